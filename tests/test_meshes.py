"""Closed surfaces from files: what is read, what is refused, and that charges cut from them have exact masses."""

import math
import struct

import meshio
import numpy as np
import pytest
import trimesh
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as some
from scenes_for_tests import explosive, start
from solids_for_tests import RING, cube_mesh, ring_mesh

from warp_mpm.builder import SceneBuilder
from warp_mpm.cli import main
from warp_mpm.detonators import PointDetonator
from warp_mpm.errors import InputError
from warp_mpm.geometry import Box, Mesh
from warp_mpm.kernels.eos.ideal_gas import IdealGas
from warp_mpm.materials import Material
from warp_mpm.mesh_files import load_mesh

FORMATS = {
    "stl": ("stl", {"binary": True}),
    "ascii.stl": ("stl", {"binary": False}),
    "obj": ("obj", {}),
    "ply": ("ply", {"binary": True}),
    "ascii.ply": ("ply", {"binary": False}),
    "msh": ("gmsh", {}),
    "ascii.msh": ("gmsh", {"binary": False}),
    "22.msh": ("gmsh22", {"binary": False}),
}
GAS = Material("inert gas", density=3.0, equation_of_state=IdealGas(gamma=1.4), specific_energy=1e5)
BOTTOM, TOP = [[0, 1, 3, 2]], [[4, 6, 7, 5]]  # of the cube, along x


def write(path, vertices, cells, kind=None):
    """A file of these cells, by kinds of cells."""
    name, options = FORMATS[kind or path.name.partition(".")[2]]
    meshio.write(path, meshio.Mesh(np.asarray(vertices, dtype=float), cells), file_format=name, **options)
    return path


def refusal(action):
    with pytest.raises(InputError) as caught:
        action()
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize("kind", FORMATS)
def test_every_format_gives_the_same_solid(tmp_path, capfd, kind):
    """In millimetres; its volume is that of the vertices as the file has them, in single precision in an STL file."""
    vertices, faces = ring_mesh(100.0, 40.0)
    file = write(tmp_path / f"ring.{kind}", vertices, {"triangle": faces})
    capfd.readouterr()  # what meshio says while it writes
    ring = load_mesh(file, unit="mm")
    single = "stl" in kind
    assert (len(ring.vertices), len(ring.faces)) == (24 * 12, 24 * 24)
    assert ring.exact_volume() == pytest.approx(
        1e-9 * Mesh(vertices, faces).exact_volume(), rel=1e-6 if single else 1e-13
    )
    np.testing.assert_allclose(ring.bounds()[1], [0.14, 0.14, 0.04], rtol=1e-7)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("kind", ["stl_ascii", "stl", "obj", "ply"])
def test_what_another_program_wrote(tmp_path, kind):
    """trimesh ends its STL text with an empty line, which meshio alone takes for a line of no numbers."""
    file = tmp_path / f"torus.{kind[:3]}"
    torus = trimesh.creation.torus(1.0, 0.3)
    torus.export(file, file_type=kind)
    assert load_mesh(file).exact_volume() == pytest.approx(torus.volume, rel=1e-6)
    if kind == "stl_ascii":
        file.write_text(file.read_text().upper().replace("\n", "\r\n"))
        assert load_mesh(file).exact_volume() == pytest.approx(torus.volume, rel=1e-6)


@pytest.mark.parametrize(
    ("unit", "length"), [("m", 1.0), ("cm", 1e-2), ("mm", 1e-3), ("um", 1e-6), ("in", 0.0254), ("ft", 0.3048), (2, 2.0)]
)
def test_units(tmp_path, unit, length):
    cube = load_mesh(write(tmp_path / "cube.ply", cube_mesh()[0], {"triangle": cube_mesh()[1]}), unit=unit)
    assert cube.exact_volume() == pytest.approx(length**3, rel=1e-14)


def test_quadrilaterals_tetrahedra_and_what_is_no_surface(tmp_path):
    vertices, _ = cube_mesh()
    quads = [*BOTTOM, *TOP, [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    assert load_mesh(write(tmp_path / "cube.obj", vertices, {"quad": quads})).exact_volume() == pytest.approx(1.0)
    tetrahedra = [[0, 3, 5, 6], [0, 1, 3, 5], [0, 3, 2, 6], [0, 5, 4, 6], [3, 5, 6, 7]]  # either way round
    cells = {"tetra": tetrahedra, "triangle": [[0, 1, 3]], "line": [[0, 1]], "vertex": [[0]]}
    cube = load_mesh(write(tmp_path / "cube.msh", vertices, cells, "22.msh"))
    assert (cube.exact_volume(), len(cube.faces)) == (pytest.approx(1.0), 12)


def test_vertices_at_one_place_are_one_and_faces_without_extent_go():
    """As in STL files, which say each corner of each triangle again."""
    vertices, faces = cube_mesh()
    soup = vertices[faces].reshape(-1, 3)
    cube = Mesh(np.concatenate([soup, [[0, 0, 0], [9, 9, 9]]]), [*np.arange(36).reshape(-1, 3), [0, 36, 1]])
    assert (len(cube.vertices), len(cube.faces), cube.exact_volume()) == (8, 12, pytest.approx(1.0))
    np.testing.assert_array_equal(cube.bounds(), [[0, 0, 0], [1, 1, 1]])


def test_thin_and_fine_surfaces_do_not_cut_themselves():
    """Faces long for their width lie close to others that they share no vertex with."""
    needle = Mesh(cube_mesh()[0] * [1e-4, 1e-4, 1.0], cube_mesh()[1])
    assert needle.exact_volume() == pytest.approx(1e-8)
    wire = Mesh(*ring_mesh(1.0, 0.002, 200, 32))
    assert wire.exact_volume() == pytest.approx(2 * math.pi**2 * 0.002**2, rel=0.01)
    points = np.array([[1.0, 0.0, 0.0], [0.99, 0.0, 0.0], [0.0, 0.0, 0.0]])
    assert wire.contains(points).tolist() == [True, False, False]


def test_a_shell_is_hollow():
    """The inner surface looks into the hollow: the volume is that between them."""
    outer, inner = cube_mesh(), cube_mesh(0.25, 0.75)
    shell = Mesh(np.concatenate([outer[0], inner[0]]), np.concatenate([outer[1], inner[1][:, ::-1] + 8]))
    assert shell.exact_volume() == pytest.approx(1.0 - 0.125)
    assert shell.contains(np.array([[0.1, 0.1, 0.1], [0.5, 0.5, 0.5]])).tolist() == [True, False]


# ---- what is refused -------------------------------------------------------------------------------------------------


def cubes(*bounds, turned=False):
    """Several cubes as one surface; `turned` turns the last one inside out."""
    parts = [cube_mesh(*pair) for pair in bounds]
    faces = [part[1] + 8 * number for number, part in enumerate(parts)]
    if turned:
        faces[-1] = faces[-1][:, ::-1]
    return np.concatenate([part[0] for part in parts]), np.concatenate(faces)


VERTICES, FACES = cube_mesh()
ONE_FLIPPED = np.concatenate([FACES[:1, ::-1], FACES[1:]])
SURFACES = {
    "open": (VERTICES, FACES[1:], "got 3 open edges, the first near (0, 0, 0.5) m; close its holes"),
    "inverted": (VERTICES, FACES[:, ::-1], "got one whose faces look inwards (volume -1 m3); flip its faces"),
    "a face flipped": (VERTICES, ONE_FLIPPED, "got 3 edges whose faces disagree which side is outside, the first"),
    "without faces": (VERTICES, FACES[:0], "expected a surface of triangles, got none"),
    "without vertices": (VERTICES[:0], FACES, "expected a surface of triangles, got none"),
    "all at one place": (0 * VERTICES, FACES, "got triangles without extent"),
    "all on a line": (VERTICES * [0, 0, 1], FACES, "got triangles without extent"),
    "flat": (VERTICES * [0, 1, 1], FACES, "expected a closed surface, each edge shared by two faces, got"),
    "folded up": (VERTICES, np.concatenate([FACES[:1], FACES[:1, ::-1]]), "encloses a volume, got 0 m3; it is flat or"),
    "a face twice": (VERTICES, np.concatenate([FACES, FACES[:1]]), "got 3 edges at which more than two faces meet"),
    "two that share an edge": (
        np.concatenate([VERTICES, VERTICES + np.array([1, 1, 0])]),
        np.concatenate([FACES, FACES + 8]),
        "got 1 edges at which more than two faces meet, the first near (1, 1, 0.5) m; remove inner faces",
    ),
    "not a number": (VERTICES * [1, 1, math.nan], FACES, "expected three finite coordinates for each vertex"),
    "infinite": (np.where(VERTICES > 0, np.inf, 0), FACES, "expected three finite coordinates for each vertex"),
    "huge": (VERTICES * 1e200, FACES, "expected three finite coordinates for each vertex, below 1e+30 m"),
    "tiny": (VERTICES * 1e-200, FACES, "expected a surface that encloses a volume, got"),
    "in a plane": (VERTICES[:, :2], FACES, "expected three finite coordinates for each vertex"),
    "no such vertex": (VERTICES, FACES + 1, "expected faces between vertices 0 to 7, got 1 to 8"),
    "a vertex before the first": (VERTICES, FACES - 1, "expected faces between vertices 0 to 7, got -1 to 6"),
    "half a vertex": (
        VERTICES,
        FACES + 0.5,
        "expected three indices of vertices for each face, got shape (12, 3)",
    ),
    "texts": ("cube", FACES, "expected numbers for vertices and faces, got something else"),
    "two that overlap": (*cubes((0, 1), (0.5, 1.5)), "faces that cut others, the first near"),
    "one through the other": (
        np.concatenate([VERTICES, VERTICES * [0.2, 0.2, 3.0] + [0.4, 0.4, -1.0]]),
        np.concatenate([FACES, FACES + 8]),
        "faces that cut others, the first near",
    ),
    "one in the other": (*cubes((0, 1), (0.2, 0.8)), "got one around 1.22 m3 that has"),
    "one of two inverted": (*cubes((0, 1), (2, 2.5), turned=True), "that encloses its volume once, got one around"),
}


@pytest.mark.parametrize("name", SURFACES)
def test_surfaces_that_enclose_nothing_for_certain_are_refused(name):
    vertices, faces, message = SURFACES[name]
    text = refusal(lambda: Mesh(vertices, faces))
    assert text.startswith("Mesh: expected ")
    assert message in text


HEADER = b"ply\nformat ascii 1.0\nelement vertex %d\nproperty float x\nproperty float y\nproperty float z\n"
PLY = HEADER % 1 + b"element face %d\nproperty list uchar int vertex_indices\nend_header\n"
FILES = {
    "empty.stl": (b"", "expected a whole STL file, got an empty file"),
    "text.stl": (b"Guten Tag", "expected a whole STL file, got 9 bytes for 0 triangles; it may be truncated"),
    "words.stl": (b"solid x\nGuten Tag\n", "meshio cannot read: could not convert string to float: 'guten'"),
    "bytes.stl": (bytes(range(256)) * 4, "expected a whole STL file, got 1024 bytes for 1397903696 triangles"),
    "solid.stl": (b"solid" + bytes(range(256)), "expected a whole STL file, got one that meshio cannot read"),
    "nothing.stl": (b"solid x\nendsolid x\n", "expected a surface of triangles, got none"),
    "short.stl": (bytes(80) + struct.pack("<I", 9) + bytes(50), "expected a whole STL file, got 134 bytes for 9 tri"),
    "text.obj": (b"Guten Tag", "expected a surface of triangles, got none"),
    "points.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\n", "expected a surface of triangles, got none"),
    "words.obj": (b"v a b c\n", "got one that meshio cannot read: could not convert string to float: 'a'"),
    "ragged.obj": (b"v 0 0\nv 1 0 0\n", "got one that meshio cannot read"),
    "relative.obj": (
        b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf -1 -2 -3\n",
        "faces between vertices 0 to 2, got -4 to -2",
    ),
    "polygon.obj": (
        b"v 0 0 0\n" * 5 + b"f 1 2 3 4 5\n",
        "triangles, quadrilaterals or tetrahedra, got polygon",
    ),
    "header.ply": (HEADER % 3, "expected a whole PLY file, got one without end_header; it may be truncated"),
    "huge.ply": (PLY % 10**15, "expected a whole PLY file, got 1000000000000000 of face in"),
    "short.ply": (
        HEADER % 3
        + b"element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n0 1 0\n1 0 0\n4 0 1 2\n",
        "expected 4 corners for each quad, got 1 of other numbers",
    ),
    "text.ply": (b"end_header", "expected a whole PLY file, got one that meshio cannot read"),
    "text.msh": (b"Guten Tag", "expected a whole MSH file, got one without $EndElements"),
    "version.msh": (b"$MeshFormat\n9.9 0 8\n$EndMeshFormat\n$EndElements", "meshio cannot read: Need mesh format in"),
    "binary.msh": (b"$MeshFormat\n4.1 1 8\nxxxx\n$EndMeshFormat\n$EndElements", "got one that meshio cannot read"),
    "cube.step": (b"ISO-10303-21;", "expected a file that ends in .stl, .obj, .ply, .msh, got '.step'"),
    "none": (b"", "expected a file that ends in .stl, .obj, .ply, .msh, got ''"),
}


@pytest.mark.parametrize("name", FILES)
def test_files_that_are_no_meshes_are_one_line(tmp_path, capfd, name):
    content, message = FILES[name]
    (tmp_path / name).write_bytes(content)
    text = refusal(lambda: load_mesh(tmp_path / name))
    assert text.startswith(f"mesh '{tmp_path / name}': expected ")
    assert message in text
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("name", ["bytes.stl", "header.ply", "version.msh", "polygon.obj"])
def test_the_command_line_says_it_in_one_line(tmp_path, capfd, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    (tmp_path / name).write_bytes(FILES[name][0])
    assert main(["run", "from_mesh", "--set", f"mesh={name}", "-o", "out"]) == 2
    output, error = capfd.readouterr()
    assert output == ""
    assert error.startswith(f"warp-mpm: scene from_mesh: mesh '{name}': expected ")
    assert error.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == [name]


def test_what_is_no_file_is_one_line(tmp_path):
    (tmp_path / "loop.stl").symlink_to("loop.stl")
    (tmp_path / "zero.stl").symlink_to("/dev/zero")
    (tmp_path / "directory.stl").mkdir()
    for name, got in {
        "missing.stl": "no such file or directory",
        "loop.stl": "",
        "zero.stl": "something else",
        "directory.stl": "something else",
        "\0.stl": "embedded null",
    }.items():
        assert f"got {got}" in refusal(lambda name=name: load_mesh(tmp_path / name))


def test_cells_that_are_not_flat_and_units_that_are_none(tmp_path):
    vertices, faces = cube_mesh()
    hexahedron = write(tmp_path / "cube.msh", vertices, {"hexahedron": [[0, 4, 6, 2, 1, 5, 7, 3]]})
    assert "expected triangles, quadrilaterals or tetrahedra, got hexahedron" in refusal(lambda: load_mesh(hexahedron))
    cube = write(tmp_path / "cube.stl", vertices, {"triangle": faces})
    assert "unit: expected a number of metres or one of m, cm" in refusal(lambda: load_mesh(cube, unit="parsec"))
    assert "unit: expected a positive number, got 0" in refusal(lambda: load_mesh(cube, unit=0))


# A changed number in a binary Gmsh file can ask meshio for tens of GB: that ends in one line too, but takes a minute.
DAMAGES = {kind: ("cut",) if kind == "msh" else ("cut", "flip", "zero", "digit") for kind in FORMATS}
FEW = settings(max_examples=60, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))


@pytest.mark.parametrize("kind", FORMATS)
def test_whatever_is_missing_or_changed_in_a_file_ends_in_one_line_or_a_solid(tmp_path_factory, kind):
    directory = tmp_path_factory.mktemp("meshes")
    whole = write(directory / f"whole.{kind}", VERTICES, {"triangle": FACES}).read_bytes()
    damaged = directory / f"damaged.{kind}"

    @FEW
    @given(some.integers(0, len(whole) - 1), some.sampled_from(DAMAGES[kind]))
    def load(place, damage):
        changed = {"flip": bytes([whole[place] ^ 0xFF]), "zero": b"\0", "digit": b"9", "cut": b""}[damage]
        damaged.write_bytes(whole[:place] + changed + (b"" if damage == "cut" else whole[place + 1 :]))
        try:
            solid = load_mesh(damaged)
        except InputError as error:
            solid, message = None, str(error)
        assert "\n" not in message if solid is None else solid.exact_volume() > 0.0

    load()


# ---- charges ---------------------------------------------------------------------------------------------------------


def builder_with(solid, cell_size=0.1):
    builder = SceneBuilder("meshes")
    builder.domain((-2, -2, -1), (2, 2, 1), cell_size=cell_size)
    builder.charge(solid, GAS, name="body")
    builder.end_time(1e-3)
    return builder


def test_the_mass_of_a_charge_is_that_of_its_mesh_and_of_what_surrounds_it():
    ring = Mesh(*ring_mesh(1.0, 0.4))
    builder = builder_with(ring)
    builder.charge(Box((-2, -2, -1), (2, 2, 1)), GAS, name="around")
    scene = builder.build()
    body, around = scene.charges
    assert body.mass == pytest.approx(3.0 * ring.exact_volume(), rel=1e-14)
    assert body.particle_volume * len(body.positions) == pytest.approx(ring.exact_volume(), rel=1e-14)
    assert scene.mass == pytest.approx(3.0 * 32.0, rel=1e-14)
    assert (body.volume_tolerance, around.volume_tolerance) == (0.0, 0.0)
    assert len(body.positions) + len(around.positions) == scene.domain.cells[0] ** 2 * scene.domain.cells[2] * 8
    assert body.particle_volume == pytest.approx(0.05**3, rel=0.02)  # the lattice resolves the tube


def test_a_mesh_of_the_wrong_unit_is_told_so(tmp_path):
    cube = write(tmp_path / "cube.stl", 500 * VERTICES - 250, {"triangle": FACES})
    text = refusal(builder_with(load_mesh(cube)).build)
    assert "charge 'body': expected inside the domain, x from -2 to 2 m, got x from -250 to 250 m" in text
    assert text.endswith("and check its unit: lengths are in metres, load_mesh(path, unit='mm') reads others")
    assert builder_with(load_mesh(cube, unit="mm")).build().particle_count == 10**3
    text = refusal(builder_with(load_mesh(cube, unit="um")).build)
    assert "x extent 0.0005 m, got particles of 0.05 m; choose a smaller cell size, and check its unit" in text


def test_convex_surfaces_are_known():
    """Those of a cube and a cone, single precision or not; not that of a ring, nor one with a dent."""
    angles = 2.0 * np.pi * np.arange(36) / 36
    rim = np.stack([0.04 * np.cos(angles), 0.04 * np.sin(angles), np.zeros(36)], axis=1)
    vertices = np.concatenate([rim, [[0.0, 0.0, 0.06], [0.0, 0.0, 0.0]]])
    after = np.roll(np.arange(36), -1)
    faces = [*([k, after[k], 36] for k in range(36)), *([after[k], k, 37] for k in range(36))]
    assert Mesh(vertices, faces).convex
    assert Mesh(vertices.astype(np.float32), faces).convex
    assert Mesh(*cube_mesh()).rotated((1.0, 2.0, 3.0), 0.7).convex
    assert not RING.convex
    dented = vertices.copy()
    dented[37, 2] += 1e-4
    assert not Mesh(dented, faces).convex


def test_a_convex_surface_needs_no_grid_for_its_arrival_times(tmp_path):
    """A cube lit at a sharp edge: times are those of the straight way, to round-off."""
    builder = SceneBuilder("cube")
    builder.domain((0.0, 0.0, 0.0), (0.1, 0.1, 0.1), cell_size=0.01)
    corners, faces = cube_mesh()
    charge = Mesh(0.06 * corners, faces).translated((0.02, 0.02, 0.02))
    builder.charge(charge, explosive())
    builder.detonator(PointDetonator((0.02, 0.02, 0.05)))
    builder.end_time(1e-6)
    scene = builder.build()
    times = start(scene).state.field("arrival_time")
    ways = np.linalg.norm(scene.charges[0].positions - (0.02, 0.02, 0.05), axis=1)
    np.testing.assert_allclose(times, ways / 2800.0, rtol=1e-6)
