"""The model: what stays constant while a scene is solved, as the kernels take it."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from warp_mpm.config import Order, ShapeFunction, SolverConfig, Transfer
from warp_mpm.kernels import shape, strain, walls
from warp_mpm.kernels.motion import Faces
from warp_mpm.kernels.order import Slabs
from warp_mpm.kernels.precision import vector3
from warp_mpm.kernels.viscosity import Viscosity
from warp_mpm.materials import Material
from warp_mpm.scene import Charge, Scene, Wall

DEFAULT_BURN_WIDTH = 0.5  # [cells]; narrower gains nothing, the front is then as wide as the grid makes it
# Two slabs of one parity have a whole one between them: particles drift towards each other from both, and their
# stencils reach two nodes up and one down, and one more where rows are written four at a time (`kernels/stencil.py`).
# So with 1.6 cells of a half slab set aside, no node is written to from both (tests/test_slabs.py counts).
SET_ASIDE = 1.6  # cells
LARGEST_DRIFT = 3.0  # cells that a particle may move between two sortings; more is never needed
SLAB = 10  # cells: thick enough for that
THINNEST_SLAB = 6  # cells: of small domains, whose particles are sorted more often
FEWEST_SLABS = 4  # two and two: with fewer there is nothing to share

WALL_CODES = {Wall.OPEN: walls.WALL_OPEN, Wall.SLIP: walls.WALL_SLIP, Wall.STICK: walls.WALL_STICK}
SHAPES = {
    ShapeFunction.LINEAR: shape.LINEAR,
    ShapeFunction.GIMP: shape.GIMP,
    ShapeFunction.BSPLINE: shape.BSPLINE,
}
STRAINS = {
    Order.MUSL: strain.Strain.REPROJECTED,
    Order.USL: strain.Strain.END,
    Order.USF: strain.Strain.START,
}


@dataclass(frozen=True)
class ChargeModel:
    """A charge, as the kernels take it."""

    material: Material
    eos_record: Any
    burn_record: Any  # 0 for inert matter
    unreacted_record: Any  # 0 where unburnt matter has no pressure
    half_width: float  # of a particle [cells]

    @property
    def eos_class(self) -> type:
        """Class of the equation of state: kernels are composed for it, not for its parameters."""
        return type(self.material.equation_of_state)

    @property
    def burn_class(self) -> type | None:
        """Class of the burn law, None for inert matter."""
        return None if self.material.burn is None else type(self.material.burn)

    @property
    def unreacted_class(self) -> type | None:
        """Class of the unreacted equation of state, None where unburnt matter has no pressure."""
        return None if self.material.unreacted is None else type(self.material.unreacted)

    @property
    def classes(self) -> tuple[type, type | None, type | None]:
        """What the material's kernels are composed of."""
        return self.eos_class, self.burn_class, self.unreacted_class

    @property
    def records(self) -> tuple[Any, ...]:
        """The parameters that these kernels take."""
        return self.eos_record, self.burn_record, self.unreacted_record, self.material.specific_energy


@dataclass(frozen=True)
class Model:
    """Everything constant."""

    scene: Scene
    config: SolverConfig
    device: wp.Device
    burn_width: float  # [cells]
    shape: shape.Shape
    charges: tuple[ChargeModel, ...]
    boundary: walls.Boundary
    faces: Faces
    viscosity: Viscosity
    slabs: Slabs
    ordered: bool  # whether nodes sum in a fixed order what particles give; on a CPU the scatter's is fixed too

    @property
    def spacing(self) -> np.ndarray:
        """Cell size per axis (3,) [m]."""
        return np.array(self.scene.domain.spacing)

    @property
    def pic_share(self) -> float:
        """Share of the grid's velocity that particles take over."""
        return 1.0 if self.config.transfer is Transfer.APIC else self.config.pic_share

    @property
    def ambient_pressure(self) -> float:
        """Pressure outside the open faces [Pa]; none without such a face."""
        return self.scene.ambient_pressure if Wall.OPEN in self.scene.walls.faces() else 0.0

    @property
    def has_walls(self) -> bool:
        """Whether any face of the domain is a wall."""
        return any(wall is not Wall.OPEN for wall in self.scene.walls.faces())

    @property
    def damped(self) -> bool:
        """Whether the conservative damping acts."""
        return self.config.transfer is Transfer.DAMPED_FLIP

    @property
    def sharpened(self) -> bool:
        """Whether the smoothing of the transfer is taken back; linear shape functions are too rough for that."""
        return self.damped and self.shape.spread > 0.0

    @property
    def affine(self) -> bool:
        """Whether particles carry a velocity gradient."""
        return self.config.transfer is Transfer.APIC

    @property
    def slab_count(self) -> int:
        """Number of slabs that the particles are sorted into; a CPU's threads work on slabs."""
        return int(self.slabs.count)

    @property
    def largest_drift(self) -> float:
        """Cells that a particle may move between two sortings."""
        return largest_drift(int(self.slabs.cells), self.slab_count)

    @property
    def burns(self) -> bool:
        """Whether any charge is an explosive."""
        return any(charge.material.burn is not None for charge in self.charges)


def build_model(scene: Scene, config: SolverConfig, device: wp.Device) -> Model:
    """The model of a scene, solved as `config` says, on a device."""
    burn_width = config.burn_width or scene.burn_width or DEFAULT_BURN_WIDTH
    cells = np.array(scene.domain.cells)
    slabs = Slabs()
    slabs.axis = int(np.argmax(cells))
    longest = int(cells[slabs.axis])
    slabs.count = 1 if device.is_cuda else slab_count(longest)
    slabs.cells = longest
    slabs.charges = len(scene.charges)
    return Model(
        scene=scene,
        config=config,
        device=device,
        burn_width=burn_width,
        shape=SHAPES[config.shape],
        charges=tuple(_charge_model(scene, charge, burn_width) for charge in scene.charges),
        boundary=_boundary(scene),
        faces=_faces(scene),
        viscosity=_viscosity(scene, config),
        slabs=slabs,
        ordered=config.reproducible and device.is_cuda,
    )


def slab_count(cells: int) -> int:
    """Number of slabs for so many cells along an axis: even, so that as many run first as second; or one."""
    if cells < FEWEST_SLABS * THINNEST_SLAB:
        return 1
    return max(FEWEST_SLABS, cells // SLAB // 2 * 2)


def largest_drift(cells: int, slabs: int) -> float:
    """Cells that a particle may move between two sortings into slabs of so many cells in all."""
    thinnest = cells // slabs
    return min(LARGEST_DRIFT, thinnest // 2 - SET_ASIDE) if slabs > 1 else LARGEST_DRIFT


def _charge_model(scene: Scene, charge: Charge, burn_width: float) -> ChargeModel:
    burn, unreacted = charge.material.burn, charge.material.unreacted
    spacing = max(scene.domain.spacing)
    return ChargeModel(
        material=charge.material,
        eos_record=charge.material.equation_of_state.record(),
        burn_record=0 if burn is None else burn.record(burn_width, spacing),
        unreacted_record=0 if unreacted is None else unreacted.record(),
        half_width=0.5 / charge.particles_per_axis,
    )


def _boundary(scene: Scene) -> walls.Boundary:
    boundary = walls.Boundary()
    for face, wall in enumerate(scene.walls.faces()):
        boundary.wall[face] = int(WALL_CODES[wall])
    boundary.gravity = vector3(*scene.gravity)
    return boundary


def _faces(scene: Scene) -> Faces:
    faces = Faces()
    for face, wall in enumerate(scene.walls.faces()):
        faces.open[face] = int(wall is Wall.OPEN)
    return faces


def _viscosity(scene: Scene, config: SolverConfig) -> Viscosity:
    viscosity = Viscosity()
    viscosity.quadratic, viscosity.linear = config.viscosity
    viscosity.length = scene.domain.cell_volume ** (1 / 3)
    viscosity.inverse_length = 1.0 / viscosity.length
    viscosity.inverse_spacing = vector3(*(1.0 / size for size in scene.domain.spacing))
    return viscosity
