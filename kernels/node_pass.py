"""A pass over the nodes of all active blocks: the loop that every grid phase shares.

A phase is two device functions: `visit` works on any node, with what walls and faces ask for; `visit_inside` on a node
of a block that lies wholly inside, two nodes or more from every face, where nothing is special.
"""

import functools

import warp as wp

from warp_mpm.kernels.blocks import EDGE, NODES, is_active, node_of_block, on_grid
from warp_mpm.kernels.precision import scalar
from warp_mpm.kernels.records import Clock, Grid, node_index
from warp_mpm.kernels.stencil import prefetch_function
from warp_mpm.kernels.walls import Boundary


@wp.struct
class Phase:
    """What the phases take besides the grid; each uses what it needs."""

    pic_share: scalar  # of the grid's velocity that particles take over
    strength: scalar  # of the sharpening
    reactions: wp.array(dtype=wp.float64)  # of the walls to forces [N], a row for each slot
    impulses: wp.array(dtype=wp.float64)  # of the walls to momenta [kg m/s], likewise
    peaks: wp.array(dtype=scalar)  # highest field pressure [Pa], one for each slot


@wp.func
def lies_inside(grid: Grid, lowest: wp.vec3i) -> bool:
    """Whether all nodes of a block, the lowest given, are two or more from every face of the domain."""
    inside = True
    for axis in range(3):
        if lowest[axis] < 2 or lowest[axis] + EDGE - 1 > grid.cells[axis] - 2:
            inside = False
    return inside


# Asks for all rows of a block at once: where gas is thin, a pass is a walk from one wait for memory to the next.
prefetch_block = prefetch_function(EDGE, 8)


@functools.cache
def node_kernel(visit: wp.Function, visit_inside: wp.Function, age: int) -> wp.Kernel:
    """Kernel over the blocks that were scattered to `age` steps ago, from `begin` on.

    visit(grid, boundary, now, phase, slot, index) and visit_inside(grid, boundary, now, phase, slot, n), with the
    clock's values `now`, a node's `index` (i, j, k) and its flat index n.
    """

    @wp.kernel(enable_backward=False, module="unique")
    def over_nodes(grid: Grid, boundary: Boundary, clock: wp.array(dtype=Clock), phase: Phase, slot: int, begin: int):
        thread = wp.tid()
        block = begin + thread // grid.workers
        now = clock[0]
        if is_active(grid, block, now.step - wp.static(age)):
            lowest = node_of_block(grid, block, 0)
            if lies_inside(grid, lowest):
                first = node_index(grid, lowest[0], lowest[1], lowest[2])
                if grid.workers == 1:
                    prefetch_block(grid.node, first, grid.stride_x, grid.stride_y)
                    if grid.kick.shape[0] > 0:
                        prefetch_block(grid.kick, first, grid.stride_x, grid.stride_y)
                for n in range(thread % grid.workers, NODES, grid.workers):
                    node = first + (n >> 4) * grid.stride_x + ((n >> 2) & 3) * grid.stride_y + (n & 3)
                    visit_inside(grid, boundary, now, phase, slot, node)
            else:
                for n in range(thread % grid.workers, NODES, grid.workers):
                    index = node_of_block(grid, block, n)
                    if on_grid(grid, index):
                        visit(grid, boundary, now, phase, slot, index)

    return over_nodes
