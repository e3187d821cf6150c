"""What `info` says of run directories and USD files, and of what is neither."""

import numpy as np
import pytest
from pxr import Usd, UsdGeom, UsdUtils
from scenes_for_tests import block

from warp_mpm.detonators import PointDetonator
from warp_mpm.errors import InputError
from warp_mpm.output.frame import Frame
from warp_mpm.output.info import describe
from warp_mpm.output.tables import TableWriter, gauge_columns, gauge_rows, write_summary
from warp_mpm.output.usd import UsdWriter
from warp_mpm.scene import Gauge

SCENE = block((6, 4, 2), detonators=(PointDetonator((0.0, 0.02, 0.01), time=2e-6),), end_time=30e-6)

GAUGES = (Gauge("wall", (0.0, 0.02, 0.01)), Gauge("carried", (0.03, 0.02, 0.01), moving=True))


def frame(index: int) -> Frame:
    count = SCENE.particle_count
    section = np.zeros([SCENE.domain.cells[axis] + 1 for axis in SCENE.section.in_plane], dtype=np.float32)
    return Frame(
        index,
        15e-6 * index,
        SCENE.charges[0].positions.astype(np.float32),
        np.linspace(0.0, 1e9 * (index + 1), count, dtype=np.float32),
        np.ones(count, dtype=bool),
        section,
        {"particleVelocity": np.full((count, 3), [3.0, 0.0, 4.0], dtype=np.float32)},
    )


@pytest.fixture
def run(tmp_path):
    """A run directory with three frames."""
    with (
        UsdWriter(
            tmp_path / "block.usdc", SCENE, pressure_range=(0.0, 2e9), frames=3, fields=("particleVelocity",)
        ) as usd,
        TableWriter(tmp_path / "history.csv", ["time_s"]) as history,
        TableWriter(tmp_path / "gauges.csv", gauge_columns(GAUGES)) as gauges,
    ):
        for index in range(3):
            usd.write(frame(index))
            history.write({"time_s": 15e-6 * index})
        gauges.extend(gauge_rows(GAUGES, np.linspace(0.0, 30e-6, 7), np.ones((7, 2, 8), dtype=np.float32)))
    figures = {"arrival_time_s": None, "peak_pressure_pa": 3e9, "peak_time_s": 1.2e-5, "impulse_pa_s": 4.5e4}
    summary = {"scene": "block", "front_pressure_pa": 1.5e9, "p_cj_pa": 2e9, "gauges": {"wall": figures}}
    write_summary(tmp_path / "summary.json", summary)
    (tmp_path / "figures").mkdir()
    (tmp_path / "figures" / "section.png").write_bytes(bytes(1234))
    return tmp_path


def line_with(text: str, start: str) -> str:
    (line,) = (line.strip() for line in text.splitlines() if line.strip().startswith(start))
    return line


def test_a_run_directory(run):
    text = describe(run)
    assert line_with(text, "front pressure").endswith("0.750")
    assert line_with(text, "figures/section.png").endswith("1.2 kB")
    assert line_with(text, "history.csv").endswith("3 rows, 0.0 to 30.0 µs")
    assert line_with(text, "gauges.csv").endswith("7 rows, 0.0 to 30.0 µs: wall, carried")
    assert line_with(text, "wall").split() == ["wall", "–", "3.000", "GPa", "12.0", "µs", "45.0", "kPa", "s"]
    assert line_with(text, "block.usdc:") == "block.usdc: 3 frames, time codes 0 to 2, 0.0 to 30.0 µs"
    assert line_with(text, "/World/particles") == f"/World/particles  Points  {SCENE.particle_count:,} points"
    assert line_with(text, "particleVelocity").endswith("vertex, 3 samples, 5 to 5 m/s")
    assert "did not" not in text


def test_a_table_that_a_kill_cut_short(run):
    whole = (run / "gauges.csv").read_text()
    (run / "gauges.csv").write_text(whole[: whole.rindex("3e-05") + 2])
    assert line_with(describe(run), "gauges.csv").endswith("6 rows, 0.0 to 25.0 µs: wall, carried")


def test_a_run_that_was_interrupted(run):
    write_summary(run / "summary.json", {"status": "interrupted", "scene": "block"})
    assert line_with(describe(run), "the run did not") == "the run did not come to its end: interrupted"


def test_a_usd_file(run):
    text = describe(run / "block.usdc")
    assert "default prim /World, up axis Z, 1 m per unit, 24 time codes per second" in text
    assert "3 frames, time codes 0 to 2, 0.0 to 30.0 µs" in text
    assert line_with(text, "/World/particles") == f"/World/particles  Points  {SCENE.particle_count:,} points"
    assert line_with(text, "particleVelocity").endswith("vertex, 3 samples, 5 to 5 m/s")
    assert "float[]   vertex, 3 samples, 0 to 3e+09 Pa" in text
    assert line_with(text, "charge ").endswith("int[]     vertex, 0 samples, 0 to 0")
    assert line_with(text, "microsecondsPerTimeCode") == "microsecondsPerTimeCode: 15.0"
    assert line_with(text, "/World/detonators/detonator_0").endswith("at (0, 0.02, 0.01) m, lit at 2 µs")


def test_a_run_that_did_not_end(tmp_path):
    writer = UsdWriter(tmp_path / "block.usdc", SCENE, pressure_range=(0.0, 2e9), frames=3)
    for index in range(2):
        writer.write(frame(index))
    (tmp_path / "block.part.usdc").write_bytes(b"killed while the frames were merged")
    assert "no summary.json, the run did not end" in describe(tmp_path)
    write_summary(tmp_path / "summary.json", {"status": "running", "scene": "block"})
    text = describe(tmp_path)
    assert text.startswith("block: the run goes on, or was killed")
    assert line_with(text, "block.usda:") == "block.usda: 2 frames, time codes 0 to 1, 0.0 to 15.0 µs"
    assert "frame_0" not in text


def test_a_package(run):
    assert UsdUtils.CreateNewUsdzPackage(str(run / "block.usdc"), str(run / "block.usdz"))
    whole, package = (describe(run / name).splitlines()[1:] for name in ("block.usdc", "block.usdz"))
    assert whole == package


def test_usd_of_another_program(tmp_path):
    stage = Usd.Stage.CreateNew(str(tmp_path / "other.usda"))
    UsdGeom.Cube.Define(stage, "/Cube")
    stage.Save()
    text = describe(tmp_path / "other.usda")
    assert "default prim none" in text
    assert line_with(text, "/Cube") == "/Cube  Cube"


def test_a_surface_that_changes(tmp_path):
    stage = Usd.Stage.CreateNew(str(tmp_path / "other.usda"))
    points = UsdGeom.Mesh.Define(stage, "/Surface").CreatePointsAttr()
    points.Set([(0, 0, 0)] * 3, 0.0)
    points.Set([(0, 0, 0)] * 1200, 1.0)
    stage.Save()
    assert line_with(describe(tmp_path / "other.usda"), "/Surface") == "/Surface  Mesh  3 to 1,200 points"


def damaged(run, name: str):
    """A path that is no result, by what is wrong with it."""
    if name == "truncated":
        whole = (run / "block.usdc").read_bytes()
        (run / "block.usdc").write_bytes(whole[: len(whole) // 2])
        return run / "block.usdc"
    if name == "other.txt":
        (run / name).write_text("not USD")
        return run / name
    if name == "broken.usda":
        (run / name).write_text("#usda 1.0\ndef Xform")
        return run / name
    if name == "layer":
        (run / "root.usda").write_text("#usda 1.0\n(\n    subLayers = [@./gone.usdc@]\n)\n")
        return run / "root.usda"
    if name == "summary.json":
        (run / name).write_text("{")
        return run
    if name == "empty":
        (run / name).mkdir()
    return run / name


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("truncated", "possibly truncated"),
        ("other.txt", "its format is unknown"),
        ("broken.usda", "does not open"),
        ("layer", "missing layer"),
        ("summary.json", "expected JSON"),
        ("empty", "has neither"),
        ("missing", "does not exist"),
    ],
)
def test_what_is_no_result_is_one_line(run, name, message):
    with pytest.raises(InputError, match=message) as caught:
        describe(damaged(run, name))
    assert "\n" not in str(caught.value)
