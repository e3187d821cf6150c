"""Checkpoints: what a run needs to go on as if it had never stopped; on a CPU bit for bit, with any number of threads.

The grid is saved, not scattered anew: the particles may have been sorted since, and sums in another order differ. Only
nodes of active blocks hold anything.
"""

import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import warp as wp

from warp_mpm.checks import mistake
from warp_mpm.config import Save
from warp_mpm.errors import InputError
from warp_mpm.kernels.blocks import EDGE
from warp_mpm.output.checkpoint import checkpoint_files, read_checkpoint, remove_checkpoints, write_checkpoint
from warp_mpm.solver import Solver
from warp_mpm.state import NO_STEP, PARTICLE_ARRAYS, State

Arrays = Mapping[str, np.ndarray]

ACCOUNTS = ("clock", "maxima", "tallies", "reactions", "pending_impulses", "impulses", "peaks")  # of a State
NODAL_ARRAYS = ("sums", "field", "content", "start")  # of a Grid; between two steps the others hold nothing of use
BLOCKS, SORTING, RANGES = "grid.blocks", "sorting", "ranges"
MINUTE = 60.0  # [s]


class Checkpoints:
    """The checkpoints of a run under way."""

    def __init__(self, directory: Path | None, identity: Mapping[str, str], save: Save) -> None:
        """Checkpoints in a run directory, none without one; `identity` are fingerprints of what is run."""
        self.latest: Path | None = None
        self._directory = directory
        self._identity = dict(identity)
        self._steps = save.checkpoint_steps
        self._seconds = MINUTE * save.checkpoint_minutes
        self._step = 0  # at the latest
        self._written = time.monotonic()

    def due(self, step: int) -> bool:
        """Whether it is time for the next one, after so many steps."""
        if self._directory is None:
            return False
        many_steps = self._steps is not None and step - self._step >= self._steps
        return many_steps or time.monotonic() - self._written >= self._seconds

    def write(self, step: int, values: Mapping[str, Any], arrays: Arrays) -> None:
        """Write one, unless there is one of this step.

        Raises:
            SimulationError: the disk is full or refuses.
        """
        if self._directory is None or (self.latest is not None and step == self._step):
            return
        header = {"identity": self._identity, "values": dict(values)}
        self.latest = write_checkpoint(self._directory, step, header, arrays)
        self._step, self._written = step, time.monotonic()

    def read(self) -> tuple[dict[str, Any], dict[str, np.ndarray], list[str]]:
        """Values and arrays of the newest one that can be read, and a warning for each that cannot.

        Raises:
            InputError: there is none, or it was made of something else.
        """
        unreadable: list[InputError] = []
        for path in () if self._directory is None else checkpoint_files(self._directory):
            try:
                header, arrays = read_checkpoint(path)
            except InputError as error:
                unreadable.append(error)
                continue
            self._compare(path, header.get("identity"))
            self.latest = path
            with self.must_fit():
                values = header["values"]
                self._step = int(values["steps"])
            return values, arrays, [f"{error}; the one before is used" for error in unreadable]
        if unreadable:
            raise unreadable[0]
        got = "no directory" if self._directory is None else f"none in {str(self._directory)!r}"
        raise mistake(
            "resume", "a checkpoint to go on from", got, "a run that is complete has none; else start anew, without it"
        )

    @contextmanager
    def must_fit(self) -> Iterator[None]:
        """Put the newest one's values back inside this `with` statement.

        Raises:
            InputError: they are not those of this run.
        """
        try:
            yield
        except (KeyError, ValueError, TypeError, IndexError) as error:
            reason = " ".join(f"{type(error).__name__}: {error}".split())
            raise mistake(str(self.latest), "a checkpoint of this run", f"one that does not fit ({reason})") from error

    def remove(self) -> None:
        """Remove them all."""
        if self._directory is not None:
            remove_checkpoints(self._directory)

    def remedy(self) -> str:
        """How to go on after the run has stopped, as the end of a message."""
        if self.latest is None:
            return ""
        return f"; the last good checkpoint is {self.latest}, --resume (resume=True) goes on from it"

    def _compare(self, path: Path, identity: object) -> None:
        if not isinstance(identity, dict):
            raise mistake(str(path), "a checkpoint that says what was run", "one that does not")
        names = sorted(identity.keys() | self._identity.keys())
        others = [name for name in names if identity.get(name) != self._identity.get(name)]
        if others:
            raise mistake(
                "resume",
                f"the scene and the settings that {path.name} was made of",
                f"others: {', '.join(others)}",
                "give the same again, or start anew without --resume (resume=True)",
            )


def part(arrays: Arrays, name: str) -> dict[str, np.ndarray]:
    """The arrays of a part of the run, by what follows its name."""
    return {key.removeprefix(f"{name}."): array for key, array in arrays.items() if key.startswith(f"{name}.")}


def saved_solver(solver: Solver) -> dict[str, np.ndarray]:
    """Everything that the next steps depend on; a copy."""
    state = solver.state
    arrays = {f"particles.{name}": getattr(state.particles, name).numpy().copy() for name in PARTICLE_ARRAYS}
    arrays |= {f"state.{name}": getattr(state, name).numpy().copy() for name in ACCOUNTS}
    blocks = _active_blocks(state)
    nodes = _nodes_of_blocks(state, blocks)
    arrays |= {f"grid.{name}": array.numpy()[nodes] for name, array in _nodal_arrays(state).items()}
    arrays[BLOCKS] = blocks.astype(np.int32)
    arrays[RANGES] = np.array(state.ranges)
    arrays[SORTING] = np.array([solver.steps_since_sort, solver.thin], dtype=np.int32)
    return arrays


def restore_solver(solver: Solver, arrays: Arrays) -> None:
    """Put back what `saved_solver` gave, into a solver at the start of the same scene.

    Raises:
        KeyError, ValueError: the arrays are not of this scene, or hold what no run can.
    """
    state = solver.state
    _check_particles(state, arrays)
    for name in PARTICLE_ARRAYS:
        _assign(getattr(state.particles, name), arrays[f"particles.{name}"])
    for name in ACCOUNTS:
        _assign(getattr(state, name), arrays[f"state.{name}"])
    _restore_grid(state, arrays)
    steps_since_sort, thin = (int(value) for value in arrays[SORTING])
    solver.take_up(arrays[RANGES], steps_since_sort, bool(thin))


def _restore_grid(state: State, arrays: Arrays) -> None:
    """Empty what the start of the scene left on the grid, and fill in what was saved."""
    blocks, step = arrays[BLOCKS], int(arrays["state.clock"][0]["step"])
    if blocks.ndim != 1 or np.any((blocks < 0) | (blocks >= state.blocks)):
        raise ValueError("blocks outside the grid")
    stamps = state.grid.stamps.numpy().copy()
    empty, nodes = (_nodes_of_blocks(state, of) for of in (np.flatnonzero(stamps != NO_STEP), blocks))
    for name, array in _nodal_arrays(state).items():
        saved = arrays[f"grid.{name}"]
        values = array.numpy()  # on a CPU a view, of which only these nodes are touched: empty space takes no memory
        if saved.shape != (len(nodes), *values.shape[1:]) or saved.dtype != values.dtype:
            raise ValueError(f"grid.{name}: {saved.dtype}{saved.shape}")
        values[empty] = 0
        values[nodes] = saved
        if state.device.is_cuda:
            array.assign(values)
    stamps[:] = NO_STEP
    stamps[blocks] = step
    state.grid.stamps.assign(stamps)


def _check_particles(state: State, arrays: Arrays) -> None:
    """Kernels trust cells, indices and ranges, and would write wherever those of a forged file point."""
    place, index, ranges = arrays["particles.position"], arrays["particles.index"], arrays[RANGES]
    cell, fraction = place["cell"], place["fraction"]
    inside = (cell >= 0) & (cell < state.model.scene.domain.cells) & (fraction >= 0.0) & (fraction < 1.0)
    if not inside.all():
        raise ValueError("particles outside the domain")
    if not np.array_equal(np.sort(index), np.arange(state.count)):
        raise ValueError("particles that are missing or twice there")
    shape = (state.model.slab_count, len(state.model.charges), 2)
    begin, count = (ranges[..., 0], ranges[..., 1]) if ranges.shape == shape else (-np.ones(1), np.ones(1))
    if np.any(begin < 0) or np.any(count < 0) or np.any(begin + count > state.count):
        raise ValueError("ranges beyond the particles")


def _nodal_arrays(state: State) -> dict[str, wp.array]:
    """What the grid keeps between two steps, by name; not every solver has all of it."""
    arrays = {name: getattr(state.grid, name) for name in NODAL_ARRAYS}
    return {name: array for name, array in arrays.items() if len(array) > 0}


def _active_blocks(state: State) -> np.ndarray:
    """The blocks that the last scatter reached."""
    return np.flatnonzero(state.grid.stamps.numpy() == int(state.clock_values()["step"]))


def _nodes_of_blocks(state: State, blocks: np.ndarray) -> np.ndarray:
    """Flat indices of all nodes of some blocks (see `kernels/blocks.py`)."""
    counts = [n + 3 for n in state.model.scene.domain.cells]
    corner = np.stack(np.unravel_index(blocks, tuple(state.grid.blocks)), axis=1) * EDGE
    within = np.stack(np.meshgrid(*3 * [np.arange(EDGE)], indexing="ij"), axis=-1).reshape(-1, 3)
    nodes = (corner[:, None] + within).reshape(-1, 3)
    on_grid = nodes[np.all(nodes < counts, axis=1)]
    return np.ravel_multi_index(tuple(on_grid.T), counts)


def _assign(array: wp.array, values: np.ndarray) -> None:
    """Overwrite an array whose type and shape the values must have."""
    there = array.numpy()
    if values.shape != there.shape or values.dtype != there.dtype:
        raise ValueError(f"{values.dtype}{values.shape} instead of {there.dtype}{there.shape}")
    array.assign(values)
