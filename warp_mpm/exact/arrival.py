"""Arrival times of straight detonation waves from several detonators with delays.

Problem: detonators light a homogeneous explosive at the times t_i, each at a point or on a whole plane; from each the
wave runs in all directions (from a plane: along both normals) at the speed D, and burns what it finds unburnt. When
does the detonation reach a point, if nothing is in the way?

Equations: by Huygens's principle the first of the waves counts,

    t_b(x) = min over detonators of (t_i + d_i(x) / D),  d_i = |x - x_i|  or  |(x - x_i) . n_i| / |n_i|.

This is the *delayed* minimum: the nearest detonator need not be the first. |grad t_b| = 1 / D but where waves meet.
A detonator that is overrun before it fires changes nothing, for then t_i > t_b(x_i).

Reference: M. L. Wilkins, Computer Simulation of Dynamic Phenomena, Springer 1999 (programmed burn); the paper,
section 2.3.
"""

from collections.abc import Sequence

import numpy as np

from warp_mpm.detonators import Detonator, PlaneDetonator


def detonator_distance(detonator: Detonator, points: np.ndarray) -> np.ndarray:
    """Distances (n,) [m] of points (n, 3) [m] from a detonator: from its point, or from its plane."""
    away = points - np.array(detonator.position)
    if isinstance(detonator, PlaneDetonator):
        return np.abs(away @ np.array(detonator.normal)) / np.linalg.norm(detonator.normal)
    return np.linalg.norm(away, axis=1)


def straight_arrival(detonators: Sequence[Detonator], points: np.ndarray, speed: float) -> np.ndarray:
    """Arrival times (n,) [s] at points (n, 3) [m] of waves of a speed [m/s]; infinite without detonators."""
    arrival = np.full(len(points), np.inf)
    for detonator in detonators:
        arrival = np.minimum(arrival, detonator.time + detonator_distance(detonator, points) / speed)
    return arrival
