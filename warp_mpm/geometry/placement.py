"""Where a solid is put: turned, scaled alike in all directions, and moved."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from warp_mpm.checks import Vector, finite, mistake, positive, vector

TURN_DIGITS = 15  # a quarter turn is exact: its cosine is 0, not 6e-17


@dataclass(frozen=True, eq=False)
class Placement:
    """Takes a point x to `factor` R x + `shift`."""

    rotation: np.ndarray  # R (3, 3), orthonormal, of determinant 1
    factor: float
    shift: np.ndarray  # (3,) [m]

    def points(self, points: Sequence[float] | np.ndarray) -> np.ndarray:
        """Where points (..., 3) [m] come to."""
        return self.factor * np.array(points) @ self.rotation.T + self.shift

    def point(self, point: Vector) -> Vector:
        """Where one point [m] comes to."""
        x, y, z = (float(value) for value in self.points(point))
        return (x, y, z)


def translation(by: Sequence[float]) -> Placement:
    """A move by a vector [m].

    Raises:
        InputError: not three finite numbers.
    """
    return Placement(np.eye(3), 1.0, np.array(vector("translated: by", by)))


def rotation(axis: Sequence[float], angle: float, about: Sequence[float]) -> Placement:
    """A turn by an angle [rad] about an axis through a point [m], as a right-handed screw turns.

    R = I + sin(angle) K + (1 - cos(angle)) K K with K x = axis x x (Rodrigues' formula).

    Raises:
        InputError: a number is not finite, or the axis has no length.
    """
    direction, center = np.array(vector("rotated: axis", axis)), np.array(vector("rotated: about", about))
    length = float(np.linalg.norm(direction))
    if length == 0.0:
        raise mistake("rotated: axis", "a vector of any length but 0", axis)
    angle = finite("rotated: angle", angle)
    x, y, z = direction / length
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turn = np.round(np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross, TURN_DIGITS)
    return Placement(turn, 1.0, center - turn @ center)


def scaling(factor: float, about: Sequence[float]) -> Placement:
    """A change of size that leaves a point [m] where it is.

    Raises:
        InputError: a number is not finite, or the factor is not positive.
    """
    factor = positive("scaled: factor", factor)
    return Placement(np.eye(3), factor, (1.0 - factor) * np.array(vector("scaled: about", about)))
