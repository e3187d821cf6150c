"""Constant body force: free fall is exact, a column of gas stands, and walls carry the weight.

Source: paper eq. 9 (f + M g at the nodes); hydrostatics dp/dx = -rho g.
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
    block,
    inert_gas,
    particle_values,
    start,
)

from warp_mpm.config import ShapeFunction, Transfer
from warp_mpm.scene import Walls

GRAVITY = np.array([1.0, -9.81, 3.0])  # [m/s2]
THROWN = np.array([3.0, -2.0, 1.0])  # initial velocity [m/s]
CONFIGS = [{"transfer": transfer} for transfer in Transfer] + [{"shape": shape} for shape in ShapeFunction]


@pytest.mark.parametrize("config", CONFIGS, ids=lambda config: next(iter(config.values())).value)
def test_free_fall(config, device):
    """V = v0 + g t and x = x0 + sum of dt v(t) (paper eq. 15: a step moves with the velocity of its end), to round-off.

    That sum leads v0 t + g t^2 / 2 by the sum of g dt^2 / 2, half a step's way. The gas has next to no energy: its
    pressure, 4e-10 Pa, accelerates by 4e-8 m/s2. Each step rounds a velocity a few times, a fraction of a cell once.
    """
    steps = 40

    def throw(state):
        state.assign("velocity", np.broadcast_to(THROWN.astype(np.float32), (state.count, 3)))

    gas = inert_gas(density=1.0, energy=1e-9)
    scene = block((3, 3, 3), material=gas, walls=OPEN, margin_cells=13, gravity=tuple(GRAVITY))
    solver = start(scene, device, prepare=throw, **config)
    begin = particle_values(solver.state)["position"]
    way, lead, now = np.zeros(3), np.zeros(3), 0.0
    for _ in range(steps):
        advance(solver, 1)
        clock = solver.state.clock_values()
        dt, now = float(clock["dt"]), float(clock["time"])
        way += dt * (THROWN + GRAVITY * now)
        lead += GRAVITY * dt**2 / 2
    values = particle_values(solver.state)
    assert values["mass"].min() > 0.0
    fastest = np.abs(THROWN + GRAVITY * now).max()
    speed_error = 4 * steps * ROUND_OFF * fastest
    np.testing.assert_allclose(values["velocity"] - (THROWN + GRAVITY * now), 0.0, atol=speed_error)
    moved = values["position"] - begin
    place_error = steps * ROUND_OFF * CELL + speed_error * now
    np.testing.assert_allclose(moved - way, 0.0, atol=place_error)
    np.testing.assert_allclose(moved - (THROWN * now + GRAVITY * now**2 / 2 + lead), 0.0, atol=2 * place_error)
    assert np.abs(moved).max() > 10 * CELL


@pytest.mark.parametrize("transfer", [Transfer.DAMPED_FLIP, Transfer.FLIP], ids=lambda transfer: transfer.value)
@pytest.mark.parametrize("cells", [20, 40])
def test_a_column_of_gas_stands(cells, transfer, device):
    """P(x) = p0 - rho g (x - H/2) with uniform density is at rest, and stays so for two crossings of sound.

    What breaks the balance is the wall: a node there averages the pressure over the cell next to it and its image, to
    an error of about rho g h / 3 at the wall and none elsewhere. It sends waves of that height, and gas moves by
    their speed p / (rho c), g h / c / 3 at most. Both shrink with the cell.
    """
    density, energy, gamma = 1.2, 2.1e5, 1.4
    height = cells * CELL
    middle = (gamma - 1.0) * density * energy
    gravity = 0.2 * middle / (density * height)
    sound = np.sqrt(gamma * middle / density)

    def pressure_at(x):
        return middle - density * gravity * (x - height / 2)

    def stand(state):
        x = particle_values(state)["position"][state.particles.index.numpy(), 0]
        state.assign("energy", (pressure_at(x) / ((gamma - 1.0) * density)).astype(np.float32))

    gas = inert_gas(density, energy, gamma)
    scene = block((cells, 1, 1), material=gas, gravity=(-gravity, 0.0, 0.0))
    solver = advance(start(scene, device, prepare=stand, transfer=transfer), 8 * cells)
    assert float(solver.state.clock_values()["time"]) * sound > 2 * height
    velocity = particle_values(solver.state)["velocity"]
    assert np.abs(velocity[:, 0]).max() < gravity * CELL / sound / 3
    assert np.abs(velocity[:, 1:]).max() < 8 * cells * ROUND_OFF * sound
    nodal = solver.state.field_pressure()[:, 0, 0].astype(np.float64)
    place = np.arange(cells + 1) * CELL
    error = np.abs(nodal - pressure_at(place)) / (density * gravity * CELL)
    assert error.max() < 0.5
    assert error[2:-2].max() < 0.1
    slope = np.polyfit(place[1:-1], nodal[1:-1], 1)[0]
    assert slope == pytest.approx(-density * gravity, rel=0.1 / cells)  # 0.1 rho g h over the height


@pytest.mark.parametrize("walls", [Walls(), STICK], ids=["slip", "stick"])
@pytest.mark.parametrize(("order", "transfer"), ORDERS_AND_TRANSFERS)
def test_walls_carry_the_weight(order, transfer, walls, device):
    """P(t) = J_walls + M g t, to round-off, while gas falls onto three walls at once; see `test_conservation.py`."""
    gas = inert_gas(1000.0, 1e6)
    scene = block((6, 5, 4), material=gas, walls=walls, gravity=(3e6, -2e6, 1e6))
    audit = audited(start(scene, device, order=order, transfer=transfer), 40, every=1)
    assert audit.momentum_error < 1e-6


def test_potential_energy_is_audited(device):
    """E - g . sum m x is constant to g . P dt / 2: places are half a step ahead of velocities (`test_free_fall`).

    A step adds g . (P(t) + P(t + dt)) dt / 2 to the kinetic energy and takes g . P(t + dt) dt from the potential one;
    the difference adds up to g . P dt / 2, if steps are equally long. Here they differ by 5 %: half as much again.
    """
    gravity, energy = 1e4, 1e4
    scene = block((4, 4, 4), material=inert_gas(1000.0, energy), gravity=(0.0, 0.0, -gravity))
    solver = start(scene, device)
    audit = audited(solver, 60, every=1)
    clock = solver.state.clock_values()
    assert clock["first_dt"] < 1.05 * clock["smallest_dt"]
    lead = gravity * audit.largest_momentum * float(clock["first_dt"]) / 2
    assert audit.energy_error < 1.5 * lead / (scene.mass * energy) + 1e-6
    weight = scene.mass * gravity * 4 * CELL  # times height [J]
    assert audit.energy_error < 0.01 * weight / (scene.mass * energy)
