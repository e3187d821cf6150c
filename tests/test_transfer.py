"""Transfer between particles and grid conserves what it must, and reproduces linear and affine fields.

Sources: Sulsky, Chen, Schreyer, A particle method for history-dependent materials, CMAME 118 (1994); Jiang et al., The
affine particle-in-cell method, ACM Trans. Graph. 34 (2015), with proofs in Jiang, Schroeder, Teran, An angular
momentum conserving affine-particle-in-cell method, J. Comput. Phys. 338 (2017).

All sums here run over a few hundred particles and nodes in single precision, in an order of the machine's choice:
`SUMMED` bounds their round-off relative to the sum of the absolute values.
"""

import functools

import numpy as np
import pytest
import warp as wp
from scenes_for_tests import (
    CELL,
    OPEN,
    ROUND_OFF,
    block,
    cell_sums,
    inert_gas,
    nodes,
    particle_values,
    scatter,
    start,
)

from warp_mpm.config import Order, ShapeFunction, Transfer
from warp_mpm.kernels import transfer
from warp_mpm.kernels.content import FILLING, PRESSURE
from warp_mpm.kernels.motion import move_kernel
from warp_mpm.kernels.precision import LAST_FRACTION, scalar
from warp_mpm.kernels.records import Clock, Grid, Particles
from warp_mpm.kernels.strain import Strain, strain_function

SUMMED = 32 * ROUND_OFF
DT = 1e-6  # [s]
AFFINE_VELOCITY = np.array([30.0, -20.0, 50.0])  # a [m/s] of v = a + B x
AFFINE_GRADIENT = np.array([[-300.0, 2000.0, 500.0], [1000.0, 700.0, -4000.0], [-1500.0, 900.0, 1200.0]])  # B [1/s]

shapes = pytest.mark.parametrize("shape", list(ShapeFunction), ids=lambda shape: shape.value)


def affine_field(position):
    """V = a + B x (n, 3) at positions (n, 3)."""
    return AFFINE_VELOCITY + position @ AFFINE_GRADIENT.T


def scatter_particles(state):
    """Random places within their cells, on cell boundaries too, and random masses, velocities and pressures."""
    random = np.random.default_rng(2)
    n = state.count
    fraction = random.random((n, 3)).astype(np.float32)
    fraction[: n // 8] = 0.0
    fraction[n // 8 : n // 4] = float(LAST_FRACTION)
    state.assign("fraction", fraction)
    state.assign("velocity", random.normal(0.0, 100.0, (n, 3)).astype(np.float32))
    state.assign("mass", (state.values("mass") * random.uniform(0.5, 2.0, n)).astype(np.float32))
    state.assign("density", random.uniform(500.0, 2000.0, n).astype(np.float32))
    state.assign("viscous_pressure", random.uniform(0.0, 1e8, n).astype(np.float32))


def cloud(shape, device, *, prepare=scatter_particles, **config):
    """A solver on a cloud of gas far from every face; its first scatter has been done and solved."""
    scene = block((4, 3, 5), material=inert_gas(1000.0), walls=OPEN, margin_cells=3)
    return start(scene, device, shape=shape, prepare=prepare, **config)


def node_positions(solver):
    """Positions (n, 3) of all nodes [m], ghosts included."""
    domain = solver.model.scene.domain
    axes = [low + size * np.arange(-1, count + 2) for low, size, count in zip(*domain_parts(domain), strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def domain_parts(domain):
    """Lower corner, spacing and cells."""
    return domain.lower, domain.spacing, domain.cells


def set_nodes(solver, velocity, acceleration=None):
    """Give the nodes velocities and accelerations (n, 3) at the start of a step; masses stay."""
    values = solver.state.grid.start.numpy().copy()
    values[:, 0:3] = velocity
    values[:, 4:7] = 0.0 if acceleration is None else acceleration
    solver.state.grid.start.assign(values)


def set_end(solver, moving, working, alpha, reprojected, heat):
    """Give the nodes the velocities of a step (n, 3), and its damping: alpha (n), v_r or alpha v_r (n, 3), heat."""
    count = len(moving)
    mass = np.full(count, np.nan)  # nobody's business
    end = np.concatenate([moving, mass[:, None], working, alpha[:, None]], axis=1)
    damping = np.concatenate([reprojected, np.full((count, 1), heat)], axis=1)
    solver.state.grid.end.assign(end.astype(np.float32))
    solver.state.grid.damping.assign(damping.astype(np.float32))


def set_time_step(state):
    """Make the step DT long."""
    clock = Clock()
    clock.dt = DT
    state.clock.assign([clock])


def gather(solver, affine=False):
    """Let the particles take the nodes' velocity over: PIC, or APIC with its gradient."""
    state, model = solver.state, solver.model
    set_time_step(state)
    kernel = transfer.advance_kernel(model.shape, True, affine, False, False)
    inputs = [state.particles, state.grid, state.clock, model.charges[0].half_width, 1.0, 0]
    wp.launch(kernel, state.count, inputs=inputs, device=state.device)


def assert_sums_agree(actual, expected, terms):
    """Two vectors of sums agree to the round-off of the terms they are made of."""
    scale = np.abs(terms).sum(axis=0).max()
    np.testing.assert_allclose(actual, expected, rtol=0, atol=SUMMED * scale)


@shapes
@pytest.mark.parametrize("affine", [False, True], ids=["flip", "apic"])
def test_scatter_conserves_mass_momentum_and_volume(shape, affine, device):
    """Sum over nodes of sum w m, w m v, w V = sum over particles: partition of unity; the affine part adds nothing.

    So are the sums over cells of sum L V and sum L V p, which only the damping's relaxation needs.
    """
    solver = cloud(shape, device, transfer=Transfer.APIC if affine else Transfer.FLIP)
    if affine:
        gradient = np.random.default_rng(3).normal(0.0, 1e4, (solver.state.count, 3, 3))
        solver.state.assign("affine", gradient.astype(np.float32))
    values = particle_values(solver.state)
    mass = values["mass"].astype(np.float64)
    momentum = mass[:, None] * values["velocity"]
    sums = scatter(solver)[0].reshape(-1, 8)
    assert_sums_agree(sums[:, 3].sum(), mass.sum(), mass)
    # The affine terms cancel in the sum, but each is as large as m |C| times a cell's diagonal.
    carried = np.abs(momentum) + (mass[:, None] * 3 * 1e4 * CELL if affine else 0.0)
    assert_sums_agree(sums[:, 0:3].sum(axis=0), momentum.sum(axis=0), carried)
    volume = (mass / values["density"]).sum()
    assert_sums_agree(sums[:, 7].sum(), volume, sums[:, 7])
    assert len(solver.state.grid.content_sums) == 0
    damped = cloud(shape, device)
    scatter(damped)
    held = cell_sums(damped).reshape(-1, 2)
    assert_sums_agree(held[:, FILLING].sum(), volume, held[:, FILLING])
    work = (mass / values["density"] * values["pressure"]).sum()
    assert work > 0.0
    assert_sums_agree(held[:, PRESSURE].sum(), work, held[:, PRESSURE])


@shapes
def test_internal_forces_balance(shape, device):
    """Sum f = 0 and sum x cross f = 0; sum x . f = 3 sum (p + q) V; and the field's sum w V p = sum V p.

    Gradients sum to zero and reproduce linear fields: sum x_i grad w_i is the unit matrix.
    """
    solver = cloud(shape, device)
    values = particle_values(solver.state)
    volume = values["mass"].astype(np.float64) / values["density"]
    sums, pressure = scatter(solver)
    place, force = node_positions(solver), sums.reshape(-1, 8)[:, 4:7]
    assert np.abs(force).max() > 0.0
    assert_sums_agree(force.sum(axis=0), np.zeros(3), force)
    torque = np.cross(place, force)
    assert_sums_agree(torque.sum(axis=0), np.zeros(3), torque)
    pull = (values["pressure"].astype(np.float64) + values["viscous_pressure"]) * volume
    virial = (place * force).sum(axis=1)
    assert_sums_agree(virial.sum(), 3.0 * pull.sum(), virial)
    energy = values["pressure"] * volume
    assert_sums_agree(pressure.sum(), energy.sum(), energy)


@shapes
def test_gather_reproduces_an_affine_field(shape, device):
    """PIC from v_i = a + B x_i gives v_p = a + B x_p, APIC the gradient B too: linear reproduction (Jiang 2015)."""
    solver = cloud(shape, device, transfer=Transfer.APIC)
    set_nodes(solver, affine_field(node_positions(solver)))
    gather(solver, affine=True)
    values = particle_values(solver.state)
    expected = affine_field(values["position"])
    fastest = np.abs(affine_field(node_positions(solver))).max()
    np.testing.assert_allclose(values["velocity"], expected, rtol=0, atol=SUMMED * fastest)
    gradient = solver.state.field("affine")
    # Gradients are differences of nodal velocities over a cell.
    np.testing.assert_allclose(gradient, np.broadcast_to(AFFINE_GRADIENT, gradient.shape), atol=SUMMED * fastest / CELL)


@shapes
def test_particles_move_with_the_grid(shape, device):
    """x_p += dt sum w (v + dt a)_i (paper eq. 15), exact for affine fields of v and a; through cell boundaries too."""
    solver = cloud(shape, device, order=Order.USF, transfer=Transfer.FLIP)
    state, model = solver.state, solver.model
    place = node_positions(solver)
    stretch = 40.0  # the fastest nodes move by more than half a cell
    set_nodes(solver, stretch * affine_field(place), stretch / DT * affine_field(place))
    set_time_step(state)
    before = particle_values(state)
    inputs = [state.particles, state.grid, model.faces, state.clock, model.charges[0].half_width]
    inputs += [state.maxima, state.tallies, state.faults, 0, 0]
    wp.launch(move_kernel(model.shape), state.count, inputs=inputs, device=state.device)
    after = particle_values(state)
    expected = 2.0 * stretch * DT * affine_field(before["position"])
    fastest = 2.0 * stretch * DT * np.abs(affine_field(place)).max()
    # A position is a fraction of its cell, which it resolves to a rounding.
    moved = after["position"] - before["position"]
    np.testing.assert_allclose(moved, expected, rtol=0, atol=SUMMED * fastest + 2 * ROUND_OFF * CELL)
    assert np.any(after["cell"] != before["cell"])
    assert not state.faults.numpy().any()
    assert after["fraction"].min() >= 0.0
    assert after["fraction"].max() < 1.0


@functools.cache
def strain_kernel(shape, strain, damped):
    """Kernel that gathers the strain increments of all particles into rows."""
    gather_strain = strain_function(shape, strain, damped)

    @wp.kernel(enable_backward=False, module="unique")
    def evaluate(
        particles: Particles,
        grid: Grid,
        half_width: scalar,
        dt: scalar,
        rows: wp.array2d(dtype=scalar),
    ):
        p = wp.tid()
        position = particles.position[p]
        s = gather_strain(grid, position.cell, position.fraction, particles.motion[p].velocity, half_width, dt)
        for axis in range(3):
            rows[p, axis] = s.motion[axis]
            rows[p, 3 + axis] = s.damping[axis]
        rows[p, 6] = wp.trace(s.gradient)
        rows[p, 7] = wp.trace(s.work_gradient)
        rows[p, 8] = s.heat

    return evaluate


def strains(solver, strain, damped):
    """Rows of the strain increments (n, 9) in creation order, in double."""
    state, model = solver.state, solver.model
    rows = wp.zeros((state.count, 9), dtype=scalar, device=state.device)
    inputs = [state.particles, state.grid, model.charges[0].half_width, DT, rows]
    wp.launch(strain_kernel(model.shape, strain, damped), state.count, inputs=inputs, device=state.device)
    return state.in_creation_order(rows.numpy().astype(np.float64))


@shapes
def test_strain_of_affine_fields(shape, device):
    """v = a + B x moves the particles, 2 v does the work, 3 v is re-projected: divergences tr B, 2 tr B and 3 tr B.

    With the damping the volume follows the motion, without it the re-projected velocity; u = sum w (alpha v_r) -
    sum w alpha v_p, the heat is sum w H. USF takes v^n for everything, USL v^n + dt a and, for the
    work, v^n + dt a / 2.
    """
    solver = cloud(shape, device)
    place = node_positions(solver)
    velocity = affine_field(place)
    set_end(solver, velocity, 2.0 * velocity, place[:, 0] / CELL, 3.0 * velocity, heat=7.0)
    values = particle_values(solver.state)
    here = affine_field(values["position"])
    trace = np.trace(AFFINE_GRADIENT)
    fastest = np.abs(3.0 * velocity).max()
    slope_round_off = SUMMED * fastest / CELL

    rows = strains(solver, Strain.REPROJECTED, True)
    np.testing.assert_allclose(rows[:, 0:3], here, rtol=0, atol=SUMMED * fastest)
    np.testing.assert_allclose(rows[:, 6], trace, rtol=0, atol=slope_round_off)
    np.testing.assert_allclose(rows[:, 7], 2.0 * trace, rtol=0, atol=slope_round_off)
    alpha = values["position"][:, :1] / CELL
    damping = 3.0 * here - alpha * values["velocity"]
    np.testing.assert_allclose(rows[:, 3:6], damping, rtol=0, atol=SUMMED * fastest * max(1.0, alpha.max()))
    np.testing.assert_allclose(rows[:, 8], 7.0, rtol=SUMMED)

    undamped_rows = strains(solver, Strain.REPROJECTED, False)
    np.testing.assert_allclose(undamped_rows[:, 6], 3.0 * trace, rtol=0, atol=slope_round_off)
    np.testing.assert_allclose(undamped_rows[:, 7], 2.0 * trace, rtol=0, atol=slope_round_off)

    set_nodes(solver, velocity, velocity / DT)
    start_rows = strains(solver, Strain.START, False)
    np.testing.assert_allclose(start_rows[:, 6:8], trace, rtol=0, atol=slope_round_off)
    end_rows = strains(solver, Strain.END, False)
    np.testing.assert_allclose(end_rows[:, 6], 2.0 * trace, rtol=0, atol=slope_round_off)
    np.testing.assert_allclose(end_rows[:, 7], 1.5 * trace, rtol=0, atol=slope_round_off)


@shapes
def test_apic_keeps_an_affine_field_over_a_round_trip(shape, device):
    """Particles with v = a + B x and C = B -> grid -> particles: both are unchanged (Jiang et al. 2015, prop. 1).

    Particles keep a thousandth of a cell away from cell boundaries: there the linear shape takes the gradient from
    nodes that may have no mass.
    """

    def prepare(state):
        scatter_particles(state)
        state.assign("fraction", np.clip(state.values("fraction"), 1e-3, 0.999))
        position = particle_values(state)["position"][state.particles.index.numpy()]
        state.assign("velocity", affine_field(position).astype(np.float32))
        state.assign("affine", np.broadcast_to(AFFINE_GRADIENT, (state.count, 3, 3)).astype(np.float32))

    solver = cloud(shape, device, prepare=prepare, transfer=Transfer.APIC)
    set_nodes(solver, nodes(solver).reshape(-1, 8)[:, 0:3])  # as scattered and solved, without the forces
    gather(solver, affine=True)
    values = particle_values(solver.state)
    fastest = np.abs(affine_field(node_positions(solver))).max()
    expected = affine_field(values["position"])
    np.testing.assert_allclose(values["velocity"], expected, rtol=0, atol=SUMMED * fastest)
    gradient = solver.state.field("affine")
    np.testing.assert_allclose(gradient, np.broadcast_to(AFFINE_GRADIENT, gradient.shape), atol=SUMMED * fastest / CELL)


def angular_momentum(solver, velocity, gradient):
    """Sum over particles of x cross m v + m sum w d cross C d with d = x_i - x_p (Jiang et al. 2017, eq. 16) and sizes.

    Sum w d d^T is diagonal, as the stencil is a product and sum w d = 0 along every axis.
    """
    values = particle_values(solver.state)
    mass = values["mass"].astype(np.float64)[:, None]
    moments = second_moments(solver)
    spin = np.stack(
        [
            gradient[:, 2, 1] * moments[:, 1] - gradient[:, 1, 2] * moments[:, 2],
            gradient[:, 0, 2] * moments[:, 2] - gradient[:, 2, 0] * moments[:, 0],
            gradient[:, 1, 0] * moments[:, 0] - gradient[:, 0, 1] * moments[:, 1],
        ],
        axis=1,
    )
    terms = mass * (np.cross(values["position"], velocity) + spin)
    return terms.sum(axis=0), np.abs(terms).sum()


@functools.cache
def moment_kernel(shape):
    """Kernel of the second moments sum w s^2 along each axis, in cells^2."""
    weights = shape.weights
    width, offset = shape.width, shape.offset

    @wp.kernel(enable_backward=False, module="unique")
    def evaluate(particles: Particles, half_width: scalar, rows: wp.array2d(dtype=scalar)):
        p = wp.tid()
        for axis in range(3):
            fraction = particles.position[p].fraction[axis]
            w = weights(fraction, half_width)
            moment = scalar(0.0)
            for n in range(width):
                distance = fraction - scalar(offset(fraction)) - scalar(n)
                moment += w[n] * distance * distance
            rows[p, axis] = moment

    return evaluate


def second_moments(solver):
    """Sum w (x_i - x_p)^2 along each axis (n, 3) [m2], in creation order."""
    state, model = solver.state, solver.model
    rows = wp.zeros((state.count, 3), dtype=scalar, device=state.device)
    inputs = [state.particles, model.charges[0].half_width, rows]
    wp.launch(moment_kernel(model.shape), state.count, inputs=inputs, device=state.device)
    return state.in_creation_order(rows.numpy().astype(np.float64)) * CELL**2


@shapes
def test_apic_conserves_angular_momentum_both_ways(shape, device):
    """L = sum x_i cross m_i v_i on the grid = L of the particles with their affine part (Jiang et al. 2017)."""

    def prepare(state):
        scatter_particles(state)
        gradient = np.random.default_rng(4).normal(0.0, 1e4, (state.count, 3, 3))
        state.assign("affine", gradient.astype(np.float32))

    solver = cloud(shape, device, prepare=prepare, transfer=Transfer.APIC)
    values = particle_values(solver.state)
    before, size = angular_momentum(solver, values["velocity"], solver.state.field("affine").astype(np.float64))
    sums, place = scatter(solver)[0].reshape(-1, 8), node_positions(solver)
    on_nodes = np.cross(place, sums[:, 0:3]).sum(axis=0)
    np.testing.assert_allclose(on_nodes, before, rtol=0, atol=SUMMED * size)

    mass = sums[:, 3]
    velocity = np.random.default_rng(5).normal(0.0, 100.0, (len(mass), 3)).astype(np.float32).astype(np.float64)
    on_nodes = np.cross(place, mass[:, None] * velocity).sum(axis=0)
    set_nodes(solver, velocity)
    gather(solver, affine=True)
    after = particle_values(solver.state)["velocity"]
    affine = solver.state.field("affine").astype(np.float64)
    on_particles, size = angular_momentum(solver, after, affine)
    # A gradient is w v / h over the second moment, and those of the linear shape vanish towards a node.
    np.testing.assert_allclose(on_particles, on_nodes, rtol=0, atol=SUMMED * size)
