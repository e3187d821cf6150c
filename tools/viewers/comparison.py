"""What the viewers make of a USD file, compared with what is in it."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Usd, UsdGeom

from viewers.colors import pixels, share_in_map, share_of_true_particles
from viewers.environment import run_client

SHAPES = ("particles", "section")


@dataclass(frozen=True)
class Picture:
    """A frame as a viewer draws it, and how true it is."""

    report: dict[str, Any]  # what the client says of itself
    share_in_map: float  # of the pixels that are drawn, those in a colour of the map
    share_of_particles: float  # of those on the camera's side, that have their own colour


def storm(file: Path, frame: int, picture: Path, size: int = 400) -> Picture:
    """Have Storm draw a frame, `size` pixels across.

    Raises:
        MissingError: no environment, or no OpenGL.
        RuntimeError: Storm failed.
    """
    report = run_client("storm", file, "--frame", frame, "--size", size, "--picture", picture)
    return judged(report, file, frame, picture)


def blender(file: Path, frames: list[int], picture: Path, size: int = 400) -> tuple[Picture, dict[str, np.ndarray]]:
    """Have Blender import a file and draw the last of some frames, `size` pixels across.

    Returns:
        The picture, and the attributes that Blender has by "<frame>/<shape>/<attribute>".

    Raises:
        MissingError: no environment.
        RuntimeError: Blender failed.
    """
    values = picture.with_suffix(".npz")
    where = ("--values", values, "--size", size, "--picture", picture)
    report = run_client("blender", file, "--frames", *frames, *where)
    with np.load(values) as arrays:
        return judged(report, file, frames[-1], picture), dict(arrays)


def judged(report: dict[str, Any], file: Path, frame: int, picture: Path) -> Picture:
    """A picture that a client drew, with what it is worth."""
    drawn = pixels(picture)
    stage = Usd.Stage.Open(str(file))
    return Picture(report, share_in_map(drawn), share_of_true_particles(drawn, stage, frame))


def expected_values(file: Path, frames: Iterable[int]) -> dict[str, np.ndarray]:
    """What Blender should have, by "<frame>/<shape>/<attribute>", as pxr reads it."""
    stage = Usd.Stage.Open(str(file))
    values = {}
    for frame in frames:
        for name in SHAPES:
            shape = UsdGeom.PointBased(stage.GetPrimAtPath(f"/World/{name}"))
            primvars = UsdGeom.PrimvarsAPI(shape)
            color = np.array(primvars.GetPrimvar("displayColor").ComputeFlattened(frame))
            values[f"{frame}/{name}/position"] = np.array(shape.GetPointsAttr().Get(frame))
            values[f"{frame}/{name}/pressure"] = np.array(primvars.GetPrimvar("pressure").Get(frame))
            values[f"{frame}/{name}/displayColor"] = np.column_stack([color, np.ones(len(color), dtype=np.float32)])
        widths = UsdGeom.Points(stage.GetPrimAtPath("/World/particles")).GetWidthsAttr().Get(frame)
        values[f"{frame}/particles/radius"] = 0.5 * np.array(widths)
    return values
