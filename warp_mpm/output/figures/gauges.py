"""What the gauges showed over time."""

import numpy as np
from matplotlib.figure import Figure

from warp_mpm.output.figures.content import cj_pressure
from warp_mpm.output.figures.style import GIGAPASCAL, MICROSECOND, NothingToDrawError, draw_cj_line, new_figure
from warp_mpm.run_directory import Run

PRESSURE, DENSITY = "_pressure_pa", "_density_kg_m3"  # end the names of a gauge's columns
COLORS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#1b1b1b", "#56b4e9", "#e69f00")  # Okabe and Ito's
LINES = ("-", "--", "-.", ":")
KILOPASCAL_SECOND = 1e3  # [Pa s]
MEGAPASCAL = 1e6  # [Pa]
CLOSE = 0.25  # share of p_CJ that the gauges must have seen for it to be shown
SMALL = 0.1 * GIGAPASCAL  # lower pressures are shown in MPa [Pa]


def gauges_figure(run: Run) -> Figure:
    """Pressure, impulse (the integral of pressure over time), speed at each gauge; who saw nothing is marked.

    Raises:
        NothingToDrawError: the scene has no gauges.
    """
    names = [column.removesuffix(PRESSURE) for column in run.gauges if column.endswith(PRESSURE)]
    if not names or len(run.gauges["time_s"]) < 2:
        raise NothingToDrawError("the scene has no gauges")
    time = run.gauges["time_s"]
    figure = new_figure((6.4, 6.0))
    panels = figure.subplots(3, 1, sharex=True, height_ratios=(1.6, 1.0, 1.0))
    highest = max(float(run.gauges[name + PRESSURE].max()) for name in names)
    unit, scale = ("GPa", GIGAPASCAL) if highest >= SMALL else ("MPa", MEGAPASCAL)
    for number, name in enumerate(names):
        pressure = run.gauges[name + PRESSURE]
        impulse = np.append(0.0, np.cumsum(0.5 * (pressure[1:] + pressure[:-1]) * np.diff(time)))
        speed = np.linalg.norm([run.gauges[f"{name}_velocity_{axis}_m_s"] for axis in "xyz"], axis=0)
        color, line = COLORS[number % len(COLORS)], LINES[number // len(COLORS) % len(LINES)]
        label = name if run.gauges[name + DENSITY].any() else f"{name} (nothing)"  # but vacuum
        curves = (pressure / scale, impulse / KILOPASCAL_SECOND, speed)
        for axes, curve in zip(panels, curves, strict=True):
            axes.plot(time / MICROSECOND, curve, color=color, linestyle=line, linewidth=1.1, label=label)
    cj = cj_pressure(run)
    if cj is not None and highest >= CLOSE * cj:  # else the line would leave no room for the curves
        draw_cj_line(panels[0], cj)
    for axes, label in zip(panels, (f"pressure [{unit}]", "impulse [kPa s]", "speed [m/s]"), strict=True):
        axes.set_ylabel(label)
        axes.set_ylim(bottom=0.0)
    panels[-1].set_xlim(time[0] / MICROSECOND, time[-1] / MICROSECOND)
    panels[-1].set_xlabel("time [µs]")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=min(len(names), 5))
    return figure
