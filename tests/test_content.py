"""What the cells hold: P_c = sum L(x_p - x_c) V p / V_c and J_c = sum L V / V_c, L the tent at a cell's centre.

Checked against the formula in NumPy for every kind of face, and against what it is made for: the internal force of the
quadratic B-spline is the difference of P_c between cells, times their cross-section. That follows from the spline being
a box convolved with a tent (de Boor, A Practical Guide to Splines, 1978): its slope is the difference of two tents,
half a cell to either side.
"""

import functools
import itertools

import numpy as np
import pytest
import warp as wp
from scenes_for_tests import (
    OPEN,
    ROUND_OFF,
    STICK,
    advance,
    block,
    cell_content,
    inert_gas,
    mirrored_cells,
    node_array,
    nodes,
    particle_values,
    start,
    tent_sums,
)

from warp_mpm.builder import SceneBuilder
from warp_mpm.config import ShapeFunction
from warp_mpm.geometry import Box
from warp_mpm.kernels import content
from warp_mpm.kernels.content import FILLING, PRESSURE
from warp_mpm.kernels.precision import LAST_FRACTION, scalar, vector2
from warp_mpm.kernels.records import Grid, Particles
from warp_mpm.kernels.shape import offset_nearest_node
from warp_mpm.scene import Wall, Walls

# Sums of some hundred rounded terms, in an order of the machine's choice, relative to their largest value.
SUMMED = 32 * ROUND_OFF
LOWER, SPACING = np.array([-0.02, 0.01, 0.0]), np.array([0.01, 0.015, 0.012])  # of `box` [m]
GAMMA = 1.4
MIXED = Walls(Wall.OPEN, Wall.SLIP, Wall.STICK, Wall.OPEN, Wall.SLIP, Wall.SLIP)

walls_and_cells = pytest.mark.parametrize(
    ("walls", "cells"),
    [
        pytest.param(Walls(), (5, 4, 3), id="slip"),
        pytest.param(STICK, (5, 4, 3), id="stick"),
        pytest.param(OPEN, (5, 4, 3), id="open"),
        pytest.param(MIXED, (5, 4, 3), id="mixed"),
        pytest.param(Walls(), (1, 1, 1), id="one-cell"),
        pytest.param(Walls(), (1, 9, 1), id="column"),
        pytest.param(Walls(y_high=Wall.OPEN), (7, 1, 2), id="half-open"),
    ],
)


def box(cells, walls):
    """A box full of gas, of cells that are no cubes."""
    builder = SceneBuilder("box")
    lower, upper = tuple(LOWER), tuple(LOWER + SPACING * cells)
    builder.domain(lower, upper, cells=cells)
    builder.walls(walls)
    builder.charge(Box(lower, upper), inert_gas(1000.0, 1e6, GAMMA), name="gas")
    builder.end_time(1.0)
    return builder.build()


def stir(state):
    """Random places all over the domain, some on the edges and in the middle of cells; random volumes and pressures."""
    random = np.random.default_rng(11)
    n = state.count
    fraction = random.random((n, 3)).astype(np.float32)
    special = random.choice([0.0, 0.5, np.nextafter(np.float32(0.5), np.float32(0.0)), float(LAST_FRACTION)], (n, 3))
    state.assign("fraction", np.where(random.random((n, 3)) < 0.1, special, fraction).astype(np.float32))
    state.assign("cell", random.integers(0, state.model.scene.domain.cells, (n, 3)).astype(np.int16))
    state.assign("mass", (state.values("mass") * random.uniform(0.5, 2.0, n)).astype(np.float32))
    state.assign("density", random.uniform(500.0, 2000.0, n).astype(np.float32))
    state.assign("energy", random.uniform(1e5, 2e6, n).astype(np.float32))


def carried(values):
    """What particles bring to the cells (n, 2), in double: V p [J] and V [m3], in the lanes of a cell's content."""
    volume = values["mass"].astype(np.float64) / values["density"]
    result = np.empty((len(volume), 2))
    result[:, PRESSURE] = volume * values["pressure"]
    result[:, FILLING] = volume
    return result


def assert_content_is_its_formula(solver):
    """In every cell and ghost, to the round-off of the sums; the last layer, which is no cell, stays empty."""
    scene, values = solver.model.scene, particle_values(solver.state)
    sums = tent_sums(scene.domain, values["position"], carried(values))
    expected = mirrored_cells(sums, scene.walls) / scene.domain.cell_volume
    computed = cell_content(solver)
    for lane in (PRESSURE, FILLING):
        largest = expected[..., lane].max()
        assert largest > 0.0
        np.testing.assert_allclose(computed[..., lane], expected[..., lane], rtol=0, atol=SUMMED * largest)
    for layer in (computed[-1], computed[:, -1], computed[:, :, -1]):
        assert not layer.any()


# ---- tents -----------------------------------------------------------------------------------------------------------


@wp.kernel(enable_backward=False)
def tents_kernel(fractions: wp.array(dtype=scalar), rows: wp.array2d(dtype=scalar)):
    n = wp.tid()
    weights = content.tents(fractions[n])
    rows[n, 0] = scalar(offset_nearest_node(fractions[n]))
    rows[n, 1] = weights[0]
    rows[n, 2] = weights[1]


def test_tents(device):
    """Two weights that are not negative, sum to one and put the particle where it is, between the two centres."""
    fractions = np.random.default_rng(3).random(1000).astype(np.float32)
    fractions[:5] = [0.0, 0.25, 0.5, np.nextafter(np.float32(0.5), np.float32(0.0)), float(LAST_FRACTION)]
    rows = wp.zeros((len(fractions), 3), dtype=scalar, device=device)
    wp.launch(tents_kernel, len(fractions), inputs=[wp.array(fractions, device=device), rows], device=device)
    lowest, *weights = rows.numpy().astype(np.float64).T
    assert set(lowest) == {-1.0, 0.0}
    assert min(weights[0].min(), weights[1].min()) >= 0.0
    np.testing.assert_allclose(weights[0] + weights[1], 1.0, rtol=0, atol=2 * ROUND_OFF)
    place = weights[0] * (lowest + 0.5) + weights[1] * (lowest + 1.5)
    np.testing.assert_allclose(place, fractions, rtol=0, atol=2 * ROUND_OFF)


@functools.cache
def gather_kernel():
    """Kernel that gathers the content of the cells around all particles."""

    @wp.kernel(enable_backward=False, module="unique")
    def evaluate(particles: Particles, grid: Grid, contents: wp.array(dtype=vector2)):
        p = wp.tid()
        contents[p] = content.gather_content(grid, particles.position[p].cell, particles.position[p].fraction)

    return evaluate


def test_gathered_content_reproduces_linear_fields(device):
    """Cells and ghosts that hold s (0.7 + g . x) give particles s (0.7 + g . x_p); what is no cell is not read."""
    cells = (5, 4, 3)
    state = start(box(cells, OPEN), device, prepare=stir).state
    slopes = np.array([[3.0, -4.0], [-4.0, 5.0], [5.0, 2.0]])  # of the two lanes
    scales = np.array([1e9, 1.0])
    centres = [LOWER[axis] + SPACING[axis] * (np.arange(n + 3) - 0.5) for axis, n in enumerate(cells)]
    given = scales * (0.7 + np.stack(np.meshgrid(*centres, indexing="ij"), axis=-1) @ slopes)
    given[-1] = given[:, -1] = given[:, :, -1] = np.nan
    state.grid.content.assign(given.reshape(-1, 2).astype(np.float32))
    gathered = wp.zeros(state.count, dtype=vector2, device=device)
    wp.launch(gather_kernel(), state.count, inputs=[state.particles, state.grid, gathered], device=device)
    expected = 0.7 + particle_values(state)["position"] @ slopes
    # Weights and contents, all below 1 in units of the scales, are rounded a few times each.
    computed = state.in_creation_order(gathered.numpy()) / scales
    np.testing.assert_allclose(computed, expected, rtol=0, atol=16 * ROUND_OFF)


def test_inside():
    """1 from a filling of 0.95 on, 0 up to 0.80, linear between."""
    for full, expected in ((2.0, 1.0), (0.95, 1.0), (0.9125, 0.75), (0.83, 0.2), (0.80, 0.0), (0.0, 0.0)):
        # The difference of two fillings is rounded to 1e-7 of 0.15.
        assert float(content.inside(full)) == pytest.approx(expected, abs=1e-6)


# ---- content ---------------------------------------------------------------------------------------------------------


@walls_and_cells
def test_content_is_its_formula(walls, cells, device):
    """Walls fold and mirror, axis by axis; beyond open faces cells are cells."""
    assert_content_is_its_formula(start(box(cells, walls), device, prepare=stir))


@walls_and_cells
def test_ghosts_behind_walls_are_mirror_images(walls, cells, device):
    """Bit for bit in both lanes, behind edges and corners too; beyond open faces cells have their own values."""
    values = cell_content(start(box(cells, walls), device, prepare=stir))
    for axis, side in itertools.product(range(3), range(2)):
        along = np.moveaxis(values, axis, 0)
        ghost, cell = ((along[0], along[1]), (along[-2], along[-3]))[side]
        if walls.faces()[2 * axis + side] is Wall.OPEN:
            assert np.any(ghost != cell, axis=(0, 1)).all()
        else:
            np.testing.assert_array_equal(ghost, cell)


@walls_and_cells
def test_the_cells_hold_what_the_particles_bring(walls, cells, device):
    """Sum P_c V_c = sum V p and sum J_c V_c = sum V: over the domain's cells in a closed box, else those beyond too."""
    scene = box(cells, walls)
    solver = start(scene, device, prepare=stir)
    held = cell_content(solver)
    for axis, (low, high) in enumerate(zip(walls.faces()[0::2], walls.faces()[1::2], strict=True)):
        first, last = int(low is not Wall.OPEN), cells[axis] + 1 + int(high is Wall.OPEN)
        held = np.moveaxis(np.moveaxis(held, axis, 0)[first:last], 0, axis)
    assert (held.shape == (*cells, 2)) == (Wall.OPEN not in walls.faces())
    total = carried(particle_values(solver.state)).sum(axis=0)
    np.testing.assert_allclose(held.sum(axis=(0, 1, 2)) * scene.domain.cell_volume, total, rtol=SUMMED)


@pytest.mark.parametrize("shape", list(ShapeFunction), ids=lambda shape: shape.value)
@pytest.mark.parametrize("margin", [0, 2, 6], ids=["closed", "near-open-faces", "free"])
def test_content_after_some_steps(shape, margin, device):
    """For every shape function nothing of earlier steps is left, while gas expands through the cells.

    Far from all faces too, where cells hold something whose lower corner no stencil of a narrow shape reaches.
    """
    scene = block((5, 4, 3), walls=OPEN, margin_cells=margin) if margin else block((5, 4, 3))
    solver = advance(start(scene, device, shape=shape), 12)
    assert_content_is_its_formula(solver)
    inside = cell_content(solver)[1:-2, 1:-2, 1:-2, FILLING]
    assert (inside.min() < 0.5) == (margin > 0)


# ---- force -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("ends", [Wall.SLIP, Wall.OPEN], ids=["closed", "open"])
def test_the_force_is_the_difference_between_cells(ends, axis, device):
    """f = (P_c below - P_c above) times the cross-section, summed over the four nodes across a column one cell wide.

    Particles lie anywhere in it. It holds next to closed ends too, where both force and pressure are folded: there the
    wall holds the node, and the next one inside counts.
    """
    faces, cells = [Wall.SLIP] * 6, [1, 1, 1]
    cells[axis] = 9
    faces[2 * axis] = faces[2 * axis + 1] = ends
    scene = box(tuple(cells), Walls(*faces))
    solver = start(scene, device, prepare=stir)
    sums = node_array(solver, "sums")[1:-1, 1:-1, 1:-1].astype(np.float64)
    across = tuple(other for other in range(3) if other != axis)
    force = sums[..., 4 + axis].sum(axis=across)
    assert_content_is_its_formula(solver)
    pressure = cell_content(solver)[1:-2, 1:-2, 1:-2, PRESSURE].ravel()
    assert np.ptp(pressure) > 0.1 * pressure.max()
    area = scene.domain.cell_volume / SPACING[axis]
    largest = pressure.max() * area
    np.testing.assert_allclose(force[1:-1], -np.diff(pressure) * area, rtol=0, atol=SUMMED * largest)


def test_evenly_filled_cells_are_at_rest(device):
    """J_c = 1 everywhere and one pressure: nothing accelerates, wherever particles lie along a column.

    Their volumes are such that the tents fill every cell, by least squares; the end walls carry p times the area. All
    lie on the column's axis: off it only the sum over the nodes across would vanish.
    """
    scene = box((9, 1, 1), Walls())
    full = scene.charges[0].particle_volume

    def fill_evenly(state):
        stir(state)
        fraction = state.values("fraction").copy()
        fraction[:, 1:] = 0.5
        state.assign("fraction", fraction)
        place = particle_values(state)["position"][state.particles.index.numpy()]
        unit = np.ones(1)
        shares = [mirrored_cells(tent_sums(scene.domain, x[None], unit), scene.walls)[1:-2, 1, 1] for x in place]
        volume = full * np.random.default_rng(5).uniform(0.8, 1.2, state.count)
        missing = scene.domain.cell_volume - volume @ shares
        volume += np.linalg.lstsq(np.transpose(shares), missing, rcond=None)[0]
        assert volume.min() > 0.1 * full
        assert volume.max() > 1.5 * volume.min()
        state.assign("density", 1000.0)
        state.assign("mass", (1000.0 * volume).astype(np.float32))
        state.assign("energy", 1e6)

    solver = start(scene, device, prepare=fill_evenly)
    held = cell_content(solver)[:-1, :-1, :-1]
    pressure = (GAMMA - 1.0) * 1000.0 * 1e6
    np.testing.assert_allclose(held[..., FILLING], 1.0, rtol=SUMMED)
    np.testing.assert_allclose(held[..., PRESSURE], pressure, rtol=SUMMED)
    node = nodes(solver)[1:-1, 1:-1, 1:-1]
    push = pressure * SPACING[1] * SPACING[2]
    assert np.abs(node[..., 3:4] * node[..., 4:7]).max() < SUMMED * push
    reactions = solver.state.reactions.numpy().reshape(-1, 6, 3).sum(axis=0)
    np.testing.assert_allclose(reactions[:2, 0], [push, -push], rtol=SUMMED)
