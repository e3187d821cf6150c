"""Solves problems level by level and judges them: everything `warp-mpm verify` does except showing it."""

import math
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

from warp_mpm.checks import closest_match, count, mistake
from warp_mpm.config import Save, SolverConfig
from warp_mpm.errors import SimulationError
from warp_mpm.progress import Progress, Silent
from warp_mpm.simulation import simulate
from warp_mpm.verification.norms import next_coarser, observed_orders
from warp_mpm.verification.problem import Bound, Level, LevelResult, Outcome, Problem, Verdict

# Round-off is that of single precision, 6e-8, gathered over thousands of steps.
CONSERVATION = (
    Bound("energy_error", high=1e-5, why="total energy is conserved to round-off"),
    Bound("mass_error", high=1e-6, why="mass is exact"),
    Bound("momentum_error", high=1e-5, why="momentum is conserved to round-off"),
)


@dataclass(frozen=True)
class Setup:
    """How the problems are solved: the same for all of them."""

    config: SolverConfig = field(default_factory=SolverConfig)
    device: str | None = None
    threads: int | None = None
    progress: Progress = field(default_factory=Silent)


@dataclass(frozen=True)
class ProblemReport:
    """A problem, solved and judged."""

    problem: Problem
    results: tuple[LevelResult, ...]
    overall: dict[str, float]  # figures that take several levels together
    verdicts: tuple[Verdict, ...]  # one a bound: where the figure comes closest to it, or breaks it most
    failure: str | None = None  # what stopped it; what was solved before is there

    @property
    def broken(self) -> tuple[Verdict, ...]:
        """The bounds that are broken."""
        return tuple(verdict for verdict in self.verdicts if verdict.outcome is Outcome.BROKEN)


def chosen_problems(problems: Sequence[Problem], names: Sequence[str]) -> list[Problem]:
    """The problems of these names, in this order; without names all of them.

    Raises:
        InputError: there is no problem of a name.
    """
    known = {problem.name: problem for problem in problems}
    for name in names:
        if name not in known:
            raise mistake("verify: problem", f"any of {', '.join(known)}", repr(name), closest_match(name, known))
    return [known[name] for name in dict.fromkeys(names)] if names else list(problems)


def chosen_levels(
    problem: Problem, *, named: bool = False, full: bool = False, coarsest: int | None = None
) -> list[Level]:
    """The levels to solve.

    Args:
        problem: whose levels.
        named: it was asked for by name; then one that has levels with --full only is solved with those.
        full: those that take long, too.
        coarsest: instead so many of each variant, however long they take.

    Raises:
        InputError: `coarsest` is not at least one.
    """
    every = [*problem.levels, *problem.more_levels]
    chosen = every if full or (named and not problem.levels) else list(problem.levels)
    if coarsest is None:
        return chosen
    variants = dict.fromkeys(level.variant for level in chosen)
    ladders = ([level for level in every if level.variant == variant] for variant in variants)
    kept = count("verify: levels", coarsest)
    return [level for steps in ladders for level in sorted(steps, key=lambda level: level.cells)[:kept]]


def run_problem(problem: Problem, levels: Iterable[Level], setup: Setup) -> ProblemReport:
    """Solve a problem at these levels and judge it. A run that cannot go on ends the problem, not the session."""
    results: list[LevelResult] = []
    failure = None
    try:
        for level in levels:
            setup.progress.message(f"{problem.name}: {words_of(level)}")
            result = solve_level(problem, level, setup)
            coarser = next_coarser(results, result)
            if coarser is not None:
                result = replace(result, orders=observed_orders(coarser, result))
            results.append(result)
    except SimulationError as error:
        failure = f"{problem.name} at {words_of(level)}: {error}"
    overall = dict(problem.overall(results)) if results else {}
    bounds = (*problem.bounds, *CONSERVATION) if problem.moves else problem.bounds
    verdicts = tuple(judge(bound, results, overall) for bound in bounds)
    return ProblemReport(problem, tuple(results), overall, verdicts, failure)


def solve_level(problem: Problem, level: Level, setup: Setup) -> LevelResult:
    """Simulate a level's scene and measure it.

    Raises:
        SimulationError: the run cannot go on.
        InputError: the device or the number of threads does not work, or there is too little memory.
    """
    begin = time.perf_counter()
    scene = problem.scene(level)
    result = simulate(
        scene,
        config=problem.solver_config(setup.config, level),
        save=Save(frames=2, figures=False),
        device=setup.device,
        threads=setup.threads,
        progress=_UpdatesOnly(setup.progress),
    )
    measurement = problem.measure(level, result)
    errors = (result.summary[f"{name}_error"] for name in ("energy", "mass", "momentum"))
    energy, mass, momentum = (math.nan if error is None else float(error) for error in errors)
    return LevelResult(
        level=level,
        cell_size=max(scene.domain.spacing),
        particles=scene.particle_count,
        steps=result.summary["steps"],
        seconds=time.perf_counter() - begin,
        measurement=measurement,
        energy_error=energy,
        mass_error=mass,
        momentum_error=momentum,
    )


def judge(bound: Bound, results: Sequence[LevelResult], overall: dict[str, float]) -> Verdict:
    """What came of a bound: of all levels to which it applies, the one that comes closest to it or breaks it most."""
    met: list[tuple[float, Level | None]] = [
        (result.figures[bound.figure], result.level)
        for result in results
        if bound.applies_to(result.level) and bound.figure in result.figures
    ]
    if bound.figure in overall:
        met.append((overall[bound.figure], None))
    if not met:
        return Verdict(bound, Outcome.NOT_MEASURED)
    value, level = min(met, key=lambda pair: bound.margin(pair[0]))
    failure = Outcome.MISSED if bound.aim else Outcome.BROKEN
    return Verdict(bound, Outcome.HELD if bound.holds_for(value) else failure, value, level)


def words_of(level: Level) -> str:
    """A level in a few words."""
    return f"{level.cells} cells" + (f", {level.variant}" if level.variant else "")


class _UpdatesOnly:
    """Passes on how far a run is, and not what it says about itself: that is the session's to say."""

    def __init__(self, progress: Progress) -> None:
        self._progress = progress

    def message(self, text: str) -> None:
        """Say nothing."""

    def update(self, time: float, end_time: float, step: int, note: str) -> None:
        """Pass it on."""
        self._progress.update(time, end_time, step, note)

    def close(self) -> None:
        """The session closes what it opened."""
