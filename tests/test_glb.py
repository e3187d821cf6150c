"""The export for the web: a .glb is one frame of the run to another reader too, and keeps to the format's rules."""

import json
import struct

import numpy as np
import pytest
import trimesh
from pxr import Usd, UsdGeom, Vt
from scenes_for_tests import CELL, OPEN, block
from usd_frames import FRAMES, RANGE, TIMES, arrival_of, frame_of, open_scene, written

from warp_mpm.errors import InputError
from warp_mpm.output import colormap
from warp_mpm.output.export import export

EIGHT_BITS = 0.5 / 255.0  # trimesh rounds colours to 8 bits, some of its versions down
NUMBERS = {5126: np.float32, 5125: np.uint32}
WIDTHS = {"SCALAR": 1, "VEC3": 3}


@pytest.fixture(scope="module")
def scene():
    """A block whose particles may leave, as some do."""
    return block((5, 4, 3), walls=OPEN, margin_cells=1)


@pytest.fixture(scope="module")
def run(scene, tmp_path_factory):
    """A run directory with three frames."""
    directory = tmp_path_factory.mktemp("run")
    written(directory / "block.usdc", scene).close()
    return directory


def y_up(position):
    """Where a point of ours, whose z is up, lies where y is."""
    return np.column_stack([position[:, 0], position[:, 2], -position[:, 1]])


def colors(pressure):
    """Linear RGB of pressures."""
    return colormap.linear_table()[colormap.indices(pressure, *RANGE)]


def placed(path):
    """Geometries of a .glb by name, and the positions of their points in the world, as trimesh has them."""
    world = trimesh.load(path)
    graph = [(node, *world.graph[node]) for node in world.graph.nodes_geometry]
    return {
        node: (world.geometry[name], trimesh.transform_points(world.geometry[name].vertices, pose))
        for node, pose, name in graph
    }


def parsed(path):
    """The JSON of a .glb and its arrays by accessor, after a look at everything the container's rules ask for."""
    data = path.read_bytes()
    magic, version, length = struct.unpack_from("<4sII", data)
    assert (magic, version, length) == (b"glTF", 2, len(data))
    (size, kind) = struct.unpack_from("<I4s", data, 12)
    assert (kind, size % 4) == (b"JSON", 0)
    document = json.loads(data[20 : 20 + size])
    (rest, kind) = struct.unpack_from("<I4s", data, 20 + size)
    assert (kind, rest % 4, 28 + size + rest) == (b"BIN\0", 0, len(data))
    (buffer,) = document["buffers"]
    assert 0 <= rest - buffer["byteLength"] < 4
    arrays = []
    for accessor in document["accessors"]:
        view = document["bufferViews"][accessor["bufferView"]]
        number, width = NUMBERS[accessor["componentType"]], WIDTHS[accessor["type"]]
        assert view["byteOffset"] % 4 == 0
        assert view["byteLength"] == accessor["count"] * width * 4
        assert view["byteOffset"] + view["byteLength"] <= buffer["byteLength"]
        array = np.frombuffer(data, number, accessor["count"] * width, 28 + size + view["byteOffset"])
        arrays.append(array.reshape(-1, width))
    return document, arrays


@pytest.mark.parametrize("index", range(FRAMES))
def test_another_reader_sees_the_frame(scene, run, tmp_path, index):
    """Particles that are still there, and the section, in their places and colours, y up."""
    saved = frame_of(scene, index)
    path = export(run, tmp_path / "block.glb", index)
    assert path == tmp_path / "block.glb"
    shapes = placed(path)
    cloud, position = shapes["particles"]
    np.testing.assert_allclose(position, y_up(saved.position[saved.inside]), atol=1e-8)
    np.testing.assert_allclose(
        cloud.colors[:, :3] / 255.0, colors(saved.pressure[saved.inside]), atol=2 * EIGHT_BITS, rtol=0
    )
    mesh, position = shapes["section"]
    corners = np.array([scene.domain.lower, scene.domain.upper])
    corners[:, scene.section.axis] = scene.section.coordinate
    np.testing.assert_allclose(mesh.bounds, corners, atol=1e-8)
    np.testing.assert_allclose(np.sort(y_up(corners), axis=0), [position.min(axis=0), position.max(axis=0)], atol=1e-8)
    lengths = np.ptp(corners, axis=0)
    assert mesh.area == pytest.approx(np.prod(lengths[lengths > 0.0]), rel=1e-6)
    np.testing.assert_array_equal(mesh.visual.vertex_attributes["color"], colors(saved.section.ravel()))


def test_it_keeps_to_the_rules(scene, run, tmp_path):
    """Header, chunks, alignment, extents, colours that no light falsifies; and it says when it is and what it shows."""
    document, arrays = parsed(export(run, tmp_path / "block.glb", 2))
    assert document["asset"]["version"] == "2.0"
    assert document["extensionsUsed"] == ["KHR_materials_unlit"]
    for mesh in document["meshes"]:
        (primitive,) = mesh["primitives"]
        place, color = (primitive["attributes"][name] for name in ("POSITION", "COLOR_0"))
        np.testing.assert_array_equal(np.float32(document["accessors"][place]["min"]), arrays[place].min(axis=0))
        np.testing.assert_array_equal(np.float32(document["accessors"][place]["max"]), arrays[place].max(axis=0))
        assert len(arrays[place]) == len(arrays[color])
        assert arrays[color].min() >= 0.0
        assert arrays[color].max() <= 1.0
        assert document["materials"][primitive["material"]]["extensions"] == {"KHR_materials_unlit": {}}
    saved = frame_of(scene, 2)
    particles = document["meshes"][0]["primitives"][0]
    assert particles["mode"] == 0
    np.testing.assert_array_equal(arrays[particles["attributes"]["POSITION"]], saved.position[saved.inside])
    np.testing.assert_array_equal(arrays[particles["attributes"]["COLOR_0"]], colors(saved.pressure[saved.inside]))
    section = document["meshes"][1]["primitives"][0]
    assert section["mode"] == 4
    assert arrays[section["indices"]].max() < saved.section.size
    notes = document["scenes"][0]["extras"]
    assert notes == {"time_s": TIMES[2], "frame": 2, "color_map": "inferno", "color_range_pa": list(RANGE)}


def test_other_surfaces_and_what_is_not_seen(run, tmp_path):
    """Faces of any number of corners fall into triangles; without a glowing material a page's light shapes them."""
    stage = Usd.Stage.Open(str(run / "block.usdc"))
    stage.SetEditTarget(stage.GetSessionLayer())
    corner = np.exp(2j * np.pi * np.arange(5) / 5)
    pentagon = np.column_stack([corner.real, corner.imag, 0 * corner.real])
    square = np.array([(2, 0, 0), (3, 0, 0), (3, 1, 0), (2, 1, 0)])
    mesh = UsdGeom.Mesh.Define(stage, "/World/surface")
    mesh.CreatePointsAttr([tuple(map(float, point)) for point in [*pentagon, *square]])
    mesh.CreateFaceVertexCountsAttr([5, 3, 4])
    mesh.CreateFaceVertexIndicesAttr([0, 1, 2, 3, 4, 0, 2, 5, 5, 6, 7, 8])
    mesh.CreateDisplayColorAttr([(0.25, 0.5, 1.0)])
    UsdGeom.Imageable(stage.GetPrimAtPath("/World/section")).MakeInvisible()
    particles = UsdGeom.Points(stage.GetPrimAtPath("/World/particles"))
    particles.GetWidthsAttr().Set(Vt.FloatArray(len(particles.GetPointsAttr().Get(0)), 0.0))  # all have left
    stage.Flatten().Export(str(tmp_path / "other.usda"))
    path = export(tmp_path / "other.usda", tmp_path / "other.glb", 0)
    document, arrays = parsed(path)
    (primitive,) = (item for mesh in document["meshes"] for item in mesh["primitives"])
    assert "extensionsUsed" not in document
    assert document["materials"][primitive["material"]].get("extensions", {}) == {}
    np.testing.assert_array_equal(arrays[primitive["attributes"]["COLOR_0"]], np.tile([0.25, 0.5, 1.0], (9, 1)))
    position = arrays[primitive["attributes"]["POSITION"]]
    triangles = position[arrays[primitive["indices"]].reshape(-1, 3)]
    sides = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    assert len(triangles) == 3 + 1 + 2
    areas = 0.5 * np.linalg.norm(sides, axis=1)
    np.testing.assert_allclose(areas[:3].sum(), 2.5 * np.sin(2 * np.pi / 5), rtol=1e-6)
    np.testing.assert_allclose(areas[4:].sum(), 1.0, rtol=1e-6)


def test_curves_are_lines(tmp_path):
    """Isochrones and the detonators that are curves, in their places."""
    scene = open_scene()
    written(tmp_path / "block.usdc", scene, arrival=arrival_of(scene)).close()
    document, arrays = parsed(export(tmp_path, tmp_path / "block.glb", 0))
    lines = {mesh["name"]: mesh["primitives"][0] for mesh in document["meshes"] if mesh["primitives"][0]["mode"] == 1}
    assert set(lines) == {"isochrones", *(f"detonator_{number}" for number in (1, 2, 3, 4))}
    cord = lines["detonator_2"]
    places = arrays[cord["attributes"]["POSITION"]]
    np.testing.assert_allclose(places, scene.detonators[2].points, atol=1e-8)
    np.testing.assert_array_equal(arrays[cord["indices"]].ravel(), [0, 1, 1, 2])
    isochrones = lines["isochrones"]
    pairs = arrays[isochrones["indices"]].reshape(-1, 2)
    ends = arrays[isochrones["attributes"]["POSITION"]][pairs]
    assert np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).max() < 2.0 * CELL  # no line from one curve to the next


def test_it_needs_a_frame_that_is_there(run, tmp_path):
    for number, message in [
        (None, "export: --frame: expected one of 0 to 2, because a .glb shows one instant, got none"),
        (3, "export: --frame: expected one of 0 to 2, got 3"),
        (-1, "export: --frame: expected one of 0 to 2, got -1"),
    ]:
        with pytest.raises(InputError) as caught:
            export(run, tmp_path / "block.glb", number)
        assert str(caught.value) == message
    assert not any(tmp_path.iterdir())
