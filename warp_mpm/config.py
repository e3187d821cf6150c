"""How a scene is solved (`SolverConfig`) and when results are saved (`Save`): immutable, separate from the scene."""

from dataclasses import dataclass
from enum import Enum

from warp_mpm.checks import count, flag, member, names, positive, shortened
from warp_mpm.errors import InputError
from warp_mpm.kernels.numbers import is_number

MOST_FRAMES = 1_000_000  # of a run; each is a file for a while, and more than anyone looks at


class ShapeFunction(Enum):
    """How a particle's extent is spread over the nodes."""

    LINEAR = "linear"
    GIMP = "gimp"
    BSPLINE = "bspline"


class Order(Enum):
    """When the strain is taken in the step (Bardenhagen 2002; Nairn 2003).

    MUSL: from the particles' new velocities, re-projected before they move. USL: from the nodes' velocity at the end of
    the step. USF: from the nodes' velocity at its start, before the forces.
    """

    MUSL = "musl"
    USL = "usl"
    USF = "usf"


class Transfer(Enum):
    """How velocity goes from the grid back to the particles.

    DAMPED_FLIP removes, conservatively, the velocity that the grid cannot see; it needs the re-projection of MUSL.
    """

    DAMPED_FLIP = "damped_flip"
    FLIP = "flip"
    APIC = "apic"


@dataclass(frozen=True)
class SolverConfig:
    """How a scene is solved. One set of defaults for all problems.

    Attributes:
        shape: how a particle's extent is spread over the nodes.
        order: when the strain is taken in the step.
        transfer: how velocity goes from the grid back to the particles.
        pic_share: 0: pure FLIP, 1: pure PIC; with transfer=flip only.
        burn_width: width of the burn zone [cells]; None: the scene's, else 0.5.
        viscosity: quadratic and linear coefficient of the artificial viscosity.
        cfl: Courant number of the time step.
        reproducible: on a GPU, the same particles and fields, bit for bit, on every run, for more time.
    """

    shape: ShapeFunction = ShapeFunction.BSPLINE
    order: Order = Order.MUSL
    transfer: Transfer = Transfer.DAMPED_FLIP
    pic_share: float = 0.0
    burn_width: float | None = None
    viscosity: tuple[float, float] = (1.5, 0.06)
    cfl: float = 0.3
    reproducible: bool = False

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            InputError: a value is out of range, or two of them exclude each other.
        """
        member("solver: shape", self.shape, ShapeFunction)
        member("solver: order", self.order, Order)
        member("solver: transfer", self.transfer, Transfer)
        flag("solver: reproducible", self.reproducible)
        share_ok = is_number(self.pic_share) and 0.0 <= self.pic_share <= 1.0
        _check("pic_share", share_ok, "a share between 0 and 1", self.pic_share)
        if self.burn_width is not None:
            width_ok = is_number(self.burn_width) and self.burn_width > 0.0
            _check("burn_width", width_ok, "a positive number of cells", self.burn_width)
        _check("cfl", is_number(self.cfl) and 0.0 < self.cfl <= 1.0, "a Courant number above 0, at most 1", self.cfl)
        viscosity_ok = isinstance(self.viscosity, (tuple, list)) and len(self.viscosity) == 2
        viscosity_ok = viscosity_ok and all(is_number(c) and c >= 0.0 for c in self.viscosity)
        _check("viscosity", viscosity_ok, "two non-negative coefficients, quadratic and linear", self.viscosity)
        if self.transfer is Transfer.DAMPED_FLIP and self.order is not Order.MUSL:
            raise InputError(
                f"solver: order: expected musl with transfer=damped_flip, got {self.order.value}; "
                "the damping uses the re-projected velocity, so choose transfer=flip or transfer=apic"
            )
        if self.pic_share > 0.0 and self.transfer is not Transfer.FLIP:
            raise InputError(
                f"solver: pic_share: expected 0 with transfer={self.transfer.value}, got {self.pic_share:g}; "
                "a PIC share mixes with plain FLIP, so choose transfer=flip"
            )


class Layout(Enum):
    """How the USD file lies on the disk when the run is over.

    AUTO: one file if it is below about 1 GB, else clips. SINGLE: one file. CLIPS: one file a frame, and one that plays
    them.
    """

    AUTO = "auto"
    SINGLE = "single"
    CLIPS = "clips"


@dataclass(frozen=True)
class Save:
    """When and what to save.

    Attributes:
        frames: how many, including the first and the last.
        fields: further particle fields in the USD file: "density", "burn_fraction", "arrival_time",
            "particleVelocity".
        figures: draw the pictures at the end.
        layout: of the USD file.
        particles_every: the USD file has one particle in so many, in creation order.
        isosurface: also show where the field pressure has this value [Pa].
        usdz: also pack the USD file into a .usdz.
        checkpoint_steps: a checkpoint at least every so many steps; None: by the clock alone.
        checkpoint_minutes: and at least every so many minutes.
    """

    frames: int = 60
    fields: tuple[str, ...] = ()
    figures: bool = True
    layout: Layout = Layout.AUTO
    particles_every: int = 1
    isosurface: float | None = None
    usdz: bool = False
    checkpoint_steps: int | None = None
    checkpoint_minutes: float = 10.0

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            InputError: a value is out of range, or a field is unknown.
        """
        if count("save: frames", self.frames) < 2:
            raise InputError(f"save: frames: expected at least 2, the first and the last, got {self.frames}")
        if self.frames > MOST_FRAMES:
            raise InputError(f"save: frames: expected at most {MOST_FRAMES}, got {self.frames}")
        flag("save: figures", self.figures)
        flag("save: usdz", self.usdz)
        member("save: layout", self.layout, Layout)
        count("save: particles_every", self.particles_every)
        if self.isosurface is not None:
            positive("save: isosurface", self.isosurface)
        if self.checkpoint_steps is not None:
            count("save: checkpoint_steps", self.checkpoint_steps)
        positive("save: checkpoint_minutes", self.checkpoint_minutes)
        for name in names("save: fields", self.fields):
            if name not in PARTICLE_FIELDS:
                raise InputError(f"save: fields: expected any of {', '.join(PARTICLE_FIELDS)}, got {name!r}")


PARTICLE_FIELDS = ("density", "burn_fraction", "arrival_time", "particleVelocity")


def _check(name: str, valid: bool, expected: str, got: object) -> None:
    if not valid:
        raise InputError(f"solver: {name}: expected {expected}, got {shortened(got)}")
