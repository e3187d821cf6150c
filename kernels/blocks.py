"""Blocks of 4 x 4 x 4 nodes: the grid's work is done only where particles are.

The scatter stamps the blocks that a particle's stencil reaches with the number of the step; a block is active in a
step if it carries that step's stamp. Stamps need no clearing. Nodes are numbered in blocks from the lowest ghost on.
"""

import warp as wp

from warp_mpm.kernels.records import Grid

EDGE = wp.constant(4)
SHIFT = wp.constant(2)  # its binary logarithm
STENCIL = wp.constant(3)  # nodes along an axis, at most
NODES = wp.constant(64)  # of a block


@wp.func
def block_of(node: int, blocks: int) -> int:
    """Block of a node along an axis, by its index; of nodes past the last block, that one."""
    return wp.min((node + 1) >> SHIFT, blocks - 1)


@wp.func
def stamp_blocks(grid: Grid, lowest: wp.vec3i, step: int):
    """Say that a stencil of three nodes per axis, the lowest given, was scattered to in a step.

    That covers every shape function's nodes, and the cells of the field. What is reached lies in one block or two along
    an axis: eight writes, some of them twice, without a branch (one per particle is slower than the writes).
    """
    reach = STENCIL - 1
    y = block_of(lowest[1], grid.blocks[1]) * grid.blocks[2]
    z = block_of(lowest[2], grid.blocks[2])
    to_y = block_of(lowest[1] + reach, grid.blocks[1]) * grid.blocks[2] - y
    to_z = block_of(lowest[2] + reach, grid.blocks[2]) - z
    for i in range(2):
        block = block_of(lowest[0] + i * reach, grid.blocks[0]) * grid.blocks[1] * grid.blocks[2] + y + z
        grid.stamps[block] = step
        grid.stamps[block + to_z] = step
        grid.stamps[block + to_y] = step
        grid.stamps[block + to_y + to_z] = step


@wp.func
def is_active(grid: Grid, block: int, step: int) -> bool:
    """Whether anything was scattered to a block in a step."""
    return grid.stamps[block] == step


@wp.func
def lowest_node_of(grid: Grid, block: int) -> wp.vec3i:
    """The lowest node of a block, as (i, j, k)."""
    row = block // grid.blocks[2]
    return wp.vec3i(
        (row // grid.blocks[1]) * EDGE - 1, (row % grid.blocks[1]) * EDGE - 1, (block % grid.blocks[2]) * EDGE - 1
    )


@wp.func
def node_of_block(lowest: wp.vec3i, n: int) -> wp.vec3i:
    """Node number n (0 to 63) of the block whose lowest node is given, as (i, j, k)."""
    return lowest + wp.vec3i(n >> 4, (n >> 2) & 3, n & 3)


@wp.func
def on_grid(grid: Grid, node: wp.vec3i) -> bool:
    """Whether a node of a block exists; the last block of an axis may be cut short."""
    return node[0] <= grid.cells[0] + 1 and node[1] <= grid.cells[1] + 1 and node[2] <= grid.cells[2] + 1
