"""A plane front with the Taylor wave behind it: a one-dimensional column, for comparison with the exact solution."""

from warp_mpm.builder import SceneBuilder
from warp_mpm.checks import positive
from warp_mpm.detonators import PlaneDetonator
from warp_mpm.geometry import Box
from warp_mpm.materials import ammonium_nitrate
from warp_mpm.scene import Scene, Wall, Walls

LENGTH = 0.4  # of the column along x [m]
RUN = 0.3  # of the front until the end [m]
SPARE_CELLS = 4  # of room beyond what the gas reaches


def scene(*, cell_size: float = 3e-3, particles_per_axis: int = 2) -> Scene:
    """A column of the paper's explosive, lit all over its free rear face; one cubic cell across between slip walls."""
    explosive = ammonium_nitrate()
    speed = explosive.burn.detonation_speed
    edge = LENGTH / max(1, round(LENGTH / positive("cell_size", cell_size)))
    column = Box((0.0, 0.0, 0.0), (LENGTH, edge, edge))
    room = RUN + SPARE_CELLS * edge  # into a vacuum the products escape backwards as fast as the front runs

    builder = SceneBuilder("taylor_wave")
    builder.domain(column.lower, column.upper, cell_size=edge, margins=(room, 0.0, 0.0, 0.0, 0.0, 0.0))
    builder.walls(Walls(x_low=Wall.OPEN))
    builder.charge(column, explosive, particles_per_axis=particles_per_axis, name="column")
    builder.detonator(PlaneDetonator((0.0, 0.0, 0.0), normal=(1.0, 0.0, 0.0)))
    builder.front_path((0.0, edge / 2, edge / 2), (RUN, edge / 2, edge / 2))
    builder.line((0.0, edge / 2, edge / 2), (LENGTH, edge / 2, edge / 2))
    builder.end_time(RUN / speed)
    builder.picture_times(part / 6 * RUN / speed for part in range(1, 7))
    return builder.build()
