"""A row of charges in water, lit one after the other: shocks run through charges that are not lit yet."""

from warp_mpm.builder import SceneBuilder
from warp_mpm.checks import count, not_negative, positive
from warp_mpm.detonators import LineDetonator
from warp_mpm.geometry import Box, Cylinder
from warp_mpm.kernels.eos.mie_gruneisen import MieGruneisen
from warp_mpm.material_library import find_material
from warp_mpm.materials import ATMOSPHERE
from warp_mpm.scene import Scene, Wall, Walls

RADIUS = 0.015  # of a charge [m]
SPACING = 0.12  # from axis to axis [m]
ROOM = 0.1  # of water beside the outer ones, and across [m]
SHOWN = (6e-6, 25e-6)  # after each detonator: instants worth a picture [s]

# Hugoniot of pressed TNT: N. L. Coleburn, T. P. Liddiard, J. Chem. Phys. 44 (1966) 1929.
UNREACTED = MieGruneisen(density=1630.0, sound_speed=2390.0, slope=2.05, gruneisen=0.9)


def scene(
    *,
    cell_size: float = 2e-3,
    charges: int = 3,
    delay: float = 50e-6,
    resists: bool = True,
    particles_per_axis: int = 2,
    end_time: float = 150e-6,
) -> Scene:
    """Rods of TNT side by side in water, one cell of their length between slip walls; the half on one side of the row.

    Each is lit on its axis, `delay` [s] after the one before. The shock of the first comes to the second after some 40
    us: what is not lit by then needs its unreacted state, and without it (`resists`) that is an error.
    """
    edge = positive("cell_size", cell_size)
    explosive = find_material("tnt", unreacted=UNREACTED if resists else None)
    box = Box((-ROOM, 0.0, 0.0), ((count("charges", charges) - 1) * SPACING + ROOM, ROOM, edge))

    builder = SceneBuilder("row_of_charges")
    builder.domain(box.lower, box.upper, cell_size=cell_size)
    builder.walls(Walls(x_low=Wall.OPEN, x_high=Wall.OPEN, y_high=Wall.OPEN))
    builder.ambient_pressure(ATMOSPHERE)
    for number in range(charges):
        place = number * SPACING
        name = f"charge_{number + 1}"
        rod = Cylinder((place, 0.0, 0.0), (place, 0.0, edge), RADIUS)
        builder.charge(box & rod, explosive, particles_per_axis=particles_per_axis, name=name)
        lit = number * not_negative("delay", delay)
        builder.detonator(LineDetonator((place, 0.0, 0.0), (place, 0.0, edge), time=lit, charges=(name,)))
        builder.gauge((place, 3.0 * RADIUS, edge / 2), name=f"beside_{number + 1}")
    builder.charge(box, find_material("water"), particles_per_axis=particles_per_axis, name="water")
    builder.line((-ROOM, 0.0, edge / 2), (box.upper[0], 0.0, edge / 2))
    builder.gauge((SPACING / 4, 0.0, edge / 2), name="near")
    builder.gauge((SPACING / 2, 0.0, edge / 2), name="middle")
    builder.end_time(end_time)
    instants = {number * delay + shown for number in range(charges) for shown in SHOWN}
    builder.picture_times(sorted(time for time in instants if time <= end_time))
    return builder.build()
