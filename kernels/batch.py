"""Records of many particles side by side, number by number: loops over them then use a CPU's vector units.

A record's numbers lie together in memory, those of the next particle after it. A loop that computes with them can be
compiled for 8 or 16 particles at a time if instead the first numbers of all particles lie together, then the second
ones, and so on. In a kernel a batch is an array of its own, on the stack: `wp.zeros(shape=N, dtype=scalar)` with N
`BATCH` times `numbers_in(record)`.

For the compiler to do it, such a loop must

- be a `while` loop that counts up by one: what Warp makes of `for` is not recognised,
- read and write batches alone: of other memory it could not know that it is not the same,
- call only functions that are compiled into it, and not the mathematical library, but for square roots,
- keep no vector from a branch: what a branch changes is a number (a vector may be half in a register of two).

Its results are the same bits as one by one. `tests/test_batch.py` asks the compiler whether it did it.
"""

import functools

import warp as wp

from warp_mpm.kernels.precision import BYTES, REAL, scalar

BATCH = 64  # particles

_PUT = f"""
    constexpr size_t numbers = sizeof(value) / sizeof({REAL});
    {REAL} row[numbers];
    memcpy(row, &value, sizeof(value));
    #pragma unroll
    for (size_t n = 0; n < numbers; ++n)
        batch.data[n * {BATCH} + i] = row[n];
"""


def numbers_in(record: type) -> int:
    """Numbers in a record, all of whose fields are scalars or vectors of them."""
    return wp.types.type_size_in_bytes(record) // BYTES


@functools.cache
def put_function(record: type) -> wp.Function:
    """Device function (batch, i, value): set the record of particle i of a batch."""

    @wp.func_native(_PUT)
    def put(batch: wp.array(dtype=scalar), i: int, value: record): ...

    return put


@functools.cache
def get_function(record: type) -> wp.Function:
    """Device function (batch, i) -> the numbers of particle i's record, in the order of its fields."""
    numbers = numbers_in(record)
    row_type = wp.types.vector(numbers, scalar)
    snippet = f"""
    wp::vec_t<{numbers}, {REAL}> row;
    #pragma unroll
    for (size_t n = 0; n < {numbers}; ++n)
        row.c[n] = batch.data[n * {BATCH} + i];
    return row;
"""

    @wp.func_native(snippet)
    def get(batch: wp.array(dtype=scalar), i: int) -> row_type: ...

    return get
