"""A planar detonation at an angle to the grid: the front must be the same whichever way it runs."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from warp_mpm.builder import SceneBuilder
from warp_mpm.detonators import PlaneDetonator
from warp_mpm.exact.taylor_wave import PlanarTaylorWave
from warp_mpm.geometry import Box, Solid
from warp_mpm.materials import ammonium_nitrate
from warp_mpm.result import Result
from warp_mpm.scene import Scene, Wall, Walls
from warp_mpm.verification.problem import (
    DISTANCE,
    PRESSURE,
    Bound,
    Curve,
    Level,
    LevelResult,
    Measurement,
    Panel,
    Problem,
    ladder,
)
from warp_mpm.verification.problems._taylor import DENSITY, GAMMA, SPEED, front_end

CELL = 1e-3  # [m]
ANGLES = (0, 30, 45)  # [degrees]
WIDTHS_RUN = 2  # length of the run [widths of the slab]
ROOM = 4  # cells of vacuum around the slab
PAST = 5  # cells that the wave runs past the run: the smeared front peaks nearly four cells behind the ideal one
CJ_PRESSURE = PlanarTaylorWave(GAMMA, DENSITY, SPEED).cj_pressure


class Angle(Problem):
    """A slab one cell thick in a vacuum, lit all over one of its ends."""

    name = "angle"
    title = "A planar front at an angle to the grid"
    statement = (
        "A slab, one cell thick and twice as long as wide, is lit all over one end, at 0, 30 and 45 degrees to the "
        "grid. Its front is the same by symmetry. 'front_gauge_p_cj' is the median over the points of the core line, "
        "from 50 to 90 % of the run, of the highest pressure that each point saw; 'front_spread' its largest relative "
        "difference between angles. 'front_field_p_cj' is the median over steps of the highest cell around the front, "
        "which is higher where a slanting front has more cells to choose from."
    )
    reference = "symmetry"
    cells_across = "the slab"
    levels = tuple(level for angle in ANGLES for level in ladder(40, angle=angle))
    more_levels = tuple(level for angle in ANGLES for level in ladder(80, angle=angle))
    panels = (Panel("front", DISTANCE._replace(label="run of the front"), PRESSURE._replace(label="highest pressure")),)
    bounds = (Bound("front_spread", high=0.03, from_cells=40, why="front pressure differs by less than 3 %"),)

    def scene(self, level: Level) -> Scene:
        """The domain is the box around the slab, with a little room; gas that flies off it leaves."""
        run = WIDTHS_RUN * level.cells
        angle = math.radians(level.settings["angle"])
        slab = tilted_slab(front_end(run) * CELL, level.cells * CELL, CELL, angle)
        lower, upper = slab.bounds()
        below = [-ROOM + math.floor(x / CELL + 1e-9) for x in lower[:2]]
        above = [ROOM + math.ceil(x / CELL - 1e-9) for x in upper[:2]]
        direction = np.array([math.cos(angle), math.sin(angle), 0.0])
        middle = np.array([0.0, 0.0, CELL / 2])
        builder = SceneBuilder(self.name)
        builder.domain(
            (below[0] * CELL, below[1] * CELL, 0.0),
            (above[0] * CELL, above[1] * CELL, CELL),
            cells=(above[0] - below[0], above[1] - below[1], 1),
        )
        builder.walls(Walls(Wall.OPEN, Wall.OPEN, Wall.OPEN, Wall.OPEN))
        builder.charge(slab, ammonium_nitrate(), name="slab")
        builder.detonator(PlaneDetonator((0.0, 0.0, 0.0), normal=tuple(direction), charges=("slab",)))
        builder.front_path(middle, middle + run * CELL * direction)
        builder.end_time((run + PAST) * CELL / SPEED)
        return builder.build()

    def measure(self, level: Level, result: Result) -> Measurement:
        """The pressure of the front along the core line."""
        path = result.record.path
        assert path is not None
        figures = {"gauge": "front_gauge_pressure_pa", "field": "front_pressure_pa"}
        return Measurement(
            figures={f"front_{name}_p_cj": result.summary[key] / CJ_PRESSURE for name, key in figures.items()},
            curves={"front": Curve(path.distance, path.pressure.max(axis=0))},
        )

    def overall(self, results: Sequence[LevelResult]) -> Mapping[str, float]:
        """How far the fronts of the finest slabs are apart."""
        finest = max(result.level.cells for result in results)
        fronts = [r.measurement.figures["front_gauge_p_cj"] for r in results if r.level.cells == finest]
        return {"front_spread": max(fronts) / min(fronts) - 1.0}


def tilted_slab(length: float, width: float, thickness: float, angle: float) -> Solid:
    """A slab on the plane z = 0 whose rear face is centred on the z axis, turned about that axis [m, radians]."""
    return Box((0.0, -width / 2, 0.0), (length, width / 2, thickness)).rotated((0.0, 0.0, 1.0), angle)


PROBLEMS = (Angle(),)
