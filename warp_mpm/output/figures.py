"""The pictures of a run: section pressure at chosen instants, pressure along a line over time, energies.

Drawn with matplotlib's figure objects alone: no window, no pyplot. All pictures are in GPa, millimetres and
microseconds, in one style. matplotlib is an optional dependency, so import this module only to draw.
"""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
from matplotlib import colormaps, rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.image import AxesImage

from warp_mpm.detonators import Detonator, PlaneDetonator
from warp_mpm.output import colormap
from warp_mpm.output.frame import LineRecord, SectionPicture
from warp_mpm.output.whole_file import whole_file
from warp_mpm.scene import Scene
from warp_mpm.summary import ideal_arrival, lit_explosive

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
MARK = "#35c4f0"  # detonators and theory: a blue that the colour map does not have
SERIES = ("#b5367a", "#2a78b5", "#1b1b1b", "#e69f00")  # lines: told apart by colour-blind readers too

_FAINT = 0.02  # share of the colour range below which gas is not worth showing
_THIN_CELLS = 4  # a section with fewer cells across is a line, and drawn as profiles
_AXIS_NAMES = "xyz"


def section_figure(
    path: str | Path,
    scene: Scene,
    pictures: Sequence[SectionPicture],
    *,
    pressure_range: tuple[float, float] | None = None,
) -> None:
    """Draw the field pressure on the section plane at each instant, side by side on one colour scale.

    A domain that is only a few cells across is drawn as pressure profiles instead.

    Args:
        path: the PNG file to write.
        scene: where the detonators and the charges are.
        pictures: at least one, pressures (nodes_u, nodes_v) [Pa].
        pressure_range: first and last colour [Pa]; None: zero to nearly the highest, at most 1.6 p_CJ.

    Raises:
        SimulationError: the file cannot be written.
    """
    pressure_range = pressure_range or _colors_for(scene, [picture.pressure for picture in pictures])
    thin = min(scene.domain.cells[axis] for axis in scene.section.in_plane) < _THIN_CELLS
    with rc_context(STYLE):
        _save(_profiles(scene, pictures) if thin else _panels(scene, pictures, pressure_range), path)


def front_figure(
    path: str | Path, scene: Scene, record: LineRecord, *, pressure_range: tuple[float, float] | None = None
) -> None:
    """Draw the pressure along the scene's line over time, with the fronts that theory expects on top.

    Above it stands the highest pressure that each point of the line ever saw.

    Args:
        path: the PNG file to write.
        scene: its line, its detonators and its explosive.
        record: field pressure along the line at every step.
        pressure_range: first and last colour [Pa]; None: zero to nearly the highest, at most 1.6 p_CJ.

    Raises:
        SimulationError: the file cannot be written.
    """
    lower, upper = pressure_range or _colors_for(scene, [record.pressure])
    distance = record.distance / MILLIMETRE
    with rc_context(STYLE):
        figure = _new_figure((5.6, 5.6))
        peak, axes = figure.subplots(2, 1, sharex=True, height_ratios=(1.0, 3.6))
        times, pressure = _even_times(record)
        image = axes.imshow(
            pressure / GIGAPASCAL,
            origin="lower",
            aspect="auto",
            interpolation="bilinear",
            cmap=colormap.NAME,
            vmin=lower / GIGAPASCAL,
            vmax=upper / GIGAPASCAL,
            extent=(distance[0], distance[-1], times[0] / MICROSECOND, times[-1] / MICROSECOND),
        )
        _draw_fronts(axes, scene, record)
        axes.set_xlabel("distance along the line [mm]")
        axes.set_ylabel("time [µs]")
        peak.plot(distance, record.pressure.max(axis=0) / GIGAPASCAL, color=SERIES[0])
        peak.set_ylabel("peak [GPa]")
        _draw_theory(peak, scene)
        peak.set_ylim(bottom=0.0)
        _draw_color_bar(figure, image, axes, scene, shrink=1.0)
        _save(figure, path)


def energy_figure(path: str | Path, history: Sequence[Mapping[str, float]]) -> None:
    """Draw kinetic, internal and total energy over time from the rows of history.csv.

    Args:
        path: the PNG file to write.
        history: rows with `time_s`, `kinetic_J`, `internal_J` and `released_J`.

    Raises:
        SimulationError: the file cannot be written.
    """
    time = np.array([row["time_s"] for row in history]) / MICROSECOND
    kinetic, internal, released = (
        np.array([row[name] for row in history]) for name in ("kinetic_J", "internal_J", "released_J")
    )
    with rc_context(STYLE):
        figure = _new_figure((5.6, 3.4))
        axes = figure.subplots()
        curves = {"total": kinetic + internal, "internal": internal, "kinetic": kinetic, "released": released}
        for (name, energy), color in zip(curves.items(), (SERIES[2], SERIES[0], SERIES[1], SERIES[3]), strict=True):
            axes.plot(time, energy / 1e3, label=name, color=color, linestyle="--" if name == "released" else "-")
        axes.set_xlim(time[0], time[-1])
        axes.set_ylim(bottom=0.0)
        axes.set_xlabel("time [µs]")
        axes.set_ylabel("energy in the domain [kJ]")
        figure.legend(loc="outside upper center", ncols=len(curves))
        _save(figure, path)


def _new_figure(size: tuple[float, float]) -> Figure:
    return Figure(figsize=size, layout="constrained")


def _save(figure: Figure, path: str | Path) -> None:
    with whole_file(path) as part:
        part.parent.mkdir(parents=True, exist_ok=True)
        FigureCanvasAgg(figure).print_figure(str(part), format="png", bbox_inches="tight", pad_inches=0.05)


def _panels(scene: Scene, pictures: Sequence[SectionPicture], pressure_range: tuple[float, float]) -> Figure:
    """One panel an instant, all of the same window and colours, with one colour bar."""
    lower, upper = pressure_range
    window = _window(scene, pictures, faint=lower + _FAINT * (upper - lower))
    rows, columns, size = _page(window, len(pictures))
    figure = _new_figure(size)
    panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    for number, (axes, picture) in enumerate(zip(panels.flat, pictures, strict=False)):
        image = _draw_section(axes, scene, picture, pressure_range, window)
        axes.set_title(f"({chr(ord('a') + number)})  {picture.time / MICROSECOND:.1f} µs", pad=8.0)
    for axes in panels.flat[len(pictures) :]:
        axes.set_visible(False)
    first, second = (_AXIS_NAMES[axis] for axis in scene.section.in_plane)
    for axes in panels[-1]:
        axes.set_xlabel(f"{first} [mm]")
    for axes in panels[:, 0]:
        axes.set_ylabel(f"{second} [mm]")
    _draw_color_bar(figure, image, panels, scene, shrink=0.8)
    return figure


def _draw_section(
    axes: Axes,
    scene: Scene,
    picture: SectionPicture,
    pressure_range: tuple[float, float],
    window: tuple[float, float, float, float],
) -> AxesImage:
    """The pressure at one instant, the charge's first outline and the detonators: hollow until they are lit."""
    first, second = scene.section.in_plane
    image = axes.imshow(
        picture.pressure.T / GIGAPASCAL,
        origin="lower",
        interpolation="bilinear",
        cmap=colormap.NAME,
        vmin=pressure_range[0] / GIGAPASCAL,
        vmax=pressure_range[1] / GIGAPASCAL,
        extent=(*_pixel_edges(scene, first), *_pixel_edges(scene, second)),
    )
    axes.set_aspect("equal")
    axes.set_xlim(window[0], window[1])
    axes.set_ylim(window[2], window[3])
    _draw_outline(axes, scene)
    for detonator in scene.detonators:
        lit = detonator.time <= picture.time
        _draw_detonator(axes, detonator, (first, second), face=MARK if lit else "none")
    return image


def _pixel_edges(scene: Scene, axis: int) -> tuple[float, float]:
    """Outer edges [mm] of an image whose pixels are centred on the nodes: half a cell beyond the domain."""
    half = 0.5 * scene.domain.spacing[axis]
    return (scene.domain.lower[axis] - half) / MILLIMETRE, (scene.domain.upper[axis] + half) / MILLIMETRE


def _draw_detonator(axes: Axes, detonator: Detonator, in_plane: tuple[int, int], face: str) -> None:
    first, second = in_plane
    at = (detonator.position[first] / MILLIMETRE, detonator.position[second] / MILLIMETRE)
    if isinstance(detonator, PlaneDetonator):
        along = (-detonator.normal[second], detonator.normal[first])
        if along != (0.0, 0.0):
            axes.axline(at, (at[0] + along[0], at[1] + along[1]), color=MARK, linewidth=1.0)
        return
    axes.plot(*at, "o", markersize=4.0, color=MARK, markerfacecolor=face, markeredgewidth=1.0, clip_on=False, zorder=5)


def _draw_outline(axes: Axes, scene: Scene) -> None:
    """Where each charge was at first, if it does not fill the domain: the edge of the cells with particles."""
    first, second = scene.section.in_plane
    domain, normal = scene.domain, scene.section.axis
    lower, spacing = np.array(domain.lower), np.array(domain.spacing)
    centres = [(lower[a] + (np.arange(domain.cells[a]) + 0.5) * spacing[a]) / MILLIMETRE for a in (first, second)]
    for charge in scene.charges:
        near = np.abs(charge.positions[:, normal] - scene.section.coordinate) <= 0.51 * spacing[normal]
        cells = ((charge.positions[near] - lower) / spacing).astype(int)
        occupied = np.zeros((domain.cells[first], domain.cells[second]))
        occupied[cells[:, first], cells[:, second]] = 1.0
        if occupied.any() and not occupied.all():
            axes.contour(*centres, occupied.T, levels=[0.5], colors="white", linewidths=0.6, linestyles="--")


def _window(scene: Scene, pictures: Sequence[SectionPicture], faint: float) -> tuple[float, float, float, float]:
    """Left, right, bottom, top [mm] of what is worth showing: the charges, and wherever there is pressure."""
    seen = np.max([picture.pressure for picture in pictures], axis=0) > faint
    window: list[float] = []
    for axis, others in zip(scene.section.in_plane, (1, 0), strict=True):
        lower, upper = scene.domain.lower[axis], scene.domain.upper[axis]
        nodes = np.linspace(lower, upper, scene.domain.cells[axis] + 1)[seen.any(axis=others)]
        charges = [charge.positions[:, axis] for charge in scene.charges]
        low = min([positions.min() for positions in charges] + [nodes.min(initial=math.inf)])
        high = max([positions.max() for positions in charges] + [nodes.max(initial=-math.inf)])
        margin = 0.03 * (high - low)
        window += [max(low - margin, lower) / MILLIMETRE, min(high + margin, upper) / MILLIMETRE]
    left, right, bottom, top = window
    return left, right, bottom, top


def _page(window: tuple[float, float, float, float], count: int) -> tuple[int, int, tuple[float, float]]:
    """Rows, columns and figure size [inch] that suit `count` panels of the window's shape on a page 9 inches wide."""
    width, wanted = 9.0, 4.2
    shape = (window[3] - window[2]) / (window[1] - window[0])

    def height(columns: int) -> float:
        return math.ceil(count / columns) * ((width - 1.2) / columns * shape + 0.35) + 0.45

    columns = min(range(1, count + 1), key=lambda n: (-count % n, abs(math.log(height(n) / wanted))))
    return math.ceil(count / columns), columns, (width, height(columns))


def _profiles(scene: Scene, pictures: Sequence[SectionPicture]) -> Figure:
    """Pressure along the longer axis of a section that is only a few cells across, one curve an instant."""
    first, second = scene.section.in_plane
    long_axis, thin = (first, 1) if scene.domain.cells[first] >= scene.domain.cells[second] else (second, 0)
    nodes = np.linspace(scene.domain.lower[long_axis], scene.domain.upper[long_axis], scene.domain.cells[long_axis] + 1)
    figure = _new_figure((7.0, 3.6))
    axes = figure.subplots()
    colors = colormaps["viridis"](np.linspace(0.0, 0.85, len(pictures)))
    for picture, color in zip(pictures, colors, strict=True):
        profile = picture.pressure.mean(axis=thin) / GIGAPASCAL
        axes.plot(nodes / MILLIMETRE, profile, color=color, label=f"{picture.time / MICROSECOND:.1f} µs")
    for detonator in scene.detonators:
        axes.axvline(detonator.position[long_axis] / MILLIMETRE, color=MARK, linewidth=1.0)
    axes.set_xlim(nodes[0] / MILLIMETRE, nodes[-1] / MILLIMETRE)
    axes.set_xlabel(f"{_AXIS_NAMES[long_axis]} [mm]")
    axes.set_ylabel("pressure [GPa]")
    _draw_theory(axes, scene)
    axes.set_ylim(bottom=0.0)
    figure.legend(loc="outside right upper")
    return figure


def _even_times(record: LineRecord, rows: int = 1000) -> tuple[np.ndarray, np.ndarray]:
    """The record on evenly spaced times, for an image: (rows,) [s] and (rows, points) [Pa]."""
    times = np.linspace(record.time[0], record.time[-1], rows)
    after = np.clip(np.searchsorted(record.time, times), 1, len(record.time) - 1)
    share = (times - record.time[after - 1]) / (record.time[after] - record.time[after - 1])
    before = record.pressure[after - 1]
    return times, before + share[:, None] * (record.pressure[after] - before)


def _draw_fronts(axes: Axes, scene: Scene, record: LineRecord) -> None:
    """When the first front should arrive, and so where fronts should meet: the least t_i + |x - x_i| / D."""
    explosive = lit_explosive(scene)
    if explosive is None or explosive.burn is None or scene.line is None:
        return
    speed = explosive.burn.detonation_speed
    along = np.linspace(record.distance[0], record.distance[-1], 1000)  # finer than the record: the corners stay sharp
    share = along[:, None] / scene.line.length
    points = (1.0 - share) * np.array(scene.line.start) + share * np.array(scene.line.end)
    arrival = ideal_arrival(scene, points, speed)
    label = f"fronts at D = {speed:.0f} m/s"
    axes.plot(along / MILLIMETRE, arrival / MICROSECOND, color=MARK, linewidth=0.9, linestyle=(0, (6, 3)), label=label)
    axes.set_ylim(record.time[0] / MICROSECOND, record.time[-1] / MICROSECOND)
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.2)


def _draw_color_bar(figure: Figure, image: AxesImage, beside: Axes | np.ndarray, scene: Scene, shrink: float) -> None:
    """The scale of the colours, with the Chapman-Jouguet pressure marked on it."""
    bar = figure.colorbar(image, ax=beside, extend="max", shrink=shrink, aspect=28, pad=0.03)
    bar.set_label("pressure [GPa]")
    bar.ax.spines["outline"].set_linewidth(0.6)
    pressure = _cj_pressure(scene)
    if pressure is not None and pressure < bar.ax.get_ylim()[1]:
        bar.ax.axhline(pressure, color="white", linewidth=1.0)
        _label_cj(bar.ax, pressure, offset=(-3.0, -3.0), side="right")


def _draw_theory(axes: Axes, scene: Scene) -> None:
    """A line at the Chapman-Jouguet pressure."""
    pressure = _cj_pressure(scene)
    if pressure is not None:
        axes.axhline(pressure, color="0.5", linewidth=0.8, linestyle="--")
        _label_cj(axes, pressure, offset=(3.0, 2.0), side="left")


def _label_cj(axes: Axes, pressure: float, offset: tuple[float, float], side: Literal["left", "right"]) -> None:
    """Write p_CJ at the left edge of the axes, at a height of `pressure` [GPa]; `offset` is in points."""
    place = (0.0, pressure)
    coordinates = ("axes fraction", "data")
    axes.annotate("$p_{CJ}$", place, offset, coordinates, "offset points", horizontalalignment=side, fontsize=8.0)


def _cj_pressure(scene: Scene) -> float | None:
    """The Chapman-Jouguet pressure [GPa] of the explosive that the figures of the run refer to."""
    explosive = lit_explosive(scene)
    return explosive.cj.pressure / GIGAPASCAL if explosive is not None and explosive.cj is not None else None


def _colors_for(scene: Scene, pressures: Sequence[np.ndarray]) -> tuple[float, float]:
    """First and last colour [Pa]: zero, and what each array stays below but for its highest 0.3 %.

    Brief focusing in a corner would leave the fronts dark, so 1.6 p_CJ is the limit, as in the USD file.
    """
    highest = max(float(np.quantile(pressure, 0.997)) for pressure in pressures) / GIGAPASCAL
    cj_pressure = _cj_pressure(scene)
    limit = math.inf if cj_pressure is None else 1.6 * cj_pressure
    return 0.0, max(min(math.ceil(10.0 * highest) / 10.0, limit), 1e-3) * GIGAPASCAL
