"""Says what a run directory or a USD file holds."""

import io
import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Tf, Usd, UsdGeom
from rich.console import Console

from warp_mpm.errors import InputError
from warp_mpm.output.tables import print_summary

MICROSECOND = 1e-6  # [s]
USD_SUFFIXES = (".usd", ".usda", ".usdc", ".usdz")
WIDTH = 100  # of the text, in characters


def describe(path: str | Path) -> str:
    """Describe a run directory (its figures, files and frames) or a USD file (its prims, frames, fields and ranges).

    Raises:
        InputError: there is no such file, or it is neither, or it is damaged.
    """
    path = Path(path)
    if path.is_dir():
        return _describe_run(path)
    if not path.exists():
        raise InputError(f"info: expected a run directory or a USD file, got {str(path)!r}, which does not exist")
    return "\n".join([f"{path.name}  {_size(path)}", *_usd_lines(_open(path))])


def _describe_run(directory: Path) -> str:
    summary = directory / "summary.json"
    stages = [file for file in sorted(directory.iterdir()) if file.suffix in USD_SUFFIXES]
    if not summary.exists() and not stages:
        raise InputError(
            f"info: expected a run directory with summary.json or a USD file, got {str(directory)!r}, which has neither"
        )
    parts = [_summary_text(summary) if summary.exists() else f"{directory}: no summary.json, the run did not end"]
    files = [file for file in sorted(directory.rglob("*")) if file.is_file() and file.parent.name != "clips"]
    width = max(len(str(file.relative_to(directory))) for file in files)
    parts.append("\n".join(f"{file.relative_to(directory)!s:{width}}  {_size(file):>9}" for file in files))
    parts += [f"{stage.name}: {_time_line(_open(stage))}" for stage in stages]
    return "\n\n".join(parts)


def _summary_text(path: Path) -> str:
    try:
        summary = json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise InputError(f"info: {path}: expected JSON, got something else ({error}); run the scene again") from error
    text = io.StringIO()
    print_summary(summary, Console(file=text, width=WIDTH))
    return text.getvalue().rstrip()


def _open(path: Path) -> Any:
    """The stage in a USD file.

    Raises:
        InputError: it is not USD, or truncated, or a layer it needs is missing.
    """
    try:
        stage = Usd.Stage.Open(str(path))
    except Tf.ErrorException as error:
        raise InputError(f"info: {path}: expected a whole USD file, got one that does not open{_why(error)}") from error
    problems = stage.GetCompositionErrors()
    if problems:
        raise InputError(f"info: {path}: expected a whole USD stage, got one with a missing layer; {problems[0]}")
    return stage


def _why(error: Exception) -> str:
    text = str(error)
    if "truncated" in text:
        return ": it is corrupt, possibly truncated"
    if "Cannot determine file format" in text:
        return ": its format is unknown"
    return ""


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
    for prim in stage.Traverse():
        yield f"{prim.GetPath()}  {prim.GetTypeName()}{_prim_note(prim)}"
        for primvar in UsdGeom.PrimvarsAPI(prim).GetPrimvarsWithAuthoredValues():
            yield f"    {primvar.GetPrimvarName():18} {_primvar_note(primvar)}"


def _time_line(stage: Any) -> str:
    """Number of frames and their times."""
    prim = stage.GetDefaultPrim()
    codes = prim.GetAttribute("blast:time").GetTimeSamples() if prim and prim.HasAttribute("blast:time") else []
    if not codes:
        return f"time codes {stage.GetStartTimeCode():g} to {stage.GetEndTimeCode():g}"
    first, last = (prim.GetAttribute("blast:time").Get(code) / MICROSECOND for code in (codes[0], codes[-1]))
    return f"{len(codes)} frames, time codes {codes[0]:g} to {codes[-1]:g}, {first:.1f} to {last:.1f} µs"


def _prim_note(prim: Any) -> str:
    """Number of points, or where and when a detonator lights."""
    ignition = prim.GetAttribute("blast:ignitionTime")
    if ignition:
        x, y, z = UsdGeom.Xformable(prim).GetLocalTransformation().ExtractTranslation()
        return f"  at ({x:g}, {y:g}, {z:g}) m, lit at {ignition.Get() / MICROSECOND:g} µs"
    if prim.IsA(UsdGeom.PointBased):
        points = UsdGeom.PointBased(prim).GetPointsAttr().Get(Usd.TimeCode.EarliestTime())
        return f"  {len(points or ()):,} points"
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
    span = f", {lower:.4g} to {upper:.4g}" if lower <= upper else ""
    return f"{kind}, {len(samples)} samples{span}"


def _range(attribute: Any, codes: list[Any]) -> tuple[float, float]:
    """Least and greatest finite value, of vectors their length; (inf, -inf) if there is none."""
    lower, upper = math.inf, -math.inf
    for code in codes:
        values = np.asarray(attribute.Get(code))
        if not np.issubdtype(values.dtype, np.number):
            continue
        values = np.linalg.norm(values, axis=1) if values.ndim == 2 else values
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
