"""The direction of the artificial viscosity: along the acceleration in strong compression, none in weak."""

import functools

import numpy as np
import pytest
import warp as wp

from warp_mpm.kernels.precision import matrix3, scalar, vector3
from warp_mpm.kernels.viscosity import Viscosity, closing_rate, directedness, unit_vector, viscous_length

ROUND_OFF = float(np.finfo(np.float32).eps)
LENGTH, SOUND = 0.01, 1000.0  # [m], [m/s]
STRONG = 1e3 * SOUND / LENGTH  # compression that jumps by 1000 c over a cell [1/s]


@functools.cache
def axis_kernel():
    """Kernel that evaluates axis and closing rate for rows of accelerations and gradients."""

    @wp.kernel(enable_backward=False, module="unique")
    def evaluate(
        viscosity: Viscosity,
        sound_speed: scalar,
        accelerations: wp.array(dtype=vector3),
        gradients: wp.array(dtype=matrix3),
        axes: wp.array(dtype=vector3),
        rates: wp.array(dtype=scalar),
    ):
        n = wp.tid()
        divergence = wp.trace(gradients[n])
        direction = unit_vector(accelerations[n])
        axis = directedness(viscosity, sound_speed, divergence) * direction
        axes[n] = axis
        rates[n] = closing_rate(wp.dot(axis, axis), wp.dot(direction, gradients[n] * direction), divergence)

    return evaluate


def axis_and_rate(acceleration, gradient, device):
    """Axis (3,) and closing rate of one acceleration (3,) and gradient (3, 3)."""
    viscosity = Viscosity()
    viscosity.length = LENGTH
    axes = wp.zeros(1, dtype=vector3, device=device)
    rates = wp.zeros(1, dtype=scalar, device=device)
    inputs = [
        *(viscosity, SOUND),
        wp.array(np.array([acceleration], dtype=np.float32), dtype=vector3, device=device),
        wp.array(np.array([gradient], dtype=np.float32), dtype=matrix3, device=device),
        *(axes, rates),
    ]
    wp.launch(axis_kernel(), 1, inputs=inputs, device=device)
    return axes.numpy()[0].astype(np.float64), float(rates.numpy()[0])


@pytest.mark.parametrize("jump", [0.01, 0.2, 1.0, 30.0])
def test_its_length_follows_the_compression(jump, device):
    """|b|^2 = x^2 / (x^2 + x0^2) with x = (l div v)^2, x0 = (0.2 c)^2: one half where a cell's jump is 0.2 c."""
    gradient = -jump * SOUND / LENGTH * np.diag([0.5, 0.3, 0.2])
    axis, _ = axis_and_rate([3.0, 0.0, 4.0], gradient, device)
    strength = jump**4 / (jump**4 + 0.2**4)
    assert axis @ axis == pytest.approx(strength, rel=64 * ROUND_OFF)
    np.testing.assert_allclose(axis, np.sqrt(strength) * np.array([0.6, 0.0, 0.8]), rtol=64 * ROUND_OFF)


@pytest.mark.parametrize("scale", [1e-20, 1.0, 1e9])
def test_the_unit_of_the_acceleration_does_not_matter(scale, device):
    """Down to numbers whose squares vanish in single precision: then there is no axis, and the viscosity is scalar."""
    gradient = -STRONG * np.diag([1.0, 0.0, 0.0])
    axis, rate = axis_and_rate([0.0, scale, 0.0], gradient, device)
    expected = 1.0 if scale > 1e-15 else 0.0
    np.testing.assert_allclose(axis, [0.0, expected, 0.0], atol=64 * ROUND_OFF)
    assert rate == pytest.approx(-STRONG * (1.0 - expected), abs=1e-4 * STRONG)


@pytest.mark.parametrize("jump", [0.01, 0.2, 1.0, 30.0])
def test_along_one_axis_it_is_the_scalar_one(jump, device):
    """Compression and acceleration along x: d = dv_x/dx, however long b is."""
    rate = -jump * SOUND / LENGTH
    _, closing = axis_and_rate([-7.0, 0.0, 0.0], np.diag([rate, 0.0, 0.0]), device)
    assert closing == pytest.approx(rate, rel=64 * ROUND_OFF)


@pytest.mark.parametrize("dimensions", [2, 3])
def test_gas_that_converges_evenly_is_left_alone(dimensions, device):
    """v = -r / |r|, as ahead of a Noh shock: nothing closes along the radius, but div v = -(n - 1) / |r|."""
    place = np.array([0.6, 0.8, 0.0]) if dimensions == 2 else np.array([2.0, 3.0, 6.0]) / 7.0
    across = np.diag([1.0, 1.0, float(dimensions == 3)]) - np.outer(place, place)
    axis, rate = axis_and_rate(5.0 * place, -STRONG * across, device)
    np.testing.assert_allclose(axis, place, rtol=1e-4)
    assert abs(rate) < 1e-4 * STRONG


@wp.kernel(enable_backward=False)
def length_kernel(viscosity: Viscosity, axes: wp.array(dtype=vector3), lengths: wp.array(dtype=scalar)):
    n = wp.tid()
    lengths[n] = viscous_length(viscosity, axes[n])


def test_its_length_is_that_of_the_cell_along_the_axis(device):
    """1 / l^2 = sum b_i^2 / h_i^2 + (1 - |b|^2) / (hx hy hz)^(2/3): a cell's edge along its axes, the mean of all edges
    without a direction; in cubes the edge for every b.
    """
    spacing = np.array([1e-3, 2e-3, 1.5e-3])
    mean = np.cbrt(np.prod(spacing))
    slanting = np.array([0.48, 0.6, 0.64])
    axes = np.array([*np.eye(3), np.zeros(3), slanting, 0.5 * slanting])
    expected = [*spacing, mean, np.linalg.norm(slanting / spacing) ** -1.0]
    expected.append((0.25 * np.linalg.norm(slanting / spacing) ** 2 + 0.75 / mean**2) ** -0.5)
    for sizes, lengths in ((spacing, expected), (np.full(3, 3e-3), [3e-3] * len(axes))):
        viscosity = Viscosity()
        viscosity.inverse_length = 1.0 / np.cbrt(np.prod(sizes))
        viscosity.inverse_spacing = wp.vec3(*(1.0 / sizes))
        computed = wp.zeros(len(axes), dtype=scalar, device=device)
        given = wp.array(axes.astype(np.float32), dtype=vector3, device=device)
        wp.launch(length_kernel, len(axes), inputs=[viscosity, given, computed], device=device)
        np.testing.assert_allclose(computed.numpy(), lengths, rtol=16 * ROUND_OFF)


def test_turning_everything_turns_the_axis(device):
    """Axis and rate do not know the grid's directions."""
    random = np.random.default_rng(5)
    turn, _ = np.linalg.qr(random.normal(size=(3, 3)))
    acceleration = random.normal(size=3)
    gradient = SOUND / LENGTH * (random.normal(size=(3, 3)) - np.eye(3))
    axis, rate = axis_and_rate(acceleration, gradient, device)
    turned_axis, turned_rate = axis_and_rate(turn @ acceleration, turn @ gradient @ turn.T, device)
    np.testing.assert_allclose(turned_axis, turn @ axis, atol=256 * ROUND_OFF)
    assert turned_rate == pytest.approx(rate, rel=1e-4)
