"""Blocks of 4 x 4 x 4 nodes: the grid's work is done only where particles are.

The scatter stamps the block of each particle's lowest stencil node with the number of the step. A stencil is three
nodes wide, so it reaches into that block and the next one along each axis: a block is active in a step if it, or one
of its lower neighbors, carries that step's stamp. Stamps need no clearing. Nodes are numbered in blocks from the
lowest ghost on.
"""

import warp as wp

from warp_mpm.kernels.records import Grid

EDGE = wp.constant(4)
NODES = wp.constant(64)  # of a block


@wp.func
def block_index(grid: Grid, i: int, j: int, k: int) -> int:
    """Flat index of the block that holds node (i, j, k)."""
    return (((i + 1) // EDGE) * grid.blocks[1] + (j + 1) // EDGE) * grid.blocks[2] + (k + 1) // EDGE


@wp.func
def stamp_block(grid: Grid, i: int, j: int, k: int, step: int):
    """Say that the stencil with lowest node (i, j, k) was scattered to in a step."""
    grid.stamps[block_index(grid, i, j, k)] = step


@wp.func
def is_active(grid: Grid, block: int, step: int) -> bool:
    """Whether anything was scattered to a block in a step."""
    if grid.stamps[block] == step:
        return True
    row = block // grid.blocks[2]
    lower_x = wp.where(row // grid.blocks[1] > 0, 2, 1)
    lower_y = wp.where(row % grid.blocks[1] > 0, 2, 1)
    lower_z = wp.where(block % grid.blocks[2] > 0, 2, 1)
    active = bool(False)
    for i in range(lower_x):
        for j in range(lower_y):
            for k in range(lower_z):
                neighbor = block - (i * grid.blocks[1] + j) * grid.blocks[2] - k
                active = active or grid.stamps[neighbor] == step
    return active


@wp.func
def node_of_block(grid: Grid, block: int, n: int) -> wp.vec3i:
    """Node number n (0 to 63) of a block, as (i, j, k)."""
    row = block // grid.blocks[2]
    return wp.vec3i(
        (row // grid.blocks[1]) * EDGE + n // 16 - 1,
        (row % grid.blocks[1]) * EDGE + n // 4 % 4 - 1,
        (block % grid.blocks[2]) * EDGE + n % 4 - 1,
    )


@wp.func
def on_grid(grid: Grid, node: wp.vec3i) -> bool:
    """Whether a node of a block exists; the last block of an axis may be cut short."""
    return node[0] <= grid.cells[0] + 1 and node[1] <= grid.cells[1] + 1 and node[2] <= grid.cells[2] + 1
