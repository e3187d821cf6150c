"""The planar Taylor wave from a rigid rear wall, and the plateau behind it."""

from collections.abc import Mapping

import numpy as np

from warp_mpm.builder import SceneBuilder
from warp_mpm.detonators import PlaneDetonator
from warp_mpm.exact.taylor_wave import RIGID, PlanarTaylorWave
from warp_mpm.geometry import Box
from warp_mpm.materials import ammonium_nitrate
from warp_mpm.result import Result
from warp_mpm.scene import Scene
from warp_mpm.verification.fields import computed_fields, exact_curves, field_errors, planar_curves, planar_means
from warp_mpm.verification.problem import DISTANCE, Bound, Curve, Level, Measurement, Problem, field_panels, ladder
from warp_mpm.verification.problems._taylor import (
    DENSITY,
    GAMMA,
    PLATEAU_BOUNDS,
    REFERENCE,
    SPEED,
    front_end,
    plateau_figures,
    taylor_flow,
)

RUN = 0.1  # of the front [m]
WAVE = PlanarTaylorWave(GAMMA, DENSITY, SPEED, RIGID)


class RigidTaylor(Problem):
    """A column, one cell across, lit at a slip wall."""

    name = "taylor_rigid"
    title = "Planar Taylor wave from a rigid wall"
    statement = (
        "Gamma-law explosive (gamma = 2) is lit at a rigid wall. Behind the front and its fan there is a plateau at "
        "rest, p = (3 / 4)^4 p_CJ = 0.3164 p_CJ from the wall to half the way of the front. Its inner 3/5 are judged, "
        "because the fan ends on it with a kink whose ringing belongs to the fan."
    )
    reference = REFERENCE
    cells_across = "the run"
    levels = ladder(25, 50, 100)
    more_levels = ladder(200, 400)
    panels = field_panels(DISTANCE)
    bounds = (*PLATEAU_BOUNDS, Bound("pressure_l1_order", low=0.7, why="the front is first order, the rest better"))

    def scene(self, level: Level) -> Scene:
        """A column that is a tenth longer than the run."""
        cell = RUN / level.cells
        column = Box((0.0, 0.0, 0.0), (front_end(level.cells) * cell, cell, cell))
        builder = SceneBuilder(self.name)
        builder.domain(column.lower, column.upper, cell_size=cell)
        builder.charge(column, ammonium_nitrate())
        builder.detonator(PlaneDetonator((0.0, 0.0, 0.0), normal=(1.0, 0.0, 0.0)))
        builder.end_time(RUN / SPEED)
        return builder.build()

    def measure(self, level: Level, result: Result) -> Measurement:
        """Errors of the fields, and the plateau."""
        domain, time = result.state.model.scene.domain, result.summary["end_time_s"]
        computed = computed_fields(result.state)
        return Measurement(
            errors=field_errors(computed, planar_means(WAVE, domain, time)),
            figures=plateau_figures(result, WAVE.fan_end_speed * time, 1, WAVE.plateau_pressure, WAVE.cj_pressure),
            curves=planar_curves(computed, domain),
        )

    def exact_curves(self, level: Level) -> Mapping[str, Curve]:
        """The three fields at the end."""
        return exact_curves(taylor_flow(WAVE), np.linspace(0.0, 1.1 * RUN, 1500), RUN / SPEED)


PROBLEMS = (RigidTaylor(),)
