"""What a picture's colours mean, and when it is, written into its corner."""

from pathlib import Path

import matplotlib.image
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.figure import Figure
from PIL import Image

from warp_mpm.output import colormap
from warp_mpm.output.usd_reading import open_run

DOTS_PER_INCH = 100
INK = "0.85"  # grey
GIGAPASCAL = 1e9  # [Pa]
MICROSECOND = 1e-6  # [s]


def add_legend(picture: Path, file: Path, frame: int, path: Path) -> None:
    """Write the pressures of the colours and the time of the frame into the lower right corner of a picture.

    Args:
        picture: a frame of a result, drawn.
        file: the result's USD file.
        frame: which one.
        path: where the picture with its legend goes.
    """
    _, stage, times = open_run("view", file)
    drawn = matplotlib.image.imread(picture)
    height, width = drawn.shape[:2]
    figure = Figure(figsize=(width / DOTS_PER_INCH, height / DOTS_PER_INCH), dpi=DOTS_PER_INCH)
    canvas = FigureCanvasAgg(figure)
    figure.figimage(drawn, origin="upper", zorder=-1)
    size = 0.2 * height / DOTS_PER_INCH * 10.0  # [points]
    lower, upper = np.array(stage.GetRootLayer().customLayerData["colorRange"]) / GIGAPASCAL
    axes = figure.add_axes((0.72, 0.115, 0.24, 0.022))
    bar = ScalarMappable(Normalize(lower, upper), ListedColormap(colormap.srgb_table()))
    figure.colorbar(bar, cax=axes, orientation="horizontal", extend="max")
    axes.set_xlabel("pressure [GPa]", color=INK, fontsize=size)
    axes.tick_params(colors=INK, labelsize=size)
    time = times[frame] / MICROSECOND
    figure.text(0.72, 0.16, f"{time:.0f} µs", color=INK, fontsize=1.2 * size, va="bottom")
    path.parent.mkdir(parents=True, exist_ok=True)
    canvas.draw()
    # Without opacity, and packed as well as it goes.
    Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB").save(path, optimize=True)
