"""Particle -> grid and grid -> particle: paper eqs. 4-8, 12-16, for any shape function, order and transfer.

Kernels are composed for the shape and the variant asked for, once each (cached). Every particle kernel works on the
particles from `begin` on, one a thread.
"""

import functools
from enum import Enum

import warp as wp

from warp_mpm.kernels.blocks import stamp_blocks
from warp_mpm.kernels.content import lowest_cell, scatter_content
from warp_mpm.kernels.contribution import contribution_function, force_on, momentum_on, reprojected
from warp_mpm.kernels.precision import ONE, ZERO, matrix3, scalar, vector3
from warp_mpm.kernels.records import Clock, Grid, Particles, node_index
from warp_mpm.kernels.shape import Shape
from warp_mpm.kernels.stencil import (
    gather_function,
    prefetch_function,
    scatter_function,
    scatter_gradient_function,
    stencil_type,
)
from warp_mpm.kernels.vectors import at_rest_if_slow, first_three, second_three

AHEAD = wp.constant(12)  # places in memory to the particle whose nodes are asked for


@functools.cache
def lowest_node_function(shape: Shape) -> wp.Function:
    """Device function: index of the lowest node of a particle's stencil."""
    offset = shape.offset

    @wp.func
    def lowest_node(cell: wp.vec3s, fraction: vector3) -> wp.vec3i:
        return wp.vec3i(
            int(cell[0]) + offset(fraction[0]), int(cell[1]) + offset(fraction[1]), int(cell[2]) + offset(fraction[2])
        )

    return lowest_node


@functools.cache
def stencil_function(shape: Shape) -> wp.Function:
    """Device function (grid, cell, fraction, half_width) -> the particle's stencil."""
    lowest_node = lowest_node_function(shape)
    weights, slopes = shape.weights, shape.slopes
    record = stencil_type(shape.width)

    @wp.func
    def stencil_of(grid: Grid, cell: wp.vec3s, fraction: vector3, half_width: scalar) -> record:
        stencil = record()
        lowest = lowest_node(cell, fraction)
        stencil.first = node_index(grid, lowest[0], lowest[1], lowest[2])
        stencil.stride_x = grid.stride_x
        stencil.stride_y = grid.stride_y
        stencil.wx = weights(fraction[0], half_width)
        stencil.wy = weights(fraction[1], half_width)
        stencil.wz = weights(fraction[2], half_width)
        stencil.sx = slopes(fraction[0], half_width) * grid.inverse_spacing[0]
        stencil.sy = slopes(fraction[1], half_width) * grid.inverse_spacing[1]
        stencil.sz = slopes(fraction[2], half_width) * grid.inverse_spacing[2]
        return stencil

    return stencil_of


class Ahead(Enum):
    """What a pass over the particles will need of the grid."""

    START = "the start of the step"
    START_AND_REPROJECTED = "the start of the step, and the sums of the re-projection"
    END = "the velocities of the step, its damping, and what cells hold"
    SUMS = "the sums of the scatter"


@functools.cache
def look_ahead_function(shape: Shape, what: Ahead) -> wp.Function:
    """Device function (particles, grid, p): ask for the nodes of a particle some places on, before it is its turn."""
    lowest_node = lowest_node_function(shape)
    prefetch = prefetch_function(shape.width, 8)
    prefetch_four = prefetch_function(shape.width, 4)
    prefetch_two_and_spare = prefetch_function(shape.width, 2, spare=1)
    prefetch_four_and_spare = prefetch_function(shape.width, 4, spare=1)
    prefetch_cells = prefetch_function(2, 2)
    start = what in (Ahead.START, Ahead.START_AND_REPROJECTED)
    reprojected = what is Ahead.START_AND_REPROJECTED
    end, sums = what is Ahead.END, what is Ahead.SUMS

    @wp.func
    def look_ahead(particles: Particles, grid: Grid, p: int):
        position = particles.position[wp.min(p + AHEAD, particles.position.shape[0] - 1)]
        lowest = lowest_node(position.cell, position.fraction)
        first = node_index(grid, lowest[0], lowest[1], lowest[2])
        if wp.static(start):
            prefetch(grid.start, first, grid.stride_x, grid.stride_y)
        if wp.static(reprojected):
            prefetch_four_and_spare(grid.reprojected, first, grid.stride_x, grid.stride_y)
        if wp.static(end):
            prefetch(grid.end, first, grid.stride_x, grid.stride_y)
            prefetch_four(grid.damping, first, grid.stride_x, grid.stride_y)
            prefetch_cells(grid.content, first, grid.stride_x, grid.stride_y)
        if wp.static(sums):
            prefetch(grid.sums, first, grid.stride_x, grid.stride_y)
            prefetch_two_and_spare(grid.field, first, grid.stride_x, grid.stride_y)
            prefetch_cells(grid.content_sums, first, grid.stride_x, grid.stride_y)

    return look_ahead


@functools.cache
def node_offset_function(shape: Shape) -> wp.Function:
    """Device function: vector from a particle to node (i, j, k) of its stencil [m]."""
    offset = shape.offset

    @wp.func
    def node_offset(grid: Grid, fraction: vector3, i: int, j: int, k: int) -> vector3:
        first = vector3(
            scalar(offset(fraction[0])) - fraction[0],
            scalar(offset(fraction[1])) - fraction[1],
            scalar(offset(fraction[2])) - fraction[2],
        )
        return wp.cw_mul(first + vector3(scalar(i), scalar(j), scalar(k)), grid.spacing)

    return node_offset


@functools.cache
def affine_gradient_function(shape: Shape) -> wp.Function:
    """Device function: velocity gradient of APIC, C = sum (v + dt a)_i (x_i - x_p)^T w / D [1/s]."""
    width = shape.width
    affine_weights = shape.affine
    record = stencil_type(width)

    @wp.func
    def affine_gradient(grid: Grid, stencil: record, fraction: vector3, half_width: scalar, dt: scalar) -> matrix3:
        ax = affine_weights(fraction[0], half_width) * grid.inverse_spacing[0]
        ay = affine_weights(fraction[1], half_width) * grid.inverse_spacing[1]
        az = affine_weights(fraction[2], half_width) * grid.inverse_spacing[2]
        gradient = matrix3()
        for i in range(width):
            for j in range(width):
                for k in range(width):
                    node = grid.start[stencil.first + i * grid.stride_x + j * grid.stride_y + k]
                    bx = ax[i] * stencil.wy[j] * stencil.wz[k]
                    by = stencil.wx[i] * ay[j] * stencil.wz[k]
                    bz = stencil.wx[i] * stencil.wy[j] * az[k]
                    gradient += wp.outer(first_three(node) + dt * second_three(node), vector3(bx, by, bz))
        return gradient

    return affine_gradient


@functools.cache
def scatter_kernel(
    shape: Shape, momentum: bool, force: bool, affine: bool, content: bool, thin: bool = False
) -> wp.Kernel:
    """Particles -> nodes: momentum, mass and volume (`momentum`); internal force and field (`force`); and to the
    cells (`content`). The sums are those of `contribution.py`.
    """
    width = shape.width
    stencil_of = stencil_function(shape)
    node_offset = node_offset_function(shape)
    contribution = contribution_function(momentum, force)
    scatter_gradient = scatter_gradient_function(width, 8)
    scatter_field = scatter_function(width, 2)
    look_ahead = look_ahead_function(shape, Ahead.SUMS)

    @wp.kernel(enable_backward=False, module="unique")
    def scatter(
        particles: Particles,
        grid: Grid,
        clock: wp.array(dtype=Clock),
        half_width: scalar,
        ambient_pressure: scalar,
        begin: int,
    ):
        p = begin + wp.tid()
        motion = particles.motion[p]
        mass = motion.mass
        if mass == ZERO:
            return
        if wp.static(thin):
            look_ahead(particles, grid, p)
        matter = particles.matter[p]
        position = particles.position[p]
        cell = position.cell
        fraction = position.fraction
        stencil = stencil_of(grid, cell, fraction, half_width)
        stamp_blocks(grid, lowest_cell(cell, fraction), clock[0].step)
        given = contribution(motion.velocity, mass, matter, ambient_pressure)
        if wp.static(force):
            scatter_field(stencil, grid.field, given.field)
        scatter_gradient(
            stencil, grid.sums, given.value, force_on(given.force_x), force_on(given.force_y), force_on(given.force_z)
        )
        if wp.static(affine and momentum):
            for i in range(width):
                for j in range(width):
                    for k in range(width):
                        weight = mass * stencil.wx[i] * stencil.wy[j] * stencil.wz[k]
                        extra = weight * (particles.affine[p] * node_offset(grid, fraction, i, j, k))
                        node = stencil.first + i * grid.stride_x + j * grid.stride_y + k
                        wp.atomic_add(grid.sums, node, momentum_on(extra))
        if wp.static(content):
            scatter_content(grid, cell, fraction, given.content)

    return scatter


@functools.cache
def advance_kernel(shape: Shape, blend: bool, affine: bool, reproject: bool, thin: bool = False) -> wp.Kernel:
    """Nodes -> particle velocity, and for MUSL back again (`reproject`).

    FLIP: v += dt sum w a. With `blend` a share s of PIC: (1 - s)(v + dt a) + s sum w (v + dt a)_i; APIC is s = 1 and
    C = sum (v + dt a)_i (x_i - x_p)^T w / D. Re-projection: sum w m v and, for the damping, sum w m v^2 / 2.
    """
    width = shape.width
    stencil_of = stencil_function(shape)
    affine_gradient = affine_gradient_function(shape)
    node_offset = node_offset_function(shape)
    gather = gather_function(width, 8)
    scatter = scatter_function(width, 4)
    look_ahead = look_ahead_function(shape, Ahead.START_AND_REPROJECTED if reproject else Ahead.START)

    @wp.kernel(enable_backward=False, module="unique")
    def advance(
        particles: Particles,
        grid: Grid,
        clock: wp.array(dtype=Clock),
        half_width: scalar,
        pic_share: scalar,
        begin: int,
    ):
        p = begin + wp.tid()
        motion = particles.motion[p]
        mass = motion.mass
        if mass == ZERO:
            return
        if wp.static(thin):
            look_ahead(particles, grid, p)
        dt = clock[0].dt
        position = particles.position[p]
        fraction = position.fraction
        stencil = stencil_of(grid, position.cell, fraction, half_width)
        sums = gather(stencil, grid.start)
        increment = dt * second_three(sums)
        velocity = motion.velocity + increment
        if wp.static(blend):
            velocity = at_rest_if_slow((ONE - pic_share) * velocity + pic_share * (first_three(sums) + increment))
        particles.motion[p].velocity = velocity
        gradient = matrix3()
        if wp.static(affine):
            gradient = affine_gradient(grid, stencil, fraction, half_width, dt)
            particles.affine[p] = gradient
        if wp.static(reproject and affine):
            for i in range(width):
                for j in range(width):
                    for k in range(width):
                        carried = velocity + gradient * node_offset(grid, fraction, i, j, k)
                        weight = mass * stencil.wx[i] * stencil.wy[j] * stencil.wz[k]
                        node = stencil.first + i * grid.stride_x + j * grid.stride_y + k
                        wp.atomic_add(grid.reprojected, node, weight * reprojected(carried))
        if wp.static(reproject and not affine):
            scatter(stencil, grid.reprojected, mass * reprojected(velocity))

    return advance


@functools.cache
def displacement_function(shape: Shape) -> wp.Function:
    """Device function: how far a particle moves in a step, dt sum w (v + dt a)_i, in cells (paper eq. 15)."""
    stencil_of = stencil_function(shape)
    gather = gather_function(shape.width, 8)

    @wp.func
    def displacement(grid: Grid, cell: wp.vec3s, fraction: vector3, half_width: scalar, dt: scalar) -> vector3:
        sums = gather(stencil_of(grid, cell, fraction, half_width), grid.start)
        return dt * wp.cw_mul(first_three(sums) + dt * second_three(sums), grid.inverse_spacing)

    return displacement
