"""Bins: the particles of each place, listed in a fixed order, for sums that must not depend on the order of threads.

A particle's bin is the lowest of the three nodes per axis around it, which every shape function's stencil lies within:
a node finds all its particles in the 27 bins below it. The list is sorted by bin; within a bin it has the order of the
particles in memory.
"""

import functools

import warp as wp

from warp_mpm.kernels.blocks import stamp_blocks
from warp_mpm.kernels.content import lowest_cell
from warp_mpm.kernels.precision import ZERO, scalar
from warp_mpm.kernels.records import Clock, Grid, Particles, node_index

NOWHERE = wp.constant(0x7FFFFFFF)  # the bin of particles that have left


@wp.struct
class Bins:
    """The particles' list, and where each bin begins in it."""

    bin: wp.array(dtype=int)  # of each place in the list: the flat index of its lowest node
    particle: wp.array(dtype=int)  # there
    first: wp.array(dtype=int)  # of each node: the first place of its bin; anything where the bin is empty
    charge: wp.array(dtype=wp.int16)  # of each particle, by creation order
    half_width: wp.array(dtype=scalar)  # of each charge's particles [cells]
    count: int  # of particles


@wp.kernel(enable_backward=False)
def fill_bins(particles: Particles, grid: Grid, clock: wp.array(dtype=Clock), bins: Bins):
    """List the particles with their bins, unsorted, and stamp the blocks that they reach."""
    p = wp.tid()
    bins.particle[p] = p
    bins.bin[p] = NOWHERE
    if particles.motion[p].mass != ZERO:
        position = particles.position[p]
        lowest = lowest_cell(position.cell, position.fraction)
        bins.bin[p] = node_index(grid, lowest[0], lowest[1], lowest[2])
        stamp_blocks(grid, lowest, clock[0].step)


@wp.kernel(enable_backward=False)
def mark_bins(bins: Bins):
    """Find where the bins of the sorted list begin."""
    place = wp.tid()
    previous = NOWHERE
    if place > 0:
        previous = bins.bin[place - 1]
    bin = bins.bin[place]
    if bin != previous and bin != NOWHERE:
        bins.first[bin] = place


@functools.cache
def sum_function(reach: int, value_type: type, give: wp.Function) -> wp.Function:
    """Device function (particles, grid, bins, ambient_pressure, index) -> sum of what particles give to a node.

    give(particles, grid, bins, ambient_pressure, p, index) -> value_type; `reach` is how many nodes per axis, from the
    lowest of its bin on, a particle gives anything to.
    """

    @wp.func
    def total(particles: Particles, grid: Grid, bins: Bins, ambient_pressure: scalar, index: wp.vec3i) -> value_type:
        result = value_type()
        for n in range(reach * reach * reach):
            below = wp.vec3i(n // (reach * reach), n // reach % reach, n % reach)
            lowest = index - below
            if wp.min(lowest) >= -1:
                bin = node_index(grid, lowest[0], lowest[1], lowest[2])
                place = bins.first[bin]
                inside = bins.bin[place] == bin
                while inside:
                    result += give(particles, grid, bins, ambient_pressure, bins.particle[place], index)
                    place += 1
                    inside = False
                    if place < bins.count:
                        inside = bins.bin[place] == bin
        return result

    return total
