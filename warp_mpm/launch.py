"""Launches: one after the other on a GPU, over a pool of threads on a CPU.

Warp runs a CPU launch on one thread, but releases the interpreter lock meanwhile. Work is therefore cut into tasks
that touch disjoint memory, and the cut depends on the domain alone, never on the number of threads: the answer is
bitwise the same for any number of them. A recorded launch costs 3 microseconds, a trip to the pool ten times that, so
small problems stay on the calling thread. On a GPU a whole step is one graph.
"""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import warp as wp

from warp_mpm import checks
from warp_mpm.errors import InputError
from warp_mpm.warp_startup import start_quietly

Task = Sequence[Any]  # recorded launches, run in order

SMALLEST_SHARED_WORK = 20_000  # particles or nodes; below, one thread is faster than two


class Launcher:
    """Runs tasks of recorded launches on a device.

    With `graphs`, the default on a GPU, a step goes out as one graph; on a CPU that runs on one thread, for tests.

    Raises:
        InputError: fewer than one thread.
    """

    def __init__(self, device: wp.Device, threads: int | None = None, graphs: bool | None = None) -> None:
        available = available_cores()
        if threads is not None:
            checks.count("threads", threads)
        self.device = device
        self.graphs = device.is_cuda if graphs is None else graphs
        self.threads = 1 if self.graphs or kernels_are_checked() else (threads or available)
        self._pool = ThreadPoolExecutor(self.threads) if self.threads > 1 else None

    def record(self, kernel: wp.Kernel, count: int, inputs: Sequence[Any]) -> Any:
        """A launch of `count` threads, recorded to be repeated."""
        return wp.launch(kernel, dim=count, inputs=list(inputs), device=self.device, record_cmd=True)

    def run(self, tasks: Sequence[Task], work: int) -> None:
        """Run tasks that touch disjoint memory; `work` is how many particles or nodes they have in all."""
        if self._pool is None or work < SMALLEST_SHARED_WORK or len(tasks) < 2:
            for task in tasks:
                _run_task(task)
            return
        for finished in [self._pool.submit(_run_task, task) for task in tasks]:
            finished.result()

    def capture(self, run: Callable[[], None]) -> wp.Graph:
        """What `run` launches, as a graph; nothing is executed yet."""
        with wp.ScopedCapture(device=self.device) as capture:
            run()
        return capture.graph

    def close(self) -> None:
        """End the threads."""
        if self._pool is not None:
            self._pool.shutdown()


def available_cores() -> int:
    """Cores that this process may run on."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def kernels_are_checked() -> bool:
    """Whether Warp compiles kernels for debugging; two that run at a time then crash.

    Each kernel puts a pointer to its own stack into one variable of its module (`shared_tile_storage` in Warp's
    `tile.h`), and puts back what was there when it ends. Only the checks at its end read it.
    """
    return wp.config.mode == "debug"


def find_device(name: str | None) -> wp.Device:
    """The device of a name, or the best one there is.

    Raises:
        InputError: there is no such device.
    """
    start_quietly()
    if name is None:
        return wp.get_preferred_device()
    known = [device.alias for device in wp.get_devices()]
    if name not in known:
        raise InputError(f"device: expected one of {', '.join(known)} on this machine, got {name!r}")
    return wp.get_device(name)


def _run_task(task: Task) -> None:
    for launch in task:
        launch.launch()
