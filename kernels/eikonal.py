"""Arrival times of a detonation around obstacles and through several explosives: |grad t_b| = 1 / D(x).

The front runs along straight ways that turn where they enter another medium and around the edges of what carries no
wave. So each node (a cell's centre, for each medium) carries no bare time but the *route* of its wave: the last corner
and the one before it. A neighbour's route goes on to a node by moving its last corner to where it is best for this
node, or by adding a corner; the earliest one stays. Times are therefore exact along straight ways from a detonator,
from a corner and through an interface, and |grad t_b| is 1 / D there, however coarse the grid is; around curved
obstacles the way is a polygon whose edges cut it no deeper than a small tolerance.

Nodes are settled in the order of their times, a window at a time, as in the group marching method: a wave comes to a
node from nodes that are settled already, so none is ever computed anew, and the outcome does not depend on the order of
the threads.

References: J. A. Sethian, Fast marching methods, SIAM Review 41 (1999) 199; S. Kim, An O(N) level set method for
eikonal equations, SIAM J. Sci. Comput. 22 (2001) 2178 (group marching); A. Nash, K. Daniel, S. Koenig, A. Felner,
Theta*: any-angle path planning on grids, AAAI (2007) 1177 (ways that go on from a parent in sight).
"""

import warp as wp

from warp_mpm.kernels.arrival import Ignition, boost, first_arrival, particle_position
from warp_mpm.kernels.passage import Passage, distance_at, is_clear, onto_surface
from warp_mpm.kernels.precision import HALF, NEVER, ONE, TWO, ZERO, scalar, vector3
from warp_mpm.kernels.records import Grid, Particles
from warp_mpm.kernels.routes import FIXED, Route, expected_gain, onward, straight_route
from warp_mpm.kernels.taut import Fan, taut_fan, time_over

ABSENT = wp.constant(-2)  # a node outside its medium
OPEN = wp.constant(-1)  # a node not yet settled; settled ones have the number of their window
ALIKE = wp.constant(scalar(1.0e-3))  # of a cell: places that are the same
NEGLIGIBLE = wp.constant(scalar(2.0e-4))  # of a cell: a gain that is not worth its computation
SMALL = wp.constant(scalar(0.004))  # of a cell: a gain that second order is good enough for
AGREED = wp.constant(scalar(0.025))  # of a cell of travel: nodes that differ more do not speak of the same wave
ALL_AGREED = wp.constant(scalar(0.02))  # of a cell of travel: nodes that differ less need not be questioned
GOOD = wp.constant(scalar(0.05))  # of a cell of travel: a gain that second order is good enough for
MARGIN = wp.constant(scalar(0.3))  # of a cell: what moving a corner may gain between neighbours


@wp.struct
class Nodes:
    """For each medium one node a cell of a box of cells: its centre, or a place of the medium near by."""

    place: wp.array(dtype=vector3)  # relative to the domain's lower corner [m]
    route: wp.array(dtype=Route)
    fan: wp.array(dtype=Fan)  # the wave around the node, where it comes around something
    window: wp.array(dtype=int)  # in which it was settled, or OPEN, or ABSENT
    touched: wp.array(dtype=int)  # window in which a neighbour was settled
    certain: wp.array(dtype=int)  # 1: no wave can come earlier than the straight one it has; 2: nor at its neighbours
    first: wp.vec3i  # cell of the box's lower corner
    cells: wp.vec3i  # of the box per axis
    count: int  # of cells
    media: int
    spacing: vector3  # of the cells [m]
    size: scalar  # of the smallest side of a cell [m]


@wp.func
def cell_of(nodes: Nodes, index: int) -> wp.vec3i:
    """A cell of the box by its flat index."""
    layer = nodes.cells[1] * nodes.cells[2]
    i = index / layer
    rest = index - i * layer
    j = rest / nodes.cells[2]
    return wp.vec3i(i, j, rest - j * nodes.cells[2])


@wp.func
def node_at(nodes: Nodes, i: int, j: int, k: int, medium: int) -> int:
    """Flat index of the node of a cell; -1 beyond the box."""
    if i < 0 or j < 0 or k < 0 or i >= nodes.cells[0] or j >= nodes.cells[1] or k >= nodes.cells[2]:
        return -1
    return medium * nodes.count + (i * nodes.cells[1] + j) * nodes.cells[2] + k


@wp.func
def node_near(nodes: Nodes, cell: wp.vec3i, neighbour: int, medium: int) -> int:
    """Flat index of the node of one of the 27 cells around a cell, itself the first; -1 beyond the box."""
    number = (neighbour + 13) % 27
    return node_at(nodes, cell[0] + number / 9 - 1, cell[1] + (number / 3) % 3 - 1, cell[2] + number % 3 - 1, medium)


@wp.func
def is_present(nodes: Nodes, index: int) -> bool:
    """Whether there is a node of this flat index, and in its medium."""
    if index < 0:
        return False
    return nodes.window[index] != ABSENT


@wp.kernel(enable_backward=False)
def place_nodes(passage: Passage, nodes: Nodes):
    """Put the nodes into their media."""
    medium, index = wp.tid()
    cell = cell_of(nodes, index)
    whole = vector3(
        scalar(nodes.first[0] + cell[0]), scalar(nodes.first[1] + cell[1]), scalar(nodes.first[2] + cell[2])
    )
    centre = wp.cw_mul(whole + vector3(HALF, HALF, HALF), nodes.spacing)
    place = centre
    if distance_at(passage, medium, centre) > ZERO:
        place = onto_surface(passage, medium, centre)
    n = medium * nodes.count + index
    shift = wp.cw_div(place - centre, nodes.spacing)
    farthest = wp.max(wp.max(wp.abs(shift[0]), wp.abs(shift[1])), wp.abs(shift[2]))
    nodes.place[n] = place
    nodes.window[n] = ABSENT
    if farthest <= HALF and distance_at(passage, medium, place) <= passage.tolerance:
        nodes.window[n] = OPEN


@wp.kernel(enable_backward=False)
def light_nodes(passage: Passage, nodes: Nodes, medium: int, ignitions: wp.array(dtype=Ignition), begin: int):
    """Give the nodes of a medium the straight waves of its detonators."""
    n = medium * nodes.count + begin + wp.tid()
    if nodes.window[n] == OPEN:
        route = straight_route(passage, ignitions, medium, nodes.place[n], NEVER)
        nodes.route[n] = route
        if route.direct == 2 and nodes.media == 1:
            nodes.certain[n] = 1


@wp.kernel(enable_backward=False)
def look_around(nodes: Nodes):
    """Mark the nodes around which all is in sight."""
    n = wp.tid()
    if nodes.certain[n] == 0:
        return
    medium = n / nodes.count
    cell = cell_of(nodes, n - medium * nodes.count)
    for neighbour in range(1, 27):
        near = node_near(nodes, cell, neighbour, medium)
        if near >= 0 and nodes.certain[wp.max(near, 0)] == 0:
            return
    wp.atomic_max(nodes.certain, n, 2)  # while others ask whether it is 0


@wp.kernel(enable_backward=False)
def settle(nodes: Nodes, open: wp.array(dtype=int), window: int, end: scalar, begin: int):
    """Settle the nodes whose waves come before the end of a window, and touch their neighbours."""
    n = open[begin + wp.tid()]
    if nodes.window[n] != OPEN or nodes.route[n].time >= end:
        return
    nodes.window[n] = window
    medium = n / nodes.count
    cell = cell_of(nodes, n - medium * nodes.count)
    for other in range(nodes.media):
        for neighbour in range(27):
            near = node_near(nodes, cell, neighbour, other)
            if near >= 0:
                nodes.touched[near] = window


@wp.kernel(enable_backward=False)
def spread(passage: Passage, nodes: Nodes, open: wp.array(dtype=int), window: int, begin: int):
    """Lead the waves of the nodes settled in a window on to their neighbours."""
    n = open[begin + wp.tid()]
    if nodes.touched[n] != window or nodes.window[n] != OPEN or nodes.certain[n] == 1:
        return
    medium = n / nodes.count
    place = nodes.place[n]
    cell = cell_of(nodes, n - medium * nodes.count)
    best = nodes.route[n]
    for other in range(nodes.media):
        for neighbour in range(27):
            near = node_near(nodes, cell, neighbour, other)
            if near < 0:
                continue
            if nodes.window[near] != window:
                continue
            known = nodes.route[near]
            if may_come_first(passage, nodes, known, other, place, medium, best):
                route = onward(passage, known, nodes.place[near], near, other, place, medium)
                if route.time < best.time:
                    best = route
    nodes.route[n] = best


@wp.func
def may_come_first(
    passage: Passage, nodes: Nodes, known: Route, before: int, place: vector3, medium: int, best: Route
) -> bool:
    """Whether a neighbour's route can come to a place before the best one known: only then it is worth to lead it on.

    Routes from the same start over the same corner differ in nothing but how far the corner has been moved.
    """
    if medium != before:
        return known.time < best.time
    if known.medium != FIXED and known.medium == best.medium:
        alike = wp.length(known.start - best.start) < ALIKE * nodes.size
        if alike and wp.length(known.corner - best.corner) < TWO * nodes.size:
            return False
    speed = passage.speed[medium]
    straight = known.corner_time + wp.length(place - known.corner) / speed
    gain = wp.where(known.medium == FIXED, -NEGLIGIBLE, MARGIN)
    return straight < best.time + gain * nodes.size / speed


@wp.func
def route_from_nodes(
    passage: Passage, nodes: Nodes, cell: wp.vec3i, place: vector3, medium: int, straight: Route
) -> Route:
    """The first wave at a place in a cell: a straight one, or one that comes over the nodes around.

    Where a node's corner is in sight of the place, and hardly moves, its time is known to second order at once. The
    others are led on with care, the most promising first, as long as they may come earlier.
    """
    best = straight
    speed = passage.speed[medium]
    cell_time = nodes.size / speed
    last = -NEVER
    for attempt in range(28):
        promise = scalar(1.0e30)
        promising = wp.int32(-1)
        for neighbour in range(27):
            near = node_near(nodes, cell, neighbour, medium)
            if not is_present(nodes, near):
                continue
            known = nodes.route[near]
            if known.time >= NEVER or (known.direct > 0 and best.direct == 2):
                continue
            if not may_come_first(passage, nodes, known, medium, place, medium, best):
                continue
            gain = expected_gain(passage, known, nodes.place[near], place, medium)
            time = known.corner_time + wp.length(place - known.corner) / speed - gain
            if time > best.time - NEGLIGIBLE * cell_time:
                continue
            if attempt == 0 and gain < SMALL * cell_time and is_clear(passage, medium, known.corner, place):
                best = known
                best.time = time
            elif time > last and time < promise:
                promise = time
                promising = near
        if promise > best.time - SMALL * cell_time or promising < 0:
            break
        route = onward(passage, nodes.route[promising], nodes.place[promising], promising, medium, place, medium)
        if route.time < best.time:
            best = route
        last = promise
    return best


@wp.kernel(enable_backward=False)
def spread_fans(passage: Passage, nodes: Nodes, open: wp.array(dtype=int), begin: int):
    """Pull the ways of the nodes taut to which waves come around something."""
    n = open[begin + wp.tid()]
    if nodes.route[n].time < NEVER and nodes.route[n].direct == 0:
        nodes.fan[n] = taut_fan(passage, nodes.route, nodes.count, n, nodes.place[n])


@wp.func
def blend(
    passage: Passage,
    nodes: Nodes,
    place: vector3,
    medium: int,
    time: scalar,
) -> vector3:
    """What the eight nodes around a place make of the time of a wave that comes there at about `time`.

    Each node's own time is a little wrong, in its own way: differences between them would be errors of the local speed.
    So all of them say when they expect the wave, and of those that agree with `time` a mean is taken, with weights that
    are linear between the nodes.

    Returns:
        The mean, or `time` where none agrees; and the lowest and highest time of all nodes; NEVER as the highest if not
        all of them have waves that come around something.
    """
    slowness = ONE / passage.speed[medium]
    agreed = AGREED * nodes.size * slowness
    offset = wp.cw_div(place, nodes.spacing) - vector3(HALF, HALF, HALF)
    first = wp.vec3i(int(wp.floor(offset[0])), int(wp.floor(offset[1])), int(wp.floor(offset[2])))
    offset -= vector3(scalar(first[0]), scalar(first[1]), scalar(first[2]))
    first -= nodes.first
    low = NEVER
    high = -NEVER
    total = scalar(0.0)
    excess = scalar(0.0)
    for corner in range(8):
        i = corner / 4
        j = (corner / 2) % 2
        k = corner % 2
        near = node_at(nodes, first[0] + i, first[1] + j, first[2] + k, medium)
        if near < 0:  # behind a face of the domain
            continue
        if nodes.fan[near].kind == 0:
            high = NEVER
            continue
        expected = time_over(nodes.fan[near], place, slowness, GOOD * nodes.size * slowness)
        low = wp.min(low, expected)
        high = wp.max(high, expected)
        weight = wp.where(i == 1, offset[0], ONE - offset[0]) * wp.where(j == 1, offset[1], ONE - offset[1])
        weight *= wp.where(k == 1, offset[2], ONE - offset[2])
        apart = (expected - time) / agreed
        weight *= wp.max(ONE - apart * apart, ZERO) ** TWO
        total += weight
        excess += weight * (expected - time)
    mean = time
    if total > ZERO:
        mean = time + excess / total
    return vector3(mean, low, high)


@wp.func
def at_least_straight(
    nodes: Nodes, ignitions: wp.array(dtype=Ignition), place: vector3, speed: scalar, time: scalar
) -> scalar:
    """A time, but not before the straight waves: in one medium none is faster."""
    least = time
    if nodes.media == 1:
        least = wp.max(time, first_arrival(ignitions, place, speed))
    return least


@wp.func
def wave_at(
    passage: Passage,
    nodes: Nodes,
    ignitions: wp.array(dtype=Ignition),
    cell: wp.vec3i,
    place: vector3,
    medium: int,
) -> scalar:
    """When the first wave comes to a place of a medium [s]."""
    own = node_near(nodes, cell, 0, medium)
    latest = NEVER
    if is_present(nodes, own):
        if nodes.certain[own] == 2:
            return first_arrival(ignitions, place, passage.speed[medium])
        latest = nodes.route[own].time + TWO * nodes.size / passage.speed[medium]
        cell_time = nodes.size / passage.speed[medium]
        if nodes.fan[own].kind != 0:
            near = time_over(nodes.fan[own], place, ONE / passage.speed[medium], GOOD * cell_time)
            found = blend(passage, nodes, place, medium, near)
            if near < NEVER and found[2] - found[1] < ALL_AGREED * cell_time:
                return at_least_straight(nodes, ignitions, place, passage.speed[medium], found[0])
    straight = straight_route(passage, ignitions, medium, place, latest)
    if straight.direct == 2 and nodes.media == 1:
        return straight.time
    best = route_from_nodes(passage, nodes, cell, place, medium, straight)
    if best.direct > 0 or best.time >= NEVER or nodes.media > 1:
        return best.time
    time = blend(passage, nodes, place, medium, best.time)[0]
    return at_least_straight(nodes, ignitions, place, passage.speed[medium], time)


@wp.kernel(enable_backward=False)
def light_around(
    particles: Particles,
    grid: Grid,
    passage: Passage,
    nodes: Nodes,
    ignitions: wp.array(dtype=Ignition),
    medium: int,
    begin: int,
):
    """Arrival times of particles of a medium: straight from a detonator in sight, else over the routes of the nodes."""
    p = begin + wp.tid()
    place = particle_position(particles, grid, p)
    cell = wp.vec3i(
        int(particles.position[p].cell[0]) - nodes.first[0],
        int(particles.position[p].cell[1]) - nodes.first[1],
        int(particles.position[p].cell[2]) - nodes.first[2],
    )
    time = wave_at(passage, nodes, ignitions, cell, place, medium)
    particles.burn_times[p].arrival_time = wp.min(particles.burn_times[p].arrival_time, time)
    boost(particles, p, ignitions, place)


@wp.kernel(enable_backward=False)
def find_next(nodes: Nodes, open: wp.array(dtype=int), next: wp.array(dtype=scalar)):
    """The earliest time of a node not yet settled to which a wave has come."""
    n = open[wp.tid()]
    if nodes.window[n] == OPEN and nodes.route[n].time < next[0]:
        wp.atomic_min(next, 0, nodes.route[n].time)
