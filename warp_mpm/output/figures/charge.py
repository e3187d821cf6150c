"""The charges at the start, their sizes, and the detonators."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.transforms import Bbox

from warp_mpm.detonators import PlaneDetonator
from warp_mpm.output.figures.cells import Cells, charge_cells, joined
from warp_mpm.output.figures.content import charge_box, cj_pressure, setup_of
from warp_mpm.output.figures.space import (
    corners_of,
    draw_detonators,
    draw_edges,
    draw_faces,
    draw_scale,
    is_thick,
    prepare,
    window_of,
)
from warp_mpm.output.figures.style import GIGAPASCAL, MICROSECOND, MILLIMETRE, new_figure
from warp_mpm.output.figures.view import View, beyond, box_edges, surface_of, view_of
from warp_mpm.run_directory import Run
from warp_mpm.scene import Wall

TINTS = ("#e4cf9f", "#b4c8de", "#d3b9d6", "#bcd6b8", "#d9b8a6")  # of charges, light enough for what is written on them
SHADES = {"in front": 1.0, "beside": 0.84, "above": 0.93}  # of faces, by where they look
GAUGE = "#b5367a"  # their crosses and names
MOST_TIMES, MOST_NUMBERS = 6, 24  # of detonators, the latter of gauges too: more labels would have no room
NAME_OFFSET, NAME_STEP = (5.0, -4.0), 3.0  # of gauges' names from their crosses, and further down [points]
SIZE = 4.6  # of the longer side of the drawing [inch]


def charge_figure(run: Run) -> Figure:
    """The charges in space, with the box around them in mm, the gauges, and each detonator with its time.

    Raises:
        NothingToDrawError: the frames of the run are gone.
    """
    setup = setup_of(run)
    view, (lower, upper) = view_of(setup.section, is_thick(run)), charge_box(run)
    window = window_of(view, corners_of(lower, upper), margin=0.1)
    width, height = window[1] - window[0], window[3] - window[2]
    figure = new_figure((SIZE * width / max(width, height), SIZE * height / max(width, height)))
    figure.set_layout_engine("none")  # it would make room for the words, and shrink the drawing for it
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    prepare(axes, window)
    corners, colors = _faces(run, view)
    draw_faces(axes, view, corners, facecolors=colors)
    seen, hidden = box_edges(lower, upper, view)
    draw_edges(axes, view, seen, colors="0.25", linewidths=0.7)
    draw_edges(axes, view, hidden, colors="0.25", linewidths=0.5, linestyles=(0, (2, 3)))
    if setup.line is not None:
        line = np.array([[setup.line.start, setup.line.end]])
        draw_edges(axes, view, line, colors="0.35", linewidths=0.7, linestyles=(0, (8, 3, 1, 3)))
    draw_detonators(axes, view, setup, np.array([lower, upper]), np.inf)
    _label_detonators(axes, run, view)
    _label_box(axes, view, lower, upper)
    draw_scale(axes, view, window, length=False)
    axes.text(1.05, 0.5, _words(run), transform=axes.transAxes, fontsize=8.0, va="center", linespacing=1.6)
    _draw_gauges(axes, run, view)  # last: their names go where there is room
    return figure


def _faces(run: Run, view: View) -> tuple[np.ndarray, np.ndarray]:
    """The faces that are seen (faces, 4, 3) [m], and their colours (faces, 3)."""
    normal = setup_of(run).section.axis
    above = int(np.argmax(np.abs(view.axes[1])))
    shade = np.array([SHADES["in front" if a == normal else "above" if a == above else "beside"] for a in range(3)])
    cells, owner = joined(_opened_parts(run, view))
    corners, number, axis = surface_of(cells, view, owner)
    tints = np.array([to_rgb(tint) for tint in TINTS])
    return corners, tints[number.astype(int) % len(TINTS)] * shade[axis][:, None]


def _opened_parts(run: Run, view: View) -> list[Cells]:
    """The cells of each charge; inert ones around explosives without what lies before the middle of the hindmost."""
    charges, axis = run.summary["charges"], setup_of(run).section.axis
    parts = charge_cells(run)
    for number, charge in enumerate(charges):
        inner = [other for other in charges if _is_explosive(other) and _is_around(charge, other)]
        if inner and not _is_explosive(charge):
            middles = [0.5 * (other["lower_m"][axis] + other["upper_m"][axis]) for other in inner]
            place = min(middles) if view.near(axis) else max(middles)
            hidden = beyond(parts[number], axis, place, view)
            parts[number] = replace(parts[number], filled=parts[number].filled & ~hidden)
    return parts


def _is_explosive(charge: Mapping[str, Any]) -> bool:
    return bool(charge.get("explosive", True))  # runs of earlier versions do not say, and are drawn whole


def _is_around(charge: Mapping[str, Any], other: Mapping[str, Any]) -> bool:
    """Whether a charge's box goes around another's."""
    lower, upper = (np.subtract(other[end], charge[end]) for end in ("lower_m", "upper_m"))
    slack = 1e-6 * np.abs([charge["lower_m"], charge["upper_m"]]).max()
    return bool(np.all(lower >= -slack) and np.all(upper <= slack))


def _label_detonators(axes: Axes, run: Run, view: View) -> None:
    """Number and time of each point detonator, beside it; of many numbers alone between the first and the last."""
    points = [(n, item) for n, item in enumerate(setup_of(run).detonators, 1) if not isinstance(item, PlaneDetonator)]
    every = math.ceil(len(points) / MOST_NUMBERS)
    for index, (number, detonator) in enumerate(points):
        text, is_end = f"{number}", index in (0, len(points) - 1)
        if is_end or len(points) <= MOST_TIMES:
            text += f": {detonator.time / MICROSECOND:.4g} µs"
        if is_end or index % every == 0:
            x, y = view.project(np.array(detonator.position)) / MILLIMETRE
            axes.annotate(text, (x, y), (6.0, 4.0), textcoords="offset points", fontsize=8.0)


def _draw_gauges(axes: Axes, run: Run, view: View) -> None:
    """A cross at each gauge, and the names of those that are there; of many places every few alone.

    A name that would lie on a cross or on another text goes down until it does not, with a line from its cross to it.
    """
    names: dict[tuple[float, ...], list[str]] = {}
    for gauge in setup_of(run).gauges:
        names.setdefault(gauge.position, []).append(gauge.name)
    every = math.ceil(len(names) / MOST_NUMBERS)
    taken, waiting = [text.get_window_extent() for text in axes.texts], []
    for index, (position, there) in enumerate(names.items()):
        place = view.project(np.array(position)) / MILLIMETRE
        (cross,) = axes.plot(*place, "x", markersize=4.0, color=GAUGE, markeredgewidth=1.0, zorder=5)
        taken.append(cross.get_window_extent())
        if index in (0, len(names) - 1) or index % every == 0:
            waiting.append((",\n".join(there), place))
    for text, place in sorted(waiting, key=lambda one: -one[1][0]):  # so that lines pass other names on the left
        taken.append(_name_gauges(axes, text, place, taken))


def _name_gauges(axes: Axes, text: str, place: np.ndarray, taken: Sequence[Bbox]) -> Bbox:
    """Write names at a place [mm], clear of what is taken; returns where they are."""
    label = axes.annotate(text, place, NAME_OFFSET, textcoords="offset points", va="top", fontsize=7.0, color=GAUGE)
    while (box := label.get_window_extent()).count_overlaps(taken):
        label.set_position((NAME_OFFSET[0], label.get_position()[1] - NAME_STEP))
    if label.get_position() != NAME_OFFSET:
        line = {"arrowstyle": "-", "linewidth": 0.4, "color": GAUGE, "shrinkA": 0.0, "shrinkB": 0.0}
        axes.annotate("", place, (0.0, 0.5), textcoords=label, arrowprops=line)
    return box


def _label_box(axes: Axes, view: View, lower: np.ndarray, upper: np.ndarray) -> None:
    """The lengths of the box around the charges, each along an edge of its outline."""
    seen, _ = box_edges(lower, upper, view)
    middle = view.project(0.5 * (lower + upper)) / MILLIMETRE
    for axis in range(3):
        edges = [edge for edge in view.project(seen) / MILLIMETRE if _runs_along(edge, view, axis)]
        x, y = max((edge.mean(axis=0) for edge in edges), key=lambda at: _outwards(at - middle))
        direction = view.project(np.eye(3)[axis])
        turn = np.degrees(np.arctan2(direction[1], direction[0]))
        turn = (turn + 89.0) % 180.0 - 89.0  # text upright, or reading upwards
        away = np.array([x, y]) - middle
        across = np.array([-direction[1], direction[0]]) / np.linalg.norm(direction)
        offset = 9.0 * across * np.sign(across @ away)
        text = f"{(upper - lower)[axis] / MILLIMETRE:.4g} mm"
        style = {"rotation": turn, "rotation_mode": "anchor", "ha": "center", "va": "center"}
        axes.annotate(text, (x, y), offset, textcoords="offset points", fontsize=8.0, annotation_clip=False, **style)


def _runs_along(edge: np.ndarray, view: View, axis: int) -> bool:
    direction = view.project(np.eye(3)[axis])
    along = edge[1] - edge[0]
    return abs(along[0] * direction[1] - along[1] * direction[0]) <= 1e-9 * np.linalg.norm(along)


def _outwards(away: np.ndarray) -> float:
    """Preference for an edge as the place of a length: to the left and below, where axes are labelled."""
    return float(-away[0] - 2.0 * away[1])


def _words(run: Run) -> str:
    """What is written beside the drawing."""
    setup, lines = setup_of(run), []
    for charge in run.summary["charges"]:
        lines += [f"{charge['name']}: {charge['material']}, {charge['mass_kg']:.4g} kg"]
    speed, pressure = run.summary.get("detonation_speed_m_s"), cj_pressure(run)
    if speed is not None:
        lines.append(f"D = {speed:.0f} m/s" + (f", $p_{{CJ}}$ = {pressure / GIGAPASCAL:.3f} GPa" if pressure else ""))
    extent = np.subtract(setup.domain.upper, setup.domain.lower) / MILLIMETRE
    lines.append("domain " + " × ".join(f"{length:.4g}" for length in extent) + " mm")
    walls = setup.walls.faces()
    kinds = [kind for kind in Wall if kind in walls]
    faces = (f"{walls.count(kind)} {kind.value}" if len(kinds) > 1 else f"all {kind.value}" for kind in kinds)
    lines.append(f"its faces: {', '.join(faces)}")
    return "\n".join(lines)
