"""Pictures that move: the section, or the pressure in space, at every saved frame."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.animation import FFMpegWriter
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from PIL import Image

from warp_mpm.checks import mistake
from warp_mpm.output import colormap
from warp_mpm.output.figures.content import (
    cj_pressure,
    faint_pressure,
    frames_of,
    picture_frames,
    pressure_scale,
    setup_of,
)
from warp_mpm.output.figures.field import SpacePanels
from warp_mpm.output.figures.plane import draw_detonators, draw_nodes, draw_outlines, is_thin, label_axes, window_of
from warp_mpm.output.figures.style import (
    GIGAPASCAL,
    MARK,
    MICROSECOND,
    STYLE,
    NothingToDrawError,
    draw_pressure_bar,
    new_figure,
)
from warp_mpm.output.saved_frames import Frames, SavedFrame
from warp_mpm.output.whole_file import whole_file
from warp_mpm.run_directory import Run

FRAMES_PER_SECOND = 12
DOTS_PER_INCH = 120
GREYS = 40  # of the 256 colours of a GIF
HEIGHT = 4.6  # of the drawing [inch]

Show = Callable[[SavedFrame], None]  # changes the figure to another instant


def draw_film(run: Run, name: str, smooth: bool, path: Path) -> None:
    """Draw all frames of a run into one file.

    Args:
        run: with its frames.
        name: "section" or "field".
        smooth: whether PyVista draws the surfaces of "field".
        path: the file to write, .gif or .mp4.

    Raises:
        InputError: an mp4 is wanted, and ffmpeg is not installed.
        NothingToDrawError: the domain is a column, or the frames are gone.
        SimulationError: the file cannot be written.
    """
    if path.suffix == ".mp4" and not FFMpegWriter.isAvailable():
        raise mistake("figures: --animate", "ffmpeg on the search path for mp4", "none", "install it, or choose gif")
    if is_thin(setup_of(run)):
        raise NothingToDrawError("the section is only a few cells across: see section.png")
    frames = frames_of(run)
    with rc_context({**STYLE, "savefig.dpi": DOTS_PER_INCH, "figure.dpi": DOTS_PER_INCH}):
        figure, show = FILMS[name](run, smooth)
        canvas = FigureCanvasAgg(figure)
        show(frames[0])
        canvas.draw()
        figure.set_layout_engine("none")  # nothing may move but what happens
        with whole_file(path) as part:
            part.parent.mkdir(parents=True, exist_ok=True)
            (_write_mp4 if path.suffix == ".mp4" else _write_gif)(part, canvas, show, frames)


def _write_mp4(path: Path, canvas: FigureCanvasAgg, show: Show, frames: Frames) -> None:
    writer = FFMpegWriter(fps=FRAMES_PER_SECOND)
    with writer.saving(canvas.figure, str(path), DOTS_PER_INCH):
        for frame in frames:
            show(frame)
            writer.grab_frame()


def _write_gif(path: Path, canvas: FigureCanvasAgg, show: Show, frames: Frames) -> None:
    """All frames in the same 256 colours: chosen for each alone, as usual, the scale would flicker."""
    palette = _palette()
    images = []
    for frame in frames:
        show(frame)
        canvas.draw()
        image = Image.fromarray(np.asarray(canvas.buffer_rgba())[..., :3])
        images.append(image.quantize(palette=palette, dither=Image.Dither.NONE))
    images[0].save(path, save_all=True, append_images=images[1:], duration=1000 // FRAMES_PER_SECOND, loop=0)


def _palette() -> Image.Image:
    """The colours of pressure, greys from black to white, and that of the detonators."""
    greys = np.linspace(0.0, 1.0, GREYS)[:, None].repeat(3, axis=1)
    pressures = colormap.srgb_table()[np.linspace(0, 255, 255 - GREYS).round().astype(int)]
    image = Image.new("P", (1, 1))
    image.putpalette((255.0 * np.vstack([pressures, greys, to_rgb(MARK)])).round().astype(np.uint8).tobytes())
    return image


def _section_film(run: Run, _: bool) -> tuple[Figure, Show]:
    setup = setup_of(run)
    window = window_of(run, np.max([frame.section for frame in run.frames], axis=0) > faint_pressure(run))
    figure = _figure_for(window)
    axes = figure.subplots()
    scale = {"cmap": colormap.NAME, "norm": pressure_scale(run)}
    image = draw_nodes(axes, setup, run.frames[0].section / GIGAPASCAL, window, interpolation="bilinear", **scale)
    draw_outlines([axes], run)
    label_axes(np.array([[axes]]), setup)
    draw_pressure_bar(figure, image, axes, cj_pressure(run), shrink=0.9)

    def show(frame: SavedFrame) -> None:
        image.set_data(frame.section.T / GIGAPASCAL)
        for line in list(axes.lines):
            line.remove()
        draw_detonators(axes, setup, frame.time)
        axes.set_title(_instant(frame))

    return figure, show


def _field_film(run: Run, smooth: bool) -> tuple[Figure, Show]:
    panels = SpacePanels(run, picture_frames(run), smooth)
    figure = _figure_for(panels.window)
    axes = figure.subplots()
    panels.draw_bar(figure, axes, shrink=0.9)

    def show(frame: SavedFrame) -> None:
        axes.clear()
        panels.draw(axes, frame)
        axes.set_title(_instant(frame))

    return figure, show


def _figure_for(window: tuple[float, float, float, float]) -> Figure:
    shape = (window[3] - window[2]) / (window[1] - window[0])
    figure = new_figure((HEIGHT * min(1.0 / shape, 2.0) + 1.6, HEIGHT * min(1.0, 2.0 * shape) + 0.8))
    figure.set_layout_engine("compressed")  # nothing is cut off to fit, as in pictures
    return figure


def _instant(frame: SavedFrame) -> str:
    return f"{frame.time / MICROSECOND:.1f} µs"


FILMS: dict[str, Callable[[Run, bool], tuple[Figure, Show]]] = {"section": _section_film, "field": _field_film}
