"""Node values: their lanes, and multiply-add written so that a CPU does it in its vector units.

Warp's own vectors compile to scalar code on a CPU. Each operation here is one line of arithmetic; on a CPU it goes
through clang's vector types, on a GPU it is the plain Warp expression (tested to give the same values).
"""

from typing import Any

import warp as wp

from warp_mpm.kernels.precision import scalar, vector3, vector4, vector8

_CTYPE = "float" if scalar is wp.float32 else "double"


def _multiply_add(lanes: int) -> str:
    return f"""
#if defined(__clang__) && !defined(__CUDACC__)
    typedef {_CTYPE} lanes __attribute__((ext_vector_type({lanes})));
    lanes sum, addend;
    __builtin_memcpy(&sum, &total, sizeof(sum));
    __builtin_memcpy(&addend, &value, sizeof(addend));
    sum += weight * addend;
    wp::vec_t<{lanes}, {_CTYPE}> result;
    __builtin_memcpy(&result, &sum, sizeof(sum));
    return result;
#else
    return wp::add(total, wp::mul(value, weight));
#endif
"""


def _scatter_add(lanes: int) -> str:
    return f"""
#if defined(__clang__) && !defined(__CUDACC__)
    typedef {_CTYPE} lanes __attribute__((ext_vector_type({lanes})));
    lanes sum, addend;
    __builtin_memcpy(&sum, nodes.data + index, sizeof(sum));
    __builtin_memcpy(&addend, &value, sizeof(addend));
    sum += weight * addend;
    __builtin_memcpy(nodes.data + index, &sum, sizeof(sum));
#else
    wp::atomic_add(nodes, index, wp::mul(value, weight));
#endif
"""


@wp.func
def first_three(values: Any) -> vector3:
    """The first vector in the lanes of a node."""
    return vector3(values[0], values[1], values[2])


@wp.func
def second_three(values: vector8) -> vector3:
    """The second vector in the lanes of a node."""
    return vector3(values[4], values[5], values[6])


@wp.func_native(_multiply_add(4))
def multiply_add4(total: vector4, weight: scalar, value: vector4) -> vector4:
    """Total + weight value."""
    ...


@wp.func_native(_multiply_add(8))
def multiply_add8(total: vector8, weight: scalar, value: vector8) -> vector8:
    """Total + weight value."""
    ...


@wp.func_native(_scatter_add(4))
def scatter_add4(nodes: wp.array(dtype=vector4), index: int, weight: scalar, value: vector4):
    """Add weight value to nodes[index]; safe against other threads on a GPU, on a CPU within a slab's thread."""
    ...


@wp.func_native(_scatter_add(8))
def scatter_add8(nodes: wp.array(dtype=vector8), index: int, weight: scalar, value: vector8):
    """Add weight value to nodes[index]; safe against other threads on a GPU, on a CPU within a slab's thread."""
    ...
