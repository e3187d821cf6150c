"""Gauges: pressure, velocity and density at points that stay, and of particles that move."""

import warp as wp

from warp_mpm.kernels.grid import node_density, node_velocity
from warp_mpm.kernels.precision import ONE, ZERO, scalar, vector3
from warp_mpm.kernels.records import Clock, Grid, Particles, node_index

# Lanes of a gauge in a record's row.
GAUGE_PRESSURE = wp.constant(0)  # [Pa]
GAUGE_VELOCITY = wp.constant(1)  # three of them [m/s]
GAUGE_DENSITY = wp.constant(4)  # [kg/m3]
GAUGE_POSITION = wp.constant(5)  # three of them [m]
GAUGE_LANES = 8

NO_PARTICLE = wp.constant(-1)  # of a gauge that stays where it is


@wp.struct
class GaugePlaces:
    """Where the gauges are; every array has one entry a gauge."""

    cell: wp.array(dtype=wp.vec3i)  # of one that stays
    fraction: wp.array(dtype=vector3)  # of that cell
    particle: wp.array(dtype=int)  # that one moves with, by its place in memory
    lower: wp.vec3d  # corner of the domain [m]
    spacing: wp.vec3d  # [m]


@wp.func
def write_gauge(
    rows: wp.array2d(dtype=scalar),
    row: int,
    lane: int,
    pressure: scalar,
    velocity: vector3,
    density: scalar,
    position: wp.vec3d,
):
    """Fill the lanes of a gauge."""
    rows[row, lane + GAUGE_PRESSURE] = pressure
    rows[row, lane + GAUGE_DENSITY] = density
    for axis in range(3):
        rows[row, lane + GAUGE_VELOCITY + axis] = velocity[axis]
        rows[row, lane + GAUGE_POSITION + axis] = scalar(position[axis])


@wp.func
def place_in(places: GaugePlaces, cell: wp.vec3i, fraction: vector3) -> wp.vec3d:
    """Position of a fraction of a cell [m]."""
    place = wp.vec3d()
    for axis in range(3):
        place[axis] = wp.float64(cell[axis]) + wp.float64(fraction[axis])
    return places.lower + wp.cw_mul(place, places.spacing)


@wp.kernel(enable_backward=False)
def record_gauges(
    grid: Grid,
    particles: Particles,
    clock: wp.array(dtype=Clock),
    places: GaugePlaces,
    first_lane: int,
    rows: wp.array2d(dtype=scalar),
    row_offset: int,
):
    """Write what every gauge shows into one row of the record; one thread a gauge.

    One that stays takes the field between the eight nodes around it with trilinear weights w: pressure sum w p, density
    sum w rho, velocity sum w rho v / sum w rho. One that moves takes what its particle has; zeros once it has left.
    """
    gauge = wp.tid()
    row = clock[0].step - row_offset
    lane = first_lane + gauge * GAUGE_LANES
    pressure = ZERO
    density = ZERO
    velocity = vector3()
    p = places.particle[gauge]
    if p == NO_PARTICLE:
        cell = places.cell[gauge]
        f = places.fraction[gauge]
        for i in range(2):
            for j in range(2):
                for k in range(2):
                    index = cell + wp.vec3i(i, j, k)
                    n = node_index(grid, index[0], index[1], index[2])
                    w = wp.abs(scalar(1 - i) - f[0]) * wp.abs(scalar(1 - j) - f[1]) * wp.abs(scalar(1 - k) - f[2])
                    mass = w * node_density(grid, index)
                    pressure += w * grid.field[n][0]
                    density += mass
                    velocity += mass * node_velocity(grid, index)
        velocity *= wp.where(density > ZERO, ONE / density, ZERO)
        write_gauge(rows, row, lane, pressure, velocity, density, place_in(places, cell, f))
    else:
        position = particles.position[p]
        if particles.motion[p].mass > ZERO:
            pressure = particles.matter[p].pressure
            density = particles.matter[p].density
            velocity = particles.motion[p].velocity
        cell = wp.vec3i(int(position.cell[0]), int(position.cell[1]), int(position.cell[2]))
        write_gauge(rows, row, lane, pressure, velocity, density, place_in(places, cell, position.fraction))
