"""What the run hands to the outputs: plain NumPy data, in creation order, no Warp."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True)
class Surface:
    """Triangles; each turns its front, where its corners run counterclockwise, to the lower pressure."""

    points: np.ndarray  # (n, 3) float32 [m]
    triangles: np.ndarray  # (m, 3) int32, indices of points


@dataclass(frozen=True)
class Frame:
    """The state at one saved instant."""

    index: int  # 0, 1, ..., frames - 1
    time: float  # [s]
    position: np.ndarray  # (n, 3) [m], creation order; a particle that left keeps its last position
    pressure: np.ndarray  # (n,) [Pa]; 0 for a particle that left
    inside: np.ndarray  # (n,) bool; False once the particle has left through an open face
    section: np.ndarray  # (nodes_u, nodes_v) [Pa]: field pressure at the nodes of the section plane
    fields: dict[str, np.ndarray] = field(default_factory=dict)  # further particle fields, (n,) or (n, 3)
    isosurface: Surface | None = None  # where the field pressure is `Save.isosurface`


@dataclass(frozen=True)
class SectionPicture:
    """The field pressure on the section plane at an instant worth a picture."""

    time: float  # [s], the true time of the step
    pressure: np.ndarray  # (nodes_u, nodes_v) [Pa]


@dataclass(frozen=True)
class GaugeRecord:
    """What a gauge showed at every step (see `SceneBuilder.gauge`)."""

    time: np.ndarray  # (steps,) float64 [s]
    pressure: np.ndarray  # (steps,) [Pa]
    velocity: np.ndarray  # (steps, 3) [m/s]
    density: np.ndarray  # (steps,) [kg/m3]
    position: np.ndarray  # (steps, 3) [m]


@dataclass(frozen=True)
class LineRecord:
    """The field pressure along the scene's line at every step."""

    time: np.ndarray  # (steps,) float64 [s]
    distance: np.ndarray  # (points,) float64 [m] from the line's start
    expected: np.ndarray  # (points,) [s]: the arrival time there, which the burn follows; NaN where no wave comes
    pressure: np.ndarray  # (steps, points) [Pa]


@dataclass(frozen=True)
class SectionRecord:
    """What every step left on the section plane, at its nodes."""

    peak: np.ndarray  # (nodes_u, nodes_v) [Pa]: highest field pressure of all steps
    arrival: np.ndarray  # (nodes_u, nodes_v) [s]: when a front came; NaN where none has
    expected: np.ndarray  # (nodes_u, nodes_v) [s]: the arrival time, which the burn follows; NaN where no wave comes


@dataclass(frozen=True)
class StepRecord:
    """What was recorded, one row a step, the initial state first. Pressures in Pa, times in s."""

    time: np.ndarray  # (steps,) float64
    dt: np.ndarray  # (steps,)
    particle_pressure: np.ndarray  # (steps,) highest of all particles
    field_pressure: np.ndarray  # (steps,) highest of all nodes at least half filled
    path_pressure: np.ndarray | None  # (steps,) highest within a cell of the front path
    point_pressures: np.ndarray  # (steps, points) highest within two cells of each collision point
    path: LineRecord | None  # along the front path
    line: LineRecord | None  # along the scene's line
    section: SectionRecord
    gauges: Mapping[str, GaugeRecord] = field(default_factory=dict)  # by name; in gauges.csv
