"""The re-projection's part of the step: what the grid sees of the particles' new velocities.

The blocks are those of the scatter at the end of the step before, whose sums are emptied here for the next one.
"""

import functools

import warp as wp

from warp_mpm.kernels.inside import solve_reprojected_inside_function
from warp_mpm.kernels.node_pass import Phase, damped_share, node_kernel, prefetch_eight, prefetch_four, prefetch_two
from warp_mpm.kernels.node_rows import nodes_at_a_time
from warp_mpm.kernels.precision import HALF, ONE, TWO, ZERO, scalar, vector2, vector4, vector8
from warp_mpm.kernels.records import Clock, Grid, node_index
from warp_mpm.kernels.sharpen import excess_function, mass_at_start, twice, velocities_of
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
)


@wp.func
def empty(grid: Grid, n: int):
    """Empty what particles scatter to at the end of a step."""
    grid.sums[n] = vector8()
    grid.field[n] = vector2()


@wp.func
def look_ahead(grid: Grid, n: int):
    """Ask for a row of what is read and written."""
    prefetch_eight(grid.start, n)
    prefetch_four(grid.reprojected, n)
    prefetch_two(grid.field, n)
    prefetch_eight(grid.end, n)
    prefetch_four(grid.damping, n)
    prefetch_eight(grid.sums, n)


@wp.func
def look_beside(grid: Grid, n: int):
    """Ask for a row of what is read of neighbours."""
    prefetch_eight(grid.start, n)
    prefetch_four(grid.reprojected, n)


@wp.func
def clear_node(grid: Grid, boundary: Boundary, now: Clock, phase: Phase, slot: int, index: wp.vec3i):
    """Empty a node."""
    empty(grid, node_index(grid, index[0], index[1], index[2]))


@wp.func
def clear_one(grid: Grid, boundary: Boundary, now: Clock, phase: Phase, slot: int, n: int):
    """Empty a node."""
    empty(grid, n)


@wp.func
def clear_row(grid: Grid, boundary: Boundary, now: Clock, phase: Phase, slot: int, n: int):
    """Empty a row of nodes."""
    for k in range(nodes_at_a_time()):
        empty(grid, n + k)


def clear_kernel() -> wp.Kernel:
    """Empty the sums of the last scatter, one step ago: where nothing is re-projected, which does that besides."""
    return node_kernel(clear_node, clear_row, clear_one, 1)


@functools.cache
def solve_reprojected_kernel(sharpened: bool, damped: bool) -> wp.Kernel:
    """Re-projected sums -> velocity v_r; if `damped` alpha v_r, heat H = alpha (sum w m v^2 / M - |v_r|^2) >= 0, alpha.

    And the two velocities of the step, sharpened if asked for: v^n + dt a, which moves the particles, and the mean
    (v^n + v_r) / 2, which does the work.
    """
    excess = excess_function(velocities_of, mass_at_start)
    solve_row = solve_reprojected_inside_function(sharpened, damped)
    solve_one = solve_reprojected_inside_function(sharpened, damped, plain=True)

    @wp.func
    def damping_of(start: vector8, total: vector4, alpha: scalar) -> vector4:
        velocity = start[7] * first_three(total)
        if wp.static(not damped):
            return vector4(velocity[0], velocity[1], velocity[2], ZERO)
        heat = alpha * wp.max(TWO * total[3] * start[7] - wp.dot(velocity, velocity), ZERO)
        return vector4(alpha * velocity[0], alpha * velocity[1], alpha * velocity[2], heat)

    @wp.func
    def both_velocities(start: vector8, total: vector4, dt: scalar, alpha: scalar) -> vector8:
        v = first_three(start)
        moving = v + dt * second_three(start)
        mean = HALF * (v + start[7] * first_three(total))
        return vector8(moving[0], moving[1], moving[2], start[3], mean[0], mean[1], mean[2], alpha)

    @wp.func
    def visit(grid: Grid, boundary: Boundary, now: Clock, phase: Phase, slot: int, index: wp.vec3i):
        n = node_index(grid, index[0], index[1], index[2])
        if is_owner(boundary, grid.cells, index):
            start = grid.start[n]
            total = grid.reprojected[n]
            alpha = damped_share(now, grid.field[n][1])
            values = both_velocities(start, total, now.dt, alpha)
            if wp.static(sharpened) and start[7] > ZERO:
                free = twice(free_components(boundary, grid.cells, index))
                values += wp.cw_mul(free, excess(grid, boundary, index, now.dt)) * (phase.strength * start[7])
            what = damping_of(start, total, alpha)
            owned = ghost_sides(boundary, grid.cells, index)
            for i in range(image_count(owned[0])):
                for j in range(image_count(owned[1])):
                    for k in range(image_count(owned[2])):
                        sides = image_sides(owned, i, j, k)
                        m = image_node(grid, index, sides)
                        s = image_signs(boundary, sides)
                        grid.end[m] = wp.cw_mul(twice(s), values)
                        grid.damping[m] = wp.cw_mul(vector4(s[0], s[1], s[2], ONE), what)
        empty(grid, n)

    @wp.func
    def visit_row(grid: Grid, boundary: Boundary, now: Clock, phase: Phase, slot: int, n: int):
        solve_row(grid, now.dt, now.damping, phase.strength, n)

    @wp.func
    def visit_one(grid: Grid, boundary: Boundary, now: Clock, phase: Phase, slot: int, n: int):
        solve_one(grid, now.dt, now.damping, phase.strength, n)

    return node_kernel(visit, visit_row, visit_one, 1, look_ahead, look_beside)
