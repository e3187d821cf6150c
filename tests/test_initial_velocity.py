"""Charges that move at the start: their velocities reach the particles, the first step and the audit.

A cold block (its pressure is 1e-20 of its kinetic energy) in uniform motion keeps its velocity and its shape exactly,
by Galilean invariance of the shape functions: their weights add up to one, their slopes to zero.
"""

import numpy as np
import pytest
from scenes_for_tests import (
    CELL,
    OPEN,
    ORDERS_AND_TRANSFERS,
    ROUND_OFF,
    STICK,
    advance,
    audited,
    inert_gas,
    particle_values,
    start,
)

from warp_mpm.builder import SceneBuilder
from warp_mpm.conservation import totals_of
from warp_mpm.errors import InputError
from warp_mpm.geometry import Box
from warp_mpm.scene import Walls
from warp_mpm.summary import color_limit

VELOCITY = (30.0, -20.0, 10.0)  # [m/s]
SPEED = float(np.linalg.norm(VELOCITY))
COLD = 1e-20  # of the kinetic energy
STEPS = 40
EXACT = 1e-6  # of conserved sums, as in test_conservation.py


def moving_block(
    velocity, *, energy=COLD * SPEED**2 / 2.0, walls=OPEN, margin_cells=6.0, cells=(4, 3, 3), charges=1, **options
):
    """A block of gas of 1 kg/m3 at the origin, or two of them on top of each other, the second one at rest."""
    builder = SceneBuilder("moving")
    box = Box((0.0, 0.0, 0.0), tuple(CELL * n for n in cells))
    builder.domain(box.lower, box.upper, cells=cells, margins=margin_cells * CELL)
    builder.walls(walls)
    gas = inert_gas(energy=energy)
    if charges == 1:
        builder.charge(box, gas, velocity=velocity, **options)
    else:
        half = CELL * (cells[2] // 2)
        lower = Box(box.lower, (*box.upper[:2], half))
        builder.charge(lower, gas, velocity=velocity, **options)
        builder.charge(Box((0.0, 0.0, half), box.upper), gas)
    builder.end_time(1.0)
    return builder.build()


@pytest.mark.parametrize(("order", "transfer"), ORDERS_AND_TRANSFERS)
def test_uniform_motion_changes_nothing_but_the_place(order, transfer, device):
    """Velocity, density and the particles' distances stay, and the block goes v t far, about fourteen cells.

    Each step rounds a velocity, and a fraction of a cell, two to four times, to 6e-8 of their size. What that costs of
    the kinetic energy the damping returns as heat, and gas whose sound is 2e-4 of its speed relaxes its densities a
    little where the block's edge leaves cells part empty.
    """
    solver = start(moving_block(VELOCITY, margin_cells=13.0), device, order=order, transfer=transfer)
    before = particle_values(solver.state)
    advance(solver, STEPS)
    after = particle_values(solver.state)
    time = float(solver.state.clock_values()["time"])
    tolerance = 4 * STEPS * ROUND_OFF
    assert time * SPEED > 13 * CELL
    assert np.abs(after["velocity"] - np.array(VELOCITY)).max() < tolerance * SPEED
    assert np.abs(after["density"] / before["density"] - 1.0).max() < 1e-3
    way = (after["position"] - before["position"]) / CELL
    assert np.abs(way - way.mean(axis=0)).max() < tolerance
    assert way.mean(axis=0) == pytest.approx(np.array(VELOCITY) * time / CELL, rel=tolerance)


@pytest.mark.parametrize(("order", "transfer"), ORDERS_AND_TRANSFERS)
@pytest.mark.parametrize("walls", [Walls(), STICK], ids=["slip", "stick"])
def test_momentum_and_energy_of_a_block_that_hits_the_walls(order, transfer, walls, device):
    """P = P(0) + J_walls from a moving start, and what the audit starts from is that of the charge."""
    scene = moving_block(VELOCITY, energy=1e3, walls=walls, margin_cells=0.0)
    solver = start(scene, device, order=order, transfer=transfer)
    first = totals_of(solver)
    assert first.momentum == pytest.approx(scene.mass * np.array(VELOCITY), rel=EXACT)
    assert first.kinetic == pytest.approx(0.5 * scene.mass * SPEED**2, rel=EXACT)
    audit = audited(solver, STEPS)
    last = totals_of(solver)
    assert audit.momentum_error < EXACT
    assert np.abs(last.momentum - first.momentum).max() > 0.1 * scene.mass * SPEED  # the walls did something
    if transfer.value in ("damped_flip", "flip") and order.value == "musl":
        assert audit.energy_error < EXACT


def test_outflow_of_a_moving_block_is_counted(device):
    """All of a cold block that flies out of the domain takes its momentum and energy with it."""
    scene = moving_block((SPEED, 0.0, 0.0), margin_cells=1.0)
    solver = start(scene, device)
    audit = audited(solver, STEPS)
    totals = totals_of(solver)
    assert totals.mass == 0.0
    assert totals.mass_out == pytest.approx([0.0, scene.mass, 0.0, 0.0, 0.0, 0.0], rel=EXACT)
    assert audit.momentum_error < EXACT
    assert audit.energy_error < EXACT


def test_a_function_of_the_positions(device):
    """Each particle has the velocity of its place, whatever the order in memory; other charges are at rest."""
    scene = moving_block(lambda place: 1e3 * place[:, [2, 0, 1]], charges=2, cells=(4, 3, 4))
    values = particle_values(start(scene, device).state)
    moving = len(scene.charges[0].positions)
    expected = 1e3 * values["position"][:moving, [2, 0, 1]]
    assert values["velocity"][:moving] == pytest.approx(expected, rel=4 * ROUND_OFF)
    assert not values["velocity"][moving:].any()
    assert scene.charges[1].velocities is None


def test_a_function_may_work_in_place():
    """It gets a copy: positions stay where they are."""

    def velocity(place):
        place *= 1e3
        return place

    (charge,) = moving_block(velocity).charges
    assert charge.velocities == pytest.approx(1e3 * charge.positions)


def test_no_motion_is_at_rest():
    assert moving_block((0.0, 0.0, 0.0)).charges[0].velocities is None
    assert moving_block(None).charges[0].velocities is None


def test_the_first_step_of_moving_gas(device):
    """cfl h / (c + |v|) along the fastest axis, with c^2 = gamma (gamma - 1) e."""
    solver = advance(start(moving_block(VELOCITY, energy=1e3), device), 1)
    expected = 0.3 * CELL / (np.sqrt(1.4 * 0.4 * 1e3) + 30.0)
    assert float(solver.state.clock_values()["first_dt"]) == pytest.approx(expected, rel=4 * ROUND_OFF)


def test_the_first_step_knows_the_strain_rate(device):
    """v = -k x strains at the rate 3 k everywhere, which quadratic shape functions see exactly: dt = 0.2 / (3 k).

    Only outside the gas do nodes lack neighbours; the particles next to its surface do not reach them.
    """
    rate = 4e3  # [1/s]; without the limit the step would be 0.3 h / (k h)
    scene = moving_block(lambda place: -rate * (place - 2.0 * CELL), cells=(4, 4, 4), particles_per_axis=3)
    solver = advance(start(scene, device), 1)
    dt = float(solver.state.clock_values()["first_dt"])
    assert dt == pytest.approx(0.2 / (3.0 * rate), rel=0.25)
    assert dt < 0.5 * 0.3 * CELL / (rate * 2.0 * CELL)


@pytest.mark.parametrize(
    ("velocity", "message"),
    [
        ((1.0, 2.0), "velocity: expected three finite numbers, got (1.0, 2.0)"),
        (5.0, "velocity: expected three finite numbers, got 5.0"),
        ((1.0, float("nan"), 0.0), "velocity: expected three finite numbers, got nan"),
        ("fast", "velocity: expected three finite numbers, got 'fast'"),
        (lambda place: place[:, 0], "into finite velocities (288, 3), got one that returns shape (288,)"),
        (lambda place: "fast", "into finite velocities (288, 3), got one that returns str"),
        (lambda place: None, "got one that returns"),
        (
            lambda place: np.full(place.shape, np.nan),
            "got one that returns (nan, nan, nan) at (0.0025, 0.0025, 0.0025) m",
        ),
    ],
)
def test_bad_velocities_are_refused_in_one_line(velocity, message):
    with pytest.raises(InputError) as caught:
        moving_block(velocity)
    assert str(caught.value).startswith("scene moving: charge 'charge_1': velocity: expected ")
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_colours_reach_the_pressure_of_gas_that_stops():
    """Cold gas of speed v has rho v^2 / 2 to give; at rest it is rho e as before."""
    assert color_limit(moving_block(VELOCITY)) == pytest.approx(0.5 * SPEED**2)
    assert color_limit(moving_block(None, energy=1e3)) == pytest.approx(1e3)
