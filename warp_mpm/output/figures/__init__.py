"""The pictures of a run, one module each, drawn from what the run left in its directory.

matplotlib is an optional dependency, so import this package only to draw.
"""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Literal

from matplotlib import rc_context
from matplotlib.figure import Figure

from warp_mpm.checks import mistake
from warp_mpm.output.figures.charge import charge_figure
from warp_mpm.output.figures.energy import energy_figure
from warp_mpm.output.figures.field import field_figure
from warp_mpm.output.figures.film import FILMS, draw_film
from warp_mpm.output.figures.front import front_figure
from warp_mpm.output.figures.gauges import gauges_figure
from warp_mpm.output.figures.maps import arrival_figure, peak_figure
from warp_mpm.output.figures.particles import particles_figure
from warp_mpm.output.figures.section import section_figure
from warp_mpm.output.figures.style import STYLE, NothingToDrawError, save
from warp_mpm.run_directory import Run

PICTURES: dict[str, Callable[[Run], Figure]] = {
    "charge": charge_figure,
    "particles": particles_figure,
    "field": field_figure,
    "section": section_figure,
    "front": front_figure,
    "peak": peak_figure,
    "arrival": arrival_figure,
    "energy": energy_figure,
    "gauges": gauges_figure,
}


def draw_figures(
    run: Run,
    directory: Path,
    names: Sequence[str] = (),
    animate: Literal["gif", "mp4"] | None = None,
    smooth: bool = False,
) -> tuple[list[str], dict[str, str]]:
    """Draw pictures of a run, each as `<name>.png` in a directory.

    Args:
        run: as `warp_mpm.load` gives it.
        directory: made if need be.
        names: of pictures; all if there are none.
        animate: also draw those of them that can move at every frame, into files of this kind.
        smooth: let PyVista draw surfaces in space, if `render.fault` has nothing against it.

    Returns:
        The files that were drawn; and the names of those that could not be, with the reason.

    Raises:
        InputError: a name is unknown, an mp4 is wanted without ffmpeg, the run does not say what its scene was, or a
            file of it is damaged.
        SimulationError: a picture cannot be written.
    """
    for name in names:
        if name not in PICTURES:
            raise mistake("figures", f"any of {', '.join(PICTURES)}", repr(name))
    wanted: dict[str, Callable[[Path], None]] = {}
    for name in names or PICTURES:
        wanted[f"{name}.png"] = partial(_draw_picture, run, name, smooth)
        if animate is not None and name in FILMS:
            wanted[f"{name}.{animate}"] = partial(draw_film, run, name, smooth)
    missing: dict[str, str] = {}
    for file, draw in wanted.items():
        try:
            draw(directory / file)
        except NothingToDrawError as reason:
            missing[file] = str(reason)
    return [file for file in wanted if file not in missing], missing


def _draw_picture(run: Run, name: str, smooth: bool, path: Path) -> None:
    draw = partial(field_figure, smooth=smooth) if name == "field" else PICTURES[name]
    with rc_context(STYLE):
        save(draw(run), path)
