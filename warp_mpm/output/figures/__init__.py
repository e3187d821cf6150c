"""The pictures of a run, one module each, drawn from what the run left in its directory.

matplotlib is an optional dependency, so import this package only to draw.
"""

from collections.abc import Callable, Iterable
from pathlib import Path

from matplotlib import rc_context
from matplotlib.figure import Figure

from warp_mpm.output.figures.energy import energy_figure
from warp_mpm.output.figures.front import front_figure
from warp_mpm.output.figures.section import section_figure
from warp_mpm.output.figures.style import STYLE, NothingToDrawError, save
from warp_mpm.run_directory import Run

PICTURES: dict[str, Callable[[Run], Figure]] = {
    "section": section_figure,
    "front": front_figure,
    "energy": energy_figure,
}


def draw_figures(run: Run, directory: Path, names: Iterable[str] = PICTURES) -> dict[str, str]:
    """Draw pictures of a run, each as `<name>.png` in a directory.

    Returns:
        What could not be drawn, by name, and why.

    Raises:
        InputError: the run does not say what its scene was, or a file of it is damaged.
        SimulationError: a picture cannot be written.
    """
    missing: dict[str, str] = {}
    with rc_context(STYLE):
        for name in names:
            try:
                save(PICTURES[name](run), directory / f"{name}.png")
            except NothingToDrawError as reason:
                missing[name] = str(reason)
    return missing
