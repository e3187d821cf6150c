"""A slab of TNT lit at a rigid wall: the usual benchmark of MPM detonation codes, with the JWL equation of state."""

from warp_mpm.builder import SceneBuilder
from warp_mpm.checks import mistake, positive
from warp_mpm.detonators import PlaneDetonator
from warp_mpm.geometry import Box
from warp_mpm.material_library import find_material
from warp_mpm.scene import Scene

LENGTH = 0.1  # of the slab along x [m]
PICTURES = 5


def scene(
    *,
    cell_size: float = 0.25e-3,
    material: str = "tnt",
    particles_per_axis: int = 2,
) -> Scene:
    """A slab 100 mm thick, one cubic cell across between slip walls, lit all over one face, which is a rigid wall.

    It ends as the front reaches the other face: what is recorded is the front's way to p_CJ, 21 GPa for TNT; `material`
    is an explosive of the library, by its name.
    """
    explosive = find_material(material)
    if explosive.burn is None:
        raise mistake("material", "an explosive", repr(material), "'warp-mpm materials' lists them")
    speed = explosive.burn.detonation_speed
    edge = LENGTH / max(1, round(LENGTH / positive("cell_size", cell_size)))
    slab = Box((0.0, 0.0, 0.0), (LENGTH, edge, edge))

    builder = SceneBuilder("tnt_slab")
    builder.domain(slab.lower, slab.upper, cell_size=edge)
    builder.charge(slab, explosive, particles_per_axis=particles_per_axis, name="slab")
    builder.detonator(PlaneDetonator((0.0, 0.0, 0.0), normal=(1.0, 0.0, 0.0)))
    builder.front_path((0.0, edge / 2, edge / 2), (LENGTH, edge / 2, edge / 2))
    builder.line((0.0, edge / 2, edge / 2), (LENGTH, edge / 2, edge / 2))
    builder.end_time(LENGTH / speed)
    builder.picture_times(part / PICTURES * LENGTH / speed for part in range(1, PICTURES + 1))
    return builder.build()
