"""What passes over the nodes leave behind: nothing stale is ever read, and what is scattered to is empty before.

Grids hold values of earlier steps wherever nobody has written since. That these do not matter is tested by putting
worse there.
"""

import numpy as np
import pytest
from scenes_for_tests import (
    CELL,
    OPEN,
    ORDERS_AND_TRANSFERS,
    active_nodes,
    advance,
    audited,
    block,
    cell_content,
    inert_gas,
    node_array,
    nodes,
    particle_values,
    start,
)

from warp_mpm.config import ShapeFunction
from warp_mpm.kernels.blocks import EDGE
from warp_mpm.scene import Wall, Walls

GAS = inert_gas(1000.0, 1e6)
SOUND = np.sqrt(1.4 * 0.4 * 1e6)  # [m/s]
HUGE = 1e30  # still a number: times 0 it is 0
STEPS = 8
SHIFTED = 3e-4  # sums in another order round otherwise; a fifth of what this allows was seen, of velocities
CPU = "cpu"  # where bits are compared, whatever else there is: on a GPU atomic sums come in any order

orders = pytest.mark.parametrize(("order", "transfer"), ORDERS_AND_TRANSFERS)
shapes = pytest.mark.parametrize("shape", list(ShapeFunction), ids=lambda shape: shape.value)


def thrown(velocity):
    """Gives all particles a velocity."""

    def prepare(state):
        state.assign("velocity", np.tile(np.array(velocity, dtype=np.float32), (state.count, 1)))

    return prepare


def small_scene(walled):
    """Gas in the open, or with room at the upper end of a box whose walls it meets, next to faces of every kind."""
    if not walled:
        return block((4, 4, 3), material=GAS, walls=OPEN, margin_cells=5)
    walls = Walls(Wall.SLIP, Wall.OPEN, Wall.STICK, Wall.SLIP, Wall.SLIP, Wall.STICK)
    return block((6, 4, 3), material=GAS, walls=walls, margin_cells=(0, 5, 0, 2, 0, 0))


def step_phase_by_phase(solver, look):
    """One step, with a look at the grid before each phase."""
    for name, run in solver.phases():
        look(name)
        run()
    solver.steps_since_sort += 1
    solver.sort_if_due()
    look("next step")


def fill(array, value, where=slice(None)):
    """Fill an array's nodes with a value; not the one to spare."""
    values = array.numpy().copy()
    values[: len(where) if isinstance(where, np.ndarray) else None][where] = value
    array.assign(values)


def everything(solver):
    """What a run has come to, by name."""
    state = solver.state
    values = {**particle_values(state), "field": state.field_pressure().copy(), "density": state.field_density()}
    values["clock"] = np.array(list(state.clock_values()))
    values["impulses"] = state.impulses.numpy().copy()
    active = active_nodes(solver)
    values["start"] = nodes(solver)[active]
    if solver.model.damped:
        active[-1] = active[:, -1] = active[:, :, -1] = False  # no cells
        values["content"] = cell_content(solver)[active]
    return values


@pytest.mark.parametrize("walled", [False, True], ids=["free", "walled"])
@shapes
@orders
def test_no_pass_reads_what_was_not_written(order, transfer, shape, walled):
    """Not a bit changes if values are spoilt before they are written anew: in every step, before the nodes are solved.

    What the step before has left is used up by then. Blocks that particles have left count as written: as empty.
    """
    clean, spoilt = (start(small_scene(walled), CPU, order=order, transfer=transfer, shape=shape) for _ in range(2))
    grid = spoilt.state.grid
    before = active_nodes(spoilt)

    def spoil(phase):
        if phase not in ("solve grid", "solve momentum", "solve forces"):
            return
        written = (before | active_nodes(spoilt)).ravel()
        fill(grid.start, np.nan, written)
        for array in (grid.end, grid.damping, grid.content):
            fill(array, np.nan)
        if len(grid.reprojected) > 1:
            fill(grid.reprojected, HUGE, written)

    for _ in range(STEPS):
        before = active_nodes(spoilt)
        step_phase_by_phase(spoilt, spoil)
    advance(clean, STEPS)
    expected = everything(clean)
    for name, values in everything(spoilt).items():
        np.testing.assert_array_equal(values, expected[name], err_msg=name)
    assert np.abs(expected["velocity"]).max() > 0.1 * SOUND  # so that something happened
    if walled:
        assert np.abs(expected["impulses"]).max() > 0.0


@pytest.mark.parametrize("walled", [False, True], ids=["free", "walled"])
@shapes
@orders
def test_sums_are_empty_before_they_are_scattered_to(order, transfer, shape, walled, device):
    """Everywhere, to the last bit; those of the re-projection at the nodes that a particle's weight reaches.

    On a node a particle of linear shape pushes at those above, where it has no weight: all begin there.
    """

    def onto_nodes(state):
        state.assign("fraction", 0.0)

    scene = small_scene(walled)
    solver = start(scene, device, prepare=onto_nodes, order=order, transfer=transfer, shape=shape)
    looked = set()

    def look(phase):
        looked.add(phase)
        if phase in ("particles to grid", "momentum to grid"):
            for name in ("sums", "field"):
                assert not node_array(solver, name).any(), name
        if phase in ("particles to grid", "forces to grid", "next step") and solver.model.damped:
            assert not node_array(solver, "content_sums").any()
        if phase == "grid to particles and back" and len(solver.state.grid.end) > 0:
            reached = nodes(solver)[..., 3] > 0.0
            assert not node_array(solver, "reprojected")[reached].any()

    for _ in range(STEPS):
        step_phase_by_phase(solver, look)
    assert {"particles to grid", "momentum to grid"} & looked


@pytest.mark.parametrize("walled", [False, True], ids=["free", "walled"])
@shapes
@orders
def test_blocks_may_be_visited_in_any_order(order, transfer, shape, walled, monkeypatch):
    """Not a bit changes if each block is a task and they run backwards: no pass reads what it writes elsewhere.

    On a GPU all nodes are visited at a time.
    """
    scene = small_scene(walled)
    blocks = -(-(np.array(scene.domain.cells) + 3) // EDGE)
    monkeypatch.setattr("warp_mpm.state.GRID_SLOTS", int(np.prod(blocks)))
    forth, back = (start(scene, CPU, order=order, transfer=transfer, shape=shape) for _ in range(2))
    run = back.launcher.run
    monkeypatch.setattr(back.launcher, "run", lambda tasks, work: run(tasks[::-1], work))
    expected = everything(advance(forth, STEPS))
    for name, values in everything(advance(back, STEPS)).items():
        np.testing.assert_array_equal(values, expected[name], err_msg=name)


@shapes
@orders
def test_it_does_not_matter_where_blocks_and_rows_end(order, transfer, shape, device):
    """To round-off: gas at upper walls, some cells farther off the lower faces, so that rows and blocks end elsewhere.

    Nodes with no face near are solved by rows, some between the two one by one, those at faces on their own.
    """
    walls = Walls(Wall.OPEN, Wall.SLIP, Wall.OPEN, Wall.STICK, Wall.OPEN, Wall.SLIP)

    def run(shift):
        margins = np.add((3, 0, 3, 0, 3, 0), np.repeat(shift, 2) * (1, 0, 1, 0, 1, 0))
        scene = block((4, 4, 4), material=GAS, walls=walls, margin_cells=margins)
        solver = advance(start(scene, device, order=order, transfer=transfer, shape=shape), STEPS)
        return particle_values(solver.state), solver.state.peaks.numpy().max()

    expected, peak = run((0, 0, 0))
    for shift in ((0, 0, 1), (0, 0, 2), (0, 0, 3), (1, 2, 0), (3, 3, 2)):
        values, highest = run(shift)
        for name in ("position", "velocity", "density", "energy", "pressure"):
            scale = np.abs(expected[name]).max()
            np.testing.assert_allclose(values[name], expected[name], rtol=0, atol=SHIFTED * scale, err_msg=name)
        assert highest == pytest.approx(peak, rel=SHIFTED)


@orders
def test_blocks_that_particles_have_left_are_empty(order, transfer, device):
    """Gas flies through the grid: outside the blocks that its last scatter reached all nodes are at 0, without mass.

    For they are neighbours of nodes that are reached.
    """
    scene = block((3, 3, 3), material=GAS, walls=OPEN, margin_cells=(2, 24, 2, 10, 2, 10))
    solver = start(scene, device, order=order, transfer=transfer, prepare=thrown((8.0 * SOUND, 3.0 * SOUND, SOUND)))
    left = np.zeros_like(active_nodes(solver))
    for _ in range(20):
        before = active_nodes(solver)
        advance(solver, 3)
        active = active_nodes(solver)
        left |= before & ~active
        values = nodes(solver)
        assert not values[~active].any()
        assert values[active, 3].any()
    assert left.sum() > 20 * 4**3  # nodes of blocks of four cubed


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("cells", range(8, 12))
def test_gas_that_leaves_a_wall_leaves_nothing_behind_it(cells, axis, device):
    """Mass, momentum and energy are kept while gas flies off an upper wall: wherever blocks end, ghosts are in another.

    Ghosts lie behind walls, perhaps in a block that nothing reaches any more while their images are still reached.
    """
    size, margins, velocity = [3, 3, 3], [0.0] * 6, [0.0] * 3
    size[axis], margins[2 * axis], velocity[axis] = 3, cells - 3, -4.0 * SOUND
    scene = block(tuple(size), material=GAS, margin_cells=margins)
    solver = start(scene, device, prepare=thrown(velocity))
    audit = audited(solver, 20, every=1)
    place = particle_values(solver.state)["position"][:, axis]
    assert place.max() < (3 - 3) * CELL  # it has left where it was
    assert audit.mass_error < 1e-6
    assert audit.momentum_error < 1e-6
    assert audit.energy_error < 1e-6
