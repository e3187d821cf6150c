"""More particles must not make it worse: the planar Taylor wave with 1 to 4 particles along each axis of a cell."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from warp_mpm.result import Result
from warp_mpm.scene import Scene
from warp_mpm.scene_loading import load_scene
from warp_mpm.verification.fields import computed_fields, exact_curves, field_errors, planar_curves, planar_means
from warp_mpm.verification.problem import (
    DISTANCE,
    Bound,
    Curve,
    Level,
    LevelResult,
    Measurement,
    Problem,
    field_panels,
    ladder,
)
from warp_mpm.verification.problems._taylor import REFERENCE, SPEED, taylor_flow
from warp_mpm.verification.problems.taylor_planar import RUN, WAVE

COUNTS = (1, 2, 3, 4)


class ParticlesPerAxis(Problem):
    """The shipped scene taylor_wave, at the solver's burn width."""

    name = "particles_per_axis"
    title = "Planar Taylor wave with ever more particles"
    statement = (
        "The problem taylor_planar with 1, 2, 3 and 4 particles along each axis of a cell. The original Material Point "
        "Method gets worse with more of them, because each step over a cell's face makes noise. 'pressure_growth' is "
        "the largest relative change of the pressure's L1 error from one count to the next at the same cell size."
    )
    reference = REFERENCE
    cells_across = "the run"
    levels = tuple(level for count in COUNTS for level in ladder(100, particles_per_axis=count))
    more_levels = tuple(level for count in COUNTS for level in ladder(200, 400, particles_per_axis=count))
    panels = field_panels(DISTANCE)
    bounds = (Bound("pressure_growth", high=0.0, why="errors do not grow with more particles"),)

    def scene(self, level: Level) -> Scene:
        """One cell across."""
        count = int(level.settings["particles_per_axis"])
        scene = load_scene("taylor_wave", cell_size=RUN / level.cells, particles_per_axis=count)
        return replace(scene, burn_width=None)

    def measure(self, level: Level, result: Result) -> Measurement:
        """Errors of the fields."""
        domain, time = result.state.model.scene.domain, result.summary["end_time_s"]
        computed = computed_fields(result.state)
        exact = planar_means(WAVE, domain, time)
        return Measurement(field_errors(computed, exact), curves=planar_curves(computed, domain))

    def exact_curves(self, level: Level) -> Mapping[str, Curve]:
        """The three fields at the end."""
        return exact_curves(taylor_flow(WAVE), np.linspace(-RUN, 1.1 * RUN, 1500), RUN / SPEED)

    def overall(self, results: Sequence[LevelResult]) -> Mapping[str, float]:
        """The largest growth of each error from one number of particles to the next."""
        by_level = {(r.level.cells, r.level.settings["particles_per_axis"]): r.measurement.errors for r in results}
        figures: dict[str, float] = {}
        for (cells, count), errors in by_level.items():
            for name, error in by_level.get((cells, count - 1), {}).items():
                growth = errors[name].l1 / error.l1 - 1.0
                figures[f"{name}_growth"] = max(growth, figures.get(f"{name}_growth", growth))
        return figures


PROBLEMS = (ParticlesPerAxis(),)
