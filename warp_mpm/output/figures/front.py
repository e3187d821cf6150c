"""The pressure along the scene's line over time, with the fronts that theory expects on top."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from warp_mpm.output import colormap
from warp_mpm.output.figures.content import cj_pressure, pressure_scale, step_record
from warp_mpm.output.figures.style import (
    GIGAPASCAL,
    MARK,
    MICROSECOND,
    MILLIMETRE,
    SERIES,
    NothingToDrawError,
    draw_cj_line,
    draw_pressure_bar,
    new_figure,
)
from warp_mpm.output.frame import LineRecord
from warp_mpm.run_directory import Run

DECADE = 10.0  # with less, a logarithmic axis has hardly a power of ten to be labelled


def front_figure(run: Run) -> Figure:
    """Distance and time; above it the highest pressure that each point of the line ever saw.

    Raises:
        NothingToDrawError: the scene has no line, or the run was killed.
    """
    record = step_record(run).line
    if record is None:
        raise NothingToDrawError("the scene names neither a line nor a front_path")
    if len(record.time) < 2:
        raise NothingToDrawError("no step was taken yet")
    scale = pressure_scale(run)
    distance = record.distance / MILLIMETRE
    figure = new_figure((5.6, 5.6))
    peak, axes = figure.subplots(2, 1, sharex=True, height_ratios=(1.0, 3.6))
    times, pressure = _even_times(record)
    image = axes.imshow(
        pressure / GIGAPASCAL,
        origin="lower",
        aspect="auto",
        interpolation="bilinear",
        cmap=colormap.NAME,
        norm=scale,
        extent=(distance[0], distance[-1], times[0] / MICROSECOND, times[-1] / MICROSECOND),
    )
    _draw_fronts(axes, run, record)
    axes.set_xlabel("distance along the line [mm]")
    axes.set_ylabel("time [µs]")
    _draw_peak(peak, record, cj_pressure(run), isinstance(scale, LogNorm))
    draw_pressure_bar(figure, image, axes, cj_pressure(run), shrink=1.0)
    return figure


def _draw_peak(axes: Axes, record: LineRecord, reference: float | None, logarithmic: bool) -> None:
    """The highest pressure at each point of the line; from zero where less than a decade is shown, if asked or not."""
    highest = record.pressure.max(axis=0)
    axes.plot(record.distance / MILLIMETRE, highest / GIGAPASCAL, color=SERIES[0])
    axes.set_ylabel("peak [GPa]")
    draw_cj_line(axes, reference)
    lowest = float(highest.min(where=highest > 0.0, initial=np.inf))
    if logarithmic and max(float(highest.max()), reference or 0.0) > DECADE * lowest:
        axes.set_yscale("log")
        axes.yaxis.set_minor_formatter(NullFormatter())  # between powers of ten labels would overlap
    else:
        axes.set_ylim(bottom=0.0)


def _even_times(record: LineRecord, rows: int = 1000) -> tuple[np.ndarray, np.ndarray]:
    """The record on evenly spaced times, for an image: (rows,) [s] and (rows, points) [Pa]."""
    times = np.linspace(record.time[0], record.time[-1], rows)
    after = np.clip(np.searchsorted(record.time, times), 1, len(record.time) - 1)
    share = (times - record.time[after - 1]) / (record.time[after] - record.time[after - 1])
    before = record.pressure[after - 1]
    return times, before + share[:, None] * (record.pressure[after] - before)


def _draw_fronts(axes: Axes, run: Run, record: LineRecord) -> None:
    """When the first front should arrive, and so where fronts should meet: the arrival times that the burn follows."""
    if not np.isfinite(record.expected).any():
        return
    expected, style = record.expected / MICROSECOND, (0, (6, 3))
    label = "expected fronts"
    axes.plot(record.distance / MILLIMETRE, expected, color=MARK, linewidth=0.9, linestyle=style, label=label)
    axes.set_ylim(record.time[0] / MICROSECOND, record.time[-1] / MICROSECOND)
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.2)
