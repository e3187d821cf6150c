"""How the charges are cut into cells and particles."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from warp_mpm.output.figures.cells import charge_cells, joined
from warp_mpm.output.figures.content import charge_box, setup_of
from warp_mpm.output.figures.plane import draw_detonators, label_axes, node_places, set_window
from warp_mpm.output.figures.space import corners_of, draw_faces, is_thick, prepare, window_of
from warp_mpm.output.figures.style import MILLIMETRE, SERIES, new_figure
from warp_mpm.output.figures.view import surface_of, view_of
from warp_mpm.run_directory import Run

ZOOM = 8.0  # cells across the part that is shown with its particles
BODY, GRID = "#e4cf9f", "0.3"


def particles_figure(run: Run) -> Figure:
    """The cells of the charges' surface, and a few of them on the section with their particles.

    Raises:
        NothingToDrawError: the frames of the run are gone.
    """
    setup = setup_of(run)
    figure = new_figure((7.0, 4.2))
    body, detail = figure.subplots(1, 2, width_ratios=(1.0, 1.2))
    view = view_of(setup.section, is_thick(run))
    prepare(body, window_of(view, corners_of(*charge_box(run))))
    cells, owner = joined(charge_cells(run))
    corners, _, _ = surface_of(cells, view, owner)
    faces = draw_faces(body, view, corners, facecolors=BODY)
    faces.set(edgecolors=GRID, linewidths=0.08, antialiaseds=True)
    _draw_detail(detail, run)
    label_axes(np.array([[detail]]), setup)
    figure.suptitle(_words(run), fontsize=9.0)
    return figure


def _draw_detail(axes: Axes, run: Run) -> None:
    """Cells as a grid, particles as dots: those in the layer of cells that the section plane is in."""
    setup = setup_of(run)
    in_plane = setup.section.in_plane
    position, half = _in_section(run), 0.5 * ZOOM * min(setup.domain.spacing)
    centre = _place(run, position)
    window = [(centre[axis] + side * half) / MILLIMETRE for axis in in_plane for side in (-1.0, 1.0)]
    for axis, draw in zip(in_plane, (axes.axvline, axes.axhline), strict=True):
        for node in node_places(setup.domain, axis):
            draw(node, color="0.75", linewidth=0.6)
    shown = position[np.all(np.abs(position[:, in_plane] - centre[list(in_plane)]) <= 1.2 * half, axis=1)]
    axes.plot(*(shown[:, axis] / MILLIMETRE for axis in in_plane), "o", markersize=4.0, color=SERIES[0])
    left, right, bottom, top = window
    set_window(axes, (left, right, bottom, top))
    draw_detonators(axes, setup)


def _in_section(run: Run) -> np.ndarray:
    """The particles (n, 3) [m] in the layer of cells that the section plane is in."""
    setup, position = setup_of(run), run.frames[0].position
    normal = setup.section.axis
    layer = np.floor((position[:, normal] - setup.domain.lower[normal]) / setup.domain.spacing[normal])
    wanted = (setup.section.coordinate - setup.domain.lower[normal]) / setup.domain.spacing[normal]
    return position[layer == min(int(wanted), setup.domain.cells[normal] - 1)]


def _place(run: Run, position: np.ndarray) -> np.ndarray:
    """The middle of the detail (3,) [m]: near the first detonator, where particles (n, 3) [m] fill it."""
    setup, (lower, upper) = setup_of(run), charge_box(run)
    if len(position):
        lower, upper = position.min(axis=0), position.max(axis=0)
    wanted = setup.detonators[0].position if setup.detonators else lower
    half = 0.4 * ZOOM * min(setup.domain.spacing)
    middle = 0.5 * (lower + upper)
    place = np.clip(wanted, np.minimum(lower + half, middle), np.maximum(upper - half, middle))
    in_plane = list(setup.section.in_plane)
    away = np.abs(position[:, in_plane] - place[in_plane]).max(axis=1)
    return position[np.argmin(away)] if len(away) and away.min() > half else place


def _words(run: Run) -> str:
    """The numbers, for the title."""
    sizes = " × ".join(f"{size / MILLIMETRE:.4g}" for size in setup_of(run).domain.spacing)
    count, saved = run.summary["particles"], len(run.frames.ids)
    text = f"{count:,} particles, cells of {sizes} mm"
    return text if saved == count else f"{text}; 1 in {round(count / saved)} of the particles was saved"
