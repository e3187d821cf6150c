"""Two fronts meet: the paper's plate, lit at both ends of its mid-line at once (Wang et al. 2015)."""

from typing import Literal

from warp_mpm.detonators import PointDetonator
from warp_mpm.materials import OnMismatch, ammonium_nitrate
from warp_mpm.scene import Scene
from warp_mpm.scenes._plate import HEIGHT, THICKNESS, Confinement, on_mid_line, start_plate

PICTURE_TIMES = (20e-6, 40e-6, 60e-6, 75e-6, 90e-6, 143e-6)  # [s]


def scene(
    *,
    cell_size: float = 3e-3,
    confinement: Confinement = "rigid",
    energy: float | Literal["cj"] = "cj",
    on_mismatch: Literal["adjust", "keep"] = "adjust",
    particles_per_axis: int = 2,
    margin: float = 0.15,
    end_time: float = 143e-6,
) -> Scene:
    """Two fronts run towards each other along the mid-line and meet half-way."""
    builder = start_plate(
        "two_point",
        ammonium_nitrate(energy=energy, on_mismatch=OnMismatch(on_mismatch)),
        cell_size=cell_size,
        confinement=confinement,
        particles_per_axis=particles_per_axis,
        margin=margin,
    )
    for y in (0.0, HEIGHT):
        builder.detonator(PointDetonator(on_mid_line(y)))
    builder.front_path(on_mid_line(0.0), on_mid_line(HEIGHT / 2))
    builder.collision_point(on_mid_line(HEIGHT / 2))
    builder.gauge(on_mid_line(HEIGHT / 4), name="quarter")
    builder.gauge(on_mid_line(HEIGHT / 4), name="quarter_moving", moving=True)
    builder.gauge(on_mid_line(HEIGHT / 2), name="collision")
    builder.gauge((0.0, HEIGHT / 4, THICKNESS / 2), name="side")
    builder.gauge((0.0, HEIGHT / 2, THICKNESS / 2), name="corner")  # where side and collision plane meet
    builder.end_time(end_time)
    builder.picture_times(time for time in PICTURE_TIMES if time <= end_time)
    return builder.build()
