"""Noh's implosion: published plateaus, the jump conditions, the equations ahead of the shock, and what is conserved.

Reference: W. F. Noh, J. Comput. Phys. 72 (1987) 78.
"""

import numpy as np
import pytest

from warp_mpm.exact.noh import NohImplosion
from warp_mpm.exact.riemann import GasState, RiemannProblem

TIME = 0.6  # [s], as Noh shows it: the shock is at 0.2 m for gamma = 5/3

dimensions = pytest.mark.parametrize("dimensions", [1, 2, 3])
gammas = pytest.mark.parametrize("gamma", [1.4, 5.0 / 3.0, 2.0, 3.0])


def volume(radius, dimensions):
    """Of a slab of 1 m2, of a disc 1 m thick, of a sphere, up to constants that cancel [m3]."""
    return radius**dimensions / dimensions


@pytest.mark.parametrize(("dimensions", "density"), [(1, 4.0), (2, 16.0), (3, 64.0)])
def test_published_plateaus(dimensions, density):
    """For gamma = 5/3: 4, 16, 64 times the density, the shock at a third of the speed, p = rho / 3."""
    noh = NohImplosion(dimensions)
    assert noh.shock_speed == pytest.approx(1.0 / 3.0)
    assert noh.plateau_density == pytest.approx(density)
    assert noh.plateau_pressure == pytest.approx(density / 3.0)
    assert noh.shock_radius(TIME) == pytest.approx(0.2)
    r = np.array([0.1, 0.3])
    np.testing.assert_allclose(noh.density(r, TIME), [density, 3.0 ** (dimensions - 1)])
    np.testing.assert_allclose(noh.pressure(r, TIME), [density / 3.0, 0.0])
    np.testing.assert_allclose(noh.energy(r, TIME), [0.5, 0.0])
    np.testing.assert_allclose(noh.velocity(r, TIME), [0.0, -1.0])


@dimensions
@gammas
def test_jump_conditions(dimensions, gamma):
    """Mass, momentum and energy that flow into the shock flow out of it, at any time."""
    noh = NohImplosion(dimensions, gamma=gamma, initial_density=3.0, speed=50.0)
    for time in (1e-3, 0.7):
        r = noh.shock_radius(time) * np.array([1.0 - 1e-9, 1.0 + 1e-9])
        density, velocity = noh.density(r, time), noh.velocity(r, time)
        pressure, energy = noh.pressure(r, time), noh.energy(r, time)
        relative = velocity - noh.shock_speed
        flow = density * relative
        for flux in (flow, flow * velocity + pressure, flow * (energy + 0.5 * velocity**2) + pressure * velocity):
            assert flux[0] == pytest.approx(flux[1], rel=1e-7)
        np.testing.assert_allclose(pressure, (gamma - 1.0) * density * energy)


@dimensions
def test_continuity_ahead_of_the_shock(dimensions):
    """r^(k-1) d(rho)/dt + d(r^(k-1) rho u)/dr = 0, by central differences; nothing accelerates cold gas."""
    noh = NohImplosion(dimensions, speed=2.0)
    time, step = 0.5, 1e-5
    r = np.linspace(1.01 * noh.shock_radius(time) + step, 3.0, 200)
    rate = (noh.density(r, time + step) - noh.density(r, time - step)) / (2 * step) * r ** (dimensions - 1)

    def flow(place):
        return place ** (dimensions - 1) * noh.density(place, time) * noh.velocity(place, time)

    divergence = (flow(r + step) - flow(r - step)) / (2 * step)
    np.testing.assert_allclose(rate + divergence, 0.0, atol=1e-6 * max(1.0, np.abs(rate).max()))
    assert dimensions == 1 or np.abs(rate).max() > 0.1
    assert np.ptp(noh.velocity(r, time)) == 0.0


@dimensions
@gammas
def test_mass_and_energy_of_a_finite_body_are_conserved(dimensions, gamma):
    """Of a slab, a cylinder or a sphere of 1 m: until the shock reaches its surface nothing else happens there."""
    noh = NohImplosion(dimensions, gamma=gamma, initial_density=2.0, speed=3.0, outer_radius=1.0)
    mass = 2.0 * volume(1.0, dimensions)
    edges = np.linspace(0.0, 1.2, 2001)
    shells = np.diff(volume(edges, dimensions))
    for time in (0.01, 0.5 * noh.last_time, noh.last_time):
        density, pressure = noh.mean_density(edges, time), noh.mean_pressure(edges, time)
        assert (density * shells).sum() == pytest.approx(mass, rel=1e-12)
        heat = (pressure * shells).sum() / (gamma - 1.0)
        resting = noh.plateau_density * volume(noh.shock_radius(time), dimensions)
        assert heat + 0.5 * (mass - resting) * noh.speed**2 == pytest.approx(0.5 * mass * noh.speed**2, rel=1e-12)
    assert noh.shock_radius(noh.last_time) == pytest.approx(noh.edge_radius(noh.last_time))
    assert noh.shock_radius(noh.last_time) == pytest.approx((gamma - 1.0) / (gamma + 1.0))


@dimensions
def test_shell_means_are_integrals(dimensions):
    """Means over shells equal those of 4000 points in each, by volume; a jump between two points costs 1 / 4000."""
    noh = NohImplosion(dimensions, outer_radius=1.0)
    edges = np.linspace(0.0, 0.6, 32)
    r = edges[:-1, None] + np.diff(edges)[:, None] * (np.arange(4000) + 0.5) / 4000
    weights = r ** (dimensions - 1)
    pairs = ((noh.mean_density, noh.density), (noh.mean_velocity, noh.velocity), (noh.mean_pressure, noh.pressure))
    for mean, field in pairs:
        values = field(r, TIME)
        expected = (values * weights).sum(axis=1) / weights.sum(axis=1)
        np.testing.assert_allclose(mean(edges, TIME), expected, atol=5e-4 * np.ptp(values))
    beyond = edges[:-1] > noh.edge_radius(TIME)
    assert beyond.any()
    assert not noh.mean_density(edges, TIME)[beyond].any()
    assert not noh.density(edges[:-1][beyond], TIME).any()


@gammas
def test_the_planar_case_is_a_riemann_problem(gamma):
    """A wall is a mirror: two cold streams collide."""
    noh = NohImplosion(1, gamma=gamma)
    streams = RiemannProblem(GasState(1.0, 1.0, 0.0), GasState(1.0, -1.0, 0.0), gamma=gamma)
    r = np.linspace(0.001, 1.5, 297)
    for name in ("density", "velocity", "pressure"):
        np.testing.assert_allclose(getattr(noh, name)(r, TIME), getattr(streams, name)(r, TIME), atol=1e-12)


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"dimensions": 4}, "dimensions"),
        ({"dimensions": 3, "gamma": 1.0}, "gamma"),
        ({"dimensions": 3, "speed": -1.0}, "speed"),
        ({"dimensions": 3, "initial_density": 0.0}, "initial_density"),
        ({"dimensions": 3, "outer_radius": 0.0}, "outer_radius"),
    ],
)
def test_wrong_parameters_are_refused(arguments, text):
    with pytest.raises(ValueError, match=text):
        NohImplosion(**arguments)
