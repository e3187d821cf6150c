"""Solids from which charges are cut: boxes, spheres, cylinders, their unions (`a | b`) and differences (`a - b`).

Points are (n, 3) arrays, all lengths in metres. A solid knows its bounds, which points it contains, a signed distance
to its surface, and its volume where a formula exists (`warp_mpm.volume` measures it where none does).
"""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from warp_mpm.checks import Vector, mistake, positive, vector

Bounds = tuple[np.ndarray, np.ndarray]

# Lengths that differ by less than this share of the solids' size count as equal: two faces that touch, for example.
TOUCHING = 1e-12

# Boxes cut space along their faces; beyond this many pieces the volume is measured, not summed.
LARGEST_PIECE_COUNT = 1_000_000


class Solid(ABC):
    """A body in space."""

    @abstractmethod
    def bounds(self) -> Bounds:
        """Lower and upper corner of a box that holds the solid, two (3,) float64 arrays [m]."""

    @abstractmethod
    def contains(self, points: np.ndarray) -> np.ndarray:
        """Which of the points (n, 3) [m] lie inside, (n,) bool. Solids that only touch share no point."""

    @abstractmethod
    def signed_distance(self, points: np.ndarray) -> np.ndarray:
        """Distance of the points (n, 3) [m] to the surface, (n,) [m], negative inside.

        Exact for boxes, spheres and cylinders. For unions and differences the sign is right and the true distance is
        at least as large.
        """

    @abstractmethod
    def exact_volume(self) -> float | None:
        """Volume [m3], or None where no formula is known."""

    def __or__(self, other: "Solid") -> "Union":
        """What lies in either solid."""
        return Union(self, other)

    def __sub__(self, other: "Solid") -> "Difference":
        """What lies in this solid and not in the other."""
        return Difference(self, other)


@dataclass(frozen=True)
class Box(Solid):
    """A box with faces normal to the axes."""

    lower: Vector  # [m]
    upper: Vector  # [m]

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


@dataclass(frozen=True)
class Sphere(Solid):
    """A ball."""

    center: Vector  # [m]
    radius: float  # [m]

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


@dataclass(frozen=True)
class Cylinder(Solid):
    """A straight cylinder with flat ends, in any direction."""

    start: Vector  # center of one end [m]
    end: Vector  # center of the other end [m]
    radius: float  # [m]

    def __post_init__(self) -> None:
        """Check the ends and the radius.

        Raises:
            InputError: a number is not finite, the ends coincide, or the radius is not positive.
        """
        object.__setattr__(self, "start", vector("Cylinder: start", self.start))
        object.__setattr__(self, "end", vector("Cylinder: end", self.end))
        object.__setattr__(self, "radius", positive("Cylinder: radius", self.radius))
        if self.start == self.end:
            raise mistake("Cylinder: end", "another point than start", self.end)

    @property
    def length(self) -> float:
        """Distance between the ends [m]."""
        return math.dist(self.start, self.end)

    @property
    def direction(self) -> np.ndarray:
        """Unit vector from start to end, (3,)."""
        return np.subtract(self.end, self.start) / self.length

    def axial_radial(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Coordinate along the axis from `start`, and distance to the axis, of points (n, 3) [m]: two (n,) [m]."""
        offset = points - np.array(self.start)
        axial = offset @ self.direction
        return axial, np.linalg.norm(offset - np.outer(axial, self.direction), axis=1)

    def bounds(self) -> Bounds:
        """The tightest box around the two ends."""
        reach = self.radius * np.sqrt(np.maximum(1.0 - self.direction**2, 0.0))
        return np.minimum(self.start, self.end) - reach, np.maximum(self.start, self.end) + reach

    def contains(self, points: np.ndarray) -> np.ndarray:
        """Which points lie inside; of the two ends the first one belongs to the cylinder."""
        axial, radial = self.axial_radial(points)
        return (radial < self.radius) & (axial >= 0.0) & (axial < self.length)

    def signed_distance(self, points: np.ndarray) -> np.ndarray:
        """Exact distance to the surface."""
        axial, radial = self.axial_radial(points)
        half = self.length / 2
        return _distance_from_excess(np.stack([radial - self.radius, np.abs(axial - half) - half], axis=1))

    def exact_volume(self) -> float:
        """Pi r^2 times the length."""
        return math.pi * self.radius**2 * self.length


@dataclass(frozen=True)
class Union(Solid):
    """What lies in either of two solids. Written `first | second`."""

    first: Solid
    second: Solid

    def bounds(self) -> Bounds:
        """The box around both."""
        (lower_a, upper_a), (lower_b, upper_b) = self.first.bounds(), self.second.bounds()
        return np.minimum(lower_a, lower_b), np.maximum(upper_a, upper_b)

    def contains(self, points: np.ndarray) -> np.ndarray:
        """Which points lie in either."""
        return self.first.contains(points) | self.second.contains(points)

    def signed_distance(self, points: np.ndarray) -> np.ndarray:
        """The smaller of the two."""
        return np.minimum(self.first.signed_distance(points), self.second.signed_distance(points))

    def exact_volume(self) -> float | None:
        """Both volumes less the overlap; None unless all three are known."""
        first, second = self.first.exact_volume(), self.second.exact_volume()
        overlap = _overlap_volume(self.first, self.second)
        if first is None or second is None or overlap is None:
            return _volume_of_boxes(self)
        return first + second - overlap


@dataclass(frozen=True)
class Difference(Solid):
    """What lies in `solid` and not in `cut`. Written `solid - cut`."""

    solid: Solid
    cut: Solid

    def bounds(self) -> Bounds:
        """The bounds of `solid`, less what a box cuts off straight across them (half a sphere, for example)."""
        lower, upper = self.solid.bounds()
        if isinstance(self.cut, Box):
            cut_lower, cut_upper = self.cut.bounds()
            spans = (cut_lower <= lower) & (cut_upper >= upper)
            for axis in range(3):
                if np.delete(spans, axis).all():
                    if cut_lower[axis] <= lower[axis]:
                        lower[axis] = np.clip(cut_upper[axis], lower[axis], upper[axis])
                    elif cut_upper[axis] >= upper[axis]:
                        upper[axis] = np.clip(cut_lower[axis], lower[axis], upper[axis])
        return lower, upper

    def contains(self, points: np.ndarray) -> np.ndarray:
        """Which points lie in `solid` and not in `cut`."""
        return self.solid.contains(points) & ~self.cut.contains(points)

    def signed_distance(self, points: np.ndarray) -> np.ndarray:
        """The larger of the distance to `solid` and the depth in `cut`."""
        return np.maximum(self.solid.signed_distance(points), -self.cut.signed_distance(points))

    def exact_volume(self) -> float | None:
        """Volume of `solid` less the overlap; None unless both are known."""
        whole, overlap = self.solid.exact_volume(), _overlap_volume(self.solid, self.cut)
        if whole is None or overlap is None:
            return _volume_of_boxes(self)
        return whole - overlap


def _distance_from_excess(excess: np.ndarray) -> np.ndarray:
    """Signed distance from how far a point is beyond each pair of faces (n, k), negative between them [m]."""
    outside = np.linalg.norm(np.maximum(excess, 0.0), axis=1)
    return outside + np.minimum(excess.max(axis=1), 0.0)


def _overlap_volume(a: Solid, b: Solid) -> float | None:
    """Volume that two solids share [m3]; None where no formula is known."""
    if certainly_apart(a, b):
        return 0.0
    if _covers(a, b):
        return b.exact_volume()
    if _covers(b, a):
        return a.exact_volume()
    if isinstance(a, Cylinder) and isinstance(b, Cylinder):
        return _nested_cylinders_overlap(a, b)
    return None


def certainly_apart(a: Solid, b: Solid) -> bool:
    """True when the solids certainly share no volume; they may touch."""
    if isinstance(a, Union):
        return certainly_apart(a.first, b) and certainly_apart(a.second, b)
    if isinstance(b, Union):
        return certainly_apart(b, a)
    if isinstance(a, Difference) and (certainly_apart(a.solid, b) or _covers(a.cut, b)):
        return True
    if isinstance(b, Difference) and (certainly_apart(a, b.solid) or _covers(b.cut, a)):
        return True
    if isinstance(b, Sphere):
        return bool(a.signed_distance(np.array([b.center]))[0] >= b.radius * (1.0 - TOUCHING))
    if isinstance(a, Sphere):
        return certainly_apart(b, a)
    (lower_a, upper_a), (lower_b, upper_b) = a.bounds(), b.bounds()
    slack = TOUCHING * np.max(upper_b - lower_b)
    return bool(np.any(upper_a <= lower_b + slack) or np.any(upper_b <= lower_a + slack))


def _covers(outer: Solid, inner: Solid) -> bool:
    """True when `inner` certainly lies within `outer`, surfaces that touch included."""
    if outer == inner:
        return True
    if isinstance(inner, Union):
        return _covers(outer, inner.first) and _covers(outer, inner.second)
    if isinstance(outer, Union) and (_covers(outer.first, inner) or _covers(outer.second, inner)):
        return True
    if isinstance(outer, Difference):
        return _covers(outer.solid, inner) and certainly_apart(outer.cut, inner)
    if isinstance(inner, Difference):
        return _covers(outer, inner.solid)
    if isinstance(inner, Sphere):
        return bool(outer.signed_distance(np.array([inner.center]))[0] <= -inner.radius * (1.0 - TOUCHING))
    if isinstance(outer, Cylinder) and isinstance(inner, Cylinder):
        shared = _nested_cylinders_overlap(outer, inner)
        return shared is not None and shared >= inner.exact_volume() * (1.0 - TOUCHING)
    if isinstance(outer, Box | Sphere | Cylinder):  # convex: all corners inside, hence all between them
        lower, upper = inner.bounds()
        slack = TOUCHING * np.max(upper - lower)
        return bool(np.all(outer.signed_distance(_corners(lower, upper)) <= slack))
    return False


def _nested_cylinders_overlap(a: Cylinder, b: Cylinder) -> float | None:
    """Volume shared by parallel cylinders when the thinner lies within the thicker's mantle, else None [m3]."""
    thick, thin = (a, b) if a.radius >= b.radius else (b, a)
    axial, radial = thick.axial_radial(np.array([thin.start, thin.end]))
    slack = TOUCHING * max(thick.radius, thick.length)
    parallel = abs(radial[1] - radial[0]) <= slack and abs(thick.direction @ thin.direction) >= 1.0 - TOUCHING
    if not parallel or radial.max() + thin.radius > thick.radius + slack:
        return None
    length = min(axial.max(), thick.length) - max(axial.min(), 0.0)
    return math.pi * thin.radius**2 * max(length, 0.0)


def _volume_of_boxes(solid: Solid) -> float | None:
    """Exact volume of any combination of boxes: their faces cut space into pieces, each inside or outside [m3]."""
    boxes = _leaves(solid)
    if not all(isinstance(box, Box) for box in boxes) or (2 * len(boxes) - 1) ** 3 > LARGEST_PIECE_COUNT:
        return None
    faces = np.array([box.bounds() for box in boxes]).reshape(-1, 3)
    edges = [np.unique(faces[:, axis]) for axis in range(3)]
    middles = np.meshgrid(*((edge[1:] + edge[:-1]) / 2 for edge in edges), indexing="ij")
    sizes = np.meshgrid(*(np.diff(edge) for edge in edges), indexing="ij")
    inside = solid.contains(np.stack([middle.ravel() for middle in middles], axis=1))
    return float(np.prod([size.ravel() for size in sizes], axis=0) @ inside)


def _leaves(solid: Solid) -> list[Solid]:
    """The solids that unions and differences combine."""
    if isinstance(solid, Union):
        return _leaves(solid.first) + _leaves(solid.second)
    if isinstance(solid, Difference):
        return _leaves(solid.solid) + _leaves(solid.cut)
    return [solid]


def _corners(lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """The eight corners of a box, (8, 3)."""
    return np.stack(np.meshgrid(*zip(lower, upper, strict=True), indexing="ij"), axis=-1).reshape(-1, 3)
