"""The exact Riemann problem: published star states, and the Euler equations themselves.

References: E. F. Toro, Riemann Solvers and Numerical Methods for Fluid Dynamics, 3rd ed., tables 4.1 to 4.3;
G. A. Sod, J. Comput. Phys. 27 (1978) 1.
"""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from warp_mpm.exact import riemann
from warp_mpm.exact.riemann import TORO_TESTS, TORO_TIMES, GasState, RiemannProblem

# Table 4.3: p*, u*, density left and right of the contact; printed with five or six digits.
PUBLISHED = (
    (0.30313, 0.92745, 0.42632, 0.26557),
    (0.00189, 0.00000, 0.02185, 0.02185),
    (460.894, 19.5975, 0.57506, 5.99924),
    (46.0950, -6.19633, 5.99242, 0.57511),
    (1691.64, 8.68975, 14.2823, 31.0426),
)
LIGHT_GAS = GasState(0.02, 3.0, 0.5)
DENSE_GAS = GasState(5.0, -1.0, 0.1)
VACUUM = GasState(0.0, 0.0, 0.0)

# Every kind of wave pattern, vacua included, and several gammas.
PROBLEMS = {
    **{f"toro-{number}": problem for number, problem in enumerate(TORO_TESTS, start=1)},
    "gamma-2": RiemannProblem(LIGHT_GAS, DENSE_GAS, gamma=2.0, origin=0.5),
    "gamma-3": RiemannProblem(DENSE_GAS, LIGHT_GAS, gamma=3.0, origin=0.5),
    "opening-vacuum": RiemannProblem(GasState(1.0, -4.0, 0.4), GasState(2.0, 4.0, 0.2), origin=0.5),
    "vacuum-left": RiemannProblem(VACUUM, DENSE_GAS, gamma=2.0, origin=0.5),
    "vacuum-right": RiemannProblem(DENSE_GAS, VACUUM, gamma=5.0 / 3.0, origin=0.5),
    "cold-streams": RiemannProblem(GasState(1.0, 1.0, 0.0), GasState(2.0, -1.0, 0.0), gamma=5.0 / 3.0, origin=0.5),
}
problems = pytest.mark.parametrize("problem", PROBLEMS.values(), ids=PROBLEMS.keys())


def speeds(problem):
    """Edges of the regions of the flow, from left to right [m/s]: heads and tails, shocks, contact."""
    edges = itertools.chain.from_iterable((region.lower, region.upper) for region in problem.regions)
    return sorted({edge for edge in edges if np.isfinite(edge)})


def reach_and_time(problem):
    """A time, and half the width of a window around the origin that the waves do not leave until then."""
    time = 0.7
    return 1.3 * time * max(1.0, *np.abs(speeds(problem))), time


@pytest.mark.parametrize(("problem", "published"), list(zip(TORO_TESTS, PUBLISHED, strict=True)))
def test_star_states_are_those_of_toro(problem, published):
    """The differences are of the last digit printed; the fifth pressure is 1691.647, printed as 1691.64."""
    star = problem.star
    values = (star.pressure, star.velocity, star.left_density, star.right_density)
    np.testing.assert_allclose(values, published, rtol=1e-5, atol=5e-6)


def test_sods_shock_tube():
    """At t = 0.2: rarefaction from 0.2634 to 0.4859, contact at 0.6855, shock at 0.8504."""
    edges = 0.5 + 0.2 * np.array(speeds(riemann.SOD))
    np.testing.assert_allclose(edges, [0.26335, 0.48594, 0.68549, 0.85043], atol=1e-5)
    x = np.array([0.1, 0.6, 0.8, 0.9])  # left, on either side of the contact, right
    np.testing.assert_allclose(riemann.SOD.density(x, 0.2), [1.0, 0.42632, 0.26557, 0.125], atol=1e-5)
    np.testing.assert_allclose(riemann.SOD.energy(x, 0.2), [2.5, 1.77760, 2.85354, 2.0], atol=1e-5)
    assert TORO_TIMES[0] == 0.25


@problems
def test_mass_momentum_and_energy_are_conserved(problem):
    """In a window that no wave leaves, they change by what flows through its ends, and by nothing else.

    400,000 midpoints: each of at most four jumps is misplaced by half an interval, 2e-6 of the window.
    """
    half, time = reach_and_time(problem)
    count = 400_000
    x = problem.origin + half * ((np.arange(count) + 0.5) * 2.0 / count - 1.0)
    density, velocity = problem.density(x, time), problem.velocity(x, time)
    total = problem.pressure(x, time) / (problem.gamma - 1.0) + 0.5 * density * velocity**2
    held = np.array([field.mean() * 2.0 * half for field in (density, density * velocity, total)])

    expected, scale = np.zeros(3), np.zeros(3)
    for state, sign in ((problem.left, 1.0), (problem.right, -1.0)):
        mass, speed, push = state.density, state.velocity, state.pressure
        energy = push / (problem.gamma - 1.0) + 0.5 * mass * speed**2
        flux = np.array([mass * speed, mass * speed**2 + push, speed * (energy + push)])
        expected += half * np.array([mass, mass * speed, energy]) + sign * time * flux
        scale += half * np.array([mass, mass * max(1.0, abs(speed)), energy]) + time * np.abs(flux)
    np.testing.assert_allclose(held / scale, expected / scale, rtol=0, atol=2e-5)


@problems
def test_fans_solve_the_euler_equations(problem):
    """In a fan d(rho)/dt + d(rho u)/dx = 0 and d(rho u)/dt + d(rho u^2 + p)/dx = 0, by central differences.

    The outer tenths are left out: powers of the distance to a vacuum's edge are differentiated.
    """
    time = 0.7

    def conserved(place, instant):
        density, velocity = problem.density(place, instant), problem.velocity(place, instant)
        return density, density * velocity, density * velocity**2 + problem.pressure(place, instant)

    for low, high in ((part.lower, part.upper) for part in problem.regions if part.sound_slope != 0.0):
        x = problem.origin + time * np.linspace(0.9 * low + 0.1 * high, 0.1 * low + 0.9 * high, 101)
        dx = 1e-4 * (high - low) * time
        dt = dx / max(1.0, abs(low), abs(high))
        left, right = conserved(x - dx, time), conserved(x + dx, time)
        before, after = conserved(x, time - dt), conserved(x, time + dt)
        for held, flux in ((0, 1), (1, 2)):
            rate, divergence = (after[held] - before[held]) / (2 * dt), (right[flux] - left[flux]) / (2 * dx)
            assert np.abs(rate).max() > 0.0
            np.testing.assert_allclose(rate + divergence, 0.0, atol=1e-5 * np.abs(divergence).max())


@problems
def test_jumps_satisfy_the_jump_conditions(problem):
    """Across every edge of a region, what flows into it per second flows out; entropy and pressure tell which it is."""
    time = 0.7
    heaviest = max(region.state.density for region in problem.regions)
    highest = max(region.state.pressure for region in problem.regions)
    shocks = 0
    for speed in speeds(problem):
        gap = 1e-10 * max(1.0, abs(speed))
        x = problem.origin + time * np.array([speed - gap, speed + gap])
        density, velocity, pressure = (
            field(x, time) for field in (problem.density, problem.velocity, problem.pressure)
        )
        flow = density * (velocity - speed)  # through the edge
        enthalpy = problem.gamma / (problem.gamma - 1.0) * pressure + 0.5 * density * (velocity - speed) ** 2
        fluxes = np.array([flow, flow * velocity + pressure, enthalpy * (velocity - speed)])
        scale = np.abs(fluxes).max(axis=1) + 1e-6 * max(heaviest, highest)  # the latter where both sides are empty
        np.testing.assert_allclose(np.diff(fluxes)[:, 0] / scale, 0.0, atol=1e-4)
        if abs(pressure[1] - pressure[0]) > 1e-3 * highest:
            shocks += 1
            entropy = pressure / density**problem.gamma  # grows through a shock
            behind = int(flow[0] > 0.0)
            assert entropy[behind] > entropy[1 - behind]
    states = () if problem.has_vacuum else (problem.left, problem.right)
    assert shocks == sum(problem.star.pressure > state.pressure for state in states)


@problems
def test_entropy_is_uniform_in_a_fan(problem):
    """Where the speed of sound varies, p / rho^gamma and the Riemann invariant do not."""
    time = 0.7
    for region in problem.regions:
        if region.sound_slope == 0.0:
            continue
        x = problem.origin + time * np.linspace(0.99 * region.lower + 0.01 * region.upper, region.upper, 200)[:-4]
        density, pressure = problem.density(x, time), problem.pressure(x, time)
        entropy = pressure / density**problem.gamma
        np.testing.assert_allclose(entropy, entropy[0], rtol=1e-9)
        sign = np.sign(region.sound_slope)
        sound = np.sqrt(problem.gamma * pressure / density)
        np.testing.assert_allclose(problem.velocity(x, time) + sign * sound, (x - problem.origin) / time, atol=1e-7)
        invariant = problem.velocity(x, time) - sign * 2.0 / (problem.gamma - 1.0) * sound
        np.testing.assert_allclose(invariant, invariant[0], atol=1e-7)
        np.testing.assert_allclose(problem.energy(x, time) * (problem.gamma - 1.0) * density, pressure, rtol=1e-9)


@problems
def test_cell_means_are_integrals(problem):
    """Means over cells equal those of 4000 points in each; a jump between two points costs 1 / 4000 of it."""
    half, time = reach_and_time(problem)
    edges = np.linspace(problem.origin - half, problem.origin + half, 38)
    jumps = np.histogram(problem.origin + time * np.array(speeds(problem)), edges)[0]
    smooth = jumps == 0
    x = edges[:-1, None] + np.diff(edges)[:, None] * (np.arange(4000) + 0.5) / 4000
    pairs = (
        (problem.mean_density, problem.density),
        (problem.mean_velocity, problem.velocity),
        (problem.mean_pressure, problem.pressure),
    )
    for mean, field in pairs:
        values = field(x, time)
        jump = values.max() - values.min()
        np.testing.assert_allclose(mean(edges, time), values.mean(axis=1), atol=2e-4 * jump + 1e-12)
        np.testing.assert_allclose(mean(edges, time)[smooth], values.mean(axis=1)[smooth], atol=1e-5 * jump + 1e-12)


@problems
def test_a_mirror_image_and_a_moving_observer_see_the_same(problem):
    """Sides swapped and velocities turned round: the same flow turned round. Both states faster: the flow moves on."""
    half, time = reach_and_time(problem)
    x = np.linspace(-half, half, 777)
    turned = [replace(state, velocity=-state.velocity) for state in (problem.right, problem.left)]
    mirror = replace(problem, left=turned[0], right=turned[1])
    wind = 3.0
    states = [
        state if state.is_vacuum else replace(state, velocity=state.velocity + wind)
        for state in (problem.left, problem.right)
    ]
    moving = replace(problem, left=states[0], right=states[1])
    for name in ("density", "pressure", "energy"):
        expected = getattr(problem, name)(problem.origin + x, time)
        scale = expected.max()
        np.testing.assert_allclose(getattr(mirror, name)(problem.origin - x, time), expected, atol=1e-9 * scale)
        np.testing.assert_allclose(
            getattr(moving, name)(problem.origin + x + wind * time, time), expected, atol=1e-9 * scale
        )
    assert mirror.velocity(problem.origin - x, time) == pytest.approx(-problem.velocity(problem.origin + x, time))


def test_two_equal_states_stay_as_they_are():
    state = GasState(1.2, 7.0, 1e5)
    problem = RiemannProblem(state, state, gamma=1.4)
    assert problem.star.pressure == pytest.approx(state.pressure, rel=1e-12)
    assert problem.star.velocity == pytest.approx(state.velocity, rel=1e-9)
    x = np.linspace(-100.0, 100.0, 11)
    np.testing.assert_allclose(problem.pressure(x, 0.1), state.pressure, rtol=1e-9)


def test_a_vacuum_is_found_where_the_gases_part_too_fast():
    """For equal states it opens at u_R - u_L = 4 c / (gamma - 1): there is a star state just below, and none above."""
    sound, gamma = np.sqrt(1.4 * 0.4), 1.4
    limit = 2.0 * sound / (gamma - 1.0)
    for factor, vacuum in ((0.99, False), (1.01, True)):
        problem = RiemannProblem(GasState(1.0, -factor * limit, 0.4), GasState(1.0, factor * limit, 0.4))
        assert problem.has_vacuum is vacuum
        assert (problem.density(np.array([0.0]), 1.0)[0] == 0.0) == vacuum
        if vacuum:
            with pytest.raises(ValueError, match="got a vacuum"):
                assert problem.star
    assert not any(problem.has_vacuum for problem in TORO_TESTS)


def test_gas_escapes_into_a_vacuum():
    """Gas at rest beside a vacuum: its edge runs at 2 c / (gamma - 1), and where the wall was, c = 2 / (gamma + 1) c0.

    The edge is that of the planar Taylor wave's tail too.
    """
    gamma, gas = 1.4, GasState(1.0, 0.0, 1.0)
    problem = RiemannProblem(gas, VACUUM, gamma=gamma)
    escape = 2.0 * gas.sound_speed(gamma) / (gamma - 1.0)
    x = np.array([0.0, 0.999 * escape, (1.0 + 1e-9) * escape])
    assert problem.density(x, 1.0)[0] == pytest.approx((2.0 / (gamma + 1.0)) ** (2.0 / (gamma - 1.0)))
    assert problem.density(x, 1.0)[1] > 0.0
    assert problem.velocity(x, 1.0)[1] == pytest.approx(escape, rel=2e-3)
    assert problem.density(x, 1.0)[2] == problem.velocity(x, 1.0)[2] == 0.0


def test_the_strength_of_a_wave_and_its_slope():
    """The slope is that of the strength, and both go on smoothly from rarefactions to shocks: no change at p_K."""
    state, gamma = GasState(1.2, 5.0, 3.0), 1.4
    assert riemann.wave_strength(state, gamma, state.pressure) == pytest.approx((0.0, 1.0 / (1.2 * 1.8708287)))
    for pressure in (0.01, 1.0, 3.0, 4.0, 100.0):
        gap = 1e-5 * pressure
        low, high = (riemann.wave_strength(state, gamma, pressure + step)[0] for step in (-gap, gap))
        assert riemann.wave_strength(state, gamma, pressure)[1] == pytest.approx((high - low) / (2.0 * gap), rel=1e-5)


@pytest.mark.parametrize("gamma", [1.05, 1.4, 3.0, 20.0])
@pytest.mark.parametrize(
    ("left", "right"),
    [
        (GasState(1.0, 0.0, 1e10), GasState(1e-5, 0.0, 1e-10)),
        (GasState(1.0, 1e4, 1.0), GasState(10.0, -1e4, 1e-3)),
        (GasState(1e3, 0.0, 0.0), GasState(1e-3, -1.0, 1e-9)),
        (GasState(1.0, 1.0, 0.0), GasState(1.0, -1.0, 0.0)),
    ],
)
def test_hard_states_converge(gamma, left, right):
    """Twenty decades of pressure, streams at ten thousand times the speed of sound: the velocities meet."""
    problem = RiemannProblem(left, right, gamma=gamma)
    left_change, right_change = (riemann.wave_strength(s, gamma, problem.star.pressure)[0] for s in (left, right))
    speed = max(abs(left_change), abs(right_change))
    assert left.velocity - left_change == pytest.approx(right.velocity + right_change, abs=1e-9 * speed)


@pytest.mark.parametrize(
    ("left", "right", "gamma", "text"),
    [
        (GasState(1.0, 0.0, 1.0), GasState(1.0, 0.0, 1.0), 1.0, "gamma"),
        (GasState(-1.0, 0.0, 1.0), GasState(1.0, 0.0, 1.0), 1.4, "expected a gas"),
        (GasState(1.0, 0.0, 1.0), GasState(1.0, 0.0, -1.0), 1.4, "expected a gas"),
        (GasState(0.0, 0.0, 1.0), GasState(1.0, 0.0, 1.0), 1.4, "expected a gas"),
        (VACUUM, VACUUM, 1.4, "two vacua"),
    ],
)
def test_what_is_not_a_gas_is_refused(left, right, gamma, text):
    with pytest.raises(ValueError, match=text):
        RiemannProblem(left, right, gamma=gamma)
