"""Drawing on the section plane: the window, the charge's first outline, detonators, labels of the axes."""

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.image import AxesImage
from matplotlib.ticker import MaxNLocator

from warp_mpm.detonators import PlaneDetonator
from warp_mpm.output.description import SceneDescription
from warp_mpm.output.figures.cells import charge_cells
from warp_mpm.output.figures.content import charge_box, setup_of
from warp_mpm.output.figures.marks import draw_mark
from warp_mpm.output.figures.style import AXIS_NAMES, MARK, MILLIMETRE
from warp_mpm.run_directory import Run
from warp_mpm.scene import Domain

THIN_CELLS = 4  # a section with fewer cells across is a line, and drawn as profiles
MOST_TICKS = 4  # along the lower edge of a panel, less one
MARGIN = 0.03  # of what is shown, around it

Window = tuple[float, float, float, float]  # left, right, bottom, top [mm]


def is_thin(setup: SceneDescription) -> bool:
    """Whether the section is only a few cells across."""
    return min(setup.domain.cells[axis] for axis in setup.section.in_plane) < THIN_CELLS


def long_axis(setup: SceneDescription) -> tuple[int, int]:
    """The longer axis of a thin section: its number in space, and in arrays (nodes_u, nodes_v)."""
    first, second = setup.section.in_plane
    return (first, 0) if setup.domain.cells[first] >= setup.domain.cells[second] else (second, 1)


def node_places(domain: Domain, axis: int) -> np.ndarray:
    """Coordinates of the nodes along an axis (nodes,) [mm]."""
    return np.linspace(domain.lower[axis], domain.upper[axis], domain.cells[axis] + 1) / MILLIMETRE


def draw_nodes(axes: Axes, setup: SceneDescription, values: np.ndarray, window: Window, **style: Any) -> AxesImage:
    """Draw values (nodes_u, nodes_v) at the nodes of the section as an image in a window."""
    first, second = setup.section.in_plane
    image = axes.imshow(
        values.T,
        origin="lower",
        extent=(*_pixel_edges(setup.domain, first), *_pixel_edges(setup.domain, second)),
        **style,
    )
    set_window(axes, window)
    return image


def set_window(axes: Axes, window: Window) -> None:
    """Show a window, to scale."""
    axes.set_aspect("equal")
    axes.set_xlim(window[0], window[1])
    axes.set_ylim(window[2], window[3])


def label_axes(panels: np.ndarray, setup: SceneDescription) -> None:
    """Name the axes below and left of panels (rows, columns)."""
    first, second = (AXIS_NAMES[axis] for axis in setup.section.in_plane)
    for axes in panels[-1]:
        axes.set_xlabel(f"{first} [mm]")
        axes.xaxis.set_major_locator(MaxNLocator(MOST_TICKS, steps=[1, 2, 2.5, 5, 10]))
    for axes in panels[:, 0]:
        axes.set_ylabel(f"{second} [mm]")


def draw_detonators(axes: Axes, setup: SceneDescription, time: float = math.inf) -> None:
    """Draw the detonators in the window of the axes as seen along the section's normal, as far as they are lit.

    A plane is drawn where it cuts the section.
    """
    in_plane, axis = list(setup.section.in_plane), setup.section.axis
    box = np.array([setup.domain.lower, setup.domain.upper])
    for detonator in setup.detonators:
        if isinstance(detonator, PlaneDetonator):
            _draw_cut(axes, detonator, setup, time)
        else:
            draw_mark(axes, detonator, lambda points: points[..., in_plane], np.eye(3)[axis], box, time)


def _draw_cut(axes: Axes, plane: PlaneDetonator, setup: SceneDescription, time: float) -> None:
    """The line in which a plane cuts the section."""
    in_plane, axis = list(setup.section.in_plane), setup.section.axis
    normal, point = np.array(plane.normal), np.array(plane.position)
    across = normal[in_plane]
    if across.any():
        point = point[in_plane] - across * normal[axis] * (setup.section.coordinate - point[axis]) / (across @ across)
        at, style = point / MILLIMETRE, "-" if plane.time <= time else ":"
        axes.axline(at, at + np.array([-across[1], across[0]]), color=MARK, linewidth=1.4, linestyle=style)


def draw_outlines(panels: Iterable[Axes], run: Run, color: str = "white") -> None:
    """Where each charge was at first, if it does not fill the domain: the edge of the cells with particles."""
    setup, axis = setup_of(run), setup_of(run).section.axis
    outlines = []
    for cells in charge_cells(run) if run.file is not None else ():
        layer = (setup.section.coordinate - cells.lower[axis]) / cells.spacing[axis]
        inside = np.take(cells.filled, np.clip(int(layer), 0, cells.filled.shape[axis] - 1), axis=axis)
        if inside.any() and not inside.all():
            u, v = (cells.centres(other) / MILLIMETRE for other in setup.section.in_plane)
            outlines.append((u, v, inside.T.astype(float)))
    for axes in panels:
        for outline in outlines:
            axes.contour(*outline, levels=[0.5], colors=color, linewidths=0.6, linestyles="--")


def window_of(run: Run, seen: np.ndarray) -> Window:
    """Left, right, bottom, top [mm] of what is worth showing: the charges, and where `seen` (nodes_u, nodes_v)."""
    setup = setup_of(run)
    lower, upper = charge_box(run)
    window: list[float] = []
    for axis, others in zip(setup.section.in_plane, (1, 0), strict=True):
        nodes = node_places(setup.domain, axis)
        shown = nodes[seen.any(axis=others)]
        low = min(lower[axis] / MILLIMETRE, shown.min(initial=math.inf))
        high = max(upper[axis] / MILLIMETRE, shown.max(initial=-math.inf))
        margin = MARGIN * (high - low)
        window += [max(low - margin, nodes[0]), min(high + margin, nodes[-1])]
    left, right, bottom, top = window
    return left, right, bottom, top


def page(window: Sequence[float], count: int) -> tuple[int, int, tuple[float, float]]:
    """Rows, columns and figure size [inch] that suit `count` panels of the window's shape on a page 9 inches wide."""
    width, wanted = 9.0, 4.2
    shape = (window[3] - window[2]) / (window[1] - window[0])

    def height(columns: int) -> float:
        return math.ceil(count / columns) * ((width - 1.2) / columns * shape + 0.35) + 0.45

    columns = min(range(1, count + 1), key=lambda n: (-count % n, abs(math.log(height(n) / wanted))))
    return math.ceil(count / columns), columns, (width, height(columns))


def _pixel_edges(domain: Domain, axis: int) -> tuple[float, float]:
    """Outer edges [mm] of an image whose pixels are centred on the nodes: half a cell beyond the domain."""
    half = 0.5 * domain.spacing[axis]
    return (domain.lower[axis] - half) / MILLIMETRE, (domain.upper[axis] + half) / MILLIMETRE
