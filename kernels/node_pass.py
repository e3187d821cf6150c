"""A pass over the nodes of all active blocks: the loop that every grid phase shares.

A phase works on any node, with what walls and faces ask for; and, faster, on nodes two or more from every face, where
nothing is special: on a CPU a row of four at a time, where all four are such nodes.
"""

import functools

import warp as wp

from warp_mpm.kernels.blocks import EDGE, NODES, is_active, lowest_node_of, node_of_block, on_grid
from warp_mpm.kernels.node_rows import nodes_at_a_time
from warp_mpm.kernels.precision import ONE, ZERO, scalar
from warp_mpm.kernels.records import Clock, Grid, node_index
from warp_mpm.kernels.stencil import prefetch_row_function
from warp_mpm.kernels.walls import Boundary

BLOCKS_AHEAD = wp.constant(2)  # along z, of what is asked for

# Of a row of a block, by its first node.
prefetch_eight = prefetch_row_function(EDGE, 8)
prefetch_four = prefetch_row_function(EDGE, 4)
prefetch_two = prefetch_row_function(EDGE, 2)


@wp.struct
class Phase:
    """What the phases take besides the grid; each uses what it needs."""

    pic_share: scalar  # of the grid's velocity that particles take over
    strength: scalar  # of the sharpening
    reactions: wp.array(dtype=wp.float64)  # of the walls to forces [N], a row for each slot
    impulses: wp.array(dtype=wp.float64)  # of the walls to momenta [kg m/s], likewise
    peaks: wp.array(dtype=scalar)  # highest field pressure [Pa], one for each slot


@wp.func
def has_no_face_near(grid: Grid, lowest: wp.vec3i, highest: wp.vec3i) -> bool:
    """Whether all nodes between two corners, both included, are two or more from every face of the domain."""
    inside = True
    for axis in range(3):
        if lowest[axis] < 2 or highest[axis] > grid.cells[axis] - 2:
            inside = False
    return inside


@wp.func
def inverse_mass(grid: Grid, mass: scalar) -> scalar:
    """1 / mass [1/kg], or 0 of a node that counts as empty."""
    counts = mass > grid.light_mass
    return wp.where(counts, ONE, ZERO) / wp.where(counts, mass, ONE)


@wp.func
def damped_share(now: Clock, sound_speed: scalar) -> scalar:
    """Alpha of a node: k s / (1 + k s), s the cells that sound crosses in the step."""
    crossing = now.damping * sound_speed
    return crossing / (ONE + crossing)


@functools.cache
def node_kernel(
    visit: wp.Function,
    visit_row: wp.Function | None,
    visit_one: wp.Function | None,
    age: int,
    look_ahead: wp.Function | None = None,
    look_beside: wp.Function | None = None,
    retire: wp.Function | None = None,
) -> wp.Kernel:
    """Kernel over the blocks that were scattered to `age` steps ago, from `begin` on.

    visit(grid, boundary, now, phase, slot, index) for any node, with the clock's values `now` and the node's `index`
    (i, j, k); visit_row and visit_one(grid, boundary, now, phase, slot, n) for rows (see `node_rows.py`) and nodes that
    have no face near, n the flat index of the first; without them there is nothing to do for these. `look_ahead(grid,
    n)` asks for a row of the next block but one, n its first node, and `look_beside(grid, n)` for a row next to that
    block, which is only looked at: thin gas keeps a pass waiting for memory, and row by row a CPU does both, waits and
    works; a whole block's rows asked for at once are too many for it. To ask beyond the arrays does no harm.
    `retire(grid, boundary, index)` is for nodes of blocks that were last scattered to a step before that.
    """
    goes_inside, looks_ahead, retires = visit_row is not None, look_ahead is not None, retire is not None

    @wp.kernel(enable_backward=False, module="unique")
    def over_nodes(grid: Grid, boundary: Boundary, clock: wp.array(dtype=Clock), phase: Phase, slot: int, begin: int):
        thread = wp.tid()
        block = begin + thread // grid.workers
        now = clock[0]
        row = nodes_at_a_time()
        if is_active(grid, block, now.step - wp.static(age)):
            lowest = lowest_node_of(grid, block)
            if has_no_face_near(grid, lowest, lowest + wp.vec3i(EDGE - 1, EDGE - 1, EDGE - 1)):
                if wp.static(goes_inside):
                    corner = node_index(grid, lowest[0], lowest[1], lowest[2])
                    for n in range(thread % grid.workers * row, NODES, grid.workers * row):
                        node = corner + (n >> 4) * grid.stride_x + ((n >> 2) & 3) * grid.stride_y + (n & 3)
                        if wp.static(looks_ahead):
                            ahead = node + BLOCKS_AHEAD * EDGE
                            look_ahead(grid, ahead)
                            if n >> 4 == 0:
                                look_beside(grid, ahead - grid.stride_x)
                            if n >> 4 == EDGE - 1:
                                look_beside(grid, ahead + grid.stride_x)
                            if (n >> 2) & 3 == 0:
                                look_beside(grid, ahead - grid.stride_y)
                            if (n >> 2) & 3 == EDGE - 1:
                                look_beside(grid, ahead + grid.stride_y)
                        visit_row(grid, boundary, now, phase, slot, node)
            else:
                for n in range(thread % grid.workers, NODES, grid.workers):
                    index = node_of_block(lowest, n)
                    node = node_index(grid, index[0], index[1], index[2])
                    place = n % row
                    first = index - wp.vec3i(0, 0, place)
                    if has_no_face_near(grid, first, first + wp.vec3i(0, 0, row - 1)):
                        if wp.static(goes_inside):
                            if place == 0:
                                visit_row(grid, boundary, now, phase, slot, node)
                    elif row > 1 and has_no_face_near(grid, index, index):  # another of its row has
                        if wp.static(goes_inside):
                            visit_one(grid, boundary, now, phase, slot, node)
                    elif on_grid(grid, index):
                        visit(grid, boundary, now, phase, slot, index)
        if wp.static(retires):
            if is_active(grid, block, now.step - wp.static(age + 1)):
                lowest = lowest_node_of(grid, block)
                for n in range(thread % grid.workers, NODES, grid.workers):
                    index = node_of_block(lowest, n)
                    if on_grid(grid, index):
                        retire(grid, boundary, index)

    return over_nodes
