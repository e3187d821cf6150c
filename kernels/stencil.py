"""A particle's stencil, and the four ways to cross it: gather and scatter, each without and with gradients.

    gather             sum w_i x_i
    gather_gradient    sum w_i x_i and sum x_i dw_i/dx, dw_i/dy, dw_i/dz
    scatter            x_i += w_i a
    scatter_gradient   x_i += w_i a + dw_i/dx b + dw_i/dy c + dw_i/dz d

Gather and scatter are each other's transpose. Values have several lanes, which a CPU takes together in its vector
units: Warp's own vectors compile to scalar code there, so the loops are written once, in C++, over a vector type that
is clang's on a CPU and Warp's on a GPU, where `add` is atomic. On a CPU threads work on slabs that share no node.
`plain` asks for Warp's type on a CPU too: that is how tests run the code of the GPU.
"""

import functools

import warp as wp

from warp_mpm.kernels.precision import REAL, scalar


def value_type_of(lanes: int) -> type:
    """A vector of as many lanes; a number for one."""
    return scalar if lanes == 1 else wp.types.vector(lanes, scalar)


def _condition(plain: bool) -> str:
    """When the vector types of the compiler are used: on a CPU, unless told not to."""
    return "0" if plain else "defined(__clang__) && !defined(__CUDACC__)"


def _warp_type(lanes: int) -> str:
    """Warp's own type of as many values, in C++."""
    return REAL if lanes == 1 else f"wp::vec_t<{lanes}, {REAL}>"


def _lanes(count: int, plain: bool) -> str:
    """Type `lanes` of as many values, and how to load and add them at a node."""
    return f"""
#if {_condition(plain)}
    typedef {REAL} lanes __attribute__((ext_vector_type({count})));
    auto load = [](const void* node) {{ lanes x; __builtin_memcpy(&x, node, sizeof(x)); return x; }};
    auto add = [=](void* node, lanes x) {{ x += load(node); __builtin_memcpy(node, &x, sizeof(x)); }};
    auto plus = [](lanes sum, lanes x, {REAL} weight) {{ return __builtin_elementwise_fma(x, (lanes)weight, sum); }};
#else
    typedef {_warp_type(count)} lanes;
    auto load = [](const lanes* node) {{ return *node; }};
    auto add = [](lanes* node, lanes x) {{ wp::atomic_add(node, x); }};
    auto plus = [](lanes sum, lanes x, {REAL} weight) {{ return wp::add(sum, wp::mul(x, weight)); }};
#endif
"""


ROW = 6  # numbers: rows up to this long are added at once


def _scatter_rows(lanes: int, width: int, plain: bool) -> str:
    """Scatter of values so short that a whole row of them is added at once, as four or eight numbers.

    What is beyond a row of three is written back as it was. That reaches one node farther than the stencil, still short
    of what another thread may write to (see `LARGEST_DRIFT`), and arrays have a node to spare.
    """
    numbers = 4 if lanes * width <= 4 else 8
    return f"""
    {REAL} given[{lanes}];
    memcpy(given, &value, sizeof(given));
#if {_condition(plain)}
    typedef {REAL} lanes __attribute__((ext_vector_type({numbers})));
    lanes along = {{}};
    for (int k = 0; k < {width}; ++k)
        for (int lane = 0; lane < {lanes}; ++lane)
            along[k * {lanes} + lane] = stencil.wz[k] * given[lane];
    for (int i = 0; i < {width}; ++i)
        for (int j = 0; j < {width}; ++j) {{
            auto* row = nodes.data + (size_t)(stencil.first + i * stencil.stride_x + j * stencil.stride_y);
            lanes x;
            __builtin_memcpy(&x, row, sizeof(x));
            x = __builtin_elementwise_fma(along, (lanes)(stencil.wx[i] * stencil.wy[j]), x);
            __builtin_memcpy(row, &x, sizeof(x));
        }}
#else
    for (int i = 0; i < {width}; ++i)
        for (int j = 0; j < {width}; ++j)
            for (int k = 0; k < {width}; ++k)
                wp::atomic_add(
                    nodes.data + stencil.first + i * stencil.stride_x + j * stencil.stride_y + k,
                    wp::mul(value, stencil.wx[i] * stencil.wy[j] * stencil.wz[k]));
#endif
"""


def _gather(lanes: int, width: int, plain: bool) -> str:
    return f"""{_lanes(lanes, plain)}
    lanes total = {{}};
    for (int i = 0; i < {width}; ++i) {{
        lanes plane = {{}};
        for (int j = 0; j < {width}; ++j) {{
            auto* row = nodes.data + (size_t)(stencil.first + i * stencil.stride_x + j * stencil.stride_y);
            lanes along = {{}};
            for (int k = 0; k < {width}; ++k)
                along = plus(along, load(row + k), stencil.wz[k]);
            plane = plus(plane, along, stencil.wy[j]);
        }}
        total = plus(total, plane, stencil.wx[i]);
    }}
    {_warp_type(lanes)} result;
    memcpy(&result, &total, sizeof(result));
    return result;
"""


def _gather_gradient(lanes: int, width: int, plain: bool) -> str:
    return f"""{_lanes(lanes, plain)}
    lanes total = {{}}, by_x = {{}}, by_y = {{}}, by_z = {{}};
    for (int i = 0; i < {width}; ++i) {{
        lanes plane = {{}}, plane_y = {{}}, plane_z = {{}};
        for (int j = 0; j < {width}; ++j) {{
            auto* row = nodes.data + (size_t)(stencil.first + i * stencil.stride_x + j * stencil.stride_y);
            lanes along = {{}}, across = {{}};
            for (int k = 0; k < {width}; ++k) {{
                lanes x = load(row + k);
                along = plus(along, x, stencil.wz[k]);
                across = plus(across, x, stencil.sz[k]);
            }}
            plane = plus(plane, along, stencil.wy[j]);
            plane_y = plus(plane_y, along, stencil.sy[j]);
            plane_z = plus(plane_z, across, stencil.wy[j]);
        }}
        total = plus(total, plane, stencil.wx[i]);
        by_x = plus(by_x, plane, stencil.sx[i]);
        by_y = plus(by_y, plane_y, stencil.wx[i]);
        by_z = plus(by_z, plane_z, stencil.wx[i]);
    }}
    wp::mat_t<4, {lanes}, {REAL}> result;
    memcpy(&result.data[0][0], &total, sizeof(lanes));
    memcpy(&result.data[1][0], &by_x, sizeof(lanes));
    memcpy(&result.data[2][0], &by_y, sizeof(lanes));
    memcpy(&result.data[3][0], &by_z, sizeof(lanes));
    return result;
"""


def _scatter(lanes: int, width: int, plain: bool) -> str:
    return f"""{_lanes(lanes, plain)}
    lanes nothing = {{}}, given;
    memcpy(&given, &value, sizeof(lanes));
    for (int i = 0; i < {width}; ++i)
        for (int j = 0; j < {width}; ++j) {{
            auto* row = nodes.data + (size_t)(stencil.first + i * stencil.stride_x + j * stencil.stride_y);
            lanes along = plus(nothing, given, stencil.wx[i] * stencil.wy[j]);
            for (int k = 0; k < {width}; ++k)
                add(row + k, plus(nothing, along, stencil.wz[k]));
        }}
"""


def _scatter_gradient(lanes: int, width: int, plain: bool) -> str:
    return f"""{_lanes(lanes, plain)}
    lanes nothing = {{}}, given, by_x, by_y, by_z;
    memcpy(&given, &value, sizeof(lanes));
    memcpy(&by_x, &x, sizeof(lanes));
    memcpy(&by_y, &y, sizeof(lanes));
    memcpy(&by_z, &z, sizeof(lanes));
    for (int i = 0; i < {width}; ++i)
        for (int j = 0; j < {width}; ++j) {{
            auto* row = nodes.data + (size_t)(stencil.first + i * stencil.stride_x + j * stencil.stride_y);
            {REAL} wij = stencil.wx[i] * stencil.wy[j];
            lanes along = plus(nothing, given, wij);
            along = plus(along, by_x, stencil.sx[i] * stencil.wy[j]);
            along = plus(along, by_y, stencil.wx[i] * stencil.sy[j]);
            lanes across = plus(nothing, by_z, wij);
            for (int k = 0; k < {width}; ++k)
                add(row + k, plus(plus(nothing, along, stencil.wz[k]), across, stencil.sz[k]));
        }}
"""


def _prefetch(width: int) -> str:
    return f"""
#if defined(__clang__) && !defined(__CUDACC__)
    for (int i = 0; i < {width}; ++i)
        for (int j = 0; j < {width}; ++j) {{
            const char* row = (const char*)(nodes.data + (size_t)(first + i * stride_x + j * stride_y));
            __builtin_prefetch(row, 1);
            const size_t size = {width} * sizeof(nodes.data[0]);
            for (size_t byte = 64; byte + 64 < size; byte += 64)  // cache lines between the first and the last
                __builtin_prefetch(row + byte, 1);
            __builtin_prefetch(row + size - 1, 1);
        }}
#endif
"""


@functools.cache
def stencil_type(width: int) -> type:
    """Record of a stencil of `width` nodes per axis."""
    weights = wp.types.vector(width, scalar)

    @wp.struct
    class Stencil:
        first: int  # flat index of its lowest node
        stride_x: int
        stride_y: int
        wx: weights
        wy: weights
        wz: weights
        sx: weights  # slopes [1/m]
        sy: weights
        sz: weights

    return Stencil


@functools.cache
def gather_function(width: int, lanes: int, plain: bool = False) -> wp.Function:
    """Device function (stencil, nodes) -> sum w x."""
    record = stencil_type(width)
    value_type = value_type_of(lanes)

    @wp.func_native(_gather(lanes, width, plain))
    def gather(stencil: record, nodes: wp.array(dtype=value_type)) -> value_type: ...

    return gather


@functools.cache
def gather_gradient_function(width: int, lanes: int, plain: bool = False) -> wp.Function:
    """Device function (stencil, nodes) -> rows sum w x, sum x dw/dx, sum x dw/dy, sum x dw/dz."""
    record = stencil_type(width)
    value_type = value_type_of(lanes)
    rows_type = wp.types.matrix((4, lanes), scalar)

    @wp.func_native(_gather_gradient(lanes, width, plain))
    def gather_gradient(stencil: record, nodes: wp.array(dtype=value_type)) -> rows_type: ...

    return gather_gradient


@functools.cache
def scatter_function(width: int, lanes: int, plain: bool = False) -> wp.Function:
    """Device function (stencil, nodes, value): x += w value."""
    record = stencil_type(width)
    value_type = value_type_of(lanes)

    @wp.func_native(_scatter_rows(lanes, width, plain) if lanes * width <= ROW else _scatter(lanes, width, plain))
    def scatter(stencil: record, nodes: wp.array(dtype=value_type), value: value_type): ...

    return scatter


@functools.cache
def scatter_gradient_function(width: int, lanes: int, plain: bool = False) -> wp.Function:
    """Device function (stencil, nodes, value, x, y, z): nodes += w value + dw/dx x + dw/dy y + dw/dz z."""
    record = stencil_type(width)
    value_type = value_type_of(lanes)

    @wp.func_native(_scatter_gradient(lanes, width, plain))
    def scatter_gradient(
        stencil: record,
        nodes: wp.array(dtype=value_type),
        value: value_type,
        x: value_type,
        y: value_type,
        z: value_type,
    ): ...

    return scatter_gradient


@functools.cache
def prefetch_function(width: int, lanes: int) -> wp.Function:
    """Device function (nodes, first, stride_x, stride_y): ask for the rows of a stencil, by its lowest node."""
    value_type = value_type_of(lanes)

    @wp.func_native(_prefetch(width))
    def prefetch(nodes: wp.array(dtype=value_type), first: int, stride_x: int, stride_y: int): ...

    return prefetch
