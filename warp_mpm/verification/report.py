"""Shows what came of the problems: tables for a person, `verify.json` for a program."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from warp_mpm.config import SolverConfig
from warp_mpm.output.tables import DASH, write_summary
from warp_mpm.verification.norms import DEFINITION
from warp_mpm.verification.problem import Bound, LevelResult, Outcome, Verdict
from warp_mpm.verification.session import ProblemReport, words_of
from warp_mpm.version import VERSION

MILLIMETRE = 1e-3  # [m]
SHORT = {"pressure": "p", "velocity": "u", "density": "rho"}
COLORS = {
    Outcome.HELD: "green",
    Outcome.BROKEN: "bold red",
    Outcome.MISSED: "yellow",
    Outcome.NOT_MEASURED: "yellow",
}


def settings_that_differ(config: SolverConfig) -> dict[str, Any]:
    """The solver settings that are not the defaults: bounds were set for those."""
    default = SolverConfig()
    names = (item.name for item in fields(config))
    return {name: getattr(config, name) for name in names if getattr(config, name) != getattr(default, name)}


# ---- for a person ----------------------------------------------------------------------------------------------------


def print_opening(console: Console, config: SolverConfig) -> None:
    """Say how errors are defined, and whether the solver's settings are those for which the bounds were set."""
    console.print(f"Errors: {DEFINITION}.", highlight=False, markup=False)
    different = settings_that_differ(config)
    if different:
        words = " ".join(f"{name}={getattr(value, 'value', value)}" for name, value in different.items())
        console.print(f"Solver: {words}. The bounds are those of the defaults.", highlight=False, markup=False)


def print_problem(console: Console, report: ProblemReport) -> None:
    """Print a problem: what it is, errors at each level, its other figures, and its bounds."""
    problem = report.problem
    console.print()
    console.print(Text.assemble((problem.name, "bold"), f"  {problem.title}"))
    console.print(f"{problem.statement} [{problem.reference}]", highlight=False, markup=False)
    if report.results:
        console.print(error_table(report))
    if report.overall or any(result.measurement.figures for result in report.results):
        console.print(figure_table(report))
    if report.failure is not None:
        console.print(f"stopped: {report.failure}", style="bold red", highlight=False, markup=False)
    console.print(bound_table(report.verdicts))


def print_verdict(console: Console, reports: Sequence[ProblemReport]) -> None:
    """Print one line a problem: bounds that hold, aims missed, seconds, verdict."""
    table = _table("problem", "bounds held", "aims missed", "s", "verdict")
    for report in reports:
        held = sum(verdict.outcome is Outcome.HELD for verdict in report.verdicts)
        missed = sum(verdict.outcome is Outcome.MISSED for verdict in report.verdicts)
        measured = sum(verdict.outcome in (Outcome.HELD, Outcome.BROKEN) for verdict in report.verdicts)
        failed = bool(report.broken or report.failure)
        verdict = Text("BROKEN" if failed else "held", COLORS[Outcome.BROKEN if failed else Outcome.HELD])
        seconds = sum(result.seconds for result in report.results)
        table.add_row(
            report.problem.name, f"{held} of {measured}", str(missed) if missed else "", f"{seconds:.1f}", verdict
        )
    console.print()
    console.print(table)


def error_table(report: ProblemReport) -> Table:
    """A row a level: errors of the fields with observed orders, conservation of energy, time."""
    names = list(dict.fromkeys(name for result in report.results for name in result.measurement.errors))
    variants = any(result.level.variant for result in report.results)
    headings = [f"cells of\n{report.problem.cells_across}", "\nh, mm"]
    for name in names:
        short = SHORT.get(name, name)
        headings += [f"{short}\nL1", "\norder", f"{short}\nLinf"]
    table = _table(*(["variant"] if variants else []), *headings, "energy\nerror", "\ns")
    for result in report.results:
        row = [str(result.level.cells), f"{result.cell_size / MILLIMETRE:.4g}"]
        for name in names:
            error = result.measurement.errors.get(name)
            order = result.orders.get(f"{name}_l1")
            row += [DASH] * 3 if error is None else [number(error.l1), _order(order), number(error.linf)]
        row += [f"{result.energy_error:.0e}", f"{result.seconds:.1f}"]
        table.add_row(*([result.level.variant] if variants else []), *row)
    return table


def figure_table(report: ProblemReport) -> Table:
    """A row a figure that the problem measured, a column a level."""
    table = _table("figure", *(_column_of(result) for result in report.results), *(["all"] if report.overall else []))
    names = dict.fromkeys(name for result in report.results for name in result.measurement.figures)
    for name in names:
        values = (result.measurement.figures.get(name) for result in report.results)
        table.add_row(name, *(number(value) for value in values))
    for name, value in report.overall.items():
        table.add_row(name, *[""] * len(report.results), number(value))
    return table


def bound_table(verdicts: Sequence[Verdict]) -> Table:
    """A row a bound."""
    table = _table("bound", "expected", "got", "where", "verdict", "why")
    for column in (3, 5):
        table.columns[column].justify = "left"
    for verdict in verdicts:
        bound = verdict.bound
        value = DASH if verdict.value is None else number(verdict.value)
        where = words_of(verdict.level) if verdict.level is not None else ""
        outcome = Text(verdict.outcome.value, COLORS[verdict.outcome])
        expected = f"aim: {_range_of(bound)}" if bound.aim else _range_of(bound)
        table.add_row(bound.figure, expected, value, where, outcome, bound.why)
    return table


def broken_bounds(reports: Sequence[ProblemReport]) -> str:
    """One line that names every broken bound and what stopped a problem; empty if all is well."""
    words = [report.failure for report in reports if report.failure is not None]
    for report in reports:
        for verdict in report.broken:
            where = f" at {words_of(verdict.level)}" if verdict.level is not None else ""
            got = f"expected {_range_of(verdict.bound)}, got {number(verdict.value)}"
            words.append(f"{report.problem.name}: {verdict.bound.figure}{where}: {got}")
    return "; ".join(words)


def number(value: float | None) -> str:
    """A figure in four digits, small ones with an exponent."""
    if value is None or math.isnan(value):
        return DASH
    return f"{value:.4f}" if 5e-4 <= abs(value) < 100.0 or value == 0.0 else f"{value:.2e}"


def _order(value: float | None) -> str:
    return DASH if value is None or math.isnan(value) else f"{value:.2f}"


def _range_of(bound: Bound) -> str:
    if bound.low is None and bound.high is None:
        return DASH
    if bound.low is None:
        return f"at most {bound.high:g}"
    return f"at least {bound.low:g}" if bound.high is None else f"{bound.low:g} to {bound.high:g}"


def _column_of(result: LevelResult) -> str:
    variant = result.level.variant.replace(" ", "\n")
    return f"{result.level.cells} cells" + (f"\n{variant}" if variant else "")


def _table(*headings: str) -> Table:
    """A table whose first column is left and whose others are right."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for place, heading in enumerate(headings):
        table.add_column(heading, justify="right" if place else "left", vertical="bottom")
    return table


# ---- for a program ---------------------------------------------------------------------------------------------------


def write_json(path: Path, reports: Sequence[ProblemReport], config: SolverConfig, run: Mapping[str, Any]) -> None:
    """Write verify.json: everything in the tables, and nothing rounded. What is not a number becomes null.

    Args:
        path: of the file.
        reports: in the order in which they were solved.
        config: the solver's settings.
        run: further keys: how the command was called.

    Raises:
        SimulationError: the disk is full or refuses.
    """
    settings = {item.name: getattr(config, item.name) for item in fields(config)}
    content = {
        "version": VERSION,
        **run,
        "error_definition": DEFINITION,
        "solver": settings,
        "solver_is_default": not settings_that_differ(config),
        "passed": not any(report.broken or report.failure for report in reports),
        "seconds": sum(result.seconds for report in reports for result in report.results),
        "problems": [_problem_values(report) for report in reports],
    }
    write_summary(path, content)


def _problem_values(report: ProblemReport) -> dict[str, Any]:
    problem = report.problem
    return {
        "name": problem.name,
        "title": problem.title,
        "statement": problem.statement,
        "reference": problem.reference,
        "cells_across": problem.cells_across,
        "levels": [_level_values(result) for result in report.results],
        "overall": report.overall,
        "bounds": [_verdict_values(verdict) for verdict in report.verdicts],
        "failure": report.failure,
    }


def _level_values(result: LevelResult) -> dict[str, Any]:
    return {
        "cells": result.level.cells,
        "settings": result.level.settings,
        "cell_size_m": result.cell_size,
        "particles": result.particles,
        "steps": result.steps,
        "seconds": result.seconds,
        "figures": result.figures,
    }


def _verdict_values(verdict: Verdict) -> dict[str, Any]:
    bound, level = verdict.bound, verdict.level
    return {
        "figure": bound.figure,
        "low": bound.low,
        "high": bound.high,
        "from_cells": bound.from_cells,
        "settings": bound.settings,
        "why": bound.why,
        "aim": bound.aim,
        "outcome": verdict.outcome,
        "value": verdict.value,
        "level": None if level is None else {"cells": level.cells, "settings": level.settings},
    }
