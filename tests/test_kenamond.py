"""Kenamond's problems on small grids: travel times to a tenth of a cell, and the speed that particles see to 0.5 %."""

import numpy as np
import pytest
from scenes_for_tests import start

from warp_mpm.config import SolverConfig
from warp_mpm.detonators import PointDetonator
from warp_mpm.exact import kenamond
from warp_mpm.launch import Launcher, find_device
from warp_mpm.model import build_model
from warp_mpm.places import section_nodes
from warp_mpm.state import State
from warp_mpm.verification.problem import Level
from warp_mpm.verification.problems.kenamond import LAMP, RADIUS, SPEED, SPEED_TOLERANCE, Kenamond
from warp_mpm.verification.session import Setup, solve_level


@pytest.mark.parametrize("problem", [1, 2, 3])
@pytest.mark.parametrize(("dimensions", "cells"), [(2, 40), (3, 24)])
def test_times_and_speeds(problem, dimensions, cells):
    """Half a cell of travel is what is promised."""
    level = Level(cells, {"problem": problem, "dimensions": dimensions})
    figures = solve_level(Kenamond(), level, Setup(device="cpu", threads=1)).figures
    assert figures["time_cells"] < 0.1
    assert figures["speed_rare"] < 0.01
    assert figures["speed"] < SPEED_TOLERANCE


@pytest.mark.parametrize("problem", [2, 3])
def test_any_number_of_threads_gives_the_same_times(problem):
    """In three dimensions: routes through two media, and ways pulled taut, whichever thread comes first."""
    model = build_model(
        Kenamond().scene(Level(36, {"problem": problem, "dimensions": 3})), SolverConfig(), find_device("cpu")
    )
    launcher = Launcher(model.device, threads=3)
    shared, alone = State(model, launcher), State(model)
    launcher.close()
    np.testing.assert_array_equal(shared.field("arrival_time"), alone.field("arrival_time"))


def test_errors_do_not_grow_with_the_grid():
    """In cells they stay the same, so in seconds they fall with the cell."""
    coarse, fine = (
        solve_level(Kenamond(), Level(cells, {"problem": 3, "dimensions": 2}), Setup(device="cpu", threads=1)).figures
        for cells in (24, 48)
    )
    assert fine["time_cells"] < 1.5 * coarse["time_cells"]


def test_what_is_recorded_is_expected_when_it_burns():
    """At the nodes of the section, around the obstacle, and never inside it."""
    scene = Kenamond().scene(Level(40, {"problem": 3, "dimensions": 2}))
    expected = start(scene).state.expected.section
    nodes = section_nodes(scene).reshape(-1, 3)
    assert scene.section.axis == 2
    exact = kenamond.inert_sphere(nodes, radius=RADIUS, detonator=PointDetonator(LAMP), speed=SPEED, cylinder=True)
    cell = scene.domain.spacing[0]
    error = (expected.ravel() - exact) * SPEED / cell
    away = np.abs(np.linalg.norm(nodes, axis=1) - RADIUS) > 0.02 * cell  # at the surface either may be right
    np.testing.assert_array_equal(np.isnan(error[away]), np.isnan(exact[away]))
    assert np.nanmax(np.abs(error)) < 0.1
