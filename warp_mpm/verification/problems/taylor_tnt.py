"""The planar Taylor wave in TNT, with the JWL equation of state: the shipped scene tnt_slab against its exact flow."""

from collections.abc import Mapping
from functools import cached_property

import numpy as np

from warp_mpm.exact.general_taylor_wave import general_taylor_wave
from warp_mpm.exact.similar_flow import SimilarFlow
from warp_mpm.material_library import find_material
from warp_mpm.materials import Material
from warp_mpm.result import Result
from warp_mpm.scene import Scene
from warp_mpm.scene_loading import load_scene
from warp_mpm.verification.fields import (
    ExactFlow,
    computed_fields,
    exact_curves,
    field_errors,
    planar_curves,
    planar_means,
)
from warp_mpm.verification.problem import DISTANCE, Bound, Curve, Level, Measurement, Problem, field_panels, ladder
from warp_mpm.verification.problems._taylor import PLATEAU_BOUNDS, plateau_figures

LENGTH = 0.1  # of the slab, as in the scene [m]


class TntTaylor(Problem):
    """A slab, one cell across, lit at a slip wall, until the front is at its other end."""

    name = "taylor_tnt"
    title = "Planar Taylor wave in TNT (JWL) from a rigid wall"
    statement = (
        "A slab of TNT, 100 mm thick, is lit at a rigid wall. Behind the front, at p_CJ = 21 GPa, its products expand "
        "along the isentrope of the JWL equation of state, a simple wave that is integrated numerically, down to a "
        "plateau at rest at 0.2686 p_CJ. Its inner 3/5 are judged. 'front_p_cj' is the front pressure of the run over "
        "p_CJ: the recorded peak of a programmed burn stays below, and comes nearer with the square root of the cells "
        "and faster."
    )
    reference = "W. Fickett, W. C. Davis, Detonation, section 2C; warp_mpm/exact/general_taylor_wave.py"
    cells_across = "the slab"
    levels = ladder(50, 100, 200)
    more_levels = ladder(400, 800)
    panels = field_panels(DISTANCE)
    bounds = (
        *PLATEAU_BOUNDS,
        Bound("pressure_l1", high=0.05, from_cells=100, why="1 mm cells over 100 mm"),
        Bound("pressure_l1_order", low=0.7, why="the front is first order, the rest better"),
        Bound("front_p_cj", high=1.0, why="a programmed burn does not overdrive the front"),
    )

    @cached_property
    def material(self) -> Material:
        """TNT of the library."""
        return find_material("tnt")

    @cached_property
    def flow(self) -> SimilarFlow:
        """The exact flow."""
        tnt = self.material
        return general_taylor_wave(tnt.equation_of_state, tnt.density, tnt.specific_energy)

    def scene(self, level: Level) -> Scene:
        """The shipped scene."""
        return load_scene("tnt_slab", cell_size=LENGTH / level.cells)

    def measure(self, level: Level, result: Result) -> Measurement:
        """Errors of the fields, the plateau and the front."""
        domain, time = result.state.model.scene.domain, result.summary["end_time_s"]
        computed = computed_fields(result.state)
        wall, end = self.flow.pressures[0], self.flow.xi[1]  # of the plateau
        cj_pressure = result.summary["p_cj_pa"]
        figures = plateau_figures(result, end * time, 1, wall, cj_pressure)
        front = result.summary["front_pressure_pa"]
        figures["front_p_cj"] = float("nan") if front is None else front / cj_pressure
        return Measurement(
            errors=field_errors(computed, planar_means(self.flow, domain, time)),
            figures=figures,
            curves=planar_curves(computed, domain),
        )

    def exact_curves(self, level: Level) -> Mapping[str, Curve]:
        """The three fields at the end."""
        flow = ExactFlow(self.flow.pressure, self.flow.velocity, self.flow.density)
        time = self.scene(level).end_time
        return exact_curves(flow, np.linspace(0.0, LENGTH, 1500), time)


PROBLEMS = (TntTaylor(),)
