"""Where and when the detonation starts: points, lines, planes, spheres' surfaces, detonating cords, and patterns."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from warp_mpm import checks
from warp_mpm.checks import mistake

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class PointDetonator:
    """Lights the charge it lies in, or the named charges, at one point.

    Attributes:
        position: where [m].
        time: of ignition [s].
        charges: names of the charges it lights; none: the charge it lies in.
        booster: whether particles within one cell burn at once.
    """

    position: Vector
    time: float = 0.0
    charges: tuple[str, ...] = ()
    booster: bool = True


@dataclass(frozen=True)
class PlaneDetonator:
    """Lights a whole plane at once: the wave runs along +normal and -normal. For one-dimensional waves.

    Attributes:
        position: a point of the plane [m].
        normal: of any length.
        time: of ignition [s].
        charges: names of the charges it lights; none: every charge the plane cuts or touches.
    """

    position: Vector
    normal: Vector
    time: float = 0.0
    charges: tuple[str, ...] = ()


@dataclass(frozen=True)
class LineDetonator:
    """Lights a straight line at once.

    Attributes:
        start: one end [m].
        end: the other [m].
        time: of ignition [s].
        charges: names of the charges it lights; none: every charge it runs through or along.
    """

    start: Vector
    end: Vector
    time: float = 0.0
    charges: tuple[str, ...] = ()

    @property
    def position(self) -> Vector:
        """The point half-way."""
        return _middle(self.start, self.end)


@dataclass(frozen=True)
class SphereDetonator:
    """Lights the surface of a sphere at once: waves run outwards and inwards.

    Attributes:
        center: of the sphere [m].
        radius: of the sphere [m].
        time: of ignition [s].
        charges: names of the charges it lights; none: every charge that holds a part of it.
    """

    center: Vector
    radius: float
    time: float = 0.0
    charges: tuple[str, ...] = ()

    @property
    def position(self) -> Vector:
        """The center."""
        return self.center


@dataclass(frozen=True)
class CordDetonator:
    """A detonating cord: it burns from its first point to its last, and lights what it runs through or along.

    Attributes:
        points: of the polyline [m], two or more.
        speed: along the cord [m/s].
        time: of ignition of the first point [s].
        charges: names of the charges it lights; none: every charge it runs through or along.
    """

    points: tuple[Vector, ...]
    speed: float
    time: float = 0.0
    charges: tuple[str, ...] = ()

    @property
    def position(self) -> Vector:
        """The point where it is lit."""
        return self.points[0]


Detonator = PointDetonator | PlaneDetonator | LineDetonator | SphereDetonator | CordDetonator


def row(
    start: Sequence[float], end: Sequence[float], count: int, *, time: float = 0.0, delay: float = 0.0
) -> tuple[PointDetonator, ...]:
    """`count` points at equal distances from `start` to `end` [m], each lit `delay` [s] after the one before.

    Raises:
        InputError: a number is not finite, or there are fewer than two points.
    """
    first, last = checks.vector("row: start", start), checks.vector("row: end", end)
    time, delay = checks.finite("row: time", time), checks.finite("row: delay", delay)
    places = np.linspace(first, last, _several("row: count", count, 2))
    return tuple(_point(place, time + delay * number) for number, place in enumerate(places))


def ring(
    center: Sequence[float],
    axis: Sequence[float],
    radius: float,
    count: int,
    *,
    time: float = 0.0,
    delay: float = 0.0,
) -> tuple[PointDetonator, ...]:
    """`count` points at equal distances on a circle, each lit `delay` [s] after the one before.

    They run around `axis` by the right hand's rule. The first lies where the coordinate axis points that is farthest
    from `axis`: on the x axis from the center for a ring around z.

    Raises:
        InputError: a number is not finite, `axis` has no length, the radius is not positive, or there is no point.
    """
    middle, normal = checks.vector("ring: center", center), np.array(checks.vector("ring: axis", axis))
    if not normal.any():
        raise mistake("ring: axis", "a vector of any length but 0", axis)
    normal /= np.linalg.norm(normal)
    radius, count = checks.positive("ring: radius", radius), _several("ring: count", count, 1)
    time, delay = checks.finite("ring: time", time), checks.finite("ring: delay", delay)
    first = np.eye(3)[np.argmin(np.abs(normal))]
    first = first - normal * (first @ normal)
    first /= np.linalg.norm(first)
    second = np.cross(normal, first)
    angles = 2.0 * np.pi * np.arange(count) / count
    places = np.array(middle) + radius * (np.outer(np.cos(angles), first) + np.outer(np.sin(angles), second))
    return tuple(_point(place, time + delay * number) for number, place in enumerate(places))


def grid(
    corner: Sequence[float],
    first: Sequence[float],
    second: Sequence[float],
    counts: tuple[int, int],
    *,
    time: float = 0.0,
    delays: tuple[float, float] = (0.0, 0.0),
) -> tuple[PointDetonator, ...]:
    """Points on a parallelogram, `counts` of them along its two edges.

    Args:
        corner: the first point [m].
        first: the first edge, from the first point to the last one of its row [m].
        second: the second edge [m].
        counts: points along each edge.
        time: when the first point is lit [s].
        delays: of a point after its neighbor before along each edge [s].

    Raises:
        InputError: a number is not finite, or there is no point.
    """
    origin = np.array(checks.vector("grid: corner", corner))
    edges = [checks.vector(f"grid: {name}", edge) for name, edge in (("first", first), ("second", second))]
    rows, columns = checks.each("grid: counts", counts, 2, checks.count)
    time = checks.finite("grid: time", time)
    delay, other_delay = checks.each("grid: delays", delays, 2, checks.finite)
    steps = [np.array(edge) / max(count - 1, 1) for edge, count in zip(edges, (rows, columns), strict=True)]
    return tuple(
        _point(origin + i * steps[0] + j * steps[1], time + i * delay + j * other_delay)
        for i in range(rows)
        for j in range(columns)
    )


def checked(where: str, detonator: object) -> Detonator:
    """A detonator with all its numbers checked, and coordinates as floats.

    Raises:
        InputError: not a detonator, a number is not finite, the time is negative, a normal or a line has no length, or
            a radius or a speed is not positive.
    """
    names = "a PointDetonator, LineDetonator, PlaneDetonator, SphereDetonator or CordDetonator"
    given: Detonator = checks.instance(
        where, detonator, Detonator, names, "of several, one argument each: detonator(*ring(...))"
    )
    time, charges = checks.not_negative(f"{where}: time", given.time), checks.names(f"{where}: charges", given.charges)
    if isinstance(given, PointDetonator):
        booster = checks.flag(f"{where}: booster", given.booster)
        return PointDetonator(checks.vector(f"{where}: position", given.position), time, charges, booster)
    if isinstance(given, PlaneDetonator):
        position = checks.vector(f"{where}: position", given.position)
        normal = checks.vector(f"{where}: normal", given.normal)
        if not any(normal):
            raise mistake(f"{where}: normal", "a vector of any length but 0", given.normal)
        return PlaneDetonator(position, normal, time, charges)
    if isinstance(given, SphereDetonator):
        center, radius = checks.vector(f"{where}: center", given.center), given.radius
        return SphereDetonator(center, checks.positive(f"{where}: radius", radius), time, charges)
    if isinstance(given, LineDetonator):
        start, end = _polyline(where, (given.start, given.end))
        return LineDetonator(start, end, time, charges)
    points = _polyline(f"{where}: points", given.points)
    return CordDetonator(points, checks.positive(f"{where}: speed", given.speed), time, charges)


def segments(detonator: LineDetonator | CordDetonator) -> list[tuple[np.ndarray, np.ndarray, float, float]]:
    """The straight pieces of a line or a cord: start and end (3,) [m], and when each of them is lit [s]."""
    if isinstance(detonator, LineDetonator):
        return [(np.array(detonator.start), np.array(detonator.end), detonator.time, detonator.time)]
    places = np.array(detonator.points)
    lengths = np.linalg.norm(np.diff(places, axis=0), axis=1)
    times = detonator.time + np.concatenate([[0.0], np.cumsum(lengths)]) / detonator.speed
    return [(places[n], places[n + 1], float(times[n]), float(times[n + 1])) for n in range(len(lengths))]


def _point(place: np.ndarray, time: float) -> PointDetonator:
    x, y, z = (float(coordinate) for coordinate in place)
    return PointDetonator((x, y, z), time)


def _several(where: str, count: int, fewest: int) -> int:
    if checks.count(where, count) < fewest:
        raise mistake(where, f"at least {fewest}", count)
    return count


def _middle(start: Vector, end: Vector) -> Vector:
    x, y, z = ((a + b) / 2 for a, b in zip(start, end, strict=True))
    return (x, y, z)


def _polyline(where: str, points: Sequence[Vector]) -> tuple[Vector, ...]:
    """The points, two or more, no two in a row the same."""
    checks.instance(where, points, Sequence, "points, each three finite numbers")
    places = tuple(checks.vector(f"{where}: point {number}", point) for number, point in enumerate(points, start=1))
    if len(places) < 2 or any(a == b for a, b in pairwise(places)):
        raise mistake(where, "two points or more, each apart from the one before", places)
    return places
