"""What every USD file has to pass: the validators of others, and our own, which look where no validator does."""

import logging
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Usd, UsdGeom, UsdValidation

ALLOWED = {"float[]", "int[]", "float3[]", "color3f[]"}  # types of primvars that every viewer reads
SWITCHED_OFF = (
    # Colours are indexed, into a table that never changes, by indices that do. The first rule looks at the table alone,
    # and would have it indexed once more because a colour comes twice; and it would have fields indexed that happen to
    # have equal values in the first frame. The second wants every colour of the table used, in the first frame.
    "IndexedPrimvarChecker",
    "UnusedPrimvarChecker",
)


def assert_sound(path: Path, times: list[float]) -> None:
    """A file passes all checks, and has frames at these times [s]."""
    stage = Usd.Stage.Open(str(path))
    assert stage.GetCompositionErrors() == []
    assert validation_errors(stage) == []
    assert asset_validator_issues(path) == []
    assert list(faults(stage, times)) == []


def validation_errors(stage: Any) -> list[str]:
    """What the validators that come with USD find, all of them."""
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    assert len(validators) >= 28  # so many has USD 26.8, and 26.11 has 30
    return [error.GetMessage() for error in UsdValidation.ValidationContext(validators).Validate(stage)]


def has_asset_validator() -> bool:
    """Whether omniverse-asset-validator is installed; it is for Python up to 3.12."""
    return find_spec("omni") is not None and find_spec("omni.asset_validator") is not None


def asset_validator_issues(path: Path) -> list[str]:
    """What the rules of omniverse-asset-validator find, but for those that are switched off; nothing without it."""
    if not has_asset_validator():
        return []
    logging.getLogger("omni.asset_validator").setLevel(logging.WARNING)
    from omni import asset_validator

    engine = asset_validator.ValidationEngine()
    for name in SWITCHED_OFF:
        engine.disable_rule(getattr(asset_validator, name))
    return [f"{issue.rule.__name__}: {issue.message}" for issue in engine.validate(str(path)).issues()]


def faults(stage: Any, times: list[float]) -> Iterator[str]:
    """What is wrong with times, lengths, numbers and extents; nothing if all is well."""
    codes = [float(index) for index in range(len(times))]
    clock = stage.GetAttributeAtPath("/World.blast:time")
    if [clock.Get(code) for code in codes] != times or times != sorted(set(times)):
        yield f"blast:time: not {times}, or not rising"
    if (stage.GetStartTimeCode(), stage.GetEndTimeCode()) != (codes[0], codes[-1]):
        yield "time codes: not those of the frames"
    for prim in stage.Traverse():
        for attribute in prim.GetAuthoredAttributes():
            where = str(attribute.GetPath())
            found = sample_codes(attribute)
            if found not in ([], codes):
                yield f"{where}: samples at {found}"
            for code in found or [Usd.TimeCode.Default()]:
                value = attribute.Get(code)
                if found and value is None:
                    yield f"{where}: no value at {code}"
                elif is_numeric(value) and not np.isfinite(np.array(value)).all():
                    yield f"{where}: not finite at {code}"
        if prim.IsA(UsdGeom.PointBased):
            yield from (f"{prim.GetPath()} at {code}: {fault}" for code in codes for fault in shape_faults(prim, code))


def shape_faults(prim: Any, code: float) -> Iterator[str]:
    """What is wrong with the lengths, the indices and the extent of points or a mesh at a time code."""
    shape = UsdGeom.PointBased(prim)
    points = np.array(shape.GetPointsAttr().Get(code)).reshape(-1, 3)
    half = np.zeros((len(points), 1))
    if prim.IsA(UsdGeom.Points):
        widths, ids = np.array(UsdGeom.Points(prim).GetWidthsAttr().Get(code)), UsdGeom.Points(prim).GetIdsAttr().Get()
        if not len(widths) == len(ids) == len(points):
            yield f"{len(points)} points, {len(widths)} widths, {len(ids)} ids"
        half = 0.5 * widths[:, None]
    if prim.IsA(UsdGeom.Mesh):
        counts = np.array(UsdGeom.Mesh(prim).GetFaceVertexCountsAttr().Get(code))
        corners = np.array(UsdGeom.Mesh(prim).GetFaceVertexIndicesAttr().Get(code))
        if counts.sum() != len(corners) or not within(corners, len(points)):
            yield "faces that do not fit the points"
    if sample_codes(shape.GetExtentAttr()) != sample_codes(shape.GetPointsAttr()):
        yield "extent not sampled as the points are"
    lower, upper = np.array(shape.GetExtentAttr().Get(code))
    slack = 1e-6 * np.abs(points).max()  # round-off
    if (points - half < lower - slack).any() or (points + half > upper + slack).any():
        yield "points outside of the extent"
    for primvar in UsdGeom.PrimvarsAPI(prim).GetPrimvarsWithAuthoredValues():
        yield from (f"{primvar.GetPrimvarName()}: {fault}" for fault in primvar_faults(primvar, code, len(points)))


def primvar_faults(primvar: Any, code: float, count: int) -> Iterator[str]:
    """What is wrong with the type, the length and the indices of a primvar of a shape with so many points."""
    if str(primvar.GetTypeName()) not in ALLOWED:
        yield f"of type {primvar.GetTypeName()}"
    values = primvar.Get(code)
    indices = primvar.GetIndices(code) if primvar.IsIndexed() else range(len(values))
    expected = {"vertex": count, "constant": 1}[primvar.GetInterpolation()]
    if len(indices) != expected:
        yield f"{len(indices)} values, expected {expected}"
    if not within(np.array(indices), len(values)):
        yield f"indices beyond the {len(values)} values"


def within(indices: np.ndarray, count: int) -> bool:
    """Whether all are indices of so many things."""
    return bool(((indices >= 0) & (indices < count)).all())


def is_numeric(value: Any) -> bool:
    """Whether a value is a number, or an array of numbers or vectors."""
    return np.issubdtype(np.array(value).dtype, np.number)


def sample_codes(attribute: Any) -> list[float]:
    """Time codes of an attribute's samples; USD 26.8 adds one just before that of a lone clip, at -4e-9."""
    return sorted({round(code, 6) for code in attribute.GetTimeSamples()})
