"""The multiply-add of whole nodes, against NumPy."""

import numpy as np
import warp as wp
from scenes_for_tests import ROUND_OFF

from warp_mpm.kernels.precision import scalar, vector8
from warp_mpm.kernels.vectors import multiply_add8


@wp.kernel(enable_backward=False)
def evaluate(
    totals: wp.array(dtype=vector8),
    weights: wp.array(dtype=scalar),
    values: wp.array(dtype=vector8),
    results: wp.array(dtype=vector8),
):
    n = wp.tid()
    results[n] = multiply_add8(totals[n], weights[n], values[n])


def test_multiply_add_equals_numpy(device):
    """Total + weight value, in every lane; a fused multiply-add saves one of the two roundings."""
    random = np.random.default_rng(6)
    totals, values = random.normal(0.0, 1e3, (2, 100, 8)).astype(np.float32)
    weights = random.normal(0.0, 1.0, 100).astype(np.float32)
    results = wp.zeros(100, dtype=vector8, device=device)
    inputs = [
        wp.array(totals, dtype=vector8, device=device),
        wp.array(weights, device=device),
        wp.array(values, dtype=vector8, device=device),
        results,
    ]
    wp.launch(evaluate, 100, inputs=inputs, device=device)
    product = weights[:, None].astype(np.float64) * values
    rounding = 2 * ROUND_OFF * (np.abs(totals) + np.abs(product))
    assert np.all(np.abs(results.numpy() - (totals + product)) <= rounding)
