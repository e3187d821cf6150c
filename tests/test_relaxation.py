"""The relaxation of volumes, to the room that there is and to the pressure around: `relax_density` and its place.

It changes volumes alone: masses, energies and, for a gamma law, p V stay what they are.
"""

import functools
import itertools

import numpy as np
import pytest
import warp as wp
from scenes_for_tests import (
    CELL,
    OPEN,
    ROUND_OFF,
    TNT,
    advance,
    audited,
    block,
    explosive,
    inert_gas,
    particle_values,
    start,
)

from warp_mpm.config import Transfer
from warp_mpm.kernels import relaxation
from warp_mpm.kernels.content import FILLING, PRESSURE
from warp_mpm.kernels.eos import evaluate
from warp_mpm.kernels.precision import scalar, vector2
from warp_mpm.material_library import water
from warp_mpm.materials import Material

SERIES = 3e-4  # of the logarithm and the exponential, for exponents up to 0.6 (see `kernels/relaxation.py`)
FORMULA = 16 * ROUND_OFF  # an exponent below 1 in size, and its exponential, each rounded a few times
CELLS = (6, 5, 4)
GAS = inert_gas(1000.0, 1e6, 1.4)


@functools.cache
def relaxation_kernel():
    """Kernel of the relaxation."""

    @wp.kernel(enable_backward=False, module="unique")
    def evaluate(given: wp.array2d(dtype=scalar), densities: wp.array(dtype=scalar)):
        n = wp.tid()
        densities[n] = relaxation.relax_density(
            given[n, 0], given[n, 1], given[n, 2], given[n, 3], given[n, 4], relaxation.PASSIVE_EQUALISATION
        )

    return evaluate


def relax(rows, device, room=1.0):
    """Relaxed densities of rows of (density, filling, excess, crossing)."""
    density, *rest = np.array(rows, dtype=np.float32).T
    columns = np.stack([density, rest[0], rest[1], np.full(len(density), room, np.float32), rest[2]], axis=1)
    given = wp.array(columns, dtype=scalar, device=device)
    densities = wp.zeros(len(rows), dtype=scalar, device=device)
    wp.launch(relaxation_kernel(), len(rows), inputs=[given, densities], device=device)
    return densities.numpy().astype(np.float64)


def formula(filling, excess, crossing, room=1.0):
    """Factor J^(a / (1 + a)) exp(-x b / (1 + b)); J at least 1/2, x at most 1/2; a, b = 0.6 room, 0.25 crossing."""
    a, b = 0.6 * room * crossing, 0.25 * crossing
    return np.maximum(filling, 0.5) ** (a / (1.0 + a)) * np.exp(-np.clip(excess, -0.5, 0.5) * b / (1.0 + b))


# ---- the formula -----------------------------------------------------------------------------------------------------


def test_relaxation_is_its_formula(device):
    """On a grid of fillings, excesses and crossings, beyond both clamps too."""
    fillings = [2.0, 1.2, 1.0, 0.95, 0.8, 0.5, 0.3, 0.0]
    excesses = [-3.0, -0.6, -0.5, -0.1, 0.0, 0.02, 0.4, 0.5, 0.6, 100.0]
    rows = np.array([(1000.0, *row) for row in itertools.product(fillings, excesses, [0.0, 0.03, 0.3, 2.0])])
    expected = rows[:, 0] * formula(rows[:, 1], rows[:, 2], rows[:, 3])
    factor = relax(rows, device) / rows[:, 0]
    exponent = np.log(expected / rows[:, 0])
    parts = [formula(rows[:, 1], 0.0, rows[:, 3]), formula(1.0, rows[:, 2], rows[:, 3])]  # they may cancel
    size = np.abs(np.log(parts)).sum(axis=0)
    assert np.all(np.abs(np.log(factor) - exponent) <= FORMULA + SERIES * size)


def test_a_full_place_in_equilibrium_stays(device):
    """J = 1 and no excess change no bit, however long the step; nor does anything where nothing is crossed."""
    densities = np.random.default_rng(1).uniform(1.0, 3000.0, 20).astype(np.float32)
    in_equilibrium = [(density, 1.0, 0.0, crossing) for density in densities for crossing in (0.0, 0.3, 10.0)]
    frozen = [(density, filling, 0.4, 0.0) for density in densities for filling in (0.0, 0.7, 1.3)]
    for rows in (in_equilibrium, frozen):
        np.testing.assert_array_equal(relax(rows, device), [row[0] for row in rows])


def test_what_the_relaxation_moves_towards(device):
    """Matter with too high a pressure expands, and matter in a place with room; the others contract."""
    rows = [(1000.0, 1.0, 0.1, 0.3), (1000.0, 0.9, 0.0, 0.3), (1000.0, 1.0, -0.1, 0.3), (1000.0, 1.1, 0.0, 0.3)]
    hot, roomy, cold, crowded = relax(rows, device)
    assert max(hot, roomy) < 999.0
    assert min(cold, crowded) > 1001.0


@pytest.mark.parametrize("gamma", [1.2, 1.4, 2.0, 3.0])
def test_pressures_do_not_overshoot(gamma, device):
    """A gas whose p V stays, p ~ rho, comes nearer to the pressure around, and never past it, up to a crossing of 1.

    From above: x b / (1 + b) < (1 - P / p) / gamma < ln(p / P); from below the clamp holds it.
    """
    ratio = np.concatenate([np.geomspace(1e-3, 0.99, 20), np.geomspace(1.01, 1e3, 20)])  # p / P
    excess = (1.0 - 1.0 / ratio) / gamma
    for crossing in (0.1, 0.3, 1.0):
        rows = np.stack([np.full(40, 1000.0), np.ones(40), excess, np.full(40, crossing)], axis=1)
        after = ratio * relax(rows, device) / 1000.0
        assert np.all(np.abs(np.log(after)) < np.abs(np.log(ratio)))
        assert np.all((after > 1.0) == (ratio > 1.0))


@pytest.mark.parametrize("factor", [4.0, 10.0, 1e6])
def test_small_volumes_do_not_shrink_further_for_want_of_room(factor, device):
    """Four times the pressure around, in a place that is too full: matter there expands, that around it contracts."""
    excess = (1.0 - 1.0 / factor) / 2.0
    crowded = [(1000.0, 1.5, excess, 0.3)]
    assert relax(crowded, device, room=0.0)[0] < 1000.0 < relax(crowded, device, room=1.0)[0]


def test_who_takes_part_in_making_room(device):
    """All up to a ratio of 2 of the pressures, none from 4 on; of cavities all make room where it wants, none else."""

    @wp.kernel(enable_backward=False, module="unique")
    def evaluate_share(given: wp.array2d(dtype=scalar), shares: wp.array(dtype=scalar)):
        n = wp.tid()
        shares[n] = relaxation.yielding(given[n, 0], given[n, 1], given[n, 2])

    rows = [  # pressure, pressure around, filling, share
        (
            *(1.0, 1.0, 1.2, 1.0),
            *(2.0, 1.0, 1.2, 1.0),
            *(3.0, 1.0, 1.2, 0.5),
            *(4.0, 1.0, 1.2, 0.0),
            *(9.0, 1.0, 1.2, 0.0),
        ),
        (
            *(1.0, 1.0, 0.8, 1.0),
            *(1.0, 2.0, 0.8, 1.0),
            *(1.0, 3.0, 0.8, 0.5),
            *(1.0, 4.0, 0.8, 0.0),
            *(1.0, 9.0, 0.8, 0.0),
        ),
        (
            *(0.0, 1.0, 1.2, 1.0),
            *(0.0, 1.0, 0.8, 0.0),
            *(1.0, 0.0, 1.2, 0.0),
            *(1.0, 0.0, 0.8, 1.0),
            *(0.0, 0.0, 0.8, 1.0),
        ),
    ]
    table = np.array(rows, dtype=np.float32).reshape(-1, 4) * [1e9, 1e9, 1.0, 1.0]
    given = wp.array(table[:, :3].astype(np.float32), dtype=scalar, device=device)
    shares = wp.zeros(len(table), dtype=scalar, device=device)
    wp.launch(evaluate_share, len(table), inputs=[given, shares], device=device)
    assert shares.numpy() == pytest.approx(table[:, 3], abs=4 * ROUND_OFF)


# ---- its place in the step -------------------------------------------------------------------------------------------


def shake(state):
    """Random velocities, so that a step strains the material; cells to hold something, which not every grid has."""
    velocity = np.random.default_rng(4).normal(0.0, 100.0, (state.count, 3))
    state.assign("velocity", velocity.astype(np.float32))
    if len(state.grid.content) == 0:
        state.grid.content = wp.zeros(len(state.grid.start), dtype=vector2, device=state.device)


def step_from(scene, device, content, **config):
    """One step of shaken particles whose cells hold `content`, a function of the centres (..., 3) [m].

    Burn fractions, if any, and pressures are random.

    Returns:
        The solver, and the particles' values before the step.
    """
    solver = start(scene, device, prepare=shake, **config)
    state, domain = solver.state, scene.domain
    random = np.random.default_rng(6)
    if len(state.particles.burn_times):
        state.assign("burn_fraction", random.uniform(0.85, 1.0, state.count).astype(np.float32))
    state.assign("pressure", random.uniform(0.0, 3e9, state.count).astype(np.float32))
    index = np.stack(np.meshgrid(*(np.arange(-1, n + 2) for n in domain.cells), indexing="ij"), axis=-1)
    centres = domain.lower + domain.spacing * (index + 0.5)
    state.grid.content.assign(content(centres).reshape(-1, 2).astype(np.float32))
    before = particle_values(state)
    if len(state.particles.burn_times):
        before["burn_fraction"] = state.field("burn_fraction")
    solver.step()
    return solver, before


def sloping(place):
    """Content of places (..., 3): pressures from 0 to 3 GPa along y, fillings from 0.65 to 1.25 along x."""
    share = place / (np.array(CELLS) * 0.01)
    content = np.empty((*place.shape[:-1], 2))
    content[..., PRESSURE] = 3e9 * share[..., 1]
    content[..., FILLING] = 0.65 + 0.6 * share[..., 0]
    return content


def empty(place):
    """Content of places where there is none."""
    return np.zeros((*place.shape[:-1], 2))


@pytest.mark.parametrize("burns", [True, False], ids=["explosive", "gas"])
def test_relaxation_in_a_step(burns, device):
    """Inside the material, once burnt: from p before the step, and P and J where the particle was, c after its work.

    The same step with empty cells, which relaxes nothing, gives the density that the strain leaves.
    """
    scene = block(CELLS, material=explosive() if burns else GAS)
    gamma = 2.0 if burns else 1.4
    solver, before = step_from(scene, device, sloping)
    unrelaxed, _ = step_from(scene, device, empty)
    after, strained = particle_values(solver.state), particle_values(unrelaxed.state)
    assert np.ptp(strained["density"]) > 1e-3 * strained["density"].max()
    around = sloping(before["position"])
    inside = np.clip((around[:, FILLING] - 0.80) / 0.15, 0.0, 1.0)
    onset = np.clip((before["burn_fraction"] - 0.9) / 0.1, 0.0, 1.0) if burns else 1.0
    squared = gamma * (gamma - 1.0) * strained["energy"].astype(np.float64)
    excess = (before["pressure"] - around[:, PRESSURE]) / (strained["density"] * squared)
    assert excess.min() < -0.5
    assert excess.max() > 0.5
    dt, length = float(solver.state.clock_values()["dt"]), scene.domain.cell_volume ** (1 / 3)
    expected = formula(around[:, FILLING], excess, onset * inside * dt * np.sqrt(squared) / length)
    assert expected.min() < 0.99
    assert expected.max() > 1.01
    # Onset and inside are differences, and 10 times as rounded as what they are made of; crossings are below 0.3.
    computed = after["density"].astype(np.float64) / strained["density"]
    np.testing.assert_allclose(computed, expected, rtol=0, atol=FORMULA)
    if device == "cpu":  # on a GPU the order of atomic sums is the machine's
        for name in ("energy", "velocity", "position", "mass"):
            np.testing.assert_array_equal(after[name], strained[name])


@pytest.mark.parametrize("ambient", [0.0, 1e8])
def test_volumes_that_are_not_passive_relax_slowly_to_equal_pressures(ambient, device):
    """At a fifth of the rate, less where the pressure above the ambient one is small; whatever the ambient one."""
    products = Material("products", TNT.density, TNT, 4e6)

    def full(place):
        content = sloping(place)
        content[..., FILLING] = 1.0
        return content

    scene = block(CELLS, material=products, walls=OPEN, margin_cells=3, ambient_pressure=ambient)
    (relaxed, before), (strained, _) = (step_from(scene, device, content) for content in (full, empty))
    after, without = particle_values(relaxed.state), particle_values(strained.state)
    states = zip(without["density"].tolist(), without["energy"].tolist(), strict=True)
    squared = np.array([evaluate(TNT, TNT.sound_speed_squared, *state) for state in states])
    excess = (before["pressure"] - full(before["position"])[:, PRESSURE]) / (without["density"] * squared)
    dt, length = float(relaxed.state.clock_values()["dt"]), scene.domain.cell_volume ** (1 / 3)
    share = np.clip(4.0 * (before["pressure"] - ambient) / (without["density"] * squared), 0.0, 1.0)
    assert share.min() < 0.01
    assert share.max() > 0.5
    rate = 0.05 * share * dt * np.sqrt(squared) / length
    expected = np.exp(-np.clip(excess, -0.5, 0.5) * rate / (1.0 + rate))
    computed = after["density"].astype(np.float64) / without["density"]
    assert np.ptp(expected) > 1e-3
    np.testing.assert_allclose(computed, expected, rtol=0, atol=FORMULA)


def test_volumes_that_are_not_passive_do_not_run_away(device):
    """Those under much higher pressures than the cells around take no part in shrinking for want of room."""
    products = Material("products", TNT.density, TNT, 4e6)
    crowded = {}
    for pressure in (1e8, 1.0):  # that of the cells around, next to nothing in the end

        def content(place, pressure=pressure):
            values = np.empty((*place.shape[:-1], 2))
            values[..., PRESSURE], values[..., FILLING] = pressure, 1.5
            return values

        scene = block(CELLS, material=products, walls=OPEN, margin_cells=3)
        (relaxed, before), (strained, _) = (step_from(scene, device, given) for given in (content, empty))
        factor = particle_values(relaxed.state)["density"] / particle_values(strained.state)["density"]
        crowded[pressure] = factor, before["pressure"]
    shrinking, own = crowded[1e8]
    assert shrinking[own < 2e8].min() > 1.0
    assert shrinking[own > 4e8].max() <= 1.0
    assert crowded[1.0][0].max() <= 1.0


@pytest.mark.parametrize("ambient", [0.0, 101325.0])
def test_water_with_free_surfaces_stays_at_rest(ambient, device):
    """Nothing is relaxed there, where cells are not quite full: 1 % of its volume would be 26 MPa.

    Into a vacuum its 1 bar expands it by 4e-5 at c = 1.6 km/s: at most 0.06 m/s, at which it goes on, since no tension
    holds it together.
    """
    scene = block((6, 5, 4), material=water(), walls=OPEN, margin_cells=3, ambient_pressure=ambient)
    state = advance(start(scene, device), 200).state
    values = particle_values(state)
    assert np.abs(values["velocity"]).max() < 0.1
    assert np.abs(values["pressure"]).max() < 2e5
    flight = 0.1 * float(state.clock_values()["time"]) if ambient == 0.0 else 0.0  # of each face [m]
    assert values["density"] == pytest.approx(1000.0, rel=1e-4 + sum(2.0 * flight / (n * CELL) for n in (6, 5, 4)))


@pytest.mark.parametrize(
    ("ambient_pressure", "transfer"),
    [(1e5, Transfer.DAMPED_FLIP), (0.0, Transfer.FLIP), (0.0, Transfer.APIC)],
    ids=["ambient", "flip", "apic"],
)
def test_nothing_relaxes_without_damping_or_against_an_ambient_pressure(ambient_pressure, transfer, device):
    """The cells' content is of no effect then."""
    scene = block(CELLS, material=GAS, walls=OPEN, margin_cells=3, ambient_pressure=ambient_pressure)
    full, bare = (step_from(scene, device, content, transfer=transfer)[0].state for content in (sloping, empty))
    np.testing.assert_allclose(full.field("density"), bare.field("density"), rtol=FORMULA)


def test_pressures_even_out(device):
    """Gas at rest whose volumes are scattered by 10 %: pressures become one, while nothing moves and no energy is lost.

    All particles have the same p V, so that there are no forces. The excess, p - P over gamma p, falls by the share
    0.25 crossing / gamma a step: with a crossing of 0.3 to e^-5 after 100 steps. The room alone leaves most of it.
    """

    def scatter_volumes(state):
        factor = np.random.default_rng(9).uniform(0.9, 1.1, state.count)
        state.assign("density", (1000.0 * factor).astype(np.float32))

    solver = start(block(CELLS, material=GAS), device, prepare=scatter_volumes)
    first = solver.state.field("pressure")
    audit = audited(solver, 100)
    last = solver.state.field("pressure")
    assert np.std(first) > 0.05 * first.mean()
    assert np.std(last) < 0.02 * np.std(first)
    assert last.mean() == pytest.approx(0.4e9, rel=1e-4)
    assert audit.energy_error < 1e-6
    # Each step of 0.3 h / c adds some round-offs of p / (rho h), which are below 0.3 of them in c.
    assert np.abs(solver.state.field("velocity")).max() < 100 * ROUND_OFF * np.sqrt(1.4 * 0.4e6)
