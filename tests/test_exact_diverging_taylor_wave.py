"""The cylindrical and spherical Taylor wave against the Euler equations, its expansions and what it must conserve."""

import numpy as np
import pytest

from warp_mpm.exact.chapman_jouguet import ideal_gas_energy
from warp_mpm.exact.diverging_taylor_wave import DivergingTaylorWave, similarity_profile

DENSITY, SPEED = 1000.0, 2800.0
TIME = 1e-4  # [s]
FRONT = SPEED * TIME

dimensions = pytest.mark.parametrize("dimensions", [2, 3], ids=["cylinder", "sphere"])
gammas = pytest.mark.parametrize("gamma", [1.3, 2.0, 3.0])


def wave_of(dimensions, gamma=2.0):
    return DivergingTaylorWave(dimensions, gamma, DENSITY, SPEED)


def test_the_published_cores():
    """gamma = 2: 0.2718 p_CJ for the cylinder, 0.2476 p_CJ for the sphere, at rest."""
    for count, expected in ((2, 0.2718), (3, 0.2476)):
        wave = wave_of(count)
        assert wave.core_pressure / wave.cj_pressure == pytest.approx(expected, abs=5e-5)
        inside = np.linspace(0.0, 0.999 * wave.core_speed * TIME, 20)
        np.testing.assert_allclose(wave.pressure(inside, TIME), wave.core_pressure, rtol=1e-12)
        assert not wave.velocity(inside, TIME).any()
        # The edge of the core is a sound wave in matter at rest.
        assert wave.sound_speed(np.array(0.0), TIME) == pytest.approx(wave.core_speed, rel=1e-8)


@dimensions
@gammas
def test_the_wave_solves_the_euler_equations(dimensions, gamma):
    """Mass, momentum and entropy, by central differences in r and t between core and front."""
    wave = wave_of(dimensions, gamma)
    r = np.linspace(1.02 * wave.core_speed, 0.98 * SPEED, 301) * TIME
    dr, dt = 1e-4 * FRONT, 1e-4 * TIME

    def fields(radius, time):
        return wave.products_density(radius, time), wave.velocity(radius, time), wave.pressure(radius, time)

    density, velocity, pressure = fields(r, TIME)
    by_time = [
        (late - early) / (2 * dt) for late, early in zip(fields(r, TIME + dt), fields(r, TIME - dt), strict=True)
    ]
    by_radius = [(out - inn) / (2 * dr) for out, inn in zip(fields(r + dr, TIME), fields(r - dr, TIME), strict=True)]
    spread = by_radius[1] + (dimensions - 1) * velocity / r
    for residual, term in (
        (by_time[0] + velocity * by_radius[0] + density * spread, density * spread),
        (by_time[1] + velocity * by_radius[1] + by_radius[2] / density, by_radius[2] / density),
        (by_time[2] + velocity * by_radius[2] + gamma * pressure * spread, gamma * pressure * spread),
    ):
        np.testing.assert_allclose(residual, 0.0, atol=2e-5 * np.abs(term).max())
    np.testing.assert_allclose(pressure / density**gamma, pressure[-1] / density[-1] ** gamma, rtol=1e-11)
    np.testing.assert_allclose(wave.sound_speed(r, TIME) ** 2, gamma * pressure / density, rtol=1e-11)


@dimensions
@gammas
def test_the_square_root_at_the_front(dimensions, gamma):
    """The state at the front is CJ; behind it u falls as sqrt(2 j u_CJ c_CJ (1 - x) / (gamma + 1)), x = r / (D t)."""
    wave = wave_of(dimensions, gamma)
    state = wave.cj_state
    front = np.array([FRONT])
    assert wave.pressure(front, TIME)[0] == pytest.approx(state.pressure, rel=1e-12)
    assert wave.products_density(front, TIME)[0] == pytest.approx(state.density, rel=1e-12)
    assert wave.velocity(front, TIME)[0] == pytest.approx(state.particle_velocity, rel=1e-12)
    for behind in (1e-6, 1e-8):
        fall = state.particle_velocity - wave.velocity((1.0 - behind) * front, TIME)[0]
        root = np.sqrt(2 * (dimensions - 1) * state.particle_velocity * state.sound_speed * behind / (gamma + 1.0))
        assert fall / root == pytest.approx(1.0, abs=10.0 * np.sqrt(behind))
    for field in (wave.pressure, wave.velocity, wave.products_density, wave.sound_speed):
        assert not field(1.0001 * front, TIME).any()


@gammas
def test_the_weak_discontinuity_at_the_core(gamma):
    """Cylinder: u = 2 / (gamma + 3) (x - c) at first; sphere: x - c = -(gamma + 1) / 2 u ln u + ..., all over D.

    The next terms are in proportion to u and to 1 / ln u.
    """
    profile = similarity_profile(2, gamma)
    x = profile.core_place + np.array([1e-4, 1e-5])
    velocity = profile.velocity_at(x) / (gamma + 1.0)
    sound = profile.sound_speed_at(x) * gamma / (gamma + 1.0)
    np.testing.assert_allclose((x - sound) / velocity, 0.5 * (gamma + 3.0), rtol=1e-2)
    assert abs((x - sound) / velocity - 0.5 * (gamma + 3.0))[1] < abs((x - sound) / velocity - 0.5 * (gamma + 3.0))[0]
    profile = similarity_profile(3, gamma)
    # Between two places the constant beside the logarithm drops out.
    x = profile.core_place + np.array([1e-5, 1e-7])
    velocity = profile.velocity_at(x) / (gamma + 1.0)
    sound = profile.sound_speed_at(x) * gamma / (gamma + 1.0)
    slope = np.diff((x - sound) / velocity)[0] / np.diff(np.log(velocity))[0]
    assert slope == pytest.approx(-0.5 * (gamma + 1.0), rel=1e-3)


@dimensions
@gammas
def test_the_wave_conserves_mass_and_energy(dimensions, gamma):
    """All that the front has swept is there, with its energy.

    The energy by Gauss's rule in sqrt(1 - x), in intervals that become fine at the core's edge.
    """
    wave = wave_of(dimensions, gamma)
    edges = np.linspace(0.0, 1.4 * FRONT, 52)
    volume = np.diff(edges**dimensions)
    density = wave.mean_density(edges, TIME)
    assert (density * volume).sum() == pytest.approx(DENSITY * edges[-1] ** dimensions, rel=1e-8)
    core = wave.core_speed / SPEED
    points, weights = np.polynomial.legendre.leggauss(8)
    q = np.sqrt(1.0 - core) * np.concatenate([1.0 - np.geomspace(1.0, 1e-9, 300), [1.0]])
    half = 0.5 * np.diff(q)[:, None]
    middle = q[:-1, None] + half * (points + 1.0)
    x = 1.0 - middle**2
    held = wave.pressure(x * FRONT, TIME) / (gamma - 1.0)
    held += 0.5 * wave.products_density(x * FRONT, TIME) * wave.velocity(x * FRONT, TIME) ** 2
    energy = (held * dimensions * x ** (dimensions - 1) * 2.0 * middle * half * weights).sum()
    energy += core**dimensions * wave.core_pressure / (gamma - 1.0)
    assert energy == pytest.approx(DENSITY * ideal_gas_energy(gamma, SPEED), rel=1e-8)


@dimensions
def test_shell_means_are_integrals(dimensions):
    """By volume, in shells that hold the core's edge and the front: midpoint rule with 4000 points a shell."""
    wave = wave_of(dimensions)
    edges = np.linspace(0.0, 1.2 * FRONT, 18)
    r = edges[:-1, None] + np.diff(edges)[:, None] * (np.arange(4000) + 0.5) / 4000
    weight = r ** (dimensions - 1) / (r ** (dimensions - 1)).sum(axis=1, keepdims=True)
    density = np.where(r > FRONT, DENSITY, wave.products_density(r, TIME))
    for exact, field, scale in (
        (wave.mean_pressure, wave.pressure(r, TIME), wave.cj_pressure),
        (wave.mean_density, density, wave.cj_state.density),
        (wave.mean_velocity, wave.velocity(r, TIME), wave.cj_state.particle_velocity),
    ):
        difference = np.abs(exact(edges, TIME) - (field * weight).sum(axis=1)) / scale
        assert difference.max() < 1.0 / 4000
        assert (difference > 1e-6).sum() <= 1  # only where the front lies


@dimensions
def test_a_thin_shell_mean_is_the_field(dimensions):
    """The means keep their accuracy where shells are far thinner than the steps of the integration."""
    wave = wave_of(dimensions)
    edges = np.linspace(0.7, 0.7001, 11) * FRONT
    middle = 0.5 * (edges[1:] + edges[:-1])
    np.testing.assert_allclose(wave.mean_pressure(edges, TIME), wave.pressure(middle, TIME), rtol=1e-7)
    np.testing.assert_allclose(wave.mean_velocity(edges, TIME), wave.velocity(middle, TIME), rtol=1e-7)


@dimensions
def test_only_the_ratio_of_radius_and_time_counts(dimensions):
    wave = wave_of(dimensions)
    r = np.linspace(0.0, 1.1 * FRONT, 50)
    np.testing.assert_allclose(wave.pressure(3.0 * r, 3.0 * TIME), wave.pressure(r, TIME), rtol=1e-9)
    with pytest.raises(ValueError, match="dimensions"):
        wave_of(1)
    with pytest.raises(ValueError, match="gamma"):
        wave_of(dimensions, 0.9)
