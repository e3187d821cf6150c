"""The export for ParaView: read back by meshio and by VTK it is what the run saved, of finished and of killed runs."""

import shutil
from dataclasses import replace
from xml.etree import ElementTree

import meshio
import numpy as np
import pytest
from pxr import Sdf, Usd, UsdGeom, Vt
from scenes_for_tests import CELL, OPEN, block
from usd_frames import FIELDS, FRAMES, RANGE, TIMES, arrival_of, frame_of, open_scene, written

from warp_mpm.errors import InputError, SimulationError
from warp_mpm.output import vtk as vtk_output
from warp_mpm.output.export import export
from warp_mpm.output.usd import UsdWriter
from warp_mpm.places import section_nodes
from warp_mpm.scene import Walls


@pytest.fixture(params=["closed", "free"])
def scene(request):
    """A block in a box, or one whose particles may leave."""
    free = request.param == "free"
    return block((5, 4, 3), walls=OPEN if free else Walls(), margin_cells=1 if free else 0)


@pytest.fixture
def run(scene, tmp_path):
    """A run directory with three frames."""
    directory = tmp_path / "run"
    directory.mkdir()
    written(directory / "block.usdc", scene).close()
    return directory


def series(path):
    """Times and files of a .pvd."""
    sets = ElementTree.parse(path).getroot().findall("./Collection/DataSet")
    return [float(item.get("timestep")) for item in sets], [path.parent / item.get("file") for item in sets]


def read_by_meshio(path):
    """Points, corners of the cells and point data."""
    mesh = meshio.read(path)
    (cells,) = mesh.cells
    return mesh.points, cells.type, cells.data, mesh.point_data


def read_by_vtk(path):
    """The same, by the reader that ParaView uses."""
    vtk = pytest.importorskip("vtk", reason="VTK is not installed: pip install vtk, 130 MB")
    from vtk.util.numpy_support import vtk_to_numpy

    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(path))
    reader.Update()
    grid = reader.GetOutput()
    kind = {vtk.VTK_VERTEX: "vertex", vtk.VTK_QUAD: "quad"}[grid.GetCellType(0)]
    corners = vtk_to_numpy(grid.GetCells().GetConnectivityArray()).reshape(grid.GetNumberOfCells(), -1)
    data = grid.GetPointData()
    arrays = {data.GetArrayName(n): vtk_to_numpy(data.GetArray(n)) for n in range(data.GetNumberOfArrays())}
    return vtk_to_numpy(grid.GetPoints().GetData()), kind, corners, arrays


@pytest.mark.parametrize("read", [read_by_meshio, read_by_vtk])
def test_what_is_read_back_is_what_was_saved(scene, run, tmp_path, read):
    """Every number of every frame; particles that have left are left out, and the ids say which the others are."""
    path = export(run, tmp_path / "block.pvd")
    assert path == tmp_path / "block.pvd"
    times, files = series(path)
    assert times == TIMES
    for index, file in enumerate(files):
        saved = frame_of(scene, index)
        points, kind, corners, data = read(file)
        assert kind == "vertex"
        np.testing.assert_array_equal(corners.ravel(), np.arange(len(points)))
        np.testing.assert_array_equal(points, saved.position[saved.inside])
        assert set(data) == {"pressure", "id", "charge", *FIELDS}
        np.testing.assert_array_equal(data["id"], np.flatnonzero(saved.inside))
        np.testing.assert_array_equal(data["pressure"], saved.pressure[saved.inside])
        for name in FIELDS:
            np.testing.assert_array_equal(data[name], saved.fields[name][saved.inside])
    times, files = series(tmp_path / "block_section.pvd")
    assert times == TIMES
    for index, file in enumerate(files):
        points, kind, corners, data = read(file)
        assert kind == "quad"
        np.testing.assert_array_equal(data["pressure"], frame_of(scene, index).section.ravel())
        sides = points[np.roll(corners, -1, axis=1)] - points[corners]
        np.testing.assert_allclose(np.linalg.norm(sides, axis=-1), 0.01, rtol=1e-5)  # squares as large as the cells
        assert len(corners) * 0.01**2 == pytest.approx(np.prod([np.ptp(points[:, a]) for a in scene.section.in_plane]))


def test_it_opens_from_anywhere(run, tmp_path, monkeypatch):
    """Written into a directory it has the name of the run; file names are relative, so all of it may be moved."""
    target = tmp_path / "made" / "here"
    assert export(run / "block.usdc", target) == target / "block.pvd"
    moved = tmp_path / "moved"
    shutil.move(target, moved)
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    _, files = series(moved / "block.pvd")
    assert [len(meshio.read(file).points) > 0 for file in files] == [True] * FRAMES
    assert not any(elsewhere.iterdir())


def test_a_killed_run(scene, tmp_path):
    """Frames that are still in clips, and no more of them than there are."""
    run = tmp_path / "run"
    run.mkdir()
    written(run / "block.usdc", scene, frames=2)
    (run / "block.part.usdc").write_bytes(b"killed while the frames were merged")
    times, files = series(export(run, tmp_path / "killed.pvd"))
    assert times == TIMES[:2]
    saved = frame_of(scene, 1)
    np.testing.assert_array_equal(meshio.read(files[1]).point_data["pressure"], saved.pressure[saved.inside])


def test_a_surface_that_changes(tmp_path):
    """Every mesh is exported, triangles and quadrilaterals, as it is in each frame; nothing where it is hidden."""
    stage = Usd.Stage.CreateNew(str(tmp_path / "run.usda"))
    world = UsdGeom.Xform.Define(stage, "/World").GetPrim()
    stage.SetDefaultPrim(world)
    stage.SetEndTimeCode(1.0)
    mesh = UsdGeom.Mesh.Define(stage, "/World/surface")
    points = np.float32([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0]])
    for code, visibility in enumerate(("invisible", "inherited")):
        world.CreateAttribute("blast:time", Sdf.ValueTypeNames.Double).Set(1e-6 * code, code)
        mesh.CreatePointsAttr().Set(Vt.Vec3fArray.FromNumpy(points), code)
        mesh.CreateFaceVertexCountsAttr().Set([4, 3], code)
        mesh.CreateFaceVertexIndicesAttr().Set([0, 1, 2, 3, 1, 4, 2], code)
        mesh.CreateVisibilityAttr().Set(visibility, code)
    stage.Save()
    export(tmp_path / "run.usda", tmp_path / "run.pvd")
    times, (hidden, shown) = series(tmp_path / "run_surface.pvd")
    assert times == [0.0, 1e-6]
    assert 'NumberOfPoints="0" NumberOfCells="0"' in hidden.read_text()
    read = meshio.read(shown)
    np.testing.assert_array_equal(read.points, points)
    np.testing.assert_array_equal(read.cells_dict["triangle"], [[1, 4, 2]])
    np.testing.assert_array_equal(read.cells_dict["quad"], [[0, 1, 2, 3]])


def test_curves_are_lines_and_do_not_change(tmp_path):
    """Isochrones with their times, and a cord where it is in the world; once each, in no directory of frames."""
    scene = open_scene()
    arrival = arrival_of(scene)
    written(tmp_path / "block.usdc", scene, arrival=arrival).close()
    (tmp_path / "block_isochrones.pvd").write_text("of an earlier export")
    export(tmp_path, tmp_path / "block.pvd")
    names = {file.name for file in tmp_path.iterdir() if file.suffix in (".pvd", ".vtu")}
    curves = {"block_isochrones.vtu", *(f"block_detonator_{number}.vtu" for number in (1, 2, 3, 4))}
    assert names == {"block.pvd", "block_section.pvd", *curves}
    assert {file.name.split("_")[0] for file in (tmp_path / "block_frames").iterdir()} == {"particles", "section"}
    points, kind, pairs, data = read_by_meshio(tmp_path / "block_isochrones.vtu")
    assert kind == "line"
    assert set(data) == {"arrival_time"}
    np.testing.assert_array_equal(*data["arrival_time"][pairs].T)  # no line from one curve to the next
    corner = section_nodes(scene)[0, 0]
    distance = np.linalg.norm(points - corner, axis=1)
    # Linear interpolation between nodes: of a distance it errs by an eighth of a cell at most, but at the corner.
    np.testing.assert_allclose(distance, 2800.0 * data["arrival_time"], atol=0.2 * CELL)
    assert np.linalg.norm(np.diff(points[pairs], axis=1), axis=-1).max() < 2.0 * CELL
    cord = read_by_meshio(tmp_path / "block_detonator_2.vtu")
    np.testing.assert_allclose(cord[0], scene.detonators[2].points, atol=1e-8)
    np.testing.assert_array_equal(cord[2], [[0, 1], [1, 2]])


def test_times_rise(tmp_path):
    """A run of fewer steps than frames repeats some; ParaView would show those of one time on top of each other."""
    scene = block((3, 3, 3))
    with UsdWriter(tmp_path / "block.usdc", scene, pressure_range=RANGE, frames=FRAMES, fields=FIELDS) as writer:
        for index, time in enumerate((0.0, 1e-6, 1e-6)):
            writer.write(replace(frame_of(scene, index), time=time))
    times, files = series(export(tmp_path, tmp_path / "block.pvd"))
    assert times == [0.0, 1e-6]
    assert [file.stem for file in files] == ["particles_00000", "particles_00001"]


def test_an_export_that_fails_leaves_nothing_half(scene, run, tmp_path, monkeypatch):
    """One line, and no .pvd, because not all it plays is there; the next export clears away what is left."""
    path = tmp_path / "block.pvd"
    export(run, path)
    write = vtk_output.meshio.vtu.write

    def full_disk(file, *arguments, **options):
        write(file, *arguments, **options)
        if "00001" in str(file):
            raise OSError(28, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr(vtk_output.meshio.vtu, "write", full_disk)
        with pytest.raises(SimulationError, match=r"cannot write .*particles_00001\.vtu: No space left") as caught:
            export(run, path)
    assert "\n" not in str(caught.value)
    assert [file.name for file in sorted(tmp_path.rglob("*.pvd"))] == []
    assert [file.name for file in sorted(tmp_path.rglob("*.vtu"))] == ["particles_00000.vtu"]
    export(run, path)
    assert len(list(tmp_path.rglob("*.vtu"))) == 2 * FRAMES


def test_what_cannot_be_exported_is_one_line(run, tmp_path):
    (tmp_path / "empty").mkdir()
    (tmp_path / "other.usda").write_text('#usda 1.0\n(\n    defaultPrim = "A"\n)\ndef Xform "A" {}\n')
    for source, target, message in [
        (run, "run.obj", "export: --to: expected a file that ends in .pvd"),
        (tmp_path / "empty", "run.pvd", "export: expected a run directory with a USD file, got"),
        (tmp_path / "gone", "run.pvd", "export: expected a run directory or a USD file, got"),
        (tmp_path / "other.usda", "run.pvd", "export: expected the USD file of a run, with frames, got"),
    ]:
        with pytest.raises(InputError) as caught:
            export(source, tmp_path / target)
        assert str(caught.value).startswith(message)
        assert "\n" not in str(caught.value)
