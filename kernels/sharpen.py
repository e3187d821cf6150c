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

The sums over neighbours are taken where nodes are solved (`grid.py`, `reproject.py`): here for any node, with walls, by
its index; in `inside.py` for those that have no face near.
"""

import functools

import warp as wp

from warp_mpm.kernels.node_pass import Phase, inverse_mass
from warp_mpm.kernels.precision import HALF, ONE, TWO, ZERO, scalar, vector3, vector8
from warp_mpm.kernels.records import Grid, index_of_node, node_index
from warp_mpm.kernels.vectors import first_three, multiply_add8, second_three
from warp_mpm.kernels.walls import (
    WALL_OPEN,
    Boundary,
    free_components,
    holds_any,
    image_count,
    image_node,
    image_sides,
    tally_reaction,
    wall_on,
)


@wp.func
def scattered_mass(grid: Grid, n: int) -> scalar:
    """Mass of a node [kg], by its flat index."""
    return grid.sums[n][3]


@wp.func
def mass_at_start(grid: Grid, n: int) -> scalar:
    """The same, once the sums of the scatter are being emptied."""
    return grid.start[n][3]


@wp.func
def acceleration_of(grid: Grid, boundary: Boundary, n: int, dt: scalar) -> vector8:
    """Acceleration of a node, from its sums, in lanes 4 to 6; nothing else, and nothing where it counts as empty."""
    sums = grid.sums[n]
    inverse = inverse_mass(grid, sums[3])
    a = inverse * second_three(sums)
    if inverse > ZERO and wp.dot(boundary.gravity, boundary.gravity) > ZERO:
        a += wp.cw_mul(free_components(boundary, grid.cells, index_of_node(grid, n)), boundary.gravity)
    return vector8(ZERO, ZERO, ZERO, ZERO, a[0], a[1], a[2], ZERO)


@wp.func
def velocities_of(grid: Grid, boundary: Boundary, n: int, dt: scalar) -> vector8:
    """Velocities of a node that move the particles, lanes 0 to 2, and do the work, lanes 4 to 6; nothing else."""
    start = grid.start[n]
    v = first_three(start)
    moving = v + dt * second_three(start)
    work = HALF * (v + start[7] * first_three(grid.reprojected[n]))
    return vector8(moving[0], moving[1], moving[2], ZERO, work[0], work[1], work[2], ZERO)


@wp.func
def exists(grid: Grid, boundary: Boundary, axis: int, at: int) -> bool:
    """Whether there are nodes at a place along an axis that are no mirror images."""
    low = wp.where(boundary.wall[2 * axis] == WALL_OPEN, -1, 0)
    high = wp.where(boundary.wall[2 * axis + 1] == WALL_OPEN, grid.cells[axis] + 1, grid.cells[axis])
    return at >= low and at <= high


@wp.func
def weight_at(grid: Grid, boundary: Boundary, axis: int, at: int) -> scalar:
    """By how much a node's mass counts along an axis: on a wall twice, with that of its mirror image."""
    return wp.where(wall_on(boundary, grid.cells, axis, at) == WALL_OPEN, ONE, TWO)


@functools.cache
def excess_function(value_of: wp.Function, mass_of: wp.Function) -> wp.Function:
    """Device function: sum of min(M_i, M_j) (x_i - x_j) over the neighbours of any node.

    x is value_of(grid, boundary, n, dt), M is mass_of(grid, n), n a node's flat index.
    """

    @wp.func
    def excess(grid: Grid, boundary: Boundary, index: wp.vec3i, dt: scalar) -> vector8:
        n = node_index(grid, index[0], index[1], index[2])
        value = value_of(grid, boundary, n, dt)
        mass = mass_of(grid, n)
        strides = wp.vec3i(grid.stride_x, grid.stride_y, 1)
        total = vector8()
        for axis in range(3):
            own = weight_at(grid, boundary, axis, index[axis]) * mass
            for side in range(-1, 2, 2):
                at = index[axis] + side
                if exists(grid, boundary, axis, at):
                    m = n + side * strides[axis]
                    link = wp.min(own, weight_at(grid, boundary, axis, at) * mass_of(grid, m))
                    total = multiply_add8(total, link, value - value_of(grid, boundary, m, dt))
        return total

    return excess


@wp.func
def twice(signs: vector3) -> vector8:
    """The signs of a vector's components, for both vectors in a node's lanes."""
    return vector8(signs[0], signs[1], signs[2], ONE, signs[0], signs[1], signs[2], ONE)


@wp.func
def tally_sharpening(
    grid: Grid,
    boundary: Boundary,
    phase: Phase,
    slot: int,
    index: wp.vec3i,
    owned: wp.vec3i,
    free: vector3,
    force: vector3,
    added: vector3,
):
    """Tally what walls do to the change of a node's acceleration, `added` by a `force`, in `reactions` [N]."""
    held = holds_any(free)
    for i in range(image_count(owned[0])):
        for j in range(image_count(owned[1])):
            for k in range(image_count(owned[2])):
                if held or i + j + k > 0:
                    sides = image_sides(owned, i, j, k)
                    given = wp.where(i + j + k == 0, force, vector3())
                    returned = grid.sums[image_node(grid, index, sides)][3] * added
                    tally_reaction(
                        boundary, grid, index, sides, free, given, vector3(), returned, phase.reactions, slot
                    )
