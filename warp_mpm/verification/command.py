"""The command `warp-mpm verify`."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from rich.console import Console

from warp_mpm.errors import VerificationError
from warp_mpm.guards import writable_directory
from warp_mpm.kernels.precision import PRECISION
from warp_mpm.verification.problem import Level, Problem
from warp_mpm.verification.progress import level_progress
from warp_mpm.verification.report import broken_bounds, print_opening, print_problem, print_verdict, write_json
from warp_mpm.verification.session import ProblemReport, Setup, chosen_levels, chosen_problems, run_problem

WIDTH = 132  # of what is not printed on a terminal [characters]


def verify(
    problems: Sequence[Problem],
    names: Sequence[str],
    output: Path,
    *,
    full: bool = False,
    coarsest: int | None = None,
    setup: Setup | None = None,
    console: Console | None = None,
) -> list[ProblemReport]:
    """Solve problems, print tables, draw pictures and write verify.json.

    Args:
        problems: those there are.
        names: of the problems to solve, in this order; none: all that have levels.
        output: directory, made if need be.
        full: solve the levels that take long, too.
        coarsest: instead so many levels of each variant.
        setup: how to solve; the defaults if not given.
        console: where to print; standard output if not given.

    Raises:
        InputError: an unknown problem, not at least one level, a device that does not work, or no place to write.
        VerificationError: a bound is broken, or a run could not go on; everything has been printed and written.
    """
    console = console or _standard_output()
    chosen = _chosen(problems, names, full, coarsest)
    directory = writable_directory(output)
    setup = replace(setup or Setup(), progress=level_progress(console))
    draw = _painter(console)
    print_opening(console, setup.config)
    reports: list[ProblemReport] = []
    run = {"full": full, "levels": coarsest, "device": setup.device, "threads": setup.threads, "precision": PRECISION}
    for problem, levels in chosen:
        try:
            reports.append(run_problem(problem, levels, setup))
        finally:
            setup.progress.close()
        print_problem(console, reports[-1])
        if draw is not None and reports[-1].results and problem.panels:
            draw(directory / f"{problem.name}.png", reports[-1])
        write_json(directory / "verify.json", reports, setup.config, run)  # each time: an interrupt loses nothing
    print_verdict(console, reports)
    console.print(f"files in {directory}", highlight=False, markup=False, soft_wrap=True)
    broken = broken_bounds(reports)
    if broken:
        raise VerificationError(f"verify: {broken}")
    return reports


def print_problems(problems: Sequence[Problem]) -> None:
    """Print the names of the problems and what they are."""
    width = max((len(problem.name) for problem in problems), default=0)
    for problem in problems:
        print(f"{problem.name:{width}}  {problem.title}" + ("" if problem.levels else " (by name, or with --full)"))


def _chosen(
    problems: Sequence[Problem], names: Sequence[str], full: bool, coarsest: int | None
) -> list[tuple[Problem, list[Level]]]:
    """Each chosen problem with the levels to solve."""
    chosen = chosen_problems(problems, names)
    ladders = [chosen_levels(problem, named=bool(names), full=full, coarsest=coarsest) for problem in chosen]
    return [(problem, levels) for problem, levels in zip(chosen, ladders, strict=True) if levels]


def _painter(console: Console) -> Callable[[Path, ProblemReport], None] | None:
    """What draws pictures; None, said aloud, where matplotlib is missing."""
    try:
        from warp_mpm.verification.pictures import draw_problem
    except ImportError:
        console.print("pictures: not drawn, matplotlib is missing; pip install matplotlib", style="yellow")
        return None
    return draw_problem


def _standard_output() -> Console:
    """Standard output; wide enough for the tables where there is no terminal to ask."""
    console = Console()
    return console if console.is_terminal else Console(width=WIDTH)
