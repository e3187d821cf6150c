"""Node values: their lanes, and the multiply-add of whole nodes (see `stencil.py` for why it is written in C++)."""

from typing import Any

import warp as wp

from warp_mpm.kernels.precision import REAL, scalar, vector3, vector8

_MULTIPLY_ADD = f"""
#if defined(__clang__) && !defined(__CUDACC__)
    typedef {REAL} lanes __attribute__((ext_vector_type(8)));
    lanes sum, addend;
    __builtin_memcpy(&sum, &total, sizeof(sum));
    __builtin_memcpy(&addend, &value, sizeof(addend));
    sum += weight * addend;
    wp::vec_t<8, {REAL}> result;
    __builtin_memcpy(&result, &sum, sizeof(sum));
    return result;
#else
    return wp::add(total, wp::mul(value, weight));
#endif
"""


# Square of the speed below which a particle rests: 1e-15 m/s. Where particles take velocities over from the grid, they
# fade ahead of a wave from cell to cell without end, and numbers below the smallest normal one are slow to work with.
STILL = wp.constant(scalar(1.0e-30))


@wp.func
def at_rest_if_slow(velocity: vector3) -> vector3:
    """A velocity [m/s], or 0 if it is next to nothing."""
    return wp.where(wp.dot(velocity, velocity) < STILL, vector3(), velocity)


@wp.func
def first_three(values: Any) -> vector3:
    """The first vector in the lanes of a node."""
    return vector3(values[0], values[1], values[2])


@wp.func
def second_three(values: vector8) -> vector3:
    """The second vector in the lanes of a node."""
    return vector3(values[4], values[5], values[6])


@wp.func_native(_MULTIPLY_ADD)
def multiply_add8(total: vector8, weight: scalar, value: vector8) -> vector8:
    """Total + weight value."""
    ...
