"""What a solid is, and what two of them make: union (`a | b`), difference (`a - b`) and intersection (`a & b`).

A solid knows its bounds, which points it contains, a signed distance to its surface, and its volume where a formula
exists (`warp_mpm.volume` measures it where none does). It also knows a little about its place among others, for
exact volumes of what they make: each kind adds what it can tell for certain, and nobody asks for kinds.
"""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from warp_mpm.geometry.placement import Placement, rotation, scaling, translation

Bounds = tuple[np.ndarray, np.ndarray]
Faces = list[tuple[int, float]]  # normal to an axis (0, 1, 2), at a coordinate [m]

# Lengths that differ by less than this share of the solids' size count as equal: two faces that touch, for example.
TOUCHING = 1e-12

# Flat faces cut space into pieces; beyond this many the volume is measured, not summed.
LARGEST_PIECE_COUNT = 1_000_000


class Solid(ABC):
    """A body in space."""

    convex = False  # certainly

    @abstractmethod
    def bounds(self) -> Bounds:
        """Lower and upper corner of a box that holds the solid, two (3,) float64 arrays [m]."""

    @abstractmethod
    def contains(self, points: np.ndarray) -> np.ndarray:
        """Which of the points (n, 3) [m] lie inside, (n,) bool. Solids that only touch share no point."""

    @abstractmethod
    def signed_distance(self, points: np.ndarray) -> np.ndarray:
        """Distance of the points (n, 3) [m] to the surface, (n,) [m], negative inside.

        Exact unless solids are combined. For unions, differences and intersections the sign is right and the true
        distance is at least as large.
        """

    @abstractmethod
    def exact_volume(self) -> float | None:
        """Volume [m3], or None where no formula is known."""

    @abstractmethod
    def placed(self, placement: Placement) -> "Solid":
        """The solid somewhere else."""

    # ---- what a solid can tell for certain, unless it knows better -------------------------------------------------

    def hull(self) -> np.ndarray:
        """Points (n, 3) [m] between which all of the solid lies."""
        lower, upper = self.bounds()
        return np.stack(np.meshgrid(*zip(lower, upper, strict=True), indexing="ij"), axis=-1).reshape(-1, 3)

    def extent(self, direction: np.ndarray) -> tuple[float, float]:
        """Coordinates [m] along a unit vector (3,) between which it lies."""
        along = self.hull() @ direction
        return float(along.min()), float(along.max())

    def normals_towards(self, other: "Solid") -> list[np.ndarray]:
        """Unit normals (3,) of planes that may part it from another."""
        return []

    def apart_from(self, other: "Solid") -> bool:
        """True when this solid can tell that it shares no volume with another; both may touch."""
        (lower_a, upper_a), (lower_b, upper_b) = self.bounds(), other.bounds()
        slack = _slack(self, other)
        if np.any(upper_a <= lower_b + slack) or np.any(upper_b <= lower_a + slack):
            return True
        for normal in self.normals_towards(other):
            (low_a, high_a), (low_b, high_b) = self.extent(normal), other.extent(normal)
            if high_a <= low_b + slack or high_b <= low_a + slack:
                return True
        return False

    def covers(self, inner: "Solid") -> bool:
        """True when this solid can tell that another lies within it; their surfaces may touch."""
        if not self.convex or not np.isfinite(inner.bounds()).all():
            return False
        return bool(np.all(self.signed_distance(inner.hull()) <= _slack(self, inner)))

    def lies_within(self, outer: "Solid") -> bool:
        """True when this solid can tell that it lies within another; their surfaces may touch."""
        return self == outer

    def volume_shared_with(self, other: "Solid") -> float | None:
        """Volume [m3] in common with a solid that is neither apart nor within; None if no formula is known."""
        return None

    def parts(self) -> list["Solid"]:
        """Solids whose union it is."""
        return [self]

    def flat_faces(self) -> Faces | None:
        """All its faces, if all are normal to the axes; else None."""
        return None

    def fills_bounds(self) -> bool:
        """True when it is all of the box that is its bounds."""
        return False

    # ---- what to make of it ----------------------------------------------------------------------------------------

    def __or__(self, other: "Solid") -> "Union":
        """What lies in either solid."""
        return Union(self, other)

    def __sub__(self, other: "Solid") -> "Difference":
        """What lies in this solid and not in the other."""
        return Difference(self, other)

    def __and__(self, other: "Solid") -> "Intersection":
        """What lies in both solids."""
        return Intersection(self, other)

    def translated(self, by: Sequence[float]) -> "Solid":
        """The solid, moved by a vector [m].

        Raises:
            InputError: not three finite numbers.
        """
        return self.placed(translation(by))

    def rotated(self, axis: Sequence[float], angle: float, about: Sequence[float] = (0.0, 0.0, 0.0)) -> "Solid":
        """The solid, turned by an angle [rad] about an axis through a point [m], as a right-handed screw turns.

        Raises:
            InputError: a number is not finite, or the axis has no length.
        """
        return self.placed(rotation(axis, angle, about))

    def scaled(self, factor: float, about: Sequence[float] = (0.0, 0.0, 0.0)) -> "Solid":
        """The solid, made larger or smaller in all directions; a point [m] stays where it is.

        Raises:
            InputError: a number is not finite, or the factor is not positive.
        """
        return self.placed(scaling(factor, about))


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
        overlap = shared_volume(self.first, self.second)
        if first is None or second is None or overlap is None:
            return _volume_of_pieces(self)
        return first + second - overlap

    def placed(self, placement: Placement) -> "Union":
        """Both elsewhere."""
        return Union(self.first.placed(placement), self.second.placed(placement))

    def hull(self) -> np.ndarray:
        """The points around both."""
        return np.concatenate([self.first.hull(), self.second.hull()])

    def extent(self, direction: np.ndarray) -> tuple[float, float]:
        """That of both."""
        (low_a, high_a), (low_b, high_b) = self.first.extent(direction), self.second.extent(direction)
        return min(low_a, low_b), max(high_a, high_b)

    def apart_from(self, other: Solid) -> bool:
        """Both are."""
        return certainly_apart(self.first, other) and certainly_apart(self.second, other)

    def covers(self, inner: Solid) -> bool:
        """Either does."""
        return certainly_covers(self.first, inner) or certainly_covers(self.second, inner)

    def lies_within(self, outer: Solid) -> bool:
        """Both do."""
        return self == outer or (certainly_covers(outer, self.first) and certainly_covers(outer, self.second))

    def volume_shared_with(self, other: Solid) -> float | None:
        """The sum of what both share with the other, if they are apart from each other."""
        first, second = shared_volume(self.first, other), shared_volume(self.second, other)
        if first is None or second is None or not certainly_apart(self.first, self.second):
            return None
        return first + second

    def parts(self) -> list[Solid]:
        """Those of both."""
        return self.first.parts() + self.second.parts()

    def flat_faces(self) -> Faces | None:
        """Those of both."""
        return _faces_of_both(self.first, self.second)


@dataclass(frozen=True)
class Difference(Solid):
    """What lies in `solid` and not in `cut`. Written `solid - cut`."""

    solid: Solid
    cut: Solid

    def bounds(self) -> Bounds:
        """The bounds of `solid`, less what boxes and planes cut off straight across (half a sphere, for example)."""
        lower, upper = self.solid.bounds()
        for cut in self.cut.parts():
            if cut.fills_bounds():
                _cut_off(lower, upper, *cut.bounds())
        return lower, upper

    def contains(self, points: np.ndarray) -> np.ndarray:
        """Which points lie in `solid` and not in `cut`."""
        return self.solid.contains(points) & ~self.cut.contains(points)

    def signed_distance(self, points: np.ndarray) -> np.ndarray:
        """The larger of the distance to `solid` and the depth in `cut`."""
        return np.maximum(self.solid.signed_distance(points), -self.cut.signed_distance(points))

    def exact_volume(self) -> float | None:
        """Volume of `solid` less the overlap; None unless both are known."""
        whole, overlap = self.solid.exact_volume(), shared_volume(self.solid, self.cut)
        if whole is None or overlap is None:
            return _volume_of_pieces(self)
        return whole - overlap

    def placed(self, placement: Placement) -> "Difference":
        """Both elsewhere."""
        return Difference(self.solid.placed(placement), self.cut.placed(placement))

    def hull(self) -> np.ndarray:
        """The points around `solid`."""
        return self.solid.hull()

    def extent(self, direction: np.ndarray) -> tuple[float, float]:
        """That of `solid`."""
        return self.solid.extent(direction)

    def apart_from(self, other: Solid) -> bool:
        """`solid` is, or the other lies in `cut`."""
        return certainly_apart(self.solid, other) or certainly_covers(self.cut, other)

    def covers(self, inner: Solid) -> bool:
        """`solid` does, and `cut` leaves it alone."""
        return certainly_covers(self.solid, inner) and certainly_apart(self.cut, inner)

    def lies_within(self, outer: Solid) -> bool:
        """`solid` does."""
        return self == outer or certainly_covers(outer, self.solid)

    def flat_faces(self) -> Faces | None:
        """Those of both."""
        return _faces_of_both(self.solid, self.cut)


@dataclass(frozen=True)
class Intersection(Solid):
    """What lies in both of two solids. Written `first & second`."""

    first: Solid
    second: Solid

    def __post_init__(self) -> None:
        """Note whether it is certainly convex."""
        object.__setattr__(self, "convex", self.first.convex and self.second.convex)

    def bounds(self) -> Bounds:
        """What the bounds of both have in common; of no size if that is nothing."""
        (lower_a, upper_a), (lower_b, upper_b) = self.first.bounds(), self.second.bounds()
        lower = np.maximum(lower_a, lower_b)
        return lower, np.maximum(lower, np.minimum(upper_a, upper_b))

    def contains(self, points: np.ndarray) -> np.ndarray:
        """Which points lie in both."""
        return self.first.contains(points) & self.second.contains(points)

    def signed_distance(self, points: np.ndarray) -> np.ndarray:
        """The larger of the two."""
        return np.maximum(self.first.signed_distance(points), self.second.signed_distance(points))

    def exact_volume(self) -> float | None:
        """What both share; None if it is not known."""
        shared = shared_volume(self.first, self.second)
        return shared if shared is not None else _volume_of_pieces(self)

    def placed(self, placement: Placement) -> "Intersection":
        """Both elsewhere."""
        return Intersection(self.first.placed(placement), self.second.placed(placement))

    def extent(self, direction: np.ndarray) -> tuple[float, float]:
        """What those of both have in common."""
        (low_a, high_a), (low_b, high_b) = self.first.extent(direction), self.second.extent(direction)
        return max(low_a, low_b), min(high_a, high_b)

    def apart_from(self, other: Solid) -> bool:
        """Either is, or their common bounds are."""
        either = certainly_apart(self.first, other) or certainly_apart(self.second, other)
        return either or super().apart_from(other)

    def covers(self, inner: Solid) -> bool:
        """Both do."""
        return certainly_covers(self.first, inner) and certainly_covers(self.second, inner)

    def lies_within(self, outer: Solid) -> bool:
        """Either does."""
        return self == outer or certainly_covers(outer, self.first) or certainly_covers(outer, self.second)

    def flat_faces(self) -> Faces | None:
        """Those of both."""
        return _faces_of_both(self.first, self.second)


def certainly_apart(a: Solid, b: Solid) -> bool:
    """True when two solids certainly share no volume; they may touch."""
    return a.apart_from(b) or b.apart_from(a)


def certainly_covers(outer: Solid, inner: Solid) -> bool:
    """True when `inner` certainly lies within `outer`, surfaces that touch included."""
    return inner.lies_within(outer) or outer.covers(inner)


def shared_volume(a: Solid, b: Solid) -> float | None:
    """Volume that two solids share [m3]; None where no formula is known."""
    if certainly_apart(a, b):
        return 0.0
    if certainly_covers(a, b):
        return b.exact_volume()
    if certainly_covers(b, a):
        return a.exact_volume()
    shared = a.volume_shared_with(b)
    return shared if shared is not None else b.volume_shared_with(a)


def _slack(a: Solid, b: Solid) -> float:
    """Lengths that make no difference beside the smaller of two solids [m]."""
    sizes = [float(np.max(np.subtract(*solid.bounds()[::-1]))) for solid in (a, b)]
    return TOUCHING * min(sizes) if np.isfinite(min(sizes)) else 0.0


def _cut_off(lower: np.ndarray, upper: np.ndarray, cut_lower: np.ndarray, cut_upper: np.ndarray) -> None:
    """Take what a box (its corners, (3,) each [m]) cuts off straight across bounds away from them, in place."""
    spans = (cut_lower <= lower) & (cut_upper >= upper)
    for axis in range(3):
        if np.delete(spans, axis).all():
            if cut_lower[axis] <= lower[axis]:
                lower[axis] = np.clip(cut_upper[axis], lower[axis], upper[axis])
            elif cut_upper[axis] >= upper[axis]:
                upper[axis] = np.clip(cut_lower[axis], lower[axis], upper[axis])


def _faces_of_both(a: Solid, b: Solid) -> Faces | None:
    first, second = a.flat_faces(), b.flat_faces()
    return None if first is None or second is None else first + second


def _volume_of_pieces(solid: Solid) -> float | None:
    """Exact volume where all faces are normal to the axes: they cut space into pieces, each inside or outside [m3]."""
    faces = solid.flat_faces()
    corners = np.array(solid.bounds())
    if faces is None or not np.isfinite(corners).all():
        return None
    edges = [np.unique([*corners[:, axis], *(at for normal, at in faces if normal == axis)]) for axis in range(3)]
    edges = [edge[(edge >= low) & (edge <= high)] for edge, low, high in zip(edges, *corners, strict=True)]
    if np.prod([len(edge) for edge in edges], dtype=float) > LARGEST_PIECE_COUNT:
        return None
    middles = np.meshgrid(*((edge[1:] + edge[:-1]) / 2 for edge in edges), indexing="ij")
    sizes = np.meshgrid(*(np.diff(edge) for edge in edges), indexing="ij")
    inside = solid.contains(np.stack([middle.ravel() for middle in middles], axis=1))
    return float(np.prod([size.ravel() for size in sizes], axis=0) @ inside)
