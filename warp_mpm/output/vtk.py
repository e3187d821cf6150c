"""Writes the frames of a run, finished or killed, as time series for ParaView and whatever else reads VTK's files.

    <name>.pvd              plays the particles: pressure [Pa], charge, further fields, and their ids
    <name>_section.pvd      plays the section plane: pressure [Pa]; one such file for every further surface
    <name>_frames/*.vtu     a file for each frame of each of them
    <name>_isochrones.vtu   curves, which do not change in time: arrival_time [s]; so for every set of them

The data come from the run's USD file, so the solver is not needed. A .pvd is written when its frames are there.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import meshio
import numpy as np
from pxr import UsdGeom

from warp_mpm.output.usd_reading import checked_frame, open_run, segments_of
from warp_mpm.output.whole_file import whole_file, write_error

PLAIN = "particles"  # the shape whose .pvd has no more than the name


def write_pvd(source: str | Path, target: str | Path, frame: int | None = None) -> Path:
    """Write a run as .pvd and .vtu files; what an earlier export left under the same name goes.

    Args:
        source: run directory or USD file.
        target: the .pvd file to be, or a directory, in which it gets the name of the run.
        frame: the only frame, counted from 0; all of them if not given.

    Returns:
        The .pvd file of the particles.

    Raises:
        InputError: the source is not the result of a run, or has no such frame.
        SimulationError: the disk is full or refuses.
    """
    file, stage, times = open_run("export", Path(source))
    codes = range(len(times)) if frame is None else [checked_frame("export", frame, times)]
    # A run that took fewer steps than frames were asked for repeats some: left out, because times have to rise.
    rising = {code: times[code] for code in codes if code == 0 or times[code] > times[code - 1]}
    path = Path(target)
    if path.suffix != ".pvd":
        path = path / f"{file.stem}.pvd"
    frames = path.with_name(f"{path.stem}_frames")
    shapes = [UsdGeom.PointBased(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.PointBased)]
    names = [shape.GetPrim().GetName() for shape in shapes]
    targets = [path if name == PLAIN else path.with_name(f"{path.stem}_{name}.pvd") for name in names]
    try:
        frames.mkdir(parents=True, exist_ok=True)
        for name, collection in zip(names, targets, strict=True):
            for old in (collection, collection.with_suffix(".vtu"), *frames.glob(f"{name}_*.vtu")):
                old.unlink(missing_ok=True)
    except OSError as error:
        raise write_error(path, error) from error
    for shape, name, collection in zip(shapes, names, targets, strict=True):
        if shape.GetPrim().IsA(UsdGeom.BasisCurves):
            _write_mesh(collection.with_suffix(".vtu"), _curves(UsdGeom.BasisCurves(shape.GetPrim()), codes[0]))
        else:
            _write_collection(collection, frames, name, rising, shape)
    return path


def _write_collection(path: Path, frames: Path, name: str, times: Mapping[int, float], shape: Any) -> None:
    """Write the frames of one shape, given by number and time [s], then the .pvd that plays them."""
    lines = []
    for code, time in times.items():
        file = frames / f"{name}_{code:05d}.vtu"
        _write_mesh(file, _mesh(shape, code))
        lines.append(f'<DataSet timestep="{time!r}" file={quoteattr(f"{frames.name}/{file.name}")}/>')
    text = "\n".join(
        [
            '<?xml version="1.0"?>',
            '<VTKFile type="Collection" version="0.1">',
            "<Collection>",
            *lines,
            "</Collection>",
            "</VTKFile>",
        ]
    )
    with whole_file(path) as part:
        part.write_text(f"{text}\n", encoding="utf-8")


def _write_mesh(path: Path, mesh: meshio.Mesh) -> None:
    with whole_file(path) as part:
        # Not compressed: packing takes longer than all the rest, and a disk is large.
        meshio.vtu.write(part, mesh, compression=None)


def _curves(curves: Any, code: int) -> meshio.Mesh:
    """Polylines as cells of two points each, which every reader knows."""
    points, segments = segments_of(curves, code)
    return meshio.Mesh(points, [("line", segments.astype(np.int32))], dict(_vertex_data(curves, code, len(points))))


def _mesh(shape: Any, code: int) -> meshio.Mesh:
    """A shape in a frame; empty where it is hidden.

    Of particles those that have left through an open face, which have no width, are left out.
    """
    if shape.ComputeVisibility(code) == UsdGeom.Tokens.invisible:
        return meshio.Mesh(np.empty((0, 3), np.float32), [])
    points = _array(shape.GetPointsAttr(), code).reshape(-1, 3)
    data = dict(_vertex_data(shape, code, len(points)))
    if not shape.GetPrim().IsA(UsdGeom.Points):
        return meshio.Mesh(points, list(_faces(UsdGeom.Mesh(shape.GetPrim()), code)), data)
    particles = UsdGeom.Points(shape.GetPrim())
    inside = _array(particles.GetWidthsAttr(), code) > 0.0
    data["id"] = _array(particles.GetIdsAttr(), code).astype(np.int32)
    if not inside.all():
        points, data = points[inside], {name: values[inside] for name, values in data.items()}
    return meshio.Mesh(points, [("vertex", np.arange(len(points), dtype=np.int32)[:, None])], data)


def _faces(mesh: Any, code: int) -> Iterator[tuple[str, np.ndarray]]:
    """The triangles and the quadrilaterals of a mesh, as meshio takes them."""
    counts = _array(mesh.GetFaceVertexCountsAttr(), code)
    corners = _array(mesh.GetFaceVertexIndicesAttr(), code)
    last = np.cumsum(counts)
    for count, kind in ((3, "triangle"), (4, "quad")):
        begins = last[counts == count] - count
        if len(begins):
            yield kind, corners[begins[:, None] + np.arange(count)].astype(np.int32)


def _vertex_data(shape: Any, code: int, count: int) -> Iterator[tuple[str, np.ndarray]]:
    """The primvars with one value a point, colours left out: ParaView has maps of its own."""
    for primvar in UsdGeom.PrimvarsAPI(shape).GetPrimvarsWithAuthoredValues():
        values = _array(primvar.GetAttr(), code)
        if not primvar.IsIndexed() and not primvar.GetAttr().GetRoleName() and len(values) == count:
            yield primvar.GetPrimvarName(), values


def _array(attribute: Any, code: int) -> np.ndarray:
    """An array attribute in a frame; empty if it has no value there."""
    values = attribute.Get(code)
    return np.asarray(() if values is None else values)
