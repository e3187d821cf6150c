"""How all pictures look: fonts, units, the colours of lines, the scale of pressures, and how they are saved.

Drawn with matplotlib's figure objects alone: no window, no pyplot. Lengths are in mm, times in microseconds, pressures
in GPa.
"""

from pathlib import Path
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.figure import Figure

from warp_mpm.output.whole_file import whole_file

GIGAPASCAL = 1e9  # [Pa]
MILLIMETRE = 1e-3  # [m]
MICROSECOND = 1e-6  # [s]

STYLE: dict[Any, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 9.0,
    "axes.titlesize": 9.0,
    "axes.labelsize": 9.0,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "legend.fontsize": 8.0,
    "legend.frameon": False,
    "lines.linewidth": 1.4,
    "figure.dpi": 100.0,
    "savefig.dpi": 200.0,
}
MARK = "#35c4f0"  # detonators and theory: a blue that the colour map of pressure does not have
SERIES = ("#b5367a", "#2a78b5", "#1b1b1b", "#e69f00")  # lines: told apart by colour-blind readers too
AXIS_NAMES = "xyz"


class NothingToDrawError(Exception):
    """A run does not have what a picture shows; the text says what is missing."""


def new_figure(size: tuple[float, float]) -> Figure:
    """An empty figure of a size [inch]."""
    return Figure(figsize=size, layout="constrained")


def save(figure: Figure, path: str | Path) -> None:
    """Write a figure as PNG.

    Raises:
        SimulationError: the file cannot be written.
    """
    with whole_file(path) as part:
        part.parent.mkdir(parents=True, exist_ok=True)
        FigureCanvasAgg(figure).print_figure(str(part), format="png", bbox_inches="tight", pad_inches=0.05)


def panel_title(number: int, time: float) -> str:
    """The letter of a panel, and its instant [s]."""
    return f"({chr(ord('a') + number)})  {time / MICROSECOND:.1f} µs"


def draw_pressure_bar(
    figure: Figure, image: ScalarMappable, beside: Axes | np.ndarray, cj_pressure: float | None, shrink: float
) -> None:
    """The scale of the colours, with the Chapman-Jouguet pressure [Pa] marked on it."""
    bar = figure.colorbar(image, ax=beside, extend="max", shrink=shrink, aspect=28, pad=0.03)
    bar.set_label("pressure [GPa]")
    bar.ax.spines["outline"].set_linewidth(0.6)
    if cj_pressure is not None and cj_pressure / GIGAPASCAL < bar.ax.get_ylim()[1]:
        bar.ax.axhline(cj_pressure / GIGAPASCAL, color="white", linewidth=1.0)
        _label_cj(bar.ax, cj_pressure, offset=(-3.0, -3.0), side="right")


def draw_cj_line(axes: Axes, cj_pressure: float | None) -> None:
    """A line at the Chapman-Jouguet pressure [Pa], if there is one."""
    if cj_pressure is not None:
        axes.axhline(cj_pressure / GIGAPASCAL, color="0.5", linewidth=0.8, linestyle="--")
        _label_cj(axes, cj_pressure, offset=(3.0, 2.0), side="left")


def _label_cj(axes: Axes, pressure: float, offset: tuple[float, float], side: Literal["left", "right"]) -> None:
    """Write p_CJ at the left edge of the axes, at a height of `pressure` [Pa]; `offset` is in points."""
    place = (0.0, pressure / GIGAPASCAL)
    coordinates = ("axes fraction", "data")
    axes.annotate("$p_{CJ}$", place, offset, coordinates, "offset points", horizontalalignment=side, fontsize=8.0)
