"""The grid's part of the step: sums of the scatter into velocity, acceleration and field pressure (paper eq. 9).

One thread owns a node and its ghosts behind walls (see `walls.py`), so nothing is written twice and the order of the
sums is fixed. What lay behind walls has been folded back before (`fold.py`).
"""

import functools

import warp as wp

from warp_mpm.kernels.content import inside, solve_cell, stands_for_itself
from warp_mpm.kernels.inside import solve_inside_function
from warp_mpm.kernels.node_pass import (
    Phase,
    inverse_mass,
    node_kernel,
    prefetch_eight,
    prefetch_four,
    prefetch_two,
)
from warp_mpm.kernels.precision import HALF, ONE, ZERO, scalar, vector2, vector3, vector4, vector8
from warp_mpm.kernels.records import Clock, Grid, index_of_node, node_index, raise_maximum
from warp_mpm.kernels.sharpen import acceleration_of, excess_function, scattered_mass, tally_sharpening, twice
from warp_mpm.kernels.vectors import first_three, second_three
from warp_mpm.kernels.walls import (
    Boundary,
    free_components,
    ghost_sides,
    image_count,
    image_node,
    image_sides,
    image_signs,
    is_owner,
    meets_wall,
    node_volume,
)


@wp.func
def beyond_face(grid: Grid, index: wp.vec3i) -> bool:
    """Whether a node lies outside the domain."""
    beyond = False
    for axis in range(3):
        if index[axis] < 0 or index[axis] > grid.cells[axis]:
            beyond = True
    return beyond


@wp.func
def occupied_volume(grid: Grid, index: wp.vec3i, filling: scalar) -> scalar:
    """Volume that a node's content is related to [m3].

    Inside the material it is that of the particles, so that the field is a mean of what they have, however they lie; at
    a free surface it is the node's own, so that the field fades towards the vacuum.
    """
    share = inside(filling)
    return node_volume(grid, index) * (share * filling + ONE - share)


@wp.func
def look_ahead(grid: Grid, n: int):
    """Ask for a row of what is read and written."""
    prefetch_eight(grid.sums, n)
    prefetch_eight(grid.start, n)
    prefetch_four(grid.reprojected, n)
    prefetch_two(grid.field, n)
    prefetch_two(grid.content, n)
    prefetch_two(grid.content_sums, n)


@wp.func
def look_beside(grid: Grid, n: int):
    """Ask for a row of what is read of neighbours."""
    prefetch_eight(grid.sums, n)


@functools.cache
def solve_kernel(force: bool, cells: bool, sharpened: bool, reprojects: bool) -> wp.Kernel:
    """Sums of the scatter -> the start of a step: v = P / M, a = f / M + g, sharpened if asked for; the field pressure,
    sum w V p over the occupied volume, and the sound speed, c^2 = sum w m c^2 / M. The sums stay, for a step.

    Without `force` (USF, whose forces come later) accelerations and fields are left out. `cells` solves their content.
    What is to be `reprojected` is emptied. Tallies what walls do to the sharpening. The highest pressure of nodes at
    least half filled inside the domain goes to `peaks`.
    """
    excess = excess_function(acceleration_of, scattered_mass)
    solve_row = solve_inside_function(force, cells, sharpened, reprojects)
    solve_one = solve_inside_function(force, cells, sharpened, reprojects, plain=True)

    @wp.func
    def field_at(grid: Grid, phase: Phase, slot: int, index: wp.vec3i, sums: vector8, inverse: scalar) -> vector2:
        field = grid.field[node_index(grid, index[0], index[1], index[2])]
        filling = sums[7] / node_volume(grid, index)
        pressure = ZERO
        if inverse > ZERO:
            pressure = field[0] / occupied_volume(grid, index, filling)
            if not beyond_face(grid, index):
                if filling >= HALF:
                    raise_maximum(phase.peaks, slot, pressure)
            elif filling > ZERO:
                pressure = field[0] / (node_volume(grid, index) * filling)
        return vector2(pressure, wp.sqrt(field[1] * inverse))

    @wp.func
    def solve_node(grid: Grid, boundary: Boundary, phase: Phase, slot: int, index: wp.vec3i):
        n = node_index(grid, index[0], index[1], index[2])
        sums = grid.sums[n]
        inverse = inverse_mass(grid, sums[3])
        v = inverse * first_three(sums)
        a = vector3()
        owned = ghost_sides(boundary, grid.cells, index)
        if wp.static(force):
            a = second_three(acceleration_of(grid, boundary, n, ZERO))
            grid.field[n] = field_at(grid, phase, slot, index, sums, inverse)
        if wp.static(force and sharpened) and inverse > ZERO:
            pulled = phase.strength * second_three(excess(grid, boundary, index, ZERO))
            free = free_components(boundary, grid.cells, index)
            added = inverse * wp.cw_mul(free, pulled)
            if meets_wall(boundary, grid.cells, index):
                tally_sharpening(grid, boundary, phase, slot, index, owned, free, pulled, added)
            a += added
        for i in range(image_count(owned[0])):
            for j in range(image_count(owned[1])):
                for k in range(image_count(owned[2])):
                    sides = image_sides(owned, i, j, k)
                    s = image_signs(boundary, sides)
                    values = vector8(v[0], v[1], v[2], sums[3], a[0], a[1], a[2], inverse)
                    grid.start[image_node(grid, index, sides)] = wp.cw_mul(twice(s), values)

    @wp.func
    def visit(grid: Grid, boundary: Boundary, now: Clock, phase: Phase, slot: int, index: wp.vec3i):
        if is_owner(boundary, grid.cells, index):
            solve_node(grid, boundary, phase, slot, index)
        if wp.static(cells) and stands_for_itself(boundary, grid.cells, index):
            solve_cell(grid, boundary, index)
        if wp.static(reprojects):
            grid.reprojected[node_index(grid, index[0], index[1], index[2])] = vector4()

    @wp.func
    def visit_row(grid: Grid, boundary: Boundary, now: Clock, phase: Phase, slot: int, n: int):
        raise_maximum(phase.peaks, slot, solve_row(grid, boundary.gravity, phase.strength, n))

    @wp.func
    def visit_one(grid: Grid, boundary: Boundary, now: Clock, phase: Phase, slot: int, n: int):
        raise_maximum(phase.peaks, slot, solve_one(grid, boundary.gravity, phase.strength, n))

    @wp.func
    def forget(grid: Grid, boundary: Boundary, index: wp.vec3i):
        """A node that no particle reaches any more: neighbours may still look at it, a wall's fold at a ghost.

        A ghost's start is its owner's, who may write it at the same time; nobody reads it before.
        """
        n = node_index(grid, index[0], index[1], index[2])
        if is_owner(boundary, grid.cells, index):
            grid.start[n] = vector8()
        if wp.static(reprojects):
            grid.reprojected[n] = vector4()

    return node_kernel(visit, visit_row, visit_one, 0, look_ahead, look_beside, forget)


@wp.func
def filling_of(grid: Grid, n: int) -> scalar:
    """Filling of a node by its flat index: its particles' volume over its own."""
    return grid.sums[n][7] / node_volume(grid, index_of_node(grid, n))


@wp.func
def node_density(grid: Grid, index: wp.vec3i) -> scalar:
    """Density at a node of the domain [kg/m3]: mass over the occupied volume, as the field pressure."""
    sums = grid.sums[node_index(grid, index[0], index[1], index[2])]
    return sums[3] / occupied_volume(grid, index, sums[7] / node_volume(grid, index))


@wp.func
def node_velocity(grid: Grid, index: wp.vec3i) -> vector3:
    """Velocity at a node of the domain [m/s], 0 at empty ones."""
    sums = grid.sums[node_index(grid, index[0], index[1], index[2])]
    return inverse_mass(grid, sums[3]) * first_three(sums)


@wp.kernel(enable_backward=False)
def measure_density(grid: Grid, density: wp.array3d(dtype=scalar)):
    """Density at the nodes of the domain [kg/m3]."""
    i, j, k = wp.tid()
    density[i, j, k] = node_density(grid, wp.vec3i(i, j, k))


@wp.kernel(enable_backward=False)
def measure_velocity(grid: Grid, velocity: wp.array3d(dtype=vector3)):
    """Velocity at the nodes of the domain [m/s]."""
    i, j, k = wp.tid()
    velocity[i, j, k] = node_velocity(grid, wp.vec3i(i, j, k))
