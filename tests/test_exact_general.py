"""Exact flows for any equation of state: against the closed forms of the gamma law, and against conservation.

Their device functions are in single precision, so that they are good to some 1e-6 of the largest value; 1e-4 in what
follows from that by differences or integration.
"""

import math

import numpy as np
import pytest
from scenes_for_tests import TNT

from warp_mpm.exact import riemann
from warp_mpm.exact.chapman_jouguet import (
    chapman_jouguet_state,
    energy_at_pressure,
    energy_for_speed,
    ideal_gas_energy,
    ideal_gas_state,
    pressure_of,
)
from warp_mpm.exact.general_riemann import GeneralRiemannProblem, MatterState
from warp_mpm.exact.general_taylor_wave import general_taylor_wave
from warp_mpm.exact.isentrope import isentrope
from warp_mpm.exact.reflection import collision_pressure
from warp_mpm.exact.similar_flow import SimilarFlow
from warp_mpm.exact.taylor_wave import RIGID, PlanarTaylorWave
from warp_mpm.kernels.eos.ideal_gas import IdealGas
from warp_mpm.kernels.eos.stiffened_gas import StiffenedGas

DENSITY, ENERGY = 1630.0, 7e9 / 1630.0  # of TNT
WATER = StiffenedGas(4.4, 6e8)
TIME = 1e-5  # [s]


def distances(one, other, edges, time):
    """Largest differences of the cell means of two flows, over the largest value of the second."""
    for name in ("pressure", "velocity", "density"):
        first, second = (getattr(flow, f"mean_{name}")(edges, time) for flow in (one, other))
        yield np.abs(first - second).max() / np.abs(second).max()


def test_similar_flow_between_its_points():
    """A line, a jump, and uniform beyond; the means are its integrals."""
    xi = np.array([0.0, 1.0, 1.0, 2.0])
    values = np.array([1.0, 3.0, 5.0, 5.0])
    flow = SimilarFlow(xi, values, -values, values, origin=1.0)
    x = np.array([-1.0, 1.0, 2.0, 2.999, 3.001, 9.0])
    np.testing.assert_allclose(flow.pressure(x, 2.0), [1.0, 1.0, 2.0, 2.999, 5.0, 5.0])
    np.testing.assert_allclose(flow.velocity(x, 2.0), -flow.density(x, 2.0))
    np.testing.assert_allclose(flow.mean_pressure(np.array([-1.0, 1.0, 2.0, 4.0, 6.0]), 2.0), [1.0, 1.5, 3.75, 5.0])


@pytest.mark.parametrize("gamma", [1.4, 2.0, 3.0])
def test_the_isentrope_of_an_ideal_gas(gamma):
    """p ~ rho^gamma, J = 2 (c - c_0) / (gamma - 1)."""
    states = isentrope(IdealGas(gamma), 2.0, 3e5)
    start = math.sqrt(gamma * (gamma - 1.0) * 3e5)
    np.testing.assert_allclose(states.pressure, (gamma - 1.0) * 6e5 * (states.density / 2.0) ** gamma, rtol=1e-4)
    np.testing.assert_allclose(states.riemann, 2.0 / (gamma - 1.0) * (states.sound_speed - start), atol=1e-4 * start)


def test_the_isentrope_of_jwl():
    """p = A exp(-R1 V) + B exp(-R2 V) + C / V^(1 + w) with one C, over all of a hundredfold expansion."""
    cj = chapman_jouguet_state(TNT, DENSITY, ENERGY)
    internal = ENERGY + 0.5 * cj.pressure * (1.0 / DENSITY - 1.0 / cj.density)
    states = isentrope(TNT, cj.density, internal)
    volume = DENSITY / states.density
    cold = TNT.a * np.exp(-TNT.r1 * volume) + TNT.b * np.exp(-TNT.r2 * volume)
    constant = (states.pressure - cold) * volume ** (1.0 + TNT.omega)
    assert len(volume) > 1000
    assert volume[-1] > 70.0
    np.testing.assert_allclose(constant, constant[0], rtol=1e-3)  # at the front the cold terms are 20 times the third
    squared = np.gradient(states.pressure, states.density)[1:-1]
    np.testing.assert_allclose(states.sound_speed[1:-1] ** 2, squared, rtol=2e-3)  # central differences, 0.2 % apart


@pytest.mark.parametrize("gamma", [1.4, 2.0, 3.0])
def test_the_taylor_wave_of_the_gamma_law(gamma):
    speed = 2800.0
    general = general_taylor_wave(IdealGas(gamma), 1000.0, ideal_gas_energy(gamma, speed))
    edges = np.linspace(-0.1, 1.3, 57) * speed * TIME
    closed = PlanarTaylorWave(gamma, 1000.0, speed, RIGID)
    inside = edges >= 0.0  # beyond the wall one is uniform, the other empty
    assert max(distances(general, closed, edges[inside], TIME)) < 1e-4


def test_the_free_taylor_wave_of_the_gamma_law():
    """Down to a thousandth of the density at the front, where c is still 3 % of what it was: gamma = 2."""
    free = general_taylor_wave(IdealGas(2.0), 1000.0, ideal_gas_energy(2.0, 2800.0), rigid=False, last_density=1.0)
    edges = np.linspace(-1.2, 1.2, 49) * 2800.0 * TIME
    errors = list(distances(free, PlanarTaylorWave(2.0, 1000.0, 2800.0), edges, TIME))
    assert errors[0] < 1e-4
    assert errors[2] < 1e-3


def test_the_taylor_wave_of_jwl_conserves():
    """Mass, momentum and energy between the wall and the front: rho0 D t, p_wall t, and rho0 D t E0."""
    flow = general_taylor_wave(TNT, DENSITY, ENERGY)
    speed = chapman_jouguet_state(TNT, DENSITY, ENERGY).detonation_speed
    x = np.linspace(0.0, speed * TIME, 1001)
    x = 0.5 * (x[1:] + x[:-1])
    width = x[1] - x[0]
    density, velocity, pressure = flow.density(x, TIME), flow.velocity(x, TIME), flow.pressure(x, TIME)
    mass = DENSITY * speed * TIME
    assert density.sum() * width == pytest.approx(mass, rel=1e-4)
    assert (density * velocity).sum() * width == pytest.approx(flow.pressures[0] * TIME, rel=1e-4)
    specific = [energy_at_pressure(TNT, at, p) for at, p in zip(density.tolist(), pressure, strict=True)]
    energy = (density * (specific + 0.5 * velocity**2)).sum() * width
    assert energy == pytest.approx(mass * ENERGY, rel=1e-4)


@pytest.mark.parametrize("number", [1, 3, 5])
def test_toros_tubes(number):
    """The same star states and flows as the closed form of the ideal gas."""
    closed, time = riemann.TORO_TESTS[number - 1], riemann.TORO_TIMES[number - 1]
    gas = IdealGas(1.4)
    left, right = (
        MatterState(gas, state.density, state.velocity, state.pressure / (0.4 * state.density))
        for state in (closed.left, closed.right)
    )
    general = GeneralRiemannProblem(left, right, closed.origin)
    assert general.star == pytest.approx((closed.star.pressure, closed.star.velocity), rel=1e-5)
    assert max(distances(general.flow, closed, np.linspace(-0.5, 1.5, 101), time)) < 1e-4


def test_two_materials_meet():
    """TNT's products against water: what the ends bring in is what there is more of: mass, momentum and energy.

    Midpoints miss up to half an interval at each jump, 1 / 4800 of the length.
    """
    left = MatterState(TNT, DENSITY, 100.0, ENERGY)
    right = MatterState(WATER, 1000.0, -50.0, energy_at_pressure(WATER, 1000.0, 1e5))
    flow = GeneralRiemannProblem(left, right).flow
    edges = np.linspace(-0.06, 0.06, 2401)
    x, width = 0.5 * (edges[1:] + edges[:-1]), edges[1] - edges[0]
    density, velocity, pressure = flow.density(x, TIME), flow.velocity(x, TIME), flow.pressure(x, TIME)
    contact = GeneralRiemannProblem(left, right).star[1] * TIME
    internal = np.array(
        [
            energy_at_pressure(TNT if at < contact else WATER, rho, p)
            for at, rho, p in zip(x.tolist(), density.tolist(), pressure, strict=True)
        ]
    )
    total = density * (internal + 0.5 * velocity**2)

    def brought(state, half):
        """Mass, momentum and energy that the state's end has brought, with what was there in its half."""
        sign = 1.0 if half < 0.0 else -1.0
        full = state.density * (state.energy + 0.5 * state.velocity**2)
        way = abs(half) + sign * state.velocity * TIME
        return np.array(
            [
                state.density * way,
                state.density * state.velocity * way + sign * state.pressure * TIME,
                full * way + sign * state.pressure * state.velocity * TIME,
            ]
        )

    expected = brought(left, -0.06) + brought(right, 0.06)
    found = np.array([density.sum() * width, (density * velocity).sum() * width, total.sum() * width])
    np.testing.assert_allclose(found, expected, rtol=1e-3)


def test_materials_that_part_are_an_error():
    gas = MatterState(IdealGas(1.4), 1.0, -1e5, 1e5)
    with pytest.raises(ValueError, match="got a vacuum between them"):
        _ = GeneralRiemannProblem(gas, MatterState(IdealGas(1.4), 1.0, 1e5, 1e5)).flow


@pytest.mark.parametrize("gamma", [1.4, 2.0, 3.0])
def test_collision_of_fronts_in_the_gamma_law(gamma):
    """p / p_CJ = (5 gamma + 1 + sqrt(17 gamma^2 + 2 gamma + 1)) / (4 gamma)."""
    pressure = collision_pressure(IdealGas(gamma), 1000.0, ideal_gas_energy(gamma, 2800.0))
    expected = (5.0 * gamma + 1.0 + math.sqrt(17.0 * gamma**2 + 2.0 * gamma + 1.0)) / (4.0 * gamma)
    assert pressure / ideal_gas_state(gamma, 1000.0, 2800.0).pressure == pytest.approx(expected, rel=1e-5)


def test_water_at_rest():
    """Its pressure to the rounding of gamma p_inf, and the Hugoniot of a weak shock: u_s = c to first order."""
    energy = energy_at_pressure(WATER, 1000.0, 101325.0)
    assert pressure_of(WATER, 1000.0, energy) == pytest.approx(101325.0, abs=1000.0)
    state = MatterState(WATER, 1000.0, 0.0, energy)
    assert state.sound_speed == pytest.approx(math.sqrt(4.4 * 6.001e8 / 1000.0), rel=1e-4)
    change = state.velocity_change(1e7)
    assert 1e7 / (1000.0 * state.sound_speed * change) == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize("speed", [6800.0, 6930.0, 7500.0])
def test_energy_for_speed_of_jwl(speed):
    """D depends on E0 weakly, because products have pressure without it."""
    energy = energy_for_speed(TNT, DENSITY, speed)
    assert chapman_jouguet_state(TNT, DENSITY, energy).detonation_speed == pytest.approx(speed, rel=1e-6)


def test_no_energy_makes_jwl_slow():
    with pytest.raises(ValueError, match="expected an energy that gives 5000 m/s"):
        energy_for_speed(TNT, DENSITY, 5000.0)
