"""What the pictures in space share: panels without axes, marks of detonators, a scale and the directions."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection

from warp_mpm.output.description import SceneDescription
from warp_mpm.output.figures.content import charge_box, setup_of
from warp_mpm.output.figures.marks import draw_mark
from warp_mpm.output.figures.style import AXIS_NAMES, MILLIMETRE
from warp_mpm.output.figures.view import View
from warp_mpm.output.outlines import CORNERS
from warp_mpm.run_directory import Run

THICK = 0.25  # of the longest extent
EDGE = "0.55"  # the colour of edges, on dark and on white
ROUND = (1.0, 2.0, 5.0, 10.0)  # lengths of the scale bar, but for powers of ten


def is_thick(run: Run) -> bool:
    """Whether the charges are thick along the section's normal, so that a surface says little of what is inside."""
    extent = np.subtract(*reversed(charge_box(run)))
    return bool(extent[setup_of(run).section.axis] > THICK * extent.max())


def draw_faces(axes: Axes, view: View, corners: np.ndarray, **colors: Any) -> PolyCollection:
    """Draw faces (faces, 4, 3) [m], each over those before it; without soft edges, which would show as seams."""
    faces = PolyCollection(view.project(corners) / MILLIMETRE, linewidths=0.0, antialiaseds=False, **colors)
    axes.add_collection(faces)
    return faces


def draw_edges(axes: Axes, view: View, edges: np.ndarray, **style: Any) -> None:
    """Draw lines (lines, 2, 3) [m]."""
    axes.add_collection(LineCollection(list(view.project(edges) / MILLIMETRE), **style))


def draw_detonators(axes: Axes, view: View, setup: SceneDescription, box: np.ndarray, time: float) -> None:
    """Mark the detonators, through whatever is before them, as far as they are lit. `box` (2, 3) bounds planes [m]."""
    for detonator in setup.detonators:
        draw_mark(axes, detonator, view.project, view.axes[2], box, time)


def window_of(view: View, points: np.ndarray, margin: float = 0.04) -> tuple[float, float, float, float]:
    """Left, right, bottom, top [mm] of points (n, 3) [m], and a margin."""
    seen = view.project(points) / MILLIMETRE
    low, high = seen.min(axis=0), seen.max(axis=0)
    room = margin * float((high - low).max())
    return low[0] - room, high[0] + room, low[1] - room, high[1] + room


def corners_of(lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """The corners (8, 3) of a box."""
    return lower + CORNERS * (upper - lower)


def prepare(axes: Axes, window: Sequence[float]) -> None:
    """Show a window to scale, without axes."""
    axes.set_aspect("equal")
    axes.set_xlim(window[0], window[1])
    axes.set_ylim(window[2], window[3])
    axes.set_axis_off()


def draw_scale(axes: Axes, view: View, window: Sequence[float], length: bool = True) -> None:
    """The directions of the axes below a window, and a length to compare with."""
    width = window[1] - window[0]
    base = window[2] - 0.20 * width
    if length:
        bar, left = _round_below(0.4 * width), window[0] + 0.03 * width
        axes.plot([left, left + bar], [base, base], color="black", linewidth=1.2, clip_on=False)
        axes.text(left + 0.5 * bar, base - 0.03 * width, f"{bar:g} mm", ha="center", va="top", fontsize=8.0)
    origin = np.array([window[0] + 0.70 * width, base])
    arrow = {"arrowstyle": "-|>", "mutation_scale": 5.0, "linewidth": 0.7, "color": "black", "shrinkA": 0, "shrinkB": 0}
    for axis in range(3):
        direction = view.project(np.eye(3)[axis])
        axes.annotate("", origin + 0.16 * width * direction, origin, arrowprops=arrow, annotation_clip=False)
        x, y = origin + 0.21 * width * direction
        axes.text(x, y, AXIS_NAMES[axis], ha="center", va="center", fontsize=8.0)


def _round_below(length: float) -> float:
    """The longest of 1, 2, 5, 10, 20, ... that is not above a length."""
    power = 10.0 ** math.floor(math.log10(length))
    return max(step * power for step in ROUND if step * power <= length)
