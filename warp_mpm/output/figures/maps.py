"""What the whole run left on the section plane: the highest pressures, and when the front came."""

from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap, LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.legend_handler import HandlerTuple
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from warp_mpm.output import colormap
from warp_mpm.output.description import SceneDescription
from warp_mpm.output.figures.content import (
    charge_box,
    cj_pressure,
    faint_pressure,
    pressure_scale,
    setup_of,
    step_record,
)
from warp_mpm.output.figures.plane import (
    draw_detonators,
    draw_nodes,
    draw_outlines,
    is_thin,
    label_axes,
    long_axis,
    node_places,
    window_of,
)
from warp_mpm.output.figures.style import (
    AXIS_NAMES,
    GIGAPASCAL,
    MARK,
    MICROSECOND,
    MILLIMETRE,
    SERIES,
    NothingToDrawError,
    new_figure,
)
from warp_mpm.run_directory import Run

HIGHEST_SHARE = 0.005  # of the section that may lie above the last colour
ISOCHRONES = 12  # about as many
TALLEST = 6.0  # [inch]


def peak_figure(run: Run) -> Figure:
    """The highest pressure of all steps at each place, in multiples of the Chapman-Jouguet pressure if there is one.

    Raises:
        NothingToDrawError: the run was killed.
    """
    peak, reference = step_record(run).section.peak, cj_pressure(run)
    ratio = peak / (reference or GIGAPASCAL)
    label = "highest pressure [GPa]" if reference is None else "highest pressure / $p_{CJ}$"
    if is_thin(setup_of(run)):
        return _profile(run, ratio, label)
    figure, axes = _map(run, peak > faint_pressure(run))
    upper = max(float(np.quantile(ratio, 1.0 - HIGHEST_SHARE)), 1e-6)
    norm = Normalize(0.0, upper)
    if isinstance(pressure_scale(run), LogNorm):
        norm = LogNorm(faint_pressure(run) / (reference or GIGAPASCAL), upper, clip=True)
    image = _draw_values(axes, run, ratio, cmap=colormap.NAME, norm=norm)
    bar = _draw_bar(figure, axes, image, label, extend="max")
    if reference is not None and ratio.min() < 1.0 < ratio.max():
        _draw_lines(axes, setup_of(run), ratio, [1.0], colors="white", linewidths=0.8)
        bar.ax.axhline(1.0, color="white", linewidth=1.0)
    return figure


def arrival_figure(run: Run) -> Figure:
    """When the front came to each place, with lines of equal times, computed and expected.

    Raises:
        NothingToDrawError: the run was killed, or nothing detonates.
    """
    arrival = step_record(run).section.arrival / MICROSECOND
    setup = setup_of(run)
    came = np.isfinite(arrival) & _in_charges(run)
    if not came.any():
        raise NothingToDrawError("no front came to the section")
    arrival, last = np.where(came, arrival, np.nan), float(arrival[came].max())
    expected = np.where(came, step_record(run).section.expected / MICROSECOND, np.nan)
    if is_thin(setup):
        return _profile(run, arrival, "arrival of the front [µs]", expected)
    figure, axes = _map(run, came)
    image = _draw_values(axes, run, arrival, cmap=_arrival_colors(), vmin=0.0, vmax=last)
    levels = MaxNLocator(ISOCHRONES, steps=[1, 2, 2.5, 5, 10]).tick_values(0.0, last)[1:]
    marks = {}
    if np.isfinite(expected).any():
        _draw_lines(axes, setup, expected, levels, colors="white", linewidths=1.8)
        marks["expected"] = Line2D([], [], color="white", linewidth=1.8)
    lines = _draw_lines(axes, setup, arrival, levels, colors="black", linewidths=0.8)
    marks["computed"] = Line2D([], [], color="black", linewidth=0.8)
    axes.clabel(lines, fontsize=7.0, fmt="%g")
    ground = Patch(color=_arrival_colors()(0.3))  # white does not show on a page
    handles: list[Any] = [(ground, line) for line in marks.values()]
    handlers = {tuple: HandlerTuple(ndivide=1)}
    figure.legend(handles, list(marks), loc="outside upper center", ncols=2, handler_map=handlers)
    _draw_bar(figure, axes, image, "arrival of the front [µs]")
    return figure


def _in_charges(run: Run) -> np.ndarray:
    """Which nodes of the section are in the box around the charges (nodes_u, nodes_v): beyond it nothing burns."""
    setup, (lower, upper) = setup_of(run), charge_box(run)
    inside = []
    for axis in setup.section.in_plane:
        nodes, slack = node_places(setup.domain, axis) * MILLIMETRE, 1e-6 * setup.domain.spacing[axis]
        inside.append((nodes >= lower[axis] - slack) & (nodes <= upper[axis] + slack))
    return inside[0][:, None] & inside[1]


def _arrival_colors() -> ListedColormap:
    """Viridis without its darkest part, on which black lines would not show."""
    return ListedColormap(colormaps["viridis"](np.linspace(0.3, 1.0, 256)))


def _map(run: Run, seen: np.ndarray) -> tuple[Figure, Axes]:
    """A figure with axes for the part of the section that was `seen` (nodes_u, nodes_v), and the charges."""
    left, right, bottom, top = window_of(run, seen)
    shape = (top - bottom) / (right - left)
    width = min(4.0, TALLEST / shape)
    figure = new_figure((width + 1.6, width * shape + 0.7))
    axes = figure.subplots()
    label_axes(np.array([[axes]]), setup_of(run))
    axes.set_xlim(left, right)
    axes.set_ylim(bottom, top)
    return figure, axes


def _draw_values(axes: Axes, run: Run, values: np.ndarray, **scale: Any) -> AxesImage:
    window = (*axes.get_xlim(), *axes.get_ylim())
    image = draw_nodes(axes, setup_of(run), values, window, interpolation="bilinear", **scale)
    draw_outlines([axes], run)
    draw_detonators(axes, setup_of(run))
    return image


def _draw_lines(axes: Axes, setup: SceneDescription, values: np.ndarray, levels: Any, **style: Any) -> Any:
    u, v = (node_places(setup.domain, axis) for axis in setup.section.in_plane)
    return axes.contour(u, v, values.T, levels=levels, **style)


def _draw_bar(figure: Figure, axes: Axes, image: AxesImage, label: str, extend: str = "neither") -> Any:
    bar = figure.colorbar(image, ax=axes, shrink=0.8, aspect=28, pad=0.03, extend=extend)
    bar.set_label(label)
    bar.ax.spines["outline"].set_linewidth(0.6)
    return bar


def _profile(run: Run, values: np.ndarray, label: str, expected: np.ndarray | None = None) -> Figure:
    """The mean across a section that is only a few cells across, along its longer axis."""
    axis, along = long_axis(setup_of(run))
    nodes = node_places(setup_of(run).domain, axis)
    figure = new_figure((7.0, 3.6))
    axes = figure.subplots()
    axes.plot(nodes, values.mean(axis=1 - along), color=SERIES[0], label="computed")
    if expected is not None:
        theory = expected.mean(axis=1 - along)
        axes.plot(nodes, theory, label="expected", color=MARK, linewidth=0.9, linestyle=(0, (6, 3)))
        figure.legend(loc="outside upper center", ncols=2)
    axes.set_xlim(nodes[0], nodes[-1])
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel(f"{AXIS_NAMES[axis]} [mm]")
    axes.set_ylabel(label)
    return figure
