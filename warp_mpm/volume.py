"""The volume of any solid: from a formula where one exists, else measured to a stated tolerance."""

import math

import numpy as np

from warp_mpm.geometry import Solid

TARGET_TOLERANCE = 1e-4  # relative
STANDARD_ERRORS = 3.0  # the tolerance is this many of them
FIRST_CELLS = 32  # along the longest edge of the bounds
LARGEST_SURFACE = 2_000_000  # cells; with the chunk it bounds the memory to about 500 MB
LARGEST_CONTACT = 200_000  # cells in which two solids are looked for
CHUNK = 50_000  # cells halved at a time

_OCTANTS = np.array([(x, y, z) for x in (-0.25, 0.25) for y in (-0.25, 0.25) for z in (-0.25, 0.25)])


def measure_volume(solid: Solid) -> tuple[float, float]:
    """Volume of a solid and its relative tolerance: [m3], [-].

    The tolerance is 0 where a formula exists. Elsewhere cells are halved along the surface, and the part of each
    surface cell that lies inside is told by two random points in it: the estimate is unbiased whatever the shape, and
    where the two points disagree gives its error. Refined until three standard errors are 1e-4 of the volume, or the
    memory bound is reached. The random points are the same in every run.
    """
    exact = solid.exact_volume()
    return (exact, 0.0) if exact is not None else _sampled_volume(solid)


def _sampled_volume(solid: Solid) -> tuple[float, float]:
    """Volume [m3] and relative tolerance from random points in ever smaller cells along the surface."""
    random = np.random.default_rng(seed=0)
    centers, size = _cells(*solid.bounds())
    core, surface = _core_and_surface(solid, centers, size)
    while len(surface):
        cell_volume = float(np.prod(size))
        first, second = (solid.contains(surface + size * (random.random(surface.shape) - 0.5)) for _ in range(2))
        volume = core + (np.count_nonzero(first) + np.count_nonzero(second)) / 2 * cell_volume
        disagreements = np.count_nonzero(first != second) + 1  # one more, for cells so few that all agree by chance
        tolerance = STANDARD_ERRORS * math.sqrt(disagreements) / 2 * cell_volume / volume if volume > 0.0 else math.inf
        if tolerance <= TARGET_TOLERANCE or len(surface) > LARGEST_SURFACE:
            return volume, tolerance
        further_core, surface = _halved(solid, surface, size)
        core, size = core + further_core, size / 2
    return core, 0.0  # no cell is left that a surface may cut: the solid is empty


def share_nothing(first: Solid, second: Solid) -> bool:
    """Whether two solids are found to be apart: there is a gap that cells small enough can tell.

    Of cells in the common bounds those are halved into which both may reach, until none is left, a point is found in
    both, or there are too many: solids that touch, or nearly, are not told apart.
    """
    both = first & second
    centers, size = _cells(*both.bounds())
    while 0 < len(centers) <= LARGEST_CONTACT:
        distance = both.signed_distance(centers)
        if np.any(distance < 0.0):
            return False
        centers, size = _parts(centers[distance < np.linalg.norm(size) / 2], size), size / 2
    return len(centers) == 0


def _parts(centers: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Centers of the eight parts of each of the cells (n, 3) [m]."""
    return (centers[:, None, :] + size * _OCTANTS).reshape(-1, 3)


def _halved(solid: Solid, surface: np.ndarray, size: np.ndarray) -> tuple[float, np.ndarray]:
    """`_core_and_surface` of the eight parts of each of the surface cells (n, 3)."""
    core, finer = 0.0, [np.empty((0, 3))]
    for start in range(0, len(surface), CHUNK):
        parts = _parts(surface[start : start + CHUNK], size)
        chunk_core, chunk_surface = _core_and_surface(solid, parts, size / 2)
        core += chunk_core
        finer.append(chunk_surface)
    return core, np.concatenate(finer)


def _core_and_surface(solid: Solid, centers: np.ndarray, size: np.ndarray) -> tuple[float, np.ndarray]:
    """Volume of the cells that certainly lie inside [m3], and the centers of those the surface may cut, (n, 3) [m]."""
    distance = solid.signed_distance(centers)
    half_diagonal = float(np.linalg.norm(size)) / 2
    core = np.count_nonzero(distance <= -half_diagonal) * float(np.prod(size))
    return core, centers[np.abs(distance) < half_diagonal]


def _cells(lower: np.ndarray, upper: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Centers (n, 3) and size (3,) [m] of nearly cubic cells that fill a box."""
    extent = upper - lower
    counts = np.maximum(np.ceil(FIRST_CELLS * extent / extent.max()), 1).astype(int)
    size = extent / counts
    axes = (start + (np.arange(count) + 0.5) * step for start, count, step in zip(lower, counts, size, strict=True))
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3), size
