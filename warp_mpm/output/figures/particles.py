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
    in_plane, normal = setup.section.in_plane, setup.section.axis
    centre, half = _place(run), 0.5 * ZOOM * min(setup.domain.spacing)
    window = [(centre[axis] + side * half) / MILLIMETRE for axis in in_plane for side in (-1.0, 1.0)]
    for axis, draw in zip(in_plane, (axes.axvline, axes.axhline), strict=True):
        for node in node_places(setup.domain, axis):
            draw(node, color="0.75", linewidth=0.6)
    position = run.frames[0].position
    layer = np.floor((position[:, normal] - setup.domain.lower[normal]) / setup.domain.spacing[normal])
    wanted = (setup.section.coordinate - setup.domain.lower[normal]) / setup.domain.spacing[normal]
    shown = position[layer == min(int(wanted), setup.domain.cells[normal] - 1)]
    shown = shown[np.all(np.abs(shown[:, in_plane] - centre[list(in_plane)]) <= 1.2 * half, axis=1)]
    axes.plot(*(shown[:, axis] / MILLIMETRE for axis in in_plane), "o", markersize=4.0, color=SERIES[0])
    left, right, bottom, top = window
    set_window(axes, (left, right, bottom, top))
    draw_detonators(axes, setup)


def _place(run: Run) -> np.ndarray:
    """The middle of the detail (3,) [m]: at the first detonator, moved so that the charges fill it."""
    setup, (lower, upper) = setup_of(run), charge_box(run)
    wanted = setup.detonators[0].position if setup.detonators else lower
    half = 0.4 * ZOOM * min(setup.domain.spacing)
    return np.clip(
        wanted, np.minimum(lower + half, 0.5 * (lower + upper)), np.maximum(upper - half, 0.5 * (lower + upper))
    )


def _words(run: Run) -> str:
    """The numbers, for the title."""
    sizes = " × ".join(f"{size / MILLIMETRE:.4g}" for size in setup_of(run).domain.spacing)
    count, saved = run.summary["particles"], len(run.frames.ids)
    text = f"{count:,} particles, cells of {sizes} mm"
    return text if saved == count else f"{text}; 1 in {round(count / saved)} of the particles was saved"
