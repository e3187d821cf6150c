"""Shock tubes with detonation products: TNT's against thinner ones of their own, and against water."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np

from warp_mpm.builder import SceneBuilder
from warp_mpm.exact.general_riemann import GeneralRiemannProblem, MatterState
from warp_mpm.geometry import Box
from warp_mpm.material_library import find_material, water
from warp_mpm.materials import Material
from warp_mpm.result import Result
from warp_mpm.scene import Scene
from warp_mpm.verification.fields import (
    FIELD_NAMES,
    ExactFlow,
    computed_fields,
    exact_curves,
    field_errors,
    planar_curves,
    planar_means,
)
from warp_mpm.verification.problem import DISTANCE, Bound, Curve, Level, Measurement, Problem, field_panels, ladder

LENGTH = 0.1  # of the tube; its halves meet in the middle [m]
TIME = 10e-6  # at which it is compared: waves have not reached the ends [s]


def _products() -> Material:
    """TNT that has burnt without expanding: 8.4 GPa."""
    tnt = find_material("tnt")
    return Material("products", tnt.density, tnt.equation_of_state, tnt.specific_energy)


def _thin_products() -> Material:
    """Products of TNT that have expanded fourfold, and are colder: 0.24 GPa."""
    return Material("thin products", 400.0, find_material("tnt").equation_of_state, 1.5e6)


@dataclass(frozen=True)
class ProductsTube(Problem):
    """Products of TNT on the left, at rest, and another material on the right; one cell across between slip walls."""

    name: str
    title: str
    other: Callable[[], Material]
    statement: str

    reference = "P. Colella, H. M. Glaz, J. Comput. Phys. 59 (1985) 264; warp_mpm/exact/general_riemann.py"
    cells_across = "the tube"
    levels = ladder(100, 200)
    more_levels = ladder(400)
    panels = field_panels(DISTANCE)
    bounds = tuple(
        Bound(f"{name}_l1", high=0.05, from_cells=200, why="200 cells resolve it to 5 %") for name in FIELD_NAMES
    )

    def scene(self, level: Level) -> Scene:
        """The two halves."""
        edge = LENGTH / level.cells
        builder = SceneBuilder(self.name)
        builder.domain((0.0, 0.0, 0.0), (LENGTH, edge, edge), cells=(level.cells, 1, 1))
        middle = LENGTH / 2
        builder.charge(Box((0.0, 0.0, 0.0), (middle, edge, edge)), _products(), name="left")
        builder.charge(Box((middle, 0.0, 0.0), (LENGTH, edge, edge)), self.other(), name="right")
        builder.end_time(TIME)
        return builder.build()

    def measure(self, level: Level, result: Result) -> Measurement:
        """Errors of the three fields."""
        domain = result.state.model.scene.domain
        computed = computed_fields(result.state)
        exact = planar_means(_flow(self.other).flow, domain, TIME)
        return Measurement(field_errors(computed, exact), curves=planar_curves(computed, domain))

    def exact_curves(self, level: Level) -> Mapping[str, Curve]:
        """The exact fields."""
        flow = _flow(self.other).flow
        fields = ExactFlow(flow.pressure, flow.velocity, flow.density)
        return exact_curves(fields, np.linspace(0.0, LENGTH, 1500), TIME)


@cache
def _flow(other: Callable[[], Material]) -> GeneralRiemannProblem:
    """The exact flow."""
    left, right = (
        MatterState(matter.equation_of_state, matter.density, 0.0, matter.specific_energy)
        for matter in (_products(), other())
    )
    return GeneralRiemannProblem(left, right, LENGTH / 2)


PROBLEMS = (
    ProductsTube(
        "jwl_tube",
        "Shock tube with products of TNT (JWL)",
        _thin_products,
        "Products of TNT at the density of the explosive, 8.4 GPa, are let go against products of 400 kg/m3 and "
        "0.24 GPa. A shock runs into these, a fan into the others; the flow is that of the Riemann problem with the "
        "JWL equation of state, by the Hugoniot and the integrated isentrope.",
    ),
    ProductsTube(
        "water_tube",
        "Shock tube with products of TNT (JWL) against water (stiffened gas)",
        water,
        "Products of TNT at the density of the explosive, 8.4 GPa, are let go against water. A shock of 3.4 GPa runs "
        "into the water, a fan into the products; the flow is that of the Riemann problem with both materials.",
    ),
)
