"""The cylindrical and the spherical Taylor wave, in a quarter and an octant of the whole."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from warp_mpm.builder import SceneBuilder
from warp_mpm.detonators import PointDetonator
from warp_mpm.exact.diverging_taylor_wave import DivergingTaylorWave
from warp_mpm.geometry import Box
from warp_mpm.materials import ammonium_nitrate
from warp_mpm.result import Result
from warp_mpm.scene import Scene
from warp_mpm.verification.fields import computed_fields, exact_curves, field_errors, radial_curves, radial_means
from warp_mpm.verification.problem import RADIUS, Bound, Curve, Level, Measurement, Problem, field_panels, ladder
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

FRONT = 0.1  # radius of the front at the end [m]
LAYERS = 2  # of particles in each cell, along each axis


@dataclass(frozen=True)
class DivergingTaylor(Problem):
    """Slip walls through the axis or the centre make the rest of the whole its mirror image."""

    name: str
    title: str
    statement: str
    dimensions: int  # 2 cylindrical, 3 spherical
    levels: tuple[Level, ...]
    more_levels: tuple[Level, ...]

    reference = f"{REFERENCE}; Landau, Lifshitz, Fluid Mechanics, section 130"
    cells_across = "the radius"
    panels = field_panels(RADIUS)
    bounds = (*PLATEAU_BOUNDS, Bound("pressure_l1_order", low=0.7, why="the error falls, and nearly as the cell size"))

    @cached_property
    def wave(self) -> DivergingTaylorWave:
        """The exact solution."""
        return DivergingTaylorWave(self.dimensions, GAMMA, DENSITY, SPEED)

    def scene(self, level: Level) -> Scene:
        """A cube, or a slab one cell thick.

        The cylinder is lit by one point for each layer of its particles, so that all of them burn as around a line.
        """
        cell = FRONT / level.cells
        edge = front_end(level.cells) * cell
        spherical = self.dimensions == 3
        charge = Box((0.0, 0.0, 0.0), (edge, edge, edge if spherical else cell))
        builder = SceneBuilder(self.name)
        builder.domain(charge.lower, charge.upper, cell_size=cell)
        builder.charge(charge, ammonium_nitrate(), particles_per_axis=LAYERS)
        for height in [0.0] if spherical else (np.arange(LAYERS) + 0.5) / LAYERS * cell:
            builder.detonator(PointDetonator((0.0, 0.0, float(height))))
        builder.end_time(FRONT / SPEED)
        return builder.build()

    def measure(self, level: Level, result: Result) -> Measurement:
        """Errors of the fields in all cells of the grid, and the core."""
        domain, time = result.state.model.scene.domain, result.summary["end_time_s"]
        computed = computed_fields(result.state, self.dimensions)
        core = self.wave.core_speed * time
        return Measurement(
            errors=field_errors(computed, radial_means(taylor_flow(self.wave), domain, time, self.dimensions)),
            figures=plateau_figures(result, core, self.dimensions, self.wave.core_pressure, self.wave.cj_pressure),
            curves=radial_curves(computed, domain, self.dimensions),
        )

    def exact_curves(self, level: Level) -> Mapping[str, Curve]:
        """The three fields at the end."""
        return exact_curves(taylor_flow(self.wave), np.linspace(0.0, 1.1 * FRONT, 1500), FRONT / SPEED)


PROBLEMS = (
    DivergingTaylor(
        "taylor_cylindrical",
        "Cylindrical Taylor wave, a quarter one cell thick",
        "Gamma-law explosive (gamma = 2) is lit along a line. The front leaves a core at rest at 0.2718 p_CJ. Errors "
        "are over all cells of a Cartesian grid.",
        dimensions=2,
        levels=ladder(20, 40, 80),
        more_levels=ladder(160),
    ),
    DivergingTaylor(
        "taylor_spherical",
        "Spherical Taylor wave, an octant",
        "Gamma-law explosive (gamma = 2) is lit at a point. The front leaves a core at rest at 0.2476 p_CJ. Errors "
        "are over all cells of a Cartesian grid.",
        dimensions=3,
        levels=ladder(20, 40),
        more_levels=ladder(80),
    ),
)
