"""Solids of simple shape: boxes, spheres, half-spaces."""

import math
from dataclasses import dataclass

import numpy as np

from warp_mpm.checks import Vector, mistake, positive, vector
from warp_mpm.geometry.placement import TURN_DIGITS, Placement
from warp_mpm.geometry.solid import TOUCHING, Bounds, Faces, Solid


@dataclass(frozen=True)
class Box(Solid):
    """A box with faces normal to the axes."""

    lower: Vector  # [m]
    upper: Vector  # [m]

    convex = True

    def __post_init__(self) -> None:
        """Check the corners.

        Raises:
            InputError: a coordinate is not finite, or `upper` is not above `lower` on every axis.
        """
        object.__setattr__(self, "lower", vector("Box: lower", self.lower))
        object.__setattr__(self, "upper", vector("Box: upper", self.upper))
        if not all(a < b for a, b in zip(self.lower, self.upper, strict=True)):
            raise mistake("Box: upper", f"above lower {self.lower} on every axis", self.upper)

    def bounds(self) -> Bounds:
        """The corners."""
        return np.array(self.lower), np.array(self.upper)

    def contains(self, points: np.ndarray) -> np.ndarray:
        """Which points lie inside; of two opposite faces the lower one belongs to the box."""
        return np.all((points >= self.lower) & (points < self.upper), axis=1)

    def signed_distance(self, points: np.ndarray) -> np.ndarray:
        """Exact distance to the surface."""
        lower, upper = self.bounds()
        return _distance_from_excess(np.abs(points - (lower + upper) / 2) - (upper - lower) / 2)

    def exact_volume(self) -> float:
        """Product of the edges."""
        return math.prod(b - a for a, b in zip(self.lower, self.upper, strict=True))

    def placed(self, placement: Placement) -> "Box | TurnedBox":
        """A box again after quarter turns, else a turned one."""
        return TurnedBox(self, _rows(np.eye(3))).placed(placement)

    def flat_faces(self) -> Faces:
        """All six."""
        return [(axis, corner[axis]) for corner in (self.lower, self.upper) for axis in range(3)]

    def fills_bounds(self) -> bool:
        """It does."""
        return True


@dataclass(frozen=True)
class TurnedBox(Solid):
    """A box whose faces are not normal to the axes. Made by `Box.rotated`."""

    box: Box  # before it is turned about the origin
    rotation: tuple[Vector, Vector, Vector]  # matrix, by rows

    convex = True

    def bounds(self) -> Bounds:
        """The tightest box around the corners."""
        corners = self.hull()
        return corners.min(axis=0), corners.max(axis=0)

    def contains(self, points: np.ndarray) -> np.ndarray:
        """Which points lie inside."""
        return self.box.contains(points @ np.array(self.rotation))

    def signed_distance(self, points: np.ndarray) -> np.ndarray:
        """Exact distance to the surface."""
        return self.box.signed_distance(points @ np.array(self.rotation))

    def exact_volume(self) -> float:
        """Product of the edges."""
        return self.box.exact_volume()

    def placed(self, placement: Placement) -> "Box | TurnedBox":
        """A box again if its faces come to be normal to the axes."""
        turn = np.round(placement.rotation @ np.array(self.rotation), TURN_DIGITS)
        unturned = Placement(np.eye(3), placement.factor, placement.shift @ turn)
        box = Box(unturned.point(self.box.lower), unturned.point(self.box.upper))
        turned = TurnedBox(box, _rows(turn))
        return Box(*turned.bounds()) if np.count_nonzero(turn) == 3 else turned

    def hull(self) -> np.ndarray:
        """The corners."""
        return self.box.hull() @ np.array(self.rotation).T

    def normals_towards(self, other: Solid) -> list[np.ndarray]:
        """Those of its faces."""
        return list(np.array(self.rotation).T)


@dataclass(frozen=True)
class Sphere(Solid):
    """A ball."""

    center: Vector  # [m]
    radius: float  # [m]

    convex = True

    def __post_init__(self) -> None:
        """Check center and radius.

        Raises:
            InputError: a number is not finite, or the radius is not positive.
        """
        object.__setattr__(self, "center", vector("Sphere: center", self.center))
        object.__setattr__(self, "radius", positive("Sphere: radius", self.radius))

    def bounds(self) -> Bounds:
        """The cube around the sphere."""
        center = np.array(self.center)
        return center - self.radius, center + self.radius

    def contains(self, points: np.ndarray) -> np.ndarray:
        """Which points lie inside."""
        return self.signed_distance(points) < 0.0

    def signed_distance(self, points: np.ndarray) -> np.ndarray:
        """Exact distance to the surface."""
        return np.linalg.norm(points - np.array(self.center), axis=1) - self.radius

    def exact_volume(self) -> float:
        """4/3 pi r^3."""
        return 4.0 / 3.0 * math.pi * self.radius**3

    def placed(self, placement: Placement) -> "Sphere":
        """Another sphere."""
        return Sphere(placement.point(self.center), placement.factor * self.radius)

    def extent(self, direction: np.ndarray) -> tuple[float, float]:
        """A radius from the center to both sides."""
        middle = float(np.array(self.center) @ direction)
        return middle - self.radius, middle + self.radius

    def apart_from(self, other: Solid) -> bool:
        """The other is no nearer to the center than the radius."""
        return bool(other.signed_distance(np.array([self.center]))[0] >= self.radius * (1.0 - TOUCHING))

    def lies_within(self, outer: Solid) -> bool:
        """The other's surface is no nearer to the center than the radius."""
        return bool(outer.signed_distance(np.array([self.center]))[0] <= -self.radius * (1.0 - TOUCHING))


@dataclass(frozen=True)
class HalfSpace(Solid):
    """All that lies behind a plane, without end: it cuts others, `solid & half_space` or `solid - half_space`."""

    point: Vector  # of the plane [m]
    normal: Vector  # of the plane, out of the solid; any length

    convex = True

    def __post_init__(self) -> None:
        """Check the point and the normal.

        Raises:
            InputError: a number is not finite, or the normal has no length.
        """
        object.__setattr__(self, "point", vector("HalfSpace: point", self.point))
        object.__setattr__(self, "normal", vector("HalfSpace: normal", self.normal))
        if not any(self.normal):
            raise mistake("HalfSpace: normal", "a vector of any length but 0", self.normal)

    @property
    def direction(self) -> np.ndarray:
        """Unit vector along the normal, (3,)."""
        normal = np.array(self.normal)
        return normal / np.linalg.norm(normal)

    def bounds(self) -> Bounds:
        """Without end, but for where the plane is normal to an axis."""
        lower, upper = np.full(3, -np.inf), np.full(3, np.inf)
        for axis, at in self.flat_faces() or []:
            (upper if self.normal[axis] > 0.0 else lower)[axis] = at
        return lower, upper

    def contains(self, points: np.ndarray) -> np.ndarray:
        """Which points lie behind the plane."""
        return self.signed_distance(points) < 0.0

    def signed_distance(self, points: np.ndarray) -> np.ndarray:
        """Exact distance to the plane."""
        return (points - np.array(self.point)) @ self.direction

    def exact_volume(self) -> None:
        """It has none."""

    def placed(self, placement: Placement) -> "HalfSpace":
        """Another half-space."""
        return HalfSpace(placement.point(self.point), _vector(placement.rotation @ self.direction))

    def extent(self, direction: np.ndarray) -> tuple[float, float]:
        """Without end, but along the normal."""
        along = float(self.direction @ direction)
        at = float(self.direction @ self.point) * along
        if abs(along) < 1.0 - TOUCHING:
            return -math.inf, math.inf
        return (-math.inf, at) if along > 0.0 else (at, math.inf)

    def normals_towards(self, other: Solid) -> list[np.ndarray]:
        """Its own."""
        return [self.direction]

    def flat_faces(self) -> Faces | None:
        """The plane, if it is normal to an axis."""
        if np.count_nonzero(self.normal) > 1:
            return None
        axis = int(np.argmax(np.abs(self.normal)))
        return [(axis, self.point[axis])]

    def fills_bounds(self) -> bool:
        """It does if the plane is normal to an axis."""
        return self.flat_faces() is not None


def _distance_from_excess(excess: np.ndarray) -> np.ndarray:
    """Signed distance from how far a point is beyond each pair of faces (n, k), negative between them [m]."""
    outside = np.linalg.norm(np.maximum(excess, 0.0), axis=1)
    return outside + np.minimum(excess.max(axis=1), 0.0)


def _rows(matrix: np.ndarray) -> tuple[Vector, Vector, Vector]:
    first, second, third = (_vector(row) for row in matrix)
    return (first, second, third)


def _vector(values: np.ndarray) -> Vector:
    x, y, z = (float(value) for value in values)
    return (x, y, z)
