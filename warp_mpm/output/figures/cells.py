"""Particles counted into cells: where matter is, and its pressure, on a regular grid that surfaces are made of."""

from dataclasses import dataclass, replace

import numpy as np

from warp_mpm.output.figures.content import frames_of, setup_of
from warp_mpm.output.saved_frames import SavedFrame
from warp_mpm.run_directory import Run

FEW = 3.0  # particles to a cell on average, so that hardly any is empty by chance


@dataclass(frozen=True)
class Cells:
    """Equal cells: those of the domain, or coarser ones where a frame has too few particles to fill these."""

    lower: np.ndarray  # (3,) lower corner of the first cell [m]
    spacing: np.ndarray  # (3,) [m]
    filled: np.ndarray  # (nx, ny, nz) bool: there is a particle
    pressure: np.ndarray  # (nx, ny, nz) float64, mean over its particles [Pa]; 0 without any
    share: np.ndarray  # (nx, ny, nz) float64, volume at the start of its particles, over the cell's

    def centres(self, axis: int) -> np.ndarray:
        """Coordinates of the cells' centres along an axis [m]."""
        return self.lower[axis] + (np.arange(self.filled.shape[axis]) + 0.5) * self.spacing[axis]


def frame_cells(run: Run, frame: SavedFrame) -> Cells:
    """The cells of a frame that hold particles."""
    frame = run.frames[frame.index]  # its own, which goes with all that it has read when the cells are there
    return _count(run, frame.position[frame.inside], frame.pressure[frame.inside], _particle_volume(run))


def charge_cells(run: Run) -> list[Cells]:
    """The cells in which each charge is at the start.

    Raises:
        NothingToDrawError: the frames of the run are gone.
    """
    first, ids = frames_of(run)[0], run.frames.ids
    ends = np.cumsum([charge["particles"] for charge in run.summary["charges"]])
    owner = np.searchsorted(ends, ids, side="right")
    parts = []
    for number, charge in enumerate(run.summary["charges"]):
        mine = owner == number
        volume = charge["volume_m3"] / max(1, np.count_nonzero(mine))
        parts.append(_count(run, first.position[mine], first.pressure[mine], volume))
    return parts


def joined(parts: list[Cells]) -> tuple[Cells, np.ndarray]:
    """All cells of some parts, and the number of the part (nx, ny, nz) that fills the most of each."""
    owner = np.argmax([np.where(part.filled, part.share, 0.0) for part in parts], axis=0)
    return replace(parts[0], filled=np.any([part.filled for part in parts], axis=0)), owner


def _count(run: Run, position: np.ndarray, pressure: np.ndarray, particle_volume: float) -> Cells:
    domain = setup_of(run).domain
    lower = np.array(domain.lower)
    shape = np.maximum(np.array(domain.cells) // _merged(run), 1)
    spacing = (np.array(domain.upper) - lower) / shape
    cell = np.clip(((position - lower) / spacing).astype(int), 0, shape - 1)
    flat = np.ravel_multi_index(tuple(cell.T), tuple(shape))
    count = np.bincount(flat, minlength=shape.prod())
    total = np.bincount(flat, weights=pressure, minlength=shape.prod())
    mean = total / np.maximum(count, 1)
    share = count * (particle_volume / spacing.prod())
    return Cells(lower, spacing, (count > 0).reshape(shape), mean.reshape(shape), share.reshape(shape))


def _merged(run: Run) -> int:
    """Cells to an edge of a counting cell, at least: each then holds a particle of matter as dense as at the start.

    Particles of which only some were saved lie unevenly, so more of them must come to a cell.
    """
    wanted = 1.0 if len(run.frames.ids) == run.summary["particles"] else FEW
    return max(1, int(np.ceil(np.cbrt(wanted * _particle_volume(run) / setup_of(run).domain.cell_volume) - 1e-6)))


def _particle_volume(run: Run) -> float:
    """Volume at the start to one of the particles that are in the file [m3]."""
    return sum(charge["volume_m3"] for charge in run.summary["charges"]) / len(run.frames.ids)
