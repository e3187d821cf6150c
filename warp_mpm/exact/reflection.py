"""Head-on collision of two plane Chapman-Jouguet fronts, at the instant of contact, for any equation of state.

Problem: two fronts of the same explosive meet, or one meets a rigid wall. What is the pressure there at first?

Equations: the products, which move with u_CJ, come to rest behind a shock. Their Hugoniot about the CJ state gives p(v)
(`chapman_jouguet.hugoniot_pressure`), the jump of momentum (p - p_CJ) (v_CJ - v) = u_CJ^2 the density.

For an ideal gas p / p_CJ = (5 gamma + 1 + sqrt(17 gamma^2 + 2 gamma + 1)) / (4 gamma).

Reference: W. Fickett, W. C. Davis, Detonation: Theory and Experiment, Dover 2000, section 2.
"""

from warp_mpm.exact.chapman_jouguet import chapman_jouguet_state, hugoniot_pressure
from warp_mpm.kernels.eos import EquationOfState

BISECTIONS = 60
LARGEST_COMPRESSION = 100.0  # of the CJ density; beyond it the Hugoniot has its pole, for every law here


def collision_pressure(eos: EquationOfState, initial_density: float, energy: float) -> float:
    """Pressure [Pa] where two CJ fronts meet in an explosive of a density [kg/m3] and specific energy E0 [J/kg]."""
    cj = chapman_jouguet_state(eos, initial_density, energy)
    internal = energy + 0.5 * cj.pressure * (1.0 / initial_density - 1.0 / cj.density)

    def pressure(density: float) -> float:
        return hugoniot_pressure(eos, cj.density, internal, density, cj.pressure)

    low, high = cj.density, LARGEST_COMPRESSION * cj.density
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        stopped = (pressure(middle) - cj.pressure) * (1.0 / cj.density - 1.0 / middle)
        low, high = (middle, high) if stopped < cj.particle_velocity**2 else (low, middle)
    return pressure(0.5 * (low + high))
