"""The regular lattice of particle positions that a charge is cut from."""

from dataclasses import dataclass

import numpy as np

from warp_mpm.geometry import Solid
from warp_mpm.scene import Domain, Vector

CHUNK = 100_000  # sites tested at a time


@dataclass(frozen=True)
class Lattice:
    """Sites at the centers of equal parts of every cell: `per_axis` of them along each axis of a cell."""

    domain: Domain
    per_axis: int

    @property
    def spacing(self) -> Vector:
        """Distance between neighboring sites per axis [m]."""
        x, y, z = (size / self.per_axis for size in self.domain.spacing)
        return (x, y, z)

    @property
    def site_volume(self) -> float:
        """Volume that belongs to one site [m3]."""
        return self.domain.cell_volume / self.per_axis**3

    def sites_in(self, solid: Solid) -> np.ndarray:
        """The sites inside a solid, (n, 3) float64 [m], in lattice order: x slowest, z fastest.

        Takes memory for the sites found and one chunk more, however large the bounds of the solid.
        """
        x, y, z = self._axes(solid)
        layers = max(1, CHUNK // max(1, len(y) * len(z)))
        found = [np.empty((0, 3))]
        for start in range(0, len(x), layers):
            grid = np.meshgrid(x[start : start + layers], y, z, indexing="ij")
            sites = np.stack(grid, axis=-1).reshape(-1, 3)
            found.append(sites[solid.contains(sites)])
        return np.concatenate(found)

    def _axes(self, solid: Solid) -> list[np.ndarray]:
        """Coordinates of the sites along each axis that the bounds of the solid span [m]."""
        lower, upper = (np.clip(corner, self.domain.lower, self.domain.upper) for corner in solid.bounds())
        origin, spacing = np.array(self.domain.lower), np.array(self.spacing)
        last = np.array(self.domain.cells) * self.per_axis
        begin = np.clip(np.floor((lower - origin) / spacing).astype(int), 0, last)
        end = np.clip(np.ceil((upper - origin) / spacing).astype(int), 0, last)
        return [origin[axis] + (np.arange(begin[axis], end[axis]) + 0.5) * spacing[axis] for axis in range(3)]
