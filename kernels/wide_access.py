"""How a GPU reads the numbers of a node, and adds to them: 16 bytes with one instruction, instead of number by number.

It must be told that they are aligned as much, as nodes are; Warp's vectors are not. Adding as many at once (`red`, see
the manual of PTX) needs single precision and compute capability 9.0. Elsewhere, and on a CPU, this is what Warp does.
"""

from collections.abc import Callable

from warp_mpm.kernels.precision import BYTES, REAL

WIDEST = 16  # bytes
ADDS_WIDELY = int(REAL == "float")


def wide_access(lanes: int) -> str:
    """C++ lambdas `read(at)` and `add_to(at, x)`, which is atomic, for 2, 4 or 8 numbers at an address."""
    vector = f"wp::vec_t<{lanes}, {REAL}>"
    size = min(lanes, WIDEST // BYTES)  # numbers at a time
    return f"""
    auto read = [](const void* at) {{
#if defined(__CUDA_ARCH__)
        {vector} x;
{_per_piece(lanes, size, _read)}
        return x;
#else
        return *(const {vector}*)at;
#endif
    }};
    auto add_to = [](void* at, const {vector}& x) {{
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ >= 900 && {ADDS_WIDELY}
{_per_piece(lanes, size, _add)}
#else
        wp::atomic_add(({vector}*)at, x);
#endif
    }};
"""


def _per_piece(lanes: int, size: int, body: Callable[[int, int], str]) -> str:
    return "\n".join(body(first, size) for first in range(0, lanes, size))


def _read(first: int, size: int) -> str:
    parts = "".join(f" x[{first + n}] = y.{part};" for n, part in enumerate("xyzw"[:size]))
    return f"        {{ const {REAL}{size} y = *(const {REAL}{size}*)(({REAL}*)at + {first});{parts} }}"


def _add(first: int, size: int) -> str:
    places = ", ".join(f"%{n + 1}" for n in range(size))
    values = ", ".join(f'"f"(x[{first + n}])' for n in range(size))
    return f"""        asm volatile("red.relaxed.gpu.global.add.v{size}.f32 [%0], {{{places}}};"
                     ::"l"(__cvta_generic_to_global(({REAL}*)at + {first})), {values} : "memory");"""
