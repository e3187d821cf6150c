"""The planar Taylor wave behind a free rear face: the shipped scene taylor_wave, at two widths of the burn zone."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from warp_mpm.exact.burn_zone import BurnZone
from warp_mpm.exact.taylor_wave import PlanarTaylorWave
from warp_mpm.result import Result
from warp_mpm.scene import Scene
from warp_mpm.scene_loading import load_scene
from warp_mpm.verification.fields import computed_fields, exact_curves, field_errors, planar_curves, planar_means
from warp_mpm.verification.problem import DISTANCE, Bound, Curve, Level, Measurement, Problem, field_panels, ladder
from warp_mpm.verification.problems._taylor import DENSITY, GAMMA, REFERENCE, SPEED, taylor_flow

RUN = 0.3  # [m], as in the scene
WAVE = PlanarTaylorWave(GAMMA, DENSITY, SPEED)
CUBES = ladder(100, 200, 400)  # 3, 1.5 and 0.75 mm


@dataclass(frozen=True)
class PlanarTaylor(Problem):
    """One width of the burn zone."""

    name: str
    title: str
    burn_width: float | None  # that the scene recommends [cells]; None: the solver's default
    bounds: tuple[Bound, ...]

    statement = (
        "A half-space of gamma-law explosive (gamma = 2) is lit all over its free rear face. After a run of 300 mm the "
        "front has a Taylor wave behind it, p = p_CJ ((x / D t + 1) / 2)^4, down to vacuum at x = -D t. "
        "'zone_floor' is the L1 error of the pressure that the width of the burn zone alone must cause."
    )
    reference = REFERENCE
    cells_across = "the run"
    levels = CUBES
    more_levels = ladder(800)
    panels = field_panels(DISTANCE)

    def scene(self, level: Level) -> Scene:
        """The shipped scene, one cell across."""
        return replace(load_scene("taylor_wave", cell_size=RUN / level.cells), burn_width=self.burn_width)

    def measure(self, level: Level, result: Result) -> Measurement:
        """Errors of the fields, and what the burn zone's width costs by itself."""
        domain, time = result.state.model.scene.domain, result.summary["end_time_s"]
        computed = computed_fields(result.state)
        zone = BurnZone(GAMMA, DENSITY, SPEED, width=result.state.model.burn_width * domain.spacing[0])
        return Measurement(
            errors=field_errors(computed, planar_means(WAVE, domain, time)),
            figures={"zone_floor": zone.pressure_error(RUN)},
            curves=planar_curves(computed, domain),
        )

    def exact_curves(self, level: Level) -> Mapping[str, Curve]:
        """The three fields at the end."""
        return exact_curves(taylor_flow(WAVE), np.linspace(-RUN, 1.1 * RUN, 1500), RUN / SPEED)


PROBLEMS = (
    PlanarTaylor(
        "taylor_planar",
        "Planar Taylor wave, free rear face",
        burn_width=None,
        bounds=(
            Bound("pressure_l1", high=0.05, from_cells=100, why="3 mm cells over 300 mm", aim=True),
            Bound("pressure_l1", high=0.03, from_cells=200, why="1.5 mm", aim=True),
            Bound("pressure_l1", high=0.02, from_cells=400, why="0.75 mm", aim=True),
            Bound("pressure_l1_order", low=0.9, from_cells=200, why="a front of fixed width is first order", aim=True),
        ),
    ),
    PlanarTaylor(
        "taylor_planar_paper",
        "Planar Taylor wave, free rear face, the paper's burn width of 3 cells",
        burn_width=3.0,
        bounds=(
            Bound("pressure_l1", high=0.10, from_cells=100, why="3 mm cells over 300 mm; the zone's floor is 0.045"),
            Bound("pressure_l1", high=0.066, from_cells=200, why="1.5 mm; the zone's floor is 0.023"),
            Bound("pressure_l1", high=0.044, from_cells=400, why="0.75 mm; the zone's floor is 0.012"),
        ),
    ),
)
