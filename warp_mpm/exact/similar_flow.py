"""A planar flow that depends on xi = x / t alone, given at points of xi with straight lines between them."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np


@dataclass(frozen=True)
class SimilarFlow:
    """Pressure, velocity and density at rising points of xi; where two points are the same, the flow jumps.

    Beyond the first and the last point everything is as there. Positions are arrays [m], times above 0 [s].
    """

    xi: np.ndarray  # (n,) [m/s]
    pressures: np.ndarray  # (n,) [Pa]
    velocities: np.ndarray  # (n,) [m/s]
    densities: np.ndarray  # (n,) [kg/m3]
    origin: float = 0.0  # where x is 0 [m]

    def pressure(self, position: np.ndarray, time: float) -> np.ndarray:
        """Pressure [Pa]."""
        return self._sample(self.pressures, position, time)

    def velocity(self, position: np.ndarray, time: float) -> np.ndarray:
        """Velocity [m/s]."""
        return self._sample(self.velocities, position, time)

    def density(self, position: np.ndarray, time: float) -> np.ndarray:
        """Density [kg/m3]."""
        return self._sample(self.densities, position, time)

    def mean_pressure(self, edges: np.ndarray, time: float) -> np.ndarray:
        """Mean pressure [Pa] of each cell between consecutive edges (n + 1,) [m]."""
        return self._mean(self.pressures, edges, time)

    def mean_velocity(self, edges: np.ndarray, time: float) -> np.ndarray:
        """Mean velocity [m/s] of each cell."""
        return self._mean(self.velocities, edges, time)

    def mean_density(self, edges: np.ndarray, time: float) -> np.ndarray:
        """Mean density [kg/m3] of each cell."""
        return self._mean(self.densities, edges, time)

    @cached_property
    def _widths(self) -> np.ndarray:
        return np.diff(self.xi)

    def _below(self, xi: np.ndarray) -> np.ndarray:
        """The interval of the table that each xi lies in."""
        return np.clip(np.searchsorted(self.xi, xi, side="right") - 1, 0, len(self.xi) - 2)

    def _share(self, below: np.ndarray, xi: np.ndarray) -> np.ndarray:
        """How far along its interval each xi lies, from 0 to 1."""
        width = self._widths[below]
        share = np.divide(xi - self.xi[below], width, out=np.ones_like(width), where=width > 0.0)
        return np.clip(share, 0.0, 1.0)

    def _sample(self, values: np.ndarray, position: np.ndarray, time: float) -> np.ndarray:
        xi = (np.asarray(position, dtype=float) - self.origin) / time
        below = self._below(xi)
        return values[below] + self._share(below, xi) * (values[below + 1] - values[below])

    def _mean(self, values: np.ndarray, edges: np.ndarray, time: float) -> np.ndarray:
        """Cell means: differences of the integral from the first point on, which is exact between straight lines."""
        xi = (np.asarray(edges, dtype=float) - self.origin) / time
        whole = np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]) * self._widths)])
        below = self._below(xi)
        share = self._share(below, xi)
        width = self._widths[below]
        inside = width * share * (values[below] + 0.5 * share * (values[below + 1] - values[below]))
        beyond = np.minimum(xi - self.xi[0], 0.0) * values[0] + np.maximum(xi - self.xi[-1], 0.0) * values[-1]
        return np.diff(whole[below] + inside + beyond) / np.diff(xi)
