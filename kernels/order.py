"""The order of particles in memory: by slab, charge and cell, so that neighbours on the grid are neighbours there."""

import functools
from typing import Any

import warp as wp

from warp_mpm.kernels.precision import ZERO
from warp_mpm.kernels.records import Grid, Particles


@wp.struct
class Slabs:
    """How the domain is cut into slabs of whole cells."""

    axis: int
    count: int
    cells: int  # of the domain along the axis, shared out evenly
    charges: int


@wp.func
def slab_of(slabs: Slabs, cell: int) -> int:
    """The slab of a cell, by its index along the axis."""
    return cell * slabs.count // slabs.cells


@wp.kernel(enable_backward=False)
def sort_keys(
    particles: Particles,
    grid: Grid,
    slabs: Slabs,
    charge: wp.array(dtype=wp.int16),
    keys: wp.array(dtype=wp.int64),
    order: wp.array(dtype=int),
):
    """Key of each particle: (slab x charges + charge) x cells + cell. Particles that left come last.

    Cells are counted through a slab along its thin axis first, then along z: the nodes that a line of cells shares with
    the next one are then still in the cache.
    """
    p = wp.tid()
    cell = particles.position[p].cell
    cells = wp.int64(grid.cells[0]) * wp.int64(grid.cells[1]) * wp.int64(grid.cells[2])
    first, second = 0, 1
    if slabs.axis == 0:
        first, second = 1, 0
    flat = (wp.int64(cell[first]) * wp.int64(grid.cells[second]) + wp.int64(cell[second])) * wp.int64(grid.cells[2])
    flat = flat + wp.int64(cell[2])
    slab = slab_of(slabs, int(cell[slabs.axis]))
    if particles.motion[p].mass == ZERO:
        slab = slabs.count
    keys[p] = (wp.int64(slab) * wp.int64(slabs.charges) + wp.int64(charge[particles.index[p]])) * cells + flat
    order[p] = p


@wp.kernel(enable_backward=False)
def group_starts(keys: wp.array(dtype=wp.int64), count: int, cells: wp.int64, starts: wp.array(dtype=int)):
    """First particle of each (slab, charge), for sorted keys; groups without particles start where the next does."""
    p = wp.tid()
    groups = starts.shape[0] - 1
    group = groups
    if p < count:
        group = wp.min(int(keys[p] // cells), groups)
    previous = -1
    if p > 0:
        previous = wp.min(int(keys[p - 1] // cells), groups)
    for g in range(previous + 1, group + 1):
        starts[g] = p


@functools.cache
def permute_kernel(dtype: Any) -> wp.Kernel:
    """target[p] = source[order[p]], for arrays of one type."""

    @wp.kernel(enable_backward=False, module="unique")
    def permute(source: wp.array(dtype=dtype), order: wp.array(dtype=int), target: wp.array(dtype=dtype)):
        p = wp.tid()
        target[p] = source[order[p]]

    return permute
