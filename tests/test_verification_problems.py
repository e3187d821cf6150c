"""Every problem of `warp-mpm verify`, shrunk to a few cells: a new one is tested by being there."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console

from warp_mpm.config import SolverConfig
from warp_mpm.verification.pictures import draw_problem
from warp_mpm.verification.problem import Level
from warp_mpm.verification.problems import all_problems
from warp_mpm.verification.report import print_problem, write_json
from warp_mpm.verification.session import Setup, run_problem

pytest.importorskip("matplotlib")
PROBLEMS = all_problems()
COARSE, LESS_COARSE = 12, 16  # cells: enough for every scene to have a front, a plateau or a shock of some kind


def test_names_are_unique_and_suit_a_file():
    names = [problem.name for problem in PROBLEMS]
    assert len(set(names)) == len(names)
    assert all(re.fullmatch(r"[a-z][a-z0-9_]*", name) for name in names)


def shrunk(problem):
    """Every variant at 12 cells, and the first one at 16, so that there is an order."""
    every = [*problem.levels, *problem.more_levels]
    variants = {level.variant: replace(level, cells=COARSE) for level in reversed(every)}
    return [*variants.values(), Level(LESS_COARSE, every[0].settings)]


@pytest.mark.parametrize("problem", PROBLEMS, ids=[problem.name for problem in PROBLEMS])
def test_a_problem_shrunk_to_a_few_cells(problem, tmp_path, capsys):
    """It runs, conserves, measures what its bounds are about, and has curves for each of its panels."""
    levels = shrunk(problem)
    report = run_problem(problem, levels, Setup(device="cpu", threads=1))
    assert report.failure is None
    assert len(report.results) == len(levels)
    known = set(report.overall).union(*(result.figures for result in report.results))
    assert {bound.figure for bound in problem.bounds} <= known
    for result in report.results:
        assert not problem.moves or (result.energy_error < 1e-5 and result.mass_error < 1e-6)
        assert all(np.isfinite(error.l1) and error.linf >= 0.0 for error in result.measurement.errors.values())
        panels = {panel.name for panel in problem.panels}
        exact = problem.exact_curves(result.level)
        assert set(result.measurement.curves) == panels
        assert set(exact) <= panels
        for curve in (*result.measurement.curves.values(), *exact.values()):
            assert curve.x.shape == curve.y.shape
        assert all(np.isfinite(curve.y).all() for curve in exact.values())
    if problem.panels:
        draw_problem(tmp_path / "picture.png", report)
        assert (tmp_path / "picture.png").stat().st_size > 0
    write_json(tmp_path / "verify.json", [report], SolverConfig(), {})
    assert json.loads((tmp_path / "verify.json").read_text())["problems"][0]["name"] == problem.name
    print_problem(Console(width=150), report)
    assert problem.title in capsys.readouterr().out


@pytest.mark.parametrize("problem", PROBLEMS, ids=[problem.name for problem in PROBLEMS])
def test_a_problem_says_what_it_is(problem):
    assert problem.levels or problem.more_levels
    for text in (problem.title, problem.statement, problem.reference, problem.cells_across):
        assert text
        assert not text.startswith(" ")
    for variant in {level.variant for level in problem.levels}:
        cells = [level.cells for level in problem.levels if level.variant == variant]
        assert cells == sorted(set(cells))  # coarsest first
