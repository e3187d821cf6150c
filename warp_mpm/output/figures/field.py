"""The pressure in space at the scene's instants: the surface of the matter, on the scale of the section's pictures."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.figure import Figure

from warp_mpm.output import colormap
from warp_mpm.output.figures.cells import Cells, frame_cells
from warp_mpm.output.figures.content import (
    charge_box,
    cj_pressure,
    faint_pressure,
    picture_frames,
    pressure_scale,
    setup_of,
)
from warp_mpm.output.figures.plane import is_thin, page
from warp_mpm.output.figures.render import render
from warp_mpm.output.figures.space import (
    EDGE,
    corners_of,
    draw_detonators,
    draw_edges,
    draw_faces,
    draw_scale,
    is_thick,
    prepare,
    window_of,
)
from warp_mpm.output.figures.style import (
    GIGAPASCAL,
    NothingToDrawError,
    draw_pressure_bar,
    new_figure,
    panel_title,
)
from warp_mpm.output.figures.view import box_edges, opened, surface_of, view_of
from warp_mpm.output.saved_frames import SavedFrame
from warp_mpm.run_directory import Run
from warp_mpm.scene import Wall

DENSE = 0.5  # of the matter that a full cell has at the start: what has less is gas


def field_figure(run: Run, smooth: bool = False) -> Figure:
    """A panel an instant, at the frames nearest to the instants; see `SpacePanels`.

    Raises:
        NothingToDrawError: the domain is a column, or the frames are gone.
    """
    if is_thin(setup_of(run)):
        raise NothingToDrawError("the section is only a few cells across: see section.png")
    frames = picture_frames(run)
    space = SpacePanels(run, frames, smooth)
    rows, columns, size = page(space.window, len(frames))
    figure = new_figure(size)
    panels = figure.subplots(rows, columns, squeeze=False)
    for axes in panels.flat[len(frames) :]:
        axes.set_visible(False)
    for number, (axes, frame) in enumerate(zip(panels.flat, frames, strict=False)):
        space.draw(axes, frame)
        axes.set_title(panel_title(number, frame.time), pad=4.0)
    draw_scale(panels[-1, 0], space.view, space.window)
    space.draw_bar(figure, panels, shrink=0.8)
    return figure


class SpacePanels:
    """Draws the matter in space, any frame of a run in the same window and on the same scale.

    A flat body in a closed box is shown whole. Thick bodies lack a quarter, with the section plane as one of the cuts;
    of flat ones from which gas expands, what lies in front of the section plane is taken away. Gas that is thin and has
    next to no pressure is left out.
    """

    def __init__(self, run: Run, frames: Sequence[SavedFrame], smooth: bool) -> None:
        """Choose the window that shows all there is to see in some frames; `smooth` takes PyVista."""
        self._run = run
        self._smooth = smooth
        self._setup = setup_of(run)
        self._box = np.array(charge_box(run))
        self._thick = is_thick(run)
        self._open = Wall.OPEN in self._setup.walls.faces()
        self._faint = faint_pressure(run)
        self._bodies: dict[int, Cells] = {}  # of the given frames
        self._scale = pressure_scale(run)
        self.view = view_of(self._setup.section, self._thick)
        points = [corners_of(*self._box)]
        for frame in frames:
            body = self._bodies[frame.index] = self._shown(frame)
            cell = np.argwhere(body.filled & (body.pressure > self._faint))
            points.append(body.lower + (cell + 0.5) * body.spacing)
        self.window = window_of(self.view, np.concatenate(points))

    def draw(self, axes: Axes, frame: SavedFrame) -> None:
        """Draw a frame."""
        prepare(axes, self.window)
        body = self._bodies.get(frame.index) or self._shown(frame)
        corners, pressure, _ = surface_of(body, self.view, body.pressure)
        values = pressure / GIGAPASCAL
        if self._smooth:
            image = render(self.view, self.window, corners, values=values, norm=self._scale)
            axes.imshow(image, extent=self.window, interpolation="antialiased")
        else:
            draw_faces(axes, self.view, corners, array=values, cmap=colormap.NAME, norm=self._scale)
        if not self._open and not self._thick:  # before the wave comes there is nothing else to see
            domain = self._setup.domain
            edges, _ = box_edges(np.array(domain.lower), np.array(domain.upper), self.view)
            draw_edges(axes, self.view, edges, colors=EDGE, linewidths=0.6)
        draw_detonators(axes, self.view, self._setup, self._box, frame.time)

    def draw_bar(self, figure: Figure, beside: Axes | np.ndarray, shrink: float) -> None:
        """The scale of the colours."""
        draw_pressure_bar(figure, ScalarMappable(self._scale, colormap.NAME), beside, cj_pressure(self._run), shrink)

    def _shown(self, frame: SavedFrame) -> Cells:
        """The cells of a frame that are shown."""
        cells = frame_cells(self._run, frame)
        dense = (cells.share >= DENSE) | (cells.pressure > self._faint)
        cells = replace(cells, filled=cells.filled & dense)
        if self._thick:
            return opened(cells, self._setup, self.view, self._box.mean(axis=0))
        return opened(cells, self._setup, self.view, None) if self._open else cells
