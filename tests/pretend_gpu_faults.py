"""What the pretend GPU must notice; `test_pretend_gpu.py` runs these in a process that has one."""

import functools
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import warp as wp

GPU = "cuda:0"
COUNT = 1000


@wp.kernel(enable_backward=False)
def sum_plainly(values: wp.array(dtype=float), total: wp.array(dtype=float)):
    total[0] = total[0] + values[wp.tid()]


@wp.kernel(enable_backward=False)
def sum_atomically(values: wp.array(dtype=float), total: wp.array(dtype=float)):
    wp.atomic_add(total, 0, values[wp.tid()])


@wp.kernel(enable_backward=False)
def shift(values: wp.array(dtype=float), total: wp.array(dtype=float)):
    i = wp.tid()
    if i > 0:
        values[i - 1] = values[i]


@wp.kernel(enable_backward=False)
def read_a_sum_too_soon(values: wp.array(dtype=float), total: wp.array(dtype=float)):
    wp.atomic_add(total, 0, 1.0)
    values[wp.tid()] = total[0]


@wp.kernel(enable_backward=False)
def write_the_same(values: wp.array(dtype=float), total: wp.array(dtype=float)):
    total[0] = 3.0


@wp.kernel(enable_backward=False)
def raise_if_higher(values: wp.array(dtype=float), total: wp.array(dtype=float)):
    value = values[wp.tid()]
    if value > total[0]:
        wp.atomic_max(total, 0, value)


@wp.kernel(enable_backward=False)
def read_past_the_end(values: wp.array(dtype=float), total: wp.array(dtype=float)):
    wp.atomic_add(total, 0, values[wp.tid() + 1])


@functools.cache
def write_differently(dtype):
    """Kernel whose threads write other values of a type to one place."""

    @wp.kernel(enable_backward=False, module="unique")
    def write_last(values: wp.array(dtype=dtype), total: wp.array(dtype=dtype)):
        total[0] = values[wp.tid()]

    return write_last


@functools.cache
def add_plainly(dtype):
    """Kernel whose threads add values of a type to one place, but not atomically."""

    @wp.kernel(enable_backward=False, module="unique")
    def add_last(values: wp.array(dtype=dtype), total: wp.array(dtype=dtype)):
        total[0] = total[0] + values[wp.tid()]

    return add_last


@functools.cache
def double_the_next(dtype):
    """Kernel whose threads read values of a type, the last one past the end."""

    @wp.kernel(enable_backward=False, module="unique")
    def double_next(values: wp.array(dtype=dtype), total: wp.array(dtype=dtype)):
        total[wp.tid()] = values[wp.tid() + 1] * 2.0

    return double_next


@wp.kernel(enable_backward=False)
def add_and_read(values: wp.array(dtype=float), total: wp.array(dtype=float)):
    i = wp.tid()
    wp.atomic_add(total, 0, 1.0)
    if i == 1:
        values[0] = total[0]


@wp.func_native("return ((const float4*)(values.data + i))->x;")
def first_of_four(values: wp.array(dtype=float), i: int) -> float: ...


@wp.kernel(enable_backward=False)
def read_four(values: wp.array(dtype=float), total: wp.array(dtype=float)):
    i = wp.tid()
    wp.atomic_add(total, 0, first_of_four(values, wp.min(i, 900)))


def launch(kernel, values=None):
    """Launch a kernel on 1, 2, 3, ... and 0; returns both after it."""
    if values is None:
        values = wp.array(np.arange(1, COUNT + 1, dtype=np.float32), device=GPU)
    total = wp.zeros(1, dtype=float, device=GPU)
    wp.launch(kernel, COUNT, inputs=[values, total], device=GPU)
    return values.numpy(), total.numpy()[0]


@pytest.mark.parametrize(
    ("kernel", "total"),
    [(sum_atomically, COUNT * (COUNT + 1) / 2), (write_the_same, 3.0), (raise_if_higher, COUNT)],
)
def test_what_is_right(kernel, total):
    assert launch(kernel)[1] == total


@pytest.mark.parametrize(
    ("kernel", "fault"),
    [
        (sum_plainly, "writes what thread .* reads|reads what thread .* writes"),
        (shift, "writes what thread .* reads|reads what thread .* writes"),
        (read_a_sum_too_soon, "reads what thread .* adds to|adds to what thread .* reads"),
        (read_four, "not aligned"),
        (read_past_the_end, "reads memory that is in no array"),
    ],
)
def test_what_is_wrong(kernel, fault):
    with pytest.raises(RuntimeError, match=rf"pretend GPU: {kernel.key}.*: thread \d+ .*({fault})"):
        launch(kernel)


@pytest.mark.parametrize("dtype", [float, wp.vec2, wp.vec3, wp.vec4, wp.types.vector(8, wp.float32)])
@pytest.mark.parametrize(
    ("make", "fault", "room"),
    [(write_differently, "writes", 1), (add_plainly, "writes|reads", 1), (double_the_next, "is in no array", COUNT)],
)
def test_numbers_of_any_length_are_watched(make, fault, room, dtype):
    count = COUNT - 1  # so that there is no page's end behind the last one, but what lies before it
    numbers = np.random.default_rng(1).random((count, wp.types.type_size(dtype))).astype(np.float32)
    values = wp.array(numbers.squeeze(), dtype=dtype, device=GPU)
    with pytest.raises(RuntimeError, match=rf"pretend GPU: .*thread \d+ .*({fault})"):
        wp.launch(make(dtype), count, inputs=[values, wp.zeros(room, dtype=dtype, device=GPU)], device=GPU)


@pytest.mark.parametrize("launches", range(10))
def test_who_added_last_may_not_read_what_others_add(launches):
    """In whatever order they come."""
    with pytest.raises(RuntimeError, match=r"adds to"):
        wp.launch(add_and_read, 2, inputs=[wp.zeros(1, dtype=float, device=GPU) for _ in range(2)], device=GPU)


def test_memory_of_the_host():
    values = np.ones(1 << 20, dtype=np.float32)
    foreign = wp.array(ptr=values.ctypes.data, dtype=float, shape=values.shape, device=GPU)
    with pytest.raises(RuntimeError, match="reads memory that is in no array"):
        launch(sum_atomically, foreign)


def test_what_nobody_wrote_is_not_a_number():
    assert np.isnan(launch(sum_atomically, wp.empty(COUNT, dtype=float, device=GPU))[1])


def test_a_graph_copies_nothing_to_the_host():
    values = wp.zeros(COUNT, dtype=float, device=GPU)
    expected = pytest.raises(RuntimeError, match="pretend GPU: a copy from or to the host while a graph is captured")
    with expected, wp.ScopedCapture(device=GPU):
        values.numpy()


def test_a_graph_does_nothing_until_it_is_launched():
    values = wp.full(COUNT, 1.0, dtype=float, device=GPU)
    total = wp.zeros(1, dtype=float, device=GPU)
    with wp.ScopedCapture(device=GPU) as capture:
        wp.launch(sum_atomically, COUNT, inputs=[values, total], device=GPU)
    assert total.numpy()[0] == 0.0
    for times in (1, 2):
        wp.capture_launch(capture.graph)
        assert total.numpy()[0] == times * COUNT


READ = "ctypes.string_at(at, 4)"
LAUNCH = f"wp.copy(wp.array(ptr=at, dtype=float, shape=9, device='{GPU}'), wp.zeros(9, dtype=float, device='{GPU}'))"


@pytest.mark.parametrize(
    ("then", "crashes"), [("pass", False), (READ, True), (LAUNCH, False), (f"del values; {LAUNCH}", True)]
)
def test_neither_the_host_nor_a_late_user_can_touch_memory(then, crashes):
    """Which ends the process."""
    begin = f"import ctypes, conftest, warp as wp; values = wp.zeros(9, dtype=float, device='{GPU}'); at = values.ptr"
    done = subprocess.run([sys.executable, "-c", f"{begin}; {then}"], check=False, cwd=Path(__file__).parent)
    assert done.returncode == (-signal.SIGSEGV if crashes else 0)
