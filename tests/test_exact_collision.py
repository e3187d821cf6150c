"""The collision of plane fronts: jump conditions, conservation, convergence, and a Lagrangian code of 400 cells."""

import numpy as np
import pytest
from lagrangian_gas import LagrangianGas

from warp_mpm.exact.chapman_jouguet import ideal_gas_energy, ideal_gas_state
from warp_mpm.exact.collision import (
    PlaneCollision,
    chebyshev_derivative,
    chebyshev_points,
    contact_pressure,
    contact_shock_speed,
    reflection,
)
from warp_mpm.exact.taylor_wave import PlanarTaylorWave

DENSITY, SPEED, RUN = 1000.0, 2800.0, 0.3
TIMES = np.array([0.1, 0.2, 0.5, 1.0, 2.0])  # since contact, in run times

gammas = pytest.mark.parametrize("gamma", [1.3, 2.0, 3.0])


def collision_of(gamma=2.0):
    return PlaneCollision(gamma, DENSITY, SPEED, RUN)


@gammas
def test_jump_conditions_at_contact(gamma):
    """Mass, momentum and energy across the reflected shock; ahead of it the CJ state, behind it rest."""
    ahead = ideal_gas_state(gamma, 1.0, 1.0)
    pressure, speed = contact_pressure(gamma) * ahead.pressure, contact_shock_speed(gamma)
    flux = ahead.density * (speed + ahead.particle_velocity)
    density = flux / speed
    assert pressure - ahead.pressure == pytest.approx(flux * ahead.particle_velocity, rel=1e-12)
    gained = (pressure / density - ahead.pressure / ahead.density) / (gamma - 1.0)
    squeezed = 0.5 * (pressure + ahead.pressure) * (1.0 / ahead.density - 1.0 / density)
    assert gained == pytest.approx(squeezed, rel=1e-12)
    assert density > ahead.density


def test_the_published_numbers():
    """gamma = 2: 2.443 p_CJ and 6.38 GPa at contact; 1.845, 1.434, 0.766 at 0.1, 0.2, 0.5 run times."""
    collision = collision_of()
    cj = collision.cj_state.pressure
    assert collision.contact_pressure / cj == pytest.approx(2.443, abs=5e-4)
    assert collision.contact_pressure == pytest.approx(6.38e9, rel=1e-3)
    assert collision.contact_shock_speed == pytest.approx(0.6287 * SPEED, rel=1e-4)
    pressure = collision.plane_pressure(np.array([0.1, 0.2, 0.5]) * collision.run_time) / cj
    np.testing.assert_allclose(pressure, [1.845, 1.434, 0.766], atol=5e-4)
    impulse = collision.impulse(np.array([0.5, 1.0]) * collision.run_time) / (cj * collision.run_time)
    np.testing.assert_allclose(impulse, [0.6904, 0.9512], atol=5e-5)


def content_of_the_fan(gamma, distance, time):
    """Mass, momentum and energy per area left of a place at a time since contact, by Gauss's rule."""
    wave = PlanarTaylorWave(gamma, DENSITY, SPEED)
    since_start = RUN / SPEED + time
    points, weights = np.polynomial.legendre.leggauss(8)
    edges = np.linspace(wave.tail_speed * since_start, RUN - distance, 401)
    half = 0.5 * np.diff(edges)[:, None]
    x, volume = edges[:-1, None] + half * (points + 1.0), half * weights
    density, velocity = wave.products_density(x, since_start), wave.velocity(x, since_start)
    energy = wave.pressure(x, since_start) / (gamma - 1.0) + 0.5 * density * velocity**2
    return np.array([(held * volume).sum() for held in (density, density * velocity, energy)])


@gammas
def test_conservation(gamma):
    """Fan and layer together hold the charge's mass and energy, and the momentum that the wall has given: -impulse.

    None of the three sums is used in the solution.
    """
    collision = collision_of(gamma)
    nodes = chebyshev_points(12)
    points, weights = np.polynomial.legendre.leggauss(20)
    for time in TIMES * collision.run_time:
        layer = collision.layer(time)
        distance = collision.shock_distance(np.array(time))
        assert layer.distance[-1] == pytest.approx(float(distance), rel=1e-6)
        m = 0.5 * (points + 1.0)  # share of the layer's mass, in which all is a polynomial
        velocity, pressure, volume = (
            np.polynomial.Polynomial.fit(nodes, field, 12)(m)
            for field in (layer.velocity, layer.pressure, 1.0 / layer.density)
        )
        mass = 0.5 * weights * layer.mass[-1]
        energy = pressure * volume / (gamma - 1.0) + 0.5 * velocity**2
        held = np.array([mass.sum(), -(mass * velocity).sum(), (mass * energy).sum()])
        total = held + content_of_the_fan(gamma, float(distance), time)
        charge = DENSITY * RUN
        assert total[0] == pytest.approx(charge, rel=1e-6)
        assert total[1] == pytest.approx(-float(collision.impulse(np.array(time))), rel=1e-6)
        assert total[2] == pytest.approx(charge * ideal_gas_energy(gamma, SPEED), rel=1e-6)


@gammas
def test_jump_conditions_later_on(gamma):
    """The layer's outer end follows from the fan ahead by the jump conditions; its shock runs as they say."""
    collision = collision_of(gamma)
    wave = PlanarTaylorWave(gamma, DENSITY, SPEED)
    for time in TIMES * collision.run_time:
        layer = collision.layer(time)
        step = 1e-4 * time
        distance, before, after = collision.shock_distance(time + step * np.array([0.0, -1.0, 1.0]))
        speed = (after - before) / (2.0 * step)
        place, since_start = np.array(RUN - distance), time + collision.run_time
        density, pressure = wave.products_density(place, since_start), wave.pressure(place, since_start)
        velocity = -wave.velocity(place, since_start)
        flux = density * (speed - velocity)
        assert layer.density[-1] * (speed - layer.velocity[-1]) == pytest.approx(flux, rel=1e-6)
        assert layer.pressure[-1] - pressure == pytest.approx(flux * (layer.velocity[-1] - velocity), rel=1e-6)
        gained = (layer.pressure[-1] / layer.density[-1] - pressure / density) / (gamma - 1.0)
        squeezed = 0.5 * (layer.pressure[-1] + pressure) * (1.0 / density - 1.0 / layer.density[-1])
        assert gained == pytest.approx(squeezed, rel=1e-6)
        assert layer.velocity[0] == 0.0


def test_particles_keep_the_entropy_that_the_shock_gave_them():
    """p / rho^gamma against mass is one curve at all times, and changes from the wall to the shock."""
    collision = collision_of()
    early, late = (collision.layer(share * collision.run_time) for share in (0.3, 1.5))
    first, second = (np.polynomial.Polynomial.fit(x.mass, x.pressure / x.density**2, 12) for x in (early, late))
    mass = np.linspace(0.0, early.mass[-1], 50)
    np.testing.assert_allclose(second(mass), first(mass), rtol=1e-6)
    assert abs(first(mass[-1]) / first(0.0) - 1.0) > 0.01


def test_convergence():
    """With more Chebyshev points the error at 3 run times falls exponentially; with smaller steps by fourth order."""
    at = np.log(3.0)

    def wall(points, log_step, place=at):
        return 3.0 * float(reflection(2.0, points, log_step).at(np.array(place))[0])

    reference = wall(12, 0.015)
    errors = [abs(wall(points, 0.015) - reference) for points in (4, 6, 8)]
    assert errors[0] > 10.0 * errors[1] > 30.0 * errors[2]
    assert errors[2] < 2e-7
    middle = np.log(0.5)
    reference = wall(8, 0.01, middle)
    coarse, fine = (abs(wall(8, log_step, middle) - reference) for log_step in (0.05, 0.025))
    assert coarse > 12.0 * fine
    assert fine < 2e-6
    assert wall(12, 0.01, middle) == pytest.approx(reference, abs=1e-7)


def test_a_lagrangian_code_agrees():
    """400 cells from the exact wave at contact on: pressure at the wall within 2 %, impulse within 1 %."""
    gamma, count = 2.0, 400
    wave, cj = PlanarTaylorWave(gamma, 1.0, 1.0), ideal_gas_state(gamma, 1.0, 1.0)
    share = np.linspace(0.0, 1.0, count + 1) ** ((gamma - 1.0) / (gamma + 1.0))  # equal masses
    position = wave.tail_speed + (1.0 - wave.tail_speed) * share
    density = (1.0 / count) / np.diff(position)
    pressure = cj.pressure * (density / cj.density) ** gamma
    gas = LagrangianGas(
        gamma=gamma,
        position=position,
        velocity=np.append(wave.velocity(position[:-1], 1.0), 0.0),
        mass=np.full(count, 1.0 / count),
        energy=pressure / (gamma - 1.0) / density,
        burn_fraction=lambda time: np.ones(count),
    )
    collision = PlaneCollision(gamma, 1.0, 1.0, 1.0)
    for time in (0.1, 0.2, 0.5):
        gas.advance(time)
        assert gas.pressure[-1] == pytest.approx(float(collision.plane_pressure(np.array(time))), rel=0.02)
        assert gas.wall_impulse == pytest.approx(float(collision.impulse(np.array(time))), rel=0.01)


def test_times_and_scales():
    """Contact is the limit of early times; impulse is the pressure's integral; results scale; other times raise."""
    collision = collision_of()
    early = np.array([0.0, 1e-8, 1e-6]) * collision.run_time
    np.testing.assert_allclose(collision.plane_pressure(early), collision.contact_pressure, rtol=1e-4)
    np.testing.assert_allclose(collision.impulse(early), early * collision.contact_pressure, rtol=1e-4)
    np.testing.assert_allclose(collision.shock_distance(early), early * collision.contact_shock_speed, rtol=1e-4)
    time = np.linspace(0.0, 1.0, 20_001) * collision.run_time
    pressure = collision.plane_pressure(time)
    assert np.all(np.diff(pressure) < 0.0)
    summed = 0.5 * (pressure[1:] + pressure[:-1]).sum() * time[1]
    assert float(collision.impulse(time[-1:])[0]) == pytest.approx(summed, rel=1e-6)
    other = PlaneCollision(2.0, 2.0 * DENSITY, 3.0 * SPEED, 5.0 * RUN)
    np.testing.assert_allclose(other.plane_pressure(time * 5.0 / 3.0), 18.0 * pressure, rtol=1e-9)
    for wrong in (-1e-9, 3.1 * collision.run_time, np.nan):
        with pytest.raises(ValueError, match="run times"):
            collision.plane_pressure(np.array([wrong]))
    with pytest.raises(ValueError, match="run"):
        PlaneCollision(2.0, DENSITY, SPEED, 0.0)
    with pytest.raises(ValueError, match="gamma"):
        PlaneCollision(1.0, DENSITY, SPEED, RUN)


def test_the_derivative_of_polynomials_is_exact():
    place, matrix = chebyshev_points(9), chebyshev_derivative(9)
    assert (place[0], place[-1]) == (0.0, 1.0)
    for power in range(1, 10):
        np.testing.assert_allclose(matrix @ place**power, power * place ** (power - 1), atol=1e-12)
