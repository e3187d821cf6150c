"""What a run leaves can be read back without the scene: `load`, on whole, killed, moved and damaged runs."""

import json
import os
import pickle
import shutil
from dataclasses import replace

import numpy as np
import pytest
from scenes_for_tests import OPEN, block, inert_gas

from warp_mpm import InputError, Save, load, simulate
from warp_mpm.builder import SceneBuilder
from warp_mpm.cli import main
from warp_mpm.detonators import PlaneDetonator, PointDetonator
from warp_mpm.geometry import Box
from warp_mpm.output import figures
from warp_mpm.output.description import description_from_json, scene_values
from warp_mpm.output.figures import film
from warp_mpm.output.frame import Frame, LineRecord, SectionRecord, StepRecord
from warp_mpm.output.steps import read_steps, write_steps
from warp_mpm.output.tables import write_summary
from warp_mpm.output.usd import UsdWriter
from warp_mpm.progress import Silent
from warp_mpm.result import Result
from warp_mpm.run_directory import FILMS, PICTURES
from warp_mpm.scene_loading import load_scene

SCENE = block((6, 4, 3), end_time=2e-5)


class Stopping(Silent):
    """Interrupts the run after a few steps, as Ctrl-C does."""

    def update(self, time: float, end: float, step: int, note: str) -> None:
        """Called after every step."""
        if step >= 4:
            raise KeyboardInterrupt


@pytest.fixture(scope="module")
def ended(tmp_path_factory) -> Result:
    """A run of four frames that ended."""
    directory = tmp_path_factory.mktemp("ended")
    return simulate(SCENE, save=Save(frames=4, fields=("density",), figures=False), output=directory)


def test_a_result_is_printed_in_one_line(ended):
    """Not all that it holds, as a notebook would."""
    assert repr(ended) == f"Result(output={ended.output!r})"


def test_a_result_comes_back_from_another_process(ended):
    """All of it but the state, which stays where it is."""
    back = pickle.loads(pickle.dumps(ended))
    assert repr(back) == repr(ended)
    assert (back.summary, back.history) == (ended.summary, ended.history)
    np.testing.assert_array_equal(back.record.field_pressure, ended.record.field_pressure)
    np.testing.assert_array_equal(back.pictures[-1].pressure, ended.pictures[-1].pressure)
    assert not hasattr(back, "state")
    assert len(ended.state.positions()) == SCENE.particle_count


def test_frames_are_printed_in_one_line(ended, tmp_path):
    """How many, when, and where; a killed run may have left a single one."""
    last = ended.summary["end_time_s"] * 1e6
    file = str(ended.output / "block.usdc")
    assert repr(load(ended.output).frames) == f"<4 frames from 0.000 to {last:.3f} us in {file!r}>"
    killed_run(tmp_path, 1)
    file = str(tmp_path / "block.usda")
    assert repr(load(tmp_path).frames) == f"<1 frame from 0.000 to 0.000 us in {file!r}>"


@pytest.mark.parametrize("every", [1, 3])
def test_frames_say_of_which_charge_each_particle_is(tmp_path, every):
    """A flyer, a plate that it flies to, and one that it does not: each particle by where it is at the start."""
    builder = SceneBuilder("plates")
    builder.domain((0.0, 0.0, 0.0), (0.06, 0.02, 0.02), cell_size=1e-2)
    for name, low in (("flyer", 0.0), ("base", 0.04), ("other", 0.02)):
        builder.charge(Box((low, 0.0, 0.0), (low + 0.01, 0.02, 0.02)), inert_gas(), name=name)
    builder.end_time(1e-6)
    simulate(builder.build(), save=Save(frames=2, figures=False, particles_every=every), output=tmp_path)
    run = load(tmp_path)
    names = [charge["name"] for charge in run.summary["charges"]]
    assert names == ["flyer", "base", "other"]
    for saved in run.frames:
        of_charge = saved.fields["charge"]
        assert of_charge.shape == saved.pressure.shape == (-(-96 // every),)
        for name, low in (("flyer", 0.0), ("base", 0.04), ("other", 0.02)):
            x = saved.position[of_charge == names.index(name), 0]
            assert len(x) in (32 // every, 32 // every + 1)
            assert low < x.min() < x.max() < low + 0.01


def frame(index: int, scene=SCENE) -> Frame:
    """Made-up values that tell frames and particles apart."""
    count = scene.particle_count
    section = np.zeros([scene.domain.cells[axis] + 1 for axis in scene.section.in_plane], dtype=np.float32)
    section[0, -1] = index
    position = scene.charges[0].positions.astype(np.float32)
    inside = np.arange(count) % 5 != index
    return Frame(index, 1.5e-6 * index, position, np.arange(count, dtype=np.float32) + index, inside, section)


def killed_run(directory, count: int = 3) -> None:
    """What a run leaves when it is killed: the writer is never closed."""
    writer = UsdWriter(directory / "block.usdc", SCENE, pressure_range=(0.0, 1e9), frames=10)
    for index in range(count):
        writer.write(frame(index))
    write_summary(directory / "summary.json", {"status": "running", **scene_values(SCENE)})
    (directory / "history.csv").write_text("time_s,step,kinetic_J\n0.0,0,\n1.5e-06,7,2.5\n3.0e-06,1")


def test_everything_comes_back(ended):
    run = load(ended.output)
    assert run.name == "block"
    assert run.summary["status"] == "complete"
    assert run.summary == json.loads(json.dumps(ended.summary))  # nothing in it but what JSON has
    np.testing.assert_array_equal(run.history["time_s"], [row["time_s"] for row in ended.history])
    assert run.gauges == {}
    for name in ("time", "dt", "particle_pressure", "field_pressure", "point_pressures"):
        np.testing.assert_array_equal(getattr(run.steps, name), getattr(ended.record, name))
    for name in ("peak", "arrival"):
        np.testing.assert_array_equal(getattr(run.steps.section, name), getattr(ended.record.section, name))
    assert (run.steps.path, run.steps.line, run.steps.path_pressure) == (None, None, None)
    assert len(run.pictures) == len(SCENE.picture_times)
    for read, drawn in zip(run.pictures, ended.pictures, strict=True):
        assert read.time == drawn.time
        np.testing.assert_array_equal(read.pressure, drawn.pressure)


def test_frames_are_what_the_state_was(ended):
    run = load(str(ended.output))
    assert len(run.frames) == 4
    np.testing.assert_array_equal(run.frames.times, run.history["time_s"])
    last = run.frames[-1]
    assert (last.index, last.time) == (3, ended.summary["end_time_s"])
    np.testing.assert_array_equal(last.position, np.float32(ended.state.positions()))
    np.testing.assert_array_equal(last.pressure, np.float32(ended.state.field("pressure")))
    np.testing.assert_array_equal(last.fields["density"], np.float32(ended.state.field("density")))
    assert (last.pressure.dtype, last.inside.dtype) == (np.float32, bool)
    assert last.inside.all()
    np.testing.assert_array_equal(last.section, np.float32(ended.pictures[-1].pressure))
    grid = run.frames.section
    assert grid.axis == SCENE.section.axis
    assert last.section.shape == (len(grid.u), len(grid.v))
    np.testing.assert_allclose(grid.u, np.linspace(0.0, 0.06, 7), atol=1e-8)
    assert [saved.index for saved in run.frames[1:3]] == [1, 2]
    assert run.frames.nearest(0.6e-5).index == 1
    with pytest.raises(IndexError):
        run.frames[4]


def test_arrays_are_copies(ended):
    """Writing into them changes no file and no other frame."""
    run = load(ended.output)
    run.frames[0].position[:] = 7.0
    assert run.frames[0].position.max() < 0.07


def test_a_line_comes_back(tmp_path):
    time, random = np.linspace(0.0, 1.0, 5), np.random.default_rng(3)
    place, expected = np.arange(3.0), np.array([0.1, 0.2, np.nan])
    lines = [LineRecord(time, place, expected, random.random((5, 3)).astype(np.float32)) for _ in range(2)]
    section = SectionRecord(np.ones((2, 3), np.float32), np.full((2, 3), np.nan, np.float32), np.ones((2, 3)))
    record = StepRecord(time, time, time, time, 2 * time, random.random((5, 2)), *lines, section)
    write_steps(tmp_path / "steps.npz", record, ())
    read, pictures = read_steps(tmp_path / "steps.npz")
    assert pictures == ()
    np.testing.assert_array_equal(read.path_pressure, record.path_pressure)
    for name in ("path", "line"):
        for part in ("time", "distance", "expected", "pressure"):
            np.testing.assert_array_equal(getattr(getattr(read, name), part), getattr(getattr(record, name), part))
    assert os.listdir(tmp_path) == ["steps.npz"]


def test_an_interrupted_run(tmp_path):
    with pytest.raises(KeyboardInterrupt):
        simulate(SCENE, save=Save(frames=30, figures=False), output=tmp_path, progress=Stopping())
    run = load(tmp_path)
    assert run.summary["status"] == "interrupted"
    assert 2 <= len(run.frames) < 30
    assert len(run.steps.time) == run.summary["steps"] + 1
    assert run.frames[-1].time <= run.steps.time[-1]


def test_a_run_says_what_it_is_before_it_ends(tmp_path):
    seen = []

    class Looking(Silent):
        def update(self, time: float, end: float, step: int, note: str) -> None:
            """Load the run as far as it got."""
            seen.append(load(tmp_path))
            assert len(seen[-1].frames) == seen[-1].frames[-1].index + 1

    (tmp_path / "steps.npz").write_bytes(b"of an earlier run")
    simulate(SCENE, save=Save(frames=4, figures=False), output=tmp_path, progress=Looking())
    assert {run.summary["status"] for run in seen} == {"running"}
    assert seen[0].setup.domain == SCENE.domain
    assert seen[0].summary["p_cj_pa"] == load(tmp_path).summary["p_cj_pa"]


def test_a_killed_run(tmp_path):
    killed_run(tmp_path)
    run = load(tmp_path)
    assert [saved.time for saved in run.frames] == [0.0, 1.5e-6, 3e-6]
    assert run.frames[2].section[0, -1] == 2.0
    assert run.steps is None
    assert run.pictures == ()
    assert list(run.history["time_s"]) == [0.0, 1.5e-6]  # the last line was cut short
    np.testing.assert_array_equal(run.history["kinetic_J"], [np.nan, 2.5])


def test_a_moved_run(tmp_path):
    (tmp_path / "here").mkdir()
    killed_run(tmp_path / "here")
    shutil.move(tmp_path / "here", tmp_path / "there")
    assert load(tmp_path / "there").frames[1].pressure[3] == 4.0


def test_particles_that_left(tmp_path):
    scene = block((6, 4, 3), walls=OPEN, margin_cells=1)
    with UsdWriter(tmp_path / "block.usdc", scene, pressure_range=(0.0, 1e9), frames=3) as usd:
        for index in range(2):
            usd.write(frame(index, scene))
    run = load(tmp_path / "block.usdc")
    assert (run.name, run.summary, run.history, run.steps, run.setup) == ("block", {}, {}, None, None)
    for index in range(2):
        np.testing.assert_array_equal(run.frames[index].inside, frame(index, scene).inside)
        assert np.all((run.frames[index].pressure == 0.0) >= ~run.frames[index].inside)


def contents(directory):
    return {file: file.read_bytes() for file in directory.rglob("*") if file.is_file()}


@pytest.mark.parametrize("resume", [False, True])
def test_a_run_of_another_scene_is_left_alone(ended, resume):
    before = contents(ended.output)
    other, save = replace(SCENE, name="cone"), Save(frames=2, figures=False)
    said = r"^output: .* than 'cone', got .* of 'block'; choose another one with -o \(output=\.\.\.\), or remove it$"
    with pytest.raises(InputError, match=said):
        simulate(other, save=save, output=ended.output, resume=resume)
    assert contents(ended.output) == before


def test_a_directory_that_cannot_be_made_is_refused_for_both_ways_of_use(tmp_path):
    (tmp_path / "file").write_text("")
    said = r"^output: expected a directory that can be written, got .*; choose another one with -o \(output=\.\.\.\)$"
    with pytest.raises(InputError, match=said):
        simulate(SCENE, output=tmp_path / "file" / "run")


def test_the_command_refuses_another_scene_in_one_line(tmp_path, capfd):
    killed_run(tmp_path)
    assert main(["run", "two_point", "--set", "cell_size=2e-2", "-o", str(tmp_path)]) == 2
    output, error = capfd.readouterr()
    assert (output, error.count("\n")) == ("", 1)


def test_the_same_scene_again_leaves_no_old_pictures(tmp_path):
    """Pictures that are not drawn this time go, whatever else is there stays."""
    killed_run(tmp_path)
    there = tmp_path / "figures"
    there.mkdir()
    for name in ("front.png", "field.gif", "field.mp4", "mine.png", "charge.gif"):
        (there / name).write_bytes(b"old")
    simulate(SCENE, save=Save(frames=2, figures=False), output=tmp_path)
    assert sorted(os.listdir(there)) == ["charge.gif", "mine.png"]
    assert sorted(os.listdir(tmp_path)) == ["block.usdc", "figures", "history.csv", "steps.npz", "summary.json"]


def test_the_names_of_all_pictures_are_known():
    assert set(PICTURES) == set(figures.PICTURES)
    assert set(FILMS) == set(film.FILMS)


def test_a_damaged_summary_does_not_keep_a_run_from_its_directory(tmp_path):
    (tmp_path / "summary.json").write_text("[1")
    assert simulate(SCENE, save=Save(frames=2, figures=False), output=tmp_path).summary["status"] == "complete"


def test_a_run_in_the_same_place_is_not_the_old_one(tmp_path):
    for offset in (0, 1):
        with UsdWriter(tmp_path / "block.usdc", SCENE, pressure_range=(0.0, 1e9), frames=3) as usd:
            usd.write(frame(offset))
            old = load(tmp_path).frames if offset == 0 else None
        assert load(tmp_path).frames[0].pressure[0] == offset
    assert old is None


def test_the_description_of_a_shipped_scene_comes_back():
    scene = load_scene("two_point", cell_size=2e-2)
    setup = description_from_json(json.loads(json.dumps(scene_values(scene)["setup"])))
    assert len(setup.gauges) > 0
    for name in ("front_path", "line", "collision_points", "gauges"):
        assert getattr(setup, name) == getattr(scene, name)


@pytest.mark.parametrize("detonator", [PointDetonator((0.0, 0.0, 0.0), 1e-6), PlaneDetonator((0, 0, 0), (1, 0, 0))])
def test_a_description_comes_back(detonator):
    scene = block((6, 4, 3), detonators=(detonator,))
    setup = description_from_json(json.loads(json.dumps(scene_values(scene)["setup"])))
    for name in ("domain", "walls", "section", "detonators", "line", "picture_times", "gauges", "end_time"):
        assert getattr(setup, name) == getattr(scene, name)


def damaged(directory, name: str):
    """Spoil a run directory; returns what to load."""
    if name == "truncated":
        (directory / "block.usda").unlink()
        shutil.copy(directory / "clips" / "frame_00001.usdc", directory / "block.usdc")
        whole = (directory / "block.usdc").read_bytes()
        (directory / "block.usdc").write_bytes(whole[: len(whole) // 2])
    elif name == "other.usda":
        (directory / name).write_text('#usda 1.0\ndef Cube "cube" {}\n')
        return directory / name
    elif name == "empty":
        (directory / name).mkdir()
        return directory / name
    elif name == "no frames":
        (directory / "block.usda").unlink()
    elif name == "lost clips":
        shutil.rmtree(directory / "clips")
    elif name.endswith((".json", ".csv", ".npz")):
        (directory / name).write_text("{}\n[" if name.endswith(".csv") else "[1")
    elif name == "setup":
        write_summary(directory / "summary.json", {"scene": "block", "setup": {"domain": {}}})
    else:
        return directory / name
    return directory


def read_everything(path):
    run = load(path)
    return run.summary, run.setup, run.history, run.steps, run.frames[0].position


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("missing", "load: expected a run directory or a USD file, got .*, which does not exist"),
        ("history.csv", "expected a table of numbers"),
        ("summary.json", "expected JSON"),
        ("steps.npz", "expected the steps of a run"),
        ("setup", "expected the description of a scene"),
        ("truncated", "possibly truncated"),
        ("other.usda", "expected a USD file that warp_mpm wrote"),
        ("empty", "which has neither"),
        ("no frames", "expected a USD file with frames"),
        ("lost clips", "expected a whole USD"),
    ],
)
def test_what_cannot_be_read_is_one_line(tmp_path, name, message):
    killed_run(tmp_path)
    path = damaged(tmp_path, name)
    with pytest.raises(InputError, match=message) as caught:
        read_everything(path)
    assert "\n" not in str(caught.value)
