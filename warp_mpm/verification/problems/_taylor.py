"""What the problems with Taylor waves share: the paper's explosive, its exact flows, and the noise on a plateau."""

import math

import numpy as np

from warp_mpm.exact.diverging_taylor_wave import DivergingTaylorWave
from warp_mpm.exact.taylor_wave import PlanarTaylorWave
from warp_mpm.result import Result
from warp_mpm.verification.fields import ExactFlow, cell_pressure, cell_radii, radius_of
from warp_mpm.verification.norms import mean_and_scatter
from warp_mpm.verification.problem import Bound

GAMMA, DENSITY, SPEED = 2.0, 1000.0, 2800.0  # of `warp_mpm.materials.ammonium_nitrate` [1, kg/m3, m/s]
REFERENCE = "G. I. Taylor, Proc. R. Soc. A 200 (1950) 235; exact solution in warp_mpm/exact/"
INNER = 0.6  # share of a plateau that is judged

# The fan ends on the plateau with a kink, and what rings there for a few cells belongs to the fan: an inner part of the
# plateau, the same at every resolution, says what the plateau itself is like. The whole one is reported beside it.


def taylor_flow(wave: PlanarTaylorWave | DivergingTaylorWave) -> ExactFlow:
    """The flow of a Taylor wave, with the unburnt explosive ahead of its front."""

    def density(position: np.ndarray, time: float) -> np.ndarray:
        burnt = np.asarray(position) <= wave.detonation_speed * time
        return np.where(burnt, wave.products_density(position, time), wave.density)

    return ExactFlow(wave.pressure, wave.velocity, density)


def plateau_figures(
    result: Result, radius: float, dimensions: int, exact_pressure: float, cj_pressure: float
) -> dict[str, float]:
    """How good a plateau is that reaches from 0 to `radius` [m]: its mean, and the scatter of cells and of particles.

    The mean over p_CJ, and how far it is from the exact one, relatively. Scatter: root mean square distance from the
    mean, over the mean. "whole_" is of all of the plateau, the others of its inner part.
    """
    state = result.state
    near = cell_radii(state.model.scene.domain, dimensions)
    pressure = cell_pressure(state)
    inside = state.field("mass") > 0.0
    place = radius_of(state.positions()[inside].astype(np.float64), dimensions)
    particle_pressure = state.field("pressure")[inside].astype(np.float64)
    figures = {}
    for name, reach in (("plateau", INNER * radius), ("whole_plateau", radius)):
        mean, scatter = mean_and_scatter(pressure[near <= reach])
        figures[f"{name}_p_cj"] = mean / cj_pressure
        figures[f"{name}_deviation"] = mean / exact_pressure - 1.0
        figures[f"{name}_scatter"] = scatter
        figures[f"{name}_particle_scatter"] = mean_and_scatter(particle_pressure[place <= reach])[1]
    return figures


PLATEAU_BOUNDS = (
    Bound("plateau_deviation", low=-0.02, high=0.02, from_cells=40, why="mean pressure within 2 % of exact"),
    Bound("plateau_scatter", high=0.01, from_cells=40, why="a quiet field: cells differ by 1 %"),
    Bound("plateau_particle_scatter", high=0.03, from_cells=40, why="and particles by 3 %"),
)


def front_end(cells: int) -> int:
    """Cells that a charge needs for a front to run through `cells` of them: a tenth more lies ahead, unburnt."""
    return math.ceil(1.1 * cells) + 1
