"""A node and its six neighbours along the axes: the sums that sharpening takes, for nodes that have no face near.

    sum over the neighbours j of min(M_i, M_j) (x_i - x_j)

with x the acceleration, from the sums of the scatter; or the velocities of the step, from the values at its start and
the re-projected sums. x is computed where it is needed, seven times for each node, which is cheaper than one more pass
over the nodes to store it. Like `stencil.py` this is written once, in C++: on a CPU with the compiler's vectors of four
numbers, half a node; on a GPU with Warp's. `plain` asks for Warp's on a CPU too, for tests.

`sharpen.py` has the same for nodes near walls and faces, in Warp, and says what it is for.
"""

import functools

import warp as wp

from warp_mpm.kernels.precision import REAL, scalar, vector4, vector8
from warp_mpm.kernels.wide_access import wide_access

_VECTORS = f"""
    typedef {REAL} half __attribute__((ext_vector_type(4)));
    auto load = [](const void* from) {{ half x; memcpy(&x, from, sizeof(x)); return x; }};
    auto plus = [](half sum, half x, {REAL} weight) {{ return __builtin_elementwise_fma(x, (half)weight, sum); }};
    auto minus = [](half x, half y) {{ return x - y; }};
    auto add = [](half x, half y) {{ return x + y; }};
    auto inverse = [](half masses, {REAL} light) {{  // without a branch, and all divisions at once
        auto counts = masses > light;
        half inverses = 1 / masses;
        auto bits = counts;
        __builtin_memcpy(&bits, &inverses, sizeof(bits));
        bits &= counts;
        __builtin_memcpy(&inverses, &bits, sizeof(bits));
        return inverses;
    }};
"""

_PLAIN = f"""
    typedef wp::vec_t<4, {REAL}> half;
{wide_access(4)}
    auto load = [&](const void* from) {{ return read(from); }};
    auto plus = [](half sum, half x, {REAL} weight) {{ return wp::add(sum, wp::mul(x, weight)); }};
    auto minus = [](half x, half y) {{ return wp::sub(x, y); }};
    auto add = [](half x, half y) {{ return wp::add(x, y); }};
    auto inverse = [](half masses, {REAL} light) {{
        half inverses;
        for (int k = 0; k < 4; ++k)
            inverses[k] = masses[k] > light ? 1 / masses[k] : 0;
        return inverses;
    }};
"""

_SHARED = f"""
    typedef {REAL} number;
    auto low = [&](const void* node) {{ return load(node); }};
    auto high = [&](const void* node) {{ return load((number*)node + 4); }};
    const int at[7] = {{n - stride_x, n + stride_x, n - stride_y, n + stride_y, n - 1, n + 1, n}};
"""

# Lanes of the sums: momentum, mass | force, volume.
_ACCELERATIONS = """
    half masses[2] = {};
    for (int k = 0; k < 7; ++k)
        masses[k / 4][k % 4] = sums.data[at[k]][3];
    const half inverses[2] = {inverse(masses[0], light_mass), inverse(masses[1], light_mass)};
    auto mass = [&](int k) { return masses[k / 4][k % 4]; };
    auto acceleration = [&](int k) { return plus(half{}, high(sums.data + at[k]), inverses[k / 4][k % 4]); };
    half here = acceleration(6), along[3] = {}, total;
    for (int k = 0; k < 6; ++k)
        along[k / 2] = plus(along[k / 2], minus(here, acceleration(k)), mass(k) < mass(6) ? mass(k) : mass(6));
    total = add(add(along[0], along[1]), along[2]);
    total[3] = 0;
    wp::vec_t<4, number> result;
    memcpy(&result, &total, sizeof(result));
    return result;
"""

# Lanes of the start: velocity, mass | acceleration, 1 / mass or 0; of the re-projected sums: momentum, energy.
_VELOCITIES = """
    auto motion = [&](int m) { return plus(low(start.data + m), high(start.data + m), dt); };
    auto twice_work = [&](int m) { return plus(low(start.data + m), low(reprojected.data + m), start.data[m][7]); };
    auto mass = start.data[n][3];
    half moves = motion(n), works = twice_work(n), moves_along[3] = {}, works_along[3] = {}, total[2];
    for (int k = 0; k < 6; ++k) {
        auto other = start.data[at[k]][3];
        auto link = other < mass ? other : mass;
        moves_along[k / 2] = plus(moves_along[k / 2], minus(moves, motion(at[k])), link);
        works_along[k / 2] = plus(works_along[k / 2], minus(works, twice_work(at[k])), link / 2);
    }
    total[0] = add(add(moves_along[0], moves_along[1]), moves_along[2]);
    total[1] = add(add(works_along[0], works_along[1]), works_along[2]);
    total[0][3] = total[1][3] = 0;
    wp::vec_t<8, decltype(mass)> result;
    memcpy(&result, total, sizeof(result));
    return result;
"""


def _compiled(body: str, plain: bool) -> str:
    """C++ for either kind of vector."""
    of_nodes = _PLAIN + _SHARED + body
    if plain:
        return of_nodes
    return f"""
#if defined(__clang__) && !defined(__CUDACC__)
{_VECTORS + _SHARED + body}
#else
{of_nodes}
#endif
"""


@functools.cache
def acceleration_excess_function(plain: bool = False) -> wp.Function:
    """Device function (sums, n, stride_x, stride_y, light_mass): x = f / M, 0 where a node counts as empty; [N]."""

    @wp.func_native(_compiled(_ACCELERATIONS, plain))
    def acceleration_excess(
        sums: wp.array(dtype=vector8), n: int, stride_x: int, stride_y: int, light_mass: scalar
    ) -> vector4: ...

    return acceleration_excess


@functools.cache
def velocity_excess_function(plain: bool = False) -> wp.Function:
    """Device function (start, reprojected, n, stride_x, stride_y, dt): x = v + dt a, and (v + P_r / M) / 2; [kg m/s].

    In lanes 0 to 2 and 4 to 6, as in `Grid.end`.
    """

    @wp.func_native(_compiled(_VELOCITIES, plain))
    def velocity_excess(
        start: wp.array(dtype=vector8),
        reprojected: wp.array(dtype=vector4),
        n: int,
        stride_x: int,
        stride_y: int,
        dt: scalar,
    ) -> vector8: ...

    return velocity_excess
