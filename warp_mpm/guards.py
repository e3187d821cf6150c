"""Guards: what is checked before a run starts, and after every step."""

import math
import os
from pathlib import Path

import numpy as np

from warp_mpm.checks import mistake
from warp_mpm.conservation import Audit
from warp_mpm.errors import InputError, SimulationError
from warp_mpm.kernels.material import HUGE
from warp_mpm.model import Model
from warp_mpm.run_directory import scene_in
from warp_mpm.state import State, memory_needed

MOST_NODES = 2**31 - 1
MEMORY_SHARE = 0.9  # of the free memory that a run may take
NOTABLE_CLAMP = 1e-3  # of all energy, from which on its clamping is worth a warning
SHORTEST_STEP = 1e-5  # of the first time step; shorter ones do not come to an end
ANOTHER = "choose another one with -o (output=...)"  # what a directory is given with: in Python by name


def directory_for(scene: str, path: Path) -> Path:
    """Make the run directory of a scene; one that holds a run of another scene is left alone, lest their files mix.

    Raises:
        InputError: it holds such a run, or cannot be made or written.
    """
    there = scene_in(path)
    if there is not None and there != scene:
        got = f"{str(path)!r}, which holds a run of {there!r}"
        remedy = f"{ANOTHER}, or remove it"
        raise mistake("output", f"a directory without a run of another scene than {scene!r}", got, remedy)
    return writable_directory(path)


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
    except (OSError, ValueError) as error:  # the latter for a name that no file can have
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(
            f"output: expected a directory that can be written, got {str(path)!r} ({reason}); {ANOTHER}"
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


def check_state(state: State, steps: int) -> None:
    """Stop when a particle has become absurd, or the time step so short that the run would not end.

    Raises:
        SimulationError: with the step, the time, the particle, its material and its position.
    """
    worst = int(state.faults.numpy().max())
    if worst > 0:
        expected, got = _fault(state, worst - 1)
        raise _stop(state, steps, worst - 1, expected, got, "try a smaller cfl, or the default solver settings")
    clock = state.clock_values()
    shortest = SHORTEST_STEP * float(clock["first_dt"])
    if clock["time"] < clock["end_time"] and not clock["dt"] > shortest:
        speeds = state.field("sound_speed") + np.linalg.norm(state.field("velocity"), axis=1)
        fastest = int(np.argmax(speeds))
        expected = f"time steps of more than {shortest:.3g} s, {SHORTEST_STEP:g} of the first"
        got = f"{clock['dt']:.3g} s; this particle is the fastest, {speeds[fastest]:.6g} m/s with its sound speed"
        raise _stop(state, steps, fastest, expected, got, "try more viscosity, or a larger cell_size")


def clamp_warnings(audit: Audit) -> list[str]:
    """What to warn of when much energy was added to particles that would have had less than none."""
    share = audit.clamped_share
    if share <= NOTABLE_CLAMP:
        return []
    return [f"energy: {share:.2%} of it was added to particles that would have had less than none; try a smaller cfl"]


def _fault(state: State, index: int) -> tuple[str, str]:
    """What was expected of a particle, and what it has become."""
    values = {name: float(state.field(name)[index]) for name in ("density", "energy", "pressure")}
    if not 0.0 < values["density"] < math.inf:
        return "a positive density", f"{values['density']:.6g} kg/m3"
    for name, unit in (("energy", "J/kg"), ("pressure", "Pa")):
        if not abs(values[name]) < float(HUGE):
            return f"a finite {name}", f"{values[name]:.6g} {unit}"
    velocity = state.field("velocity")[index]
    if not np.isfinite(velocity).all():
        return "a finite velocity", f"({', '.join(f'{v:.6g}' for v in velocity)}) m/s"
    return "it to stay within reach of its cell", "a longer way in one step"


def _stop(state: State, steps: int, index: int, expected: str, got: str, remedy: str) -> SimulationError:
    """The error about a particle, given by its creation order."""
    scene = state.model.scene
    time = float(state.clock_values()["time"])
    edges = np.cumsum([len(charge.positions) for charge in scene.charges])
    charge = scene.charges[int(np.searchsorted(edges, index, side="right"))]
    place = ", ".join(f"{x:.6g}" for x in state.positions()[index])
    return SimulationError(
        f"{scene.name}: step {steps} at {time * 1e6:.3f} us: particle {index} of charge {charge.name!r} "
        f"({charge.material.name}) at ({place}) m: expected {expected}, got {got}; {remedy}"
    )
