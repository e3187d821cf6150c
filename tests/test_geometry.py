"""Solids: bounds, inside and outside, distances, volumes, and what they refuse."""

import itertools
import math

import numpy as np
import pytest
from solids_for_tests import BALL, BOX, CONE, FRUSTUM, RING, ROD, SLANTED, SOLIDS, cube_mesh

from warp_mpm import geometry, volume
from warp_mpm.errors import InputError
from warp_mpm.geometry import Box, Cone, Cylinder, HalfSpace, Mesh, Solid, Sphere
from warp_mpm.geometry.solid import certainly_apart, certainly_covers
from warp_mpm.volume import measure_volume

SINGLE = 2e-7  # of the size: distances to meshes are found in single precision
all_solids = pytest.mark.parametrize("solid", SOLIDS.values(), ids=SOLIDS)


def points_around(solid, count=4000):
    lower, upper = solid.bounds()
    room = 0.2 * (upper - lower)
    return np.random.default_rng(1).uniform(lower - room, upper + room, (count, 3))


def size_of(solid):
    return float(np.ptp(solid.bounds(), axis=0).max())


def test_there_is_an_example_of_every_kind_of_solid():
    """A new one needs a line in `solids_for_tests.py`: then all tests of all solids test it."""

    def kinds(solid):
        inner = [value for value in vars(solid).values() if isinstance(value, Solid)]
        return {type(solid)}.union(*(kinds(part) for part in inner))

    offered = {kind for kind in vars(geometry).values() if isinstance(kind, type) and issubclass(kind, Solid)}
    assert offered - {Solid} <= set().union(*(kinds(solid) for solid in SOLIDS.values()))


@all_solids
def test_contained_points_have_negative_distance_and_lie_within_bounds(solid):
    points = points_around(solid)
    inside = solid.contains(points)
    assert 0 < inside.sum() < len(points)
    np.testing.assert_array_equal(inside, solid.signed_distance(points) < 0.0)
    lower, upper = solid.bounds()
    assert np.all(points[inside] >= lower)
    assert np.all(points[inside] <= upper)


@all_solids
def test_distances_are_no_larger_than_the_way_to_the_surface(solid):
    """They change by no more than the way between two points; with the right sign that is what it takes."""
    near = points_around(solid)
    step = np.random.default_rng(2).normal(size=near.shape) * np.geomspace(1e-4, 1.0, len(near))[:, None]
    change = np.abs(solid.signed_distance(near + step) - solid.signed_distance(near))
    assert np.all(change <= np.linalg.norm(step, axis=1) + SINGLE * size_of(solid))


@all_solids
def test_formulas_of_volumes_agree_with_sampling(solid, monkeypatch):
    """Random points know nothing but `contains` and the distance."""
    monkeypatch.setattr(volume, "TARGET_TOLERANCE", 2e-3)
    sampled, tolerance = volume._sampled_volume(solid)
    exact, _ = measure_volume(solid)
    assert sampled == pytest.approx(exact, rel=1.5 * tolerance)  # 4.5 standard errors


@all_solids
def test_a_solid_elsewhere_is_the_same(solid):
    """Turned, scaled and moved: distances and volume scale, and turning back gives what there was."""
    turned = solid.rotated((1, -2, 0.5), 2.0, about=(0.3, 0, 0)).scaled(0.5, about=(0, 1, 0)).translated((0.1, 0.2, 3))
    points = points_around(solid)
    back = turned.translated((-0.1, -0.2, -3)).scaled(2.0, about=(0, 1, 0)).rotated((1, -2, 0.5), -2.0, (0.3, 0, 0))
    expected = solid.signed_distance(points)
    size = size_of(solid) + np.abs(solid.bounds()).max()
    np.testing.assert_allclose(back.signed_distance(points), expected, rtol=0, atol=SINGLE * size)
    centers = [Sphere(tuple(point), 1.0) for point in points[:200]]
    placed = [
        one.rotated((1, -2, 0.5), 2.0, (0.3, 0, 0)).scaled(0.5, (0, 1, 0)).translated((0.1, 0.2, 3)) for one in centers
    ]
    there = np.array([one.center for one in placed])
    np.testing.assert_allclose(turned.signed_distance(there), 0.5 * expected[:200], rtol=0, atol=SINGLE * size)
    assert placed[0].radius == 0.5
    if solid.exact_volume() is not None and turned.exact_volume() is not None:
        assert turned.exact_volume() == pytest.approx(solid.exact_volume() / 8.0, rel=1e-9)


@all_solids
def test_a_solid_lies_between_the_points_of_its_hull(solid):
    inside = points_around(solid)[solid.contains(points_around(solid))]
    directions = np.random.default_rng(3).normal(size=(100, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    reach = SINGLE * size_of(solid)
    along, hull = inside @ directions.T, solid.hull() @ directions.T
    assert np.all(along.max(axis=0) <= hull.max(axis=0) + reach)
    for number, direction in enumerate(directions):
        low, high = solid.extent(direction)
        assert low - reach <= along[:, number].min()
        assert along[:, number].max() <= high + reach


def test_what_solids_tell_of_each_other_is_true():
    """Of all pairs, as they are and one of them small: apart means no point in both, covered no point outside."""
    told = 0
    for first, second in itertools.product(SOLIDS.values(), repeat=2):
        for other in (second, second.scaled(0.2, about=tuple(np.mean(second.bounds(), axis=0)))):
            points = np.concatenate([points_around(first, 500), points_around(other, 500)])
            in_first, in_other = first.contains(points), other.contains(points)
            if certainly_apart(first, other):
                assert not np.any(in_first & in_other)
                told += 1
            if certainly_covers(first, other):
                assert not np.any(in_other & ~in_first)
                told += 1
    assert told > 100


@pytest.mark.parametrize("quarters", [-1, 1, 2, 3])
@pytest.mark.parametrize("axis", [(1, 0, 0), (0, 2, 0), (0, 0, -1)])
def test_a_box_after_quarter_turns_is_a_box(axis, quarters):
    box = BOX.rotated((1, 1, 0), 0.3).rotated((1, 1, 0), -0.3).rotated(axis, quarters * math.pi / 2)
    assert isinstance(box, Box)
    assert sorted(np.ptp(box.bounds(), axis=0)) == pytest.approx([1, 2, 3], rel=1e-14)


def test_distances_of_primitives():
    points = np.array([[0.5, 1.0, 1.5], [0.5, 1.0, 2.9], [-3.0, -4.0, 1.0]])
    np.testing.assert_allclose(BOX.signed_distance(points), [-0.5, -0.1, 5.0])
    np.testing.assert_allclose(BALL.signed_distance(np.array([[0.0, 0.0, 0.0], [0.0, 3.0, 4.0]])), [-1.0, 4.0])
    points = np.array([[0.0, 0.0, 1.0], [3.5, 0.0, 1.0], [3.5, 0.0, 6.0], [0.0, 0.0, 1.9]])
    np.testing.assert_allclose(ROD.signed_distance(points), [-0.5, 3.0, 5.0, -0.1])


def test_distances_of_a_cone():
    """Its mantle falls from radius 1 at z = 0 to the tip at z = 2: the unit normal is (2, 1) / sqrt(5)."""
    points = np.array([[0, 0, 1], [2, 0, 2], [0, 0, 3], [0, 0, -1], [0, 2, -1], [0, 0, 0.1], [0.4, 0, 1]])
    expected = [-1 / math.sqrt(5), 4 / math.sqrt(5), 1.0, 1.0, math.sqrt(2), -0.1, -0.2 / math.sqrt(5)]
    np.testing.assert_allclose(CONE.signed_distance(points), expected, rtol=1e-14)


def test_distances_of_a_half_space_and_a_mesh():
    points = np.array([[0.5, 0.5, 0.5], [0.5, 0.5, 0.9], [2.0, 2.0, 0.5]])
    np.testing.assert_allclose(HalfSpace((0, 0, 1), (0, 0, 5)).signed_distance(points), points[:, 2] - 1)
    cube = Mesh(*cube_mesh()).signed_distance(points)
    np.testing.assert_allclose(cube, [-0.5, -0.1, math.sqrt(2)], rtol=0, atol=SINGLE)
    on_axis = RING.signed_distance(np.array([[0, 0, 0], [0, 0, 0.1]]))  # as near to all of the ring's inner side
    np.testing.assert_allclose(on_axis, np.hypot(0.6, [0, 0.1]), rtol=0.02)


def test_bounds_of_cones_and_of_what_planes_cut_off():
    reach = 0.9 * np.sqrt(1 - np.array([1, 4, 1]) / 6)
    np.testing.assert_allclose(FRUSTUM.bounds()[1], np.array([2, 2, 1]) + reach)
    np.testing.assert_array_equal((BALL & HalfSpace((0, 0, 0.5), (0, 0, -2))).bounds(), [[-1, -1, 0.5], [1, 1, 1]])
    np.testing.assert_array_equal((BALL - HalfSpace((0, 0, 0.5), (0, 0, -2))).bounds(), [[-1, -1, -1], [1, 1, 0.5]])
    assert np.isinf(HalfSpace((0, 0, 0), (1, 1, 0)).bounds()).all()


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
        (CONE, 2 / 3 * math.pi),
        (Cone((0, 0, 0), (0, 3, 4), 1.0, 2.0), 5 / 3 * math.pi * 7),
        (Box((-1, -1, 0), (1, 1, 2)) - CONE, 8.0 - 2 / 3 * math.pi),
        (CONE - Cone((0, 0, 0), (0, 0, 1), 0.5), 2 / 3 * math.pi - math.pi / 12),  # a hollow one
        (CONE & Cylinder((0, 0, -1), (0, 0, 3), 1.0), 2 / 3 * math.pi),
        (BOX & Box((0.5, 1, 1), (2, 3, 2)), 0.5),
        (BOX & BOX.translated((5, 0, 0)), 0.0),
        (BOX & HalfSpace((0, 0, 1), (0, 0, 1)), 2.0),
        (BOX - HalfSpace((0, 0.5, 1), (0, 1, 0)), 4.5),
        (
            BOX - (BALL.scaled(0.1).translated((0.5, 0.5, 0.5)) | BALL.scaled(0.2).translated((0.5, 1.5, 0.5))),
            6 - 0.012 * math.pi,
        ),
        (Box((-2, -2, -2), (2, 2, 2)) - RING, 64 - RING.exact_volume()),
        (RING - Sphere((1, 0, 0), 0.3), RING.exact_volume() - 0.036 * math.pi),
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
        (lambda: Cone((0, 0, 0), (0, 0, 0), 1.0), "Cone: end: expected another point than start"),
        (lambda: Cone((0, 0, 0), (0, 0, 1), -1.0), "Cone: start_radius: expected a number of at least 0, got -1.0"),
        (
            lambda: Cone((0, 0, 0), (0, 0, 1), 1.0, math.nan),
            "Cone: end_radius: expected a number of at least 0, got nan",
        ),
        (
            lambda: Cone((0, 0, 0), (0, 0, 1), 0.0),
            "Cone: end_radius: expected a positive number where start_radius is 0",
        ),
        (lambda: HalfSpace((0, 0, 0), (0, 0, 0)), "HalfSpace: normal: expected a vector of any length but 0"),
        (lambda: HalfSpace((0, math.inf, 0), (0, 0, 1)), "HalfSpace: point: expected three finite numbers"),
        (lambda: BOX.translated((1, 2)), "translated: by: expected three finite numbers, got .1, 2."),
        (lambda: BALL.rotated((0, 0, 0), 1.0), "rotated: axis: expected a vector of any length but 0"),
        (lambda: BALL.rotated((0, 0, 1), math.inf), "rotated: angle: expected a finite number, got inf"),
        (lambda: RING.scaled(0.0), "scaled: factor: expected a positive number, got 0.0"),
        (lambda: ROD.scaled(-1.0), "scaled: factor: expected a positive number, got -1.0"),
    ],
)
def test_impossible_solids_are_refused(make, message):
    with pytest.raises(InputError, match=message) as caught:
        make()
    assert "\n" not in str(caught.value)
