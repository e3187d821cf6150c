"""The solution of nodes that have no face near, against the formulas in NumPy, in double.

Rows are what a CPU runs, single nodes (`plain`) what a GPU runs. Some nodes are empty, some have so little mass that
they count as empty, and whole rows are empty.
"""

import numpy as np
import pytest
import warp as wp
from scenes_for_tests import ROUND_OFF

from warp_mpm.kernels.content import FULL, SPARSE
from warp_mpm.kernels.inside import solve_inside_function, solve_reprojected_inside_function
from warp_mpm.kernels.node_rows import nodes_at_a_time
from warp_mpm.kernels.precision import scalar, vector2, vector3, vector4, vector8
from warp_mpm.kernels.records import Grid

NODES = (7, 6, 10)  # of the arrays
INSIDE = (slice(1, -1),) * 3  # two rows of four along z
LIGHT = 1e-12  # [kg]
DT = 1e-6  # [s]
DAMPING = 3e-4  # k dt / l [s/m]
STRENGTH = 0.125  # of the sharpening
SPACING = (0.01, 0.012, 0.008)  # [m]
VOLUME = np.prod(SPACING)
GRAVITY = (1.0, -2.0, 3.0)
# Two dozen roundings: of inverses, values, differences, products, and sums of six; relative to the sum of sizes.
SUMMED = 24 * ROUND_OFF
LANES = {"sums": 8, "start": 8, "end": 8, "field": 2, "content_sums": 2, "content": 2, "reprojected": 4, "damping": 4}
TYPES = {2: vector2, 4: vector4, 8: vector8}

kinds = pytest.mark.parametrize("plain", [False, True], ids=["rows", "plain"])
sharpened_or_not = pytest.mark.parametrize("sharpened", [False, True], ids=["as_it_is", "sharpened"])


class Case:
    """Random nodes, rounded as the device's are, of every array; what is only written holds other things before."""

    def __init__(self, pushed=False):
        """`pushed`: at some nodes without mass, as linear shapes do, which are not sharpened."""
        random = np.random.default_rng(6)
        self.values = {name: random.normal(0.0, 1e3, (*NODES, lanes)) for name, lanes in LANES.items()}
        mass = 10.0 ** random.uniform(-9.0, -3.0, NODES)
        mass[random.random(NODES) < 0.2] = 0.0
        mass[random.random(NODES) < 0.1] = 0.1 * LIGHT
        mass[2, 3] = mass[4, 4] = 0.0
        sums, field = self.values["sums"], np.abs(self.values["field"])
        sums[..., 0:7] *= mass[..., None]
        sums[..., 3] = mass
        sums[1, 1, 1:3, 4:7] = 7.0 if pushed else 0.0
        sums[1, 1, 1:3, 0:4] = 0.0
        sums[..., 7] = VOLUME * random.uniform(0.0, 1.3, NODES) * (sums[..., 3] > 0.0)
        self.values["field"] = field * (sums[..., 3:4] > 0.0)
        self.values["reprojected"] *= sums[..., 3:4]
        self.values["start"][..., 3] = sums[..., 3]
        self.values["start"][..., 4:7] /= DT
        self.values = {name: values.astype(np.float32) for name, values in self.values.items()}
        self.values["start"][..., 7] = self.inverse(self.values["start"][..., 3])

    @staticmethod
    def inverse(mass):
        """1 / M, or 0 where a node counts as empty."""
        mass = mass.astype(np.float64)
        return np.divide(1.0, mass, out=np.zeros_like(mass), where=mass > LIGHT)

    def of(self, name):
        """An array in double."""
        return self.values[name].astype(np.float64)

    def grid(self, device):
        """The arrays as a kernel takes them."""
        grid = Grid()
        for name, lanes in LANES.items():
            flat = self.values[name].reshape(-1, lanes)
            setattr(grid, name, wp.array(flat, dtype=TYPES[lanes], device=device))
        grid.stride_x, grid.stride_y = NODES[1] * NODES[2], NODES[2]
        grid.inverse_spacing = vector3(*(1.0 / size for size in SPACING))
        grid.light_mass = LIGHT
        return grid


def excess(mass, value, size):
    """Sum of min(M_i, M_j) (x_i - x_j) over the neighbours of the inner nodes, and the sum of the terms' sizes."""
    total, sizes = np.zeros((2, *value[INSIDE].shape))
    for axis in range(3):
        for side in (-1, 1):
            other_mass, other, far = (np.roll(x, side, axis)[INSIDE] for x in (mass, value, size))
            link = np.minimum(mass[INSIDE], other_mass)[..., None]
            total += link * (value[INSIDE] - other)
            sizes += link * (size[INSIDE] + far)
    return total, sizes


def run(kernel, grid, plain, device, *inputs):
    """Let a kernel work on the inner nodes, row by row or one by one; returns the arrays, inner nodes, in double."""
    at_a_time = 1 if plain or wp.get_device(device).is_cuda else 4
    numbers = np.arange(np.prod(NODES), dtype=np.int32).reshape(NODES)[INSIDE][..., ::at_a_time]
    first = wp.array(numbers.ravel(), dtype=int, device=device)
    wp.launch(kernel, numbers.size, inputs=[grid, first, *inputs], device=device)
    arrays = {name: getattr(grid, name).numpy().reshape(*NODES, -1) for name in LANES}
    outside = np.ones(NODES, bool)
    outside[INSIDE] = False
    return {name: array[INSIDE].astype(np.float64) for name, array in arrays.items()}, {
        name: array[outside] for name, array in arrays.items()
    }


def assert_close(computed, expected, sizes):
    """Equal to round-off of what they are made of."""
    assert np.abs(expected).max() > 0.0
    assert np.all(np.abs(computed - expected) <= SUMMED * sizes)


def solve_kernel(plain, force, sharpened):
    solve = solve_inside_function(force, True, sharpened, True, plain)

    @wp.kernel(enable_backward=False, module="unique")
    def solve_listed(grid: Grid, first: wp.array(dtype=int), gravity: vector3, peaks: wp.array(dtype=scalar)):
        thread = wp.tid()
        peaks[thread] = solve(grid, gravity, scalar(STRENGTH), first[thread])

    return solve_listed


@kinds
@sharpened_or_not
def test_the_solution_of_the_scattered_sums(plain, sharpened, device):
    """v = P / M, a = (f + s sum min(M_i, M_j) (a_i - a_j)) / M + g, p = sum w V p over the occupied volume, c."""
    case = Case(pushed=not sharpened)
    peaks = wp.zeros(int(np.prod(NODES)), dtype=scalar, device=device)
    grid = case.grid(device)
    found, outside = run(solve_kernel(plain, True, sharpened), grid, plain, device, vector3(*GRAVITY), peaks)
    sums, field = case.of("sums"), case.of("field")
    mass, inverse = sums[..., 3], case.inverse(sums[..., 3])
    acceleration = inverse[..., None] * sums[..., 4:7]
    pulled, sizes = excess(mass, acceleration, np.abs(acceleration)) if sharpened else np.zeros((2, 1))
    inside, inverse, mass, field = sums[INSIDE], inverse[INSIDE][..., None], mass[INSIDE], field[INSIDE]
    counts = inverse > 0.0
    expected = acceleration[INSIDE] + inverse * STRENGTH * pulled + counts * np.array(GRAVITY)
    assert_close(
        found["start"][..., 4:7], expected, np.abs(acceleration[INSIDE]) + inverse * sizes + counts * np.abs(GRAVITY)
    )
    assert_close(found["start"][..., 0:3], inverse * inside[..., 0:3], np.abs(inverse * inside[..., 0:3]))
    np.testing.assert_array_equal(found["start"][..., 3], mass)
    np.testing.assert_allclose(found["start"][..., 7], inverse[..., 0], rtol=SUMMED)

    filling = inside[..., 7] / VOLUME
    share = np.clip((filling - float(SPARSE)) / (float(FULL) - float(SPARSE)), 0.0, 1.0)
    pressure = counts[..., 0] * field[..., 0] / VOLUME / (share * filling + 1.0 - share)
    # A rounding of the filling is multiplied by the slope of the share, 1 / 0.15.
    np.testing.assert_allclose(found["field"][..., 0], pressure, rtol=10 * SUMMED)
    np.testing.assert_allclose(found["field"][..., 1], np.sqrt(inverse[..., 0] * field[..., 1]), rtol=SUMMED)
    assert peaks.numpy().max() == found["field"][..., 0][filling >= 0.5].max()
    np.testing.assert_allclose(found["content"], case.of("content_sums")[INSIDE] / VOLUME, rtol=SUMMED)
    assert not found["content_sums"].any()
    assert not found["reprojected"].any()
    kept = np.where((mass == 0.0)[..., None], 0.0, inside)
    np.testing.assert_array_equal(found["sums"], kept)  # but what was pushed without mass
    for name, values in outside.items():
        edge = np.ones(NODES, bool)
        edge[INSIDE] = False
        np.testing.assert_array_equal(values, case.values[name][edge], err_msg=name)


@kinds
def test_without_forces_only_velocities_are_solved(plain, device):
    """USF, whose forces come later."""
    case = Case()
    peaks = wp.zeros(int(np.prod(NODES)), dtype=scalar, device=device)
    found, _ = run(solve_kernel(plain, False, False), case.grid(device), plain, device, vector3(*GRAVITY), peaks)
    sums = case.of("sums")[INSIDE]
    expected = case.inverse(sums[..., 3])[..., None] * sums[..., 0:3]
    assert_close(found["start"][..., 0:3], expected, np.abs(expected))
    assert not found["start"][..., 4:7].any()
    np.testing.assert_array_equal(found["field"], case.values["field"][INSIDE])


def reprojected_kernel(plain, sharpened, damped):
    solve = solve_reprojected_inside_function(sharpened, damped, plain)

    @wp.kernel(enable_backward=False, module="unique")
    def solve_listed(grid: Grid, first: wp.array(dtype=int)):
        solve(grid, scalar(DT), scalar(DAMPING), scalar(STRENGTH), first[wp.tid()])

    return solve_listed


@kinds
@sharpened_or_not
@pytest.mark.parametrize("damped", [False, True], ids=["undamped", "damped"])
def test_the_solution_of_the_reprojected_sums(plain, sharpened, damped, device):
    """v + dt a moves, (v + v_r) / 2 works, both sharpened; alpha v_r and the heat of the damping."""
    case = Case()
    found, _ = run(reprojected_kernel(plain, sharpened, damped), case.grid(device), plain, device)
    start, given, field = case.of("start"), case.of("reprojected"), case.of("field")[INSIDE]
    mass, inverse = start[..., 3], start[..., 7:]
    velocity, step, seen = start[..., 0:3], DT * start[..., 4:7], inverse * given[..., 0:3]
    inside = mass[INSIDE][..., None] > 0.0
    per_mass = STRENGTH * inverse[INSIDE]
    for lanes, value, size in (
        (slice(0, 3), velocity + step, np.abs(velocity) + np.abs(step)),
        (slice(4, 7), (velocity + seen) / 2, (np.abs(velocity) + np.abs(seen)) / 2),
    ):
        pulled, sizes = excess(mass, value, size) if sharpened else np.zeros((2, 1))
        expected, sizes = value[INSIDE] + per_mass * pulled, size[INSIDE] + per_mass * sizes
        assert np.all((np.abs(found["end"][..., lanes] - expected) <= SUMMED * sizes)[inside[..., 0]])
    alpha = DAMPING * field[..., 1] / (1.0 + DAMPING * field[..., 1])
    np.testing.assert_array_equal(found["end"][..., 3], mass[INSIDE])
    np.testing.assert_allclose(found["end"][..., 7], alpha * inside[..., 0], rtol=SUMMED)
    seen = seen[INSIDE]
    share = alpha[..., None] if damped else 1.0
    assert_close(found["damping"][..., 0:3], share * seen, np.abs(share * seen))
    squared, doubled = (seen**2).sum(axis=-1), 2.0 * given[INSIDE][..., 3] * inverse[INSIDE][..., 0]
    heat = alpha * np.maximum(doubled - squared, 0.0) * damped
    assert np.all(np.abs(found["damping"][..., 3] - heat) <= SUMMED * alpha * (squared + np.abs(doubled)))
    empty = inside.reshape(-1, 4).sum(axis=1) == 0  # rows of four
    assert empty.any()
    assert not found["end"].reshape(-1, 4, 8)[empty].any()
    assert not found["sums"][inside[..., 0]].any()
    assert not found["field"][inside[..., 0]].any()


def test_a_cpu_takes_four_nodes_at_a_time(device):
    @wp.kernel(enable_backward=False, module="unique")
    def count(result: wp.array(dtype=int)):
        result[0] = nodes_at_a_time()

    result = wp.zeros(1, dtype=int, device=device)
    wp.launch(count, 1, inputs=[result], device=device)
    assert result.numpy()[0] == (1 if wp.get_device(device).is_cuda else 4)
