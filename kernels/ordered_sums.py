"""The scatter from the nodes' side: each sums what its particles give, in a fixed order and without atomic additions.

So a GPU gives the same answer on every run, bit for bit. It computes every weight once for each node of a stencil, not
once for each particle: a choice for those who need it. The sums are those of `contribution.py`.
"""

import functools

import warp as wp

from warp_mpm.kernels.bins import Bins, sum_function
from warp_mpm.kernels.blocks import NODES, STENCIL, is_active, lowest_node_of, node_of_block, on_grid
from warp_mpm.kernels.content import lowest_cell, tents_around
from warp_mpm.kernels.contribution import contribution_function, force_on, momentum_on, reprojected
from warp_mpm.kernels.precision import scalar, vector2, vector4, vector8
from warp_mpm.kernels.records import Clock, Grid, Particles, node_index
from warp_mpm.kernels.shape import Shape
from warp_mpm.kernels.stencil import stencil_type
from warp_mpm.kernels.transfer import lowest_node_function, node_offset_function, stencil_function

vector10 = wp.types.vector(10, scalar)  # a node's sums and its field's


@wp.func
def is_within(place: wp.vec3i, width: int) -> bool:
    """Whether a place (i, j, k) is one of a stencil's nodes."""
    return wp.min(place) >= 0 and wp.max(place) < width


@functools.cache
def sum_by_stencil(shape: Shape, value_type: type, give: wp.Function) -> wp.Function:
    """Device function (particles, grid, bins, ambient_pressure, index) -> sum of what particles give to a node.

    give(particles, grid, ambient_pressure, p, stencil, at) -> value_type, `at` the node's place in the stencil.
    """
    width = shape.width
    stencil_of, lowest_node = stencil_function(shape), lowest_node_function(shape)

    @wp.func
    def given(
        particles: Particles, grid: Grid, bins: Bins, ambient_pressure: scalar, p: int, index: wp.vec3i
    ) -> value_type:
        position = particles.position[p]
        at = index - lowest_node(position.cell, position.fraction)
        if not is_within(at, width):
            return value_type()
        half_width = bins.half_width[int(bins.charge[particles.index[p]])]
        stencil = stencil_of(grid, position.cell, position.fraction, half_width)
        return give(particles, grid, ambient_pressure, p, stencil, at)

    return sum_function(STENCIL, value_type, given)


@functools.cache
def sum_scattered(shape: Shape, momentum: bool, force: bool, affine: bool) -> wp.Function:
    """Device function (particles, grid, bins, ambient_pressure, index) -> the sums and the field of a node."""
    record = stencil_type(shape.width)
    node_offset = node_offset_function(shape)
    contribution = contribution_function(momentum, force)

    @wp.func
    def given(
        particles: Particles, grid: Grid, ambient_pressure: scalar, p: int, stencil: record, at: wp.vec3i
    ) -> vector10:
        motion = particles.motion[p]
        give = contribution(motion.velocity, motion.mass, particles.matter[p], ambient_pressure)
        wx, wy, wz = stencil.wx[at[0]], stencil.wy[at[1]], stencil.wz[at[2]]
        weight = wx * wy * wz
        value = weight * give.value
        if wp.static(force):
            value += (stencil.sx[at[0]] * wy * wz) * force_on(give.force_x)
            value += (wx * stencil.sy[at[1]] * wz) * force_on(give.force_y)
            value += (wx * wy * stencil.sz[at[2]]) * force_on(give.force_z)
        if wp.static(affine and momentum):
            offset = node_offset(grid, particles.position[p].fraction, at[0], at[1], at[2])
            value += momentum_on(weight * motion.mass * (particles.affine[p] * offset))
        field = weight * give.field
        return vector10(
            value[0], value[1], value[2], value[3], value[4], value[5], value[6], value[7], field[0], field[1]
        )

    return sum_by_stencil(shape, vector10, given)


@functools.cache
def sum_reprojected(shape: Shape, affine: bool) -> wp.Function:
    """Device function (particles, grid, bins, ambient_pressure, index) -> the re-projected sums of a node."""
    record = stencil_type(shape.width)
    node_offset = node_offset_function(shape)

    @wp.func
    def given(
        particles: Particles, grid: Grid, ambient_pressure: scalar, p: int, stencil: record, at: wp.vec3i
    ) -> vector4:
        motion = particles.motion[p]
        velocity = motion.velocity
        if wp.static(affine):
            velocity += particles.affine[p] * node_offset(grid, particles.position[p].fraction, at[0], at[1], at[2])
        weight = stencil.wx[at[0]] * stencil.wy[at[1]] * stencil.wz[at[2]]
        return motion.mass * weight * reprojected(velocity)

    return sum_by_stencil(shape, vector4, given)


content_of = contribution_function(False, False)


@wp.func
def content_given(
    particles: Particles, grid: Grid, bins: Bins, ambient_pressure: scalar, p: int, index: wp.vec3i
) -> vector2:
    """What a particle gives to the content of cell (i, j, k)."""
    position, motion = particles.position[p], particles.motion[p]
    at = index - lowest_cell(position.cell, position.fraction)
    tents = tents_around(grid, position.cell, position.fraction)
    weight = tents.wx[at[0]] * tents.wy[at[1]] * tents.wz[at[2]]
    return weight * content_of(motion.velocity, motion.mass, particles.matter[p], ambient_pressure).content


sum_content = sum_function(2, vector2, content_given)


def _over_nodes(add: wp.Function, age: int) -> wp.Kernel:
    """Kernel over the nodes of the blocks that were scattered to `age` steps ago, one a thread, from `begin` on."""

    @wp.kernel(enable_backward=False, module="unique")
    def sum_in_order(
        particles: Particles,
        grid: Grid,
        clock: wp.array(dtype=Clock),
        bins: Bins,
        ambient_pressure: scalar,
        begin: int,
    ):
        thread = wp.tid()
        block = begin + thread // NODES
        if is_active(grid, block, clock[0].step - wp.static(age)):
            index = node_of_block(lowest_node_of(grid, block), thread % NODES)
            if on_grid(grid, index):
                add(particles, grid, bins, ambient_pressure, index)

    return sum_in_order


@functools.cache
def ordered_scatter_kernel(shape: Shape, momentum: bool, force: bool, affine: bool, content: bool) -> wp.Kernel:
    """What `scatter_kernel` of `transfer.py` adds to the nodes and cells."""
    sum_given = sum_scattered(shape, momentum, force, affine)

    @wp.func
    def add(particles: Particles, grid: Grid, bins: Bins, ambient_pressure: scalar, index: wp.vec3i):
        n = node_index(grid, index[0], index[1], index[2])
        x = sum_given(particles, grid, bins, ambient_pressure, index)
        grid.sums[n] = grid.sums[n] + vector8(x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7])
        if wp.static(force):
            grid.field[n] = grid.field[n] + vector2(x[8], x[9])
        if wp.static(content):
            grid.content_sums[n] = sum_content(particles, grid, bins, ambient_pressure, index)

    return _over_nodes(add, 0)


@functools.cache
def ordered_reprojection_kernel(shape: Shape, affine: bool) -> wp.Kernel:
    """What `advance_kernel` of `transfer.py` adds to the re-projection."""
    sum_given = sum_reprojected(shape, affine)

    @wp.func
    def add(particles: Particles, grid: Grid, bins: Bins, ambient_pressure: scalar, index: wp.vec3i):
        n = node_index(grid, index[0], index[1], index[2])
        grid.reprojected[n] = sum_given(particles, grid, bins, ambient_pressure, index)

    return _over_nodes(add, 1)
