"""How far a field is from an exact one, and how fast that falls with the cell size.

    L1 = sum over cells |h - exact| / sum over cells |exact|,    Linf = largest |h - exact| / largest |exact|,

over all cells of the domain (ahead of the front and in vacuum too). h is the cell's value of the computed field, exact
the mean of the exact field over the cell. Fields are compared, never raw particles.

The observed order between two levels is ln(L1 / L1') / ln(n' / n), n and n' being their numbers of cells.
"""

import math
from collections.abc import Iterable, Mapping

import numpy as np

from warp_mpm.verification.problem import FieldError, LevelResult

DEFINITION = (
    "L1 = sum of |h - exact| / sum of |exact|, Linf = max |h - exact| / max |exact|, over all cells of the domain; "
    "h: the cell's value of the field, exact: the mean of the exact field over the cell (velocities are 0 where there "
    "is no matter); order = ln(coarser L1 / L1) / ln(cells / coarser cells)"
)


def relative_l1(computed: np.ndarray, exact: np.ndarray) -> float:
    """Sum of |computed - exact| over the sum of |exact|; arrays of one shape, and not all of exact 0."""
    return float(np.abs(computed - exact).sum() / np.abs(exact).sum())


def relative_linf(computed: np.ndarray, exact: np.ndarray) -> float:
    """Largest |computed - exact| over the largest |exact|; arrays of one shape, and not all of exact 0."""
    return float(np.abs(computed - exact).max() / np.abs(exact).max())


def field_error(computed: np.ndarray, exact: np.ndarray) -> FieldError:
    """Both distances of a computed field from an exact one."""
    return FieldError(relative_l1(computed, exact), relative_linf(computed, exact))


def observed_order(coarse_error: float, fine_error: float, refinement: float) -> float:
    """The power of the cell size with which an error falls when there are `refinement` times as many cells.

    Not-a-number where an error is 0: round-off, or nothing to measure.
    """
    if not (coarse_error > 0.0 and fine_error > 0.0):
        return math.nan
    return math.log(coarse_error / fine_error) / math.log(refinement)


def observed_orders(coarse: LevelResult, fine: LevelResult) -> Mapping[str, float]:
    """Order of each field's L1 error between two levels: "pressure_l1" and so on."""
    refinement = fine.level.cells / coarse.level.cells
    before, after = coarse.measurement.errors, fine.measurement.errors
    shared = [name for name in after if name in before]
    return {f"{name}_l1": observed_order(before[name].l1, after[name].l1, refinement) for name in shared}


def mean_and_scatter(values: np.ndarray, weights: np.ndarray | None = None) -> tuple[float, float]:
    """Mean of some values, and their root mean square distance from it over that mean; not-a-number without values."""
    if len(values) == 0:
        return math.nan, math.nan
    mean = float(np.average(values, weights=weights))
    scatter = math.sqrt(float(np.average((values - mean) ** 2, weights=weights)))
    return mean, scatter / abs(mean) if mean else math.nan


def next_coarser(results: Iterable[LevelResult], fine: LevelResult) -> LevelResult | None:
    """Of the levels with the settings of `fine` and fewer cells the one with most; None if there is none."""
    variant = fine.level.variant
    coarser = [r for r in results if r.level.variant == variant and r.level.cells < fine.level.cells]
    return max(coarser, key=lambda result: result.level.cells, default=None)
