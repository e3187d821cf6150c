"""The field pressure on the section plane at the scene's instants, side by side on one scale of colours."""

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure

from warp_mpm.output import colormap
from warp_mpm.output.figures.content import cj_pressure, faint_pressure, pressure_scale, section_pictures, setup_of
from warp_mpm.output.figures.plane import (
    draw_detonators,
    draw_nodes,
    draw_outlines,
    is_thin,
    label_axes,
    long_axis,
    node_places,
    page,
    window_of,
)
from warp_mpm.output.figures.style import (
    AXIS_NAMES,
    GIGAPASCAL,
    MARK,
    MICROSECOND,
    MILLIMETRE,
    draw_cj_line,
    draw_pressure_bar,
    new_figure,
    panel_title,
)
from warp_mpm.run_directory import Run


def section_figure(run: Run) -> Figure:
    """A panel an instant; a domain that is only a few cells across is drawn as pressure profiles instead.

    Raises:
        NothingToDrawError: there are neither pictures nor frames.
    """
    return _profiles(run) if is_thin(setup_of(run)) else _panels(run)


def _panels(run: Run) -> Figure:
    setup, pictures = setup_of(run), section_pictures(run)
    window = window_of(run, np.max([picture.pressure for picture in pictures], axis=0) > faint_pressure(run))
    rows, columns, size = page(window, len(pictures))
    figure = new_figure(size)
    panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    scale = {"cmap": colormap.NAME, "norm": pressure_scale(run)}
    for number, (axes, picture) in enumerate(zip(panels.flat, pictures, strict=False)):
        values = picture.pressure / GIGAPASCAL
        image = draw_nodes(axes, setup, values, window, interpolation="bilinear", **scale)
        draw_detonators(axes, setup, picture.time)
        axes.set_title(panel_title(number, picture.time), pad=8.0)
    for axes in panels.flat[len(pictures) :]:
        axes.set_visible(False)
    draw_outlines(panels.flat[: len(pictures)], run)
    label_axes(panels, setup)
    draw_pressure_bar(figure, image, panels, cj_pressure(run), shrink=0.8)
    return figure


def _profiles(run: Run) -> Figure:
    """Pressure along the longer axis of a section that is only a few cells across, one curve an instant."""
    setup, pictures = setup_of(run), section_pictures(run)
    axis, along = long_axis(setup)
    nodes = node_places(setup.domain, axis)
    figure = new_figure((7.0, 3.6))
    axes = figure.subplots()
    colors = colormaps["viridis"](np.linspace(0.0, 0.85, len(pictures)))
    for picture, color in zip(pictures, colors, strict=True):
        profile = picture.pressure.mean(axis=1 - along) / GIGAPASCAL
        axes.plot(nodes, profile, color=color, label=f"{picture.time / MICROSECOND:.1f} µs")
    for detonator in setup.detonators:
        axes.axvline(detonator.position[axis] / MILLIMETRE, color=MARK, linewidth=1.0)
    axes.set_xlim(nodes[0], nodes[-1])
    axes.set_xlabel(f"{AXIS_NAMES[axis]} [mm]")
    axes.set_ylabel("pressure [GPa]")
    draw_cj_line(axes, cj_pressure(run))
    axes.set_ylim(bottom=0.0)
    figure.legend(loc="outside right upper")
    return figure
