"""A ball of TNT in air: its shock against measured ones, four to eight charge radii away."""

import math

import numpy as np

from warp_mpm.builder import SceneBuilder
from warp_mpm.checks import positive
from warp_mpm.detonators import PointDetonator
from warp_mpm.geometry import Box, Sphere
from warp_mpm.material_library import find_material
from warp_mpm.materials import ATMOSPHERE
from warp_mpm.scene import Scene, Wall, Walls

RADIUS = 0.05  # of the ball [m]
SIZE = 5  # of the domain [radii]; its diagonal is 8.7
GAUGES = (4, 5, 6, 7, 8)  # along the diagonal [radii]
PICTURES = 6


def scene(
    *,
    cell_size: float = 6.25e-3,
    particles_per_axis: int = 2,
    charge_particles_per_axis: int = 4,
    end_time: float = 120e-6,
) -> Scene:
    """An octant of a ball of TNT, lit in its center, in air at standard pressure; slip walls on the planes of symmetry.

    Products expand to some 500 times their volume: so that their particles do not become much sparser than cells, the
    charge is cut more finely than the air. Gauges are on the diagonal of the domain, whose other faces are open: the
    gas behind the shock leaves faster than sound, so that nothing comes back from there.
    """
    positive("cell_size", cell_size)
    side = SIZE * RADIUS
    octant, ball = Box((0.0, 0.0, 0.0), (side, side, side)), Sphere((0.0, 0.0, 0.0), RADIUS)

    builder = SceneBuilder("sphere_in_air")
    builder.domain(octant.lower, octant.upper, cell_size=cell_size)
    builder.walls(Walls(x_high=Wall.OPEN, y_high=Wall.OPEN, z_high=Wall.OPEN))
    builder.ambient_pressure(ATMOSPHERE)
    builder.charge(octant & ball, find_material("tnt"), particles_per_axis=charge_particles_per_axis, name="charge")
    builder.charge(octant, find_material("air"), particles_per_axis=particles_per_axis, name="air")
    builder.detonator(PointDetonator((0.0, 0.0, 0.0)))
    diagonal = np.ones(3) / math.sqrt(3.0)
    for radii in GAUGES:
        builder.gauge(radii * RADIUS * diagonal, name=f"at_{radii}_radii")
    builder.line((0.0, 0.0, 0.0), max(GAUGES) * RADIUS * diagonal)
    builder.section(2, 0.0)
    builder.end_time(end_time)
    builder.picture_times(end_time * part / PICTURES for part in range(1, PICTURES + 1))
    return builder.build()
