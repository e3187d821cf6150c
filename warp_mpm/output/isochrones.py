"""Lines of equal arrival times on the section plane."""

import math
from collections import defaultdict

import numpy as np

ABOUT = 12  # lines, at round times
ROUND = (1.0, 2.0, 2.5, 5.0, 10.0)  # steps between times, but for powers of ten


def round_times(last: float, about: int = ABOUT) -> np.ndarray:
    """Multiples (n,) of a round step up to `last` [s], at most `about` of them, without 0."""
    power = 10.0 ** math.floor(math.log10(last / about))
    step = next(share * power for share in ROUND if share * power * about >= last * (1.0 - 1e-9))
    return step * np.arange(1, math.floor(last / step * (1.0 + 1e-9)) + 1)


def contour(values: np.ndarray, level: float) -> list[np.ndarray]:
    """Lines on which values (rows, columns) at nodes have a level, as polylines (n, 2) of rows and columns.

    Every square is cut into two triangles, on which values are linear. Squares with a value that is not finite have no
    lines; closed lines end where they begin.
    """
    rows, columns = values.shape
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    below, beside, beyond = corner + columns, corner + 1, corner + columns + 1
    triangles = np.concatenate([np.stack([corner, below, beyond], axis=1), np.stack([corner, beyond, beside], axis=1)])
    flat = values.ravel()
    triangles = triangles[np.isfinite(flat[triangles]).all(axis=1)]
    above = flat[triangles] >= level
    crossed = above.any(axis=1) & ~above.all(axis=1)
    triangles, above = triangles[crossed], above[crossed]
    alone = np.where(above.sum(axis=1) == 1, above.argmax(axis=1), above.argmin(axis=1))  # the corner on its own side
    turns = (alone[:, None] + np.arange(3)) % 3
    tip, first, second = np.take_along_axis(triangles, turns, axis=1).T
    ways: dict[tuple[int, int], list[tuple[int, int]]] = defaultdict(list)
    for start, left, right in zip(tip.tolist(), first.tolist(), second.tolist(), strict=True):
        ends = (min(start, left), max(start, left)), (min(start, right), max(start, right))
        ways[ends[0]].append(ends[1])
        ways[ends[1]].append(ends[0])
    return [_places(edges, flat, columns, level) for edges in _chains(ways)]


def _chains(ways: dict[tuple[int, int], list[tuple[int, int]]]) -> list[list[tuple[int, int]]]:
    """The edges of a mesh in the order in which lines cross them, given the one or two next to each; empties `ways`."""
    chains = []
    ends = [edge for edge, others in ways.items() if len(others) == 1]
    for edge in [*ends, *ways]:  # what has ends is begun there
        chain = [edge]
        while ways[chain[-1]]:
            following = ways[chain[-1]].pop()
            ways[following].remove(chain[-1])
            chain.append(following)
        if len(chain) > 1:
            chains.append(chain)
    return chains


def _places(edges: list[tuple[int, int]], flat: np.ndarray, columns: int, level: float) -> np.ndarray:
    """Where edges between nodes have a level, (n, 2): rows and columns."""
    low, high = np.array(edges).T
    share = ((level - flat[low]) / (flat[high] - flat[low]))[:, None]
    ends = (np.stack([node // columns, node % columns], axis=1) for node in (low, high))
    start, end = ends
    return start + share * (end - start)
