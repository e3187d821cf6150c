"""Sharpening: the smoothing of the transfer is taken back, to second order in the cell size, on the grid alone.

What goes from particles to nodes or back is smoothed by the shape function, whose second moment is s^2 cells^2 per axis
(1/4 for the quadratic B-spline): a wave of wave number k is weakened by 1 - s^2 k^2 h^2 / 2, so that a smeared front is
wider and lower than it need be. Nodal accelerations a, the velocities w that do the work, and those that move the
particles and change their volumes, are therefore replaced by

    x_i + s^2 / 2 sum over the neighbours j along the axes of min(M_i, M_j) / M_i (x_i - x_j),

which strengthens such a wave by as much. Momentum, sum M_i x_i, is conserved: the shares of a pair are equal and
opposite; their weight keeps them bounded where nodes are light. Energy is conserved, because the same symmetric
operator acts on both: sum f'_i . w_i = sum f_i . w'_i. (Inverting the full mass matrix approximately serves the same
end: Nairn and Hammerquist 2021, Material point method simulations using an approximate full mass matrix inverse.)

A node on a wall stands for its mirror image too: seen along the wall's normal it has twice its mass.
"""

import functools

import warp as wp

from warp_mpm.kernels.node_pass import Phase, node_kernel
from warp_mpm.kernels.precision import ONE, TWO, ZERO, scalar, vector3, vector8
from warp_mpm.kernels.records import Clock, Grid, node_index
from warp_mpm.kernels.vectors import multiply_add8, second_three
from warp_mpm.kernels.walls import (
    WALL_OPEN,
    Boundary,
    free_components,
    ghost_sides,
    image_count,
    image_node,
    image_sides,
    image_signs,
    is_owner,
    tally_reaction,
    wall_on,
)


@wp.func
def mass_along(grid: Grid, boundary: Boundary, index: wp.vec3i, axis: int) -> scalar:
    """Mass of a node as its neighbours along an axis see it [kg]: on a wall with that of the mirror image."""
    mass = grid.node[node_index(grid, index[0], index[1], index[2])][3]
    return wp.where(wall_on(boundary, grid.cells, axis, index[axis]) == WALL_OPEN, mass, TWO * mass)


@wp.func
def neighbour(grid: Grid, boundary: Boundary, index: wp.vec3i, axis: int, side: int) -> wp.vec3i:
    """The next node along an axis, side -1 or 1; the node itself where there is none but its mirror image."""
    other = wp.vec3i(index[0], index[1], index[2])
    at = index[axis] + side
    low = wp.where(boundary.wall[2 * axis] == WALL_OPEN, -1, 0)
    high = wp.where(boundary.wall[2 * axis + 1] == WALL_OPEN, grid.cells[axis] + 1, grid.cells[axis])
    if at >= low and at <= high:
        other[axis] = at
    return other


@wp.func
def node_values(grid: Grid, n: int) -> vector8:
    """Mass and acceleration of a node, among its lanes."""
    return grid.node[n]


@wp.func
def step_velocities(grid: Grid, n: int) -> vector8:
    """Mass of a node and its velocities that move the particles and do the work; nothing where no particle is."""
    return grid.kick[n]


@wp.func
def pull(total: vector8, values: vector8, other: vector8) -> vector8:
    """Total + min(M_i, M_j) (x_i - x_j), the masses in lane 3."""
    # (wp.min would look for NaN first, six times a node.)
    return multiply_add8(total, wp.where(values[3] < other[3], values[3], other[3]), values - other)


@functools.cache
def excess_functions(values_of: wp.Function) -> tuple[wp.Function, wp.Function]:
    """Device functions: sum of min(M_i, M_j) (x_i - x_j) over a node's neighbours, x from `values_of`.

    The first takes any node's index (i, j, k), the second the flat one of a node that has no face near.
    """

    @wp.func
    def excess(grid: Grid, boundary: Boundary, index: wp.vec3i) -> vector8:
        values = values_of(grid, node_index(grid, index[0], index[1], index[2]))
        total = vector8()
        for axis in range(3):
            mass = mass_along(grid, boundary, index, axis)
            for side in range(-1, 2, 2):
                other = neighbour(grid, boundary, index, axis, side)
                link = wp.min(mass, mass_along(grid, boundary, other, axis))
                difference = values - values_of(grid, node_index(grid, other[0], other[1], other[2]))
                total = multiply_add8(total, link, difference)
        return total

    @wp.func
    def excess_inside(grid: Grid, n: int) -> vector8:
        values = values_of(grid, n)
        total = pull(vector8(), values, values_of(grid, n - grid.stride_x))
        total = pull(total, values, values_of(grid, n + grid.stride_x))
        total = pull(total, values, values_of(grid, n - grid.stride_y))
        total = pull(total, values, values_of(grid, n + grid.stride_y))
        total = pull(total, values, values_of(grid, n - 1))
        return pull(total, values, values_of(grid, n + 1))

    return excess, excess_inside


@wp.func
def twice(signs: vector3) -> vector8:
    """The signs of a vector's components, for both vectors in a node's lanes."""
    return vector8(signs[0], signs[1], signs[2], ONE, signs[0], signs[1], signs[2], ONE)


@functools.cache
def sharpen_acceleration_kernel() -> wp.Kernel:
    """Accelerations -> sharpened ones, in `kick`; what walls do to the change is tallied in `reactions` [N]."""
    excess, excess_inside = excess_functions(node_values)

    @wp.func
    def visit(grid: Grid, boundary: Boundary, now: Clock, phase: Phase, slot: int, index: wp.vec3i):
        node = grid.node[node_index(grid, index[0], index[1], index[2])]
        value = vector3(node[4], node[5], node[6])
        force = vector3()
        added = vector3()
        free = free_components(boundary, grid.cells, index)
        if node[3] == ZERO or not is_owner(boundary, grid.cells, index):
            return
        if node[3] > grid.light_mass:
            force = phase.strength * second_three(excess(grid, boundary, index))
            added = wp.cw_mul(free, force) / node[3]
        value = value + added
        owned = ghost_sides(boundary, grid.cells, index)
        near_wall = owned[0] + owned[1] + owned[2] > 0 or free[0] * free[1] * free[2] == ZERO
        for i in range(image_count(owned[0])):
            for j in range(image_count(owned[1])):
                for k in range(image_count(owned[2])):
                    sides = image_sides(owned, i, j, k)
                    m = image_node(grid, index, sides)
                    if near_wall:
                        given = wp.where(i + j + k == 0, force, vector3())
                        returned = grid.node[m][3] * added
                        tally_reaction(boundary, grid, index, sides, given, vector3(), returned, phase.reactions, slot)
                    v = wp.cw_mul(image_signs(boundary, sides), value)
                    grid.kick[m] = vector8(ZERO, ZERO, ZERO, ZERO, v[0], v[1], v[2], ZERO)

    @wp.func
    def visit_inside(grid: Grid, boundary: Boundary, now: Clock, phase: Phase, slot: int, n: int):
        node = grid.node[n]
        if node[3] == ZERO:
            return
        if node[3] > grid.light_mass:
            node = multiply_add8(node, phase.strength / node[3], excess_inside(grid, n))
        grid.kick[n] = node

    return node_kernel(visit, visit_inside, 1)


@functools.cache
def sharpen_velocity_kernel() -> wp.Kernel:
    """Velocities that move the particles and do the work, in `kick` -> sharpened ones, in the nodes."""
    excess, excess_inside = excess_functions(step_velocities)

    @wp.func
    def visit(grid: Grid, boundary: Boundary, now: Clock, phase: Phase, slot: int, index: wp.vec3i):
        n = node_index(grid, index[0], index[1], index[2])
        mass = grid.node[n][3]
        if mass == ZERO or not is_owner(boundary, grid.cells, index):
            return
        values = grid.kick[n]
        alpha = values[7]
        if mass > grid.light_mass:
            free = twice(free_components(boundary, grid.cells, index))
            values += wp.cw_mul(free, excess(grid, boundary, index)) * (phase.strength / mass)
        owned = ghost_sides(boundary, grid.cells, index)
        for i in range(image_count(owned[0])):
            for j in range(image_count(owned[1])):
                for k in range(image_count(owned[2])):
                    sides = image_sides(owned, i, j, k)
                    m = image_node(grid, index, sides)
                    v = wp.cw_mul(twice(image_signs(boundary, sides)), values)
                    grid.node[m] = vector8(v[0], v[1], v[2], grid.node[m][3], v[4], v[5], v[6], alpha)

    @wp.func
    def visit_inside(grid: Grid, boundary: Boundary, now: Clock, phase: Phase, slot: int, n: int):
        values = grid.kick[n]
        if values[3] == ZERO:
            return
        if values[3] > grid.light_mass:
            excess_here = excess_inside(grid, n)
            excess_here[3] = ZERO  # mass, which others read, and alpha stay
            excess_here[7] = ZERO
            values = multiply_add8(values, phase.strength / values[3], excess_here)
        grid.node[n] = values

    return node_kernel(visit, visit_inside, 1)
