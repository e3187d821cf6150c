"""The USD file, read back: prims, lengths, types, times, units; and what a killed or failing run leaves."""

import numpy as np
import pytest
from pxr import Gf, Usd, UsdGeom, UsdShade
from scenes_for_tests import CELL, block
from usd_checks import ALLOWED, sample_codes
from usd_frames import FIELDS, FRAMES, LEFT, RANGE, arrival_of, frame_of, open_scene, written

from warp_mpm.errors import SimulationError
from warp_mpm.output import colormap, usd
from warp_mpm.output.frame import Frame
from warp_mpm.output.usd import UsdWriter
from warp_mpm.places import section_nodes

TIMES = "primvars:arrival_time"


@pytest.fixture(scope="module")
def scene():
    return open_scene()


@pytest.fixture(scope="module")
def stage(scene, tmp_path_factory):
    """The finished file, opened."""
    path = written(tmp_path_factory.mktemp("usd") / "block.usdc", scene).close()
    return Usd.Stage.Open(str(path))


def attribute(stage, path: str, name: str):
    return stage.GetPrimAtPath(path).GetAttribute(name)


def test_closing_leaves_one_file(scene, tmp_path):
    path = written(tmp_path / "block.usdc", scene).close()
    assert path == tmp_path / "block.usdc"
    assert [file.name for file in tmp_path.iterdir()] == ["block.usdc"]


def test_stage_metadata(stage):
    assert stage.GetDefaultPrim().GetPath() == "/World"
    assert Usd.ModelAPI(stage.GetDefaultPrim()).GetKind() == "component"
    assert UsdGeom.GetStageUpAxis(stage) == "Z"
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1.0
    assert stage.GetTimeCodesPerSecond() == 24.0
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (0.0, FRAMES - 1.0)
    custom = stage.GetRootLayer().customLayerData
    assert custom["microsecondsPerTimeCode"] == pytest.approx(10.0)
    assert custom["pressureUnit"] == "Pa"
    assert custom["colorMap"] == "inferno"
    assert tuple(custom["colorRange"]) == RANGE


def test_time_codes_are_frame_indices(stage):
    clock = attribute(stage, "/World", "blast:time")
    assert clock.GetTypeName() == "double"
    assert clock.GetTimeSamples() == [0.0, 1.0, 2.0]
    assert [clock.Get(code) for code in range(FRAMES)] == pytest.approx([0.0, 10e-6, 20e-6])


@pytest.mark.parametrize("index", range(FRAMES))
def test_particles_are_what_the_frame_says_in_its_order(stage, scene, index):
    frame = frame_of(scene, index)
    points = UsdGeom.Points(stage.GetPrimAtPath("/World/particles"))
    np.testing.assert_array_equal(points.GetPointsAttr().Get(index), frame.position)
    np.testing.assert_array_equal(points.GetIdsAttr().Get(index), np.arange(scene.particle_count))
    pressure = np.array(attribute(stage, "/World/particles", "primvars:pressure").Get(index))
    np.testing.assert_array_equal(pressure, np.where(frame.inside, frame.pressure, 0.0))
    for name in FIELDS:
        value = attribute(stage, "/World/particles", f"primvars:{name}").Get(index)
        np.testing.assert_array_equal(value, frame.fields[name])


def test_extent_holds_the_points_and_their_widths(stage):
    points = UsdGeom.Points(stage.GetPrimAtPath("/World/particles"))
    assert points.GetExtentAttr().GetTimeSamples() == [0.0, 1.0, 2.0]
    for code in range(FRAMES):
        position = np.array(points.GetPointsAttr().Get(code))
        half = 0.5 * np.array(points.GetWidthsAttr().Get(code))[:, None]
        lower, upper = np.array(points.GetExtentAttr().Get(code))
        np.testing.assert_allclose(lower, (position - half).min(axis=0), rtol=1e-6)
        np.testing.assert_allclose(upper, (position + half).max(axis=0), rtol=1e-6)


def test_a_particle_that_left_keeps_its_place_without_width_and_pressure(stage, scene):
    widths = attribute(stage, "/World/particles", "widths")
    before, after = np.array(widths.Get(1)), np.array(widths.Get(2))
    np.testing.assert_allclose(before, CELL / 2, rtol=1e-6)
    assert after[LEFT] == 0.0
    np.testing.assert_array_equal(np.delete(after, LEFT), np.delete(before, LEFT))
    assert attribute(stage, "/World/particles", "primvars:pressure").Get(2)[LEFT] == 0.0
    place = attribute(stage, "/World/particles", "points").Get(2)[LEFT]
    np.testing.assert_array_equal(place, frame_of(scene, 2).position[LEFT])


def test_widths_are_not_animated_where_nothing_can_leave(tmp_path):
    scene = block((4, 4, 2))
    stage = Usd.Stage.Open(str(written(tmp_path / "block.usdc", scene).close()))
    widths = attribute(stage, "/World/particles", "widths")
    assert not widths.GetTimeSamples()
    assert len(widths.Get()) == scene.particle_count


def test_primvars_are_of_types_every_viewer_reads_and_of_full_length(stage):
    for path in ("/World/particles", "/World/section"):
        prim = stage.GetPrimAtPath(path)
        count = len(UsdGeom.PointBased(prim).GetPointsAttr().Get(0))
        for primvar in UsdGeom.PrimvarsAPI(prim).GetPrimvarsWithAuthoredValues():
            assert str(primvar.GetTypeName()) in ALLOWED, primvar.GetName()
            assert primvar.GetInterpolation() == "vertex"
            constant = primvar.GetPrimvarName() == "charge"
            assert primvar.GetTimeSamples() == ([] if constant else [0.0, 1.0, 2.0])
            for code in range(FRAMES):
                values = np.array(primvar.ComputeFlattened(code))
                assert len(values) == count
                assert np.isfinite(values).all()


@pytest.mark.parametrize("path", ["/World/particles", "/World/section"])
def test_colors_are_those_of_the_pressure(stage, path):
    prim = stage.GetPrimAtPath(path)
    colors = UsdGeom.PrimvarsAPI(prim).GetPrimvar("displayColor")
    assert colors.IsIndexed()
    pressure = np.array(prim.GetAttribute("primvars:pressure").Get(1))
    expected = colormap.linear_table()[colormap.indices(pressure, *RANGE)]
    np.testing.assert_array_equal(colors.ComputeFlattened(1), expected)


def test_section_has_its_values_at_the_nodes_of_the_plane(stage, scene):
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/World/section"))
    points = np.array(mesh.GetPointsAttr().Get())
    pressure = np.array(attribute(stage, "/World/section", "primvars:pressure").Get(0))
    first, second = scene.section.in_plane
    i, j = np.divmod(pressure, 1e6)
    np.testing.assert_allclose(points[:, scene.section.axis], scene.section.coordinate)
    np.testing.assert_allclose(points[:, first], scene.domain.lower[first] + i * CELL, atol=1e-8)
    np.testing.assert_allclose(points[:, second], scene.domain.lower[second] + j / 1e3 * CELL, atol=1e-8)
    assert mesh.GetDoubleSidedAttr().Get()


def test_section_faces_are_the_cells_of_the_plane(stage, scene):
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/World/section"))
    assert not mesh.GetPointsAttr().GetTimeSamples()
    assert set(mesh.GetFaceVertexCountsAttr().Get()) == {4}
    corners = np.array(mesh.GetPointsAttr().Get())[np.array(mesh.GetFaceVertexIndicesAttr().Get()).reshape(-1, 4)]
    normals = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]) / 2
    cells = np.prod([scene.domain.cells[axis] for axis in scene.section.in_plane])
    assert len(normals) == cells
    np.testing.assert_allclose(normals[:, scene.section.axis], CELL**2, rtol=1e-4)


def test_detonators_have_place_and_time(stage, scene):
    prims = stage.GetPrimAtPath("/World/detonators").GetChildren()
    assert [prim.GetName() for prim in prims] == [f"detonator_{n}" for n in range(5)]
    for prim, detonator in zip(prims, scene.detonators, strict=True):
        place = UsdGeom.Xformable(prim).GetLocalTransformation().ExtractTranslation()
        assert tuple(place) == pytest.approx(detonator.position)
        assert prim.GetAttribute("blast:ignitionTime").Get() == detonator.time
    assert [prim.GetTypeName() for prim in prims] == ["Sphere"] + 4 * ["BasisCurves"]
    assert prims[1].GetAttribute("blast:normal").Get() == Gf.Vec3f(1.0, 0.0, 0.0)


def test_detonators_that_are_no_points_are_curves_where_they_are(stage, scene):
    def places(number):
        curves = UsdGeom.BasisCurves(stage.GetPrimAtPath(f"/World/detonators/detonator_{number}"))
        assert curves.GetTypeAttr().Get() == "linear"
        counts = np.array(curves.GetCurveVertexCountsAttr().Get())
        points = np.array(curves.GetPointsAttr().Get()) + scene.detonators[number].position
        return np.split(points, np.cumsum(counts)[:-1])

    _, plane, cord, sphere, line = scene.detonators
    (around,) = places(1)
    np.testing.assert_allclose(around[:, 0], plane.position[0], rtol=1e-6)
    assert len(around) == 5
    np.testing.assert_allclose(places(2), [cord.points], atol=1e-8)
    np.testing.assert_allclose(places(4), [[line.start, line.end]], atol=1e-8)
    assert len(places(3)) == 3
    for circle in places(3):
        np.testing.assert_allclose(np.linalg.norm(circle - sphere.center, axis=1), sphere.radius, rtol=1e-5)


def test_isochrones_are_where_the_wave_comes_at_their_times(scene, tmp_path):
    """On the section; between nodes the times are taken as linear. Where none comes there are none."""
    path = written(tmp_path / "block.usdc", scene, arrival=arrival_of(scene)).close()
    stage = Usd.Stage.Open(str(path))
    curves = UsdGeom.BasisCurves(stage.GetPrimAtPath("/World/isochrones"))
    points, times = np.array(curves.GetPointsAttr().Get()), np.array(attribute(stage, curves.GetPath(), TIMES).Get())
    corner = section_nodes(scene)[0, 0]
    np.testing.assert_allclose(points[:, scene.section.axis], corner[scene.section.axis], atol=1e-9)
    away = np.linalg.norm(points - corner, axis=1)
    np.testing.assert_allclose(away, 2800.0 * times, atol=0.13 * CELL)  # a chord of a circle: h^2 / 8 R, R = h
    steps = np.unique(times.round(9))
    np.testing.assert_allclose(np.diff(steps), steps[0], rtol=1e-4)
    assert 5 <= len(steps) <= 12
    middle = np.abs(points - section_nodes(scene)[5:7, 4:6].mean(axis=(0, 1)))[:, list(scene.section.in_plane)]
    assert not (middle < 0.5 * CELL).all(axis=1).any()
    assert not Usd.Stage.Open(str(path)).GetPrimAtPath("/World/isochrones").GetAttribute("points").GetTimeSamples()


def test_camera_sees_the_whole_charge(stage, scene):
    camera = UsdGeom.Camera(stage.GetPrimAtPath("/World/camera")).GetCamera()
    frustum = camera.frustum
    assert all(frustum.Intersects(Gf.Vec3d(*position)) for position in scene.charges[0].positions)
    corners = [frustum.ComputeViewMatrix().Transform(Gf.Vec3d(*p)) for p in scene.charges[0].positions]
    across = max(abs(c[0] / c[2]) for c in corners) * 2.0 * camera.focalLength / camera.horizontalAperture
    assert across > 0.6  # of the half picture: the charge is not a dot


def test_material_glows_in_the_colors_of_the_pressure_and_reflects_no_light(stage):
    for path in ("/World/particles", "/World/section", "/World/detonators/detonator_0"):
        material, _ = UsdShade.MaterialBindingAPI(stage.GetPrimAtPath(path)).ComputeBoundMaterial()
        surface, _, _ = material.ComputeSurfaceSource()
        assert surface.GetShaderId() == "UsdPreviewSurface"
        reader = UsdShade.Shader(surface.GetInput("emissiveColor").GetConnectedSources()[0][0].source.GetPrim())
        assert reader.GetShaderId() == "UsdPrimvarReader_float3"
        assert reader.GetInput("varname").Get() == "displayColor"
        assert tuple(surface.GetInput("diffuseColor").Get()) == (0.0, 0.0, 0.0)
        assert surface.GetInput("ior").Get() == 1.0


@pytest.mark.parametrize("frames", [1, 2])
def test_a_killed_run_keeps_its_frames(scene, tmp_path, frames):
    written(tmp_path / "block.usdc", scene, frames)  # and never closed
    stage = Usd.Stage.Open(str(tmp_path / "block.usda"))
    codes = [float(index) for index in range(frames)]
    assert stage.GetEndTimeCode() == frames - 1
    assert sample_codes(attribute(stage, "/World", "blast:time")) == codes
    points = attribute(stage, "/World/particles", "points")
    assert sample_codes(points) == codes
    for index in range(frames):
        np.testing.assert_array_equal(points.Get(index), frame_of(scene, index).position)
    assert not attribute(stage, "/World/particles", "ids").ValueMightBeTimeVarying()


def test_clips_and_merged_file_hold_the_same(scene, stage, tmp_path, monkeypatch):
    monkeypatch.setattr(usd, "MERGE_LIMIT", 0)
    path = written(tmp_path / "block.usdc", scene).close()
    assert path == tmp_path / "block.usda"
    clips = Usd.Stage.Open(str(path))
    for prim in stage.Traverse():
        for merged in prim.GetAuthoredAttributes():
            clipped = clips.GetAttributeAtPath(merged.GetPath())
            assert clipped.GetTimeSamples() == merged.GetTimeSamples(), merged.GetPath()
            for code in range(FRAMES):
                assert clipped.Get(code) == merged.Get(code), merged.GetPath()


def test_an_interrupted_run_is_merged(scene, tmp_path):
    def interrupted() -> None:
        with UsdWriter(tmp_path / "block.usdc", scene, pressure_range=RANGE, frames=FRAMES, fields=FIELDS) as writer:
            writer.write(frame_of(scene, 0))
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    stage = Usd.Stage.Open(str(tmp_path / "block.usdc"))
    assert attribute(stage, "/World/particles", "points").GetTimeSamples() == [0.0]


def test_a_new_run_removes_what_an_old_one_left(scene, tmp_path):
    written(tmp_path / "block.usdc", scene, 2)
    (tmp_path / "clips" / "frame_00002.part.usdc").write_bytes(b"half a frame")
    (tmp_path / "block.usdc").write_bytes(b"an old result")
    written(tmp_path / "block.usdc", scene, 1).close()
    assert [file.name for file in tmp_path.iterdir()] == ["block.usdc"]


def test_a_full_disk_is_one_line_and_keeps_the_frames(scene, tmp_path):
    resource = pytest.importorskip("resource", reason="the limit on file sizes is a Unix one")
    writer = written(tmp_path / "block.usdc", scene, 2)
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (4096, before[1]))
    try:
        with pytest.raises(SimulationError, match=r"cannot write .*frame_00002\.usdc: .*File too large") as caught:
            writer.write(frame_of(scene, 2))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert "\n" not in str(caught.value)
    assert not list((tmp_path / "clips").glob("*.part.*"))
    stage = Usd.Stage.Open(str(writer.close()))
    assert attribute(stage, "/World/particles", "points").GetTimeSamples() == [0.0, 1.0]


def test_a_directory_that_cannot_be_made_is_one_line(scene, tmp_path):
    (tmp_path / "file").write_text("not a directory")
    with pytest.raises(SimulationError, match="cannot write"):
        UsdWriter(tmp_path / "file" / "block.usdc", scene, pressure_range=RANGE, frames=FRAMES)


def test_an_array_of_the_wrong_length_is_refused(scene, tmp_path):
    writer = UsdWriter(tmp_path / "block.usdc", scene, pressure_range=RANGE, frames=FRAMES)
    frame = frame_of(scene, 0)
    with pytest.raises(ValueError, match="pressure: expected shape"):
        writer.write(Frame(0, 0.0, frame.position, frame.pressure[:-1], frame.inside, frame.section))
