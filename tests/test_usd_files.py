"""Every kind of USD file that can be asked for passes every check; and what the options do."""

import shutil

import numpy as np
import pytest
import usd_checks
from pxr import Sdf, Usd, UsdGeom
from scenes_for_tests import CELL
from usd_checks import assert_sound, faults
from usd_frames import FRAMES, RANGE, TIMES, arrival_of, frame_of, open_scene, section_of, surface_of, written

from warp_mpm.config import PARTICLE_FIELDS, Layout, Save
from warp_mpm.errors import InputError, SimulationError
from warp_mpm.output import colormap, usd, usd_package
from warp_mpm.simulation import simulate

LEVEL = 1e9  # pressure of the isosurface [Pa]
VARIANTS = {
    "single": {"layout": Layout.SINGLE},
    "clips": {"layout": Layout.CLIPS},
    "thinned": {"layout": Layout.SINGLE, "particles_every": 5},
    "isosurface": {"layout": Layout.SINGLE, "isosurface": LEVEL},
    "isochrones": {"layout": Layout.SINGLE, "arrival": arrival_of(open_scene())},
    "all in clips": {
        "layout": Layout.CLIPS,
        "isosurface": LEVEL,
        "particles_every": 3,
        "arrival": arrival_of(open_scene()),
    },
}


@pytest.fixture(scope="module")
def scene():
    return open_scene()


def closed(path, scene, **options):
    return written(path / "block.usdc", scene, **options).close()


@pytest.mark.parametrize("options", VARIANTS.values(), ids=VARIANTS)
def test_every_kind_of_file_is_sound(scene, tmp_path, options):
    path = closed(tmp_path, scene, usdz=True, **options)
    assert_sound(path, TIMES)
    assert_sound(path.with_suffix(".usdz"), TIMES)


@pytest.mark.parametrize("layout", [Layout.SINGLE, Layout.CLIPS])
def test_a_run_has_the_times_of_its_history(tmp_path, layout):
    save = Save(frames=4, fields=PARTICLE_FIELDS, isosurface=LEVEL, layout=layout, figures=False)
    result = simulate(open_scene(), save=save, output=tmp_path)
    path = tmp_path / ("block.usdc" if layout is Layout.SINGLE else "block.usda")
    assert_sound(path, [row["time_s"] for row in result.history])


def test_the_asset_validator_can_fail(scene, tmp_path):
    """Other tests pass it over where it is missing; this one says so."""
    if not usd_checks.has_asset_validator():
        pytest.skip("omniverse-asset-validator is not installed; there is none for Python 3.13")
    path = closed(tmp_path, scene)
    stage = Usd.Stage.Open(str(path))
    stage.GetPrimAtPath("/World/section").RemoveProperty("normals")
    stage.Save()
    assert any("NormalsExist" in issue for issue in usd_checks.asset_validator_issues(path))


def without_a_point(stage):
    points = UsdGeom.Points(stage.GetPrimAtPath("/World/particles")).GetPointsAttr()
    points.Set(points.Get(1)[1:], 1)


def with_a_hole_in_pressure(stage):
    pressure = stage.GetAttributeAtPath("/World/section.primvars:pressure")
    values = np.array(pressure.Get(2))
    values[3] = np.nan
    pressure.Set(values, 2)


def with_a_small_extent(stage):
    extent = stage.GetAttributeAtPath("/World/particles.extent")
    extent.Set(np.array(extent.Get(0)) * 0.5, 0)


def with_an_extent_of_all_time(stage):
    stage.GetAttributeAtPath("/World/isosurface.extent").ClearAtTime(1)


def with_an_unknown_color(stage):
    indices = stage.GetAttributeAtPath("/World/particles.primvars:displayColor:indices")
    indices.Set(np.array(indices.Get(1)) + 1, 1)


def with_a_face_too_many(stage):
    counts = stage.GetAttributeAtPath("/World/isosurface.faceVertexCounts")
    counts.Set([*counts.Get(2), 3], 2)


def with_time_standing_still(stage):
    stage.GetAttributeAtPath("/World.blast:time").Set(TIMES[1], 2)


def with_a_double_primvar(stage):
    api = UsdGeom.PrimvarsAPI(stage.GetPrimAtPath("/World/section"))
    api.CreatePrimvar("weight", Sdf.ValueTypeNames.DoubleArray, UsdGeom.Tokens.constant).Set([1.0])


@pytest.mark.parametrize(
    ("spoil", "found"),
    [
        (without_a_point, "widths"),
        (with_a_hole_in_pressure, "primvars:pressure: not finite at 2"),
        (with_a_small_extent, "outside of the extent"),
        (with_an_extent_of_all_time, "extent not sampled"),
        (with_an_unknown_color, "indices beyond the 256 values"),
        (with_a_face_too_many, "faces that do not fit"),
        (with_time_standing_still, "blast:time"),
        (with_a_double_primvar, "of type double"),
    ],
)
def test_our_checks_can_fail(scene, tmp_path, spoil, found):
    stage = Usd.Stage.Open(str(closed(tmp_path, scene, isosurface=LEVEL)))
    assert list(faults(stage, TIMES)) == []
    spoil(stage)
    assert any(found in fault for fault in faults(stage, TIMES))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"layout": "clips"}, r"save: layout: expected one of .*, got 'clips'; did you mean Layout\.CLIPS\?$"),
        ({"particles_every": 1.5}, "save: particles_every: expected a whole number of at least 1, got 1.5"),
        ({"isosurface": -1e9}, "save: isosurface: expected a positive number, got -1000000000.0"),
    ],
)
def test_what_cannot_be_saved_is_one_line(options, message):
    with pytest.raises(InputError, match=message):
        Save(**options)


@pytest.mark.parametrize(
    ("layout", "limit", "suffix"),
    [
        (Layout.AUTO, 10**9, ".usdc"),
        (Layout.AUTO, 0, ".usda"),
        (Layout.SINGLE, 0, ".usdc"),
        (Layout.CLIPS, 10**9, ".usda"),
    ],
)
def test_the_layout_decides_whether_frames_become_one_file(scene, tmp_path, monkeypatch, layout, limit, suffix):
    monkeypatch.setattr(usd, "MERGE_LIMIT", limit)
    path = closed(tmp_path, scene, layout=layout)
    assert path.suffix == suffix
    kept = {".usdc": ["block.usdc"], ".usda": ["block.usda", "clips"]}
    assert sorted(file.name for file in tmp_path.iterdir()) == kept[suffix]


@pytest.mark.parametrize("batch", [1, 10**9])
def test_merging_in_batches_changes_nothing(scene, tmp_path, monkeypatch, batch):
    monkeypatch.setattr(usd, "MERGE_BATCH", batch)
    merged = Usd.Stage.Open(str(closed(tmp_path / "merged", scene, layout=Layout.SINGLE, isosurface=LEVEL)))
    clips = Usd.Stage.Open(str(closed(tmp_path / "clips", scene, layout=Layout.CLIPS, isosurface=LEVEL)))
    for attribute in (attribute for prim in clips.Traverse() for attribute in prim.GetAuthoredAttributes()):
        found = merged.GetAttributeAtPath(attribute.GetPath())
        assert found.GetTimeSamples() == attribute.GetTimeSamples()
        for code in range(FRAMES):
            assert found.Get(code) == attribute.Get(code), attribute.GetPath()


def test_a_new_run_is_merged_even_if_someone_still_shows_the_old_one(scene, tmp_path):
    old = Usd.Stage.Open(str(closed(tmp_path, scene, layout=Layout.CLIPS)))
    points = old.GetAttributeAtPath("/World/particles.points").Get(0)
    writer = written(tmp_path / "block.usdc", scene, 0, layout=Layout.SINGLE)
    moved = frame_of(scene, 0)
    moved.position[:] += 1.0
    writer.write(moved)
    new = Usd.Stage.Open(str(writer.close()))
    np.testing.assert_array_equal(new.GetAttributeAtPath("/World/particles.points").Get(0), moved.position)
    assert not np.array_equal(points, moved.position)


@pytest.mark.parametrize("layout", [Layout.SINGLE, Layout.CLIPS])
def test_thinning_takes_particles_in_creation_order_and_leaves_the_section(scene, tmp_path, layout):
    every = 5
    stage = Usd.Stage.Open(str(closed(tmp_path, scene, particles_every=every, layout=layout)))
    frame = frame_of(scene, 1)
    points = UsdGeom.Points(stage.GetPrimAtPath("/World/particles"))
    np.testing.assert_array_equal(points.GetPointsAttr().Get(1), frame.position[::every])
    np.testing.assert_array_equal(points.GetIdsAttr().Get(), np.arange(0, scene.particle_count, every))
    for name, values in {"pressure": frame.pressure, **frame.fields}.items():
        shown = UsdGeom.PrimvarsAPI(points).GetPrimvar(name).Get(1)
        np.testing.assert_array_equal(shown, values[::every])
    # 8 particles a cell; those shown take over the room of those left out
    np.testing.assert_allclose(points.GetWidthsAttr().Get(0), np.cbrt(every) * CELL / 2, rtol=1e-6)
    section = stage.GetAttributeAtPath("/World/section.primvars:pressure").Get(1)
    np.testing.assert_array_equal(section, section_of(scene).ravel())
    assert stage.GetRootLayer().customLayerData["particlesEvery"] == every


@pytest.mark.parametrize("layout", [Layout.SINGLE, Layout.CLIPS])
def test_the_isosurface_changes_from_frame_to_frame(scene, tmp_path, layout):
    stage = Usd.Stage.Open(str(closed(tmp_path, scene, isosurface=LEVEL, layout=layout)))
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/World/isosurface"))
    assert mesh.ComputeVisibility(0) == "invisible"  # there is none at first
    for code in (1, 2):
        assert mesh.ComputeVisibility(code) == "inherited"
        np.testing.assert_array_equal(mesh.GetPointsAttr().Get(code), surface_of(code).points)
        np.testing.assert_array_equal(mesh.GetFaceVertexIndicesAttr().Get(code), surface_of(code).triangles.ravel())
        assert set(mesh.GetFaceVertexCountsAttr().Get(code)) == {3}
    color = colormap.linear_table()[colormap.indices(np.float32([LEVEL]), *RANGE)]
    np.testing.assert_array_equal(mesh.GetDisplayColorAttr().Get(), color)
    assert not mesh.GetNormalsAttr().HasAuthoredValue()
    assert mesh.GetPrim().GetAttribute("blast:pressure").Get() == LEVEL


@pytest.mark.parametrize("layout", [Layout.SINGLE, Layout.CLIPS])
def test_a_package_needs_nothing_beside_it(scene, tmp_path, layout):
    path = closed(tmp_path / "run", scene, usdz=True, layout=layout)
    shutil.move(path.with_suffix(".usdz"), tmp_path)
    shutil.rmtree(tmp_path / "run")
    stage = Usd.Stage.Open(str(tmp_path / "block.usdz"))
    for code in range(FRAMES):
        points = stage.GetAttributeAtPath("/World/particles.points").Get(code)
        np.testing.assert_array_equal(points, frame_of(scene, code).position)


def test_what_is_too_large_for_a_package_is_one_line(scene, tmp_path, monkeypatch):
    monkeypatch.setattr(usd_package, "LIMIT", 1000)
    with pytest.raises(SimulationError, match=r"cannot write .*block\.usdz: expected at most .* GB") as caught:
        closed(tmp_path, scene, usdz=True)
    assert "\n" not in str(caught.value)
    assert [file.name for file in tmp_path.iterdir()] == ["block.usdc"]
    assert_sound(tmp_path / "block.usdc", TIMES)


def test_a_new_run_removes_the_package_of_an_old_one(scene, tmp_path):
    closed(tmp_path, scene, usdz=True)
    closed(tmp_path, scene)
    assert [file.name for file in tmp_path.iterdir()] == ["block.usdc"]


def test_a_disk_that_is_full_while_merging_leaves_the_clips(scene, tmp_path):
    resource = pytest.importorskip("resource", reason="the limit on file sizes is a Unix one")
    writer = written(tmp_path / "block.usdc", scene, layout=Layout.SINGLE)
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (30_000, before[1]))
    try:
        with pytest.raises(SimulationError, match=r"cannot write .*block\.usdc: .*File too large") as caught:
            writer.close()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert "\n" not in str(caught.value)
    assert sorted(file.name for file in tmp_path.iterdir()) == ["block.usda", "clips"]
    assert_sound(tmp_path / "block.usda", TIMES)
    assert_sound(writer.close(), TIMES)  # with room again


def test_a_directory_that_goes_away_is_one_line(scene, tmp_path):
    writer = written(tmp_path / "run" / "block.usdc", scene, 1)
    shutil.rmtree(tmp_path / "run")
    with pytest.raises(SimulationError, match=r"cannot write .*frame_00001\.usdc: the directory is gone"):
        writer.write(frame_of(scene, 1))
    with pytest.raises(SimulationError, match="cannot write"):
        writer.close()
    assert not (tmp_path / "run").exists()
