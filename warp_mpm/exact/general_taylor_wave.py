"""The planar Taylor wave behind a Chapman-Jouguet front, for any equation of state p = a(rho) + b(rho) e.

Problem: as in `taylor_wave.py`, an explosive x > 0 is lit at x = 0, t = 0, at a rigid wall or a free face.

Equations: the front runs at D and leaves the CJ state. Behind it entropy is uniform and the flow depends on xi = x / t
alone: a simple wave, u = u_CJ + J with J = integral of c / rho from the CJ state on, xi = u + c. At a rigid wall the
fan ends where u = 0, and a plateau at rest reaches from there to the wall. Behind a free face it goes on to a vacuum;
the table ends at a density `last_density`, and what lies behind that counts as empty.

Reference: W. Fickett, W. C. Davis, Detonation: Theory and Experiment, Dover 2000, section 2C.
"""

import numpy as np

from warp_mpm.exact.chapman_jouguet import chapman_jouguet_state
from warp_mpm.exact.isentrope import isentrope
from warp_mpm.exact.similar_flow import SimilarFlow
from warp_mpm.kernels.eos import EquationOfState


def general_taylor_wave(
    eos: EquationOfState, density: float, energy: float, *, rigid: bool = True, last_density: float | None = None
) -> SimilarFlow:
    """The flow behind a plane front in an explosive of a density [kg/m3] and a specific energy E0 [J/kg].

    Args:
        eos: of the products.
        density: of the explosive.
        energy: of the explosive, all chemical.
        rigid: whether a wall is behind, or nothing.
        last_density: where the table ends [kg/m3], by default a hundredth of that at the front.
    """
    cj = chapman_jouguet_state(eos, density, energy)
    internal = energy + 0.5 * cj.pressure * (1.0 / density - 1.0 / cj.density)
    states = isentrope(eos, cj.density, internal, last_density)
    velocity = cj.particle_velocity + states.riemann
    xi = velocity + states.sound_speed
    columns = np.stack([xi, states.pressure, velocity, states.density])[:, ::-1]  # rising xi
    if rigid:
        start = np.array([np.interp(0.0, columns[2], column) for column in columns])
        start[2] = 0.0
        wall = np.array([0.0, *start[1:]])
        columns = np.column_stack([wall, start, columns[:, columns[2] > 0.0]])
    else:
        columns = np.column_stack([[columns[0, 0], 0.0, 0.0, 0.0], columns])
    front = cj.detonation_speed
    columns[0, -1] = front  # u + c there is D to round-off
    columns = np.column_stack([columns, [front, 0.0, 0.0, density]])
    return SimilarFlow(*columns)
