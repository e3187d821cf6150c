"""Arrival times of the detonation: the wave runs straight from each detonator at the detonation speed.

t_b = min over detonators of (t_i + distance / D), the delayed minimum: the nearest detonator need not be the first.
Where something is in the way, `eikonal.py` finds the way around it.
Reference: Wilkins 1999; the paper, section 2.3.
"""

import warp as wp

from warp_mpm.kernels.precision import NEVER, ONE, ZERO, scalar, vector3
from warp_mpm.kernels.records import Grid, Particles


@wp.struct
class Ignition:
    """One detonator: a point or a straight line, which may be lit from its start to its end, a sphere or a plane."""

    position: vector3  # of the point, the line's start, the sphere's centre; relative to the domain's lower corner [m]
    along: vector3  # from the line's start to its end [m]; zero for anything else
    normal: vector3  # unit normal of a plane; zero for anything else
    radius: scalar  # of a sphere [m]; 0 for anything else
    time: scalar  # [s]
    delay: scalar  # of the line's end after its start [s]
    booster_radius: scalar  # within which matter burns from `time` on [m]; 0 without a booster


@wp.func
def lit_share(ignition: Ignition, position: vector3, detonation_speed: scalar) -> scalar:
    """Share of a line after which the wave starts that is the first at a place.

    With r the distance from the line and s the coordinate along it, t = s / D_line + sqrt(r^2 + (s_x - s)^2) / D is
    smallest at s = s_x - r / sqrt((D_line / D)^2 - 1), the Mach cone, or at the start if the line is not faster.
    """
    length = wp.length(ignition.along)
    direction = ignition.along / length
    foot = wp.dot(position - ignition.position, direction)
    away = wp.length(position - ignition.position - direction * foot)
    lag = ignition.delay * detonation_speed / length  # D / D_line
    share = scalar(0.0)
    if lag < ONE:
        share = wp.clamp((foot - away * lag / wp.sqrt(ONE - lag * lag)) / length, ZERO, ONE)
    return share


@wp.func
def source_of(ignition: Ignition, position: vector3, detonation_speed: scalar) -> vector3:
    """The point of a detonator whose wave is the first at a place."""
    source = ignition.position
    from_detonator = position - ignition.position
    if wp.dot(ignition.normal, ignition.normal) > ZERO:
        source = position - ignition.normal * wp.dot(ignition.normal, from_detonator)
    elif wp.dot(ignition.along, ignition.along) > ZERO:
        source = ignition.position + ignition.along * lit_share(ignition, position, detonation_speed)
    elif ignition.radius > ZERO:
        source = ignition.position + wp.normalize(from_detonator) * ignition.radius
    return source


@wp.func
def source_time(ignition: Ignition, position: vector3, detonation_speed: scalar) -> scalar:
    """When that point is lit [s]."""
    time = ignition.time
    if wp.dot(ignition.along, ignition.along) > ZERO:
        time = ignition.time + ignition.delay * lit_share(ignition, position, detonation_speed)
    return time


@wp.func
def distance_to(ignition: Ignition, position: vector3, detonation_speed: scalar) -> scalar:
    """Distance from a detonator [m]: from the point of it whose wave is the first."""
    from_detonator = position - ignition.position
    distance = wp.length(from_detonator)
    if wp.dot(ignition.normal, ignition.normal) > ZERO:
        distance = wp.abs(wp.dot(ignition.normal, from_detonator))
    elif wp.dot(ignition.along, ignition.along) > ZERO:
        distance = wp.length(position - source_of(ignition, position, detonation_speed))
    elif ignition.radius > ZERO:
        distance = wp.abs(distance - ignition.radius)
    return distance


@wp.func
def arrival_time(ignition: Ignition, position: vector3, detonation_speed: scalar) -> scalar:
    """t_i + distance / D [s]."""
    distance = distance_to(ignition, position, detonation_speed)
    return source_time(ignition, position, detonation_speed) + distance / detonation_speed


@wp.func
def first_arrival(ignitions: wp.array(dtype=Ignition), position: vector3, detonation_speed: scalar) -> scalar:
    """The least of the arrival times from several detonators [s]."""
    arrival = NEVER
    for n in range(ignitions.shape[0]):
        arrival = wp.min(arrival, arrival_time(ignitions[n], position, detonation_speed))
    return arrival


@wp.func
def particle_position(particles: Particles, grid: Grid, p: int) -> vector3:
    """Position of a particle relative to the domain's lower corner [m]."""
    position = particles.position[p]
    cell = position.cell
    whole = vector3(scalar(cell[0]), scalar(cell[1]), scalar(cell[2]))
    return wp.cw_mul(whole + position.fraction, grid.spacing)


@wp.func
def boost(particles: Particles, p: int, ignitions: wp.array(dtype=Ignition), position: vector3):
    """Set the time of the earliest booster that a particle lies in; only points have one."""
    booster = particles.burn_times[p].booster_time
    for n in range(ignitions.shape[0]):
        ignition = ignitions[n]
        within = wp.length(position - ignition.position) <= ignition.booster_radius
        if ignition.booster_radius > ZERO and within:
            booster = wp.min(booster, ignition.time)
    particles.burn_times[p].booster_time = booster


@wp.kernel(enable_backward=False)
def light(particles: Particles, grid: Grid, ignitions: wp.array(dtype=Ignition), detonation_speed: scalar, begin: int):
    """Arrival and booster times of particles from the detonators that light them, whatever lies between."""
    p = begin + wp.tid()
    position = particle_position(particles, grid, p)
    arrival = first_arrival(ignitions, position, detonation_speed)
    particles.burn_times[p].arrival_time = wp.min(particles.burn_times[p].arrival_time, arrival)
    boost(particles, p, ignitions, position)
