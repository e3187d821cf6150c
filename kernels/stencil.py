"""A particle's stencil, and the four ways to cross it: gather and scatter, each without and with gradients.

    gather             sum w_i x_i
    gather_gradient    sum w_i x_i and sum x_i dw_i/dx, dw_i/dy, dw_i/dz
    scatter            x_i += w_i a
    scatter_gradient   x_i += w_i a + dw_i/dx b + dw_i/dy c + dw_i/dz d

Gather and scatter are each other's transpose. Values have several lanes, which a CPU takes together in its vector
units: Warp's own vectors compile to scalar code there. So the loops are written once, in C++, over chunks of a row
(`rows.py`), which are vectors of the compiler's on a CPU and nodes on a GPU. On a CPU threads work on slabs that share
no node. `plain` asks for nodes on a CPU too: that is how tests run the code of the GPU.

How many numbers a chunk has was measured (docs/numerics.md): two nodes' where values are gathered, one node's where
gradients are, which need more registers; a whole row's where values are scattered, one node's where gradients are: the
next particle's row may begin a node later, and then waits for what this one wrote.
"""

import functools
from collections.abc import Callable

import warp as wp

from warp_mpm.kernels.precision import REAL, scalar
from warp_mpm.kernels.rows import Nodes, Row, Vectors, warp_type


def value_type_of(lanes: int) -> type:
    """A vector of as many lanes: 2, 4 or 8."""
    return wp.types.vector(lanes, scalar)


WIDEST = 16  # numbers in a chunk
AT = "auto* at = nodes.data + (size_t)(stencil.first + i * stencil.stride_x + j * stencil.stride_y);"


def _compiled(body: Callable[[Row], str], lanes: int, width: int, widest: int, plain: bool) -> str:
    """C++ for either kind of row."""
    nodes = body(Nodes(lanes, width))
    if plain:
        return nodes
    return f"""
#if defined(__clang__) && !defined(__CUDACC__)
{body(Vectors(lanes, width, widest))}
#else
{nodes}
#endif
"""


def _gather(row: Row) -> str:
    return f"""{row.declarations()}
{row.each("    T@ total@ = {};")}
{row.unrolled}
    for (int i = 0; i < {row.width}; ++i) {{
{row.each("        T@ plane@ = {};")}
        for (int j = 0; j < {row.width}; ++j) {{
            {AT}
{row.each("            plane@ = plus(plane@, load@(at), stencil.wy[j]);")}
        }}
{row.each("        total@ = plus(total@, plane@, stencil.wx[i]);")}
    }}
{row.weights("wz", "stencil.wz")}
    lanes sum = {row.total("total", "wz")};
    {warp_type(row.lanes)} result;
    memcpy(&result, &sum, sizeof(result));
    return result;
"""


def _gather_gradient(row: Row) -> str:
    return f"""{row.declarations()}
{row.each("    T@ total@ = {}, by_x@ = {}, by_y@ = {};")}
{row.unrolled}
    for (int i = 0; i < {row.width}; ++i) {{
{row.each("        T@ plane@ = {}, plane_y@ = {};")}
        for (int j = 0; j < {row.width}; ++j) {{
            {AT}
{row.each("            T@ x@ = load@(at);")}
{row.each("            plane@ = plus(plane@, x@, stencil.wy[j]);")}
{row.each("            plane_y@ = plus(plane_y@, x@, stencil.sy[j]);")}
        }}
{row.each("        total@ = plus(total@, plane@, stencil.wx[i]);")}
{row.each("        by_x@ = plus(by_x@, plane@, stencil.sx[i]);")}
{row.each("        by_y@ = plus(by_y@, plane_y@, stencil.wx[i]);")}
    }}
{row.weights("wz", "stencil.wz")}
{row.weights("sz", "stencil.sz")}
    lanes sums[4] = {{
        {row.total("total", "wz")},
        {row.total("by_x", "wz")},
        {row.total("by_y", "wz")},
        {row.total("total", "sz")}
    }};
    wp::mat_t<4, {row.lanes}, {REAL}> result;
    memcpy(&result, sums, sizeof(result));
    return result;
"""


def _scatter(row: Row) -> str:
    return f"""{row.declarations()}
    lanes given = as_lanes(value);
{row.weights("wz", "stencil.wz")}
{row.each("    T@ along@ = mul(repeat@(given), wz@);")}
{row.unrolled}
    for (int i = 0; i < {row.width}; ++i)
        for (int j = 0; j < {row.width}; ++j) {{
            {AT}
            {REAL} wij = stencil.wx[i] * stencil.wy[j];
{row.each("            end@(at, plus(begin@(at), along@, wij));")}
        }}
"""


def _scatter_gradient(row: Row) -> str:
    return f"""{row.declarations()}
    lanes given = as_lanes(value), given_x = as_lanes(x);
    lanes given_y = as_lanes(y), given_z = as_lanes(z);
{row.weights("wz", "stencil.wz")}
{row.weights("sz", "stencil.sz")}
{row.each("    T@ along@ = plus(mul(repeat@(given), wz@), repeat@(given_z), sz@);")}
{row.each("    T@ along_x@ = mul(repeat@(given_x), wz@);")}
{row.each("    T@ along_y@ = mul(repeat@(given_y), wz@);")}
{row.unrolled}
    for (int i = 0; i < {row.width}; ++i) {{
{row.each("        T@ plane@ = plus(mul(along@, stencil.wx[i]), along_x@, stencil.sx[i]);")}
{row.each("        T@ plane_y@ = mul(along_y@, stencil.wx[i]);")}
        for (int j = 0; j < {row.width}; ++j) {{
            {AT}
{row.each("            T@ x@ = plus(mul(plane@, stencil.wy[j]), plane_y@, stencil.sy[j]);  // small: rounded little")}
{row.each("            end@(at, begin@(at) + x@);")}
        }}
    }}
"""


def _prefetch_row(width: int) -> str:
    return f"""
            const char* row = (const char*)at;
            __builtin_prefetch(row, 1);
            const size_t size = {width} * sizeof(nodes.data[0]);
            for (size_t byte = 64; byte + 32 < size; byte += 64)  // nodes of longer rows begin at multiples of 32
                __builtin_prefetch(row + byte, 1);
            __builtin_prefetch(row + size - 1, 1);
"""


def _on_a_cpu(body: str) -> str:
    return f"""
#if defined(__clang__) && !defined(__CUDACC__)
{body}
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

    @wp.func_native(_compiled(_gather, lanes, width, 2 * lanes, plain))
    def gather(stencil: record, nodes: wp.array(dtype=value_type)) -> value_type: ...

    return gather


@functools.cache
def gather_gradient_function(width: int, lanes: int, plain: bool = False) -> wp.Function:
    """Device function (stencil, nodes) -> rows sum w x, sum x dw/dx, sum x dw/dy, sum x dw/dz."""
    record = stencil_type(width)
    value_type = value_type_of(lanes)
    rows_type = wp.types.matrix((4, lanes), scalar)

    @wp.func_native(_compiled(_gather_gradient, lanes, width, lanes, plain))
    def gather_gradient(stencil: record, nodes: wp.array(dtype=value_type)) -> rows_type: ...

    return gather_gradient


@functools.cache
def scatter_function(width: int, lanes: int, plain: bool = False) -> wp.Function:
    """Device function (stencil, nodes, value): x += w value."""
    record = stencil_type(width)
    value_type = value_type_of(lanes)

    @wp.func_native(_compiled(_scatter, lanes, width, WIDEST, plain))
    def scatter(stencil: record, nodes: wp.array(dtype=value_type), value: value_type): ...

    return scatter


@functools.cache
def scatter_gradient_function(width: int, lanes: int, plain: bool = False) -> wp.Function:
    """Device function (stencil, nodes, value, x, y, z): nodes += w value + dw/dx x + dw/dy y + dw/dz z."""
    record = stencil_type(width)
    value_type = value_type_of(lanes)

    @wp.func_native(_compiled(_scatter_gradient, lanes, width, lanes, plain))
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
def prefetch_function(width: int, lanes: int, spare: int = 0) -> wp.Function:
    """Device function (nodes, first, stride_x, stride_y): ask for the rows of a stencil, by its lowest node.

    `spare`: nodes past its end that may come with the last chunk of a row where it is scattered to (see `rows.py`).
    """
    value_type = value_type_of(lanes)
    body = f"""
    for (int i = 0; i < {width}; ++i)
        for (int j = 0; j < {width}; ++j) {{
            auto* at = nodes.data + (size_t)(first + i * stride_x + j * stride_y);
{_prefetch_row(width + spare)}
        }}
"""

    @wp.func_native(_on_a_cpu(body))
    def prefetch(nodes: wp.array(dtype=value_type), first: int, stride_x: int, stride_y: int): ...

    return prefetch


@functools.cache
def prefetch_row_function(width: int, lanes: int) -> wp.Function:
    """Device function (nodes, first): ask for one row, by its first node."""
    value_type = value_type_of(lanes)
    body = f"            auto* at = nodes.data + (size_t)first;{_prefetch_row(width)}"

    @wp.func_native(_on_a_cpu(body))
    def prefetch_row(nodes: wp.array(dtype=value_type), first: int): ...

    return prefetch_row
