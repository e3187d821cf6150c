"""Six fronts, lit one after the other: the paper's plate with six delayed detonators on its mid-line."""

from itertools import pairwise
from typing import Literal

from warp_mpm.detonators import PointDetonator
from warp_mpm.materials import OnMismatch, ammonium_nitrate
from warp_mpm.scene import Scene
from warp_mpm.scenes._plate import Confinement, on_mid_line, start_plate

HEIGHTS = (0.0, 0.08, 0.16, 0.24, 0.32, 0.4)  # of the detonators [m]
DELAY = 0.5e-6  # of each after the one below it [s]
PICTURE_TIMES = (5e-6, 10e-6, 15e-6, 25e-6, 40e-6, 60e-6)  # [s]


def scene(
    *,
    cell_size: float = 3e-3,
    confinement: Confinement = "rigid",
    energy: float | Literal["cj"] = "cj",
    on_mismatch: Literal["adjust", "keep"] = "adjust",
    particles_per_axis: int = 2,
    margin: float = 0.15,
    end_time: float = 100e-6,
) -> Scene:
    """Six fronts, lit from bottom to top; each pair of neighbors meets a little above the point half-way."""
    material = ammonium_nitrate(energy=energy, on_mismatch=OnMismatch(on_mismatch))
    builder = start_plate(
        "six_point",
        material,
        cell_size=cell_size,
        confinement=confinement,
        particles_per_axis=particles_per_axis,
        margin=margin,
    )
    for number, y in enumerate(HEIGHTS):
        builder.detonator(PointDetonator(on_mid_line(y), time=number * DELAY))
    for below, above in pairwise(HEIGHTS):  # the lower front has run for DELAY when the upper one starts
        builder.collision_point(on_mid_line((below + above) / 2 + material.burn.detonation_speed * DELAY / 2))
    builder.front_path(on_mid_line(0.0), on_mid_line(0.04))
    builder.section(axis=2, coordinate=on_mid_line(0.0)[2])
    builder.end_time(end_time)
    builder.picture_times(time for time in PICTURE_TIMES if time <= end_time)
    return builder.build()
