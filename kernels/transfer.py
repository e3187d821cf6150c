"""Particle -> grid and grid -> particle: paper eqs. 4-8, 12-16, for any shape function, order and transfer.

Kernels are composed for the shape and the variant asked for, once each (cached). Every particle kernel works on the
particles from `begin` on, one a thread.
"""

import functools

import warp as wp

from warp_mpm.kernels.blocks import stamp_blocks
from warp_mpm.kernels.content import lowest_cell, scatter_content
from warp_mpm.kernels.precision import HALF, ONE, ZERO, matrix3, scalar, vector3, vector4, vector8
from warp_mpm.kernels.records import Clock, Grid, Particles, node_index
from warp_mpm.kernels.shape import Shape
from warp_mpm.kernels.vectors import multiply_add8, scatter_add4, scatter_add8


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
def stencil_functions(shape: Shape) -> tuple[wp.Function, wp.Function, wp.Function, wp.Function]:
    """Device functions of a shape's stencil: `first_node`, and per axis `weights`, `slopes`, `affine_weights`.

    first_node(grid, cell, fraction) is the flat index of the stencil's lowest node; the others take
    (fraction, half_width) and return a vector of `shape.width` values.
    """
    width = shape.width
    weights_type = wp.types.vector(width, scalar)
    offset, weight, slope, affine = shape.offset, shape.weight, shape.slope, shape.affine

    lowest_node = lowest_node_function(shape)

    @wp.func
    def first_node(grid: Grid, cell: wp.vec3s, fraction: vector3) -> int:
        lowest = lowest_node(cell, fraction)
        return node_index(grid, lowest[0], lowest[1], lowest[2])

    @wp.func
    def weights(fraction: scalar, half_width: scalar) -> weights_type:
        result = weights_type()
        distance = fraction - scalar(offset(fraction))
        for n in range(width):
            result[n] = weight(distance - scalar(n), half_width)
        return result

    @wp.func
    def slopes(fraction: scalar, half_width: scalar) -> weights_type:
        result = weights_type()
        distance = fraction - scalar(offset(fraction))
        for n in range(width):
            result[n] = slope(distance - scalar(n), half_width)
        return result

    @wp.func
    def affine_weights(fraction: scalar, half_width: scalar) -> weights_type:
        result = weights_type()
        distance = fraction - scalar(offset(fraction))
        for n in range(width):
            result[n] = affine(distance - scalar(n), half_width, fraction)
        return result

    return first_node, weights, slopes, affine_weights


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
def scatter_kernel(shape: Shape, momentum: bool, force: bool, affine: bool, content: bool) -> wp.Kernel:
    """Particles -> nodes: momentum, mass and volume (`momentum`); internal force and field pressure (`force`).

    sum w m, sum w m v (APIC: v + C (x_i - x_p)), sum w V; f = sum V (p + q - p_ambient + s s^T) grad w, q and s s^T
    the isotropic and the directed part of the artificial viscosity, sum w V p; and to the
    cells sum L V p, sum L V (`content`).
    """
    width = shape.width
    first_node, weights, slopes, _ = stencil_functions(shape)
    node_offset = node_offset_function(shape)

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
        mass = particles.mass[p]
        if mass == ZERO:
            return
        fraction = particles.fraction[p]
        first = first_node(grid, particles.cell[p], fraction)
        wx = weights(fraction[0], half_width)
        wy = weights(fraction[1], half_width)
        wz = weights(fraction[2], half_width)
        stamp_blocks(grid, lowest_cell(particles.cell[p], fraction), clock[0].step)
        volume = mass / particles.density[p]
        carried = mass * particles.velocity[p]
        pressure_volume = particles.pressure[p] * volume
        pull = pressure_volume + (particles.viscous_pressure[p] - ambient_pressure) * volume
        thrust = wp.sqrt(volume) * particles.viscous_thrust[p]
        sx = slopes(fraction[0], half_width) / grid.spacing[0]
        sy = slopes(fraction[1], half_width) / grid.spacing[1]
        sz = slopes(fraction[2], half_width) / grid.spacing[2]
        for i in range(width):
            for j in range(width):
                row = first + i * grid.stride_x + j * grid.stride_y
                wij = wx[i] * wy[j]
                along = vector8()  # what a row's nodes get by their weights along z
                across = vector8()  # and by their slopes
                if wp.static(momentum):
                    along += wij * vector8(carried[0], carried[1], carried[2], mass, ZERO, ZERO, ZERO, volume)
                if wp.static(force):
                    gx = sx[i] * wy[j]
                    gy = wx[i] * sy[j]
                    f = vector3(pull * gx, pull * gy, ZERO) + (thrust[0] * gx + thrust[1] * gy) * thrust
                    along += vector8(ZERO, ZERO, ZERO, ZERO, f[0], f[1], f[2], ZERO)
                    f = vector3(ZERO, ZERO, pull * wij) + (thrust[2] * wij) * thrust
                    across = vector8(ZERO, ZERO, ZERO, ZERO, f[0], f[1], f[2], ZERO)
                for k in range(width):
                    value = multiply_add8(vector8(), wz[k], along)
                    if wp.static(affine and momentum):
                        extra = wij * wz[k] * mass * (particles.affine[p] * node_offset(grid, fraction, i, j, k))
                        value += vector8(extra[0], extra[1], extra[2], ZERO, ZERO, ZERO, ZERO, ZERO)
                    if wp.static(force):
                        value = multiply_add8(value, sz[k], across)
                        wp.atomic_add(grid.pressure, row + k, wij * wz[k] * pressure_volume)
                    scatter_add8(grid.node, row + k, ONE, value)
        if wp.static(content):
            scatter_content(grid, particles.cell[p], fraction, particles.pressure[p], volume)

    return scatter


@functools.cache
def advance_kernel(shape: Shape, blend: bool, affine: bool, reproject: bool, sharpened: bool) -> wp.Kernel:
    """Nodes -> particle velocity, and for MUSL back again (`reproject`).

    FLIP: v += dt sum w a. With `blend` a share s of PIC: (1 - s)(v + dt a) + s sum w (v + dt a)_i; APIC is s = 1 and
    C = sum (v + dt a)_i (x_i - x_p)^T w / D. Re-projection: sum w m v and, for the damping, sum w m v^2 / 2. With
    `sharpened`, which does not go with the other two, a comes from `kick`.
    """
    width = shape.width
    first_node, weights, _, affine_weights = stencil_functions(shape)
    node_offset = node_offset_function(shape)

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
        mass = particles.mass[p]
        if mass == ZERO:
            return
        dt = clock[0].dt
        fraction = particles.fraction[p]
        first = first_node(grid, particles.cell[p], fraction)
        wx = weights(fraction[0], half_width)
        wy = weights(fraction[1], half_width)
        wz = weights(fraction[2], half_width)
        sums = vector8()
        gradient = matrix3()
        for i in range(width):
            for j in range(width):
                row = first + i * grid.stride_x + j * grid.stride_y
                row_sums = vector8()
                for k in range(width):
                    if wp.static(sharpened):
                        row_sums = multiply_add8(row_sums, wz[k], grid.kick[row + k])
                    else:
                        row_sums = multiply_add8(row_sums, wz[k], grid.node[row + k])
                    if wp.static(affine):
                        node = grid.node[row + k]
                        bx = affine_weights(fraction[0], half_width)[i] * wy[j] * wz[k] / grid.spacing[0]
                        by = wx[i] * affine_weights(fraction[1], half_width)[j] * wz[k] / grid.spacing[1]
                        bz = wx[i] * wy[j] * affine_weights(fraction[2], half_width)[k] / grid.spacing[2]
                        v = vector3(node[0], node[1], node[2]) + dt * vector3(node[4], node[5], node[6])
                        gradient += wp.outer(v, vector3(bx, by, bz))
                sums = multiply_add8(sums, wx[i] * wy[j], row_sums)
        increment = dt * vector3(sums[4], sums[5], sums[6])
        velocity = particles.velocity[p] + increment
        if wp.static(blend):
            grid_velocity = vector3(sums[0], sums[1], sums[2]) + increment
            velocity = (ONE - pic_share) * velocity + pic_share * grid_velocity
        if wp.static(affine):
            particles.affine[p] = gradient
        particles.velocity[p] = velocity
        if wp.static(reproject):
            for i in range(width):
                for j in range(width):
                    row = first + i * grid.stride_x + j * grid.stride_y
                    wij = wx[i] * wy[j] * mass
                    for k in range(width):
                        carried = velocity
                        if wp.static(affine):
                            carried += gradient * node_offset(grid, fraction, i, j, k)
                        kinetic = HALF * wp.dot(carried, carried)
                        value = vector4(carried[0], carried[1], carried[2], kinetic)
                        scatter_add4(grid.reprojected, row + k, wij * wz[k], value)

    return advance


@functools.cache
def displacement_function(shape: Shape) -> wp.Function:
    """Device function: how far a particle moves in a step, dt sum w (v + dt a)_i, in cells (paper eq. 15)."""
    width = shape.width
    first_node, weights, _, _ = stencil_functions(shape)

    @wp.func
    def displacement(grid: Grid, cell: wp.vec3s, fraction: vector3, half_width: scalar, dt: scalar) -> vector3:
        first = first_node(grid, cell, fraction)
        wx = weights(fraction[0], half_width)
        wy = weights(fraction[1], half_width)
        wz = weights(fraction[2], half_width)
        velocity = vector3()
        for i in range(width):
            for j in range(width):
                row = first + i * grid.stride_x + j * grid.stride_y
                wij = wx[i] * wy[j]
                for k in range(width):
                    node = grid.node[row + k]
                    a = vector3(node[4], node[5], node[6])
                    velocity += wij * wz[k] * (vector3(node[0], node[1], node[2]) + dt * a)
        return wp.cw_div(dt * velocity, grid.spacing)

    return displacement
