"""Particle -> grid and grid -> particle: paper eqs. 4-8, 12-16, for any shape function, order and transfer.

Kernels are composed for the shape and the variant asked for, once each (cached). Every particle kernel works on the
particles from `begin` on, one a thread.
"""

import functools
from enum import Enum

import warp as wp

from warp_mpm.kernels.blocks import stamp_blocks
from warp_mpm.kernels.content import lowest_cell, scatter_content
from warp_mpm.kernels.precision import HALF, ONE, ZERO, matrix3, scalar, vector2, vector3, vector4, vector8
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
    prefetch_two = prefetch_function(shape.width, 2)
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
            prefetch_four(grid.reprojected, first, grid.stride_x, grid.stride_y)
        if wp.static(end):
            prefetch(grid.end, first, grid.stride_x, grid.stride_y)
            prefetch_four(grid.damping, first, grid.stride_x, grid.stride_y)
            prefetch_cells(grid.content, first, grid.stride_x, grid.stride_y)
        if wp.static(sums):
            prefetch(grid.sums, first, grid.stride_x, grid.stride_y)
            prefetch_two(grid.field, first, grid.stride_x, grid.stride_y)
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


@wp.func
def force_on(force: vector3) -> vector8:
    """A force in the lanes of a node."""
    return vector8(ZERO, ZERO, ZERO, ZERO, force[0], force[1], force[2], ZERO)


@functools.cache
def scatter_kernel(
    shape: Shape, momentum: bool, force: bool, affine: bool, content: bool, thin: bool = False
) -> wp.Kernel:
    """Particles -> nodes: momentum, mass and volume (`momentum`); internal force and field pressure (`force`).

    sum w m, sum w m v (APIC: v + C (x_i - x_p)), sum w V; f = sum V (p + q - p_ambient + s s^T) grad w, q and s s^T
    the isotropic and the directed part of the artificial viscosity, sum w V p, sum w m c^2; and to the
    cells sum L V p, sum L V (`content`).
    """
    width = shape.width
    stencil_of = stencil_function(shape)
    node_offset = node_offset_function(shape)
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
        volume = mass / matter.density
        pressure_volume = matter.pressure * volume
        scattered = vector8()
        force_x = vector3()  # V sigma, column by column
        force_y = vector3()
        force_z = vector3()
        if wp.static(momentum):
            carried = mass * motion.velocity
            scattered = vector8(carried[0], carried[1], carried[2], mass, ZERO, ZERO, ZERO, volume)
        if wp.static(force):
            push = pressure_volume + (matter.viscous_pressure - ambient_pressure) * volume
            thrust = matter.viscous_thrust
            directed = volume * thrust
            force_x = directed[0] * thrust + vector3(push, ZERO, ZERO)
            force_y = directed[1] * thrust + vector3(ZERO, push, ZERO)
            force_z = directed[2] * thrust + vector3(ZERO, ZERO, push)
            elasticity = mass * matter.sound_speed * matter.sound_speed
            scatter_field(stencil, grid.field, vector2(pressure_volume, elasticity))
        scatter_gradient(stencil, grid.sums, scattered, force_on(force_x), force_on(force_y), force_on(force_z))
        if wp.static(affine and momentum):
            for i in range(width):
                for j in range(width):
                    for k in range(width):
                        weight = mass * stencil.wx[i] * stencil.wy[j] * stencil.wz[k]
                        extra = weight * (particles.affine[p] * node_offset(grid, fraction, i, j, k))
                        node = stencil.first + i * grid.stride_x + j * grid.stride_y + k
                        wp.atomic_add(
                            grid.sums,
                            node,
                            vector8(extra[0], extra[1], extra[2], ZERO, ZERO, ZERO, ZERO, ZERO),
                        )
        if wp.static(content):
            scatter_content(grid, cell, fraction, matter.pressure, volume)

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
                        value = vector4(carried[0], carried[1], carried[2], HALF * wp.dot(carried, carried))
                        node = stencil.first + i * grid.stride_x + j * grid.stride_y + k
                        wp.atomic_add(grid.reprojected, node, weight * value)
        if wp.static(reproject and not affine):
            kinetic = HALF * wp.dot(velocity, velocity)
            scatter(stencil, grid.reprojected, mass * vector4(velocity[0], velocity[1], velocity[2], kinetic))

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
