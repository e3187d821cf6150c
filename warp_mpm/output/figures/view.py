"""A parallel view of the scene in space, and the surface of matter as seen in it.

Surfaces are those of cells: all faces are parallel to the axes, so at most three of a cell's six can be seen, and cells
drawn from far to near hide each other correctly.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from warp_mpm.output.description import SceneDescription
from warp_mpm.output.figures.cells import Cells
from warp_mpm.output.outlines import CORNERS
from warp_mpm.scene import SectionPlane

FLAT = (math.radians(25.0), math.radians(12.0))  # turn and lift of the view from the section's normal: the USD camera's
ROUND = (math.radians(38.0), math.radians(22.0))  # of the view of thick bodies


@dataclass(frozen=True)
class View:
    """The directions right, up and towards the viewer."""

    axes: np.ndarray  # (3, 3): a unit vector a row

    def project(self, points: np.ndarray) -> np.ndarray:
        """Points (..., 3) as they are seen (..., 2), in the same unit."""
        return points @ self.axes[:2].T

    def depth(self, points: np.ndarray) -> np.ndarray:
        """How near points (..., 3) are to the viewer (...)."""
        return points @ self.axes[2]

    def near(self, axis: int) -> bool:
        """Whether it is the upper face of a box along an axis that is seen, rather than the lower."""
        return bool(self.axes[2, axis] > 0.0)


def view_of(section: SectionPlane, thick: bool) -> View:
    """Onto the section plane, as the pictures of it are turned, but a little round the corner: more of thick bodies."""
    turn, lift = ROUND if thick else FLAT
    right, up = np.eye(3)[list(section.in_plane)]
    normal = np.cross(right, up)
    backward = math.cos(lift) * (math.cos(turn) * normal + math.sin(turn) * right) + math.sin(lift) * up
    sideways = np.cross(up, backward)
    sideways /= np.linalg.norm(sideways)
    return View(np.stack([sideways, np.cross(backward, sideways), backward]))


def surface_of(cells: Cells, view: View, values: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The faces between filled and empty cells that look towards the viewer, from far to near.

    Returns:
        Corners (faces, 4, 3) [m], for each face the one of `values` (nx, ny, nz) that its cell has (faces,), and the
        axis it is normal to (faces,).
    """
    corners, shown, axes = [], [], []
    for axis in range(3):
        near = view.near(axis)
        behind = np.moveaxis(cells.filled, axis, 0)
        front = np.zeros_like(behind)
        if near:
            front[:-1] = behind[1:]
        else:
            front[1:] = behind[:-1]
        cell = np.argwhere(np.moveaxis(behind & ~front, 0, axis))
        corners.append(cells.lower + (cell[:, None, :] + _square(axis, near)) * cells.spacing)
        shown.append(values[tuple(cell.T)])
        axes.append(np.full(len(cell), axis))
    faces = np.concatenate(corners)
    order = np.argsort(view.depth(faces.mean(axis=1)), kind="stable")
    return faces[order], np.concatenate(shown)[order], np.concatenate(axes)[order]


def opened(cells: Cells, setup: SceneDescription, view: View, corner: np.ndarray | None) -> Cells:
    """What is left of some cells when those in front of the section plane are taken away.

    With a corner (3,) [m] only the quarter goes that lies beyond it on the side which the view is turned to.
    """
    section = setup.section
    removed = beyond(cells, section.axis, section.coordinate, view)
    if corner is not None:
        side = section.in_plane[0]
        removed = removed & beyond(cells, side, corner[side], view)
    return replace(cells, filled=cells.filled & ~removed)


def beyond(cells: Cells, axis: int, place: float, view: View) -> np.ndarray:
    """Which cells lie beyond a place along an axis, seen from behind; of a shape that broadcasts over them all."""
    centres = cells.centres(axis)
    shape = np.ones(3, dtype=int)
    shape[axis] = -1
    return (centres > place if view.near(axis) else centres < place).reshape(shape)


def box_edges(lower: np.ndarray, upper: np.ndarray, view: View) -> tuple[np.ndarray, np.ndarray]:
    """The edges of a box that are seen (9, 2, 3), and those hidden behind it (3, 2, 3)."""
    far = np.array([0 if view.near(axis) else 1 for axis in range(3)])
    seen: list[tuple[np.ndarray, np.ndarray]] = []
    hidden: list[tuple[np.ndarray, np.ndarray]] = []
    for axis in range(3):
        for start in CORNERS[CORNERS[:, axis] == 0]:
            end = start + np.eye(3, dtype=int)[axis]
            others = np.arange(3) != axis
            (hidden if np.all(start[others] == far[others]) else seen).append((start, end))
    extent = upper - lower
    return lower + np.array(seen) * extent, lower + np.array(hidden) * extent


def _square(axis: int, near: bool) -> np.ndarray:
    """The corners (4, 3) of a unit cell's face, in turn."""
    first, second = (other for other in range(3) if other != axis)
    square = np.zeros((4, 3))
    square[:, axis] = 1.0 if near else 0.0
    square[[1, 2], first] = 1.0
    square[[2, 3], second] = 1.0
    return square
