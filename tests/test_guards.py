"""What stops a run: particles that became absurd, time steps that come to no end, disks that are full; in one line."""

import json
import os
import re
import shutil
import subprocess
import sys

import numpy as np
import pytest
import warp as wp
from scenes_for_tests import CELL, OPEN, ORDERS_AND_TRANSFERS, block, inert_gas, start

from warp_mpm import guards, simulation
from warp_mpm.config import Save, SolverConfig
from warp_mpm.conservation import Audit, totals_of
from warp_mpm.errors import SimulationError
from warp_mpm.kernels.records import CLAMPED_ENERGY
from warp_mpm.launch import find_device
from warp_mpm.model import build_model
from warp_mpm.output.checkpoint import checkpoint_files, read_checkpoint
from warp_mpm.progress import Silent
from warp_mpm.scene_loading import load_scene
from warp_mpm.simulation import simulate
from warp_mpm.state import State, memory_needed

SPOILT = {
    "velocity": (np.nan, "got nan (kg/m3|J/kg)"),  # it spreads to its nodes and neighbors, of which one is named
    "energy": (np.nan, "expected a finite energy, got nan J/kg"),
    "density": (-500.0, "expected a positive density, got -"),
}


@pytest.mark.parametrize(("name", "value", "message"), [(name, *case) for name, case in SPOILT.items()])
def test_an_absurd_particle_stops_the_run(device, monkeypatch, name, value, message):
    """The run ends after the step that shows it, and says which particle it is, where and when."""

    class Spoilt(State):
        def __init__(self, model, launcher):
            super().__init__(model, launcher)
            values = self.values(name).copy()
            values[100] = value
            self.assign(name, values)

    monkeypatch.setattr(simulation, "State", Spoilt)
    pattern = (
        rf"^block: step 1 at [^\n]* us: particle \d+ of charge 'block' \(ammonium nitrate\) at [^\n]*{message}[^\n]*$"
    )
    with pytest.raises(SimulationError, match=pattern):
        simulate(block((6, 4, 3), end_time=1e-5), device=device, threads=1)


def test_a_particle_that_goes_too_far_in_a_step_stops_the_run(device):
    """Gas with free surfaces, in a step a thousand times as long as sound and speed allow."""
    solver = start(block((4, 4, 4), material=inert_gas(1.0, 1e5), walls=OPEN, margin_cells=2), device)
    clock = solver.state.clock.numpy().copy()
    clock["dt"] = 1000.0 * CELL / 300.0
    solver.state.clock.assign(clock)
    solver.state.maxima.zero_()  # what would shorten it
    solver.step()
    with pytest.raises(SimulationError, match=r"^block: step 1 at .* within reach .*; try a smaller cfl[^\n]*$"):
        guards.check_state(solver.state, 1)


def test_time_steps_that_come_to_no_end_stop_the_run(device):
    solver = start(block((6, 4, 3)), device)
    solver.step()
    guards.check_state(solver.state, 1)
    for share in (0.9 * guards.SHORTEST_STEP, 0.0, np.nan):
        clock = solver.state.clock.numpy().copy()
        clock["dt"] = share * clock["first_dt"]
        solver.state.clock.assign(clock)
        with pytest.raises(
            SimulationError, match=r"particle \d+ of charge 'block' .* expected time steps of more than"
        ):
            guards.check_state(solver.state, 1)


def test_the_last_good_checkpoint_is_named_and_can_be_read(tmp_path, monkeypatch):
    """From some step on the steps are called too short: what was saved before is whole, and the summary says why."""

    class Impatient(Silent):
        def update(self, time: float, end_time: float, step: int, note: str) -> None:
            """Lose patience after ten steps."""
            if step == 10:
                monkeypatch.setattr(guards, "SHORTEST_STEP", 10.0)

    scene, save = load_scene("two_point", cell_size=2e-2), Save(checkpoint_steps=3, figures=False)
    with pytest.raises(
        SimulationError, match=r"last good checkpoint is .*checkpoint_00000009.npz, --resume \(resume=True\) goes on"
    ):
        simulate(scene, save=save, output=tmp_path, progress=Impatient())
    header, _ = read_checkpoint(checkpoint_files(tmp_path)[0])
    assert header["values"]["steps"] == 9
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["status"].startswith("failed: two_point: step 11 at ")


def test_energy_that_is_clamped_is_warned_of(device):
    """Two per cent of the energy are added; nothing is said of none."""
    solver = start(block((6, 4, 3)), device)
    audit = Audit(np.zeros(3), solver.model.scene.mass)
    audit.add(totals_of(solver))
    assert guards.clamp_warnings(audit) == []
    tallies = solver.state.tallies.numpy().copy()
    tallies[CLAMPED_ENERGY] = 0.02 * totals_of(solver).internal
    solver.state.tallies.assign(tallies)
    audit.add(totals_of(solver))
    assert guards.clamp_warnings(audit) == [
        "energy: 2.00% of it was added to particles that would have had less than none; try a smaller cfl"
    ]


def test_a_directory_that_is_removed_is_one_line(tmp_path):
    class Remove(Silent):
        def update(self, time: float, end_time: float, step: int, note: str) -> None:
            """Remove it after three steps."""
            if step == 3:
                shutil.rmtree(tmp_path)

    with pytest.raises(SimulationError, match=r"^cannot write [^\n]*; free some space, or choose another [^\n]*$"):
        simulate(load_scene("two_point", cell_size=2e-2), output=tmp_path, progress=Remove())
    assert not tmp_path.exists()


LIMITED = """
import resource, sys
from warp_mpm.cli import main
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[1]), resource.RLIM_INFINITY))
sys.exit(main(sys.argv[2:]))
"""
RUN = ("run", "two_point", "--set", "cell_size=2e-2", "--frames", "5", "--layout", "clips", "--checkpoint-steps", "20")
LIMITS = {"frame_00000.usdc": 20_000, "checkpoint_00000020.npz": 90_000}  # [bytes]: half of what the file needs


@pytest.mark.parametrize(("file", "limit"), LIMITS.items(), ids=LIMITS)
def test_a_full_disk_is_one_line_and_leaves_what_was_there(tmp_path, file, limit):
    """No file may grow beyond a limit, which the named one is the first to reach."""
    pytest.importorskip("resource", reason="this system limits no file's size")
    command = [sys.executable, "-c", LIMITED, str(limit), *RUN, "-o", str(tmp_path)]
    run = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert run.returncode == 1, run.stderr
    assert re.fullmatch(rf"warp-mpm: cannot write .*{file}: .*File too large.*; free some space, .*\n", run.stderr)
    names = [name for _, _, files in os.walk(tmp_path) for name in files]
    assert "summary.json" in names
    assert [name for name in names if ".part" in name or name == file] == []


@pytest.mark.parametrize("material", [None, inert_gas()], ids=["explosive", "inert"])
@pytest.mark.parametrize(("order", "transfer"), ORDERS_AND_TRANSFERS)
def test_the_memory_that_a_state_needs_is_what_it_takes(order, transfer, material, device):
    """All arrays with an entry for each particle or node, to a few bytes: some have a node to spare."""
    config = SolverConfig(order=order, transfer=transfer)
    model = build_model(block((5, 4, 3), material=material, margin_cells=1), config, find_device(device))
    state = State(model)
    arrays = [value for holder in (state.grid, state.particles, state) for value in vars(holder).values()]
    taken = sum(
        array.size * wp.types.type_size_in_bytes(array.dtype)
        for array in arrays
        if isinstance(array, wp.array) and array.size >= state.count and array is not state.tallies
    )
    assert taken == pytest.approx(memory_needed(model), abs=64)
