"""How problems are judged and shown, with a problem whose figures are chosen here."""

import json
import math
import sys
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console

from warp_mpm.config import SolverConfig
from warp_mpm.errors import InputError, SimulationError, VerificationError
from warp_mpm.verification.command import verify
from warp_mpm.verification.problem import (
    DISTANCE,
    PRESSURE,
    Bound,
    Curve,
    FieldError,
    Level,
    Measurement,
    Outcome,
    Panel,
    Problem,
    ladder,
)
from warp_mpm.verification.problems.taylor_rigid import RigidTaylor
from warp_mpm.verification.progress import LevelLines, level_progress
from warp_mpm.verification.session import Setup, chosen_levels, chosen_problems, judge, run_problem

FAST = Setup(device="cpu", threads=1)


class Known(Problem):
    """Its pressure error falls with second order; a level of 13 cells cannot be solved."""

    name = "known"
    title = "A problem whose figures are known"
    statement = "Errors are 8 / n^2."
    reference = "this test"
    cells_across = "a length"
    levels = (*ladder(8, 16), *ladder(8, skew=0.5))
    more_levels = ladder(32)
    panels = (Panel("pressure", DISTANCE, PRESSURE),)
    bounds = (
        Bound("pressure_l1", high=0.1, from_cells=8),
        Bound("pressure_l1_order", low=1.5),
        Bound("skewness", high=1.0, settings={"skew": 0.5}, why="skew"),
        Bound("levels_solved", low=2.0),
        Bound("nothing", low=0.0),
    )

    def scene(self, level):
        """A column that is quick to solve."""
        return RigidTaylor().scene(Level(8))

    def measure(self, level, result):
        """What the level is told to find."""
        if level.cells == 13:
            raise SimulationError("step 3: no number")
        error = 8.0 / level.cells**2
        curve = Curve(np.array([0.0, 0.1]), np.array([1e9, 2e9 - 1e9 * error]))
        figures = {"skewness": level.settings.get("skew", 7.0)}
        return Measurement({"pressure": FieldError(error, 2.0 * error)}, figures, {"pressure": curve})

    def exact_curves(self, level):
        """A straight line."""
        return {"pressure": Curve(np.array([0.0, 0.1]), np.array([1e9, 2e9]))}

    def overall(self, results):
        """How many levels there were."""
        return {"levels_solved": float(len(results))}


class Good(Known):
    """Without the bound that is broken."""

    name = "good"
    bounds = Known.bounds[1:]


def outcome_of(report, figure):
    (verdict,) = (verdict for verdict in report.verdicts if verdict.bound.figure == figure)
    return verdict


@pytest.fixture(scope="module")
def report():
    return run_problem(Known(), Known.levels, FAST)


def test_levels_are_solved_and_measured(report):
    first, second, skewed = report.results
    assert (first.figures["pressure_l1"], second.figures["pressure_linf"]) == (8.0 / 64.0, 16.0 / 256.0)
    assert second.orders == {"pressure_l1": pytest.approx(2.0)}
    assert first.orders == skewed.orders == {}  # coarsest of their variants
    assert first.steps > 0
    assert first.particles == 8 * 10  # 8 in each cell of a column of 10
    assert first.cell_size == pytest.approx(0.1 / 8)
    assert (first.level.variant, skewed.level.variant) == ("", "skew=0.5")


def test_bounds_are_judged_where_they_are_closest(report):
    worst = outcome_of(report, "pressure_l1")
    assert (worst.outcome, worst.value, worst.level) == (Outcome.BROKEN, 0.125, Level(8))
    assert report.broken == (worst,)
    assert outcome_of(report, "pressure_l1_order").outcome is Outcome.HELD
    assert outcome_of(report, "skewness").value == 0.5  # 7.0 elsewhere does not matter
    assert outcome_of(report, "levels_solved").outcome is Outcome.HELD
    assert outcome_of(report, "levels_solved").level is None
    assert outcome_of(report, "nothing").outcome is Outcome.NOT_MEASURED


def test_every_problem_is_asked_for_conservation(report):
    """The bounds that the issue asks for, on figures of the run itself."""
    for name, high in (("energy_error", 1e-5), ("mass_error", 1e-6), ("momentum_error", 1e-5)):
        verdict = outcome_of(report, name)
        assert (verdict.outcome, verdict.bound.high) == (Outcome.HELD, high)
    leaky = [replace(result, energy_error=2e-5) for result in report.results]
    assert judge(outcome_of(report, "energy_error").bound, leaky, {}).outcome is Outcome.BROKEN


def test_not_a_number_breaks_a_bound(report):
    blind = [*report.results[:1], replace(report.results[1], momentum_error=math.nan)]
    verdict = judge(outcome_of(report, "momentum_error").bound, blind, {})
    assert (verdict.outcome, verdict.level) == (Outcome.BROKEN, Level(16))


@pytest.mark.parametrize(
    ("bound", "value", "margin"),
    [
        (Bound("x", high=2.0), 1.5, 0.5),
        (Bound("x", low=1.0), 0.5, -0.5),
        (Bound("x", 1.0, 2.0), 1.25, 0.25),
        (Bound("x", 1.0, 2.0), 2.5, -0.5),
    ],
)
def test_margin_of_a_bound(bound, value, margin):
    assert bound.margin(value) == margin
    assert bound.holds_for(value) == (margin >= 0.0)


def test_a_run_that_cannot_go_on_ends_its_problem_only():
    report = run_problem(Known(), ladder(8, 13, 16), FAST)
    assert report.failure == "known at 13 cells: step 3: no number"
    assert [result.level.cells for result in report.results] == [8]
    assert outcome_of(report, "pressure_l1").outcome is Outcome.BROKEN


def test_which_levels_are_solved():
    known = Known()
    assert chosen_levels(known) == list(known.levels)
    assert chosen_levels(known, full=True) == [*known.levels, Level(32)]
    assert chosen_levels(known, coarsest=1) == [Level(8), Level(8, {"skew": 0.5})]
    assert chosen_levels(known, coarsest=3) == [*ladder(8, 16, 32), Level(8, {"skew": 0.5})]
    only_full = Known()
    only_full.levels, only_full.more_levels = (), ladder(64)
    assert chosen_levels(only_full) == []
    assert chosen_levels(only_full, full=True) == chosen_levels(only_full, named=True) == [Level(64)]
    with pytest.raises(InputError, match="verify: levels: expected a whole number of at least 1, got 0"):
        chosen_levels(known, coarsest=0)


def test_which_problems_are_solved():
    known, good = Known(), Good()
    assert chosen_problems([known, good], []) == [known, good]
    assert chosen_problems([known, good], ["good", "known", "good"]) == [good, known]
    with pytest.raises(InputError, match=r"expected any of known, good, got 'goo'; did you mean good\?"):
        chosen_problems([known, good], ["goo"])


def verify_to(directory, problems, capsys, **arguments):
    """Run the command's work, and return what it printed and what it wrote."""
    console = Console(width=150)
    arguments = {"setup": FAST, "console": console, **arguments}
    error = ""
    try:
        verify(problems, [], directory, **arguments)
    except VerificationError as raised:
        error = str(raised)
    return capsys.readouterr().out, json.loads((directory / "verify.json").read_text()), error


def test_what_is_printed_and_written(tmp_path, capsys):
    text, written, error = verify_to(tmp_path, [Known(), Good()], capsys, coarsest=2)
    assert error == "verify: known: pressure_l1 at 8 cells: expected at most 0.1, got 0.1250"
    for words in ("L1 = sum of |h - exact|", "solving known: 16 cells", Known.title, Known.statement, "skew=0.5"):
        assert words in text
    assert "6 of 7" in text  # bounds of the first problem; `nothing` was not measured
    assert "6 of 6" in text
    assert (written["passed"], written["solver_is_default"], written["levels"]) == (False, True, 2)
    known, good = written["problems"]
    assert (known["name"], good["name"]) == ("known", "good")
    assert known["levels"][1]["figures"]["pressure_l1_order"] == pytest.approx(2.0)
    assert known["levels"][2]["settings"] == {"skew": 0.5}
    assert {bound["outcome"] for bound in known["bounds"]} == {"held", "broken", "not measured"}
    assert known["overall"] == {"levels_solved": 3.0}


def test_a_picture_of_each_problem(tmp_path, capsys):
    pytest.importorskip("matplotlib")
    verify_to(tmp_path, [Known(), Good()], capsys, coarsest=1)
    for name in ("known", "good"):
        assert (tmp_path / f"{name}.png").read_bytes().startswith(b"\x89PNG")


def test_without_matplotlib_all_but_the_pictures_is_there(tmp_path, capsys, monkeypatch):
    for name in ("warp_mpm.verification.pictures", "warp_mpm.output.figures"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    text, written, error = verify_to(tmp_path, [Good()], capsys, coarsest=1)
    assert "pictures: not drawn, matplotlib is missing" in text
    assert (written["passed"], error) == (True, "")
    assert not list(tmp_path.glob("*.png"))


def test_a_problem_that_stops_is_reported(tmp_path, capsys):
    problem = Good()
    problem.levels = ladder(8, 13)
    text, written, error = verify_to(tmp_path, [problem], capsys)
    assert error.startswith("verify: good at 13 cells: step 3: no number")
    assert "stopped: good at 13 cells" in text
    assert written["problems"][0]["failure"].endswith("no number")
    assert not written["passed"]


def test_other_settings_are_told_apart_from_the_defaults(tmp_path, capsys):
    config = SolverConfig(cfl=0.25)
    text, written, _ = verify_to(tmp_path, [Good()], capsys, coarsest=1, setup=replace(FAST, config=config))
    assert "Solver: cfl=0.25. The bounds are those of the defaults." in text
    assert (written["solver"]["cfl"], written["solver_is_default"]) == (0.25, False)


def test_progress_in_lines(capsys):
    """A line for the level, and another one once it takes long."""
    progress = level_progress(Console(width=80))
    progress.message("sod: 100 cells")
    progress.update(1.0, 2.0, 7, "")
    assert isinstance(progress, LevelLines)
    progress._printed -= 1000.0
    progress.update(1.0, 2.0, 8, "")
    progress.close()
    assert capsys.readouterr().out == "solving sod: 100 cells\n  50%, step 8\n"


def test_progress_on_a_terminal(capsys):
    progress = level_progress(Console(width=80, force_terminal=True))
    progress.update(0.5, 2.0, 1, "")  # before any level: nothing to show
    for level in ("sod: 100 cells", "sod: 200 cells"):
        progress.message(level)
        progress.update(1.0, 2.0, 7, "")
    progress.close()
    assert "sod: 200 cells" in capsys.readouterr().out


def test_a_missed_aim_breaks_nothing():
    """It is shown as missed; the same bound, not an aim, is broken."""
    results = run_problem(Known(), [Level(8)], FAST).results
    bound = Bound("pressure_l1", high=0.01)
    assert judge(replace(bound, aim=True), results, {}).outcome is Outcome.MISSED
    assert judge(bound, results, {}).outcome is Outcome.BROKEN
    assert judge(replace(bound, high=0.2, aim=True), results, {}).outcome is Outcome.HELD
