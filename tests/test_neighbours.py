"""A node and its neighbours along the axes, against NumPy: sum min(M_i, M_j) (x_i - x_j), in double.

Vectors are what a CPU runs, `plain` is what a GPU runs. Some nodes are empty, some have so little mass that they count
as empty.
"""

import functools

import numpy as np
import pytest
import warp as wp
from scenes_for_tests import ROUND_OFF

from warp_mpm.kernels import neighbours
from warp_mpm.kernels.precision import scalar, vector4, vector8

NODES = (7, 6, 8)  # of the array
INSIDE = (slice(1, -1),) * 3
LIGHT = 1e-12  # [kg]
DT = 1e-6  # [s]
# A dozen roundings: of 1 / M, of values, differences and products, and of sums of six; relative to the sum of sizes.
SUMMED = 12 * ROUND_OFF

plain_or_not = pytest.mark.parametrize("plain", [False, True], ids=["vectors", "plain"])


class Case:
    """Random nodes (..., lanes), rounded as the device's are."""

    def __init__(self):
        random = np.random.default_rng(6)
        self.mass = 10.0 ** random.uniform(-9.0, -3.0, NODES)
        self.mass[random.random(NODES) < 0.2] = 0.0
        self.mass[random.random(NODES) < 0.1] = 0.1 * LIGHT
        # Lanes that are no part of it hold other things: volumes, for one.
        self.sums, self.start = random.normal(0.0, 1e3, (2, *NODES, 8)).astype(np.float32)
        self.reprojected = random.normal(0.0, 1e3, (*NODES, 4)).astype(np.float32)
        self.sums[..., 4:7] *= self.mass[..., None]
        self.sums[..., 3] = self.start[..., 3] = self.mass
        self.mass = self.sums[..., 3].astype(np.float64)
        self.inverse = np.divide(1.0, self.mass, out=np.zeros(NODES), where=self.mass > LIGHT)
        self.start[..., 4:7] /= DT
        self.start[..., 7] = self.inverse
        self.reprojected[..., 0:3] *= self.mass[..., None]

    def excess(self, *terms):
        """The sums over neighbours of the inner nodes (..., 3), of a value that is the sum of terms; and of sizes."""
        value, size = sum(terms), sum(np.abs(term) for term in terms)
        total, sizes = np.zeros((2, *value[INSIDE].shape))
        for axis in range(3):
            for side in (-1, 1):
                mass, other, far = (np.roll(x, side, axis)[INSIDE] for x in (self.mass, value, size))
                link = np.minimum(self.mass[INSIDE], mass)[..., None]
                total += link * (value[INSIDE] - other)
                sizes += link * (size[INSIDE] + far)
        return total, sizes


def flat(values, dtype, device):
    return wp.array(values.reshape(-1, values.shape[-1]), dtype=dtype, device=device)


@functools.cache
def kernels(plain):
    """Kernels that take the sums of listed nodes: of accelerations, of both velocities."""
    of_accelerations = neighbours.acceleration_excess_function(plain)
    of_velocities = neighbours.velocity_excess_function(plain)

    @wp.kernel(enable_backward=False, module="unique")
    def accelerations(
        sums: wp.array(dtype=vector8),
        listed: wp.array(dtype=int),
        stride_x: int,
        stride_y: int,
        light_mass: scalar,
        results: wp.array(dtype=vector4),
    ):
        n = wp.tid()
        results[n] = of_accelerations(sums, listed[n], stride_x, stride_y, light_mass)

    @wp.kernel(enable_backward=False, module="unique")
    def velocities(
        start: wp.array(dtype=vector8),
        reprojected: wp.array(dtype=vector4),
        listed: wp.array(dtype=int),
        stride_x: int,
        stride_y: int,
        dt: scalar,
        results: wp.array(dtype=vector8),
    ):
        n = wp.tid()
        results[n] = of_velocities(start, reprojected, listed[n], stride_x, stride_y, dt)

    return accelerations, velocities


def computed(kernel, arrays, number, dtype, device):
    """What a kernel gives for the inner nodes (..., lanes), in double."""
    listed = np.arange(np.prod(NODES), dtype=np.int32).reshape(NODES)[INSIDE]
    results = wp.zeros(listed.size, dtype=dtype, device=device)
    places = wp.array(listed.ravel(), dtype=int, device=device)
    inputs = [*arrays, places, NODES[1] * NODES[2], NODES[2], number, results]
    wp.launch(kernel, listed.size, inputs=inputs, device=device)
    return results.numpy().reshape(*listed.shape, -1).astype(np.float64)


def assert_is(computed, case, *terms):
    """Three lanes are the formula's."""
    expected, sizes = case.excess(*terms)
    assert np.abs(expected).max() > 0.0
    assert np.all(np.abs(computed - expected) <= SUMMED * sizes)


@plain_or_not
def test_the_excess_of_accelerations(plain, device):
    """Of f / M, 0 where a node counts as empty; the fourth lane is 0."""
    case = Case()
    kernel, _ = kernels(plain)
    result = computed(kernel, [flat(case.sums, vector8, device)], LIGHT, vector4, device)
    assert_is(result[..., 0:3], case, case.inverse[..., None] * case.sums[..., 4:7])
    assert not result[..., 3].any()


@plain_or_not
def test_the_excess_of_both_velocities(plain, device):
    """Of v + dt a, which moves, and of (v + P_r / M) / 2, which works; what is beside them is 0."""
    case = Case()
    _, kernel = kernels(plain)
    arrays = [flat(case.start, vector8, device), flat(case.reprojected, vector4, device)]
    result = computed(kernel, arrays, DT, vector8, device)
    start = case.start.astype(np.float64)
    assert_is(result[..., 0:3], case, start[..., 0:3], DT * start[..., 4:7])
    assert_is(result[..., 4:7], case, start[..., 0:3] / 2, start[..., 7:] * case.reprojected[..., 0:3] / 2)
    assert not result[..., [3, 7]].any()
