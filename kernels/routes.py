"""Routes: the end of a wave's way, and how it is led on from a node of the grid to a place near by.

Used by `eikonal.py`, which says what it is about.
"""

import warp as wp

from warp_mpm.kernels.arrival import Ignition, arrival_time, source_of, source_time
from warp_mpm.kernels.passage import Passage, best_corner, corner_between, distance_at, is_clear, onto_surface
from warp_mpm.kernels.precision import NEVER, ONE, TWO, ZERO, scalar, vector3

FIXED = wp.constant(-1)  # the medium before a corner that does not move any more
MOST_CORNERS = wp.constant(12)  # between two neighbouring nodes


@wp.struct
class Route:
    """The end of a wave's way: ... start - corner - here, straight in between."""

    time: scalar  # of arrival [s]
    corner: vector3  # from which the wave comes straight [m]
    corner_time: scalar  # when it was there [s]
    start: vector3  # from which it came to the corner [m]
    start_time: scalar  # [s]
    medium: int  # between start and corner; FIXED: the corner is a detonator, or stays where it is
    direct: int  # 1: the corner is a detonator; 2: and no other one that is hindered would come earlier
    source: int  # number of that detonator
    parent: int  # node from which what lies before the corner, or the start, was led on; -1 without one


@wp.func
def no_route() -> Route:
    """Nothing has come."""
    route = Route()
    route.time = NEVER
    route.medium = FIXED
    route.parent = -1
    return route


@wp.func
def route_from(corner: vector3, corner_time: scalar, speed: scalar, place: vector3) -> Route:
    """A straight way from a corner that stays where it is."""
    route = Route()
    route.corner = corner
    route.corner_time = corner_time
    route.time = corner_time + wp.length(place - corner) / speed
    route.medium = FIXED
    route.parent = -1
    return route


@wp.func
def route_over(
    passage: Passage, start: vector3, start_time: scalar, before: int, corner: vector3, place: vector3, medium: int
) -> Route:
    """The way from a start through a medium to a corner, on through another one to a place, if it is clear."""
    route = no_route()
    if is_clear(passage, before, start, corner) and is_clear(passage, medium, corner, place):
        time = start_time + wp.length(corner - start) / passage.speed[before]
        route = route_from(corner, time, passage.speed[medium], place)
        route.start = start
        route.start_time = start_time
        route.medium = before
    return route


@wp.func
def moved_on(passage: Passage, known: Route, place: vector3, medium: int) -> Route:
    """A node's route, its last corner moved to suit another place of the same medium; none if that is not clear."""
    if known.medium == medium and is_clear(passage, medium, known.start, place):
        return route_from(known.start, known.start_time, passage.speed[medium], place)
    corner = best_corner(
        passage,
        known.medium,
        known.start,
        ONE / passage.speed[known.medium],
        known.corner,
        place,
        ONE / passage.speed[medium],
    )
    return route_over(passage, known.start, known.start_time, known.medium, corner, place, medium)


@wp.func
def around(passage: Passage, known: Route, place: vector3, medium: int) -> Route:
    """A node's route, its last corner kept: straight on to a place of the same medium, or around what is between."""
    speed = passage.speed[medium]
    start = known.corner + vector3()
    start_time = known.corner_time + ZERO
    corner = known.corner + vector3()
    corner_time = known.corner_time + ZERO
    corners = wp.int32(0)
    while corners < MOST_CORNERS:
        if is_clear(passage, medium, corner, place):
            break
        following = corner_between(passage, medium, corner, place)
        if corners == 0 or not is_clear(passage, medium, start, following):
            start = corner
            start_time = corner_time
        corner = following
        corner_time = start_time + wp.length(corner - start) / speed
        corners = corners + 1
    route = no_route()
    if corners == 0:
        route = route_from(corner, corner_time, speed, place)
    elif corners < MOST_CORNERS:
        kept = route_over(passage, start, start_time, medium, corner, place, medium)
        best = best_corner(passage, medium, start, ONE / speed, corner, place, ONE / speed)
        route = route_over(passage, start, start_time, medium, best, place, medium)
        if kept.time < route.time:
            route = kept
    return route


@wp.func
def across(passage: Passage, known: Route, node: vector3, before: int, place: vector3, medium: int) -> Route:
    """A node's route, its last corner kept, on to a place in another medium: refracted at the surface between."""
    inside = wp.min(distance_at(passage, before, node), ZERO)
    outside = wp.max(distance_at(passage, before, place), ZERO)
    corner = node
    if outside - inside > ZERO:
        corner = node + (place - node) * (inside / (inside - outside))
    corner = onto_surface(passage, before, corner)
    corner = best_corner(
        passage,
        before,
        known.corner,
        ONE / passage.speed[before],
        corner,
        place,
        ONE / passage.speed[medium],
    )
    return route_over(passage, known.corner, known.corner_time, before, corner, place, medium)


@wp.func
def onward(
    passage: Passage, known: Route, node: vector3, number: int, before: int, place: vector3, medium: int
) -> Route:
    """The route of a node in one medium, led on to a place near by in the same or another medium."""
    if medium != before:
        route = across(passage, known, node, before, place, medium)
        route.parent = number
        return route
    route = no_route()
    if known.medium != FIXED:
        route = moved_on(passage, known, place, medium)
        route.parent = known.parent
    if route.time >= NEVER:
        route = around(passage, known, place, medium)
        route.parent = number
    return route


@wp.func
def straight_route(
    passage: Passage, ignitions: wp.array(dtype=Ignition), medium: int, place: vector3, latest: scalar
) -> Route:
    """The first of the straight waves that nothing hinders and that come before the latest time of interest.

    Its `direct` is 2 if those that are hindered would come later.
    """
    speed = passage.speed[medium]
    best = no_route()
    best.time = latest
    first = wp.int32(0)
    earliest = scalar(1.0e30)
    for n in range(ignitions.shape[0]):
        time = arrival_time(ignitions[n], place, speed)
        if time < earliest:
            earliest = time
            first = n
    hindered = scalar(1.0e30)
    for count in range(ignitions.shape[0]):
        n = (first + count) % ignitions.shape[0]  # the first one is seldom hindered, and then the others come too late
        ignition = ignitions[n]
        time = arrival_time(ignition, place, speed)
        if time < best.time:
            source = source_of(ignition, place, speed)
            if is_clear(passage, medium, source, place):
                best.time = time
                best.corner = source
                best.corner_time = source_time(ignition, place, speed)
                best.direct = 1
                best.source = n
            else:
                hindered = wp.min(hindered, time)
    if best.direct == 0:
        best.time = NEVER
    elif best.time <= hindered:
        best.direct = 2
    return best


@wp.func
def expected_gain(passage: Passage, known: Route, node: vector3, place: vector3, medium: int) -> scalar:
    """What moving the corner of a node's route to suit a place near by gains in time, to second order [s].

    With g the part of the time's gradient along the surface, and H the second derivative along g, it is g^2 / (2 H).
    The surface's normal is that of the gradient at the node, where the corner is best.
    """
    gain = scalar(0.0)
    if known.medium != FIXED:
        slowness = ONE / passage.speed[known.medium]
        slowness_after = ONE / passage.speed[medium]
        before = known.corner - known.start
        after = place - known.corner
        length = wp.length(before)
        length_after = wp.length(after)
        if length > ZERO and length_after > ZERO:
            before /= length
            after /= length_after
            normal = wp.normalize(before * slowness - wp.normalize(node - known.corner) * slowness_after)
            gradient = before * slowness - after * slowness_after
            gradient -= normal * wp.dot(normal, gradient)
            way = wp.normalize(gradient)
            second = slowness / length * (ONE - wp.dot(before, way) ** TWO)
            second += slowness_after / length_after * (ONE - wp.dot(after, way) ** TWO)
            if second > ZERO:
                gain = wp.dot(gradient, gradient) / (TWO * second)
    return gain
