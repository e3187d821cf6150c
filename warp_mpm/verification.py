"""How far a field is from an exact solution.

The norm: L1 = sum over cells |p_h - p| / sum over cells p, over all cells of the domain (ahead of the front and in
vacuum too), where p_h is the cell mean of the field pressure, interpolated linearly between nodes, and p the cell mean
of the exact pressure. Fields are compared, never raw particles, whose noise the nodes average out.
"""

from typing import Protocol

import numpy as np

from warp_mpm.state import State


class PlanarSolution(Protocol):
    """An exact solution that depends on x and time."""

    def mean_pressure(self, edges: np.ndarray, time: float) -> np.ndarray:
        """Mean pressure [Pa] of each cell between consecutive edges (n + 1,) [m]."""


def cell_means(nodal: np.ndarray) -> np.ndarray:
    """Cell means (nx, ny, nz) of a field given at the nodes (nx + 1, ny + 1, nz + 1), linear between them."""
    result = nodal.astype(np.float64)
    for axis in range(3):
        low = np.take(result, np.arange(result.shape[axis] - 1), axis=axis)
        high = np.take(result, np.arange(1, result.shape[axis]), axis=axis)
        result = 0.5 * (low + high)
    return result


def relative_l1(computed: np.ndarray, exact: np.ndarray) -> float:
    """Sum of |computed - exact| over the sum of exact."""
    return float(np.abs(computed - exact).sum() / exact.sum())


def pressure_error(state: State, exact: PlanarSolution, time: float) -> float:
    """L1 error of the field pressure against an exact solution that depends on x alone."""
    domain = state.model.scene.domain
    edges = np.linspace(domain.lower[0], domain.upper[0], domain.cells[0] + 1)
    expected = exact.mean_pressure(edges, time)[:, None, None]
    computed = cell_means(state.field_pressure())
    return relative_l1(computed, np.broadcast_to(expected, computed.shape))
