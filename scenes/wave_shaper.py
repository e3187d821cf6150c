"""An inert lens in an explosive: the wave goes around it, and meets behind it."""

from warp_mpm.builder import SceneBuilder
from warp_mpm.checks import positive
from warp_mpm.detonators import LineDetonator
from warp_mpm.geometry import Box, Cylinder
from warp_mpm.material_library import find_material
from warp_mpm.scene import Scene, Wall, Walls

LENGTH, WIDTH = 0.12, 0.1  # of the charge, along x and y [m]
PICTURES = 6


def scene(
    *,
    cell_size: float = 1.25e-3,
    lens_radius: float = 0.02,
    lens_at: float = 0.05,
    particles_per_axis: int = 2,
    end_time: float = 20e-6,
) -> Scene:
    """A slab of TNT, one cell thick between slip walls, lit on the middle of one face, with a rod of water across it.

    The rod, `lens_radius` [m] thick and `lens_at` [m] from the lit face, carries no detonation: arrival times behind it
    are those of the way around.
    """
    edge = positive("cell_size", cell_size)
    explosive, water = find_material("tnt"), find_material("water")
    charge = Box((0.0, -WIDTH / 2, 0.0), (LENGTH, WIDTH / 2, edge))
    lens = Cylinder((lens_at, 0.0, 0.0), (lens_at, 0.0, edge), positive("lens_radius", lens_radius))
    middle = edge / 2

    builder = SceneBuilder("wave_shaper")
    builder.domain(charge.lower, charge.upper, cell_size=cell_size)
    builder.walls(Walls(x_low=Wall.OPEN, x_high=Wall.OPEN))
    builder.charge(charge - lens, explosive, particles_per_axis=particles_per_axis, name="explosive")
    builder.charge(lens, water, particles_per_axis=particles_per_axis, name="lens")
    builder.detonator(LineDetonator((0.0, 0.0, 0.0), (0.0, 0.0, edge)))
    builder.front_path((0.0, 0.0, middle), (lens_at - lens_radius, 0.0, middle))
    builder.line((0.0, 0.0, middle), (LENGTH, 0.0, middle))
    builder.gauge((LENGTH - edge, 0.0, middle), name="behind")
    builder.gauge((LENGTH - edge, WIDTH / 3, middle), name="beside")
    builder.end_time(end_time)
    builder.picture_times(end_time * part / PICTURES for part in range(1, PICTURES + 1))
    return builder.build()
