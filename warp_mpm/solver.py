"""One step of the Material Point Method, as named phases.

MUSL (the default): choose the time step | grid to particles, and their momentum back to the grid | solve what was
re-projected | strain, material and motion | particles to grid | solve the grid. What lies behind walls is folded back
before each solution, and both sharpen. The particles are scattered at the end of a step, so that the field pressure on
the grid belongs to the same instant as the particles.
"""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import warp as wp

from warp_mpm.config import Order
from warp_mpm.kernels import fold, material, motion, reduce, reproject, transfer
from warp_mpm.kernels import grid as grid_kernels
from warp_mpm.kernels.blocks import NODES
from warp_mpm.kernels.initial_strain import initial_strain_kernel
from warp_mpm.kernels.node_pass import Phase
from warp_mpm.kernels.precision import vector3
from warp_mpm.launch import Launcher, Task
from warp_mpm.model import STRAINS, ChargeModel, Model
from warp_mpm.ordered_sums import OrderedSums
from warp_mpm.state import State

THIN = 0.5  # nodes of active blocks to a particle from which on asking ahead pays; in a dense gas there are 0.2
AUDIT_THREADS = 1 << 15  # on a GPU: enough to keep all of it busy
STEPS_BETWEEN_SORTS = 20  # neighbours in memory stay neighbours on the grid for about as long


class Solver:
    """Advances a state, step by step."""

    def __init__(self, model: Model, state: State, launcher: Launcher) -> None:
        self.model = model
        self.state = state
        self.launcher = launcher
        self.steps_since_sort = 0
        self.thin = False  # whether there were very few particles to a node when they were last sorted
        self.batched = not model.device.is_cuda  # whether a launch goes through its particles in batches
        self._graph: wp.Graph | None = None
        self._ordered = OrderedSums(state, launcher) if model.ordered else None
        self._record_clock()
        self._record_ranges()
        self._initialise()

    def step(self) -> None:
        """One step, of whatever length the state allows."""
        if self.launcher.graphs:
            if self._graph is None:
                self._graph = self.launcher.capture(self._run_phases)
            wp.capture_launch(self._graph)
        else:
            self._run_phases()
        self.steps_since_sort += 1

    def _run_phases(self) -> None:
        for _, run in self.phases():
            run()

    def phases(self) -> Iterator[tuple[str, Callable[[], None]]]:
        """The phases of a step, in order, by name."""
        if self.model.config.order is Order.USF:
            yield from self._phases_of_usf()
            return
        musl = self.model.config.order is Order.MUSL
        yield "time step", self._start_step.launch
        yield "collect reactions", self._collect_reactions.launch
        yield "grid to particles and back", lambda: self._over_slabs(self._advance)
        if musl:
            if self.model.ordered:
                yield "momentum to grid", lambda: self._over_nodes(self._reproject)
            yield "fold re-projection", lambda: self._over_nodes(self._fold_reprojected)
            yield "solve re-projection", lambda: self._over_nodes(self._solve_reprojected)
        yield "strain and material", lambda: self._over_particles(self._update)
        if not musl:
            yield "clear", lambda: self._over_nodes(self._clear)
        yield "particles to grid", lambda: self._to_grid(self._scatter_all)
        yield "fold grid", lambda: self._over_nodes(self._fold_all)
        yield "solve grid", lambda: self._over_nodes(self._solve_all)
        yield "end of step", self._end_step.launch

    def _phases_of_usf(self) -> Iterator[tuple[str, Callable[[], None]]]:
        yield "time step", self._start_step.launch
        yield "clear", lambda: self._over_nodes(self._clear)
        yield "momentum to grid", lambda: self._to_grid(self._scatter_momentum)
        yield "fold momentum", lambda: self._over_nodes(self._fold_momentum)
        yield "solve momentum", lambda: self._over_nodes(self._solve_momentum)
        yield "strain and material", lambda: self._over_particles(self._update)
        yield "forces to grid", lambda: self._to_grid(self._scatter_force)
        yield "fold forces", lambda: self._over_nodes(self._fold_force)
        yield "solve forces", lambda: self._over_nodes(self._solve_all)
        yield "collect reactions", self._collect_reactions.launch
        yield "grid to particles", lambda: self._over_slabs(self._advance)
        yield "motion", lambda: self._over_particles(self._move)
        yield "end of step", self._end_step.launch

    def sort_if_due(self) -> None:
        """Sort the particles before any of them can drift out of its slab's reach, and for locality."""
        clock = self.state.clock_values()
        # Twice the last step's way: the next one is at most a little longer.
        drifting = clock["drift"] + 2.0 * clock["last_drift"] > self.model.largest_drift
        if drifting or self.steps_since_sort >= STEPS_BETWEEN_SORTS:
            self.sort()

    def sort(self) -> None:
        """Sort the particles, and record the launches for their new ranges."""
        ranges = self.state.sort()
        self.state.reset_drift()
        self.take_up(ranges, 0, self._gas_is_thin())

    def take_up(self, ranges: np.ndarray, steps_since_sort: int, thin: bool) -> None:
        """Record the launches for particles that lie otherwise in memory: just sorted, or those of a checkpoint."""
        self.state.ranges = ranges
        self.steps_since_sort = steps_since_sort
        self.thin = thin
        self._record_ranges()
        if self._ordered is not None:
            self._ordered.fill()

    def audit(self) -> tuple[np.ndarray, float]:
        """Sums over the particles (`kernels.reduce` names the lanes), and the mass on the grid [kg]."""
        state, model = self.state, self.model
        threads = AUDIT_THREADS if model.device.is_cuda else 1
        sums = wp.zeros(threads, dtype=reduce.AuditRow, device=model.device)
        for _, charge, begin, count in self._groups():
            energy = charge.material.specific_energy if charge.burn_class is not None else 0.0
            inputs = [state.particles, state.grid.spacing, energy, sums, threads, begin, count]
            wp.launch(reduce.audit_particles, threads, inputs=inputs, device=model.device)
        grid_mass = wp.zeros(threads, dtype=wp.float64, device=model.device)
        inputs = [state.grid, model.boundary, state.clock, grid_mass, threads]
        wp.launch(reduce.audit_grid, threads, inputs=inputs, device=model.device)
        return sums.numpy().sum(axis=0), float(grid_mass.numpy().sum())

    def _initialise(self) -> None:
        """Pressures and rates at the start, and the first scatter."""
        state, model = self.state, self.model
        for slab, charge, begin, count in self._groups():
            wp.launch(
                material.initial_kernel(*charge.classes),
                count,
                inputs=[
                    *(state.particles, *charge.records),
                    *(model.viscosity, model.ambient_pressure, state.maxima, slab, begin),
                ],
                device=model.device,
            )
        self._to_grid(self._scatter_all)
        self._over_nodes(self._fold_all)
        self._over_nodes(self._solve_all)
        if any(charge.velocities is not None for charge in model.scene.charges):
            kernel = initial_strain_kernel(model.shape)
            for slab, charge, begin, count in self._groups():
                inputs = [state.particles, state.grid, charge.half_width, state.maxima, slab, begin]
                wp.launch(kernel, count, inputs=inputs, device=model.device)
        if model.config.order is Order.USF:  # which computes forces anew before it uses any
            state.reactions.zero_()
            state.pending_impulses.zero_()

    def _to_grid(self, tasks: list[Task]) -> None:
        """What particles give to nodes: from slab to slab, or node by node in a fixed order."""
        if self._ordered is None:
            self._over_slabs(tasks)
        else:
            self._ordered.fill()
            self._over_nodes(tasks)

    def _over_slabs(self, tasks: list[Task]) -> None:
        """Particle work that writes to nodes: the even slabs, which share none, then the odd ones."""
        self.launcher.run(tasks[0::2], self.state.count)
        self.launcher.run(tasks[1::2], self.state.count)

    def _over_particles(self, tasks: list[Task]) -> None:
        """Particle work that writes to particles and their slab's reductions alone."""
        self.launcher.run(tasks, self.state.count)

    def _over_nodes(self, tasks: list[Task]) -> None:
        """Work on nodes."""
        self.launcher.run(tasks, NODES * self.state.blocks)

    def _groups(self) -> Iterator[tuple[int, ChargeModel, int, int]]:
        """Slab, charge, first particle and number of particles of each group that has any."""
        for slab, row in enumerate(self.state.ranges):
            for charge, (begin, count) in zip(self.model.charges, row, strict=True):
                if count > 0:
                    yield slab, charge, int(begin), int(count)

    def _record_clock(self) -> None:
        state, model = self.state, self.model
        slabs = model.slab_count
        damping = reduce.DAMPING if model.damped else 0.0
        inputs = [state.clock, vector3(*model.spacing), model.viscosity.length, model.config.cfl, damping]
        self._start_step = self.launcher.record(reduce.start_step, 1, [*inputs, slabs, state.maxima])
        self._end_step = self.launcher.record(reduce.end_step, 1, [state.clock, slabs, state.maxima])
        self._collect_reactions = self.launcher.record(
            reduce.collect_reactions,
            len(state.reactions),
            [state.clock, state.reactions, state.pending_impulses, state.impulses],
        )

    def _record_ranges(self) -> None:
        """Record every launch over particles and nodes, for the ranges that the last sorting gave."""
        self._graph = None  # of the ranges before
        self._record_particle_phases()
        self._record_node_phases()

    def _record_particle_phases(self) -> None:
        state, model = self.state, self.model
        order, shape = model.config.order, model.shape
        ambient = model.ambient_pressure
        blend = model.pic_share > 0.0
        musl, usf = order is Order.MUSL, order is Order.USF
        thin = self.thin

        def scatter(momentum: bool, force: bool) -> list[Task]:
            if self._ordered is not None:
                return self._ordered.scatter(momentum, force)
            kernel = transfer.scatter_kernel(shape, momentum, force, model.affine, model.damped, thin)
            return self._per_slab(
                lambda slab, charge: (kernel, [state.particles, state.grid, state.clock, charge.half_width, ambient])
            )

        reprojects = musl and self._ordered is None
        if musl and self._ordered is not None:
            self._reproject = self._ordered.reprojection()
        advance = transfer.advance_kernel(shape, blend, model.affine, reprojects, thin)
        self._advance = self._per_slab(
            lambda slab, charge: (
                advance,
                [state.particles, state.grid, state.clock, charge.half_width, model.pic_share],
            )
        )
        self._record_update()
        self._scatter_all = scatter(momentum=True, force=True)
        if usf:
            self._scatter_momentum = scatter(momentum=True, force=False)
            self._scatter_force = scatter(momentum=False, force=True)
            move = motion.move_kernel(shape)
            self._move = self._per_slab(
                lambda slab, charge: (
                    move,
                    [
                        *(state.particles, state.grid, model.faces, state.clock, charge.half_width),
                        *(state.maxima, state.tallies, state.faults, slab),
                    ],
                )
            )

    def _record_update(self) -> None:
        """The material update: on a CPU a launch has one thread, which goes through its particles in batches."""
        state, model = self.state, self.model
        strain, moves = STRAINS[model.config.order], model.config.order is not Order.USF
        tasks: list[list[Any]] = [[] for _ in range(model.slab_count)]
        for slab, charge, begin, count in self._groups():
            kernel = material.update_kernel(
                model.shape, strain, model.damped, moves, *charge.classes, self.thin, self.batched
            )
            inputs = [
                *(state.particles, state.grid, model.faces, state.clock, *charge.records),
                *(model.viscosity, charge.half_width, model.ambient_pressure),
                *(state.maxima, state.tallies, state.faults, slab, begin, count),
            ]
            tasks[slab].append(self.launcher.record(kernel, 1 if self.batched else count, inputs))
        self._update: list[Task] = list(tasks)

    def _gas_is_thin(self) -> bool:
        """Whether there are so many nodes to a particle that a CPU mostly waits for them, and should ask ahead."""
        if self.model.device.is_cuda:
            return False
        step = int(self.state.clock_values()["step"])
        active = np.count_nonzero(self.state.grid.stamps.numpy() == step)
        return bool(NODES * active > THIN * self.state.count)

    def _record_node_phases(self) -> None:
        state, model = self.state, self.model
        phase = Phase()
        phase.pic_share = model.pic_share
        phase.strength = 0.5 * model.shape.spread
        phase.reactions, phase.impulses, phase.peaks = state.reactions, state.pending_impulses, state.peaks
        reprojection = Phase()
        reprojection.strength, reprojection.impulses = phase.strength, state.impulses
        order, damped, sharpened = model.config.order, model.damped, model.sharpened

        musl = order is Order.MUSL
        self._fold_all = self._at_walls(fold.fold_kernel(True, True), phase)
        self._solve_all = self._per_slot(grid_kernels.solve_kernel(True, damped, sharpened, musl), phase)
        if musl:
            self._fold_reprojected = self._at_walls(fold.fold_reprojected_kernel(), reprojection)
            kernel = reproject.solve_reprojected_kernel(sharpened, damped)
            self._solve_reprojected = self._per_slot(kernel, reprojection)
        else:
            self._clear = self._per_slot(reproject.clear_kernel(), phase)
        if order is Order.USF:
            self._fold_momentum = self._at_walls(fold.fold_kernel(True, False), phase)
            self._fold_force = self._at_walls(fold.fold_kernel(False, True), phase)
            self._solve_momentum = self._per_slot(grid_kernels.solve_kernel(False, damped, sharpened, False), phase)

    def _per_slab(self, phase: Callable[[int, ChargeModel], tuple[wp.Kernel, list[Any]]]) -> list[Task]:
        """One task for each slab, with one recorded launch for each charge that has particles there."""
        tasks: list[list[Any]] = [[] for _ in range(self.model.slab_count)]
        for slab, charge, begin, count in self._groups():
            kernel, inputs = phase(slab, charge)
            tasks[slab].append(self.launcher.record(kernel, count, [*inputs, begin]))
        return list(tasks)

    def _at_walls(self, kernel: wp.Kernel, phase: Phase) -> list[Task]:
        """Work on the nodes at walls; none, and nothing to compile, without walls."""
        return self._per_slot(kernel, phase) if self.model.has_walls else []

    def _per_slot(self, kernel: wp.Kernel, phase: Phase) -> list[Task]:
        """The blocks of nodes, piece by piece."""
        state = self.state
        inputs = [state.grid, self.model.boundary, state.clock, phase]
        return [
            [self.launcher.record(kernel, count * state.grid.workers, [*inputs, slot, begin])]
            for slot, begin, count in state.pieces()
        ]
