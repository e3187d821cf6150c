"""Reductions: the next time step, the walls' impulse, the audit of mass, momentum and energy."""

import warp as wp

from warp_mpm.kernels.blocks import NODES, is_active, lowest_node_of, node_of_block, on_grid
from warp_mpm.kernels.precision import HALF, ZERO, scalar, vector3
from warp_mpm.kernels.records import (
    DISPLACEMENT,
    SPEED_X,
    STRAIN_RATE,
    VISCOUS_RATE,
    Clock,
    Grid,
    Maxima,
    Particles,
    node_index,
)
from warp_mpm.kernels.walls import Boundary, is_owner

GROWTH = wp.constant(scalar(1.1))  # of the time step, from one step to the next, at most
LARGEST_STRAIN = wp.constant(scalar(0.2))  # |div v| dt, at most
DAMPING = 0.4  # k of the conservative damping
TINY = wp.constant(scalar(1.0e-30))  # keeps a rate that is zero from being divided by

# Lanes of the audit.
AUDIT_MASS = 0  # [kg]
AUDIT_MOMENTUM = 1  # three lanes [kg m/s]
AUDIT_ABSOLUTE_MOMENTUM = 4  # sum m |v| [kg m/s]
AUDIT_KINETIC = 5  # [J]
AUDIT_INTERNAL = 6  # [J]
AUDIT_RELEASED = 7  # sum F m E0 [J]
AUDIT_VOLUME = 8  # [m3]
AUDIT_POSITION = 9  # three lanes, sum m x from the domain's lower corner [kg m]
AUDIT = 12  # lanes


@wp.func
def largest(maxima: wp.array(dtype=Maxima), slabs: int, lane: int) -> scalar:
    """Largest value of a lane over the slabs."""
    result = ZERO
    for slab in range(slabs):
        result = wp.max(result, maxima[slab][lane])
    return result


@wp.kernel(enable_backward=False)
def start_step(
    clock: wp.array(dtype=Clock),
    spacing: vector3,
    length: scalar,
    cfl: scalar,
    damping: scalar,
    slabs: int,
    maxima: wp.array(dtype=Maxima),
):
    """Choose the time step, advance the time to its end, set the damping, and empty the maxima.

    dt = cfl / max over axes of max(c + |v_axis|, D) / h_axis, with the crushing speed where it is above c; cfl l^2 / nu
    for the viscosity; |div v| dt <= 0.2; at most 1.1 times the last; clipped to the end time. The damping k is 0
    without it, as walls act on what it moves.
    """
    now = clock[0]
    rate = largest(maxima, slabs, VISCOUS_RATE)
    for axis in range(3):
        rate = wp.max(rate, largest(maxima, slabs, SPEED_X + axis) / spacing[axis])
    dt = wp.min(cfl / wp.max(rate, TINY), LARGEST_STRAIN / wp.max(largest(maxima, slabs, STRAIN_RATE), TINY))
    if now.step > 0:
        dt = wp.min(dt, GROWTH * now.dt)
    left = now.end_time - now.time
    clipped = wp.float64(dt) >= left
    now.time = now.time + wp.float64(dt)
    if clipped:
        dt = scalar(left)
        now.time = now.end_time
    if now.step == 0:
        now.first_dt = dt
        now.smallest_dt = dt
    if not clipped:
        now.smallest_dt = wp.min(now.smallest_dt, dt)
    now.damping = damping * dt / length
    now.dt = dt
    now.step = now.step + 1
    clock[0] = now
    for slab in range(slabs):
        maxima[slab] = Maxima()


@wp.kernel(enable_backward=False)
def end_step(clock: wp.array(dtype=Clock), slabs: int, maxima: wp.array(dtype=Maxima)):
    """Add the way of the fastest particle to the drift since the last sorting."""
    now = clock[0]
    now.last_drift = largest(maxima, slabs, DISPLACEMENT)
    now.drift = now.drift + now.last_drift
    clock[0] = now


@wp.kernel(enable_backward=False)
def collect_reactions(
    clock: wp.array(dtype=Clock),
    reactions: wp.array(dtype=wp.float64),
    pending: wp.array(dtype=wp.float64),
    impulses: wp.array(dtype=wp.float64),
):
    """Impulse of the walls in this step: their forces times dt, and what PIC took over from them."""
    lane = wp.tid()
    impulses[lane] = impulses[lane] + reactions[lane] * wp.float64(clock[0].dt) + pending[lane]
    reactions[lane] = wp.float64(0.0)
    pending[lane] = wp.float64(0.0)


AuditRow = wp.types.vector(AUDIT, wp.float64)


@wp.func
def audited(particles: Particles, spacing: vector3, chemical_energy: scalar, p: int) -> AuditRow:
    """What a particle adds to the audit."""
    motion = particles.motion[p]
    matter = particles.matter[p]
    position = particles.position[p]
    mass = wp.float64(motion.mass)
    velocity = motion.velocity
    row = AuditRow()
    row[AUDIT_MASS] = mass
    for axis in range(3):
        place = wp.float64(position.cell[axis]) + wp.float64(position.fraction[axis])
        row[AUDIT_MOMENTUM + axis] = mass * wp.float64(velocity[axis])
        row[AUDIT_POSITION + axis] = mass * place * wp.float64(spacing[axis])
    row[AUDIT_ABSOLUTE_MOMENTUM] = mass * wp.float64(wp.length(velocity))
    row[AUDIT_KINETIC] = mass * wp.float64(HALF * wp.dot(velocity, velocity))
    row[AUDIT_INTERNAL] = mass * wp.float64(matter.energy)
    if particles.burn_times.shape[0] > 0:
        row[AUDIT_RELEASED] = mass * wp.float64(matter.burn_fraction) * wp.float64(chemical_energy)
    row[AUDIT_VOLUME] = mass / wp.float64(matter.density)
    return row


@wp.kernel(enable_backward=False)
def audit_particles(
    particles: Particles,
    spacing: vector3,
    chemical_energy: scalar,
    sums: wp.array(dtype=AuditRow),
    threads: int,
    begin: int,
    count: int,
):
    """Sum mass, momentum, energies and volume of some particles, in double; inert matter has no `chemical_energy`.

    Each thread adds its share to a row of its own: in the same order every time, and without waiting for others.
    """
    thread = wp.tid()
    row = sums[thread]
    for p in range(begin + thread, begin + count, threads):
        row += audited(particles, spacing, chemical_energy, p)
    sums[thread] = row


@wp.kernel(enable_backward=False)
def audit_grid(
    grid: Grid, boundary: Boundary, clock: wp.array(dtype=Clock), sums: wp.array(dtype=wp.float64), threads: int
):
    """Sum the mass on the grid, in double, thread by thread."""
    thread = wp.tid()
    mass = wp.float64(0.0)
    for task in range(thread, grid.stamps.shape[0] * grid.workers, threads):
        block = task // grid.workers
        if is_active(grid, block, clock[0].step):
            lowest = lowest_node_of(grid, block)
            for n in range(task % grid.workers, NODES, grid.workers):
                index = node_of_block(lowest, n)
                if on_grid(grid, index) and is_owner(boundary, grid.cells, index):
                    mass += wp.float64(grid.sums[node_index(grid, index[0], index[1], index[2])][3])
    sums[thread] = mass
