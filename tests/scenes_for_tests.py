"""Small scenes, and a solver on them without the run loop around it."""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import warp as wp

from warp_mpm.builder import SceneBuilder
from warp_mpm.config import Order, SolverConfig, Transfer
from warp_mpm.conservation import Audit, totals_of
from warp_mpm.detonators import Detonator, PointDetonator
from warp_mpm.errors import InputError
from warp_mpm.geometry import Box
from warp_mpm.kernels import transfer
from warp_mpm.kernels.blocks import EDGE
from warp_mpm.kernels.eos.ideal_gas import IdealGas
from warp_mpm.kernels.eos.jwl import JWL
from warp_mpm.kernels.precision import DIGITS
from warp_mpm.launch import Launcher, find_device
from warp_mpm.materials import Material, ammonium_nitrate
from warp_mpm.model import build_model
from warp_mpm.scene import Domain, Scene, Vector, Wall, Walls
from warp_mpm.solver import Solver
from warp_mpm.state import State

CELL = 0.01  # edge of a cell [m]
ROUND_OFF = 0.5**DIGITS  # of a number, relative; 6e-8 in single precision
OPEN = Walls.all(Wall.OPEN)
STICK = Walls.all(Wall.STICK)
TNT = JWL(density=1630.0, a=371.21e9, b=3.231e9, r1=4.15, r2=0.95, omega=0.30)  # its energy: 7e9 J/m3
CORNER = PointDetonator((0.0, 0.0, 0.0))


def _is_allowed(order: Order, transfer: Transfer) -> bool:
    try:
        SolverConfig(order=order, transfer=transfer)
    except InputError:
        return False
    return True


# Every order and transfer that may go together, as parameters of a test.
ORDERS_AND_TRANSFERS = [
    pytest.param(order, transfer, id=f"{order.value}-{transfer.value}")
    for order, transfer in itertools.product(Order, Transfer)
    if _is_allowed(order, transfer)
]


def explosive() -> Material:
    """The explosive of the paper: 1000 kg/m3, 2800 m/s, gamma = 2."""
    return ammonium_nitrate()


def inert_gas(density: float = 1.0, energy: float = 1e5, gamma: float = 1.4) -> Material:
    """An ideal gas that does not burn; energy in J/kg."""
    return Material("gas", density=density, equation_of_state=IdealGas(gamma), specific_energy=energy)


def block(
    cells: tuple[int, int, int],
    *,
    material: Material | None = None,
    detonators: Sequence[Detonator] = (),
    walls: Walls | None = None,
    margin_cells: float | Sequence[float] = 0,
    particles_per_axis: int = 2,
    gravity: Vector = (0.0, 0.0, 0.0),
    ambient_pressure: float = 0.0,
    end_time: float = 1.0,
) -> Scene:
    """A block of `cells` cubes of 10 mm from the origin on, of the paper's explosive if no material is given.

    Without other detonators an explosive is lit at the origin. `margin_cells` of vacuum, one number or one for each
    face, lie between the block and the faces of the domain.
    """
    material = material or explosive()
    builder = SceneBuilder("block")
    box = Box((0.0, 0.0, 0.0), (cells[0] * CELL, cells[1] * CELL, cells[2] * CELL))
    builder.domain(box.lower, box.upper, cells=cells, margins=np.multiply(margin_cells, CELL).tolist())
    builder.walls(walls or Walls())
    builder.charge(box, material, particles_per_axis=particles_per_axis, name="block")
    for detonator in detonators or ((CORNER,) if material.burn else ()):
        builder.detonator(detonator)
    builder.gravity(gravity)
    builder.ambient_pressure(ambient_pressure)
    builder.end_time(end_time)
    return builder.build()


def start(
    scene: Scene,
    device: str = "cpu",
    *,
    threads: int = 1,
    graphs: bool | None = None,
    ordered: bool | None = None,
    prepare: Callable[[State], None] | None = None,
    **config: Any,
) -> Solver:
    """A solver at the start of a scene; `prepare` may change the particles before their first scatter.

    `ordered` lets a CPU sum as a GPU does for a reproducible answer, and a GPU without being asked.
    """
    launcher = Launcher(find_device(device), threads, graphs)
    model = build_model(scene, SolverConfig(**config), launcher.device)
    state = State(model if ordered is None else replace(model, ordered=ordered))
    if prepare is not None:
        prepare(state)
    return Solver(state.model, state, launcher)


def advance(solver: Solver, steps: int) -> Solver:
    """Take some steps, sorting the particles when it is due; none may leave its reach."""
    for _ in range(steps):
        solver.step()
        solver.sort_if_due()
    assert not solver.state.faults.numpy().any()
    return solver


def audited(solver: Solver, steps: int, every: int = 5, audit: Audit | None = None) -> Audit:
    """Take some steps, with an audit of the conserved sums after every few; it begins before them, or goes on."""
    if audit is None:
        audit = Audit(np.array(solver.model.scene.gravity), solver.model.scene.mass)
        audit.add(totals_of(solver))
    for _ in range(steps // every):
        advance(solver, every)
        audit.add(totals_of(solver))
    return audit


def nodes(solver: Solver) -> np.ndarray:
    """Copy of all node values (nx + 3, ny + 3, nz + 3, 8), ghosts included, at a step's start: see `Grid.start`."""
    return node_array(solver, "start")


def node_array(solver: Solver, name: str) -> np.ndarray:
    """Copy of a nodal array of the grid (nx + 3, ny + 3, nz + 3, lanes), ghosts included."""
    shape = tuple(n + 3 for n in solver.model.scene.domain.cells)
    values = getattr(solver.state.grid, name).numpy()
    return values[: np.prod(shape)].reshape(*shape, -1).copy()


def cell_content(solver: Solver) -> np.ndarray:
    """Copy of what all cells hold (nx + 3, ny + 3, nz + 3, 2), ghosts included, in double: pressure [Pa] and filling.

    Cell (i, j, k) of the domain is at [i + 1, j + 1, k + 1]; the last layer along every axis is no cell.
    """
    return node_array(solver, "content").astype(np.float64)


def cell_sums(solver: Solver) -> np.ndarray:
    """The same after a scatter alone, unsolved: sum L V p [J] and sum L V [m3]."""
    return node_array(solver, "content_sums").astype(np.float64)


def active_nodes(solver: Solver) -> np.ndarray:
    """Whether each node (nx + 3, ny + 3, nz + 3) is in a block that the last scatter reached."""
    grid = solver.state.grid
    active = grid.stamps.numpy().reshape(tuple(grid.blocks)) == int(solver.state.clock_values()["step"])
    places = np.indices([n + 3 for n in solver.model.scene.domain.cells]) // EDGE
    return active[tuple(places)]


def scatter(solver: Solver) -> tuple[np.ndarray, np.ndarray]:
    """Scatter all particles onto an empty grid, without solving it; into the cells too if the solver does.

    Returns:
        Node sums (nx + 3, ny + 3, nz + 3, 8), momentum, mass, force, volume, and sum w V p (nx + 3, ...), in double.
    """
    state, model = solver.state, solver.model
    state.grid.sums.zero_()
    state.grid.field.zero_()
    state.grid.content_sums.zero_()
    kernel = transfer.scatter_kernel(model.shape, True, True, model.affine, model.damped)
    inputs = [state.particles, state.grid, state.clock, model.charges[0].half_width, model.scene.ambient_pressure, 0]
    wp.launch(kernel, state.count, inputs=inputs, device=state.device)
    sums = node_array(solver, "sums").astype(np.float64)
    return sums, state.grid.field.numpy()[: sums[..., 0].size, 0].reshape(sums.shape[:3]).astype(np.float64)


def tent_sums(domain: Domain, position: np.ndarray, carried: np.ndarray) -> np.ndarray:
    """What particles at positions (n, 3) carry (n, ...), shared out among the cells by tents at their centres.

    Returns:
        Sums (nx + 3, ny + 3, nz + 3, ...) in double, laid out as `cell_content`; what fell behind faces is still in the
        ghosts.
    """
    place = (position - domain.lower) / domain.spacing
    sums = np.zeros((*(n + 3 for n in domain.cells), *carried.shape[1:]))
    nearest = np.floor(place).astype(int)
    for shift in itertools.product((-1, 0, 1), repeat=3):  # the cell a particle is in, and all its neighbours
        cell = nearest + shift
        weights = np.maximum(1.0 - np.abs(place - (cell + 0.5)), 0.0).prod(axis=1)
        np.add.at(sums, tuple((cell + 1).T), (weights * carried.T).T)
    return sums


def mirrored_cells(sums: np.ndarray, walls: Walls) -> np.ndarray:
    """Cell sums (nx + 3, ny + 3, nz + 3, ...), ghosts behind walls added to what they mirror, then equal to it."""
    faces = walls.faces()
    for axis in range(3):
        sums = np.moveaxis(sums, axis, 0).copy()
        ends = [(0, 1, faces[2 * axis]), (-2, -3, faces[2 * axis + 1])]
        mirrors = [(ghost, cell) for ghost, cell, wall in ends if wall is not Wall.OPEN]
        for ghost, cell in mirrors:
            sums[cell] += sums[ghost]
        for ghost, cell in mirrors:
            sums[ghost] = sums[cell]
        sums = np.moveaxis(sums, 0, axis)
    return sums


def particle_values(state: State) -> dict[str, np.ndarray]:
    """Copies of all particle arrays, in creation order, positions (float64, [m]) among them."""
    names = ("cell", "fraction", "velocity", "mass", "density", "energy", "pressure", "viscous_pressure")
    values = {name: state.field(name) for name in names}
    place = values["cell"].astype(np.float64) + values["fraction"]
    values["position"] = place * state.model.spacing + state.model.scene.domain.lower
    return values
