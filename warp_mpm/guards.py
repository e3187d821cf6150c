"""Guards: what is checked before a run starts, and after every step."""

import math
import os
from pathlib import Path

import numpy as np

from warp_mpm.errors import InputError, SimulationError
from warp_mpm.model import Model
from warp_mpm.state import State, memory_needed

MOST_NODES = 2**31 - 1
MEMORY_SHARE = 0.9  # of the free memory that a run may take


def writable_directory(path: Path) -> Path:
    """Make the run directory, and try to write there before anything is computed.

    Raises:
        InputError: it cannot be made or written.
    """
    probe = path / ".warp_mpm_probe"
    try:
        path.mkdir(parents=True, exist_ok=True)
        probe.write_bytes(b"")
        probe.unlink()
    except OSError as error:
        raise InputError(
            f"output: expected a directory that can be written, got {str(path)!r} ({error.strerror}); "
            "choose another one with -o"
        ) from error
    return path


def check_memory(model: Model) -> None:
    """Refuse a run that does not fit into the free memory.

    Raises:
        InputError: with the numbers.
    """
    nodes = math.prod(n + 3 for n in model.scene.domain.cells)
    if nodes > MOST_NODES:
        raise InputError(
            f"{model.scene.name}: expected at most {MOST_NODES:,} nodes, which 32-bit indices reach, got {nodes:,}; "
            "use a larger cell_size or a smaller margin"
        )
    needed = memory_needed(model)
    free = model.device.free_memory if model.device.is_cuda else _free_host_memory()
    if free is not None and needed > MEMORY_SHARE * free:
        raise InputError(
            f"{model.scene.name}: expected a run that fits into the {free / 2**30:.1f} GiB of free memory, got "
            f"{model.scene.particle_count:,} particles and {math.prod(model.scene.domain.cells):,} cells, which take "
            f"{needed / 2**30:.1f} GiB; use a larger cell_size, a smaller domain or fewer particles_per_axis"
        )


def _free_host_memory() -> int | None:
    """Bytes that this machine can still give; None where the system does not tell."""
    try:
        for line in Path("/proc/meminfo").read_text().splitlines():
            if line.startswith("MemAvailable:"):
                return int(line.split()[1]) * 1024
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return None


def check_faults(state: State, steps: int) -> None:
    """Stop when a particle moved absurdly far, became NaN, or left the active cells.

    Raises:
        SimulationError: with the step, the time, the particle, its material and its position.
    """
    worst = int(state.faults.numpy().max())
    if worst == 0:
        return
    index = worst - 1
    scene = state.model.scene
    time = float(state.clock_values()["time"])
    edges = np.cumsum([len(charge.positions) for charge in scene.charges])
    charge = scene.charges[int(np.searchsorted(edges, index, side="right"))]
    place = ", ".join(f"{x:.6g}" for x in state.positions()[index])
    raise SimulationError(
        f"{scene.name}: step {steps} at {time * 1e6:.3f} us: particle {index} of charge {charge.name!r} "
        f"({charge.material.name}) at ({place}) m: expected it to stay within reach of its cell, but it moved farther "
        "in one step; try a smaller cfl, or the default solver settings"
    )
