"""Solids: bounds, inside and outside, distances, volumes, and what they refuse."""

import math

import numpy as np
import pytest

from warp_mpm.errors import InputError
from warp_mpm.geometry import Box, Cylinder, Sphere
from warp_mpm.volume import measure_volume

BOX = Box((0, 0, 0), (1, 2, 3))
BALL = Sphere((0, 0, 0), 1.0)
ROD = Cylinder((0, 0, 0), (0, 0, 2), 0.5)
SLANTED = Cylinder((0, 0, 0), (3, 4, 0), 0.5)


def points_around(solid, count=4000):
    lower, upper = solid.bounds()
    room = 0.2 * (upper - lower)
    return np.random.default_rng(1).uniform(lower - room, upper + room, (count, 3))


@pytest.mark.parametrize("solid", [BOX, BALL, ROD, SLANTED, BOX | BALL, BOX - BALL, BALL - ROD])
def test_contained_points_have_negative_distance_and_lie_within_bounds(solid):
    points = points_around(solid)
    inside = solid.contains(points)
    assert 0 < inside.sum() < len(points)
    np.testing.assert_array_equal(inside, solid.signed_distance(points) < 0.0)
    lower, upper = solid.bounds()
    assert np.all(points[inside] >= lower)
    assert np.all(points[inside] <= upper)


def test_distances_of_primitives():
    points = np.array([[0.5, 1.0, 1.5], [0.5, 1.0, 2.9], [-3.0, -4.0, 1.0]])
    np.testing.assert_allclose(BOX.signed_distance(points), [-0.5, -0.1, 5.0])
    np.testing.assert_allclose(BALL.signed_distance(np.array([[0.0, 0.0, 0.0], [0.0, 3.0, 4.0]])), [-1.0, 4.0])
    points = np.array([[0.0, 0.0, 1.0], [3.5, 0.0, 1.0], [3.5, 0.0, 6.0], [0.0, 0.0, 1.9]])
    np.testing.assert_allclose(ROD.signed_distance(points), [-0.5, 3.0, 5.0, -0.1])


def test_bounds_of_a_slanted_cylinder_are_tight():
    lower, upper = SLANTED.bounds()
    np.testing.assert_allclose(lower, [-0.4, -0.3, -0.5])
    np.testing.assert_allclose(upper, [3.4, 4.3, 0.5])


def test_bounds_of_half_a_sphere():
    lower, upper = (BALL - Box((-2, -2, -2), (2, 2, 0))).bounds()
    np.testing.assert_allclose(lower, [-1, -1, 0])
    np.testing.assert_allclose(upper, [1, 1, 1])


def test_boxes_that_touch_share_no_point():
    left, right = Box((0, 0, 0), (1, 1, 1)), Box((1, 0, 0), (2, 1, 1))
    on_the_face = np.array([[1.0, 0.5, 0.5]])
    assert left.contains(on_the_face)[0] + right.contains(on_the_face)[0] == 1


@pytest.mark.parametrize(
    ("solid", "volume"),
    [
        (BOX, 6.0),
        (BALL, 4 / 3 * math.pi),
        (SLANTED, math.pi * 0.25 * 5),
        (BALL | Sphere((3, 0, 0), 0.5), 4 / 3 * math.pi * 1.125),  # apart
        (BALL | Sphere((2, 0, 0), 1.0), 8 / 3 * math.pi),  # touching
        (ROD | Cylinder((0, 0, 2), (0, 0, 3), 0.5), math.pi * 0.25 * 3),  # end to end
        (BOX | Box((0.5, 1, 1), (2, 3, 2)), 6.0 + 3.0 - 0.5),  # overlapping boxes
        (BOX - Box((0.5, 1, 1), (2, 3, 2)), 6.0 - 0.5),
        ((BOX | Box((0.5, 1, 1), (2, 3, 2))) - Box((0, 0, 0), (2, 3, 1.5)), 3.0 + 1.5 - 0.25),
        (BALL - Sphere((0, 0, 0), 0.5), 4 / 3 * math.pi * 0.875),  # shell
        (ROD - Cylinder((0, 0, -1), (0, 0, 5), 0.4), math.pi * 0.09 * 2),  # tube, bored right through
        (BOX - Sphere((0.5, 1, 1), 0.5), 6.0 - math.pi / 6),  # hole that touches three faces
        (BOX - Sphere((9, 9, 9), 1.0), 6.0),  # the cut misses
        (Box((-1, -1, -1), (1, 1, 1)) | BALL, 8.0),  # one within the other
    ],
)
def test_exact_volumes(solid, volume):
    assert solid.exact_volume() == pytest.approx(volume, rel=1e-12)
    assert measure_volume(solid) == (solid.exact_volume(), 0.0)


@pytest.mark.parametrize(
    ("solid", "volume"),
    [
        (BALL - Box((-2, -2, -2), (2, 2, 0.5)), math.pi * 0.25 * (3 - 0.5) / 3),  # cap
        (BALL - Sphere((1, 0, 0), 1.0), 4 / 3 * math.pi - 5 / 12 * math.pi),  # ball less a lens
        (BOX - Sphere((0, 0, 0), 0.9), 6.0 - math.pi / 6 * 0.9**3),  # corner rounded inwards
    ],
)
def test_measured_volumes_keep_their_tolerance(solid, volume):
    assert solid.exact_volume() is None
    measured, tolerance = measure_volume(solid)
    assert 0.0 < tolerance <= 1e-4
    assert measured == pytest.approx(volume, rel=tolerance)


def test_a_cut_that_leaves_nothing_has_no_volume():
    assert (BALL - Box((-2, -2, -2), (2, 2, 2))).exact_volume() == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Box((0, 0, math.nan), (1, 1, 1)), "Box: lower: expected three finite numbers"),
        (lambda: Box((0, 0, 0), (1, math.inf, 1)), "Box: upper: expected three finite numbers"),
        (lambda: Box((0, 0), (1, 1)), "Box: lower: expected three finite numbers"),
        (lambda: Box((0, 0, 0), (1, -1, 1)), "Box: upper: expected above lower"),
        (lambda: Box((0, 0, 0), (1, 0, 1)), "Box: upper: expected above lower"),
        (lambda: Sphere((0, 0, 0), 0.0), "Sphere: radius: expected a positive number, got 0.0"),
        (lambda: Sphere((0, 0, 0), math.nan), "Sphere: radius: expected a positive number, got nan"),
        (lambda: Sphere("abc", 1.0), "Sphere: center: expected three finite numbers, got 'abc'"),
        (lambda: Cylinder((0, 0, 0), (0, 0, 1), -1.0), "Cylinder: radius: expected a positive number, got -1.0"),
        (lambda: Cylinder((0, 0, 0), (0, 0, 0), 1.0), "Cylinder: end: expected another point than start"),
    ],
)
def test_impossible_solids_are_refused(make, message):
    with pytest.raises(InputError, match=message) as caught:
        make()
    assert "\n" not in str(caught.value)
