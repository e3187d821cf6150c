"""Opens what a run left as USD, whole or killed, and says which frames are in it."""

from pathlib import Path
from typing import Any

import numpy as np
from pxr import Tf, Usd

from warp_mpm.checks import mistake
from warp_mpm.errors import InputError
from warp_mpm.output.usd_files import usd_files


def usd_file(where: str, path: Path) -> Path:
    """The USD file at a path: that file, or that of a run directory.

    Args:
        where: the beginning of error messages.
        path: a USD file or a run directory.

    Raises:
        InputError: there is neither.
    """
    if path.is_dir():
        files = usd_files(path)
        if not files:
            raise mistake(where, "a run directory with a USD file", f"{str(path)!r}, which has none")
        return files[0]
    if not path.exists():
        raise mistake(where, "a run directory or a USD file", f"{str(path)!r}, which does not exist")
    return path


def open_stage(where: str, path: Path) -> Any:
    """The stage in a USD file.

    Raises:
        InputError: it is not USD, or truncated, or a layer it needs is missing.
    """
    try:
        stage = Usd.Stage.Open(str(path))
    except Tf.ErrorException as error:
        raise InputError(
            f"{where}: {path}: expected a whole USD file, got one that does not open{_why(error)}"
        ) from error
    problems = stage.GetCompositionErrors()
    if problems:
        raise InputError(f"{where}: {path}: expected a whole USD stage, got one with a missing layer; {problems[0]}")
    return stage


def open_run(where: str, path: Path) -> tuple[Path, Any, list[float]]:
    """The USD file of a run, its stage, and the physical times of its frames [s].

    Raises:
        InputError: there is no such file, it does not open, or it has no frames.
    """
    file = usd_file(where, path)
    stage = open_stage(where, file)
    times = frame_times(stage)
    if not times:
        raise mistake(where, "the USD file of a run, with frames", f"{str(file)!r}, which has none")
    return file, stage, times


def checked_frame(where: str, frame: int, times: list[float]) -> int:
    """The number of a frame that is there.

    Raises:
        InputError: there is no such frame.
    """
    if not 0 <= frame < len(times):
        raise mistake(f"{where}: --frame", f"one of 0 to {len(times) - 1}", frame)
    return frame


def frame_times(stage: Any) -> list[float]:
    """Physical time of every frame [s]; time codes count the frames. Empty if the stage is not that of a run."""
    prim = stage.GetDefaultPrim()
    time = prim.GetAttribute("blast:time") if prim else None
    if not time or not time.HasValue() or not time.GetTimeSamples():
        return []
    return [time.Get(code) for code in range(round(stage.GetEndTimeCode()) + 1)]


def segments_of(curves: Any, frame: int) -> tuple[np.ndarray, np.ndarray]:
    """The points (n, 3) float32 [m] of linear curves, where they are in the world, and the pairs (m, 2) to be joined.

    Args:
        curves: a UsdGeom.BasisCurves, with one polyline or several.
        frame: the time code.
    """
    counts = np.asarray(curves.GetCurveVertexCountsAttr().Get(frame) or (), dtype=np.int64)
    points = np.asarray(curves.GetPointsAttr().Get(frame) or (), dtype=np.float64).reshape(-1, 3)
    to_world = np.asarray(curves.ComputeLocalToWorldTransform(frame))  # for rows
    start = np.delete(np.arange(len(points)), np.cumsum(counts) - 1)  # all but the last of each polyline
    return (points @ to_world[:3, :3] + to_world[3, :3]).astype(np.float32), np.stack([start, start + 1], axis=1)


def _why(error: Exception) -> str:
    text = str(error)
    if "truncated" in text:
        return ": it is corrupt, possibly truncated"
    if "Cannot determine file format" in text:
        return ": its format is unknown"
    return ""
