"""The state: what changes while a scene is solved, in arrays on the device."""

import contextlib
import itertools
import mmap
from collections.abc import Iterator
from typing import Any

import numpy as np
import warp as wp

from warp_mpm.arrival_times import light_particles
from warp_mpm.config import Order
from warp_mpm.kernels import grid, order
from warp_mpm.kernels.blocks import EDGE, NODES
from warp_mpm.kernels.precision import LAST_FRACTION, NEVER, matrix3, scalar, vector2, vector3, vector4, vector8
from warp_mpm.kernels.records import (
    TALLIES,
    BurnTimes,
    Clock,
    Grid,
    Matter,
    Maxima,
    Motion,
    Particles,
    Position,
)
from warp_mpm.kernels.walls import REACTIONS
from warp_mpm.launch import Launcher
from warp_mpm.model import Model
from warp_mpm.places import recorded_places

TALLY_ROWS = 1024  # on a GPU
GRID_SLOTS = 16  # pieces into which the work on nodes is cut on a CPU: more, and late gas is shared more evenly
CACHE_LINE = 64  # [bytes]; a node's eight lanes never lie in two
NO_STEP = -2  # a stamp that no step has
LIGHT = 1e-14  # of a particle's mass: nodes with less count as empty
CHUNK = 100_000  # particles placed at a time
NUMBER = np.dtype(wp.dtype_to_numpy(scalar))  # the scalar type, for NumPy

PARTICLE_ARRAYS = (
    "position",
    "motion",
    "matter",
    "burn_times",
    "affine",
    "index",
)


RECORDS = {"position": Position, "motion": Motion, "matter": Matter, "burn_times": BurnTimes}
RECORD_OF = {field: name for name, record in RECORDS.items() for field in record.vars}  # of each quantity


class State:
    """Particles, grid, clock, and what the kernels reduce and tally."""

    def __init__(self, model: Model, launcher: Launcher | None = None) -> None:
        """The start of a scene; a launcher's threads share the work on arrival times."""
        self.model = model
        self.device = model.device
        self.slots = 1 if model.device.is_cuda else GRID_SLOTS
        self.count = model.scene.particle_count
        self.grid = _allocate_grid(model)
        self.particles = _place_particles(model)
        self.clock = _start_clock(model)
        self.maxima = wp.zeros(model.slab_count, dtype=Maxima, device=self.device)
        rows = TALLY_ROWS if model.device.is_cuda else model.slab_count
        self.tallies = wp.zeros(rows * TALLIES, dtype=wp.float64, device=self.device)
        self.faults = wp.zeros(model.slab_count, dtype=int, device=self.device)
        self.reactions = wp.zeros(self.slots * REACTIONS, dtype=wp.float64, device=self.device)
        self.pending_impulses = wp.zeros_like(self.reactions)
        self.impulses = wp.zeros_like(self.reactions)
        self.peaks = wp.zeros(self.slots, dtype=scalar, device=self.device)
        charge = np.repeat(
            np.arange(len(model.scene.charges), dtype=np.int16), [len(c.positions) for c in model.scene.charges]
        )
        self.charge: wp.array = wp.array(charge, dtype=wp.int16, device=self.device)
        # Twice the count: the sort uses the second half as its scratch.
        self._keys = wp.zeros(2 * self.count, dtype=wp.int64, device=self.device)
        self._order = wp.zeros(2 * self.count, dtype=int, device=self.device)
        places = recorded_places(model.scene)
        times = light_particles(
            model.scene, self.particles, self.grid, launcher or Launcher(self.device, threads=1), places.joined
        )
        self.expected = places.parted(times)  # when the detonation comes to where it is recorded [s]
        self.sorts = 0
        self.ranges = self.sort()

    def sort(self) -> np.ndarray:
        """Sort the particles by (slab, charge, cell).

        Returns:
            (slabs, charges, 2) first particle and number of particles of each group.
        """
        model, n = self.model, self.count
        self.sorts += 1
        wp.launch(
            order.sort_keys,
            n,
            inputs=[self.particles, self.grid, model.slabs, self.charge, self._keys, self._order],
            device=self.device,
        )
        wp.utils.radix_sort_pairs(self._keys, self._order, n)
        for name in PARTICLE_ARRAYS:
            source = getattr(self.particles, name)
            if len(source) == n:
                target = wp.empty_like(source)
                wp.launch(
                    order.permute_kernel(source.dtype), n, inputs=[source, self._order, target], device=self.device
                )
                setattr(self.particles, name, target)
        groups = model.slab_count * len(model.charges)
        starts = wp.zeros(groups + 1, dtype=int, device=self.device)
        cells = int(np.prod(model.scene.domain.cells))
        wp.launch(order.group_starts, n + 1, inputs=[self._keys, n, wp.int64(cells), starts], device=self.device)
        first = starts.numpy()
        return np.stack([first[:-1], np.diff(first)], axis=1).reshape(model.slab_count, len(model.charges), 2)

    @property
    def blocks(self) -> int:
        """Number of blocks of nodes."""
        return len(self.grid.stamps)

    def pieces(self) -> Iterator[tuple[int, int, int]]:
        """Slot, first block and number of blocks of each piece that the work on nodes is cut into."""
        edges = [self.blocks * slot // self.slots for slot in range(self.slots + 1)]
        for slot, (begin, end) in enumerate(itertools.pairwise(edges)):
            if end > begin:
                yield slot, begin, end - begin

    def clock_values(self) -> np.void:
        """The clock's fields, by name."""
        return self.clock.numpy()[0]

    def reset_drift(self) -> None:
        """The particles have just been sorted."""
        values = self.clock.numpy().copy()
        values["drift"] = 0.0
        self.clock.assign(values)

    def positions(self) -> np.ndarray:
        """Positions of all particles (n, 3) [m], in creation order."""
        cell = self.values("cell").astype(np.float64)
        place = (cell + self.values("fraction")) * self.model.spacing + self.model.scene.domain.lower
        return self.in_creation_order(place.astype(NUMBER))

    def in_creation_order(self, values: np.ndarray) -> np.ndarray:
        """Reorder per-particle values from memory order to creation order."""
        result = np.empty_like(values)
        result[self.particles.index.numpy()] = values
        return result

    def places_in_memory(self, particles: np.ndarray) -> np.ndarray:
        """Where particles (n,), given by their creation order, are in memory, (n,); until the next sorting."""
        index = self.particles.index.numpy()
        places = np.flatnonzero(np.isin(index, particles))
        rising = np.argsort(index[places])
        return places[rising][np.searchsorted(index[places], particles, sorter=rising)]

    def field(self, name: str) -> np.ndarray:
        """A quantity of all particles (see `kernels/records.py`), in creation order."""
        return self.in_creation_order(self.values(name))

    def values(self, name: str) -> np.ndarray:
        """A quantity of all particles, in memory order."""
        if name in RECORD_OF:
            return getattr(self.particles, RECORD_OF[name]).numpy()[name]
        return getattr(self.particles, name).numpy()

    def assign(self, name: str, values: np.ndarray) -> None:
        """Set a quantity of all particles, in memory order."""
        if name not in RECORD_OF:
            getattr(self.particles, name).assign(values)
            return
        records = getattr(self.particles, RECORD_OF[name])
        changed = records.numpy().copy()
        changed[name] = values
        records.assign(changed)

    def field_pressure(self) -> np.ndarray:
        """Field pressure at the nodes of the domain (nx + 1, ny + 1, nz + 1) [Pa]; a view on a CPU."""
        return self._in_the_domain(self.grid.field)[..., 0]

    def field_density(self) -> np.ndarray:
        """Density at the nodes of the domain (nx + 1, ny + 1, nz + 1) [kg/m3]."""
        return self._measured(grid.measure_density, scalar)

    def field_velocity(self) -> np.ndarray:
        """Velocity at the nodes of the domain (nx + 1, ny + 1, nz + 1, 3) [m/s], 0 at empty ones."""
        return self._measured(grid.measure_velocity, vector3)

    def _measured(self, kernel: wp.Kernel, dtype: Any) -> np.ndarray:
        """What a kernel measures at the nodes of the domain."""
        values = wp.zeros(tuple(n + 1 for n in self.model.scene.domain.cells), dtype=dtype, device=self.device)
        wp.launch(kernel, values.shape, inputs=[self.grid, values], device=self.device)
        return values.numpy()

    def _in_the_domain(self, nodal: wp.array) -> np.ndarray:
        """What a nodal array holds at the nodes of the domain."""
        values = nodal.numpy()
        shape = tuple(n + 3 for n in self.model.scene.domain.cells)
        return values[: np.prod(shape)].reshape(shape + values.shape[1:])[1:-1, 1:-1, 1:-1]


def memory_needed(model: Model) -> int:
    """Bytes that a state of this model takes on its device."""
    kept = [record for record in RECORDS.values() if record is not BurnTimes or model.burns]
    records = sum(record.numpy_dtype()["itemsize"] for record in kept)
    affine = 9 * NUMBER.itemsize if model.affine else 0
    particle = records + affine + 4 + 26  # its index; the keys and the scratch of the sort
    musl = model.config.order is Order.MUSL
    node = (8 + 8 + 2 + (2 * 2 if model.damped else 0) + (4 + 8 + 4 if musl else 0)) * NUMBER.itemsize
    if model.ordered:  # the bins, and the scratch of their sort
        particle, node = particle + 16, node + 4
    nodes = np.prod(np.array(model.scene.domain.cells, dtype=np.float64) + 3)
    return int(model.scene.particle_count * particle + nodes * node)


def _allocate_grid(model: Model) -> Grid:
    cells = model.scene.domain.cells
    counts = [n + 3 for n in cells]
    total = counts[0] * counts[1] * counts[2]
    grid = Grid()
    reprojected = total if model.config.order is Order.MUSL else 0
    spare = 1  # of what is scattered in rows that end within a vector: see `kernels/rows.py`
    grid.sums = _sparse_zeros(total, vector8, model.device)
    grid.field = _sparse_zeros(total + spare, vector2, model.device)
    grid.content_sums = _sparse_zeros(total if model.damped else 0, vector2, model.device)
    grid.content = _sparse_zeros(total if model.damped else 0, vector2, model.device)
    grid.start = _sparse_zeros(total, vector8, model.device)
    grid.reprojected = _sparse_zeros(reprojected + spare, vector4, model.device)
    grid.end = _sparse_zeros(reprojected, vector8, model.device)
    grid.damping = _sparse_zeros(reprojected, vector4, model.device)
    blocks = [-(-n // EDGE) for n in counts]
    grid.stamps = wp.full(blocks[0] * blocks[1] * blocks[2], NO_STEP, dtype=int, device=model.device)
    grid.blocks = wp.vec3i(*blocks)
    grid.workers = NODES if model.device.is_cuda else 1
    grid.cells = wp.vec3i(*cells)
    grid.stride_x = counts[1] * counts[2]
    grid.stride_y = counts[2]
    grid.spacing = vector3(*model.spacing)
    grid.inverse_spacing = vector3(*(1.0 / model.spacing))
    grid.light_mass = LIGHT * min(c.material.density * c.particle_volume for c in model.scene.charges)
    return grid


def _sparse_zeros(count: int, dtype: Any, device: wp.Device) -> wp.array:
    """Zeros; on a CPU of memory that the system gives where it is touched, so that empty space takes none.

    In small pages: gas that expands touches new ones every few steps, and to be given one of 2 MB takes milliseconds.
    """
    if device.is_cuda or count == 0:
        return wp.zeros(count, dtype=dtype, device=device)
    lanes = getattr(dtype, "_length_", 1)
    size = count * lanes * NUMBER.itemsize
    raw = _small_pages(size + CACHE_LINE)
    begin = -raw.ctypes.data % CACHE_LINE
    values = raw[begin : begin + size].view(NUMBER)
    return wp.array(values.reshape(count, lanes) if lanes > 1 else values, dtype=dtype, device=device, copy=False)


def _small_pages(size: int) -> np.ndarray:
    """Bytes, all zero; NumPy's own ask for large pages."""
    if not hasattr(mmap, "MADV_NOHUGEPAGE"):  # only Linux has them
        return np.zeros(size, dtype=np.uint8)
    pages = mmap.mmap(-1, size, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
    with contextlib.suppress(OSError):  # a kernel without them
        pages.madvise(mmap.MADV_NOHUGEPAGE)
    return np.frombuffer(pages, dtype=np.uint8)


def _place_particles(model: Model) -> Particles:
    """Particles in creation order, at their initial velocity, density and energy."""
    device = model.device
    n = model.scene.particle_count
    position, motion, matter = (_records(record, n) for record in (Position, Motion, Matter))
    begin = 0
    for charge in model.scene.charges:
        of_charge = slice(begin, begin + len(charge.positions))
        motion["mass"][of_charge] = charge.material.density * charge.particle_volume
        if charge.velocities is not None:
            motion["velocity"][of_charge] = charge.velocities
        matter["density"][of_charge] = charge.material.density
        matter["energy"][of_charge] = charge.material.specific_energy
        _fill_places(position[of_charge], charge.positions, model)
        begin += len(charge.positions)
    burn_times = _records(BurnTimes, n if model.burns else 0)
    for name in BurnTimes.vars:
        burn_times[name] = NEVER

    particles = Particles()
    particles.position = _moved(position, Position, device)
    particles.motion = _moved(motion, Motion, device)
    particles.matter = _moved(matter, Matter, device)
    particles.burn_times = _moved(burn_times, BurnTimes, device)
    particles.affine = wp.zeros(n if model.affine else 0, dtype=matrix3, device=device)
    particles.index = _moved(np.arange(n, dtype=np.int32), int, device)
    return particles


def _fill_places(records: np.ndarray, positions: np.ndarray, model: Model) -> None:
    """Cells and fractions of `positions` (n, 3) [m], some at a time: each step makes arrays of doubles."""
    last = np.array(model.scene.domain.cells) - 1
    for begin in range(0, len(positions), CHUNK):
        chunk = slice(begin, begin + CHUNK)
        place = (positions[chunk] - model.scene.domain.lower) / model.spacing
        cell = np.clip(np.floor(place), 0, last)
        records["cell"][chunk] = cell
        records["fraction"][chunk] = np.clip((place - cell).astype(NUMBER), 0.0, float(LAST_FRACTION))


def _records(record: Any, count: int) -> np.ndarray:
    """Records on the host, all 0."""
    return np.zeros(count, dtype=record.numpy_dtype())


def _moved(values: np.ndarray, dtype: Any, device: wp.Device) -> wp.array:
    """An array on the device; on a CPU the very memory of `values`."""
    return wp.array(values, dtype=dtype, device=device, copy=device.is_cuda)


def _start_clock(model: Model) -> wp.array:
    clock = Clock()
    clock.end_time = model.scene.end_time
    return wp.array([clock], dtype=Clock, device=model.device)
