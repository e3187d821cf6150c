"""Straight bodies with flat round ends: cylinders and cones."""

import math
from abc import abstractmethod
from dataclasses import dataclass

import numpy as np

from warp_mpm.checks import Vector, mistake, not_negative, positive, vector
from warp_mpm.geometry.placement import Placement
from warp_mpm.geometry.solid import TOUCHING, Bounds, Solid


class Revolved(Solid):
    """A straight body with flat round ends, in any direction: a cylinder or a cone."""

    start: Vector  # center of one end [m]
    end: Vector  # center of the other end [m]

    convex = True

    @property
    @abstractmethod
    def end_radii(self) -> tuple[float, float]:
        """Radii at `start` and `end` [m]."""

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
        ends = np.array([self.start, self.end])
        reach = np.outer(self.end_radii, np.sqrt(np.maximum(1.0 - self.direction**2, 0.0)))
        return (ends - reach).min(axis=0), (ends + reach).max(axis=0)

    def extent(self, direction: np.ndarray) -> tuple[float, float]:
        """That of its two ends."""
        ends = np.array([self.start, self.end]) @ direction
        reach = np.array(self.end_radii) * math.sqrt(max(1.0 - float(self.direction @ direction) ** 2, 0.0))
        return float((ends - reach).min()), float((ends + reach).max())

    def normals_towards(self, other: Solid) -> list[np.ndarray]:
        """Its direction, and the one across it to the middle of the other."""
        lower, upper = other.bounds()
        if not np.isfinite([lower, upper]).all():
            return [self.direction]
        across = (lower + upper) / 2 - self.start
        across -= (across @ self.direction) * self.direction
        length = float(np.linalg.norm(across))
        return [self.direction, across / length] if length > 0.0 else [self.direction]

    def covers(self, inner: Solid) -> bool:
        """Another round body along the same direction by its ends."""
        if not isinstance(inner, Revolved):
            return super().covers(inner)
        ends = self.ends_of_parallel(inner)
        if ends is None:
            return super().covers(inner)
        slack = TOUCHING * max(self.length, *self.end_radii)
        return bool(np.all(self.profile_distance(ends[0], ends[1] + inner.end_radii) <= slack))

    def _check_ends(self, kind: str) -> None:
        """Check that both ends are points, and not the same."""
        for name in ("start", "end"):
            object.__setattr__(self, name, vector(f"{kind}: {name}", getattr(self, name)))
        if self.start == self.end:
            raise mistake(f"{kind}: end", "another point than start", self.end)

    def ends_of_parallel(self, other: "Revolved") -> tuple[np.ndarray, np.ndarray] | None:
        """Axial and radial coordinate of the ends of another, (2,) [m] each; None if it has another direction."""
        axial, radial = self.axial_radial(np.array([other.start, other.end]))
        slack = TOUCHING * max(self.length, *self.end_radii)
        parallel = abs(radial[1] - radial[0]) <= slack and abs(self.direction @ other.direction) >= 1.0 - TOUCHING
        return (axial, radial) if parallel else None

    def profile_distance(self, axial: np.ndarray, radial: np.ndarray) -> np.ndarray:
        """Signed distance of places in a plane through the axis, axial and radial (n,) [m]; negative inside [m]."""
        (first, second), length = self.end_radii, self.length
        at_start, at_end = (
            np.hypot(axial - at, np.maximum(radial - reach, 0.0))
            for at, reach in zip((0.0, length), (first, second), strict=True)
        )
        along = np.clip(
            (axial * length + (radial - first) * (second - first)) / (length**2 + (second - first) ** 2), 0, 1
        )
        to_mantle = np.hypot(axial - along * length, radial - first - along * (second - first))
        distance = np.minimum(np.minimum(at_start, at_end), to_mantle)
        return np.where(self.profile_contains(axial, radial), -distance, distance)

    def profile_contains(self, axial: np.ndarray, radial: np.ndarray) -> np.ndarray:
        """Whether places in a plane through the axis lie inside; of the two ends the first one does."""
        (first, second), length = self.end_radii, self.length
        return (radial < first + axial / length * (second - first)) & (axial >= 0.0) & (axial < length)

    def contains(self, points: np.ndarray) -> np.ndarray:
        """Which points lie inside; of the two ends the first one belongs to it."""
        return self.profile_contains(*self.axial_radial(points))

    def signed_distance(self, points: np.ndarray) -> np.ndarray:
        """Exact distance to the surface."""
        return self.profile_distance(*self.axial_radial(points))

    def exact_volume(self) -> float:
        """Pi (r1^2 + r1 r2 + r2^2) / 3 times the length."""
        first, second = self.end_radii
        return math.pi * (first**2 + first * second + second**2) / 3.0 * self.length


@dataclass(frozen=True)
class Cylinder(Revolved):
    """A straight cylinder with flat ends, in any direction."""

    start: Vector  # center of one end [m]
    end: Vector  # center of the other end [m]
    radius: float  # [m]

    def __post_init__(self) -> None:
        """Check the ends and the radius.

        Raises:
            InputError: a number is not finite, the ends coincide, or the radius is not positive.
        """
        self._check_ends("Cylinder")
        object.__setattr__(self, "radius", positive("Cylinder: radius", self.radius))

    @property
    def end_radii(self) -> tuple[float, float]:
        """Twice the same [m]."""
        return self.radius, self.radius

    def placed(self, placement: Placement) -> "Cylinder":
        """Another cylinder."""
        start, end = placement.point(self.start), placement.point(self.end)
        return Cylinder(start, end, placement.factor * self.radius)

    def volume_shared_with(self, other: Solid) -> float | None:
        """Of parallel cylinders when the thinner lies within the thicker's mantle."""
        if not isinstance(other, Cylinder):
            return None
        thick, thin = (self, other) if self.radius >= other.radius else (other, self)
        ends = thick.ends_of_parallel(thin)
        slack = TOUCHING * max(thick.radius, thick.length)
        if ends is None or ends[1].max() + thin.radius > thick.radius + slack:
            return None
        length = min(ends[0].max(), thick.length) - max(ends[0].min(), 0.0)
        return math.pi * thin.radius**2 * max(length, 0.0)


@dataclass(frozen=True)
class Cone(Revolved):
    """A straight cone with flat ends, in any direction; cut off where the second radius is not 0."""

    start: Vector  # center of one end [m]
    end: Vector  # center of the other end, or the tip [m]
    start_radius: float  # [m]
    end_radius: float = 0.0  # [m]

    def __post_init__(self) -> None:
        """Check the ends and the radii.

        Raises:
            InputError: a number is not finite, the ends coincide, a radius is negative, or both are 0.
        """
        self._check_ends("Cone")
        for name in ("start_radius", "end_radius"):
            object.__setattr__(self, name, not_negative(f"Cone: {name}", getattr(self, name)))
        if self.start_radius == self.end_radius == 0.0:
            raise mistake("Cone: end_radius", "a positive number where start_radius is 0", self.end_radius)

    @property
    def end_radii(self) -> tuple[float, float]:
        """Both radii [m]."""
        return self.start_radius, self.end_radius

    def placed(self, placement: Placement) -> "Cone":
        """Another cone."""
        start, end = placement.point(self.start), placement.point(self.end)
        return Cone(start, end, placement.factor * self.start_radius, placement.factor * self.end_radius)
