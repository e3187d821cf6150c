"""A ring of detonators: the fronts of a disc lit all around its rim close in on its axis."""

import math

from warp_mpm.builder import SceneBuilder
from warp_mpm.checks import positive
from warp_mpm.detonators import ring
from warp_mpm.geometry import Cylinder
from warp_mpm.materials import ammonium_nitrate
from warp_mpm.scene import Scene, Wall, Walls

RADIUS = 0.1  # of the disc [m]
THICKNESS = 2  # cells
ROOM = 0.02  # around the rim [m]
MEETING_TIMES = (0.5, 0.8, 1.0, 1.1, 1.3)  # of the run to the axis: instants worth a picture


def scene(
    *,
    cell_size: float = 2e-3,
    detonators: int = 12,
    delay: float = 0.0,
    particles_per_axis: int = 2,
    end_time: float = 50e-6,
) -> Scene:
    """A disc of the paper's explosive between two slip walls, lit at points on its rim, which is free.

    Neighbouring fronts meet on radii half-way between the detonators, and all of them on the axis at once, unless each
    is lit `delay` after the one before it.
    """
    explosive = ammonium_nitrate()
    height = THICKNESS * positive("cell_size", cell_size)
    low, high = (0.0, 0.0, 0.0), (0.0, 0.0, height)
    middle = (0.0, 0.0, height / 2)
    lamps = ring(middle, (0.0, 0.0, 1.0), RADIUS, detonators, delay=delay)

    builder = SceneBuilder("ring_initiation")
    room = (ROOM, ROOM, ROOM, ROOM, 0.0, 0.0)
    builder.domain((-RADIUS, -RADIUS, 0.0), (RADIUS, RADIUS, height), cell_size=cell_size, margins=room)
    builder.walls(Walls(Wall.OPEN, Wall.OPEN, Wall.OPEN, Wall.OPEN))
    builder.charge(Cylinder(low, high, RADIUS), explosive, particles_per_axis=particles_per_axis, name="disc")
    builder.detonator(*lamps)
    builder.front_path(lamps[0].position, middle)
    builder.line(lamps[0].position, middle)
    builder.collision_point(middle)
    between = math.pi / detonators
    builder.gauge(middle, name="axis")
    builder.gauge((RADIUS / 2 * math.cos(between), RADIUS / 2 * math.sin(between), height / 2), name="between")
    builder.end_time(end_time)
    run = RADIUS / explosive.burn.detonation_speed
    builder.picture_times(part * run for part in MEETING_TIMES if part * run <= end_time)
    return builder.build()
