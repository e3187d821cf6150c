"""A front on its way through many cells: it may come near the Chapman-Jouguet pressure, and never grow above it."""

from collections.abc import Mapping

import numpy as np

from warp_mpm.builder import SceneBuilder
from warp_mpm.detonators import PlaneDetonator
from warp_mpm.exact.taylor_wave import PlanarTaylorWave
from warp_mpm.geometry import Box
from warp_mpm.materials import ammonium_nitrate
from warp_mpm.result import Result
from warp_mpm.scene import Scene, Wall, Walls
from warp_mpm.verification.problem import DISTANCE, PRESSURE, Bound, Curve, Level, Measurement, Panel, Problem, ladder
from warp_mpm.verification.problems._taylor import DENSITY, GAMMA, SPEED, front_end

CELL = 1e-3  # [m]; a longer run is a finer one
CJ_PRESSURE = PlanarTaylorWave(GAMMA, DENSITY, SPEED).cj_pressure
SPANS = 16  # into which the run is divided; the highest pressure in each is the front's there


class LongRun(Problem):
    """A column with a free rear face."""

    name = "long_run"
    title = "A planar front after 800 cells"
    statement = (
        "The steady front of a programmed burn has p_CJ behind it. On the way the Taylor wave cuts into its smeared "
        "peak, ever less: the peak rises towards p_CJ. Artificial viscosity in the burning front can overdrive it "
        "instead, and then it grows. 'front_max_p_cj' is the highest field pressure of all steps, 'front_growth' the "
        "relative change of the front's pressure from the third to the last quarter of the run."
    )
    reference = "warp_mpm/exact/burn_zone.py"
    cells_across = "the run"
    levels = ladder(800)
    more_levels = ladder(1600)
    panels = (Panel("front", DISTANCE._replace(label="run of the front"), PRESSURE._replace(label="front pressure")),)
    bounds = (
        Bound("front_max_p_cj", high=1.01, why="never overdriven"),
        Bound("front_growth", high=0.01, from_cells=800, why="a rise towards p_CJ, not growth beyond it"),
    )

    def scene(self, level: Level) -> Scene:
        """One cell across."""
        run, end = level.cells * CELL, front_end(level.cells) * CELL
        builder = SceneBuilder(self.name)
        builder.domain((0.0, 0.0, 0.0), (end, CELL, CELL), cell_size=CELL, margins=(run, 0.0, 0.0, 0.0, 0.0, 0.0))
        builder.walls(Walls(x_low=Wall.OPEN))
        builder.charge(Box((0.0, 0.0, 0.0), (end, CELL, CELL)), ammonium_nitrate())
        builder.detonator(PlaneDetonator((0.0, 0.0, 0.0), normal=(1.0, 0.0, 0.0)))
        builder.end_time(run / SPEED)
        return builder.build()

    def measure(self, level: Level, result: Result) -> Measurement:
        """The highest field pressure in each part of the run."""
        record, run = result.record, level.cells * CELL
        edges = np.linspace(0.0, run / SPEED, SPANS + 1)
        span = np.clip(np.searchsorted(edges, record.time) - 1, 0, SPANS - 1)
        front = np.array([record.field_pressure[span == number].max(initial=0.0) for number in range(SPANS)])
        quarters = front.reshape(4, -1).mean(axis=1)
        return Measurement(
            figures={
                "front_max_p_cj": float(record.field_pressure.max()) / CJ_PRESSURE,
                "front_p_cj": float(front[-1]) / CJ_PRESSURE,
                "front_growth": float(quarters[3] / quarters[2]) - 1.0,
                "particle_max_p_cj": float(record.particle_pressure.max()) / CJ_PRESSURE,
            },
            curves={"front": Curve(SPEED * 0.5 * (edges[1:] + edges[:-1]), front)},
        )

    def exact_curves(self, level: Level) -> Mapping[str, Curve]:
        """p_CJ."""
        return {"front": Curve(np.array([0.0, level.cells * CELL]), np.full(2, CJ_PRESSURE))}


PROBLEMS = (LongRun(),)
