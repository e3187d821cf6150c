"""A scene: what is simulated, as validated immutable data. Built by `SceneBuilder`, read by everything else.

All units are SI. Nothing here knows about Warp or about how the scene will be solved.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

import numpy as np

from warp_mpm.checks import member
from warp_mpm.detonators import Detonator
from warp_mpm.geometry import Solid
from warp_mpm.materials import Material

Vector = tuple[float, float, float]


class Wall(Enum):
    """What a face of the domain does to the material.

    SLIP is a mirror plane, STICK holds the material, OPEN lets it out (it is not a non-reflecting boundary).
    """

    SLIP = "slip"
    STICK = "stick"
    OPEN = "open"


@dataclass(frozen=True)
class Walls:
    """One wall per face of the domain: x low, x high, y low, y high, z low, z high."""

    x_low: Wall = Wall.SLIP
    x_high: Wall = Wall.SLIP
    y_low: Wall = Wall.SLIP
    y_high: Wall = Wall.SLIP
    z_low: Wall = Wall.SLIP
    z_high: Wall = Wall.SLIP

    def __post_init__(self) -> None:
        """Check the faces.

        Raises:
            InputError: one is not a `Wall`.
        """
        for name, wall in zip(FACE_NAMES, self.faces(), strict=True):
            member(f"walls: {name}", wall, Wall)

    @classmethod
    def all(cls, wall: Wall) -> "Walls":
        """The same wall on all six faces."""
        return cls(wall, wall, wall, wall, wall, wall)

    def faces(self) -> tuple[Wall, Wall, Wall, Wall, Wall, Wall]:
        """The walls in the order of `FACE_NAMES`."""
        return (self.x_low, self.x_high, self.y_low, self.y_high, self.z_low, self.z_high)


FACE_NAMES = ("x_low", "x_high", "y_low", "y_high", "z_low", "z_high")


@dataclass(frozen=True)
class Domain:
    """The box in which material may be, cut into equal cells that fit it exactly."""

    lower: Vector  # [m]
    upper: Vector  # [m]
    cells: tuple[int, int, int]

    @property
    def spacing(self) -> Vector:
        """Cell size per axis [m]."""
        x, y, z = ((b - a) / n for a, b, n in zip(self.lower, self.upper, self.cells, strict=True))
        return (x, y, z)

    def centres(self, axis: int) -> np.ndarray:
        """Coordinates of the cells' centres along an axis (cells,) [m]."""
        return self.lower[axis] + (np.arange(self.cells[axis]) + 0.5) * self.spacing[axis]

    @property
    def cell_volume(self) -> float:
        """Volume of one cell [m3]."""
        return float(np.prod(self.spacing))


@dataclass(frozen=True)
class Charge:
    """A body of one material, cut into particles of equal volume."""

    name: str
    solid: Solid
    material: Material
    positions: np.ndarray  # (n, 3) float64 [m]
    volume: float  # [m3], exact where a formula exists
    volume_tolerance: float  # relative; 0 when the volume is exact
    particles_per_axis: int = 2  # along each axis of every cell
    velocities: np.ndarray | None = None  # (n, 3) float64, initial [m/s]; None: at rest
    may_stay_unlit: bool = False  # an explosive to which no detonation needs to come

    @property
    def particle_volume(self) -> float:
        """Initial volume of each particle [m3]: the charge's volume over their number."""
        return self.volume / len(self.positions)

    @property
    def mass(self) -> float:
        """Mass of the charge [kg]."""
        return self.material.density * self.volume

    @property
    def greatest_speed(self) -> float:
        """Initial speed of its fastest particle [m/s]."""
        return 0.0 if self.velocities is None else float(np.linalg.norm(self.velocities, axis=1).max())


@dataclass(frozen=True)
class Segment:
    """A straight line from `start` to `end` [m]."""

    start: Vector
    end: Vector

    @property
    def length(self) -> float:
        """Length [m]."""
        return float(np.linalg.norm(np.subtract(self.end, self.start)))

    def points(self, count: int) -> np.ndarray:
        """`count` equally spaced points from start to end, (count, 3) [m]."""
        return np.linspace(self.start, self.end, count)


@dataclass(frozen=True)
class Gauge:
    """A point where pressure, velocity and density are recorded at every step (see `SceneBuilder.gauge`)."""

    name: str
    position: Vector  # [m]; of a moving one, the point where its particle was looked for
    moving: bool = False
    particle: int | None = None  # that a moving one is carried by, in creation order


@dataclass(frozen=True)
class SectionPlane:
    """A plane normal to an axis on which the field pressure is shown."""

    axis: int  # 0, 1, 2: the plane's normal
    coordinate: float  # [m] along that axis

    @property
    def in_plane(self) -> tuple[int, int]:
        """The two other axes, in rising order."""
        first, second = (axis for axis in range(3) if axis != self.axis)
        return first, second


@dataclass(frozen=True)
class Scene:
    """Everything that is simulated, and what to look at. Made by `SceneBuilder.build`."""

    name: str
    domain: Domain
    walls: Walls
    charges: tuple[Charge, ...]
    detonators: tuple[Detonator, ...]
    end_time: float  # [s]
    section: SectionPlane
    description: str = ""
    parameters: Mapping[str, Any] = field(default_factory=dict)  # what the scene function was called with
    gravity: Vector = (0.0, 0.0, 0.0)  # constant body force [m/s2]
    ambient_pressure: float = 0.0  # outside the open faces [Pa]
    burn_width: float | None = None  # the scene's recommendation [cells]; None: the solver's default
    front_path: Segment | None = None  # along which front pressure and speed are measured
    line: Segment | None = None  # along which pressure is recorded at every step
    collision_points: tuple[Vector, ...] = ()  # where fronts are expected to meet [m]
    picture_times: tuple[float, ...] = ()  # instants worth a picture [s]
    gauges: tuple[Gauge, ...] = ()
    warnings: tuple[str, ...] = ()

    @property
    def particle_count(self) -> int:
        """Number of particles in all charges."""
        return sum(len(charge.positions) for charge in self.charges)

    @property
    def mass(self) -> float:
        """Mass of all charges [kg]."""
        return sum(charge.mass for charge in self.charges)
