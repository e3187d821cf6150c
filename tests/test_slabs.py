"""Slabs: threads that work at the same time write to no node of each other's."""

import numpy as np
import pytest

from warp_mpm.model import FEWEST_SLABS, THINNEST_SLAB, largest_drift, slab_count

CELLS = range(1, 260)
STEP = 1e-3  # between places that are looked at [cells]


def slab_edges(cells, slabs):
    """First cell of each slab, and one past the last, as `kernels/order.py` cuts them."""
    owner = np.arange(cells) * slabs // cells
    return np.append(np.searchsorted(owner, np.arange(slabs)), cells)


def nodes_written(places):
    """Lowest and highest node that stencils of three nodes write to, and rows that are written four nodes at a time."""
    nearest = np.floor(places + 0.5).astype(int)
    lowest = np.minimum(nearest - 1, np.floor(places).astype(int))
    return lowest.min(), nearest.max() + 1 + 1


@pytest.mark.parametrize("cells", CELLS)
def test_slabs_of_one_parity_share_no_node(cells):
    slabs = slab_count(cells)
    if slabs == 1:
        assert cells < FEWEST_SLABS * THINNEST_SLAB
        return
    assert slabs % 2 == 0
    edges = slab_edges(cells, slabs)
    assert np.diff(edges).min() >= THINNEST_SLAB
    drift = largest_drift(cells, slabs)
    assert drift > 1.0  # some steps' way: a step is 0.3 cells at most
    reach = np.arange(-drift, drift, STEP)
    for slab in range(slabs - 2):
        _, highest = nodes_written(edges[slab + 1] + reach)
        lowest, _ = nodes_written(edges[slab + 2] + reach)
        assert highest < lowest


def test_a_drift_that_is_too_large_would_be_seen():
    cells = FEWEST_SLABS * THINNEST_SLAB
    edges = slab_edges(cells, FEWEST_SLABS)
    reach = np.arange(-1.6, 1.6, STEP)
    _, highest = nodes_written(edges[1] + reach)
    lowest, _ = nodes_written(edges[2] + reach)
    assert highest >= lowest
