"""The time step: as long as waves, detonation and growth allow, and the last one ends at the end time."""

import itertools

import numpy as np
import pytest
from scenes_for_tests import (
    CELL,
    OPEN,
    ROUND_OFF,
    advance,
    audited,
    block,
    explosive,
    inert_gas,
    particle_values,
    start,
)

from warp_mpm.builder import SceneBuilder
from warp_mpm.config import Save, SolverConfig
from warp_mpm.detonators import PointDetonator
from warp_mpm.geometry import Box
from warp_mpm.simulation import simulate

SPEED = 2800.0  # detonation speed [m/s]


@pytest.mark.parametrize("cfl", [0.1, 0.3])
def test_the_first_step_of_a_fresh_charge(cfl, device):
    """A step of cfl h / D while anything is unburnt, with h the smallest spacing: here 8 mm of 8 x 10 x 12."""
    builder = SceneBuilder("brick")
    box = Box((0.0, 0.0, 0.0), (0.08, 0.1, 0.12))
    builder.domain(box.lower, box.upper, cells=(10, 10, 10))
    builder.charge(box, explosive())
    builder.detonator(PointDetonator((0.0, 0.0, 0.0), booster=False))
    builder.end_time(1.0)
    solver = advance(start(builder.build(), device, cfl=cfl), 1)
    assert float(solver.state.clock_values()["dt"]) == pytest.approx(cfl * 0.008 / SPEED, rel=4 * ROUND_OFF)


def test_the_step_obeys_its_limits(device):
    """At most cfl h / max(c + |v|, D while unburnt) and 10 % above the last step; most are as long as allowed.

    The limits are those of the state before the step. Without viscosity only the strain rate can shorten it further.
    """
    solver = start(block((12, 3, 2)), device, viscosity=(0.0, 0.0))
    last, at_limit = None, 0
    for step in range(80):
        values = particle_values(solver.state)
        sound = np.sqrt(2.0 * values["energy"].astype(np.float64))  # gamma (gamma - 1) e
        fastest = (sound[:, None] + np.abs(values["velocity"])).max()
        if solver.state.field("burn_fraction").min() < 1.0:
            fastest = max(fastest, SPEED)
        advance(solver, 1)
        dt = float(solver.state.clock_values()["dt"])
        limit = 0.3 * CELL / fastest
        if last is not None and 1.1 * last < limit:
            limit = 1.1 * last
        assert dt <= limit * (1.0 + 8 * ROUND_OFF), f"step {step}"
        at_limit += dt > limit * (1.0 - 1e-5)
        last = dt
    assert at_limit > 60


def test_a_step_grows_by_a_tenth_at_most(device):
    """After a short first step they grow by 10 % each, until the Courant number limits them."""
    solver = advance(start(block((6, 4, 3)), device), 1)
    clock = solver.state.clock.numpy().copy()
    clock["dt"] = 1e-8
    solver.state.clock.assign(clock)
    steps = []
    for _ in range(60):
        advance(solver, 1)
        steps.append(float(solver.state.clock_values()["dt"]))
    ratios = np.array([after / before for before, after in itertools.pairwise([1e-8, *steps])])
    assert ratios.max() < 1.1 * (1.0 + 8 * ROUND_OFF)
    np.testing.assert_allclose(ratios[:40], 1.1, rtol=8 * ROUND_OFF)
    assert steps[-1] == pytest.approx(0.3 * CELL / SPEED, rel=0.1)


def test_the_last_step_ends_at_the_end_time(device):
    """The end time exactly, in double; the clipped step does not count as the smallest."""
    first = 0.3 * CELL / SPEED
    scene = block((6, 4, 3), end_time=2.25 * first)
    result = simulate(scene, save=Save(frames=2), device=device, threads=1)
    assert result.summary["end_time_s"] == scene.end_time
    assert result.summary["steps"] == 3
    assert result.record.time[-1] == scene.end_time
    assert result.record.dt[-1] == pytest.approx(0.25 * first, rel=1e-4)
    assert result.summary["min_dt_s"] == pytest.approx(first, rel=8 * ROUND_OFF)
    assert result.summary["first_dt_s"] == pytest.approx(first, rel=8 * ROUND_OFF)


def test_time_adds_up_in_double(device):
    """The time is the sum of the steps, to the rounding of double, and rises with each."""
    result = simulate(block((6, 4, 3), end_time=60e-6), config=SolverConfig(), save=Save(frames=2), device=device)
    time, dt = result.record.time, result.record.dt.astype(np.float64)
    assert time[0] == 0.0
    assert np.all(np.diff(time) > 0.0)
    np.testing.assert_allclose(np.diff(time)[:-1], dt[1:-1], rtol=1e-9)
    assert time[-1] == 60e-6


@pytest.mark.parametrize("energy", [1e6, 2.5e5, 2.5e3, 2.5e-1])
def test_an_ambient_pressure_limits_the_first_step(energy, device):
    """cfl h / c, or cfl h / sqrt((p_ambient - p) / rho) in gas so thin that this drives it faster than sound.

    The step is then cfl^2 of the time in which the surface, with (p_ambient - p) / (rho h), would cross its cell twice
    over; no particle moves by more than a few such shares of its cell, where it would have crossed many.
    """
    ambient, density, gamma = 1e5, 1.0, 1.4
    gas = inert_gas(density, energy, gamma)
    scene = block((4, 3, 3), material=gas, walls=OPEN, margin_cells=2, ambient_pressure=ambient)
    solver = advance(start(scene, device), 1)
    pressure = (gamma - 1.0) * density * energy
    squared = max(gamma * pressure, ambient - pressure) / density
    first = float(solver.state.clock_values()["dt"])
    assert first == pytest.approx(0.3 * CELL / np.sqrt(squared), rel=1e-5)
    assert float(solver.state.clock_values()["last_drift"]) < 4 * 0.3**2


def test_gas_far_below_the_ambient_pressure_implodes_quietly(device):
    """A block at a hundredth of the ambient pressure is driven together, and bounces; mass and energy are kept.

    Energy relative to what it had: the ambient pressure does a hundred times as much work.
    """
    scene = block((6, 3, 3), material=inert_gas(1.0, 2.5e3), walls=OPEN, margin_cells=3, ambient_pressure=1e5)
    solver = start(scene, device)
    audit = audited(solver, 150)
    assert audit.mass_error < 1e-6
    assert audit.energy_error < 1e-4
    assert particle_values(solver.state)["density"].max() > 2.0
