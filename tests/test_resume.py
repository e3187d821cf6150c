"""Runs that are stopped or killed, and go on: the same results as those of a run that never stopped, bit for bit."""

import json
import os
import random
import signal
import subprocess
import sys
import time
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from warp_mpm import launch, stopping
from warp_mpm.cli import main
from warp_mpm.config import Layout, Save, SolverConfig
from warp_mpm.errors import InputError, Terminated
from warp_mpm.output.checkpoint import checkpoint_files
from warp_mpm.progress import Silent
from warp_mpm.result import Result
from warp_mpm.scene_loading import load_scene
from warp_mpm.simulation import simulate

STEPS = 68  # of the whole run
OF_THE_MACHINE = ("wall_s", "solver_wall_s", "ns_per_particle_step", "threads", "device", "version")
RESULTS = ("history.csv", "gauges.csv", "steps.npz", "two_point.usdc")


@cache
def scene():
    """A small plate in the open, lit at both ends, with gauges; gas leaves, particles are sorted five times."""
    return load_scene("two_point", cell_size=2e-2, confinement="free")


def save(**settings):
    return Save(**{"frames": 9, "figures": False, **settings})


class StopAt(Silent):
    """Asks the run to stop while it is in a step, once or several times."""

    def __init__(self, step: int, *signals: signal.Signals) -> None:
        self.step, self.signals = step, list(signals or (signal.SIGINT,))

    def update(self, time: float, end_time: float, step: int, note: str) -> None:
        """Ask after a certain step; on a GPU, which makes several at once, perhaps a little later."""
        while step >= self.step and self.signals:
            signal.raise_signal(self.signals.pop(0))


def run(directory: Path, save_as: Save | None = None, **settings) -> Result:
    return simulate(scene(), save=save_as or save(), output=directory, **{"device": "cpu", **settings})


@pytest.fixture(scope="module")
def uninterrupted(tmp_path_factory):
    """The directory of a run on one thread that never stopped."""
    directory = tmp_path_factory.mktemp("whole")
    run(directory, threads=1)
    return directory


def resume(directory: Path, **settings) -> Result:
    return run(directory, save(**settings), threads=3, resume=True)


def of_physics(directory: Path) -> dict:
    summary = json.loads((directory / "summary.json").read_text())
    return {name: value for name, value in summary.items() if name not in OF_THE_MACHINE}


def assert_same_results(directory: Path, whole: Path) -> None:
    assert of_physics(directory) == of_physics(whole)
    for name in RESULTS:
        assert (directory / name).read_bytes() == (whole / name).read_bytes(), name
    assert sorted(os.listdir(directory)) == sorted(os.listdir(whole))


@pytest.mark.parametrize("step", [1, 20, 21, 47])
def test_a_stopped_run_goes_on_as_if_it_had_not(uninterrupted, tmp_path, monkeypatch, step):
    monkeypatch.setattr(launch, "SMALLEST_SHARED_WORK", 0)  # so that three threads do work
    with pytest.raises(KeyboardInterrupt, match=f"interrupted at .* us.*checkpoint_{step:08d}.npz"):
        run(tmp_path, threads=1, progress=StopAt(step))
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert (summary["status"], summary["steps"]) == ("interrupted", step)
    last = (tmp_path / "history.csv").read_text().splitlines()[-1].split(",")
    assert (float(last[0]), int(last[1])) == (summary["end_time_s"], step)  # its frame is there too
    assert resume(tmp_path).summary["steps"] == STEPS
    assert_same_results(tmp_path, uninterrupted)


@pytest.mark.parametrize("step", [20, 21])
def test_on_any_device(device, tmp_path, step):
    """On a GPU where nodes sum in a fixed order, and particles are sorted at steps that no stop changes."""
    whole, parts = tmp_path / "whole", tmp_path / "parts"
    settings = {"config": SolverConfig(reproducible=True), "device": device}
    steps = run(whole, **settings).summary["steps"]
    with pytest.raises(KeyboardInterrupt):
        run(parts, progress=StopAt(step), **settings)
    assert run(parts, resume=True, **settings).summary["steps"] == steps
    for name in ("gauges.csv", "steps.npz", "two_point.usdc"):  # the history has sums in no fixed order
        assert (parts / name).read_bytes() == (whole / name).read_bytes(), name


def test_a_signal_right_after_another_is_the_same_request(uninterrupted, tmp_path):
    """As a pool of processes sends it: SIGTERM to those that Ctrl-C has just reached."""
    both = StopAt(30, signal.SIGINT, signal.SIGTERM)
    with pytest.raises(KeyboardInterrupt, match="interrupted at"):
        run(tmp_path, threads=1, progress=both)
    assert signal.getsignal(signal.SIGTERM) == signal.SIG_DFL
    resume(tmp_path)
    assert_same_results(tmp_path, uninterrupted)


def test_a_signal_a_second_later_ends_a_run_at_once(tmp_path, monkeypatch):
    """Without a checkpoint: the step does not come to its end."""
    monkeypatch.setattr(stopping, "TOGETHER", -1.0)
    twice = StopAt(30, signal.SIGINT, signal.SIGINT)
    with pytest.raises(KeyboardInterrupt) as ended:
        run(tmp_path, threads=1, progress=twice)
    assert str(ended.value) == ""
    assert checkpoint_files(tmp_path) == []
    assert signal.getsignal(signal.SIGINT) == signal.default_int_handler


def test_sigterm_stops_a_run_in_good_order(uninterrupted, tmp_path):
    with pytest.raises(Terminated) as stopped:
        run(tmp_path, threads=1, progress=StopAt(30, signal.SIGTERM))
    assert stopped.value.code == 143
    assert signal.getsignal(signal.SIGTERM) == signal.SIG_DFL
    resume(tmp_path)
    assert_same_results(tmp_path, uninterrupted)


def test_a_run_may_stop_many_times(uninterrupted, tmp_path):
    for first, step in enumerate((5, 6, 40, 66)):
        with pytest.raises(KeyboardInterrupt):
            run(tmp_path, progress=StopAt(step), resume=first > 0)
    resume(tmp_path)
    assert_same_results(tmp_path, uninterrupted)


def test_frames_that_stay_apart_are_kept(tmp_path):
    """The clips of frames before the stop are not written again, those after it are."""
    whole, parts = tmp_path / "whole", tmp_path / "parts"
    run(whole, save(layout=Layout.CLIPS))
    with pytest.raises(KeyboardInterrupt):
        run(parts, save(layout=Layout.CLIPS), progress=StopAt(30))
    before = {clip.name: clip.stat().st_mtime_ns for clip in (parts / "clips").glob("frame_*")}
    assert 3 < len(before) < 9
    resume(parts, layout=Layout.CLIPS)
    again = [name for name, time in before.items() if (parts / "clips" / name).stat().st_mtime_ns != time]
    assert again == [max(before)]  # that of the stop
    for file in ("two_point.usda", *(f"clips/{clip.name}" for clip in (whole / "clips").iterdir())):
        assert (parts / file).read_bytes() == (whole / file).read_bytes(), file


def test_checkpoints_change_nothing_and_two_are_kept(uninterrupted, tmp_path):
    left = []

    class Look(Silent):
        def update(self, *_) -> None:
            left.append([file.name for file in checkpoint_files(tmp_path)])

    run(tmp_path, save(checkpoint_steps=7), progress=Look())
    assert left[13] == ["checkpoint_00000007.npz"]
    assert left[50] == ["checkpoint_00000049.npz", "checkpoint_00000042.npz"]
    assert_same_results(tmp_path, uninterrupted)  # none is left


def test_checkpoints_by_the_clock(tmp_path):
    with pytest.raises(KeyboardInterrupt):
        run(tmp_path, save(checkpoint_minutes=1e-9), progress=StopAt(5))
    assert [file.name for file in checkpoint_files(tmp_path)] == ["checkpoint_00000005.npz", "checkpoint_00000004.npz"]


@pytest.fixture(scope="module")
def stopped(tmp_path_factory):
    """The directory of a run that was stopped at step 30, with checkpoints of steps 24 and 30."""
    directory = tmp_path_factory.mktemp("stopped")
    with pytest.raises(KeyboardInterrupt):
        run(directory, save(checkpoint_steps=8), progress=StopAt(30))
    return directory


def copy_of(stopped, directory):
    for file in stopped.iterdir():
        (directory / file.name).write_bytes(file.read_bytes())
    return checkpoint_files(directory)


@pytest.mark.parametrize("share", [0.0, 0.01, 0.5, 0.999])
def test_a_truncated_checkpoint_makes_way_for_the_one_before(uninterrupted, stopped, tmp_path, share):
    newest, _ = copy_of(stopped, tmp_path)
    os.truncate(newest, int(share * newest.stat().st_size))
    (warning,) = set(resume(tmp_path).summary["warnings"]) - set(of_physics(uninterrupted)["warnings"])
    assert "checkpoint_00000030.npz: expected a whole checkpoint" in warning
    assert (tmp_path / "two_point.usdc").read_bytes() == (uninterrupted / "two_point.usdc").read_bytes()


def test_one_wrong_bit_is_noticed(stopped, tmp_path):
    for file in copy_of(stopped, tmp_path):
        content = bytearray(file.read_bytes())
        content[len(content) // 2] ^= 1
        file.write_bytes(content)
    with pytest.raises(InputError, match=r"expected a whole checkpoint, got one that cannot be read .*CRC"):
        resume(tmp_path)


def rewritten(file, **changes):
    with np.load(file) as arrays:
        np.savez(file, **{**arrays, **changes})


class Payload:
    """Leaves a file when it is unpickled."""

    def __init__(self, path: str) -> None:
        self.path = path

    def __reduce__(self):
        return (Path.touch, (Path(self.path),))


def test_nothing_in_a_checkpoint_is_executed(stopped, tmp_path):
    for file in copy_of(stopped, tmp_path):
        rewritten(file, evil=np.array([Payload(str(tmp_path / "executed"))], dtype=object))
    with pytest.raises(InputError, match=r"cannot be read .*allow_pickle"):
        resume(tmp_path)
    assert not (tmp_path / "executed").exists()


def forged(**changes):
    """Changes of a saved array's values."""

    def forge(file):
        with np.load(file) as arrays:
            values = {name: arrays[name] for name in changes}
        for name, change in changes.items():
            change(values[name])
        rewritten(file, **values)

    return forge


def set_field(name, value):
    def change(array):
        array[name][5] = value

    return change


def set_value(value):
    def change(array):
        array.flat[3] = value

    return change


FORGED = {
    "a cell outside the domain": forged(**{"particles.position": set_field("cell", 30000)}),
    "a fraction that is not a number": forged(**{"particles.position": set_field("fraction", np.nan)}),
    "a particle twice": forged(**{"particles.index": set_value(7)}),
    "a range beyond the particles": forged(ranges=set_value(10**6)),
    "a block outside the grid": forged(**{"grid.blocks": set_value(10**6)}),
    "fewer particles": lambda file: rewritten(file, **{"particles.index": np.arange(5, dtype=np.int32)}),
    "another type": lambda file: rewritten(file, **{"particles.index": np.zeros(1600)}),
    "a clock of text": lambda file: rewritten(file, **{"state.clock": np.array("noon")}),
    "other rows": lambda file: rewritten(file, **{"record.rows": np.zeros((3, 3))}),
    "no header": lambda file: rewritten(file, header=np.array("[]")),
    "a header without values": lambda file: rewritten(file, header=with_values(file, lambda values: {})),
    "a history without rows": lambda file: rewritten(file, header=with_values(file, no_history)),
}


def no_history(values):
    return {**values, "history": []}


def with_values(file, change):
    """The header of a checkpoint, with other values."""
    with np.load(file) as arrays:
        header = json.loads(str(arrays["header"]))
    return np.array(json.dumps({**header, "values": change(header["values"])}))


@pytest.mark.parametrize("forge", FORGED.values(), ids=FORGED)
def test_a_forged_checkpoint_is_one_clear_line(stopped, tmp_path, forge):
    for file in copy_of(stopped, tmp_path):
        forge(file)
    with pytest.raises(InputError, match=r"^[^\n]*checkpoint_00000030.npz: expected [^\n]*$"):
        resume(tmp_path)


def test_a_checkpoint_of_another_version(stopped, tmp_path):
    for file in copy_of(stopped, tmp_path):
        with np.load(file) as arrays:
            header = json.loads(str(arrays["header"]))
        rewritten(file, header=np.array(json.dumps({**header, "version": "0.0.0"})))
    with pytest.raises(InputError, match=r"expected a checkpoint of version .*, got one of version 0.0.0; go on with"):
        resume(tmp_path)


def test_other_scenes_and_settings_are_refused_by_name(stopped):
    with pytest.raises(InputError, match=r"got others: .*scene walls, solver cfl; give the same again"):
        simulate(
            load_scene("two_point", cell_size=2e-2, confinement="rigid"),
            config=SolverConfig(cfl=0.2),
            save=save(),
            output=stopped,
            device="cpu",
            resume=True,
        )
    with pytest.raises(InputError, match="got others: save frames;"):
        resume(stopped, frames=10)


def test_without_a_checkpoint_there_is_nothing_to_resume(tmp_path, capfd):
    words = ["run", "two_point", "--set", "cell_size=2e-2", "--resume", "-o", str(tmp_path)]
    assert main(words) == 2
    error = capfd.readouterr().err
    assert error.startswith("warp-mpm: resume: expected a checkpoint to go on from, got none in ")
    assert error.count("\n") == 1


def test_a_fresh_run_forgets_older_checkpoints(stopped, tmp_path):
    copy_of(stopped, tmp_path)
    with pytest.raises(KeyboardInterrupt):
        run(tmp_path, progress=StopAt(2))
    assert [file.name for file in checkpoint_files(tmp_path)] == ["checkpoint_00000002.npz"]


def command(directory: Path, *words: str) -> list[str]:
    settings = [
        "--set",
        "cell_size=2e-2",
        "confinement=free",
        "--frames",
        "9",
        "--checkpoint-steps",
        "3",
        "--device",
        "cpu",
    ]
    return [sys.executable, "-m", "warp_mpm", "run", "two_point", *settings, *words, "-o", str(directory)]


def test_a_run_that_is_killed_again_and_again_ends_with_the_same_results(uninterrupted, tmp_path):
    """Each time at a random moment, of starting too; as soon as there is a checkpoint the next run goes on from it."""
    chance = random.Random(7)
    kills = 0
    while kills < 5:
        words = ["--resume"] if checkpoint_files(tmp_path) else []
        with subprocess.Popen(command(tmp_path, *words), stdout=subprocess.PIPE, text=True) as run:
            for line in run.stdout:
                if "%" in line:  # it takes steps
                    break
            time.sleep(0.1 * chance.random())
            run.kill()
        kills += 1
    assert resume(tmp_path, checkpoint_steps=3).summary["status"] == "complete"
    assert_same_results(tmp_path, uninterrupted)


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_signals_to_the_command(tmp_path, number, code):
    with subprocess.Popen(
        command(tmp_path, "--solver", "cfl=0.01"), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as run:
        for line in run.stdout:
            if "%" in line:
                break
        run.send_signal(number)
        _, error = run.communicate(timeout=60)
    assert run.returncode == code
    assert error.startswith("warp-mpm: interrupted at ")
    assert error.count("\n") == 1
    assert json.loads((tmp_path / "summary.json").read_text())["status"] == "interrupted"
