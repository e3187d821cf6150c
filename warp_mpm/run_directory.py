"""What a run left behind, read back: frames and fields as NumPy arrays, tables, and the record of every step."""

import csv
import json
import math
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from warp_mpm.checks import as_path, mistake
from warp_mpm.output.description import SceneDescription, description_from_json
from warp_mpm.output.frame import SectionPicture, StepRecord
from warp_mpm.output.steps import read_steps
from warp_mpm.output.usd_files import USD_SUFFIXES, usd_files

if TYPE_CHECKING:  # the reader of frames needs pxr
    from warp_mpm.output.saved_frames import Frames

SUMMARY, HISTORY, STEPS, GAUGES = "summary.json", "history.csv", "steps.npz", "gauges.csv"
FIGURES = "figures"  # directory
PICTURES = ("charge", "particles", "field", "section", "front", "peak", "arrival", "energy", "gauges")  # `<name>.png`
FILMS = ("field", "section")  # those of them that can also move, `<name>.gif` or `<name>.mp4`
FILM_KINDS = ("gif", "mp4")  # as the command offers them


def load(path: str | Path) -> "Run":
    """What a run left behind; only its summary is read now, everything else when it is first used.

        run = warp_mpm.load("out/two_point")
        run.history["time_s"], run.frames[-1].pressure, run.frames[-1].section

    A run that is still under way, or was killed, can be read as far as it got, and a directory may have been moved.

    Args:
        path: a run directory, or a USD file of a run, which has the frames alone.

    Raises:
        InputError: there is no such file, or it is neither; when something is used, that it is damaged.
    """
    path = as_path("load", path)
    if path.is_file() and path.suffix in USD_SUFFIXES:
        return Run(None, path)
    if not path.is_dir():
        got = f"{str(path)!r}, which " + ("is neither" if path.exists() else "does not exist")
        raise mistake("load", "a run directory or a USD file", got)
    run = Run(path, next(iter(usd_files(path)), None))
    if not run.summary and run.file is None:
        raise mistake("load", f"a run directory, with {SUMMARY} or a USD file", f"{str(path)!r}, which has neither")
    return run


def scene_in(directory: Path) -> str | None:
    """The name of the scene whose run is in a directory, as its summary says; None if none says so."""
    try:
        summary = json.loads((directory / SUMMARY).read_text(encoding="utf-8"))
    except (OSError, ValueError):  # the latter also for a name that no file can have
        return None
    name = summary.get("scene") if isinstance(summary, dict) else None
    return name if isinstance(name, str) else None


def remove_results(directory: Path) -> None:
    """Remove what an earlier run drew and wrote at its end: a run that is killed leaves neither."""
    films = (f"{name}.{kind}" for name in FILMS for kind in FILM_KINDS)
    for file in (*(f"{name}.png" for name in PICTURES), *films):
        (directory / FIGURES / file).unlink(missing_ok=True)
    (directory / STEPS).unlink(missing_ok=True)


class Run:
    """A run, read from its files; what it does not have is None or empty. See `load`."""

    def __init__(self, directory: Path | None, file: Path | None) -> None:
        self.directory = directory  # None for a USD file alone
        self.file = file  # the USD file with the frames

    def __repr__(self) -> str:
        return f"<run {self.name!r} in {str(self.directory or self.file)!r}>"

    @property
    def name(self) -> str:
        """Name of the scene."""
        return str(self.summary.get("scene", self.file.stem if self.file else ""))

    @cached_property
    def summary(self) -> dict[str, Any]:
        """summary.json; its "status" is "running" as long as the run goes on, and for ever if it was killed."""
        path = self._path(SUMMARY)
        if path is None:
            return {}
        try:
            summary = json.loads(path.read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise mistake(str(path), "JSON", f"something else ({error})", "run the scene again") from error
        if not isinstance(summary, dict):
            raise mistake(str(path), "the summary of a run", "other JSON", "run the scene again")
        return summary

    @cached_property
    def setup(self) -> SceneDescription | None:
        """Domain, walls, section, detonators, and what else of the scene does not change."""
        if "setup" not in self.summary:
            return None
        try:
            return description_from_json(self.summary["setup"])
        except (KeyError, TypeError, ValueError) as error:
            where, got = f"{self._path(SUMMARY)}: setup", f"something else ({type(error).__name__}: {error})"
            raise mistake(where, "the description of a scene", got, "run the scene again") from error

    @cached_property
    def history(self) -> dict[str, np.ndarray]:
        """history.csv: its columns by name, (frames,) float64."""
        return self._table(HISTORY)

    @cached_property
    def gauges(self) -> dict[str, np.ndarray]:
        """gauges.csv: its columns by name, (steps,) float64; empty if the scene has no gauges."""
        return self._table(GAUGES)

    @property
    def steps(self) -> StepRecord | None:
        """What every step left: peaks, pressure along lines, the section's highest pressures and arrival times.

        None until a run has ended or was interrupted.
        """
        return self._steps[0]

    @property
    def pictures(self) -> tuple[SectionPicture, ...]:
        """The section at the scene's picture instants; none until a run has ended or was interrupted."""
        return self._steps[1]

    @cached_property
    def frames(self) -> "Frames":
        """The saved frames, a sequence: see `warp_mpm.output.saved_frames.SavedFrame`."""
        if self.file is None:
            raise mistake(str(self.directory), "a USD file with frames", "none")
        from warp_mpm.output.saved_frames import Frames

        return Frames(self.file)

    @cached_property
    def _steps(self) -> tuple[StepRecord | None, tuple[SectionPicture, ...]]:
        path = self._path(STEPS)
        return (None, ()) if path is None else read_steps(path)

    def _path(self, name: str) -> Path | None:
        """A file of the run directory, if it is there."""
        path = None if self.directory is None else self.directory / name
        return path if path is not None and path.is_file() else None

    def _table(self, name: str) -> dict[str, np.ndarray]:
        """The columns of a CSV file. The last line may be half written; what has no value is NaN."""
        path = self._path(name)
        if path is None:
            return {}
        try:
            with path.open(newline="", encoding="utf-8") as file:
                header, *rows = csv.reader(file)
            values = [[float(cell) if cell else math.nan for cell in row] for row in rows if len(row) == len(header)]
        except (OSError, ValueError) as error:
            raise mistake(
                str(path), "a table of numbers", f"something else ({error})", "run the scene again"
            ) from error
        columns = np.array(values, dtype=np.float64).reshape(-1, len(header)).T
        return dict(zip(header, columns, strict=True))
