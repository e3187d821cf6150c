"""Sedov's blast wave: published constants, the Euler equations, the jump conditions, and what is conserved.

References: J. R. Kamm, F. X. Timmes, LA-UR-07-2849 (2007); J. P. Ostriker, C. F. McKee, Rev. Mod. Phys. 60 (1988) 1;
L. D. Landau, E. M. Lifshitz, Fluid Mechanics, section 106.
"""

import math

import numpy as np
import pytest

from warp_mpm.exact.sedov import SedovBlast, similarity_profile

TIME = 1e-3  # [s]
GAMMAS = [1.1, 1.4, 5.0 / 3.0, 2.0, 3.0, 6.0]

gammas = pytest.mark.parametrize("gamma", GAMMAS)


def blast_of(gamma):
    """A blast of 1 MJ in air-like gas."""
    return SedovBlast(gamma, blast_energy=1e6, initial_density=1.2)


def test_published_constants():
    """Kamm and Timmes: with gamma = 1.4, E = 0.851072 puts the shock at 1 at t = 1. Ostriker and McKee: 5/3, 2.026."""
    assert SedovBlast(1.4).alpha == pytest.approx(0.851072, abs=5e-7)
    assert SedovBlast(1.4).xi0 == pytest.approx(1.033, abs=5e-4)
    assert SedovBlast(1.4, blast_energy=0.851072).shock_radius(1.0) == pytest.approx(1.0, abs=2e-7)
    assert 1.0 / SedovBlast(5.0 / 3.0).alpha == pytest.approx(2.026, abs=5e-4)
    assert SedovBlast(5.0 / 3.0).xi0 == pytest.approx(1.1517, abs=5e-5)


def test_the_state_behind_the_shock_of_kamm_and_timmes():
    """There R' = 0.4, so that u = 1/3, rho = 6, p = 2/15; ahead there is gas at rest without pressure."""
    blast = SedovBlast(1.4, blast_energy=0.851072)
    r = np.array([1.0 - 1e-9, 1.0 + 1e-6])
    np.testing.assert_allclose(blast.density(r, 1.0), [6.0, 1.0], rtol=1e-6)
    np.testing.assert_allclose(blast.velocity(r, 1.0), [1.0 / 3.0, 0.0], rtol=1e-6)
    np.testing.assert_allclose(blast.pressure(r, 1.0), [2.0 / 15.0, 0.0], rtol=1e-6)


@pytest.mark.parametrize(("gamma", "share"), [(1.4, 0.3655), (5.0 / 3.0, 0.3062)])
def test_the_pressure_at_the_center(gamma, share):
    """It is uniform there, and a known share of that behind the shock."""
    pressure = similarity_profile(np.array([0.0, 0.01, 0.1, 0.2]), gamma).pressure
    np.testing.assert_allclose(pressure, share, atol=1e-4)


@gammas
def test_the_profile_solves_the_euler_equations(gamma):
    """Mass, momentum and entropy, by central differences in time and radius, from 0.3 R to the shock."""
    blast = blast_of(gamma)
    radius = blast.shock_radius(TIME)
    r = np.linspace(0.3 * radius, 0.995 * radius, 400)
    dr, dt = 2e-5 * radius, 2e-5 * TIME
    fields = (blast.density, blast.velocity, blast.pressure)
    density, velocity, pressure = (field(r, TIME) for field in fields)
    rates = [(field(r, TIME + dt) - field(r, TIME - dt)) / (2 * dt) for field in fields]
    slopes = [(field(r + dr, TIME) - field(r - dr, TIME)) / (2 * dr) for field in fields]

    flow = ((r + dr) ** 2 * blast.density(r + dr, TIME) * blast.velocity(r + dr, TIME)) - (
        (r - dr) ** 2 * blast.density(r - dr, TIME) * blast.velocity(r - dr, TIME)
    )
    mass = rates[0] + flow / (2 * dr * r**2)
    momentum = density * (rates[1] + velocity * slopes[1]) + slopes[2]
    entropy = (rates[2] + velocity * slopes[2]) / pressure - gamma * (rates[0] + velocity * slopes[0]) / density
    np.testing.assert_allclose(mass, 0.0, atol=2e-5 * np.abs(rates[0]).max())
    np.testing.assert_allclose(momentum, 0.0, atol=2e-5 * np.abs(slopes[2]).max())
    np.testing.assert_allclose(entropy, 0.0, atol=2e-5 * np.abs(rates[2] / pressure).max())


@gammas
def test_jump_conditions(gamma):
    """Mass, momentum and energy that flow into the shock flow out of it; it moves at the rate of its radius."""
    blast = blast_of(gamma)
    speed = (blast.shock_radius(1.0001 * TIME) - blast.shock_radius(0.9999 * TIME)) / (0.0002 * TIME)
    assert speed == pytest.approx(blast.shock_speed(TIME), rel=1e-7)
    speed = blast.shock_speed(TIME)
    r = blast.shock_radius(TIME) * np.array([1.0 - 1e-12, 1.0 + 1e-12])
    density, velocity, pressure = blast.density(r, TIME), blast.velocity(r, TIME), blast.pressure(r, TIME)
    flow = density * (velocity - speed)
    energy = pressure / (gamma - 1.0) / density + 0.5 * velocity**2
    for flux in (flow, flow * velocity + pressure, flow * energy + pressure * velocity):
        assert flux[0] == pytest.approx(flux[1], rel=1e-6, abs=1e-9 * blast.initial_density * speed**3)
    assert blast.shock_pressure(TIME) == pytest.approx(pressure[0])
    assert blast.shock_velocity(TIME) == pytest.approx(velocity[0])


@gammas
def test_mass_and_energy_are_those_swept_and_released(gamma):
    """At two times, by midpoints in 20,000 shells: the profile is smooth, and empty in the middle."""
    blast = blast_of(gamma)
    for time in (TIME, 5 * TIME):
        radius = blast.shock_radius(time)
        r = (np.arange(20_000) + 0.5) / 20_000 * radius
        shells = 4.0 * math.pi * r**2 * radius / 20_000
        density, velocity, pressure = blast.density(r, time), blast.velocity(r, time), blast.pressure(r, time)
        swept = 4.0 / 3.0 * math.pi * radius**3 * blast.initial_density
        assert (density * shells).sum() == pytest.approx(swept, rel=1e-6)
        energy = 0.5 * density * velocity**2 + pressure / (gamma - 1.0)
        assert (energy * shells).sum() == pytest.approx(blast.blast_energy, rel=1e-6)


@gammas
def test_the_mass_within_a_radius(gamma):
    """The closed form equals the sum of the density up to there, also beyond the shock."""
    blast = blast_of(gamma)
    radius = blast.shock_radius(TIME)
    edges = np.linspace(0.0, 1.5 * radius, 30_001)
    middle = 0.5 * (edges[1:] + edges[:-1])
    summed = np.cumsum(4.0 * math.pi * middle**2 * np.diff(edges) * blast.density(middle, TIME))
    at = slice(9_999, None, 2_500)
    np.testing.assert_allclose(blast.enclosed_mass(edges[1:], TIME)[at], summed[at], rtol=1e-4)


def test_gamma_two_is_no_exception():
    """The limit there continues the formula on both sides: all differ by the first order in gamma - 2 alone."""
    x = np.linspace(0.05, 1.0, 50)
    below, at, above = (similarity_profile(x, gamma) for gamma in (2.0 - 1e-4, 2.0, 2.0 + 1e-4))
    for name in ("density", "velocity", "pressure"):
        low, middle, high = (np.log(getattr(profile, name)) for profile in (below, at, above))
        np.testing.assert_allclose(middle, 0.5 * (low + high), atol=1e-6)
        assert np.abs(high - low).max() > 1e-5


@pytest.mark.parametrize("gamma", [1.4, 2.0])
def test_shell_means_are_integrals(gamma):
    """Means over shells equal those of 4000 points in each, by volume, also in the shell that the shock crosses."""
    blast = blast_of(gamma)
    edges = np.linspace(0.0, 1.3 * blast.shock_radius(TIME), 32)
    r = edges[:-1, None] + np.diff(edges)[:, None] * (np.arange(4000) + 0.5) / 4000
    pairs = (
        (blast.mean_density, blast.density),
        (blast.mean_velocity, blast.velocity),
        (blast.mean_pressure, blast.pressure),
    )
    for mean, field in pairs:
        values = field(r, TIME)
        expected = (values * r**2).sum(axis=1) / (r**2).sum(axis=1)
        np.testing.assert_allclose(mean(edges, TIME), expected, atol=3e-4 * np.ptp(values))
        np.testing.assert_allclose(mean(edges, TIME)[:20], expected[:20], rtol=2e-5, atol=1e-9 * np.ptp(values))


def test_the_center_is_finite():
    """At r = 0 there is pressure, but neither velocity nor density, and no warning."""
    blast = blast_of(1.4)
    center = np.array([0.0])
    assert blast.pressure(center, TIME)[0] == pytest.approx(0.36546 * blast.shock_pressure(TIME), rel=1e-4)
    assert blast.velocity(center, TIME)[0] == 0.0
    assert 0.0 <= blast.density(center, TIME)[0] < 1e-12
    assert blast.enclosed_mass(center, TIME)[0] == 0.0


@pytest.mark.parametrize(
    ("arguments", "text"),
    [({"gamma": 1.0}, "gamma"), ({"gamma": 7.0}, "gamma"), ({"blast_energy": 0.0}, "blast_energy")],
)
def test_wrong_parameters_are_refused(arguments, text):
    with pytest.raises(ValueError, match=text):
        SedovBlast(**arguments)
