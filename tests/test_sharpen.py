"""Sharpening: what it does to a field, that it conserves momentum and energy, and that walls mirror it.

Source: the formulas at the top of `kernels/sharpen.py`, here in double precision, pair by pair instead of node by node;
walls by the method of images, on a grid unfolded at its walls.

The kernels run on fields of our own, in every node, and are compared for the same single precision inputs. `FORMULA`
bounds their round-off relative to the largest value: six differences of up to twice that, weighted, summed up, times
s^2 / 2 = 1/8, and the node's own value make at most 16 roundings of it. (That values are quotients of sums adds one.)
"""

import numpy as np
import pytest
import warp as wp
from scenes_for_tests import CELL, OPEN, ROUND_OFF, STICK, advance, block, inert_gas, node_array, particle_values, start

from warp_mpm.config import Save, ShapeFunction, Transfer
from warp_mpm.kernels.grid import solve_kernel
from warp_mpm.kernels.node_pass import Phase
from warp_mpm.kernels.reproject import solve_reprojected_kernel
from warp_mpm.kernels.shape import BSPLINE, SHAPES
from warp_mpm.kernels.walls import REACTIONS
from warp_mpm.scene import Wall, Walls
from warp_mpm.simulation import simulate

FORMULA = 16 * ROUND_OFF
STRENGTH = 0.5 * BSPLINE.spread  # s^2 / 2
HALF_WIDTH = 0.25  # of a particle, two per axis [cells]
CELLS = (6, 5, 4)  # three blocks of nodes along x, two of them along y and z
MIXED = Walls(Wall.SLIP, Wall.OPEN, Wall.STICK, Wall.SLIP, Wall.OPEN, Wall.STICK)
ENDS_OPEN = Walls(x_low=Wall.OPEN, x_high=Wall.OPEN)
EXACT = 1e-6  # of sums over particles, relative; see `test_conservation.py`
SMALLEST = 1e-4  # of the masses, in the largest

DT = 2.0**-20  # [s]; a power of two, so that dt a is exact

ACCELERATION, MOTION, WORK = "acceleration", "motion", "work"  # what is sharpened

phases = pytest.mark.parametrize("phase", [ACCELERATION, MOTION, WORK])
grids = pytest.mark.parametrize(
    ("walls", "cells"),
    [
        pytest.param(OPEN, CELLS, id="free"),
        pytest.param(Walls(), (10, 8, 9), id="with_an_inside"),
        pytest.param(Walls(), CELLS, id="slip"),
        pytest.param(STICK, CELLS, id="stick"),
        pytest.param(MIXED, CELLS, id="mixed"),
        pytest.param(Walls(), (5, 1, 2), id="one_cell_wide"),
    ],
)


def formula(mass, x, strength=STRENGTH):
    """Sharpened values (..., 3) of x on masses (..., 1): each pair of neighbours moves apart, by equal shares.

    Nothing is added where an array ends.
    """
    result = x.copy()
    for axis in range(3):
        m, value, moved = (np.moveaxis(array, axis, 0) for array in (mass, x, result))
        share = strength * np.minimum(m[1:], m[:-1]) * (value[1:] - value[:-1])
        moved[1:] += share / m[1:]
        moved[:-1] -= share / m[:-1]
    return result


def wall_ends(walls):
    """(axis, side, face) of every wall; side 0 is the low one."""
    return [(face // 2, face % 2, face) for face, wall in enumerate(walls.faces()) if wall is not Wall.OPEN]


def odd_components(walls):
    """Components of a vector (6, 3) that change sign behind a face."""
    odd = np.zeros((6, 3), dtype=bool)
    for face, wall in enumerate(walls.faces()):
        odd[face, face // 2] = wall is Wall.SLIP
        odd[face] |= wall is Wall.STICK
    return odd


def own_nodes(walls):
    """Index of the nodes that stand for themselves: all but the ghosts behind walls."""
    index = [[None, None] for _ in range(3)]
    for axis, side, _ in wall_ends(walls):
        index[axis][side] = -1 if side else 1
    return tuple(slice(*ends) for ends in index)


def unfold(walls, own, odd):
    """Values of own nodes (..., c) with two mirrored layers behind every wall; `odd` (6, c) change their sign there."""
    whole = own
    for axis, side, face in wall_ends(walls):
        width = [(0, 0)] * 4
        width[axis] = (0, 2) if side else (2, 0)
        whole = np.pad(whole, width, mode="reflect")
        np.moveaxis(whole, axis, 0)[slice(-2, None) if side else slice(2), ..., odd[face]] *= -1.0
    return whole


def with_ghosts(walls, whole):
    """The grid's part of an unfolded array: one layer of ghosts behind every wall."""
    return whole[own_nodes(walls)]  # of two layers one goes


def on_walls(walls, own):
    """How many walls each own node lies on, (..., 1)."""
    count = np.zeros_like(own[..., :1])
    for axis, side, _ in wall_ends(walls):
        np.moveaxis(count, axis, 0)[-1 if side else 0] += 1.0
    return count


def expected(walls, mass, x):
    """What sharpening has to give in all nodes, ghosts included: that of the unfolded grid, without any walls."""
    whole = unfold(walls, mass * 2.0 ** on_walls(walls, mass), np.zeros((6, 1), dtype=bool))
    return with_ghosts(walls, formula(whole, unfold(walls, x, odd_components(walls))))


def held_components(walls, own):
    """Own values with those components set to zero that walls hold."""
    values = own.copy()
    odd = odd_components(walls)
    for axis, side, face in wall_ends(walls):
        np.moveaxis(values, axis, 0)[-1 if side else 0, ..., odd[face]] = 0.0
    return values


def single(values):
    """Rounded to single precision, in double."""
    return values.astype(np.float32).astype(np.float64)


def grid_of(walls, cells, device):
    """A solver whose kernels work on all nodes, in steps of DT; none has been sharpened."""
    solver = start(block(cells, walls=walls), device)
    state = solver.state
    state.reactions.zero_()
    clock = state.clock.numpy().copy()
    clock["dt"] = DT
    state.clock.assign(clock)
    return solver


def random_mass(walls, cells, seed=1, smallest=SMALLEST):
    """Masses of own nodes (..., 1), evenly spread over the powers of ten up to 1 g."""
    shape = np.empty(tuple(n + 3 for n in cells))[own_nodes(walls)].shape
    return single(1e-3 * smallest ** np.random.default_rng(seed).random((*shape, 1)))


def random_values(walls, mass, seed=2):
    """Values of own nodes (..., 3), zero where walls hold them."""
    values = np.random.default_rng(seed).normal(0.0, 1e3, (*mass.shape[:3], 3))
    return held_components(walls, single(values))


def by_kernel(solver, walls, mass, x, phase, ghost_mass=0.0):
    """Sharpened values of all nodes, ghosts too, in double; `x` (..., 3) and `mass` (..., 1) are of own nodes."""
    state, model = solver.state, solver.model
    own = own_nodes(walls)
    sums, begin, reprojected = (np.zeros_like(node_array(solver, name)) for name in ("sums", "start", "reprojected"))
    sums[..., 3] = ghost_mass
    sums[(*own, 3)] = begin[(*own, 3)] = mass[..., 0]
    begin[(*own, 7)] = np.where(mass[..., 0] > state.grid.light_mass, 1.0 / mass[..., 0], 0.0)
    if phase is ACCELERATION:
        sums[(*own, slice(4, 7))] = mass * x
    elif phase is MOTION:
        begin[(*own, slice(0, 3))] = 0.75 * x
        begin[(*own, slice(4, 7))] = 0.25 / DT * x
    else:
        begin[(*own, slice(0, 3))] = x
        reprojected[(*own, slice(0, 3))] = mass * x
    for name, values in {"sums": sums, "start": begin, "reprojected": reprojected}.items():
        array = getattr(state.grid, name)
        flat = values.reshape(-1, values.shape[-1])
        array.assign(np.pad(flat, ((0, len(array) - len(flat)), (0, 0))))
    what = Phase()
    what.strength, what.reactions, what.peaks = STRENGTH, state.reactions, state.peaks
    step = int(state.clock_values()["step"])
    at_start = phase is ACCELERATION
    kernel = solve_kernel(True, False, True, False) if at_start else solve_reprojected_kernel(True, True)
    state.grid.stamps.fill_(step if at_start else step - 1)
    inputs = [state.grid, model.boundary, state.clock, what, 0, 0]
    wp.launch(kernel, state.blocks * state.grid.workers, inputs=inputs, device=state.device)
    np.testing.assert_array_equal(node_array(solver, "sums"), sums if at_start else np.zeros_like(sums))
    result = node_array(solver, "start" if at_start else "end").astype(np.float64)
    return result[..., 0:3] if phase is MOTION else result[..., 4:7]


def assert_equal(actual, wanted, x):
    """Values agree to the round-off of the formula."""
    np.testing.assert_allclose(actual, wanted, rtol=0, atol=FORMULA * np.abs(x).max())


@phases
@grids
def test_values_are_those_of_the_formula(walls, cells, phase, device):
    """x_i + s^2 / 2 sum min(M_i, M_j) / M_i (x_i - x_j), on a grid without walls, of which this one is a part.

    So half a symmetric problem against a wall is the whole one. What walls hold stays zero, and ghosts are images.
    """
    mass = random_mass(walls, cells)
    x = random_values(walls, mass)
    wanted = expected(walls, mass, x)
    actual = by_kernel(grid_of(walls, cells, device), walls, mass, x, phase)
    assert_equal(actual, wanted, x)
    own = actual[own_nodes(walls)]
    np.testing.assert_array_equal(held_components(walls, own), own)
    assert np.abs(own - x).max() > 0.3 * np.abs(x).max()  # something has happened


@phases
def test_a_free_grid_keeps_its_momentum(phase, device):
    """Sum M x stays: what one node of a pair gets the other loses, whatever their masses."""
    mass = random_mass(OPEN, CELLS)
    x = random_values(OPEN, mass)
    actual = by_kernel(grid_of(OPEN, CELLS, device), OPEN, mass, x, phase)
    change = mass * (actual - x)
    assert np.abs(change.sum(axis=(0, 1, 2))).max() < FORMULA * mass.sum() * np.abs(x).max()
    assert np.abs(change).sum() > 0.1 * (mass * np.abs(x)).sum()


@grids
def test_the_work_on_sharpened_velocities_is_that_of_sharpened_forces(walls, cells, device):
    """Sum f' . w = sum f . w': what the particles gain in kinetic energy their internal energy loses."""
    solver = grid_of(walls, cells, device)
    mass = random_mass(walls, cells)
    acceleration = random_values(walls, mass, 2)
    velocity = single(acceleration + random_values(walls, mass, 3))  # not without work
    sharp_acceleration = by_kernel(solver, walls, mass, acceleration, ACCELERATION)[own_nodes(walls)]
    sharp_velocity = by_kernel(solver, walls, mass, velocity, WORK)[own_nodes(walls)]
    gained = (mass * sharp_acceleration * velocity).sum()
    lost = (mass * acceleration * sharp_velocity).sum()
    scale = mass.sum() * np.abs(acceleration).max() * np.abs(velocity).max()
    assert gained == pytest.approx(lost, rel=0, abs=FORMULA * scale)
    plain = (mass * acceleration * velocity).sum()
    assert abs(gained - plain) > 100 * FORMULA * scale


@pytest.mark.parametrize("modes", [(3, 0, 0), (0, 1, 0), (2, 0, 4), (1, 2, 3)])
@phases
def test_a_wave_is_strengthened_by_its_factor(modes, phase, device):
    """By 1 + s^2 sum over the axes of (1 - cos k h), exactly: standing waves in a box of uniform mass, its walls too.

    Components along a wall are cosines, those across it sines; mode 4 of 4 cells is the shortest wave there is.
    """
    walls = Walls()
    mass = single(1e-3 * 0.5 ** on_walls(walls, random_mass(walls, CELLS)))
    angles = [np.pi * mode / n for mode, n in zip(modes, CELLS, strict=True)]
    lines = [k * np.arange(-1, n + 2) for k, n in zip(angles, CELLS, strict=True)]
    place = np.meshgrid(*lines, indexing="ij")
    wave = [np.prod([np.sin(p) if a == c else np.cos(p) for a, p in enumerate(place)], axis=0) for c in range(3)]
    wave = np.stack(wave, axis=-1)
    x = held_components(walls, single(wave[own_nodes(walls)]))
    actual = by_kernel(grid_of(walls, CELLS, device), walls, mass, x, phase)
    factor = 1.0 + BSPLINE.spread * sum(1.0 - np.cos(k) for k in angles)
    assert_equal(actual, factor * wave, x)
    assert np.abs(x).max() > 0.5


@phases
def test_constant_and_linear_fields_stay(phase, device):
    """A constant field stays on any masses, a linear one in the inside of a uniform material."""
    solver = grid_of(OPEN, CELLS, device)
    mass = random_mass(OPEN, CELLS)
    constant = np.broadcast_to(single(np.array([300.0, -20.0, 0.1])), (*mass.shape[:3], 3))
    assert_equal(by_kernel(solver, OPEN, mass, constant, phase), constant, constant)
    place = np.stack(np.meshgrid(*(np.arange(n + 3.0) for n in CELLS), indexing="ij"), axis=-1)
    linear = single(place @ np.array([[1.0, -2.0, 3.0], [0.5, 4.0, -1.0], [-3.0, 0.2, 2.0]]))
    actual = by_kernel(solver, OPEN, np.full_like(mass, single(np.array(1e-3))), linear, phase)
    inside = (slice(1, -1),) * 3
    assert_equal(actual[inside], linear[inside], linear)
    assert np.abs(actual - linear).max() > 100 * FORMULA * np.abs(linear).max()  # not so at its surface


@pytest.mark.parametrize("walls", [OPEN, Walls(), STICK, MIXED], ids=["free", "slip", "stick", "mixed"])
@phases
def test_light_nodes_stay_bounded(walls, phase, device):
    """|x'| <= |x| + s^2 / 2 x 6 neighbours x 2 max |x| next to any masses; a node that counts as empty stays at 0."""
    solver = grid_of(walls, CELLS, device)
    light = float(solver.state.grid.light_mass)
    mass = random_mass(walls, CELLS, smallest=1e-20)
    x = random_values(walls, mass)
    empty = mass[..., 0] <= light
    x[empty] = 0.0  # as the solution of the nodes leaves them
    largest = np.abs(x).max()
    actual = by_kernel(solver, walls, mass, x, phase)[own_nodes(walls)]
    assert 0.1 < empty.mean() < 0.9
    assert not actual[empty].any()
    bound = np.abs(x) + 12.0 * STRENGTH * largest
    assert np.all(np.abs(actual) <= bound + FORMULA * largest)
    assert np.abs(actual)[~empty].max() > 1.2 * largest


@grids
def test_wall_forces_are_tallied(walls, cells, device):
    """What particles gain by the change of the accelerations is what the walls give, and no face without one gives any.

    A node and its ghosts give w m a back, each by the mass that was scattered to it; they need not be mirror images.
    """
    solver = grid_of(walls, cells, device)
    mass = random_mass(walls, cells)
    x = random_values(walls, mass)
    even = np.zeros((6, 1), dtype=bool)
    owner_mass = with_ghosts(walls, unfold(walls, mass, even))[..., 0]
    # A node owns 26 ghosts at most: their masses together are less than its own, which counts them in.
    ghost_mass = single(owner_mass * np.random.default_rng(4).random(owner_mass.shape) / 27.0)
    before = with_ghosts(walls, unfold(walls, x, odd_components(walls)))
    added = by_kernel(solver, walls, mass, x, ACCELERATION, ghost_mass) - before
    own_added = added[own_nodes(walls)]
    as_owner = with_ghosts(walls, unfold(walls, own_added, np.zeros((6, 3), dtype=bool)))
    gained = (mass * own_added).sum(axis=(0, 1, 2)) + (ghost_mass[..., None] * (added - as_owner)).sum(axis=(0, 1, 2))
    reactions = solver.state.reactions.numpy().reshape(-1, REACTIONS).sum(axis=0).reshape(6, 3)
    scale = mass.sum() * np.abs(x).max()
    np.testing.assert_allclose(reactions.sum(axis=0), gained, rtol=0, atol=FORMULA * scale)
    walled = [face for _, _, face in wall_ends(walls)]
    assert not np.delete(reactions, walled, axis=0).any()
    if walled:
        assert np.abs(reactions).max() > 100 * FORMULA * scale


@pytest.mark.parametrize(
    "walls",
    [Walls(), Walls(x_high=Wall.STICK), STICK],
    ids=["slip", "slip_and_stick_end", "stick"],
)
def test_walls_give_the_momentum_that_particles_gain(walls, device):
    """P(t) = J_walls to round-off in a closed column lit at one end, in a corner: nothing is symmetric or cancels.

    The front takes 71 us for the 0.2 m, and is on its way back at the end.
    """
    scene = block((20, 2, 2), walls=walls, end_time=1.2e-4)
    summary = simulate(scene, save=Save(frames=13, figures=False), device=device, threads=1).summary
    assert summary["momentum_error"] < EXACT
    assert summary["energy_error"] < EXACT


TRANSFORMS = {  # of the shape functions, at k / cell: what is left of the amplitude of a wave, averaged over all places
    "gimp": lambda k: np.sinc(k / (2 * np.pi)) ** 2 * np.sinc(k * HALF_WIDTH / np.pi),
    "bspline": lambda k: np.sinc(k / (2 * np.pi)) ** 3,
}


@pytest.mark.parametrize("shape", [shape for shape in SHAPES if shape.spread > 0.0], ids=lambda shape: shape.name)
def test_the_strength_is_that_of_the_smoothing(shape):
    """The factor of a wave and the shape function's Fourier transform give 1 to second order: their product - 1 ~ k^4.

    Tents have the transform sinc^2 (k / 2), B-splines sinc^3 (k / 2), and GIMP averages the tent over a particle.
    """
    errors = [TRANSFORMS[shape.name](k) * (1.0 + shape.spread * (1.0 - np.cos(k))) - 1.0 for k in (0.2, 0.1)]
    assert errors[0] / errors[1] == pytest.approx(16.0, rel=0.05)


# Weights of the nodes -1, 0 and 1 at a quarter of a cell above node 0, where every other particle is.
QUARTER_WEIGHTS = {
    ShapeFunction.LINEAR: [0.0, 0.75, 0.25],
    ShapeFunction.GIMP: [0.0, 0.75, 0.25],
    ShapeFunction.BSPLINE: [0.03125, 0.6875, 0.28125],
}
SPREADS = {ShapeFunction.LINEAR: 0.0, ShapeFunction.GIMP: 3 / 16, ShapeFunction.BSPLINE: 1 / 4}


@pytest.mark.parametrize("transfer", [Transfer.DAMPED_FLIP, Transfer.FLIP], ids=lambda transfer: transfer.value)
@pytest.mark.parametrize("shape", list(ShapeFunction), ids=lambda shape: shape.value)
def test_a_step_sharpens_with_the_damping_alone(shape, transfer, device):
    """From rest, accelerated by a wave, particles move by dt^2 sum w a; with the damping, times its factor squared.

    One factor is the acceleration's, one the velocity's; nothing is done for plain FLIP, nor for tents, whose forces
    jump. Places within a cell are rounded to 2^-25 of it, and the ways, of 0.1 cells, by less.
    """
    cells, mode = (3, 8, 2), 3
    solver = start(block(cells, material=inert_gas(1000.0), walls=ENDS_OPEN), device, shape=shape, transfer=transfer)
    angle = np.pi * mode / cells[1]
    sums = node_array(solver, "sums")
    sums[..., 4:7] = 0.0
    sums[..., 4] = sums[..., 3] * (5e6 * np.cos(angle * np.arange(-1, cells[1] + 2))[:, None])
    solver.state.grid.sums.assign(sums.reshape(-1, 8))
    dict(solver.phases())["solve grid"]()
    before = particle_values(solver.state)
    after = particle_values(advance(solver, 1).state)
    place = before["position"][:, 1] / CELL
    nearest = np.round(place)
    steps = np.where(place > nearest, 1.0, -1.0)  # towards the second node of the cell
    gathered = sum(w * np.cos(angle * (nearest + n * steps)) for n, w in enumerate(QUARTER_WEIGHTS[shape], start=-1))
    factor = 1.0
    if transfer is Transfer.DAMPED_FLIP:
        factor = (1.0 + SPREADS[shape] * (1.0 - np.cos(angle))) ** 2
    way = (after["position"] - before["position"])[:, 0] / CELL
    wanted = 5e6 * float(solver.state.clock_values()["dt"]) ** 2 / CELL * factor * gathered
    np.testing.assert_allclose(way, wanted, rtol=0, atol=4 * ROUND_OFF)
    assert 0.05 < np.abs(way).max() < 0.24  # they stay inside
