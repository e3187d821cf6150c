"""What is timed: a cube of the paper's explosive, lit in its centre, confined or in vacuum, at chosen instants."""

import math

import numpy as np

import warp_mpm as mpm
from benchmark.timing import timed
from warp_mpm.conservation import totals_of
from warp_mpm.guards import check_memory, check_state
from warp_mpm.launch import Launcher
from warp_mpm.materials import ammonium_nitrate
from warp_mpm.model import build_model
from warp_mpm.solver import STEPS_BETWEEN_SORTS, Solver
from warp_mpm.state import State

CELL = 3e-3  # edge of a cell [m]
DETONATION_SPEED = 2800.0  # of the explosive [m/s]
PARTICLES_PER_AXIS = 2
PARTICLES_PER_CELL = PARTICLES_PER_AXIS**3
FIRST_STEPS = 10  # taken before anything is timed
TIMED_STEPS = 3  # at a time: few, because a run must not grow old while it is measured
SORT = "sort"  # what a sorting costs, shared by the steps between two of them
FOREVER = 1.0  # [s] an end time that no run here comes near, so that no step is clipped
AFTER_THE_BURN = 1.2  # a closed run is late at this many times the time the detonation takes
FREE_DURATION = 2.0  # a free run ends at this many times that time
MARGIN = 1.5  # of vacuum on every side of a free cube, in its edges


def burn_time(cells: int) -> float:
    """Time that the detonation takes from the centre of a cube to its corners [s]; `cells` along an edge."""
    return 0.5 * math.sqrt(3.0) * cells * CELL / DETONATION_SPEED


def cube(cells: int, *, free: bool = False) -> mpm.Scene:
    """A cube of explosive, `cells` along each edge, between slip walls, or free in vacuum and open beyond that."""
    builder = mpm.SceneBuilder("free_cube" if free else "cube")
    edge = cells * CELL
    box = mpm.Box((0.0, 0.0, 0.0), (edge, edge, edge))
    builder.domain(box.lower, box.upper, cells=(cells, cells, cells), margins=MARGIN * edge if free else 0.0)
    if free:
        builder.walls(mpm.Walls.all(mpm.Wall.OPEN))
    builder.charge(box, ammonium_nitrate(), particles_per_axis=PARTICLES_PER_AXIS)
    builder.detonator(mpm.PointDetonator((0.5 * edge, 0.5 * edge, 0.5 * edge)))
    builder.end_time(FOREVER)
    return builder.build()


def start(scene: mpm.Scene, launcher: Launcher, config: mpm.SolverConfig | None = None) -> Solver:
    """A solver at the start of a scene.

    Raises:
        InputError: it does not fit into the free memory.
    """
    model = build_model(scene, config or mpm.SolverConfig(), launcher.device)
    check_memory(model)
    return Solver(model, State(model), launcher)


def advance(solver: Solver, steps: int) -> None:
    """Take some steps, untimed.

    Raises:
        SimulationError: the run broke down.
    """
    for _ in range(steps):
        solver.step()
        solver.sort_if_due()
    check_state(solver.state, steps)


def advance_to(solver: Solver, instant: float) -> tuple[float, int]:
    """Take steps until a time [s], untimed; returns the time and the number of steps since the start."""
    while float(solver.state.clock_values()["time"]) < instant:
        advance(solver, 4)
    clock = solver.state.clock_values()  # on a CPU a view of what changes
    return float(clock["time"]), int(clock["step"])


def early(cells: int, launcher: Launcher, config: mpm.SolverConfig | None = None) -> Solver:
    """A closed cube, some steps after its start."""
    solver = start(cube(cells), launcher, config)
    advance(solver, FIRST_STEPS)
    return solver


def take_steps(solver: Solver) -> None:
    """The steps that are timed."""
    for _ in range(TIMED_STEPS):
        solver.step()


def step_seconds(solver: Solver, launcher: Launcher) -> float:
    """Seconds that a step takes now, on the threads of a launcher, its share of a sorting included."""
    solver.launcher = launcher
    device = launcher.device
    sorting = timed(device, solver.sort)
    stepping = timed(device, lambda: take_steps(solver))
    return stepping / TIMED_STEPS + sorting / STEPS_BETWEEN_SORTS


def phase_seconds(solver: Solver, launcher: Launcher) -> dict[str, float]:
    """Seconds that each phase of a step takes now, by name, and the step's share of a sorting."""
    solver.launcher = launcher
    device = launcher.device
    seconds = {SORT: timed(device, solver.sort) / STEPS_BETWEEN_SORTS}
    for _ in range(TIMED_STEPS):
        for name, run in solver.phases():
            seconds[name] = seconds.get(name, 0.0) + timed(device, run) / TIMED_STEPS
    return seconds


def share_inside(solver: Solver) -> float:
    """Share of the mass that has not left the domain."""
    return totals_of(solver).mass / solver.model.scene.mass


def nodes_per_particle(solver: Solver) -> float:
    """Nodes that the particles' stencils reach, for each particle."""
    width = solver.model.shape.width
    domain = solver.model.scene.domain
    place = (solver.state.positions() - np.array(domain.lower)) / np.array(domain.spacing)
    nearest = np.floor(place + (0.5 if width == 3 else 0.0)).astype(int) + 1
    reached = np.zeros([n + 4 for n in domain.cells], dtype=bool)
    reached[tuple(nearest.T)] = True
    for axis in range(3):
        across = reached.copy()
        for shift in (-1, 1) if width == 3 else (1,):
            across |= np.roll(reached, shift, axis)
        reached = across
    return float(reached.sum()) / solver.state.count
