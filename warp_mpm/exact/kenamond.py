"""Kenamond's three problems: when does a programmed burn light an explosive?

They test the geometry of arrival times alone: waves of constant speed from point detonators, by Huygens's principle and
Fermat's, |grad t_b| = 1 / D. In two dimensions "sphere" means cylinder, and nothing depends on z.

**Problem 1**, in sight of one detonator. An infinite explosive is lit at x_d at the time t_d:

    t(x) = t_d + |x - x_d| / D.

**Problem 2**, several detonators and two explosives. A sphere of radius R around the origin, of an explosive with the
speed D_1, lies in an infinite one with D_2 < D_1. One detonator is at the origin, others outside of the sphere, so late
that the wave of the first has left the sphere before it meets theirs. It leaves along radii, so that nothing bends it:

    t_o(x) = t_o + |x| / D_1                           inside,
    t_o(x) = t_o + R / D_1 + (|x| - R) / D_2           outside,
    t(x)   = min(t_o(x), min_i (t_i + |x - x_i| / D_2)),

the second terms where x is outside; inside they are later, if each t_i >= t_o + R / D_1 + (R - |x_i|) / D_2.

**Problem 3**, the shadow. An inert sphere of radius R around the origin lies in an infinite explosive lit at x_d, at
the distance d from its centre. Where the straight way is blocked the shortest one is a taut string: a tangent from x_d,
an arc of a great circle, and a tangent to x at the distance r:

    t(x) = t_d + (sqrt(d^2 - R^2) + R theta + sqrt(r^2 - R^2)) / D,
    theta = alpha - arccos(R / d) - arccos(R / r) > 0,

alpha the angle between x and x_d seen from the origin; where theta <= 0 x is in sight. t and its gradient are
continuous across the shadow's edge theta = 0. Behind the sphere waves from all sides (in two dimensions from both) meet
on the line alpha = pi.

References: M. A. Kenamond, HE burn table verification problems, Los Alamos report LA-UR-11-03096 (2011); the report's
formulas are quoted in the documentation of ExactPack (Los Alamos National Laboratory), `exactpack.solvers.kenamond`.
The derivations above are elementary.
"""

from collections.abc import Sequence

import numpy as np

from warp_mpm.detonators import PointDetonator
from warp_mpm.exact.arrival import straight_arrival


def one_point(points: np.ndarray, detonator: PointDetonator, speed: float) -> np.ndarray:
    """Problem 1: arrival times (n,) [s] at points (n, 3) [m] in an explosive of a speed D [m/s]."""
    return straight_arrival([detonator], points, speed)


def two_explosives(
    points: np.ndarray,
    *,
    radius: float,
    inner_speed: float,
    outer_speed: float,
    central_time: float,
    others: Sequence[PointDetonator],
    cylinder: bool = False,
) -> np.ndarray:
    """Problem 2: arrival times (n,) [s] at points (n, 3) [m].

    Args:
        points: where.
        radius: of the inner explosive [m].
        inner_speed: D_1 [m/s].
        outer_speed: D_2, at most D_1 [m/s].
        central_time: when the detonator at the origin is lit [s].
        others: detonators outside of the inner explosive.
        cylinder: the two-dimensional problem; z and the detonators' z do not count.

    Raises:
        ValueError: D_2 is above D_1, or another detonator lies in the inner explosive or is lit too early.
    """
    if outer_speed > inner_speed:
        raise ValueError(f"outer_speed: expected at most inner_speed, {inner_speed:g} m/s, got {outer_speed:g}")
    left = central_time + radius / inner_speed
    for detonator in others:
        distance = _radius_of(np.array([detonator.position]), cylinder)[0]
        earliest = left + (radius - distance) / outer_speed
        if distance <= radius or detonator.time < earliest:
            expected = f"outside of the inner explosive and not before {earliest:g} s"
            raise ValueError(f"others: expected {expected}, got {detonator}")
    distance = _radius_of(points, cylinder)
    inside = distance <= radius
    time = np.where(inside, central_time + distance / inner_speed, left + (distance - radius) / outer_speed)
    for detonator in others:
        straight = detonator.time + _radius_of(points - np.array(detonator.position), cylinder) / outer_speed
        time = np.where(inside, time, np.minimum(time, straight))
    return time


def inert_sphere(
    points: np.ndarray, *, radius: float, detonator: PointDetonator, speed: float, cylinder: bool = False
) -> np.ndarray:
    """Problem 3: arrival times (n,) [s] at points (n, 3) [m]; NaN inside the inert sphere.

    Args:
        points: where.
        radius: of the inert sphere [m].
        detonator: outside of it.
        speed: D [m/s].
        cylinder: the two-dimensional problem; z and the detonator's z do not count.

    Raises:
        ValueError: the detonator is inside the sphere.
    """
    place = np.array([detonator.position])
    far, distance = _radius_of(place, cylinder), _radius_of(points, cylinder)
    if far[0] <= radius:
        raise ValueError(f"detonator: expected outside of the sphere of {radius:g} m, got {detonator}")
    arc = shadow_angle(points, radius=radius, detonator=detonator, cylinder=cylinder)
    outside = np.maximum(distance, radius)
    around = np.sqrt(far**2 - radius**2) + radius * arc + np.sqrt(outside**2 - radius**2)
    length = np.where(arc > 0.0, around, _radius_of(points - place, cylinder))
    return np.where(distance >= radius, detonator.time + length / speed, np.nan)


def shadow_angle(points: np.ndarray, *, radius: float, detonator: PointDetonator, cylinder: bool = False) -> np.ndarray:
    """Angle theta (n,) of the arc in problem 3 [rad]; at most 0 in sight of the detonator, NaN inside the sphere."""
    place = np.array([detonator.position])
    far, distance = float(_radius_of(place, cylinder)[0]), _radius_of(points, cylinder)
    with np.errstate(invalid="ignore", divide="ignore"):
        cosine = (points[:, :2] @ place[0, :2] if cylinder else points @ place[0]) / (distance * far)
        return np.arccos(np.clip(cosine, -1.0, 1.0)) - np.arccos(radius / far) - np.arccos(radius / distance)


def _radius_of(points: np.ndarray, cylinder: bool) -> np.ndarray:
    """Distances (n,) of points (n, 3) from the origin, or from the z axis [m]."""
    return np.linalg.norm(points[:, :2] if cylinder else points, axis=1)
