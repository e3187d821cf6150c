"""Runge-Kutta integration and Hermite interpolation, against solutions in closed form."""

import numpy as np
import pytest

from warp_mpm.exact.integration import hermite, runge_kutta


def turning(place, state):
    """Of (cos, sin), with a dependence on the place that must be seen at its right value: exp(-place^2)."""
    return np.array([-state[1], state[0], -2.0 * place * state[2]])


def solution(place):
    return np.stack([np.cos(place), np.sin(place), np.exp(-(np.asarray(place) ** 2))], axis=-1)


@pytest.mark.parametrize("end", [2.0, -2.0])
def test_fourth_order_at_the_steps_and_between(end):
    """Halving the step divides the error by 16, in either direction of integration, also between the steps."""
    places = np.linspace(0.0, end, 337)
    errors = []
    for steps in (40, 80):
        path = runge_kutta(turning, 0.0, np.array([1.0, 0.0, 1.0]), end, steps)
        assert path.place[-1] == end
        assert path.state.shape == path.slope.shape == (steps + 1, 3)
        at_steps = np.abs(path.state - solution(path.place)).max()
        errors.append((at_steps, np.abs(path.at(places) - solution(places)).max()))
    (coarse, coarse_between), (fine, fine_between) = errors
    assert 14.0 < coarse / fine < 18.0
    assert 12.0 < coarse_between / fine_between < 20.0
    assert fine_between < 1e-7


def test_slopes_belong_to_the_states():
    path = runge_kutta(turning, 0.0, np.array([1.0, 0.0, 1.0]), 1.0, 10)
    expected = [turning(place, state) for place, state in zip(path.place, path.state, strict=True)]
    np.testing.assert_array_equal(path.slope, expected)


def test_hermite_reproduces_cubics_on_uneven_nodes():
    nodes = np.array([-1.0, -0.5, 0.7, 0.8, 3.0])
    cubic = np.polynomial.Polynomial([1.0, -2.0, 0.5, 0.25])
    places = np.linspace(-1.0, 3.0, 101)
    result = hermite(nodes, cubic(nodes), cubic.deriv()(nodes), places)
    np.testing.assert_allclose(result, cubic(places), rtol=0, atol=1e-13)
    # The end values beyond the nodes, and a single place.
    np.testing.assert_allclose(
        hermite(nodes, cubic(nodes), cubic.deriv()(nodes), np.array([-9.0, 9.0])), cubic([-1, 3])
    )
    assert hermite(nodes, cubic(nodes), cubic.deriv()(nodes), np.array(0.1)) == pytest.approx(cubic(0.1))
