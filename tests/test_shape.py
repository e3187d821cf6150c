"""Every shape function is one: partition of unity, linear reproduction, slopes, affine weights.

Sources: Steffen, Kirby, Berzins, Analysis and reduction of quadrature errors in the material point method, Int. J.
Numer. Meth. Engng 76 (2008); Bardenhagen, Kober, The generalized interpolation material point method, CMES 5 (2004);
Jiang et al., The affine particle-in-cell method, ACM Trans. Graph. 34 (2015). A new member of `SHAPES` is tested as
soon as it is listed there.
"""

import functools

import numpy as np
import pytest
import warp as wp
from scenes_for_tests import ROUND_OFF

from warp_mpm.kernels.precision import scalar
from warp_mpm.kernels.shape import SHAPES

HALF_WIDTHS = [0.5 / per_axis for per_axis in (1, 2, 3, 4)]
LAST_FRACTION = float(np.nextafter(np.float32(1.0), np.float32(0.0)))
BELOW_HALF = float(np.nextafter(np.float32(0.5), np.float32(0.0)))

pytestmark = [
    pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: shape.name),
    pytest.mark.parametrize("half_width", HALF_WIDTHS, ids=["1", "2", "3", "4"]),
]


@functools.cache
def stencil_kernel(shape):
    """Kernel that fills a row of weights, slopes, affine weights and the offset for each fraction."""
    weights, slopes, affine_weights = shape.weights, shape.slopes, shape.affine
    width, offset = shape.width, shape.offset

    @wp.kernel(enable_backward=False, module="unique")
    def evaluate(
        fractions: wp.array(dtype=scalar),
        half_width: scalar,
        values: wp.array3d(dtype=scalar),
        offsets: wp.array(dtype=int),
    ):
        n = wp.tid()
        w = weights(fractions[n], half_width)
        s = slopes(fractions[n], half_width)
        a = affine_weights(fractions[n], half_width)
        for i in range(width):
            values[n, 0, i] = w[i]
            values[n, 1, i] = s[i]
            values[n, 2, i] = a[i]
        offsets[n] = offset(fractions[n])

    return evaluate


def stencil(shape, half_width, device, fractions):
    """Weights, slopes, affine weights and node coordinates (in cells), each (fractions, width), in double."""
    fractions = np.asarray(fractions, dtype=np.float32)
    values = wp.zeros((len(fractions), 3, shape.width), dtype=scalar, device=device)
    offsets = wp.zeros(len(fractions), dtype=int, device=device)
    inputs = [wp.array(fractions, device=device), half_width, values, offsets]
    wp.launch(stencil_kernel(shape), len(fractions), inputs=inputs, device=device)
    weights, slopes, affine = np.moveaxis(values.numpy().astype(np.float64), 1, 0)
    return weights, slopes, affine, offsets.numpy()[:, None] + np.arange(shape.width)


def sample_fractions():
    """The ends of a cell, the switch between nearest nodes, and a spread between."""
    spread = np.random.default_rng(1).random(500, dtype=np.float32)
    return np.concatenate([[0.0, LAST_FRACTION, 0.5, BELOW_HALF, 0.25, 0.75, 1e-7, ROUND_OFF], spread])


def test_weights_are_a_partition_of_unity_and_not_negative(shape, half_width, device):
    """Sum w = 1, sum dw/ds = 0 (Steffen et al. 2008, sec. 2); a few roundings of numbers up to 1 and 2."""
    weights, slopes, _, _ = stencil(shape, half_width, device, sample_fractions())
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, rtol=0, atol=4 * ROUND_OFF)
    assert weights.min() >= 0.0
    # GIMP divides a difference that carries a rounding of a number up to 2 by twice its half width, 1/8 cell or more.
    np.testing.assert_allclose(slopes.sum(axis=1), 0.0, rtol=0, atol=16 * ROUND_OFF)


def test_linear_fields_are_reproduced(shape, half_width, device):
    """Sum w x_i = x_p and sum dw/ds x_i = 1 (in cells), to a few roundings of sums of numbers up to 2."""
    fractions = sample_fractions()
    weights, slopes, _, place = stencil(shape, half_width, device, fractions)
    np.testing.assert_allclose((weights * place).sum(axis=1), np.float32(fractions), rtol=0, atol=8 * ROUND_OFF)
    np.testing.assert_allclose((slopes * place).sum(axis=1), 1.0, rtol=0, atol=32 * ROUND_OFF)


def test_the_slope_is_the_derivative_of_the_weight(shape, half_width, device):
    """Mean value theorem: (w(b) - w(a)) / (b - a) lies between the least and the greatest slope from a to b.

    Slopes are sampled 16 times between a and b; between two samples they may pass them by at most as much as those
    differ. The quotient itself has two roundings of w <= 1 over b - a.
    """
    samples, step = 16, 1.0 / 1024  # fractions that are exact in single precision
    weights, slopes, _, place = stencil(shape, half_width, device, np.arange(0.0, 1.0, step))
    checked = 0
    for begin in range(0, len(weights) - samples, samples):
        window = slice(begin, begin + samples + 1)
        if np.ptp(place[window, 0]) > 0:  # the stencil changes from one nearest node to the next
            continue
        quotient = (weights[window][-1] - weights[window][0]) / (samples * step)
        slack = np.abs(np.diff(slopes[window], axis=0)).max(axis=0) + 2 * ROUND_OFF / (samples * step)
        assert np.all(quotient >= slopes[window].min(axis=0) - slack)
        assert np.all(quotient <= slopes[window].max(axis=0) + slack)
        checked += 1
    assert checked >= 60


def test_weights_pass_smoothly_from_cell_to_cell(shape, half_width, device):
    """A particle at the last fraction of a cell, and one on its upper face, have the same weights at the same nodes.

    They are one rounding apart, and slopes are at most 1 per cell.
    """
    weights, _, _, place = stencil(shape, half_width, device, [LAST_FRACTION, 0.0])
    nodes = np.arange(-1, 4)
    last = [weights[0] @ (place[0] == node) for node in nodes]
    first = [weights[1] @ (place[1] + 1 == node) for node in nodes]
    np.testing.assert_allclose(last, first, rtol=0, atol=4 * ROUND_OFF)


def test_affine_weights_measure_the_gradient_of_a_linear_field(shape, half_width, device):
    """Sum b (x_i - x_p) = 1 and sum b = 0, so that C = sum v_i b recovers B from v = a + B x (Jiang et al. 2015).

    b = w s / sum(w s^2) up to sign: near a node the linear weight and its moment f (1 - f) both are as small as the
    distance, and the slope stands for their quotient.
    """
    fractions = sample_fractions()
    _, _, affine, place = stencil(shape, half_width, device, fractions)
    distance = place - np.float32(fractions)[:, None].astype(np.float64)
    np.testing.assert_allclose((affine * distance).sum(axis=1), 1.0, rtol=0, atol=32 * ROUND_OFF)
    np.testing.assert_allclose(affine.sum(axis=1), 0.0, rtol=0, atol=32 * ROUND_OFF)


def test_affine_weights_are_the_moment_weights_over_the_second_moment(shape, half_width, device):
    """With the affine weight b: b sum(w s^2) = w (x_i - x_p), which conserves angular momentum (Jiang et al. 2015)."""
    fractions = sample_fractions()
    weights, _, affine, place = stencil(shape, half_width, device, fractions)
    distance = place - np.float32(fractions)[:, None].astype(np.float64)
    moment = (weights * distance**2).sum(axis=1, keepdims=True)
    np.testing.assert_allclose(affine * moment, weights * distance, rtol=0, atol=8 * ROUND_OFF)
