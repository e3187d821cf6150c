"""Straight-line arrival times from several detonators with delays, against the eikonal equation and known meetings."""

import itertools

import numpy as np
import pytest

from warp_mpm.detonators import PlaneDetonator, PointDetonator
from warp_mpm.exact.arrival import detonator_distance, straight_arrival

SPEED = 2800.0


def test_the_first_wave_counts_and_not_the_nearest_detonator():
    """Two points 400 mm apart, the second 50 us late: the waves meet where both took equally long."""
    first, second = PointDetonator((0.0, 0.0, 0.0)), PointDetonator((0.0, 0.4, 0.0), time=50e-6)
    meeting = 0.5 * (0.4 + SPEED * 50e-6)  # 0.27 m: beyond the middle
    along = np.array([0.0, 0.1, 0.25, meeting, 0.35, 0.4])
    points = np.stack([np.zeros(6), along, np.zeros(6)], axis=1)
    expected = np.where(along <= meeting, along / SPEED, 50e-6 + (0.4 - along) / SPEED)
    np.testing.assert_allclose(straight_arrival([first, second], points, SPEED), expected, rtol=1e-12, atol=1e-18)
    # At 0.25 m the second detonator is nearer; the first one's wave has come already.
    assert np.argmin([detonator_distance(first, points[2:3]), detonator_distance(second, points[2:3])]) == 1
    assert straight_arrival([first, second], points[2:3], SPEED)[0] == 0.25 / SPEED


def test_a_detonator_that_is_overrun_changes_nothing():
    points = np.random.default_rng(1).uniform(-0.2, 0.2, (200, 3))
    points[0] = 0.1, 0.0, 0.0
    first = PointDetonator((0.0, 0.0, 0.0))
    late = PointDetonator((0.1, 0.0, 0.0), time=0.1001 / SPEED)
    alone = straight_arrival([first], points, SPEED)
    np.testing.assert_array_equal(straight_arrival([first, late], points, SPEED), alone)
    early = PointDetonator((0.1, 0.0, 0.0), time=0.0999 / SPEED)
    assert straight_arrival([first, early], points, SPEED)[0] == pytest.approx(0.0999 / SPEED)
    assert alone[0] == pytest.approx(0.1 / SPEED)


def test_the_six_points_of_the_paper():
    """At y = 0, 80, ..., 400 mm, 0.5 us apart: neighbours' waves meet half-way plus D x 0.5 us / 2."""
    detonators = [PointDetonator((0.1, 0.08 * n, 0.01), time=0.5e-6 * n) for n in range(6)]
    meetings = np.array([[0.1, 0.08 * n + 0.04 + 0.5 * SPEED * 0.5e-6, 0.01] for n in range(5)])
    arrival = straight_arrival(detonators, meetings, SPEED)
    np.testing.assert_allclose(arrival, 0.5e-6 * np.arange(5) + (0.04 + 0.5 * SPEED * 0.5e-6) / SPEED, rtol=1e-12)
    for below, above in itertools.pairwise(detonators):
        pair = [straight_arrival([one], meetings, SPEED) for one in (below, above)]
        assert np.isclose(pair[0], pair[1], rtol=1e-12).sum() == 1


def test_planes_run_both_ways_with_normals_of_any_length():
    plane = PlaneDetonator((0.1, 7.0, -3.0), normal=(3.0, 0.0, 4.0), time=1e-6)
    points = np.array([[0.1, 0.0, -3.0], [0.1 + 0.6, 1.0, -3.0 + 0.8], [0.1 - 0.3, 2.0, -3.0 - 0.4]])
    np.testing.assert_allclose(detonator_distance(plane, points), [0.0, 1.0, 0.5], atol=1e-15)
    np.testing.assert_allclose(straight_arrival([plane], points, SPEED), 1e-6 + np.array([0.0, 1.0, 0.5]) / SPEED)


def test_the_eikonal_equation():
    """|grad t_b| = 1 / D, by central differences, wherever one wave is the first by more than the step."""
    detonators = [
        PointDetonator((0.0, 0.0, 0.0)),
        PointDetonator((0.1, 0.02, 0.0), time=5e-6),
        PlaneDetonator((0.0, 0.3, 0.0), normal=(0.1, 1.0, 0.0), time=20e-6),
    ]
    points = np.random.default_rng(2).uniform(-0.3, 0.3, (500, 3))
    each = np.sort([straight_arrival([one], points, SPEED) for one in detonators], axis=0)
    step = 1e-6
    points = points[each[1] - each[0] > 4.0 * step / SPEED]
    assert len(points) > 400
    slopes = [
        (straight_arrival(detonators, points + way, SPEED) - straight_arrival(detonators, points - way, SPEED))
        / (2.0 * step)
        for way in step * np.eye(3)
    ]
    np.testing.assert_allclose(np.linalg.norm(slopes, axis=0) * SPEED, 1.0, rtol=1e-4)


def test_no_detonator_no_arrival():
    assert np.isinf(straight_arrival([], np.zeros((2, 3)), SPEED)).all()
    assert straight_arrival([PointDetonator((0.0, 0.0, 0.0), time=3e-6)], np.zeros((1, 3)), SPEED) == pytest.approx(
        3e-6
    )
