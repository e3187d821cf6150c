"""Arrival times of the detonation: the wave runs straight from each detonator at the detonation speed.

t_b = min over detonators of (t_i + distance / D), the delayed minimum: the nearest detonator need not be the first.
Reference: Wilkins 1999; the paper, section 2.3.
"""

import warp as wp

from warp_mpm.kernels.precision import ZERO, scalar, vector3
from warp_mpm.kernels.records import Grid, Particles


@wp.struct
class Ignition:
    """One detonator."""

    position: vector3  # relative to the domain's lower corner [m]
    normal: vector3  # unit normal of a plane detonator; zero for a point
    time: scalar  # [s]
    booster_radius: scalar  # within which matter burns from `time` on [m]; 0 without a booster


@wp.func
def distance_to(ignition: Ignition, position: vector3) -> scalar:
    """Distance from a detonator [m]: to the point, or to the plane."""
    from_detonator = position - ignition.position
    distance = wp.length(from_detonator)
    if wp.dot(ignition.normal, ignition.normal) > ZERO:
        distance = wp.abs(wp.dot(ignition.normal, from_detonator))
    return distance


@wp.func
def arrival_time(ignition: Ignition, position: vector3, detonation_speed: scalar) -> scalar:
    """t_i + distance / D [s]."""
    return ignition.time + distance_to(ignition, position) / detonation_speed


@wp.func
def particle_position(particles: Particles, grid: Grid, p: int) -> vector3:
    """Position of a particle relative to the domain's lower corner [m]."""
    position = particles.position[p]
    cell = position.cell
    whole = vector3(scalar(cell[0]), scalar(cell[1]), scalar(cell[2]))
    return wp.cw_mul(whole + position.fraction, grid.spacing)


@wp.kernel(enable_backward=False)
def light(particles: Particles, grid: Grid, ignitions: wp.array(dtype=Ignition), detonation_speed: scalar, begin: int):
    """Arrival and booster times of particles from the detonators that light them."""
    p = begin + wp.tid()
    position = particle_position(particles, grid, p)
    arrival = particles.burn_times[p].arrival_time
    booster = particles.burn_times[p].booster_time
    for n in range(ignitions.shape[0]):
        ignition = ignitions[n]
        arrival = wp.min(arrival, arrival_time(ignition, position, detonation_speed))
        if ignition.booster_radius > ZERO and distance_to(ignition, position) <= ignition.booster_radius:
            booster = wp.min(booster, ignition.time)
    particles.burn_times[p].arrival_time = arrival
    particles.burn_times[p].booster_time = booster
