"""Closed surface meshes from files: STL, OBJ, PLY and Gmsh, read through meshio."""

import contextlib
import io
import re
import warnings
from pathlib import Path
from stat import S_ISREG
from tempfile import TemporaryDirectory

import meshio
import numpy as np

from warp_mpm.checks import as_path, mistake, positive
from warp_mpm.geometry import Mesh

UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": 0.0254, "ft": 0.3048}  # [m]
FORMATS = {".stl": "stl", ".obj": "obj", ".ply": "ply", ".msh": "gmsh"}

# What a file of the format has if it is whole: without it readers go on for ever, or take the part for the whole.
ENDINGS = {".ply": b"end_header", ".msh": b"$EndElements"}

CORNERS = {"triangle": 3, "quad": 4, "tetra": 4}
QUAD_HALVES = [[0, 1, 2], [0, 2, 3]]
TETRAHEDRON_SIDES = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]  # counter-clockwise seen from outside
IGNORED = ("vertex", "line")  # cells that are no part of a surface


def load_mesh(path: str | Path, *, unit: str | float = "m") -> Mesh:
    """Read a solid from a file with its closed surface.

    Triangles and quadrilaterals are its surface; where there are tetrahedra, their boundary is. Vertices at the same
    place are merged. Nothing in the file is executed.

    Args:
        path: an STL, OBJ, PLY or Gmsh (.msh) file.
        unit: of the file's coordinates: "m", "cm", "mm", "um", "in", "ft", or a number of metres.

    Raises:
        InputError: there is no such file, it cannot be read, or what is in it is not one closed surface whose faces
            look outwards (see `Mesh`).
    """
    where = f"mesh {str(as_path('mesh', path))!r}"
    length = _length(where, unit)
    points, cells = _read(where, path)
    with np.errstate(over="ignore"):  # what becomes infinite is refused
        vertices = length * points
    return Mesh(vertices, _faces(where, points, cells), where)


def _length(where: str, unit: str | float) -> float:
    """A unit of length [m]."""
    if not isinstance(unit, str):
        return positive(f"{where}: unit", unit)
    if unit not in UNITS:
        raise mistake(f"{where}: unit", f"a number of metres or one of {', '.join(UNITS)}", repr(unit))
    return UNITS[unit]


def _read(where: str, path: str | Path) -> tuple[np.ndarray, list[meshio.CellBlock]]:
    """Points (n, 3) and cells of a file. That meshio may end the program does not get out."""
    suffix = Path(path).suffix.lower()
    if suffix not in FORMATS:
        raise mistake(where, f"a file that ends in {', '.join(FORMATS)}", repr(suffix))
    try:
        if not S_ISREG(Path(path).stat().st_mode):  # reading from a device or a pipe may never end
            raise mistake(where, "a file", "something else")
        content = Path(path).read_bytes()
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or f"{error}"
        raise mistake(where, "a file that can be read", reason[:1].lower() + reason[1:]) from error
    _check_whole(where, suffix, content)
    try:
        with TemporaryDirectory() as directory:
            copy = Path(directory) / f"mesh{suffix}"  # of what was checked, whatever becomes of the file
            copy.write_bytes(_plain(content) if suffix == ".stl" and _is_stl_text(content) else content)
            mesh = _quietly_read(copy, FORMATS[suffix])
        points = np.array(mesh.points, dtype=float)
    except (Exception, SystemExit) as error:
        reason = "" if isinstance(error, SystemExit) else f": {' '.join(f'{error}'.split()) or type(error).__name__}"
        raise mistake(
            where,
            f"a whole {suffix[1:].upper()} file",
            f"one that meshio cannot read{reason}",
            "it may be truncated or damaged; export it again",
        ) from error
    if points.ndim == 2 and suffix == ".obj":
        points = points[:, :3]  # colours may follow the coordinates
    return points, mesh.cells


def _quietly_read(path: Path, file_format: str) -> meshio.Mesh:
    """What meshio reads, without what it prints."""
    said = io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return meshio.read(path, file_format=file_format)


def _plain(content: bytes) -> bytes:
    """An STL file of text as meshio likes it: in small letters, without empty lines."""
    lines = (line.strip().lower() for line in content.splitlines())
    return b"\n".join(line for line in lines if line)


def _is_stl_text(content: bytes) -> bool:
    """Whether an STL file is one of text; some binary ones start like that too."""
    return content.lstrip()[:5].lower() == b"solid" and len(content) != 84 + 50 * _stl_count(content)


def _stl_count(content: bytes) -> int:
    """Triangles that a binary STL file says it has."""
    return int.from_bytes(content[80:84], "little")


def _check_whole(where: str, suffix: str, content: bytes) -> None:
    """Refuse what would keep a reader busy for ever."""
    ending = ENDINGS.get(suffix, b"")
    if not content or ending not in content:
        got = f"one without {ending.decode()}" if content else "an empty file"
        raise mistake(where, f"a whole {suffix[1:].upper()} file", got, "it may be truncated; export it again")
    if suffix == ".stl" and not _is_stl_text(content) and len(content) != 84 + 50 * _stl_count(content):
        got = f"{len(content)} bytes for {_stl_count(content)} triangles"
        raise mistake(where, "a whole STL file", got, "it may be truncated; export it again")
    if suffix == ".ply":
        header = content[: content.index(ending)]
        for name, count in re.findall(rb"element\s+(\w+)\s+(\d+)", header):
            if int(count) > len(content):
                got = f"{int(count)} of {name.decode()} in {len(content)} bytes"
                raise mistake(where, "a whole PLY file", got, "it may be truncated; export it again")


def _faces(where: str, points: np.ndarray, cells: list[meshio.CellBlock]) -> np.ndarray:
    """The triangles (m, 3) of a surface, indices of points."""
    found: dict[str, list[np.ndarray]] = {}
    for block in cells:
        if block.type not in IGNORED and len(block.data):
            found.setdefault(block.type, []).append(block.data)
    unknown = set(found) - set(CORNERS)
    if unknown:
        expected = "triangles, quadrilaterals or tetrahedra"
        raise mistake(where, expected, ", ".join(sorted(unknown)), "export a surface of triangles")
    for kind, blocks in found.items():
        for block in blocks:
            if np.shape(block)[1:] != (CORNERS[kind],):
                raise mistake(where, f"{CORNERS[kind]} corners for each {kind}", f"{len(block)} of other numbers")
    if "tetra" in found:
        return _boundary(where, points, np.concatenate(found["tetra"]).astype(np.int64))
    triangles = found.get("triangle", [])
    halves = [block[:, QUAD_HALVES].reshape(-1, 3) for block in found.get("quad", [])]
    return np.concatenate([*triangles, *halves]).astype(np.int64) if found else np.empty((0, 3), dtype=np.int64)


def _boundary(where: str, points: np.ndarray, tetrahedra: np.ndarray) -> np.ndarray:
    """The sides of tetrahedra (n, 4) that belong to one of them alone, (m, 3), counter-clockwise seen from outside."""
    if tetrahedra.min() < 0 or tetrahedra.max() >= len(points):
        got = f"{tetrahedra.min()} to {tetrahedra.max()}"
        raise mistake(where, f"cells between points 0 to {len(points) - 1}", got, "the file may be truncated")
    a, b, c, d = (points[corner, :3] for corner in tetrahedra.T)
    inverted = np.einsum("ij,ij->i", b - a, np.cross(c - a, d - a)) < 0.0
    tetrahedra[inverted] = tetrahedra[inverted][:, [0, 2, 1, 3]]
    sides = tetrahedra[:, TETRAHEDRON_SIDES].reshape(-1, 3)
    _, first, count = np.unique(np.sort(sides, axis=1), axis=0, return_index=True, return_counts=True)
    return sides[np.sort(first[count == 1])]
