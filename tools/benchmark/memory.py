"""Memory of a run, per particle: its arrays, and what the process really took at its peak.

Measured in a process of its own, because a process hardly gives memory back, and after a tiny run, so that the kernels'
code does not count as the particles'.
"""

import multiprocessing
import re
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import warp as wp

from benchmark.runs import early
from warp_mpm.launch import Launcher, find_device

STATUS = Path("/proc/self/status")  # Linux alone tells a process's peak, and can forget an earlier one
FORGET_PEAK = Path("/proc/self/clear_refs"), "5"
WARM_UP_CELLS = 6


def measure_memory(cells: int, device: str | None, threads: int | None) -> dict[str, float | None]:
    """Bytes per particle of a closed cube: see `memory_record`; in a new process."""
    fresh = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, mp_context=fresh) as process:
        return process.submit(memory_record, cells, device, threads).result()


def memory_record(cells: int, device: str | None, threads: int | None) -> dict[str, float | None]:
    """Bytes per particle: of the particles' arrays, of the grid's, of all others, and the growth of the process.

    The growth is that of the resident set on a CPU, of the memory pool on a GPU, from before the scene is built to its
    highest in the first steps; None where the system does not tell.
    """
    launcher = Launcher(find_device(device), threads)
    early(WARM_UP_CELLS, launcher)
    before = forget_peak(launcher.device)
    solver = early(cells, launcher)
    peak = highest(launcher.device)
    launcher.close()
    state, count = solver.state, solver.state.count
    growth = None if peak is None or before is None else (peak - before) / count
    return {
        "particles": count,
        "particle_arrays_bytes_per_particle": array_bytes(state.particles) / count,
        "grid_arrays_bytes_per_particle": array_bytes(state.grid) / count,
        "other_arrays_bytes_per_particle": array_bytes(state) / count,
        "peak_growth_bytes_per_particle": growth,
    }


def array_bytes(holder: Any) -> int:
    """Bytes of all Warp arrays that are attributes of something."""
    values = [getattr(holder, name, None) for name in dir(holder) if not name.startswith("__")]
    arrays = {value.ptr: value.capacity for value in values if isinstance(value, wp.array) and value.ptr}
    return sum(arrays.values())


def forget_peak(device: wp.Device) -> int | None:
    """Bytes in use now, from which on the peak counts."""
    if device.is_cuda:
        return wp.get_mempool_used_mem_current(device) if device.is_mempool_supported else None
    path, word = FORGET_PEAK
    try:
        path.write_text(word)
    except OSError:
        return None
    return _status_bytes("VmRSS")


def highest(device: wp.Device) -> int | None:
    """Most bytes in use so far."""
    if device.is_cuda:
        return wp.get_mempool_used_mem_high(device) if device.is_mempool_supported else None
    return _status_bytes("VmHWM")


def _status_bytes(name: str) -> int | None:
    try:
        found = re.search(rf"^{name}:\s*(\d+) kB", STATUS.read_text(), re.MULTILINE)
    except OSError:
        return None
    return int(found.group(1)) * 1024 if found else None
