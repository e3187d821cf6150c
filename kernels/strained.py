"""What a step does to a particle before its material answers: a new energy, velocity and place, and a strain.

What the strain does to its volume is for the material to answer (`response.py`).
"""

import functools
from typing import Any

import warp as wp

from warp_mpm.kernels.batch import numbers_in
from warp_mpm.kernels.content import FILLING, PRESSURE
from warp_mpm.kernels.motion import Faces, place, settle
from warp_mpm.kernels.precision import ONE, ZERO, matrix3, scalar, vector3
from warp_mpm.kernels.records import AMBIENT_WORK, CLAMPED_ENERGY, TALLIES, Clock, Grid, Particles, tally_row
from warp_mpm.kernels.shape import Shape
from warp_mpm.kernels.strain import Strain, deformation_function
from warp_mpm.kernels.transfer import Ahead, look_ahead_function
from warp_mpm.kernels.vectors import at_rest_if_slow


@wp.struct
class Strained:
    """What a particle's material answers to; in the order of `strained_of`, `batch.py` holds many of them."""

    density: scalar  # before the step [kg/m3]
    pressure: scalar  # before the step [Pa]
    burn_fraction: scalar  # before the step
    energy: scalar  # after work and heat of the step [J/kg]
    gradient: matrix3  # grad v [1/s], of the velocity that changes its volume
    acceleration: vector3  # in direction: the velocity that the step adds [m/s]
    pressure_around: scalar  # of the cells around it [Pa]
    filling: scalar  # of the cells around it
    since_arrival: scalar  # time since the wave came [s]
    since_booster: scalar  # time since the booster began to burn [s]
    moved: scalar  # [cells]


strained_numbers = wp.types.vector(numbers_in(Strained), scalar)


@wp.func
def strained_of(x: strained_numbers) -> Strained:
    """The record of these numbers."""
    gradient = matrix3(x[4], x[5], x[6], x[7], x[8], x[9], x[10], x[11], x[12])
    acceleration = vector3(x[13], x[14], x[15])
    return Strained(x[0], x[1], x[2], x[3], gradient, acceleration, x[16], x[17], x[18], x[19], x[20])


@functools.cache
def straining_function(
    shape: Shape, strain: Strain, damped: bool, move: bool, eos: Any, burns: bool, thin: bool
) -> wp.Function:
    """Device function: what the grid does to a particle; its energy, velocity and place are new then."""
    deform = deformation_function(shape, strain, damped)
    look_ahead = look_ahead_function(shape, Ahead.END if strain is Strain.REPROJECTED else Ahead.START)

    @wp.func
    def strain_particle(
        particles: Particles,
        grid: Grid,
        faces: Faces,
        now: Clock,
        half_width: scalar,
        ambient_pressure: scalar,
        tallies: wp.array(dtype=wp.float64),
        faults: wp.array(dtype=int),
        slab: int,
        p: int,
    ) -> Strained:
        result = Strained()
        result.density = ONE  # also of what is not there: nothing is divided by zero
        motion = particles.motion[p]
        mass = motion.mass
        if mass == ZERO:
            return result
        if wp.static(thin):
            look_ahead(particles, grid, p)
        dt = now.dt
        matter = particles.matter[p]
        position = particles.position[p]
        step = deform(grid, now, position, motion, matter, half_width)
        gained = step.energy
        if wp.static(damped):
            velocity = at_rest_if_slow(motion.velocity + step.damping)
            # What rounding adds to the velocity it takes from the energy: cold fast gas would be heated otherwise by a
            # damping whose changes of velocity are too small to be kept.
            gained -= wp.dot(velocity, (velocity - motion.velocity) - step.damping)
            motion.velocity = velocity
            particles.motion[p] = motion
        if ambient_pressure != ZERO:
            work = wp.float64(ambient_pressure * dt * step.work_divergence) * wp.float64(mass / matter.density)
            wp.atomic_add(tallies, tally_row(tallies, slab, p) * TALLIES + AMBIENT_WORK, work)
        energy = matter.energy + gained
        if wp.static(not eos.negative_energy):
            if energy < ZERO:
                clamped = -wp.float64(energy) * wp.float64(mass)
                wp.atomic_add(tallies, tally_row(tallies, slab, p) * TALLIES + CLAMPED_ENERGY, clamped)
                energy = ZERO
        if wp.static(move):
            way = dt * wp.cw_mul(step.carried, grid.inverse_spacing)
            after = place(grid.cells, faces, position.cell, position.fraction, way)
            result.moved = after.moved
            settle(particles, p, after, mass, motion.velocity, energy, slab, tallies, faults)
        result.density = matter.density
        result.pressure = matter.pressure
        result.burn_fraction = matter.burn_fraction
        result.energy = energy
        result.gradient = step.gradient
        result.acceleration = step.acceleration
        result.pressure_around = step.around[PRESSURE]
        result.filling = step.around[FILLING]
        if wp.static(burns):
            if matter.burn_fraction < ONE:
                times = particles.burn_times[p]
                result.since_arrival = scalar(now.time - wp.float64(times.arrival_time))
                result.since_booster = scalar(now.time - wp.float64(times.booster_time))
        return result

    return strain_particle
