"""Kenamond's three problems: against the eikonal equation, Fermat's principle by brute force, and symmetry."""

import numpy as np
import pytest

from warp_mpm.detonators import PointDetonator
from warp_mpm.exact.kenamond import inert_sphere, one_point, shadow_angle, two_explosives

RADIUS, SPEED, SLOW = 0.03, 8000.0, 4000.0
LAMP = PointDetonator((0.0, 0.05, 0.0), time=1e-6)
OTHERS = [
    PointDetonator((0.0, a, 0.0), time=t) for a, t in ((0.1, 5e-6), (0.05, 2.5e-6), (-0.05, 2.5e-6), (-0.1, 5e-6))
]


def places(count=400, size=0.1):
    return np.random.default_rng(3).uniform(-size, size, (count, 3))


def slowness(times, points, step=1e-6):
    """|grad t| by central differences (n,) [s/m]."""
    slopes = [(times(points + way) - times(points - way)) / (2.0 * step) for way in step * np.eye(3)]
    return np.linalg.norm(slopes, axis=0)


def shadow(points, cylinder=False):
    return inert_sphere(points, radius=RADIUS, detonator=LAMP, speed=SPEED, cylinder=cylinder)


def concentric(points, cylinder=False):
    return two_explosives(
        points,
        radius=RADIUS,
        inner_speed=SPEED,
        outer_speed=SLOW,
        central_time=0.0,
        others=OTHERS,
        cylinder=cylinder,
    )


def test_one_point():
    points = places()
    exact = LAMP.time + np.linalg.norm(points - LAMP.position, axis=1) / SPEED
    np.testing.assert_allclose(one_point(points, LAMP, SPEED), exact, rtol=1e-14)


@pytest.mark.parametrize("cylinder", [False, True])
def test_the_eikonal_equation(cylinder):
    """|grad t| = 1 / D of the place, but on the lines where waves meet: there it is less."""
    points = places()
    radius = np.linalg.norm(points[:, :2] if cylinder else points, axis=1)
    clear = np.abs(radius - RADIUS) > 1e-3
    product = slowness(lambda x: concentric(x, cylinder), points[clear]) * np.where(radius[clear] < RADIUS, SPEED, SLOW)
    assert np.mean(np.abs(product - 1.0) < 1e-5) > 0.98
    outside = points[radius > RADIUS + 1e-3]
    product = slowness(lambda x: shadow(x, cylinder), outside) * SPEED
    assert np.mean(np.abs(product - 1.0) < 1e-5) > 0.98
    assert np.isnan(shadow(points[radius < RADIUS - 1e-3], cylinder)).all()


def test_in_two_dimensions_z_does_not_count():
    points = places()
    moved = points + np.array([0.0, 0.0, 0.7])
    np.testing.assert_allclose(shadow(moved, cylinder=True), shadow(points, cylinder=True), rtol=1e-14)
    np.testing.assert_allclose(concentric(moved, cylinder=True), concentric(points, cylinder=True), rtol=1e-14)
    flat = points * [1.0, 1.0, 0.0]
    np.testing.assert_allclose(shadow(flat), shadow(flat, cylinder=True), rtol=1e-12)


def test_two_explosives_by_fermats_principle():
    """The earliest way from the centre over any point of the sphere, by brute force in a plane through the centre."""
    angles = np.linspace(0.0, 2.0 * np.pi, 20001)
    corners = RADIUS * np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=1)
    points = places(20) * [1.0, 1.0, 0.0]
    points = points[np.linalg.norm(points, axis=1) > 1.2 * RADIUS]
    alone = two_explosives(
        points, radius=RADIUS, inner_speed=SPEED, outer_speed=SLOW, central_time=2e-6, others=[], cylinder=True
    )
    for point, time in zip(points, alone, strict=True):
        ways = RADIUS / SPEED + np.linalg.norm(corners - point, axis=1) / SLOW
        assert time == pytest.approx(2e-6 + ways.min(), rel=1e-7)


def test_the_shadow_by_a_taut_string():
    """The convex hull of detonator, obstacle and place has the string as one of its halves."""
    angles = np.linspace(0.0, 2.0 * np.pi, 20001)[:-1]
    circle = RADIUS * np.exp(1j * angles)
    lamp = complex(LAMP.position[0], LAMP.position[1])
    for point in (0.01 - 0.05j, 0.035 - 0.02j, -0.04 - 0.06j, 0.002 - 0.031j):
        place = np.array([[point.real, point.imag, 0.0]])
        assert shadow_angle(place, radius=RADIUS, detonator=LAMP)[0] > 0.0
        leave, land = (touching(circle, end, point, lamp) for end in (lamp, point))
        arc = RADIUS * abs(np.angle(land / leave))
        length = abs(leave - lamp) + arc + abs(point - land)
        assert shadow(place)[0] == pytest.approx(LAMP.time + length / SPEED, rel=1e-4)


def touching(circle, end, point, lamp):
    """Where the tangent from one end of the string touches the circle, on the same side of the lamp as the point."""
    far_side = (circle * np.conj(lamp)).imag * (point * np.conj(lamp)).imag < 0.0
    return circle[np.argmin(np.abs((circle * np.conj(circle - end)).real) + far_side)]


def test_times_and_speeds_are_continuous_at_the_edge_of_the_shadow():
    tangent = np.arccos(RADIUS / 0.05)
    touch = RADIUS * np.array([np.sin(tangent), np.cos(tangent), 0.0])
    along = (touch - LAMP.position) / np.linalg.norm(touch - LAMP.position)
    edge = touch + np.outer(np.linspace(0.005, 0.05, 10), along)
    across = 1e-9 * touch / RADIUS
    np.testing.assert_allclose(shadow(edge + across), shadow(edge - across), rtol=1e-7)
    np.testing.assert_allclose(slowness(shadow, edge) * SPEED, 1.0, rtol=1e-4)


def test_what_the_formulas_do_not_cover_is_refused():
    with pytest.raises(ValueError, match="outer_speed: expected at most inner_speed"):
        two_explosives(places(1), radius=1.0, inner_speed=1.0, outer_speed=2.0, central_time=0.0, others=[])
    with pytest.raises(ValueError, match="others: expected outside of the inner explosive and not before"):
        two_explosives(places(1), radius=RADIUS, inner_speed=SPEED, outer_speed=SLOW, central_time=9.0, others=OTHERS)
    with pytest.raises(ValueError, match="detonator: expected outside of the sphere"):
        inert_sphere(places(1), radius=0.06, detonator=LAMP, speed=SPEED)
