"""Ways pulled taut: all corners of a wave's way moved at once to where its time is stationary.

A route's last corner moves to suit every new node, those before it stay where they were best for a node that the wave
passed earlier. So its time is a little too long, by another amount for every node, and differences of times between
nodes would be errors of the local speed. Here the way of a node is put together from the routes of the nodes that it
came over, and Newton's method moves all its corners. Each has two coordinates on the surface, and only neighbours along
the way see each other: the equations are tridiagonal, in blocks of two by two, and are solved from the way's start to
its end and back.
"""

import warp as wp

from warp_mpm.kernels.passage import (
    FLAT,
    Passage,
    bend_of,
    corner_between,
    deepest,
    is_clear,
    onto_surface,
    shortened,
    surface_at,
)
from warp_mpm.kernels.precision import HALF, NEVER, ONE, TWO, ZERO, matrix2, scalar, vector2, vector3, vector4
from warp_mpm.kernels.routes import FIXED, Route

FAST = wp.constant(1)  # kinds of fans: the last corner stays where it is,
TURNS = wp.constant(2)  # or moves along the surface
MOST = wp.constant(24)  # corners that move; what lies before them stays as it is
STEPS = wp.constant(5)
STILL = wp.constant(scalar(2.0e-3))  # a movement that is none: of the step along lines
SHORT = wp.constant(scalar(0.5))  # a last leg too short to tell how its corner is held: of the step along lines
SAME = wp.constant(scalar(1.0e-3))  # places that are the same: of the step along lines
WEAK = wp.constant(scalar(0.2))  # of a leg's stiffness: a corner that is hardly held
DEEPER = wp.constant(scalar(2.0))  # tolerances that a taut way may cut deep
CHANGE = wp.constant(scalar(1.0))  # that pulling may make in the time: of the step along lines

Places = wp.types.matrix((24, 3), scalar)
Pairs = wp.types.matrix((24, 2), scalar)
Blocks = wp.types.matrix((24, 4), scalar)
Media = wp.types.vector(24, wp.int32)


@wp.struct
class Fan:
    """The last leg of a node's way, and what holds its corner when its end is moved: the wave around the node."""

    kind: int  # FAST or TURNS; 0: there is none
    corner: vector3  # [m]
    corner_time: scalar  # [s]
    pull: vector3  # derivative of the time up to the corner with respect to it [s/m]; 0 if the corner stays
    first: vector3  # unit vectors along the surface; 0 if the corner stays
    second: vector3
    stiffness: matrix2  # second derivatives along them of the time up to the corner, all others moving too [s/m2]


@wp.struct
class Way:
    """The corners from the last to the first, with the media before them, and where the way begins."""

    corners: Places
    media: Media
    count: int
    source: vector3
    source_time: scalar
    first: vector3  # unit vectors along the surface at the last corner
    second: vector3
    stiffness: matrix2  # second derivatives of the time there, the other corners moving too [s/m2]


@wp.func
def end_of_route(known: Route) -> Way:
    """What a route itself says of its way: the last corner, if there is one, and what comes straight before."""
    way = Way()
    way.source = known.corner
    way.source_time = known.corner_time
    if known.medium != FIXED:
        way.corners[0] = known.corner
        way.media[0] = known.medium
        way.count = 1
        way.source = known.start
        way.source_time = known.start_time
    return way


@wp.func
def way_of(passage: Passage, routes: wp.array(dtype=Route), nodes_a_medium: int, node: int) -> Way:
    """The way of a node, put together from the routes of the nodes that it came over."""
    known = routes[node]
    parent = known.parent
    way = end_of_route(known)
    while parent >= 0 and way.count < MOST - 1:
        before = routes[parent]
        medium = parent / nodes_a_medium
        if wp.length(way.source - before.corner) > SAME * passage.step:
            way.corners[way.count] = way.source
            way.media[way.count] = medium
            way.count = way.count + 1
            way.source = before.corner
            way.source_time = before.corner_time
        if before.medium != FIXED:
            way.corners[way.count] = before.corner
            way.media[way.count] = before.medium
            way.count = way.count + 1
            way.source = before.start
            way.source_time = before.start_time
        parent = before.parent
    return way


@wp.func
def start_of(way: Way, n: int) -> vector3:
    """Where the leg before a corner begins."""
    place = way.source
    if n + 1 < way.count:
        place = way.corners[n + 1]
    return place


@wp.func
def end_of(way: Way, n: int, place: vector3) -> vector3:
    """Where the leg after a corner ends: at the next one, or at the place where the way ends."""
    end = place
    if n > 0:
        end = way.corners[n - 1]
    return end


@wp.func
def slowness_after(passage: Passage, way: Way, n: int, medium: int) -> scalar:
    """Of the leg after a corner [s/m]; `medium` is that of the last leg."""
    following = medium
    if n > 0:
        following = way.media[n - 1]
    return ONE / passage.speed[following]


@wp.func
def mended(passage: Passage, given: Way, place: vector3, medium: int) -> Way:
    """The way with corners where it is not clear, and without those that it does not need."""
    way = given
    way.count = 0
    end = place
    leg_medium = medium
    for n in range(given.count + 1):
        target = given.source
        if n < given.count:
            target = given.corners[n]
        while way.count < MOST and not is_clear(passage, leg_medium, end, target):
            end = corner_between(passage, leg_medium, end, target)
            way.corners[way.count] = end
            way.media[way.count] = leg_medium
            way.count = way.count + 1
        if n < given.count and way.count < MOST:
            before = given.media[n]
            if before != leg_medium or not is_clear(passage, leg_medium, end, start_of(given, n)):
                way.corners[way.count] = target
                way.media[way.count] = before
                way.count = way.count + 1
                end = target
            leg_medium = before
    return way


@wp.func
def coupling(slowness: scalar, leg: vector3, first: vector3, second: vector3) -> scalar:
    """Second derivative of the time of a leg, its start moved along one vector, its end along another [s/m2]."""
    length = wp.length(leg)
    along = leg / length
    return (wp.dot(first, along) * wp.dot(second, along) - wp.dot(first, second)) * slowness / length


@wp.func
def block_of(values: Blocks, n: int) -> matrix2:
    """A row as a block."""
    return matrix2(values[n, 0], values[n, 1], values[n, 2], values[n, 3])


@wp.func
def lanes_of(block: matrix2) -> vector4:
    """A block as a row."""
    return vector4(block[0, 0], block[0, 1], block[1, 0], block[1, 1])


@wp.func
def pulled(passage: Passage, given: Way, place: vector3, medium: int, steps: int) -> Way:
    """The way with all corners where its time is stationary; without corners where Newton's method fails."""
    way = given
    firsts = Places()
    seconds = Places()
    sides = Blocks()
    inverses = Blocks()
    rests = Pairs()
    for step in range(steps + 1):
        for back in range(way.count):
            n = way.count - 1 - back
            corner = way.corners[n]
            start = start_of(way, n)
            slowness = ONE / passage.speed[way.media[n]]
            after = slowness_after(passage, way, n, medium)
            bend = bend_of(passage, way.media[n], start, slowness, corner, end_of(way, n, place), after)
            if slowness == after and wp.abs(bend.stiffness[0, 0]) < WEAK * bend.scale:
                bend.first = vector3()  # on a smooth surface: along the way a corner may be anywhere
                bend.slope = vector2(ZERO, bend.slope[1])
                bend.stiffness = matrix2(bend.scale, ZERO, ZERO, bend.stiffness[1, 1])
            stiffness = bend.stiffness
            rest = -bend.slope
            if back > 0:
                leg = corner - start
                first = firsts[n + 1]
                second = seconds[n + 1]
                side = matrix2(
                    coupling(slowness, leg, first, bend.first),
                    coupling(slowness, leg, first, bend.second),
                    coupling(slowness, leg, second, bend.first),
                    coupling(slowness, leg, second, bend.second),
                )
                carried = wp.transpose(side) * block_of(inverses, n + 1)
                stiffness -= carried * side
                rest -= carried * rests[n + 1]
                sides[n] = lanes_of(side)
            if wp.abs(wp.determinant(stiffness)) <= FLAT * bend.scale * bend.scale:
                way.count = 0
                return way
            way.stiffness = stiffness
            way.first = bend.first
            way.second = bend.second
            inverses[n] = lanes_of(wp.inverse(stiffness))
            firsts[n] = bend.first
            seconds[n] = bend.second
            rests[n] = rest
        if step == steps:
            break
        farthest = scalar(0.0)
        move = vector2()
        for n in range(way.count):
            rest = rests[n]
            if n > 0:
                rest -= block_of(sides, n - 1) * move
            move = block_of(inverses, n) * rest
            way_there = shortened(firsts[n] * move[0] + seconds[n] * move[1], TWO * TWO * passage.step)
            farthest = wp.max(farthest, wp.length(way_there))
            way.corners[n] = onto_surface(passage, way.media[n], way.corners[n] + way_there)
        if farthest < STILL * passage.step:
            break
    return way


@wp.func
def last_leg(slowness: scalar, leg: vector3, first: vector3, second: vector3) -> matrix2:
    """Second derivatives of the time of a way's last leg, its corner moved along two vectors [s/m2]."""
    side = coupling(slowness, leg, first, second)
    return matrix2(-coupling(slowness, leg, first, first), -side, -side, -coupling(slowness, leg, second, second))


@wp.func
def excess(passage: Passage, medium: int, start: vector3, corner: vector3) -> scalar:
    """How much longer the arc over a surface is than the chord that a leg to a corner cuts off [m].

    8 s^2 / (3 l) for a flat arc of the height s over a chord l.
    """
    found = deepest(passage, medium, corner, start, scalar(1.0e30), ZERO, ZERO)
    longer = scalar(0.0)
    height = surface_at(passage, medium, corner + (start - corner) * found[1]).distance
    if height > ZERO and found[1] > ZERO:
        longer = height * height / (found[1] * wp.length(corner - start)) * scalar(4.0 / 3.0)
    return longer


@wp.func
def fan_of(passage: Passage, way: Way, place: vector3, medium: int) -> Fan:
    """The end of a way."""
    fan = Fan()
    fan.kind = FAST
    fan.corner = way.source
    fan.corner_time = way.source_time
    for back in range(way.count):
        n = way.count - 1 - back
        leg = way.corners[n] - fan.corner
        slowness = ONE / passage.speed[way.media[n]]
        fan.corner = way.corners[n]
        fan.corner_time += wp.length(leg) * slowness
        fan.pull = wp.normalize(leg) * slowness
        ends = scalar(1.0)
        if back == 0:
            ends = scalar(0.5)
        fan.corner_time += ends * excess(passage, way.media[n], start_of(way, n), fan.corner) * slowness
    if way.count > 0:
        fan.kind = TURNS
        fan.corner_time += HALF * excess(passage, medium, place, fan.corner) / passage.speed[medium]
        fan.first = way.first
        fan.second = way.second
        held = last_leg(ONE / passage.speed[medium], place - fan.corner, way.first, way.second)
        fan.stiffness = way.stiffness - held
        if wp.length(place - fan.corner) < SHORT * passage.step:
            fan.kind = 0
    return fan


@wp.func
def time_over(fan: Fan, place: vector3, slowness: scalar, most: scalar) -> scalar:
    """When a node's wave comes to a place near by [s], to second order in how far its corner moves.

    NEVER if moving the corner gains more than `most` [s]: then that is not good enough.
    """
    leg = place - fan.corner
    length = wp.length(leg)
    time = fan.corner_time + length * slowness
    if fan.kind == TURNS and length > ZERO:
        along = leg / length
        far = slowness / length
        u = wp.dot(along, fan.first)
        v = wp.dot(along, fan.second)
        x = wp.dot(fan.pull, fan.first) - slowness * u
        y = wp.dot(fan.pull, fan.second) - slowness * v
        a = fan.stiffness[0, 0] + far * (wp.dot(fan.first, fan.first) - u * u)
        b = fan.stiffness[0, 1] - far * u * v
        c = fan.stiffness[1, 1] + far * (ONE - v * v)
        gain = (c * x * x - TWO * b * x * y + a * y * y) / (TWO * (a * c - b * b))
        time = wp.where(wp.abs(gain) <= most, time - gain, NEVER)
    return time


@wp.func
def is_sound(passage: Passage, way: Way, place: vector3, medium: int) -> bool:
    """Whether all legs of a way are as good as clear."""
    limit = DEEPER * passage.tolerance
    sound = bool(True)
    for n in range(way.count + 1):
        start = way.source
        leg_medium = medium
        if n > 0:
            leg_medium = way.media[n - 1]
        if n < way.count:
            start = way.corners[n]
        sound = sound and deepest(passage, leg_medium, start, end_of(way, n, place), limit, ZERO, ZERO)[0] <= limit
    return sound


@wp.func
def taut_fan(passage: Passage, routes: wp.array(dtype=Route), nodes_a_medium: int, node: int, place: vector3) -> Fan:
    """The end of a node's way pulled taut; where that fails, with its last corner alone."""
    medium = node / nodes_a_medium
    known = routes[node]
    way = way_of(passage, routes, nodes_a_medium, node)
    way = mended(passage, way, place, medium)
    taut = pulled(passage, way, place, medium, STEPS)
    fan = fan_of(passage, taut, place, medium)
    slowness = ONE / passage.speed[medium]
    change = fan.corner_time + wp.length(place - fan.corner) * slowness - known.time
    failed = taut.count < way.count or wp.abs(change) > CHANGE * passage.step * slowness
    if failed or not is_sound(passage, taut, place, medium):
        short = end_of_route(known)
        alone = pulled(passage, short, place, medium, 0)
        if alone.count < short.count:
            alone.source = known.corner
            alone.source_time = known.corner_time
        fan = fan_of(passage, alone, place, medium)
    return fan
