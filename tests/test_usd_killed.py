"""A run that is killed, at whatever moment, leaves a file that opens and has every frame that was finished."""

import multiprocessing
import time
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from pxr import Usd
from scenes_for_tests import block

from warp_mpm.config import Layout
from warp_mpm.output.frame import Frame
from warp_mpm.output.usd import UsdWriter
from warp_mpm.scene import Scene

FRAMES = 30
CLOSING = "closing"
MOMENTS = [  # when to kill: so many seconds after a frame was finished, or merging began, which takes about 20 ms
    *((frame, 1e-3 * (3 * frame % 10)) for frame in (0, 1, 6, 13, 20, FRAMES - 1)),
    *((CLOSING, delay) for delay in (0.0, 2e-3, 5e-3, 10e-3, 20e-3)),
]


@cache
def scene() -> Scene:
    """Large enough for a kill to hit the middle of writing: 12,000 particles."""
    return block((30, 25, 2), end_time=1e-6 * (FRAMES - 1))


def position_of(index: int) -> np.ndarray:
    """Places in a frame that no other has, and that do not compress."""
    return np.random.default_rng(index).random((scene().particle_count, 3), dtype=np.float32)


def frame_of(index: int) -> Frame:
    count = scene().particle_count
    section = np.zeros([scene().domain.cells[axis] + 1 for axis in scene().section.in_plane], dtype=np.float32)
    pressure = np.linspace(0.0, 1e9, count, dtype=np.float32)
    return Frame(index, 1e-6 * index, position_of(index), pressure, np.ones(count, dtype=bool), section)


def write_all(path: Path, report) -> None:
    """Write frames and close, reporting each that is finished."""
    with UsdWriter(path, scene(), pressure_range=(0.0, 1e9), frames=FRAMES, layout=Layout.SINGLE) as writer:
        for index in range(FRAMES):
            writer.write(frame_of(index))
            report.send(index)
        report.send(CLOSING)


def finished_when_killed(path: Path, moment: object, delay: float) -> int:
    """Number of frames that a process had finished when it was killed, some time after a moment."""
    processes = multiprocessing.get_context("forkserver")
    processes.set_forkserver_preload([__name__])
    receiver, sender = processes.Pipe(duplex=False)
    writer = processes.Process(target=write_all, args=(path, sender))
    writer.start()
    sender.close()
    reports = []
    while moment not in reports:
        reports.append(receiver.recv())
    time.sleep(delay)
    writer.kill()
    writer.join()
    while receiver.poll():
        try:
            reports.append(receiver.recv())
        except EOFError:
            break
    return len([report for report in reports if report != CLOSING])


def points_found(path: Path) -> list[np.ndarray]:
    """Points of every frame in what a person would open: the whole file, or if there is none what plays the clips."""
    stage = Usd.Stage.Open(str(path if path.exists() else path.with_suffix(".usda")))
    assert stage.GetCompositionErrors() == []
    points = stage.GetAttributeAtPath("/World/particles.points")
    return [np.array(points.Get(index)) for index in range(round(stage.GetEndTimeCode()) + 1)]


@pytest.mark.skipif("forkserver" not in multiprocessing.get_all_start_methods(), reason="this system has no fork")
def test_a_killed_run_keeps_every_finished_frame(tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parent))  # for the server that starts the processes
    path = tmp_path / "block.usdc"
    for moment, delay in MOMENTS:  # in one directory, so that each run also meets what the one before left
        finished = finished_when_killed(path, moment, delay)
        frames = points_found(path)
        assert finished <= len(frames) <= FRAMES, (moment, delay)
        for index, points in enumerate(frames):
            np.testing.assert_array_equal(points, position_of(index))
    _receiver, sender = multiprocessing.Pipe()
    write_all(path, sender)
    assert [file.name for file in tmp_path.iterdir()] == ["block.usdc"]
