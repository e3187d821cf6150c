"""The plate of the paper's two scenes: 200 x 400 x 20 mm of explosive, in a rigid box or in vacuum."""

from typing import Literal

from warp_mpm.builder import SceneBuilder
from warp_mpm.geometry import Box
from warp_mpm.materials import Material
from warp_mpm.scene import Vector, Wall, Walls

Confinement = Literal["rigid", "free"]

WIDTH, HEIGHT, THICKNESS = 0.2, 0.4, 0.02  # x, y, z [m]
BURN_WIDTH = 3.0  # the paper's [cells]


def on_mid_line(y: float) -> Vector:
    """The point at height `y` [m] on the mid-line of the plate."""
    return (WIDTH / 2, y, THICKNESS / 2)


def start_plate(
    name: str,
    material: Material,
    *,
    cell_size: float,
    confinement: Confinement,
    particles_per_axis: int,
    margin: float,
) -> SceneBuilder:
    """Start a scene with the plate in its domain; detonators and end time are the caller's.

    `rigid`: the plate fills a box of slip walls. `free`: vacuum of `margin` [m] all around it, rounded to whole cells,
    so that cells and particles in the plate are the same.

    Raises:
        InputError: a value is not finite or not positive.
    """
    free = confinement == "free"
    plate = Box((0.0, 0.0, 0.0), (WIDTH, HEIGHT, THICKNESS))
    builder = SceneBuilder(name)
    builder.domain(plate.lower, plate.upper, cell_size=cell_size, margins=margin if free else 0.0)
    builder.walls(Walls.all(Wall.OPEN if free else Wall.SLIP))
    builder.charge(plate, material, particles_per_axis=particles_per_axis, name="plate")
    builder.burn_width(BURN_WIDTH)
    builder.line(on_mid_line(0.0), on_mid_line(HEIGHT))
    return builder
