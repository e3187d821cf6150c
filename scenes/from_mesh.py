"""A charge from a mesh: a ring from an STL file, lit at one side; or any file of yours."""

import math
from pathlib import Path
from tempfile import TemporaryDirectory

import meshio
import numpy as np

from warp_mpm.builder import SceneBuilder
from warp_mpm.checks import mistake, not_negative
from warp_mpm.detonators import PointDetonator
from warp_mpm.geometry import Mesh
from warp_mpm.material_library import find_material
from warp_mpm.mesh_files import load_mesh
from warp_mpm.scene import Scene, Wall, Walls

RING, TUBE = 60.0, 20.0  # radii of the ring and of its tube [mm]
AROUND, ACROSS = 96, 32  # vertices
PICTURES = 6


def scene(
    *,
    mesh: str = "",
    unit: str = "mm",
    material: str = "ammonium_nitrate",
    cell_size: float = 4e-3,
    room: float = 0.02,
    particles_per_axis: int = 2,
    end_time: float = 75e-6,
) -> Scene:
    """An explosive in the shape of a closed surface, free in a vacuum, lit where its x is least.

    Args:
        mesh: an STL, OBJ, PLY or Gmsh file; without one the ring that `write_ring` makes.
        unit: of its coordinates.
        material: an explosive of the library, by its name; without one the paper's.
        cell_size: wanted [m].
        room: around it [m].
        particles_per_axis: particles along each axis of every cell.
        end_time: [s].
    """
    solid = load_mesh(mesh, unit=unit) if mesh else _ring(unit)
    explosive = find_material(material)
    if explosive.burn is None:
        raise mistake("material", "an explosive", repr(material), "'warp-mpm materials' lists them")
    lower, upper = solid.bounds()
    first, last = (solid.vertices[index(solid.vertices[:, 0])] for index in (np.argmin, np.argmax))

    builder = SceneBuilder("from_mesh")
    builder.domain(lower, upper, cell_size=cell_size, margins=not_negative("room", room))
    builder.walls(Walls.all(Wall.OPEN))
    builder.charge(solid, explosive, particles_per_axis=particles_per_axis, name="body")
    builder.detonator(PointDetonator(tuple(first)))
    builder.line(first, last)
    builder.section(2, _middle_height(solid))
    builder.gauge(last, name="opposite", moving=True)
    builder.end_time(end_time)
    builder.picture_times(end_time * part / PICTURES for part in range(1, PICTURES + 1))
    return builder.build()


def write_ring(path: str | Path) -> None:
    """Write a ring about the z axis, in millimetres, to an STL file."""
    long, short = np.meshgrid(*(2.0 * math.pi * np.arange(n) / n for n in (AROUND, ACROSS)), indexing="ij")
    reach = RING + TUBE * np.cos(short)
    points = np.stack([reach * np.cos(long), reach * np.sin(long), TUBE * np.sin(short)], axis=-1).reshape(-1, 3)
    a = np.arange(AROUND * ACROSS).reshape(AROUND, ACROSS)
    b, d = np.roll(a, -1, axis=0), np.roll(a, -1, axis=1)
    c = np.roll(b, -1, axis=1)
    faces = np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)
    meshio.write(path, meshio.Mesh(points, {"triangle": faces}), file_format="stl", binary=True)


def _middle_height(solid: Mesh) -> float:
    """Half-way up the mesh, or where nothing is there half-way up its tallest part [m]: the section cuts matter."""
    heights = solid.vertices[solid.faces][..., 2]
    order = np.argsort(heights.min(axis=1))
    lower, reach = heights.min(axis=1)[order], np.maximum.accumulate(heights.max(axis=1)[order])
    above_gap = np.flatnonzero(lower[1:] > reach[:-1]) + 1  # the first faces of parts that have nothing below them
    begins, ends = lower[[0, *above_gap]], reach[[*(above_gap - 1), -1]]
    middle = 0.5 * (begins[0] + ends[-1])
    tallest = int(np.argmax(ends - begins))
    inside = np.any((begins < middle) & (middle < ends))
    return float(middle if inside else 0.5 * (begins[tallest] + ends[tallest]))


def _ring(unit: str) -> Mesh:
    with TemporaryDirectory() as directory:
        path = Path(directory) / "ring.stl"
        write_ring(path)
        return load_mesh(path, unit=unit)
