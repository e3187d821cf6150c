"""Fold: what was scattered behind walls is added to the nodes in front of them, before any node is solved.

After it a node has all that belongs to it, and of what a wall holds at its own nodes nothing is left. Ghosts keep what
was scattered to them: by their masses the walls' forces are told.
"""

import functools

import warp as wp

from warp_mpm.kernels.node_pass import Phase, damped_share, inverse_mass, node_kernel
from warp_mpm.kernels.precision import ONE, ZERO, scalar, vector3, vector4, vector8
from warp_mpm.kernels.records import Clock, Grid, node_index
from warp_mpm.kernels.vectors import first_three, second_three
from warp_mpm.kernels.walls import (
    Boundary,
    free_components,
    ghost_sides,
    holds_any,
    image_count,
    image_node,
    image_sides,
    image_signs,
    is_owner,
    meets_wall,
    tally_reaction,
)


@wp.func
def tally_walls(
    grid: Grid,
    boundary: Boundary,
    index: wp.vec3i,
    owned: wp.vec3i,
    free: vector3,
    force: bool,
    total_mass: scalar,
    share: scalar,
    value: vector3,
    reactions: wp.array(dtype=wp.float64),
    slot: int,
):
    """Tally what walls add to a node and its ghosts: of the forces, or of a share of the momenta.

    `total_mass` is that of the node and its ghosts, whose whole weight counts at the node.
    """
    held = holds_any(free)
    for i in range(image_count(owned[0])):
        for j in range(image_count(owned[1])):
            for k in range(image_count(owned[2])):
                if held or i + j + k > 0:
                    sides = image_sides(owned, i, j, k)
                    x = grid.sums[image_node(grid, index, sides)]
                    scattered = share * first_three(x)
                    body = vector3()
                    if force:
                        scattered = second_three(x)
                        if i + j + k == 0:
                            body = total_mass * boundary.gravity
                    returned = share * x[3] * value
                    tally_reaction(boundary, grid, index, sides, free, scattered, body, returned, reactions, slot)


@functools.cache
def fold_kernel(momentum: bool, force: bool) -> wp.Kernel:
    """Fold momentum, mass and volume (`momentum`); force and the sums of the field (`force`).

    Tallies what walls add: `reactions` to forces [N], `impulses` to momenta [kg m/s], the latter for PIC and APIC,
    whose particles take the nodes' velocity over with a share of `pic_share`.
    """
    of_momentum = ONE if momentum else ZERO
    of_force = ONE if force else ZERO

    @wp.func
    def fold(grid: Grid, boundary: Boundary, now: Clock, phase: Phase, slot: int, index: wp.vec3i):
        if not meets_wall(boundary, grid.cells, index) or not is_owner(boundary, grid.cells, index):
            return
        n = node_index(grid, index[0], index[1], index[2])
        owned = ghost_sides(boundary, grid.cells, index)
        free = free_components(boundary, grid.cells, index)
        total = grid.sums[n]
        field = grid.field[n]
        for i in range(image_count(owned[0])):
            for j in range(image_count(owned[1])):
                for k in range(image_count(owned[2])):
                    if i + j + k > 0:
                        sides = image_sides(owned, i, j, k)
                        m = image_node(grid, index, sides)
                        x = grid.sums[m]
                        signs = image_signs(boundary, sides)
                        carried = of_momentum * wp.cw_mul(signs, first_three(x))
                        pushed = of_force * wp.cw_mul(signs, second_three(x))
                        mass = of_momentum * x[3]
                        volume = of_momentum * x[7]
                        total += vector8(
                            carried[0], carried[1], carried[2], mass, pushed[0], pushed[1], pushed[2], volume
                        )
                        if wp.static(force):
                            field += grid.field[m]
        mass = total[3]
        inverse = inverse_mass(grid, mass)
        momentum_left = wp.cw_mul(free, first_three(total))
        force_left = wp.cw_mul(free, second_three(total))
        if wp.static(force):
            acceleration = vector3()
            if inverse > ZERO:
                acceleration = inverse * force_left + wp.cw_mul(free, boundary.gravity)
            tally_walls(grid, boundary, index, owned, free, True, mass, ONE, acceleration, phase.reactions, slot)
        if wp.static(momentum) and phase.pic_share > ZERO:
            velocity = inverse * momentum_left
            tally_walls(
                grid, boundary, index, owned, free, False, mass, phase.pic_share, velocity, phase.impulses, slot
            )
        grid.sums[n] = vector8(
            momentum_left[0],
            momentum_left[1],
            momentum_left[2],
            mass,
            force_left[0],
            force_left[1],
            force_left[2],
            total[7],
        )
        if wp.static(force):
            grid.field[n] = field

    return node_kernel(fold, None, None, 0)


@functools.cache
def fold_reprojected_kernel() -> wp.Kernel:
    """Fold the re-projected momentum and kinetic energy; tallies what walls add to the damping, in `impulses`."""

    @wp.func
    def fold(grid: Grid, boundary: Boundary, now: Clock, phase: Phase, slot: int, index: wp.vec3i):
        if not meets_wall(boundary, grid.cells, index) or not is_owner(boundary, grid.cells, index):
            return
        n = node_index(grid, index[0], index[1], index[2])
        owned = ghost_sides(boundary, grid.cells, index)
        total = vector4()
        for i in range(image_count(owned[0])):
            for j in range(image_count(owned[1])):
                for k in range(image_count(owned[2])):
                    sides = image_sides(owned, i, j, k)
                    s = image_signs(boundary, sides)
                    x = grid.reprojected[image_node(grid, index, sides)]
                    total += vector4(s[0] * x[0], s[1] * x[1], s[2] * x[2], x[3])
        free = free_components(boundary, grid.cells, index)
        held = holds_any(free)
        momentum = wp.cw_mul(free, first_three(total))
        velocity = inverse_mass(grid, grid.sums[n][3]) * momentum
        alpha = damped_share(now, grid.field[n][1])
        for i in range(image_count(owned[0])):
            for j in range(image_count(owned[1])):
                for k in range(image_count(owned[2])):
                    if held or i + j + k > 0:
                        sides = image_sides(owned, i, j, k)
                        m = image_node(grid, index, sides)
                        given = alpha * first_three(grid.reprojected[m])
                        returned = alpha * grid.sums[m][3] * velocity
                        tally_reaction(
                            boundary, grid, index, sides, free, given, vector3(), returned, phase.impulses, slot
                        )
        grid.reprojected[n] = vector4(momentum[0], momentum[1], momentum[2], total[3])

    return node_kernel(fold, None, None, 1)
