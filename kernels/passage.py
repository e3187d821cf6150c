"""Where a detonation can run: the media, bodies of explosive of one detonation speed each, and ways through them.

A medium is known by its signed distance (negative inside) on a lattice finer than the grid. A straight way through a
medium is clear if it nowhere leaves it by more than a tolerance. A way with one corner is shortest in time when the
corner, on the surface of a medium, makes the time stationary: that is Snell's law where the way enters another medium
(Fermat), and a taut string where it goes around an obstacle.
"""

import warp as wp

from warp_mpm.kernels.precision import HALF, ONE, TWO, ZERO, matrix2, scalar, vector2, vector3

CAUTION = wp.constant(scalar(0.8))  # of the distance to a surface that is stepped over; interpolated ones are inexact
NEWTON_STEPS = wp.constant(4)
CORNER_STEPS = wp.constant(8)
EDGE = wp.constant(scalar(8.0))  # steps, two cells: how far from an end at a sharp edge this is blunt
ENOUGH = wp.constant(scalar(0.1))  # of what the slope promises a step must gain (Armijo's condition)
CLOSE = wp.constant(scalar(1.0e-3))  # to the best corner: of a step
HALVINGS = wp.constant(8)
STEEP = wp.constant(scalar(1.0e-2))  # a component along a surface that says nothing about a direction
FLAT = wp.constant(scalar(1.0e-6))  # of a slope or a determinant that counts as 0
LOWEST = wp.constant(scalar(-1.0e30))


@wp.struct
class Passage:
    """The media."""

    distance: wp.array(dtype=scalar)  # signed, of each medium at all lattice points, z fastest [m]
    speed: wp.array(dtype=scalar)  # of the detonation in each medium [m/s]
    points: wp.vec3i  # of the lattice per axis
    count: int  # of them all
    lower: vector3  # first lattice point, relative to the domain's lower corner [m]
    spacing: vector3  # of the lattice [m]
    inverse_spacing: vector3  # [1/m]
    step: scalar  # smallest step of the search along a line [m]
    reach: scalar  # a way may begin this far outside its medium [m]
    tolerance: scalar  # how deep a clear way may cut what is no part of the medium [m]


@wp.func
def distance_at(passage: Passage, medium: int, place: vector3) -> scalar:
    """Signed distance of a place to a medium [m], linear between lattice points, constant beyond them."""
    at = wp.cw_mul(place - passage.lower, passage.inverse_spacing)
    i = wp.clamp(int(wp.floor(at[0])), 0, passage.points[0] - 2)
    j = wp.clamp(int(wp.floor(at[1])), 0, passage.points[1] - 2)
    k = wp.clamp(int(wp.floor(at[2])), 0, passage.points[2] - 2)
    x = wp.clamp(at[0] - scalar(i), ZERO, ONE)
    y = wp.clamp(at[1] - scalar(j), ZERO, ONE)
    z = wp.clamp(at[2] - scalar(k), ZERO, ONE)
    row = passage.points[2]
    layer = passage.points[1] * row
    first = medium * passage.count + i * layer + j * row + k
    d = passage.distance
    low = wp.lerp(
        wp.lerp(d[first], d[first + 1], z),
        wp.lerp(d[first + row], d[first + row + 1], z),
        y,
    )
    high = wp.lerp(
        wp.lerp(d[first + layer], d[first + layer + 1], z),
        wp.lerp(d[first + layer + row], d[first + layer + row + 1], z),
        y,
    )
    return wp.lerp(low, high, x)


@wp.struct
class Surface:
    """A medium's surface, seen from a place near by."""

    distance: scalar  # signed [m]
    slope: vector3  # the distance's gradient


@wp.func
def between(distance: wp.array(dtype=scalar), first: int, one: int, other: int, share: vector2) -> scalar:
    """Linear between four lattice points of a plane, from the strides along its two axes."""
    return wp.lerp(
        wp.lerp(distance[first], distance[first + other], share[1]),
        wp.lerp(distance[first + one], distance[first + one + other], share[1]),
        share[0],
    )


@wp.func
def surface_at(passage: Passage, medium: int, place: vector3) -> Surface:
    """A medium's surface near a place: slopes by central differences over two lattice spacings.

    Linear interpolation takes a curved surface for one with facets, off by h^2 / (8 R) for each radius R, and times
    would wiggle from facet to facet. So along each axis x (1 - x) / 2 times the second difference is taken off: that of
    the two next to the place that is nearer to zero, as at edges and ridges one of them is wrong (Min and Gibou, J.
    Comput. Phys. 225 (2007) 300). No more than a tolerance is taken off, or ways to a corner would not be clear.
    """
    at = wp.cw_mul(place - passage.lower, passage.inverse_spacing)
    stride = wp.vec3i(passage.points[1] * passage.points[2], passage.points[2], 1)
    first = medium * passage.count
    share = vector3()
    for axis in range(3):
        i = wp.clamp(int(wp.floor(at[axis])), 1, passage.points[axis] - 3)
        share[axis] = wp.clamp(at[axis] - scalar(i), ZERO, ONE)
        first += i * stride[axis]
    surface = Surface()
    middle = scalar(0.0)
    bulge = scalar(0.0)
    for axis in range(3):
        step = stride[axis]
        one = stride[(axis + 1) % 3]
        other = stride[(axis + 2) % 3]
        x = share[axis]
        across = vector2(share[(axis + 1) % 3], share[(axis + 2) % 3])
        before = between(passage.distance, first - step, one, other, across)
        here = between(passage.distance, first, one, other, across)
        there = between(passage.distance, first + step, one, other, across)
        beyond = between(passage.distance, first + 2 * step, one, other, across)
        low = before - here - here + there
        high = here - there - there + beyond
        if low * high > ZERO:
            bulge += HALF * x * (ONE - x) * wp.where(wp.abs(low) < wp.abs(high), low, high)
        middle = wp.lerp(here, there, x)
        surface.slope[axis] = wp.lerp(there - before, beyond - here, x) * HALF * passage.inverse_spacing[axis]
    surface.distance = middle - wp.clamp(bulge, -passage.tolerance, passage.tolerance)
    return surface


@wp.func
def bend_at(passage: Passage, medium: int, place: vector3, direction: vector3) -> scalar:
    """Second derivative of the signed distance along a unit vector [1/m], over two lattice spacings."""
    way = direction * (TWO * passage.step)
    both = distance_at(passage, medium, place + way) + distance_at(passage, medium, place - way)
    return (both - TWO * distance_at(passage, medium, place)) / wp.dot(way, way)


@wp.func
def onto_surface(passage: Passage, medium: int, place: vector3) -> vector3:
    """The place, moved along the gradient onto the surface of a medium (Newton's method)."""
    moved = place
    for _ in range(NEWTON_STEPS):
        surface = surface_at(passage, medium, moved)
        if wp.abs(surface.distance) < CLOSE * passage.step:
            break
        square = wp.dot(surface.slope, surface.slope)
        if square < FLAT:
            break
        moved -= surface.slope * (surface.distance / square)
    return moved


@wp.func
def beginning(passage: Passage, medium: int, place: vector3) -> vector3:
    """Where a way from a place begins in a medium: a detonator just outside lights what is nearest to it."""
    distance = distance_at(passage, medium, place)
    if distance > passage.tolerance and distance <= passage.reach:
        return onto_surface(passage, medium, place)
    return place


@wp.func
def overhang(passage: Passage, medium: int, place: vector3) -> scalar:
    """How far outside its medium a place in it seems to be [m]: the lattice blunts sharp edges."""
    distance = distance_at(passage, medium, place)
    return wp.where(distance > passage.tolerance and distance <= passage.reach, distance, ZERO)


@wp.func
def deepest(
    passage: Passage, medium: int, start: vector3, end: vector3, limit: scalar, at_start: scalar, at_end: scalar
) -> vector2:
    """How far a straight way leaves the medium at most [m], and after which share of the way.

    Stops where it first leaves it by more than `limit`. Where the surface is far away long steps are taken. An end at a
    sharp edge seems to be outside (`overhang`, here `at_start` and `at_end`), and what is near it may seem so as far.
    """
    way = end - start
    length = wp.length(way)
    worst = scalar(-1.0e30)
    where = scalar(0.0)
    gone = scalar(0.0)
    per_edge = ONE / (EDGE * passage.step)
    while gone < length and worst <= limit:
        distance = distance_at(passage, medium, start + way * (gone / length))
        left = distance - at_start * wp.max(ONE - gone * per_edge, ZERO)
        left -= at_end * wp.max(ONE - (length - gone) * per_edge, ZERO)
        if left > worst:
            worst = left
            where = gone / length
        gone += wp.max(-CAUTION * distance - passage.step, passage.step)
    return vector2(worst, where)


@wp.func
def is_clear(passage: Passage, medium: int, start: vector3, end: vector3) -> bool:
    """Whether the straight way stays in the medium."""
    begin = beginning(passage, medium, start)
    at_start = overhang(passage, medium, start)
    at_end = overhang(passage, medium, end)
    return deepest(passage, medium, begin, end, passage.tolerance, at_start, at_end)[0] <= passage.tolerance


@wp.func
def corner_between(passage: Passage, medium: int, start: vector3, end: vector3) -> vector3:
    """A point on the surface over which a blocked way has to go, so near that the way from the start to it is clear.

    Where the way is deepest in the obstacle, the nearest point of the surface; or the same for the way to that point.
    """
    begin = beginning(passage, medium, start)
    at_start = overhang(passage, medium, start)
    at_end = overhang(passage, medium, end)
    corner = end
    for _ in range(HALVINGS):
        found = deepest(passage, medium, begin, corner, -LOWEST, at_start, at_end)
        if found[0] <= passage.tolerance:
            break
        corner = onto_surface(passage, medium, begin + (corner - begin) * found[1])
        at_end = ZERO
    return corner


@wp.func
def shortened(way: vector3, longest: scalar) -> vector3:
    """A vector of the same direction, no longer than `longest`."""
    length = wp.length(way)
    return wp.where(length > longest, way * (longest / length), way)


@wp.func
def tangent(normal: vector3, way: vector3) -> vector3:
    """A unit vector along a surface, in the direction of a way unless this is all but normal to it."""
    along = way - normal * wp.dot(normal, way)
    if wp.length(along) < STEEP:
        axis = vector3()
        axis[int(wp.argmin(wp.abs(normal)))] = ONE
        along = axis - normal * wp.dot(normal, axis)
    return wp.normalize(along)


@wp.struct
class Bend:
    """A corner of a way on a medium's surface: derivatives of the time along two unit vectors on the surface."""

    first: vector3
    second: vector3
    slope: vector2  # first derivatives [s/m]
    stiffness: matrix2  # second derivatives [s/m2]
    scale: scalar  # of these [s/m2]; 0 if there is no corner, or no surface


@wp.func
def bend_of(
    passage: Passage,
    surface: int,
    start: vector3,
    slowness: scalar,
    corner: vector3,
    end: vector3,
    slowness_after: scalar,
) -> Bend:
    """How the time of a way changes with its corner on a medium's surface.

    With the gradient g of the time, its Hessian H and the surface's unit normal n the second derivatives along the
    surface are those of H - (g . n) grad grad d / |grad d|, d the signed distance.
    """
    bend = Bend()
    before = corner - start
    after = end - corner
    length = wp.length(before)
    length_after = wp.length(after)
    slope = surface_at(passage, surface, corner).slope
    steepness = wp.length(slope)
    nearest = passage.step * FLAT
    if length < nearest or length_after < nearest or steepness < HALF * HALF:
        return bend
    before /= length
    after /= length_after
    gradient = before * slowness - after * slowness_after
    normal = slope / steepness
    first = tangent(normal, before + after)
    second = wp.cross(normal, first)
    push = wp.dot(gradient, normal) / steepness
    near = slowness / length
    far = slowness_after / length_after
    a = near * (ONE - wp.dot(before, first) ** TWO) + far * (ONE - wp.dot(after, first) ** TWO)
    b = -near * wp.dot(before, first) * wp.dot(before, second)
    b -= far * wp.dot(after, first) * wp.dot(after, second)
    c = near * (ONE - wp.dot(before, second) ** TWO) + far * (ONE - wp.dot(after, second) ** TWO)
    a -= push * bend_at(passage, surface, corner, first)
    c -= push * bend_at(passage, surface, corner, second)
    diagonal = wp.normalize(first + second)
    opposite = wp.normalize(first - second)
    turn = bend_at(passage, surface, corner, diagonal) - bend_at(passage, surface, corner, opposite)
    b -= push * HALF * turn
    bend.first = first
    bend.second = second
    bend.slope = vector2(wp.dot(gradient, first), wp.dot(gradient, second))
    bend.stiffness = matrix2(a, b, b, c)
    bend.scale = near + far
    return bend


@wp.func
def best_corner(
    passage: Passage,
    surface: int,
    start: vector3,
    slowness: scalar,
    corner: vector3,
    end: vector3,
    slowness_after: scalar,
) -> vector3:
    """The corner, moved along a medium's surface to where the time of the way over it is stationary (Newton)."""
    for _ in range(CORNER_STEPS):
        bend = bend_of(passage, surface, start, slowness, corner, end, slowness_after)
        if wp.abs(wp.determinant(bend.stiffness)) <= FLAT * bend.scale * bend.scale:
            break
        step = -(wp.inverse(bend.stiffness) * bend.slope)
        longest = TWO * TWO * passage.step
        move = shortened(bend.first * step[0] + bend.second * step[1], longest)
        moved = onto_surface(passage, surface, corner + move)
        if slowness != slowness_after:  # a minimum: where Newton's step hardly leads down, one that must
            rise = bend.first * bend.slope[0] + bend.second * bend.slope[1]
            time = wp.length(corner - start) * slowness + wp.length(end - corner) * slowness_after
            most = time + ENOUGH * wp.min(wp.dot(rise, move), ZERO)
            if wp.length(moved - start) * slowness + wp.length(end - moved) * slowness_after > most:
                move = shortened(-rise / bend.scale, longest)
                moved = onto_surface(passage, surface, corner + move)
        corner = moved
        if wp.length(move) < CLOSE * passage.step:
            break
    return corner
