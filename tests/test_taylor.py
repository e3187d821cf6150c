"""The planar Taylor wave: the exact solution solves its equations, and the simulation comes close to it.

Reference: G. I. Taylor, Proc. R. Soc. A 200 (1950) 235; Fickett and Davis, Detonation, section 2C. The solution is
checked against the Euler equations themselves, not against the formulas it was written from.
"""

import numpy as np
import pytest

from warp_mpm.config import Save, SolverConfig
from warp_mpm.exact.chapman_jouguet import chapman_jouguet_state
from warp_mpm.exact.taylor_wave import PlanarTaylorWave
from warp_mpm.kernels.eos.ideal_gas import IdealGas
from warp_mpm.scene_loading import load_scene
from warp_mpm.simulation import simulate
from warp_mpm.verification import cell_means, pressure_error, relative_l1

DENSITY, SPEED = 1000.0, 2800.0
TIME = 1e-4  # [s]

gammas = pytest.mark.parametrize("gamma", [1.4, 2.0, 3.0])


def wave_of(gamma):
    return PlanarTaylorWave(gamma, DENSITY, SPEED)


def inside(wave, count=2001):
    """Places in the products, the tail and the front left out."""
    return np.linspace(0.98 * wave.tail_speed * TIME, 0.999 * SPEED * TIME, count)


@gammas
def test_the_wave_solves_the_euler_equations(gamma):
    """d(rho)/dt + d(rho u)/dx = 0, d(rho u)/dt + d(rho u^2 + p)/dx = 0, p / rho^gamma uniform.

    Central differences with steps of 1e-4 of the wave are exact to 1e-8 of third derivatives: 1e-5 of each term, near
    the tail, where powers of the distance to it are differentiated, is safe.
    """
    wave = wave_of(gamma)
    x = inside(wave)
    dx, dt = 1e-4 * SPEED * TIME, 1e-4 * TIME

    def conserved(place, time):
        density, velocity = wave.products_density(place, time), wave.velocity(place, time)
        return density, density * velocity, density * velocity**2 + wave.pressure(place, time)

    before, after = conserved(x, TIME - dt), conserved(x, TIME + dt)
    left, right = conserved(x - dx, TIME), conserved(x + dx, TIME)
    for held, flux in ((0, 1), (1, 2)):
        rate = (after[held] - before[held]) / (2 * dt)
        divergence = (right[flux] - left[flux]) / (2 * dx)
        scale = np.abs(rate).max()
        assert scale > 0.0
        np.testing.assert_allclose(rate + divergence, 0.0, atol=1e-5 * scale)
    entropy = wave.pressure(x, TIME) / wave.products_density(x, TIME) ** gamma
    np.testing.assert_allclose(entropy, entropy[-1], rtol=1e-9)


@gammas
def test_the_characteristics_are_straight(gamma):
    """C+ starts at the origin, u + c = x / t; the C- invariant u - 2 c / (gamma - 1) is the same everywhere."""
    wave = wave_of(gamma)
    x = inside(wave)
    velocity, sound = wave.velocity(x, TIME), wave.sound_speed(x, TIME)
    np.testing.assert_allclose(velocity + sound, x / TIME, rtol=0, atol=1e-9 * SPEED)
    np.testing.assert_allclose(velocity - 2.0 / (gamma - 1.0) * sound, wave.tail_speed, rtol=1e-9)
    squared = gamma * wave.pressure(x, TIME) / wave.products_density(x, TIME)
    np.testing.assert_allclose(sound**2, squared, rtol=1e-9)


@gammas
def test_the_front_is_the_chapman_jouguet_state(gamma):
    """At x = D t the state is that of the equation of state's own Chapman-Jouguet point; beyond there is nothing."""
    wave = wave_of(gamma)
    energy = SPEED**2 / (2.0 * (gamma**2 - 1.0))
    state = chapman_jouguet_state(IdealGas(gamma), DENSITY, energy)
    front = np.array([SPEED * TIME])
    assert wave.pressure(front, TIME)[0] == pytest.approx(state.pressure, rel=1e-5)
    assert wave.cj_pressure == pytest.approx(state.pressure, rel=1e-5)
    assert wave.velocity(front, TIME)[0] == pytest.approx(state.particle_velocity, rel=1e-5)
    assert wave.products_density(front, TIME)[0] == pytest.approx(state.density, rel=1e-5)
    outside = np.array([1.001 * wave.tail_speed * TIME, 1.001 * SPEED * TIME])
    for field in (wave.pressure, wave.velocity, wave.products_density, wave.sound_speed):
        assert not field(outside, TIME).any()


@gammas
def test_the_wave_conserves_mass_momentum_and_energy(gamma):
    """What the front has swept, rho0 D t, is all there: with no momentum, as no force acts, and its energy E0.

    Gauss quadrature in 400 parts: the integrands are powers of the distance to the tail, smooth elsewhere.
    """
    wave = wave_of(gamma)
    points, weights = np.polynomial.legendre.leggauss(8)
    edges = np.linspace(wave.tail_speed * TIME, SPEED * TIME, 401)
    x = (edges[:-1, None] + edges[1:, None]) / 2 + np.diff(edges)[:, None] / 2 * points
    volume = np.diff(edges)[:, None] / 2 * weights
    density, velocity = wave.products_density(x, TIME), wave.velocity(x, TIME)
    swept = DENSITY * SPEED * TIME
    assert (density * volume).sum() == pytest.approx(swept, rel=1e-6)
    assert (density * velocity * volume).sum() == pytest.approx(0.0, abs=1e-6 * swept * SPEED)
    energy = wave.pressure(x, TIME) / (gamma - 1.0) + density * velocity**2 / 2
    assert (energy * volume).sum() == pytest.approx(swept * SPEED**2 / (2.0 * (gamma**2 - 1.0)), rel=1e-6)


@gammas
def test_cell_means_are_integrals(gamma):
    """The mean pressure equals a quadrature with 2000 points a cell, also where front or tail lie within a cell.

    The front's jump falls between two of the points: 1 / 2000 of p_CJ.
    """
    wave = wave_of(gamma)
    edges = np.linspace(1.2 * wave.tail_speed * TIME, 1.3 * SPEED * TIME, 38)
    x = edges[:-1, None] + np.diff(edges)[:, None] * (np.arange(2000) + 0.5) / 2000
    means = wave.pressure(x, TIME).mean(axis=1)
    np.testing.assert_allclose(wave.mean_pressure(edges, TIME), means, atol=wave.cj_pressure / 2000)
    away = means[:-8]  # far behind the front's cell: the midpoint rule is exact to 1e-7
    np.testing.assert_allclose(wave.mean_pressure(edges, TIME)[:-8], away, rtol=1e-6, atol=1e-9 * wave.cj_pressure)


def test_a_known_value():
    """For gamma = 2 the pressure where the charge began is p_CJ / 16 at all times: ((0 + 1) / 2)^4."""
    wave = wave_of(2.0)
    assert wave.tail_speed == pytest.approx(-SPEED)
    for time in (TIME, 2 * TIME):
        assert wave.pressure(np.array([0.0]), time)[0] == pytest.approx(wave.cj_pressure / 16)


def test_the_error_norm():
    """Cell means of nodal values are exact for linear fields; the error is relative to the sum of the exact field."""
    x, y, z = np.meshgrid(np.arange(4.0), np.arange(3.0), np.arange(2.0), indexing="ij")
    means = cell_means((1.0 + 2.0 * x - 3.0 * y + 5.0 * z).astype(np.float32))
    assert means.shape == (3, 2, 1)
    assert means[2, 1, 0] == 1.0 + 2.0 * 2.5 - 3.0 * 1.5 + 5.0 * 0.5
    exact = np.array([1.0, 2.0, 0.0, 1.0])
    assert relative_l1(exact, exact) == 0.0
    assert relative_l1(np.array([1.0, 1.0, 1.0, 1.0]), exact) == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("cell_size", "burn_width", "bound"),
    [(3e-3, 3.0, 0.11), (3e-3, 1.5, 0.08), (1.5e-3, 3.0, 0.07), (1.5e-3, 1.5, 0.055)],
)
def test_the_simulation_comes_close(cell_size, burn_width, bound, device):
    """The relative L1 error of the pressure after a run of 300 mm, and its bound from the issue."""
    scene = load_scene("taylor_wave", cell_size=cell_size)
    config = SolverConfig(burn_width=burn_width)
    result = simulate(scene, config=config, save=Save(frames=2), device=device, threads=1)
    error = pressure_error(result.state, wave_of(2.0), result.summary["end_time_s"])
    assert 0.0 < error < bound
    assert result.summary["energy_error"] < 1e-6
    # The front is where it should be, and not overdriven.
    assert result.summary["front_speed_m_s"] == pytest.approx(SPEED, rel=0.005)
    assert result.summary["peak_pressure_pa"] < 1.01 * wave_of(2.0).cj_pressure
