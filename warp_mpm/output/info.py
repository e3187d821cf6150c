"""Says what a run directory or a USD file holds."""

import csv
import io
import math
import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Usd, UsdGeom
from rich.console import Console

from warp_mpm.errors import InputError
from warp_mpm.output.checkpoint import checkpoint_files
from warp_mpm.output.tables import GAUGE_COLUMNS, print_summary
from warp_mpm.output.usd_files import usd_files
from warp_mpm.output.usd_reading import frame_times, open_stage, usd_file
from warp_mpm.run_directory import Run

MICROSECOND = 1e-6  # [s]
COMPLETE = "complete"  # status of a run that came to its end
RUNNING = "running"  # of one that goes on, and for ever of one that was killed
GAUGE_MARK = f"_{GAUGE_COLUMNS[0]}"  # ends one column of every gauge
WIDTH = 100  # of the text, in characters


def describe(path: str | Path) -> str:
    """Describe a run directory (its figures, files, frames and fields) or a USD file (its prims, frames and fields).

    Raises:
        InputError: there is no such file, or it is neither, or it is damaged.
    """
    path = Path(path)
    if path.is_dir():
        return _describe_run(path)
    file = usd_file("info", path)
    return "\n".join([f"{file.name}  {_size(file)}", *_usd_lines(open_stage("info", file))])


def _describe_run(directory: Path) -> str:
    summary = directory / "summary.json"
    stages = usd_files(directory)
    if not summary.exists() and not stages:
        raise InputError(
            f"info: expected a run directory with summary.json or a USD file, got {str(directory)!r}, which has neither"
        )
    parts = [_summary_text(summary) if summary.exists() else f"{directory}: no summary.json, the run did not end"]
    files = [file for file in sorted(directory.rglob("*")) if file.is_file() and file.parent.name != "clips"]
    width = max(len(str(file.relative_to(directory))) for file in files)
    lines = (f"{file.relative_to(directory)!s:{width}}  {_size(file):>9}  {_table_note(file)}" for file in files)
    parts.append("\n".join(line.rstrip() for line in lines))
    for file in stages[:1]:  # further ones, such as a package, hold the same
        stage = open_stage("info", file)
        shapes = (prim for prim in stage.Traverse() if prim.IsA(UsdGeom.PointBased))
        parts.append("\n".join([f"{file.name}: {_time_line(stage)}", *_prim_lines(shapes)]))
    return "\n\n".join(parts)


def _summary_text(path: Path) -> str:
    summary = Run(path.parent, None).summary
    status = summary.get("status", COMPLETE)
    checkpoints = checkpoint_files(path.parent)
    resume = f"; --resume goes on from {checkpoints[0].name}" if checkpoints else ""
    if status == RUNNING:
        return f"{summary.get('scene', path.parent)}: the run goes on, or was killed{resume}"
    text = io.StringIO()
    print_summary(summary, Console(file=text, width=WIDTH))
    ended = "" if status == COMPLETE else f"\nthe run did not come to its end: {status}{resume}"
    return text.getvalue().rstrip() + ended


def _table_note(file: Path) -> str:
    """Rows of a table of a run, the times they span, and the gauges that have columns in it."""
    if file.suffix != ".csv":
        return ""
    try:
        with file.open(newline="", encoding="utf-8") as lines:
            header, *rows = [*csv.reader(lines)] or [[]]
    except (ValueError, csv.Error):
        return "not a table"
    rows = [row for row in rows if len(row) == len(header)]  # a killed run may have left part of one
    if header[:1] != ["time_s"] or not rows:
        return f"{len(rows)} rows"
    first, last = (float(row[0]) / MICROSECOND for row in (rows[0], rows[-1]))
    gauges = [name.removesuffix(GAUGE_MARK) for name in header if name.endswith(GAUGE_MARK)]
    named = f": {', '.join(gauges)}" if file.name == "gauges.csv" else ""
    return f"{len(rows)} rows, {first:.1f} to {last:.1f} µs{named}"


def _usd_lines(stage: Any) -> Iterator[str]:
    """What the stage says of itself, then a line for each prim and each of its fields."""
    default = stage.GetDefaultPrim()
    yield (
        f"  default prim {default.GetPath() if default else 'none'}, up axis {UsdGeom.GetStageUpAxis(stage)}, "
        f"{UsdGeom.GetStageMetersPerUnit(stage):g} m per unit, {stage.GetTimeCodesPerSecond():g} time codes per second"
    )
    yield f"  {_time_line(stage)}"
    for key, value in sorted(stage.GetRootLayer().customLayerData.items()):
        yield f"  {key}: {value}"
    yield from _prim_lines(stage.Traverse())


def _prim_lines(prims: Iterable[Any]) -> Iterator[str]:
    """A line for each prim and each of its fields."""
    for prim in prims:
        yield f"{prim.GetPath()}  {prim.GetTypeName()}{_prim_note(prim)}"
        for primvar in UsdGeom.PrimvarsAPI(prim).GetPrimvarsWithAuthoredValues():
            yield f"    {primvar.GetPrimvarName():18} {_primvar_note(primvar)}"


def _time_line(stage: Any) -> str:
    """Number of frames and their times."""
    times = frame_times(stage)
    if not times:
        return f"time codes {stage.GetStartTimeCode():g} to {stage.GetEndTimeCode():g}"
    first, last = times[0] / MICROSECOND, times[-1] / MICROSECOND
    return f"{len(times)} frames, time codes 0 to {len(times) - 1}, {first:.1f} to {last:.1f} µs"


def _prim_note(prim: Any) -> str:
    """Number of points, or where and when a detonator lights."""
    ignition = prim.GetAttribute("blast:ignitionTime")
    if ignition:
        x, y, z = UsdGeom.Xformable(prim).GetLocalTransformation().ExtractTranslation()
        return f"  at ({x:g}, {y:g}, {z:g}) m, lit at {ignition.Get() / MICROSECOND:g} µs"
    if prim.IsA(UsdGeom.PointBased):
        points = UsdGeom.PointBased(prim).GetPointsAttr()
        changing = prim.IsA(UsdGeom.Mesh) and points.GetTimeSamples()
        counts = {len(points.Get(code) or ()) for code in changing or [Usd.TimeCode.EarliestTime()]}
        return f"  {' to '.join(f'{count:,}' for count in sorted({min(counts), max(counts)}))} points"
    return ""


def _primvar_note(primvar: Any) -> str:
    """Type, number of samples, and for numbers their range over all samples."""
    kind = f"{primvar.GetTypeName()!s:9} {primvar.GetInterpolation()}"
    if primvar.IsIndexed():
        samples = len(primvar.GetIndicesAttr().GetTimeSamples())
        return f"{kind}, {len(primvar.Get() or ())} values, indexed, {samples} samples"
    attribute = primvar.GetAttr()
    samples = attribute.GetTimeSamples()
    if attribute.GetRoleName():
        return f"{kind}, {len(samples)} samples"
    lower, upper = _range(attribute, samples or [Usd.TimeCode.Default()])
    unit = re.search(r"\[([^]]*)\]$", attribute.GetDocumentation())
    span = f", {lower:.4g} to {upper:.4g} {unit.group(1) if unit else ''}".rstrip() if lower <= upper else ""
    return f"{kind}, {len(samples)} samples{span}"


def _range(attribute: Any, codes: list[Any]) -> tuple[float, float]:
    """Least and greatest finite value, of vectors their length; (inf, -inf) if there is none."""
    lower, upper = math.inf, -math.inf
    for code in codes:
        values = np.asarray(attribute.Get(code))
        if not np.issubdtype(values.dtype, np.number):
            continue
        values = np.linalg.norm(values, axis=1) if values.ndim == 2 else values.astype(np.float64)
        finite = values[np.isfinite(values)]
        lower = float(finite.min(initial=lower))
        upper = float(finite.max(initial=upper))
    return lower, upper


def _size(path: Path) -> str:
    size = float(path.stat().st_size)
    for unit in ("B", "kB", "MB"):
        if size < 1000.0:
            return f"{size:.0f} {unit}" if unit == "B" else f"{size:.1f} {unit}"
        size /= 1000.0
    return f"{size:.1f} GB"
