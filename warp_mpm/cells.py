"""Cuts the box of a scene into equal cells that fit it exactly."""

from collections.abc import Sequence

import numpy as np

from warp_mpm.checks import mistake
from warp_mpm.scene import Domain, Vector

MOST_CELLS = 32_000  # per axis: cell indices have 16 bits
LARGEST_ASPECT = 2.0  # longest over shortest edge of a cell


def domain_of_cells(
    where: str, lower: Vector, upper: Vector, counts: Sequence[float], margins: Sequence[float]
) -> Domain:
    """The box from `lower` to `upper` in equal cells, with whole cells of room around it.

    Args:
        where: start of the error messages.
        lower: corner of the smallest coordinates [m].
        upper: corner of the largest [m].
        counts: cells per axis, whole numbers.
        margins: room beyond each face of the box [m], rounded to whole cells: those inside the box stay as they are.

    Raises:
        InputError: there are too many cells.
    """
    _check_counts(where, np.array(counts))
    spacing = np.subtract(upper, lower) / counts
    below, above = np.round(np.reshape(margins, (3, 2)).T / spacing)
    total = below + counts + above
    _check_counts(where, total)
    x, y, z = (int(count) for count in total)
    return Domain(_vector(lower - below * spacing), _vector(upper + above * spacing), (x, y, z))


def check_aspect(where: str, domain: Domain) -> None:
    """Check that the cells are not too far from cubes.

    Raises:
        InputError: one edge is more than twice another.
    """
    longest, shortest = max(domain.spacing), min(domain.spacing)
    if longest > LARGEST_ASPECT * shortest:
        raise mistake(
            f"{where}: cells",
            f"edges that differ by a factor of {LARGEST_ASPECT:g} at most",
            " x ".join(f"{size:.3g}" for size in domain.spacing) + " m",
            f"choose a cell size of {shortest:.3g} m or less, or one for each axis",
        )


def _check_counts(where: str, counts: np.ndarray) -> None:
    if counts.max() > MOST_CELLS:
        got = " x ".join(f"{count:.0f}" for count in counts)
        raise mistake(
            f"{where}: cells", f"at most {MOST_CELLS} per axis", got, "choose a larger cell size or a smaller domain"
        )


def _vector(values: np.ndarray) -> Vector:
    x, y, z = (float(value) for value in values)
    return (x, y, z)
