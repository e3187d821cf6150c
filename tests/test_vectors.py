"""The operations on wide vectors that the transfer is made of, against NumPy."""

import functools

import numpy as np
import pytest
import warp as wp
from scenes_for_tests import ROUND_OFF

from warp_mpm.kernels import vectors
from warp_mpm.kernels.precision import scalar, vector4, vector8


@functools.cache
def vector_kernel(lanes):
    """Kernel that applies the multiply-add and the scatter of `vectors.py` to rows."""
    vector = vector4 if lanes == 4 else vector8
    multiply_add = vectors.multiply_add4 if lanes == 4 else vectors.multiply_add8
    scatter_add = vectors.scatter_add4 if lanes == 4 else vectors.scatter_add8

    @wp.kernel(enable_backward=False, module="unique")
    def evaluate(
        totals: wp.array(dtype=vector),
        weights: wp.array(dtype=scalar),
        values: wp.array(dtype=vector),
        results: wp.array(dtype=vector),
        nodes: wp.array(dtype=vector),
    ):
        n = wp.tid()
        results[n] = multiply_add(totals[n], weights[n], values[n])
        scatter_add(nodes, n, weights[n], values[n])

    return evaluate


@pytest.mark.parametrize("lanes", [4, 8])
def test_vector_operations_equal_numpy(lanes, device):
    """Total + weight value, in every lane; a fused multiply-add saves one of the two roundings."""
    vector = vector4 if lanes == 4 else vector8
    random = np.random.default_rng(6)
    totals, values = random.normal(0.0, 1e3, (2, 100, lanes)).astype(np.float32)
    weights = random.normal(0.0, 1.0, 100).astype(np.float32)
    results = wp.zeros(100, dtype=vector, device=device)
    target = wp.array(totals, dtype=vector, device=device)
    given = [wp.array(totals, dtype=vector, device=device), wp.array(weights, device=device)]
    inputs = [*given, wp.array(values, dtype=vector, device=device), results, target]
    wp.launch(vector_kernel(lanes), 100, inputs=inputs, device=device)
    product = weights[:, None].astype(np.float64) * values
    rounding = 2 * ROUND_OFF * (np.abs(totals) + np.abs(product))
    for computed in (results.numpy(), target.numpy()):
        assert np.all(np.abs(computed - (totals + product)) <= rounding)
