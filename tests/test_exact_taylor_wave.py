"""The planar Taylor wave with a wall or a piston behind it, and the closed forms of the gamma law.

The free rear face is tested in test_taylor.py. Reference: Fickett and Davis, Detonation, section 2C.
"""

import math

import numpy as np
import pytest

from warp_mpm.exact.chapman_jouguet import chapman_jouguet_state, ideal_gas_energy, ideal_gas_state
from warp_mpm.exact.taylor_wave import FREE, RIGID, PlanarTaylorWave
from warp_mpm.kernels.eos.ideal_gas import IdealGas

DENSITY, SPEED = 1000.0, 2800.0
TIME = 1e-4  # [s]
PISTONS = {"wall": 0.0, "pushing": 0.2, "pulling": -0.3, "at the CJ speed": 1.0}  # of u_CJ

gammas = pytest.mark.parametrize("gamma", [1.3, 2.0, 3.0])
pistons = pytest.mark.parametrize("share", PISTONS.values(), ids=PISTONS.keys())


def wave_of(gamma, share):
    return PlanarTaylorWave(gamma, DENSITY, SPEED, piston_speed=share * SPEED / (gamma + 1.0))


def quadrature(lower, upper):
    """400 intervals with 8 Gauss points each."""
    points, weights = np.polynomial.legendre.leggauss(8)
    edges = np.linspace(lower, upper, 401)
    half = 0.5 * np.diff(edges)[:, None]
    return edges[:-1, None] + half * (points + 1.0), half * weights


def test_the_published_plateau():
    """gamma = 2: p = (3 / 4)^4 p_CJ = 0.3164 p_CJ at rest from a rigid wall to x = D t / 2."""
    wave = wave_of(2.0, 0.0)
    assert wave.plateau_pressure / wave.cj_pressure == pytest.approx(0.3164, abs=5e-5)
    assert wave.fan_end_speed == pytest.approx(SPEED / 2.0)
    x = np.array([0.0, 0.2, 0.4999]) * SPEED * TIME
    np.testing.assert_allclose(wave.pressure(x, TIME), wave.plateau_pressure, rtol=1e-12)
    np.testing.assert_allclose(wave.velocity(x, TIME), 0.0, atol=1e-9)
    assert wave.velocity(np.array(0.51 * SPEED * TIME), TIME) > 0.0


@gammas
@pistons
def test_mass_momentum_and_energy(gamma, share):
    """Between piston and front there is the mass rho0 D t; the piston's push and work are the rest of the balance."""
    wave = wave_of(gamma, share)
    piston = wave.piston_speed
    swept = DENSITY * SPEED * TIME
    mass = momentum = energy = 0.0
    for lower, upper in ((piston, wave.fan_end_speed), (wave.fan_end_speed, SPEED)):  # smooth in each
        x, volume = quadrature(lower * TIME, upper * TIME)
        density, velocity = wave.products_density(x, TIME), wave.velocity(x, TIME)
        mass += (density * volume).sum()
        momentum += (density * velocity * volume).sum()
        energy += ((wave.pressure(x, TIME) / (gamma - 1.0) + 0.5 * density * velocity**2) * volume).sum()
    push = wave.plateau_pressure * TIME
    assert mass == pytest.approx(swept, rel=1e-8)
    assert momentum == pytest.approx(push, rel=1e-8)
    assert energy == pytest.approx(swept * ideal_gas_energy(gamma, SPEED) + push * piston, rel=1e-8)


@gammas
@pistons
def test_state_and_invariants(gamma, share):
    """The piston's velocity in the plateau, straight characteristics in the fan, one C- invariant and one entropy."""
    wave = wave_of(gamma, share)
    x = np.linspace(wave.piston_speed, SPEED, 301) * TIME
    velocity, sound = wave.velocity(x, TIME), wave.sound_speed(x, TIME)
    plateau = x < wave.fan_end_speed * TIME
    np.testing.assert_allclose(velocity[plateau], wave.piston_speed, rtol=1e-12, atol=1e-9)
    np.testing.assert_allclose((velocity + sound)[~plateau], x[~plateau] / TIME, rtol=1e-12)
    np.testing.assert_allclose(velocity - 2.0 / (gamma - 1.0) * sound, wave.tail_speed, rtol=1e-12)
    pressure, density = wave.pressure(x, TIME), wave.products_density(x, TIME)
    np.testing.assert_allclose(gamma * pressure / density, sound**2, rtol=1e-11)
    np.testing.assert_allclose(pressure / density**gamma, pressure[-1] / density[-1] ** gamma, rtol=1e-11)
    behind = np.array([wave.piston_speed * TIME - 1e-6, SPEED * TIME + 1e-6])
    for field in (wave.pressure, wave.velocity, wave.products_density, wave.sound_speed):
        assert not field(behind, TIME).any()


def test_the_piston_decides_between_free_and_overdriven():
    """A piston that outruns the gas is a free face; one just slower leaves next to nothing; a faster than CJ raises."""
    free = PlanarTaylorWave(2.0, DENSITY, SPEED)
    assert free.piston_speed == FREE
    assert free.rear_speed == free.fan_end_speed == free.tail_speed
    assert free.plateau_pressure == 0.0
    x = np.linspace(-1.1, 1.1, 221) * SPEED * TIME
    outrun = PlanarTaylorWave(2.0, DENSITY, SPEED, 1.5 * free.tail_speed)
    np.testing.assert_array_equal(outrun.pressure(x, TIME), free.pressure(x, TIME))
    np.testing.assert_array_equal(outrun.mean_pressure(x, TIME), free.mean_pressure(x, TIME))
    nearly = PlanarTaylorWave(2.0, DENSITY, SPEED, 0.999 * free.tail_speed)
    assert 0.0 < nearly.plateau_pressure < 1e-9 * nearly.cj_pressure
    with pytest.raises(ValueError, match="overdrive"):
        wave_of(2.0, 1.001)
    with pytest.raises(ValueError, match="overdrive"):
        PlanarTaylorWave(2.0, DENSITY, SPEED, math.nan)
    with pytest.raises(ValueError, match="gamma"):
        PlanarTaylorWave(1.0, DENSITY, SPEED)


@gammas
@pytest.mark.parametrize("share", [*PISTONS.values(), FREE])
def test_cell_means_are_integrals(gamma, share):
    """Of pressure, density and velocity, in cells that hold the piston, the fan's end and the front, and beyond.

    The midpoint rule with 4000 points a cell is off by at most 1 / 4000 of a jump within the cell.
    """
    wave = wave_of(gamma, share)
    edges = np.linspace(1.2 * max(wave.rear_speed, -SPEED) - 0.1 * SPEED, 1.3 * SPEED, 30) * TIME
    x = edges[:-1, None] + np.diff(edges)[:, None] * (np.arange(4000) + 0.5) / 4000
    state = wave.cj_state
    density = np.where(x > SPEED * TIME, DENSITY, wave.products_density(x, TIME))
    for exact, field, scale in (
        (wave.mean_pressure, wave.pressure(x, TIME), state.pressure),
        (wave.mean_density, density, state.density),
        (wave.mean_velocity, wave.velocity(x, TIME), abs(wave.tail_speed)),
    ):
        means = exact(edges, TIME)
        difference = np.abs(means - field.mean(axis=1)) / scale
        assert difference.max() < 1.0 / 4000
        assert (difference > 2e-7).sum() <= 2  # only where a jump lies: piston and front


def test_total_content_of_cells():
    """The cells together hold the mass that was there, and with a free rear face a known integral: 0.4 p_CJ D t."""
    wave = PlanarTaylorWave(2.0, DENSITY, SPEED)
    edges = np.linspace(-1.5, 1.5, 8) * SPEED * TIME
    width = np.diff(edges)
    assert (wave.mean_pressure(edges, TIME) * width).sum() == pytest.approx(0.4 * wave.cj_pressure * SPEED * TIME)
    assert (wave.mean_density(edges, TIME) * width).sum() == pytest.approx(1.5 * DENSITY * SPEED * TIME)
    wall = PlanarTaylorWave(2.0, DENSITY, SPEED, RIGID)
    assert (wall.mean_density(edges, TIME) * width).sum() == pytest.approx(1.5 * DENSITY * SPEED * TIME)


@gammas
def test_closed_forms_of_the_gamma_law(gamma):
    """They are what the general search finds for the equation of state."""
    energy = ideal_gas_energy(gamma, SPEED)
    found, closed = chapman_jouguet_state(IdealGas(gamma), DENSITY, energy), ideal_gas_state(gamma, DENSITY, SPEED)
    for name in ("detonation_speed", "pressure", "density", "particle_velocity", "sound_speed"):
        assert getattr(closed, name) == pytest.approx(getattr(found, name), rel=1e-5)
    assert ideal_gas_energy(2.0, SPEED) == pytest.approx(1.307e6, rel=5e-4)
    for bad in ((1.0, DENSITY, SPEED), (gamma, 0.0, SPEED), (gamma, DENSITY, -1.0), (math.nan, DENSITY, SPEED)):
        with pytest.raises(ValueError, match="expected"):
            ideal_gas_state(*bad)
