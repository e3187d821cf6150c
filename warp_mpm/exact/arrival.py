"""Arrival times of straight detonation waves from several detonators with delays.

Problem: detonators light a homogeneous explosive at the times t_i, each at a point, along a line, on a whole plane or
on the surface of a sphere; from each the wave runs in all directions (from a plane: along both normals) at the speed D,
and burns what it finds unburnt. When does the detonation reach a point, if nothing is in the way?

Equations: by Huygens's principle the first of the waves counts,

    t_b(x) = min over detonators of (t_i + d_i(x) / D),  d_i = |x - x_i|  or  |(x - x_i) . n_i| / |n_i|.

A cord burns at its own speed D_c from end to end. A point at the distance r from its straight piece, s along it, is
reached first from the place s' with

    t = t_0 + s' / D_c + sqrt(r^2 + (s - s')^2) / D,  s' = s - r / sqrt((D_c / D)^2 - 1),

the Mach cone of the cord; s' is cut to the piece, and is its start if D_c <= D.

This is the *delayed* minimum: the nearest detonator need not be the first. |grad t_b| = 1 / D but where waves meet.
A detonator that is overrun before it fires changes nothing, for then t_i > t_b(x_i).

Reference: M. L. Wilkins, Computer Simulation of Dynamic Phenomena, Springer 1999 (programmed burn); the paper,
section 2.3.
"""

from collections.abc import Sequence

import numpy as np

from warp_mpm.detonators import (
    CordDetonator,
    Detonator,
    LineDetonator,
    PlaneDetonator,
    PointDetonator,
    SphereDetonator,
    segments,
)


def detonator_distance(detonator: PointDetonator | PlaneDetonator | SphereDetonator, points: np.ndarray) -> np.ndarray:
    """Distance (n,) [m] of points (n, 3) [m] from a detonator: from its point, its plane, or its sphere's surface."""
    away = points - np.array(detonator.position)
    if isinstance(detonator, PlaneDetonator):
        return np.abs(away @ np.array(detonator.normal)) / np.linalg.norm(detonator.normal)
    distance = np.linalg.norm(away, axis=1)
    return np.abs(distance - detonator.radius) if isinstance(detonator, SphereDetonator) else distance


def straight_arrival(detonators: Sequence[Detonator], points: np.ndarray, speed: float) -> np.ndarray:
    """Arrival times (n,) [s] at points (n, 3) [m] of waves of a speed [m/s]; infinite without detonators."""
    arrival = np.full(len(points), np.inf)
    for detonator in detonators:
        if isinstance(detonator, LineDetonator | CordDetonator):
            arrival = np.minimum(arrival, _along_segments(detonator, points, speed))
        else:
            arrival = np.minimum(arrival, detonator.time + detonator_distance(detonator, points) / speed)
    return arrival


def _along_segments(detonator: LineDetonator | CordDetonator, points: np.ndarray, speed: float) -> np.ndarray:
    """Arrival times (n,) [s] at points (n, 3) [m] from all pieces of a line or a cord."""
    arrival = np.full(len(points), np.inf)
    for start, end, lit, burnt in segments(detonator):
        length = float(np.linalg.norm(end - start))
        foot = (points - start) @ (end - start) / length
        away = np.linalg.norm(points - start - np.outer(foot / length, end - start), axis=1)
        lag = (burnt - lit) * speed / length
        place = np.zeros(len(points))
        if lag < 1.0:
            place = np.clip(foot - away * lag / np.sqrt(1.0 - lag**2), 0.0, length)
        arrival = np.minimum(arrival, lit + place / length * (burnt - lit) + np.hypot(away, foot - place) / speed)
    return arrival
