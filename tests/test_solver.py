"""The solver: every variant runs, any number of threads gives the same bits, particles keep their identity, time steps.

Scenes are small: that one thread takes them all is undone where threads are what is tested.
"""

import functools
import itertools

import numpy as np
import pytest
import warp as wp
from scenes_for_tests import (
    CELL,
    OPEN,
    ORDERS_AND_TRANSFERS,
    ROUND_OFF,
    advance,
    audited,
    block,
    explosive,
    inert_gas,
    particle_values,
    start,
)

from warp_mpm import launch, simulation
from warp_mpm.builder import SceneBuilder
from warp_mpm.config import Order, Save, ShapeFunction, SolverConfig, Transfer
from warp_mpm.conservation import totals_of
from warp_mpm.detonators import PointDetonator
from warp_mpm.errors import SimulationError
from warp_mpm.geometry import Box
from warp_mpm.guards import check_faults
from warp_mpm.kernels import motion
from warp_mpm.kernels.precision import scalar, vector3
from warp_mpm.scene import Wall, Walls
from warp_mpm.simulation import simulate
from warp_mpm.state import LAST_FRACTION, State

SPEED = 2800.0  # [m/s]

# ---- every variant ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("shape", list(ShapeFunction), ids=lambda shape: shape.value)
@pytest.mark.parametrize(("order", "transfer"), ORDERS_AND_TRANSFERS)
def test_every_variant_runs(order, transfer, shape, device):
    """30 steps with finite values, exact mass and the energy error that each variant is known to have.

    FLIP with MUSL conserves energy to round-off (`test_conservation.py`), the textbook updates to about a percent, and
    APIC loses the velocities that the grid cannot see: 2-3 % (DESIGN.md, section 3), more in a few cells.
    """
    solver = start(block((6, 4, 3)), device, shape=shape, order=order, transfer=transfer)
    audit = audited(solver, 30)
    values = particle_values(solver.state)
    assert all(np.isfinite(value).all() for value in values.values())
    assert np.isfinite(solver.state.field_pressure()).all()
    assert audit.mass_error < 1e-6
    exact = order is Order.MUSL and transfer is not Transfer.APIC
    assert audit.energy_error < (1e-6 if exact else 0.05)
    assert values["pressure"].max() > 0.3 * explosive().cj.pressure


# ---- threads ---------------------------------------------------------------------------------------------------------


def run_on(threads, **config):
    """Bits of everything after 60 steps over five slabs, some of which gas enters, and leaves through an open face."""
    scene = block(
        (70, 4, 3),
        walls=Walls(x_high=Wall.OPEN, y_high=Wall.STICK),
        margin_cells=(0, 3, 0, 0, 0, 0),
        detonators=[PointDetonator((0.0, 0.0, 0.0)), PointDetonator((0.7, 0.0, 0.0)), PointDetonator((0.3, 0.0, 0.0))],
    )
    solver = advance(start(scene, threads=threads, **config), 60)
    state = solver.state
    totals = totals_of(solver)
    assert len(solver.model.scene.charges) == 1
    assert solver.model.slab_count == 5
    assert totals.mass_out[1] > 0.0
    bits = particle_values(state)
    bits["memory order"] = state.particles.index.numpy().copy()
    bits["field pressure"] = state.field_pressure().copy()
    bits["clock"] = np.array(list(state.clock_values()))
    bits["impulse"] = totals.wall_impulse
    bits["sums"] = np.array([totals.kinetic, totals.internal, totals.grid_mass, totals.energy_out, *totals.momentum])
    solver.launcher.close()
    return bits


@pytest.mark.parametrize(("order", "transfer"), [(Order.MUSL, Transfer.DAMPED_FLIP), (Order.USF, Transfer.APIC)])
def test_any_number_of_threads_gives_the_same_bits(order, transfer, monkeypatch):
    """One thread, two or three, and more tasks than threads: slabs and sums depend on the domain alone."""
    alone = run_on(1, order=order, transfer=transfer)
    monkeypatch.setattr(launch, "SMALLEST_SHARED_WORK", 0)
    submitted = []
    submit = launch.ThreadPoolExecutor.submit

    def counted(pool, *args):
        submitted.append(pool)
        return submit(pool, *args)

    monkeypatch.setattr(launch.ThreadPoolExecutor, "submit", counted)
    for threads in (2, 3):
        shared = run_on(threads, order=order, transfer=transfer)
        for name, expected in alone.items():
            np.testing.assert_array_equal(shared[name], expected, err_msg=f"{name}, {threads} threads")
    assert len(submitted) > 2 * 60 * 10  # the pool was really used


# ---- identity --------------------------------------------------------------------------------------------------------


def test_particles_keep_their_identity(device):
    """Values come in creation order though sorting changes the order in memory: a tag in the mass stays where it was.

    Two charges, created in an order that is not that of the cells, and mixed by the detonation.
    """
    builder = SceneBuilder("pair")
    builder.domain((0.0, 0.0, 0.0), (0.4, 0.04, 0.04), cell_size=CELL)
    builder.charge(Box((0.2, 0.0, 0.0), (0.4, 0.04, 0.04)), inert_gas(10.0), name="gas", particles_per_axis=1)
    builder.charge(Box((0.0, 0.0, 0.0), (0.2, 0.04, 0.04)), explosive(), name="charge")
    builder.detonator(PointDetonator((0.2, 0.0, 0.0)))
    builder.end_time(1.0)
    scene = builder.build()
    count = scene.particle_count
    tags = 1.0 + 1e-3 * np.random.default_rng(8).permutation(count) / count

    def tag(state):
        index = state.particles.index.numpy()
        state.particles.mass.assign((state.particles.mass.numpy() * tags[index]).astype(np.float32))

    solver = start(scene, device, prepare=tag)
    before = particle_values(solver.state)
    place = np.concatenate([charge.positions for charge in scene.charges])
    np.testing.assert_allclose(before["position"], place, rtol=0, atol=ROUND_OFF * CELL)
    first_order = solver.state.particles.index.numpy().copy()
    previous = before["position"]
    for _ in range(6):
        advance(solver, 25)
        position = particle_values(solver.state)["position"]
        # Nobody moves by more than 0.3 cells and a bit a step, and the layout is not shuffled.
        assert np.abs(position - previous).max() < 25 * 0.5 * CELL
        np.testing.assert_allclose(solver.state.positions(), position, rtol=1e-6)
        previous = position
    order = solver.state.particles.index.numpy()
    assert np.any(order != first_order)
    np.testing.assert_array_equal(np.sort(order), np.arange(count))
    np.testing.assert_array_equal(particle_values(solver.state)["mass"], before["mass"])
    gas = solver.state.field("energy")[: len(scene.charges[0].positions)]
    assert np.abs(previous - place).max() > 5 * CELL  # it did move, so that cells changed
    assert gas.min() > 0.0


def test_memory_is_ordered_by_slab_charge_and_cell(device):
    """After a sort, keys (slab, charge, cell) rise; ranges name the particles of each slab and charge."""
    solver = advance(start(block((40, 3, 2)), device), 30)
    solver.sort()
    state, model = solver.state, solver.model
    cell = state.particles.cell.numpy().astype(int)
    slab = cell[:, 0] // model.slabs.thickness
    nx, ny, nz = model.scene.domain.cells
    flat = (cell[:, 0] * ny + cell[:, 1]) * nz + cell[:, 2]
    assert np.all(np.diff(slab * nx * ny * nz + flat) >= 0)
    for number, (begin, count) in enumerate(state.ranges[:, 0]):
        assert np.all(slab[begin : begin + count] == number)
    assert state.ranges[..., 1].sum() == state.count


def test_frames_do_not_change_the_physics(device):
    """2 frames or 23: not a bit of difference, for steps are never cut for a frame."""
    scene = block((8, 4, 3), end_time=40e-6)
    few, many = (simulate(scene, save=Save(frames=n), device=device, threads=1) for n in (2, 23))
    assert len(few.history) == 2
    assert len(many.history) == 23
    assert few.summary["steps"] == many.summary["steps"] > 20
    np.testing.assert_array_equal(few.record.time, many.record.time)
    np.testing.assert_array_equal(few.record.field_pressure, many.record.field_pressure)
    if device == "cpu":  # on a GPU the order of atomic sums is the machine's
        one, other = particle_values(few.state), particle_values(many.state)
        for name in one:
            np.testing.assert_array_equal(one[name], other[name], err_msg=name)


# ---- where particles go ----------------------------------------------------------------------------------------------


@functools.cache
def place_kernel():
    """Kernel that moves one particle a thread."""

    @wp.kernel(enable_backward=False, module="unique")
    def evaluate(
        faces: motion.Faces,
        cells: wp.array(dtype=wp.vec3s),
        fractions: wp.array(dtype=vector3),
        ways: wp.array(dtype=vector3),
        rows: wp.array2d(dtype=scalar),
    ):
        n = wp.tid()
        domain = wp.vec3i(10, 10, 10)
        after = motion.place(domain, faces, cells[n], fractions[n], ways[n])
        for axis in range(3):
            rows[n, axis] = scalar(after.cell[axis])
            rows[n, 3 + axis] = after.fraction[axis]
        rows[n, 6] = scalar(after.left_through)
        rows[n, 7] = wp.where(after.fault, scalar(1.0), scalar(0.0))

    return evaluate


PLACES = {  # cell, fraction and displacement along x -> cell, fraction, face left through, fault
    "within its cell": ((3, 0.25, 0.5), (3, 0.75, -1, False)),
    "up a cell": ((3, 0.75, 0.5), (4, 0.25, -1, False)),
    "down two cells": ((3, 0.25, -1.5), (1, 0.75, -1, False)),
    "onto a face": ((3, 0.5, 0.5), (4, 0.0, -1, False)),
    "a rounding below a face": ((3, 0.0, -1e-10), (2, float(LAST_FRACTION), -1, False)),
    "through the open low face": ((0, 0.25, -0.5), (0, 0.0, 0, False)),
    "through the open high face": ((9, 0.75, 3.5), (9, float(LAST_FRACTION), 1, False)),
    "absurdly far": ((3, 0.25, 4.5), (None, None, -1, True)),
}


@pytest.mark.parametrize("case", PLACES.values(), ids=PLACES.keys())
def test_where_a_particle_goes(case, device):
    """A cell and a fraction of it, 0 <= f < 1; out through an open face; a fault where no stencil may go."""
    (cell, fraction, way), (new_cell, new_fraction, face, fault) = case
    row = placed((cell, 5, 5), (fraction, 0.5, 0.5), (way, 0.0, 0.0), device)
    assert row[6] == face
    assert bool(row[7]) is fault
    if new_cell is not None:
        assert row[0] == new_cell
        assert row[3] == np.float32(new_fraction)
        assert tuple(row[1:3]) == (5.0, 5.0)
        assert tuple(row[4:6]) == (0.5, 0.5)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("way", [np.nan, 4.5, -np.inf])
def test_no_way_is_too_far_along_one_axis(axis, way, device):
    """One component that is no number, or too large, is a fault whatever the others are."""
    ways = np.zeros(3)
    ways[axis] = way
    row = placed((3, 5, 5), (0.25, 0.5, 0.5), ways, device)
    assert row[7] == 1.0
    assert row[6] == -1.0


@pytest.mark.parametrize(("cell", "fraction", "way"), [(0, 0.0, -1e-4), (9, 0.99999, 1e-3), (0, 0.5, -0.75)])
def test_no_particle_passes_a_wall(cell, fraction, way, device):
    """Y faces are walls here: what would cross one by round-off, or more, stays on it."""
    row = placed((4, cell, 5), (0.5, fraction, 0.5), (0.0, way, 0.0), device)
    assert row[1] == cell
    assert row[4] == (0.0 if way < 0.0 else LAST_FRACTION)
    assert row[6] == -1.0
    assert row[7] == 0.0


def placed(cell, fraction, way, device):
    """Where `motion.place` puts a particle; only the faces along x are open."""
    faces = motion.Faces()
    faces.open[0], faces.open[1] = 1, 1
    rows = wp.zeros((1, 8), dtype=scalar, device=device)
    given = [
        wp.array(np.array([cell], dtype=np.int16), dtype=wp.vec3s, device=device),
        wp.array(np.array([fraction], dtype=np.float32), dtype=vector3, device=device),
        wp.array(np.array([way], dtype=np.float32), dtype=vector3, device=device),
    ]
    wp.launch(place_kernel(), 1, inputs=[faces, *given, rows], device=device)
    return rows.numpy()[0]


def test_a_particle_that_leaves_its_reach_stops_the_run(device):
    """Nodes that run away take a particle along: the error says which, where and when, and no array is overrun."""
    solver = start(block((6, 4, 3)), device)
    state = solver.state
    values = state.grid.node.numpy().copy()
    values[:, 0] = 1e9  # [m/s]
    state.grid.node.assign(values)
    solver.step()
    with pytest.raises(SimulationError) as caught:
        check_faults(state, 1)
    message = str(caught.value)
    assert "\n" not in message
    assert "block: step 1 at 1.071 us: particle " in message
    assert "charge 'block' (ammonium nitrate)" in message
    cells = particle_values(state)["cell"]
    assert cells.min() >= 0
    assert np.all(cells < (6, 4, 3))


def test_a_velocity_that_is_no_number_stops_the_run(device, monkeypatch):
    """NaN in one particle spreads to its nodes and neighbors: the run ends after the step that shows it."""

    class Spoilt(State):
        def __init__(self, model):
            super().__init__(model)
            velocity = self.particles.velocity.numpy().copy()
            velocity[100, 1] = np.nan
            self.particles.velocity.assign(velocity)

    monkeypatch.setattr(simulation, "State", Spoilt)
    with pytest.raises(SimulationError, match="step 1 at"):
        simulate(block((6, 4, 3), end_time=1e-5), device=device, threads=1)


def test_a_fast_particle_shortens_the_step(device):
    """10 km/s at the start: the step is 0.3 h / (c + |v|) along its axis, and it moves 0.3 cells at most."""

    def hit(state):
        velocity = state.particles.velocity.numpy().copy()
        velocity[:, 1] = 1e4
        state.particles.velocity.assign(velocity)

    gas = inert_gas(1.0, 1e5)
    solver = start(block((4, 4, 4), material=gas, walls=OPEN, margin_cells=6), device, prepare=hit)
    before = particle_values(solver.state)["position"]
    advance(solver, 1)
    sound = np.sqrt(1.4 * 0.4 * 1e5)
    dt = float(solver.state.clock_values()["dt"])
    assert dt == pytest.approx(0.3 * CELL / (1e4 + sound), rel=8 * ROUND_OFF)
    moved = np.abs(particle_values(solver.state)["position"] - before).max()
    assert 0.25 * CELL < moved < 0.3 * CELL


# ---- time steps ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("cfl", [0.1, 0.3])
def test_the_first_step_of_a_fresh_charge(cfl, device):
    """A step of cfl h / D while anything is unburnt, with h the smallest spacing: here 8 mm of 8 x 10 x 12."""
    builder = SceneBuilder("brick")
    box = Box((0.0, 0.0, 0.0), (0.08, 0.1, 0.12))
    builder.domain(box.lower, box.upper, cells=(10, 10, 10))
    builder.charge(box, explosive())
    builder.detonator(PointDetonator((0.0, 0.0, 0.0), booster=False))
    builder.end_time(1.0)
    solver = advance(start(builder.build(), device, cfl=cfl), 1)
    assert float(solver.state.clock_values()["dt"]) == pytest.approx(cfl * 0.008 / SPEED, rel=4 * ROUND_OFF)


def test_the_step_obeys_its_limits(device):
    """At most cfl h / max(c + |v|, D while unburnt) and 10 % above the last step; most are as long as allowed.

    The limits are those of the state before the step. Without viscosity only the strain rate can shorten it further.
    """
    solver = start(block((12, 3, 2)), device, viscosity=(0.0, 0.0))
    last, at_limit = None, 0
    for step in range(80):
        values = particle_values(solver.state)
        sound = np.sqrt(2.0 * values["energy"].astype(np.float64))  # gamma (gamma - 1) e
        fastest = (sound[:, None] + np.abs(values["velocity"])).max()
        if solver.state.field("burn_fraction").min() < 1.0:
            fastest = max(fastest, SPEED)
        advance(solver, 1)
        dt = float(solver.state.clock_values()["dt"])
        limit = 0.3 * CELL / fastest
        if last is not None and 1.1 * last < limit:
            limit = 1.1 * last
        assert dt <= limit * (1.0 + 8 * ROUND_OFF), f"step {step}"
        at_limit += dt > limit * (1.0 - 1e-5)
        last = dt
    assert at_limit > 60


def test_a_step_grows_by_a_tenth_at_most(device):
    """After a short first step they grow by 10 % each, until the Courant number limits them."""
    solver = advance(start(block((6, 4, 3)), device), 1)
    clock = solver.state.clock.numpy().copy()
    clock["dt"] = 1e-8
    solver.state.clock.assign(clock)
    steps = []
    for _ in range(60):
        advance(solver, 1)
        steps.append(float(solver.state.clock_values()["dt"]))
    ratios = np.array([after / before for before, after in itertools.pairwise([1e-8, *steps])])
    assert ratios.max() < 1.1 * (1.0 + 8 * ROUND_OFF)
    np.testing.assert_allclose(ratios[:40], 1.1, rtol=8 * ROUND_OFF)
    assert steps[-1] == pytest.approx(0.3 * CELL / SPEED, rel=0.1)


def test_the_last_step_ends_at_the_end_time(device):
    """The end time exactly, in double; the clipped step does not count as the smallest."""
    first = 0.3 * CELL / SPEED
    scene = block((6, 4, 3), end_time=2.25 * first)
    result = simulate(scene, save=Save(frames=2), device=device, threads=1)
    assert result.summary["end_time_s"] == scene.end_time
    assert result.summary["steps"] == 3
    assert result.record.time[-1] == scene.end_time
    assert result.record.dt[-1] == pytest.approx(0.25 * first, rel=1e-4)
    assert result.summary["min_dt_s"] == pytest.approx(first, rel=8 * ROUND_OFF)
    assert result.summary["first_dt_s"] == pytest.approx(first, rel=8 * ROUND_OFF)


def test_time_adds_up_in_double(device):
    """The time is the sum of the steps, to the rounding of double, and rises with each."""
    result = simulate(block((6, 4, 3), end_time=60e-6), config=SolverConfig(), save=Save(frames=2), device=device)
    time, dt = result.record.time, result.record.dt.astype(np.float64)
    assert time[0] == 0.0
    assert np.all(np.diff(time) > 0.0)
    np.testing.assert_allclose(np.diff(time)[:-1], dt[1:-1], rtol=1e-9)
    assert time[-1] == 60e-6
