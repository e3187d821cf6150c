"""What the pictures in space are made of: surfaces of cells, seen from the right side and in the right order."""

import numpy as np
import pytest

from warp_mpm.detonators import CordDetonator
from warp_mpm.output.description import SceneDescription
from warp_mpm.output.figures.cells import Cells
from warp_mpm.output.figures.view import View, box_edges, opened, surface_of, view_of
from warp_mpm.output.isochrones import contour, round_times
from warp_mpm.output.outlines import lit_part, outlines, plane_in_box
from warp_mpm.scene import Domain, SectionPlane, Walls

SPACING = np.array([1.0, 0.8, 1.3])
LOWER = np.array([-2.0, 1.0, 0.5])


def cells_of(filled: np.ndarray) -> Cells:
    """Cells whose pressure is their number."""
    pressure = np.arange(filled.size, dtype=float).reshape(filled.shape)
    return Cells(LOWER, SPACING, filled, pressure, filled.astype(float))


@pytest.fixture(params=[(0, False), (1, True), (2, False), (2, True)], ids=["x", "y thick", "z", "z thick"])
def view(request) -> View:
    axis, thick = request.param
    return view_of(SectionPlane(axis, 0.0), thick)


def test_a_view_is_turned_as_the_section_is(view):
    """Right-handed and orthonormal; the first axis of the plane still points right, the second up."""
    np.testing.assert_allclose(view.axes @ view.axes.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(view.axes) == pytest.approx(1.0)
    normal = int(np.argmax(np.abs(view.axes[2])))
    first, second = (axis for axis in range(3) if axis != normal)
    assert view.project(np.eye(3)[first])[0] > 0.7
    assert view.project(np.eye(3)[second])[1] > 0.7


def test_what_is_seen_is_what_is_nearest(view):
    """At any point of the picture the face drawn last is that of the first cell that a ray meets."""
    random = np.random.default_rng(5)
    filled = random.random((5, 4, 6)) < 0.4
    cells = cells_of(filled)
    corners, number, _ = surface_of(cells, view, cells.pressure)
    seen = view.project(corners)
    low, high = seen.reshape(-1, 2).min(axis=0), seen.reshape(-1, 2).max(axis=0)
    hits = 0
    for point in random.uniform(low, high, (300, 2)):
        inside = np.flatnonzero(_covers(seen, point))
        expected = _first_cell(filled, view, point)
        if expected is None:
            assert len(inside) == 0
        else:
            assert number[inside[-1]] == expected
            hits += 1
    assert 50 < hits < 300


def _covers(faces: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Which parallelograms (faces, 4, 2) cover a point."""
    first, second = faces[:, 1] - faces[:, 0], faces[:, 3] - faces[:, 0]
    across = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    away = point - faces[:, 0]
    along = (away[:, 0] * second[:, 1] - away[:, 1] * second[:, 0]) / across
    up = (first[:, 0] * away[:, 1] - first[:, 1] * away[:, 0]) / across
    return (along > 0.0) & (along < 1.0) & (up > 0.0) & (up < 1.0)


def _first_cell(filled: np.ndarray, view: View, point: np.ndarray) -> float | None:
    """Number of the filled cell that is nearest to the viewer along a ray."""
    nearest, found = -np.inf, None
    start = point @ view.axes[:2]
    for cell in np.argwhere(filled):
        low = LOWER + cell * SPACING
        crossings = np.sort([(low - start) / view.axes[2], (low + SPACING - start) / view.axes[2]], axis=0)
        enter, leave = crossings[0].max(), crossings[1].min()
        if enter < leave and leave > nearest:
            nearest, found = leave, float(np.ravel_multi_index(tuple(cell), filled.shape))
    return found


def test_the_edges_of_a_box(view):
    lower, upper = np.zeros(3), np.array([3.0, 1.0, 2.0])
    seen, hidden = box_edges(lower, upper, view)
    assert (seen.shape, hidden.shape) == ((9, 2, 3), (3, 2, 3))
    corner = [
        point for edge in hidden for point in edge if sum(np.any(np.all(e == point, axis=1)) for e in hidden) == 3
    ]
    far = np.where(view.axes[2] > 0.0, lower, upper)  # the corner that the whole box hides
    np.testing.assert_array_equal(corner, [far] * 3)


@pytest.mark.parametrize("corner", [None, np.array([0.5, 0.0, 0.0])])
def test_taking_away_what_is_in_front(corner):
    setup = SceneDescription(
        *("", Domain((0, 0, 0), (1, 1, 1), (4, 4, 4)), Walls(), SectionPlane(2, 0.5)), (), None, None, (), (), (), 1.0
    )
    view = view_of(setup.section, thick=corner is not None)
    filled = np.ones((4, 4, 4), dtype=bool)
    cells = Cells(np.zeros(3), np.full(3, 0.25), filled, filled.astype(float), filled.astype(float))
    expected = filled.copy()
    expected[0 if corner is None else 2 :, :, 2:] = False  # towards the viewer; with a corner only on the right
    np.testing.assert_array_equal(opened(cells, setup, view, corner).filled, expected)


@pytest.mark.parametrize(
    ("point", "normal", "corners"),
    [
        ((0.5, 0.0, 0.0), (2.0, 0.0, 0.0), 4),
        ((0.5, 0.5, 0.5), (1.0, 1.0, 1.0), 6),
        ((2.0, 0.0, 0.0), (1.0, 0.0, 0.0), 0),
    ],
)
def test_a_plane_cuts_a_box(point, normal, corners):
    polygon = plane_in_box(np.array(point), np.array(normal), np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]]))
    assert polygon.shape == (corners, 3)
    np.testing.assert_allclose((polygon - point) @ normal, 0.0, atol=1e-12)
    sides = np.linalg.norm(np.roll(polygon, 1, axis=0) - polygon, axis=1)
    if corners:  # in turn around it: all sides equal here, no diagonals
        np.testing.assert_allclose(sides, {4: 1.0, 6: np.sqrt(0.5)}[corners])


def test_a_cord_is_lit_as_far_as_it_has_burnt():
    """At 2 m/s from 1 s on: 3 m after 2.5 s, one of them around the corner."""
    cord = CordDetonator(((0.0, 0.0, 0.0), (2.0, 0.0, 0.0), (2.0, 2.0, 0.0)), speed=2.0, time=1.0)
    (outline,) = outlines(cord, np.zeros((2, 3)), np.eye(3))
    np.testing.assert_array_equal(outline, cord.points)
    np.testing.assert_allclose(lit_part(cord, outline, 2.5), [[0, 0, 0], [2, 0, 0], [2, 1, 0]])
    assert len(lit_part(cord, outline, 0.5)) == 0
    np.testing.assert_array_equal(lit_part(cord, outline, 9.0), outline)


def test_lines_of_equal_values():
    """Closed inside, open where they meet an edge or what has no value; exact on a plane."""
    rows, columns = np.indices((20, 30)).astype(float)
    (line,) = contour(rows + 2.0 * columns, 17.5)
    np.testing.assert_allclose(line @ [1.0, 2.0], 17.5)
    assert abs(line[0, 0] - line[-1, 0]) > 15.0  # from edge to edge, in turn
    assert np.abs(np.diff(line, axis=0)).max() <= 1.0
    away = np.hypot(rows - 9.3, columns - 12.2)
    (ring,) = contour(away, 6.0)
    np.testing.assert_array_equal(ring[0], ring[-1])
    np.testing.assert_allclose(np.hypot(*(ring - [9.3, 12.2]).T), 6.0, atol=2.0 / (8 * 6.0))  # of a chord, the diagonal
    away[9, 18] = np.nan
    (torn,) = contour(away, 6.0)
    assert np.linalg.norm(torn[0] - torn[-1]) > 1.0
    assert contour(away, 1e3) == []


@pytest.mark.parametrize("last", [1.0, 9.99, 12.0, 143e-6])
def test_times_of_lines_are_round(last):
    times = round_times(last)
    assert 4 <= len(times) <= 12
    assert times[-1] <= last * (1.0 + 1e-9) < times[-1] + 1.001 * times[0]
    digits = times[0] / 10.0 ** np.floor(np.log10(times[0]) + 1e-9)
    assert min(abs(digits - step) for step in (1.0, 2.0, 2.5, 5.0, 10.0)) < 1e-6
