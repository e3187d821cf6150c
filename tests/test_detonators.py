"""Patterns of detonators, and distances and times of lines, spheres' surfaces and cords by brute force."""

import numpy as np
import pytest

from warp_mpm.detonators import (
    CordDetonator,
    LineDetonator,
    PointDetonator,
    SphereDetonator,
    grid,
    ring,
    row,
    segments,
)
from warp_mpm.errors import InputError
from warp_mpm.exact.arrival import straight_arrival

SPEED = 2800.0
CORD = CordDetonator(((0.0, 0.0, 0.0), (0.1, 0.0, 0.0), (0.1, 0.05, 0.02)), speed=6500.0, time=2e-6)


def places():
    return np.random.default_rng(5).uniform(-0.1, 0.2, (50, 3))


def test_a_row():
    lamps = row((0.0, 0.0, 0.0), (0.3, 0.0, 0.6), 4, time=1e-6, delay=2e-6)
    np.testing.assert_allclose([lamp.position for lamp in lamps], [[0.1 * n, 0.0, 0.2 * n] for n in range(4)])
    np.testing.assert_allclose([lamp.time for lamp in lamps], [1e-6, 3e-6, 5e-6, 7e-6])


@pytest.mark.parametrize("axis", [(0.0, 0.0, 2.0), (1.0, 0.0, 0.0), (1.0, -2.0, 0.5)])
def test_a_ring(axis):
    center, radius = np.array([1.0, 2.0, 3.0]), 0.5
    lamps = ring(center, axis, radius, 6, delay=1e-6)
    arms = np.array([lamp.position for lamp in lamps]) - center
    unit = np.array(axis) / np.linalg.norm(axis)
    np.testing.assert_allclose(np.linalg.norm(arms, axis=1), radius)
    np.testing.assert_allclose(arms @ unit, 0.0, atol=1e-15)
    turned = np.cross(arms, np.roll(arms, -1, axis=0)) @ unit / radius**2  # the sine of the angle between neighbors
    np.testing.assert_allclose(turned, np.sin(np.pi / 3.0))
    np.testing.assert_allclose([lamp.time for lamp in lamps], 1e-6 * np.arange(6))
    assert ring((0, 0, 0), (0, 0, 1), 0.1, 4)[0].position == pytest.approx((0.1, 0.0, 0.0))


def test_a_grid():
    lamps = grid((1.0, 0.0, 0.0), (0.2, 0.0, 0.0), (0.0, 0.0, 0.9), (3, 4), delays=(1e-6, 1e-5))
    assert len(lamps) == 12
    by_place = {tuple(np.round(lamp.position, 12)): lamp.time for lamp in lamps}
    assert by_place[1.0, 0.0, 0.0] == 0.0
    assert by_place[1.2, 0.0, 0.9] == pytest.approx(2e-6 + 3e-5)
    assert by_place[1.1, 0.0, 0.3] == pytest.approx(1e-6 + 1e-5)
    assert [lamp.position for lamp in grid((0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1))] == [(0.0, 0.0, 0.0)]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: row((0, 0, 0), (1, 0, 0), 1), "row: count: expected at least 2, got 1"),
        (lambda: row((0, 0), (1, 0, 0), 2), "row: start: expected three finite numbers"),
        (lambda: ring((0, 0, 0), (0, 0, 0), 1.0, 3), "ring: axis: expected a vector of any length but 0"),
        (lambda: ring((0, 0, 0), (0, 0, 1), -1.0, 3), "ring: radius: expected a positive number"),
        (lambda: ring((0, 0, 0), (0, 0, 1), 1.0, 0), "ring: count: expected a whole number of at least 1"),
        (lambda: grid((0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 0)), "grid: counts: expected a whole number of at least 1"),
    ],
)
def test_mistakes_in_patterns(make, message):
    with pytest.raises(InputError) as caught:
        make()
    assert message in str(caught.value)


@pytest.mark.parametrize("cord", [CORD, CordDetonator(CORD.points, 2000.0), LineDetonator(*CORD.points[1:], time=1e-6)])
def test_a_cord_is_many_points_lit_one_after_the_other(cord):
    """By Huygens's principle: the first of the waves of all its points."""
    parts = [
        PointDetonator(tuple(start + share * (end - start)), time=lit + share * (burnt - lit))
        for start, end, lit, burnt in segments(cord)
        for share in np.linspace(0.0, 1.0, 2001)
    ]
    np.testing.assert_allclose(
        straight_arrival([cord], places(), SPEED), straight_arrival(parts, places(), SPEED), rtol=1e-6
    )


def test_a_fast_cord_makes_a_mach_cone():
    """Far from its ends the wave leaves a cord of the speed D_c at the angle with the cosine D / D_c."""
    cord = CordDetonator(((-1.0, 0.0, 0.0), (1.0, 0.0, 0.0)), speed=2.0 * SPEED)
    away = np.array([[0.0, r, 0.0] for r in (0.01, 0.02, 0.05)])
    cone = 1.0 / cord.speed + away[:, 1] * np.sqrt(1.0 / SPEED**2 - 1.0 / cord.speed**2)
    np.testing.assert_allclose(straight_arrival([cord], away, SPEED), cone, rtol=1e-12)


def test_a_sphere_runs_both_ways():
    lamp = SphereDetonator((0.0, 0.0, 0.0), 0.1, time=1e-6)
    points = np.array([[0.0, 0.0, 0.0], [0.05, 0.0, 0.0], [0.0, 0.3, 0.0]])
    np.testing.assert_allclose(straight_arrival([lamp], points, SPEED), 1e-6 + np.array([0.1, 0.05, 0.2]) / SPEED)
