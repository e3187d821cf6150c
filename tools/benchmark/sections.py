"""The sections of the benchmark: each measures one thing, and gives records with a unit in every name."""

import itertools
import statistics
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import warp as wp

from benchmark import runs
from benchmark.counts import Count, phase_counts
from benchmark.limits import measure_limits
from benchmark.memory import measure_memory
from benchmark.timing import Progress, interleaved, spread, thread_counts
from warp_mpm.config import Order, ShapeFunction, SolverConfig, Transfer
from warp_mpm.errors import InputError
from warp_mpm.launch import Launcher
from warp_mpm.solver import Solver

NANO = 1e-9
Record = dict[str, Any]
SHAPES = tuple(reversed(ShapeFunction))  # the default first
ORDERS = (
    (Order.MUSL, Transfer.DAMPED_FLIP),
    (Order.MUSL, Transfer.FLIP),
    (Order.USL, Transfer.FLIP),
    (Order.USF, Transfer.FLIP),
)


@dataclass(frozen=True)
class Effort:
    """How much is measured."""

    cells: int = 40  # along an edge of the cube; 8 particles each
    free_cells: int = 40  # of the cubes that run to their end, confined and free
    sizes: tuple[int, ...] = (18, 40, 63, 100)  # cells along an edge: 47 k to 8 M particles
    rounds: int = 5
    stream_bytes: int = 2**28  # of each of the two arrays that measure the memory bandwidth


@dataclass
class Bench:
    """What all sections share."""

    device: wp.Device
    threads: int  # the most
    effort: Effort
    progress: Progress
    launchers: dict[int, Launcher] = field(default_factory=dict)

    def launcher(self, threads: int | None = None) -> Launcher:
        """The launcher with so many threads, or with all."""
        threads = threads or self.threads
        if threads not in self.launchers:
            self.launchers[threads] = Launcher(self.device, threads)
        return self.launchers[threads]

    def few_threads(self) -> list[int]:
        """One thread, and all."""
        return sorted({1, self.threads})

    def close(self) -> None:
        """End all threads."""
        for launcher in self.launchers.values():
            launcher.close()


def limits(bench: Bench) -> list[Record]:
    """Memory bandwidth and multiply-add rate of the machine, on one thread and on all."""
    effort = bench.effort
    return measure_limits(bench.device, bench.few_threads(), effort.stream_bytes, 2 * effort.rounds, bench.progress)


def phases(bench: Bench, limits: Sequence[Mapping[str, float]]) -> Record:
    """Each phase of a default step, early in a run, beside what the machine's limits would allow."""
    solver = bench_cube(bench, bench.effort.cells)
    measures: dict[tuple[str, int], Callable[[], Any]] = {}
    for threads in bench.few_threads():
        measures["step", threads] = step_of(solver, bench.launcher(threads))
        measures["phases", threads] = phases_of(solver, bench.launcher(threads))
    bench.progress(f"phases: {solver.state.count:,} particles, {bench.effort.rounds} rounds")
    seconds = interleaved(measures, bench.effort.rounds)
    nodes = runs.nodes_per_particle(solver)
    counts = phase_counts(solver.model)
    columns = []
    for limit in limits:
        threads = int(limit["threads"])
        table = by_phase(seconds["phases", threads])
        rows = [
            {"phase": name, **_speed(values, solver), **_bound(counts.get(name, Count()), nodes, limit)}
            for name, values in table.items()
        ]
        for row in rows:
            row["percent_of_limit"] = 100.0 * row["limit_ns_per_particle_step"] / row["ns_per_particle_step"]
        columns.append({"threads": threads, **_speed(seconds["step", threads], solver), "phases": rows})
    return {"particles": solver.state.count, "nodes_per_particle": nodes, "columns": columns}


def variants(bench: Bench) -> list[Record]:
    """Every shape function with every order of the step."""
    configs = {
        (shape, order, transfer): SolverConfig(shape=shape, order=order, transfer=transfer)
        for shape, (order, transfer) in itertools.product(SHAPES, ORDERS)
    }
    solvers = {}
    for key, config in configs.items():
        bench.progress("variants: preparing " + " ".join(choice.value for choice in key))
        solvers[key] = runs.early(bench.effort.cells, bench.launcher(), config)
    bench.progress(f"variants: {len(solvers)} in turns, {bench.effort.rounds} rounds")
    measures = {key: step_of(solver, bench.launcher()) for key, solver in solvers.items()}
    seconds = interleaved(measures, bench.effort.rounds)
    return [
        {"shape": key[0].value, "order": key[1].value, "transfer": key[2].value, **_speed(seconds[key], solver)}
        for key, solver in solvers.items()
    ]


def threads(bench: Bench) -> list[Record]:
    """The same particles on 1, 2, ... threads."""
    solver = bench_cube(bench, bench.effort.cells)
    counts = thread_counts(bench.threads)
    bench.progress(f"threads: {', '.join(map(str, counts))} in turns, {bench.effort.rounds} rounds")
    measures = {count: step_of(solver, bench.launcher(count)) for count in counts}
    seconds = interleaved(measures, bench.effort.rounds)
    return [
        {
            "threads": count,
            **_speed(seconds[count], solver),
            **spread("speed_up_ratio", [one / many for one, many in zip(seconds[1], seconds[count], strict=True)]),
        }
        for count in counts
    ]


def sizes(bench: Bench) -> list[Record]:
    """Cubes of several sizes; one that does not fit into the memory is left out, and says so."""
    solvers: dict[int, Solver] = {}
    records: dict[int, Record] = {}
    for cells in bench.effort.sizes:
        particles = cells**3 * runs.PARTICLES_PER_CELL
        records[cells] = {"cells_along_an_edge": cells, "particles": particles}
        bench.progress(f"sizes: preparing {particles:,} particles")
        try:
            solvers[cells] = runs.early(cells, bench.launcher())
        except (InputError, MemoryError) as error:
            records[cells]["skipped"] = str(error) or "out of memory"
            bench.progress(f"sizes: {particles:,} particles left out: {records[cells]['skipped']}")
    bench.progress(f"sizes: {len(solvers)} in turns, {bench.effort.rounds} rounds")
    measures = {cells: step_of(solver, bench.launcher()) for cells, solver in solvers.items()}
    seconds = interleaved(measures, bench.effort.rounds)
    for cells, solver in solvers.items():
        records[cells].update(_speed(seconds[cells], solver))
    return list(records.values())


def late(bench: Bench) -> Record:
    """Early and late: a closed cube before and after the burn, a free one in its first and its last quarter."""
    cells, burn = bench.effort.free_cells, runs.burn_time(bench.effort.free_cells)
    end = runs.FREE_DURATION * burn
    instants = {  # in the middle of the quarters
        ("closed", "early"): (False, 0.0),
        ("closed", "late"): (False, runs.AFTER_THE_BURN * burn),
        ("free", "first quarter"): (True, 0.125 * end),
        ("free", "last quarter"): (True, 0.875 * end),
    }
    solvers, clocks = {}, {}
    for key, (free, instant) in instants.items():
        bench.progress(f"late: {key[0]} cube to {instant * 1e6:.0f} us")
        solvers[key] = runs.start(runs.cube(cells, free=free), bench.launcher())
        runs.advance(solvers[key], runs.FIRST_STEPS)
        clocks[key] = runs.advance_to(solvers[key], instant)
    bench.progress(f"late: four instants in turns, {bench.effort.rounds} rounds")
    measures = {key: phases_of(solver, bench.launcher()) for key, solver in solvers.items()}
    rounds = interleaved(measures, bench.effort.rounds)
    steps = {key: [sum(phases.values()) for phases in found] for key, found in rounds.items()}
    pairs = zip(steps["free", "last quarter"], steps["free", "first quarter"], strict=True)
    return {
        "free_last_to_first_quarter_ratio": statistics.median(last / first for last, first in pairs),
        "instants": [
            {
                "run": key[0],
                "instant": key[1],
                "time_s": clocks[key][0],
                "steps": clocks[key][1],
                "particles": solver.state.count,
                "share_of_mass_inside": runs.share_inside(solver),
                "nodes_per_particle": runs.nodes_per_particle(solver),
                **_speed(steps[key], solver),
                "phases": [{"phase": n, **_speed(values, solver)} for n, values in by_phase(rounds[key]).items()],
            }
            for key, solver in solvers.items()
        ],
    }


def memory(bench: Bench) -> Record:
    """Memory per particle of the default cube."""
    bench.progress("memory: a run in a process of its own")
    return measure_memory(bench.effort.cells, bench.device.alias, bench.threads)


def bench_cube(bench: Bench, cells: int) -> Solver:
    """A closed cube, early in its run."""
    bench.progress(f"preparing a cube of {cells} x {cells} x {cells} cells")
    return runs.early(cells, bench.launcher())


def step_of(solver: Solver, launcher: Launcher) -> Callable[[], float]:
    """What measures a step of a solver."""
    return lambda: runs.step_seconds(solver, launcher)


def phases_of(solver: Solver, launcher: Launcher) -> Callable[[], dict[str, float]]:
    """What measures the phases of a solver's step."""
    return lambda: runs.phase_seconds(solver, launcher)


def by_phase(rounds: Sequence[Mapping[str, float]]) -> dict[str, list[float]]:
    """Seconds by phase and round, of seconds by round and phase."""
    return {name: [one[name] for one in rounds] for name in rounds[0]}


def _speed(seconds: Sequence[float], solver: Solver) -> Record:
    particles = solver.state.count
    figures = spread("ns_per_particle_step", [value / particles / NANO for value in seconds])
    return {**figures, "particle_steps_per_s": particles / statistics.median(seconds)}


def _bound(count: Count, nodes_per_particle: float, limit: Mapping[str, float]) -> Record:
    """What a phase moves and does per particle, and the least time that this takes on this machine."""
    moved = count.bytes_per_particle(nodes_per_particle)
    done = count.operations_per_particle(nodes_per_particle)
    by_memory = moved / limit["memory_bandwidth_bytes_per_s"] / NANO
    by_arithmetic = done / limit["multiply_adds_per_s"] / NANO
    return {
        "memory_bytes_per_particle_step": moved,
        "operations_per_particle_step": done,
        "memory_limit_ns_per_particle_step": by_memory,
        "arithmetic_limit_ns_per_particle_step": by_arithmetic,
        "limit_ns_per_particle_step": max(by_memory, by_arithmetic),
    }
