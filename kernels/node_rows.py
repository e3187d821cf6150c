"""Nodes along z, worked on together: on a CPU a row of four, one in each lane of a vector; on a GPU one node.

What a pass does to nodes is written once, in C++, with `number` for a quantity of all nodes of a row, so that it reads
like the formula for one. Values of nodes are turned into numbers where they are read, and back where they are written.
Both kinds declare the same: `number`, and

    read_eight, read_four, read_two      all values of the nodes of a row, by the address of its first node
    read_mass_and_force                  lanes 3 to 6 of eight
    write_eight, write_four, write_two   and back
    smaller, choose, root, any, highest  of numbers

`plain` asks for single nodes on a CPU too: for those whose row comes near a face, and for tests.
"""

import warp as wp

from warp_mpm.kernels.precision import REAL
from warp_mpm.kernels.wide_access import wide_access

_ROW = f"""
    typedef {REAL} number __attribute__((ext_vector_type(4)));
    auto load = [](const void* at) {{ number x; memcpy(&x, at, sizeof(x)); return x; }};
    auto store = [](void* at, number x) {{ memcpy(at, &x, sizeof(x)); }};
    auto turn = [](number* x) {{  // rows of four by four into columns
        number a = __builtin_shufflevector(x[0], x[1], 0, 4, 1, 5), b = __builtin_shufflevector(x[0], x[1], 2, 6, 3, 7);
        number c = __builtin_shufflevector(x[2], x[3], 0, 4, 1, 5), d = __builtin_shufflevector(x[2], x[3], 2, 6, 3, 7);
        x[0] = __builtin_shufflevector(a, c, 0, 1, 4, 5);
        x[1] = __builtin_shufflevector(a, c, 2, 3, 6, 7);
        x[2] = __builtin_shufflevector(b, d, 0, 1, 4, 5);
        x[3] = __builtin_shufflevector(b, d, 2, 3, 6, 7);
    }};
    auto read_part = [=](const void* nodes, int lanes, int first, number* x) {{
        for (int node = 0; node < 4; ++node)
            x[node] = load((const {REAL}*)nodes + node * lanes + first);
        turn(x);
    }};
    auto write_part = [=](void* nodes, int lanes, int first, const number* x) {{
        number y[4] = {{x[0], x[1], x[2], x[3]}};
        turn(y);
        for (int node = 0; node < 4; ++node)
            store(({REAL}*)nodes + node * lanes + first, y[node]);
    }};
    auto read_eight = [=](const void* nodes, number* x) {{ read_part(nodes, 8, 0, x); read_part(nodes, 8, 4, x + 4); }};
    auto read_four = [=](const void* nodes, number* x) {{ read_part(nodes, 4, 0, x); }};
    auto read_mass_and_force = [=](const void* nodes, number* x) {{ read_part(nodes, 8, 3, x); }};
    auto read_two = [=](const void* nodes, number* x) {{
        number low = load(nodes), high = load((const {REAL}*)nodes + 4);
        x[0] = __builtin_shufflevector(low, high, 0, 2, 4, 6);
        x[1] = __builtin_shufflevector(low, high, 1, 3, 5, 7);
    }};
    auto write_eight = [=](void* nodes, const number* x) {{
        write_part(nodes, 8, 0, x);
        write_part(nodes, 8, 4, x + 4);
    }};
    auto write_four = [=](void* nodes, const number* x) {{ write_part(nodes, 4, 0, x); }};
    auto write_two = [=](void* nodes, const number* x) {{
        store(nodes, __builtin_shufflevector(x[0], x[1], 0, 4, 1, 5));
        store(({REAL}*)nodes + 4, __builtin_shufflevector(x[0], x[1], 2, 6, 3, 7));
    }};
    auto smaller = [](number x, number y) {{ return x < y ? x : y; }};
    auto choose = [](auto condition, number x, number y) {{  // without a branch
        auto bits = condition, others = condition;
        memcpy(&bits, &x, sizeof(x));
        memcpy(&others, &y, sizeof(y));
        bits = (bits & condition) | (others & ~condition);
        memcpy(&x, &bits, sizeof(x));
        return x;
    }};
    auto root = [](number x) {{ return __builtin_elementwise_sqrt(x); }};
    auto any = [](auto condition) {{ return __builtin_reduce_or(condition) != 0; }};
    auto highest = [](number x) {{ return __builtin_reduce_max(x); }};
"""


def _read(lanes: int) -> str:
    return f"""[](const void* node, number* x) {{
{wide_access(lanes)}
        const auto y = read(node);
        for (int lane = 0; lane < {lanes}; ++lane)
            x[lane] = y[lane];
    }};"""


def _write(lanes: int) -> str:
    return f"""[](void* node, const number* x) {{
        wp::vec_t<{lanes}, {REAL}> y;
        for (int lane = 0; lane < {lanes}; ++lane)
            y[lane] = x[lane];
        *(wp::vec_t<{lanes}, {REAL}>*)node = y;
    }};"""


_NODE = f"""
    typedef {REAL} number;
    auto read_eight = {_read(8)}
    auto read_four = {_read(4)}
    auto read_two = {_read(2)}
    auto read_mass_and_force = [=](const void* node, number* x) {{
        number y[8];
        read_eight(node, y);
        for (int lane = 0; lane < 4; ++lane)
            x[lane] = y[3 + lane];
    }};
    auto write_eight = {_write(8)}
    auto write_four = {_write(4)}
    auto write_two = {_write(2)}
    auto smaller = [](number x, number y) {{ return x < y ? x : y; }};
    auto choose = [](bool condition, number x, number y) {{ return condition ? x : y; }};
    auto root = [](number x) {{ return wp::sqrt(x); }};
    auto any = [](bool condition) {{ return condition; }};
    auto highest = [](number x) {{ return x; }};
"""


def of_rows(body: str, plain: bool) -> str:
    """C++ for either kind."""
    if plain:
        return _NODE + body
    return f"""
#if defined(__clang__) && !defined(__CUDACC__)
{_ROW + body}
#else
{_NODE + body}
#endif
"""


@wp.func_native("""
#if defined(__clang__) && !defined(__CUDACC__)
    return 4;
#else
    return 1;
#endif
""")
def nodes_at_a_time() -> int:
    """Nodes of a row."""
    ...
