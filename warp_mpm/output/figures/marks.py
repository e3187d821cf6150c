"""Marks of detonators: dots for points, lines for all else; filled or solid as far as they are lit."""

from collections.abc import Callable

import numpy as np
from matplotlib.axes import Axes

from warp_mpm.detonators import Detonator, PlaneDetonator
from warp_mpm.output.figures.style import MARK, MILLIMETRE
from warp_mpm.output.outlines import lit_part, outlines

SMALL = 0.02  # of the window: a line that looks shorter is a dot

Projection = Callable[[np.ndarray], np.ndarray]  # of points (..., 3) to how they are seen (..., 2), in the same unit


def draw_mark(
    axes: Axes, detonator: Detonator, project: Projection, towards: np.ndarray, box: np.ndarray, time: float
) -> None:
    """Mark a detonator at a time [s] in the window of the axes, which is in mm.

    Args:
        axes: with its window set.
        detonator: what is marked, through whatever is before it.
        project: how it is seen.
        towards: the direction from which it is seen (3,), a unit vector.
        box: bounds planes (2, 3) [m].
        time: what is lit later is hollow, or dotted.
    """
    lines = outlines(detonator, box, towards[None])
    seen = [project(line) / MILLIMETRE for line in lines]
    if isinstance(detonator, PlaneDetonator) or any(np.ptp(line, axis=0).max() > _dot(axes) for line in seen):
        for line, at in zip(lines, seen, strict=True):
            axes.plot(*at.T, color=MARK, linewidth=1.0, linestyle=":", zorder=5)
            lit = project(lit_part(detonator, line, time)) / MILLIMETRE
            axes.plot(*lit.T, color=MARK, linewidth=1.4, zorder=5)
        return
    x, y = project(np.array(detonator.position)) / MILLIMETRE
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    if left <= x <= right and bottom <= y <= top:
        face = MARK if detonator.time <= time else "none"
        axes.plot(
            x, y, "o", markersize=4.0, color=MARK, markerfacecolor=face, markeredgewidth=1.0, clip_on=False, zorder=5
        )


def _dot(axes: Axes) -> float:
    """The size of a dot in the window [mm]."""
    return SMALL * float(max(abs(np.diff(axes.get_xlim())[0]), abs(np.diff(axes.get_ylim())[0])))
