"""Kenamond's problems on small grids: travel times to a tenth of a cell, and the speed that particles see to 0.5 %."""

import pytest

from warp_mpm.verification.problem import Level
from warp_mpm.verification.problems.kenamond import SPEED_TOLERANCE, Kenamond
from warp_mpm.verification.session import Setup, solve_level


@pytest.mark.parametrize("problem", [1, 2, 3])
@pytest.mark.parametrize(("dimensions", "cells"), [(2, 40), (3, 24)])
def test_times_and_speeds(problem, dimensions, cells):
    """Half a cell of travel is what is promised. A sphere of four cells' radius is poor on a lattice of half cells."""
    level = Level(cells, {"problem": problem, "dimensions": dimensions})
    figures = solve_level(Kenamond(), level, Setup(device="cpu", threads=1)).figures
    assert figures["time_cells"] < 0.1
    assert figures["speed_rare"] < 0.01
    if dimensions == 2:
        assert figures["speed"] < SPEED_TOLERANCE


def test_errors_do_not_grow_with_the_grid():
    """In cells they stay the same, so in seconds they fall with the cell."""
    coarse, fine = (
        solve_level(Kenamond(), Level(cells, {"problem": 3, "dimensions": 2}), Setup(device="cpu", threads=1)).figures
        for cells in (24, 48)
    )
    assert fine["time_cells"] < 1.5 * coarse["time_cells"]
