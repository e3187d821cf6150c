"""Where particles go: displacement, walls, and the faces through which they leave."""

import functools

import warp as wp

from warp_mpm.kernels.precision import HALF, LAST_FRACTION, ZERO, scalar, vector3
from warp_mpm.kernels.records import (
    DISPLACEMENT,
    OUTFLOW_LANES,
    OUTFLOW_MASS,
    TALLIES,
    Clock,
    Grid,
    Maxima,
    Particles,
    Position,
    raise_maxima,
    tally_row,
)
from warp_mpm.kernels.shape import Shape
from warp_mpm.kernels.transfer import displacement_function

FARTHEST = wp.constant(scalar(4.0))  # cells that a particle may move in one step; more, or NaN, is a fault


@wp.struct
class Faces:
    """Which faces of the domain are open, in the order x low, x high, y low, y high, z low, z high."""

    open: wp.types.vector(6, wp.int32)


@wp.func
def face_crossed(cell: wp.vec3i, cells: wp.vec3i, faces: Faces) -> int:
    """The open face behind which a cell lies, or -1."""
    face = -1
    for axis in range(3):
        if cell[axis] < 0 and faces.open[2 * axis] != 0:
            face = 2 * axis
        if cell[axis] >= cells[axis] and faces.open[2 * axis + 1] != 0:
            face = 2 * axis + 1
    return face


@wp.func
def tally_outflow(
    mass: scalar, velocity: vector3, energy: scalar, face: int, row: int, tallies: wp.array(dtype=wp.float64)
):
    """Add the mass, momentum and energy of a particle that leaves to the tallies of its face."""
    lane = row * TALLIES + face * OUTFLOW_LANES + OUTFLOW_MASS
    specific = wp.float64(energy) + wp.float64(HALF) * wp.float64(wp.dot(velocity, velocity))
    wp.atomic_add(tallies, lane, wp.float64(mass))
    for axis in range(3):
        wp.atomic_add(tallies, lane + 1 + axis, wp.float64(mass) * wp.float64(velocity[axis]))
    wp.atomic_add(tallies, lane + 4, wp.float64(mass) * specific)


@wp.struct
class Place:
    """Where a particle is after a step."""

    cell: wp.vec3i
    fraction: vector3
    moved: scalar  # its longest way along an axis [cells]
    left_through: int  # the open face through which it left, or -1
    fault: bool  # it moved absurdly far, or its displacement is not a number


@wp.func
def place(
    cells: wp.vec3i,
    faces: Faces,
    old_cell: wp.vec3s,
    old_fraction: vector3,
    displacement: vector3,
) -> Place:
    """Move a particle by `displacement` [cells]; every particle's stencil is tested here, every step.

    A particle that crosses an open face leaves. A mirror wall cannot be crossed but by round-off, which puts the
    particle back on the wall. So a particle's cell is always one of the domain, and its stencil within the arrays.
    """
    result = Place()
    result.left_through = -1
    result.moved = wp.max(wp.abs(displacement[0]), wp.max(wp.abs(displacement[1]), wp.abs(displacement[2])))
    # Axis by axis: the maximum of NaN and a number may be the number.
    near = wp.abs(displacement[0]) < FARTHEST and wp.abs(displacement[1]) < FARTHEST
    near = near and wp.abs(displacement[2]) < FARTHEST
    if not near:
        result.moved = ZERO
        result.fault = True
        return result
    fraction = old_fraction + displacement
    below = vector3(wp.floor(fraction[0]), wp.floor(fraction[1]), wp.floor(fraction[2]))
    fraction = fraction - below
    cell = wp.vec3i(int(old_cell[0]), int(old_cell[1]), int(old_cell[2]))
    cell = cell + wp.vec3i(int(below[0]), int(below[1]), int(below[2]))
    # A tiny negative number plus one rounds to one.
    last = vector3(LAST_FRACTION, LAST_FRACTION, LAST_FRACTION)
    fraction = wp.min(fraction, last)
    outside = cell[0] < 0 or cell[1] < 0 or cell[2] < 0
    outside = outside or cell[0] >= cells[0] or cell[1] >= cells[1] or cell[2] >= cells[2]
    if outside:
        result.left_through = face_crossed(cell, cells, faces)
        for axis in range(3):
            if cell[axis] < 0:
                fraction[axis] = ZERO
            if cell[axis] >= cells[axis]:
                fraction[axis] = LAST_FRACTION
        cell = wp.max(wp.min(cell, cells - wp.vec3i(1, 1, 1)), wp.vec3i(0, 0, 0))
    result.cell = cell
    result.fraction = fraction
    return result


@wp.func
def report_fault(particles: Particles, p: int, slab: int, faults: wp.array(dtype=int)):
    """Say that the run cannot go on because of a particle; of several in a slab, the last one is reported."""
    wp.atomic_max(faults, slab, particles.index[p] + 1)


@wp.func
def settle(
    particles: Particles,
    p: int,
    after: Place,
    mass: scalar,
    velocity: vector3,
    energy: scalar,
    slab: int,
    tallies: wp.array(dtype=wp.float64),
    faults: wp.array(dtype=int),
):
    """Put a particle in its place, take it out if it left, or report a fault."""
    if after.fault:
        report_fault(particles, p, slab, faults)
        return
    if after.left_through >= 0:
        tally_outflow(mass, velocity, energy, after.left_through, tally_row(tallies, slab, p), tallies)
        particles.motion[p].mass = ZERO
        particles.matter[p].pressure = ZERO
        particles.matter[p].viscous_pressure = ZERO
        return
    position = Position()
    position.cell = wp.vec3s(wp.int16(after.cell[0]), wp.int16(after.cell[1]), wp.int16(after.cell[2]))
    position.fraction = after.fraction
    particles.position[p] = position


@functools.cache
def move_kernel(shape: Shape) -> wp.Kernel:
    """Move the particles with the grid (for USF, whose material update comes before the forces)."""
    displacement = displacement_function(shape)

    @wp.kernel(enable_backward=False, module="unique")
    def move(
        particles: Particles,
        grid: Grid,
        faces: Faces,
        clock: wp.array(dtype=Clock),
        half_width: scalar,
        maxima: wp.array(dtype=Maxima),
        tallies: wp.array(dtype=wp.float64),
        faults: wp.array(dtype=int),
        slab: int,
        begin: int,
    ):
        p = begin + wp.tid()
        motion = particles.motion[p]
        if motion.mass == ZERO:
            return
        position = particles.position[p]
        step = displacement(grid, position.cell, position.fraction, half_width, clock[0].dt)
        after = place(grid.cells, faces, position.cell, position.fraction, step)
        moved = Maxima()
        moved[DISPLACEMENT] = after.moved
        raise_maxima(maxima, slab, moved)
        energy = particles.matter[p].energy
        settle(particles, p, after, motion.mass, motion.velocity, energy, slab, tallies, faults)

    return move
