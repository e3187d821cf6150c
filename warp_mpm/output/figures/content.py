"""What several pictures show of a run: its instants, its pressures, where its charges were."""

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.colors import LogNorm, Normalize

from warp_mpm.checks import mistake
from warp_mpm.output.description import SceneDescription
from warp_mpm.output.figures.style import GIGAPASCAL, NothingToDrawError
from warp_mpm.output.frame import SectionPicture, StepRecord
from warp_mpm.output.saved_frames import Frames, SavedFrame
from warp_mpm.run_directory import SUMMARY, Run

COLOR_LIMIT = 1.6  # of p_CJ: brief focusing in a corner would otherwise leave the fronts dark; as in the USD file
FAINT = 0.02  # share of the range of colours below which gas is not worth showing
BRIGHTEST_SHARE = 0.003  # of an instant's values that may lie above the last colour
DARK = 6.0  # the last colour over the highest pressure of an instant that is dark: the map is nearly black there
DARK_SHARE = 0.5  # of the instants that are dark, from which on colours are logarithmic
BELOW = 30.0  # the highest pressure of the weakest instant over the first colour then
SPAN = 1e5  # the last colour over the first then, at most: gas that has left leaves next to nothing


def setup_of(run: Run) -> SceneDescription:
    """The description of the run's scene.

    Raises:
        InputError: the run has none: it is a USD file alone, or of an earlier version.
    """
    if run.setup is None:
        got = f"{str(run.directory or run.file)!r}, which has none"
        raise mistake("figures", f"a run directory whose {SUMMARY} describes the scene", got, "run the scene again")
    return run.setup


def section_pictures(run: Run) -> tuple[SectionPicture, ...]:
    """The section at the scene's picture instants; without a record of them, at the frames nearest to them.

    Raises:
        NothingToDrawError: there are neither pictures nor frames.
    """
    return run.pictures or tuple(SectionPicture(frame.time, frame.section) for frame in picture_frames(run))


def picture_frames(run: Run) -> list[SavedFrame]:
    """The frames nearest to the scene's picture instants, each once; the last one if the run did not get that far.

    Raises:
        NothingToDrawError: the frames are gone.
    """
    frames = frames_of(run)
    step = float(np.diff(frames.times).max(initial=0.0))
    instants = [time for time in setup_of(run).picture_times if time <= frames.times[-1] + 0.5 * step]
    return list({frame.index: frame for frame in map(frames.nearest, instants or frames.times[-1:])}.values())


def frames_of(run: Run) -> Frames:
    """The saved frames.

    Raises:
        NothingToDrawError: they are gone.
    """
    if run.file is None or len(run.frames) == 0:
        raise NothingToDrawError("the frames are gone")
    return run.frames


def step_record(run: Run) -> StepRecord:
    """What every step left.

    Raises:
        NothingToDrawError: the run was killed, or goes on.
    """
    if run.steps is None:
        raise NothingToDrawError("the run was killed, or goes on: it has left no record of its steps")
    return run.steps


def cj_pressure(run: Run) -> float | None:
    """The Chapman-Jouguet pressure [Pa] of the explosive that the figures of the run refer to."""
    return run.summary.get("p_cj_pa")


def pressure_range(run: Run) -> tuple[float, float]:
    """First and last colour of pressure [Pa], the same in all pictures of a run.

    Zero, and what nearly everything stays below on the section at the instants of its pictures and along the line; at
    most `COLOR_LIMIT`.
    """
    shown = [picture.pressure for picture in section_pictures(run)] if run.pictures or run.file is not None else []
    if run.steps is not None and run.steps.line is not None:
        shown.append(run.steps.line.pressure)
    if not shown:
        shown.append(step_record(run).section.peak)
    return range_of(shown, cj_pressure(run))


def pressure_scale(run: Run) -> Normalize:
    """The scale of colours for pressures in GPa: from zero; logarithmic where half of the instants would be dark.

    A shock in water soon has a twentieth of the pressure of the charge that it came from, one in air a thousandth.
    """
    lower, upper = pressure_range(run)
    shown = section_pictures(run) if run.pictures or run.file is not None else ()
    quantiles = (float(np.quantile(picture.pressure, 1.0 - BRIGHTEST_SHARE)) for picture in shown)
    highest = [value for value in quantiles if value > 0.0]
    dark = [value for value in highest if DARK * value < upper]
    if not dark or len(dark) < DARK_SHARE * len(highest):
        return Normalize(lower / GIGAPASCAL, upper / GIGAPASCAL)
    first = max(min(dark) / BELOW, upper / SPAN)
    return LogNorm(first / GIGAPASCAL, upper / GIGAPASCAL, clip=True)


def faint_pressure(run: Run) -> float:
    """The pressure below which gas is not worth showing [Pa]."""
    scale = pressure_scale(run)
    if isinstance(scale, LogNorm):
        return (scale.vmin or 0.0) * GIGAPASCAL
    lower, upper = pressure_range(run)
    return lower + FAINT * (upper - lower)


def range_of(pressures: Sequence[np.ndarray], cj_pressure: float | None) -> tuple[float, float]:
    """First and last colour [Pa] for some arrays of pressures [Pa]: see `pressure_range`."""
    highest = max(float(np.quantile(pressure, 1.0 - BRIGHTEST_SHARE)) for pressure in pressures) / GIGAPASCAL
    limit = math.inf if cj_pressure is None else COLOR_LIMIT * cj_pressure / GIGAPASCAL
    return 0.0, max(min(math.ceil(10.0 * highest) / 10.0, limit), 1e-3) * GIGAPASCAL


def charge_box(run: Run) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper corner of the box around all charges at the start [m], (3,) each."""
    lower, upper = np.swapaxes([[charge["lower_m"], charge["upper_m"]] for charge in run.summary["charges"]], 0, 1)
    return lower.min(axis=0), upper.max(axis=0)
