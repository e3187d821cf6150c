"""The energies of a run over time."""

from matplotlib.figure import Figure

from warp_mpm.output.figures.style import MICROSECOND, SERIES, NothingToDrawError, new_figure
from warp_mpm.run_directory import Run

KILOJOULE = 1e3  # [J]


def energy_figure(run: Run) -> Figure:
    """Kinetic, internal and total energy in the domain, and the energy released by the burn so far.

    Raises:
        NothingToDrawError: the run has no history.
    """
    if not len(run.history.get("time_s", ())):
        raise NothingToDrawError("the run has no history")
    time = run.history["time_s"] / MICROSECOND
    kinetic, internal, released = (run.history[f"{name}_J"] for name in ("kinetic", "internal", "released"))
    figure = new_figure((5.6, 3.4))
    axes = figure.subplots()
    curves = {"total": kinetic + internal, "internal": internal, "kinetic": kinetic, "released": released}
    for (name, energy), color in zip(curves.items(), (SERIES[2], SERIES[0], SERIES[1], SERIES[3]), strict=True):
        axes.plot(time, energy / KILOJOULE, label=name, color=color, linestyle="--" if name == "released" else "-")
    axes.set_xlim(time[0], max(time[-1], time[0] + 1e-6))
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel("time [µs]")
    axes.set_ylabel("energy in the domain [kJ]")
    figure.legend(loc="outside upper center", ncols=len(curves))
    return figure
