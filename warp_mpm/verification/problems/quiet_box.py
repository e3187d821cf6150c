"""A closed box for a millisecond: detonation products must come to rest, and not grow noisy."""

from dataclasses import replace

import numpy as np

from warp_mpm.config import SolverConfig, Transfer
from warp_mpm.exact.taylor_wave import PlanarTaylorWave
from warp_mpm.result import Result
from warp_mpm.scene import Scene
from warp_mpm.scene_loading import load_scene
from warp_mpm.verification.problem import (
    PRESSURE,
    TIME,
    Axis,
    Bound,
    Curve,
    Level,
    Measurement,
    Panel,
    Problem,
    ladder,
)
from warp_mpm.verification.problems._taylor import DENSITY, GAMMA, SPEED

WIDTH, HEIGHT = 0.2, 0.4  # of the box [m]
END = 1e-3  # [s]
EARLY = 200e-6  # [s] from which on the wall peak is looked for: the fronts have met at 71 us
BURNT = 150e-6  # [s] by which all has burnt and the first reflections are through
SETTLED = 600e-6  # [s] from which on the highest particle is looked for
LOOKS = 2e-6  # between two looks at the section [s]
DAMPED, PLAIN = {"plain_flip": 0.0}, {"plain_flip": 1.0}
CJ_PRESSURE = PlanarTaylorWave(GAMMA, DENSITY, SPEED).cj_pressure


class QuietBox(Problem):
    """The shipped scene two_point in its rigid box."""

    name = "quiet_box"
    title = "A closed box for a millisecond"
    statement = (
        "The scene two_point in its rigid box, until 1 ms. Waves run to and fro and die out; at rest the pressure is "
        "rho0 E0 = p_CJ / 2. 'volume_error' is the particles' volume over the box's, less one; 'pressure_spread' "
        "the standard deviation of the particles' pressure over its mean at the end, 'field_spread' that of the field, "
        "which is sound; 'late_particle_p_cj' the highest particle after 600 us. 'early_peak' is the highest field "
        "pressure after 200 us, with its time and its distances from the nearest side wall and from the plane where "
        "the fronts met: where these are the same at all cell sizes, it is focused shocks and not noise. plain_flip=1 "
        "is the same without the conservative damping."
    )
    reference = "conservation of volume and energy"
    cells_across = "the height, 0.4 m"
    levels = ladder(67, **DAMPED)  # 6 mm
    more_levels = (*ladder(100, 133, **DAMPED), *ladder(67, 100, 133, **PLAIN))  # 4 and 3 mm
    panels = (
        Panel("peak", TIME, PRESSURE._replace(label="highest field pressure")),
        Panel("spread", TIME, Axis("spread of the section's pressure")),
    )
    bounds = (
        Bound("volume_error", low=-1e-3, high=1e-3, why="within 0.1 % of the box", from_cells=67, settings=DAMPED),
        Bound("pressure_spread", high=0.1, why="gas at rest has one pressure", from_cells=67, settings=DAMPED),
    )

    def scene(self, level: Level) -> Scene:
        """With pictures of the section at short intervals, in which the early peak is looked for."""
        scene = load_scene("two_point", cell_size=HEIGHT / level.cells, end_time=END)
        return replace(scene, picture_times=tuple(np.arange(0.0, END, LOOKS).tolist()))

    def solver_config(self, config: SolverConfig, level: Level) -> SolverConfig:
        """Plain FLIP where the level says so."""
        return replace(config, transfer=Transfer.FLIP) if level.settings["plain_flip"] else config

    def measure(self, level: Level, result: Result) -> Measurement:
        """Volume, spread, late and early peaks."""
        record, summary = result.record, result.summary
        late = record.particle_pressure[record.time >= SETTLED]
        looks = np.array([picture.time for picture in result.pictures])
        spread = np.array([picture.pressure.std() / max(picture.pressure.mean(), 1.0) for picture in result.pictures])
        field = result.state.field_pressure().astype(np.float64)
        burnt = looks >= BURNT  # before that the spread is that of a detonation
        return Measurement(
            figures={
                "volume_error": summary["particle_volume_error"],
                "pressure_spread": summary["pressure_spread"],
                "field_spread": float(field.std() / field.mean()),
                "late_particle_p_cj": float(late.max()) / CJ_PRESSURE,
                **early_peak(result),
            },
            curves={"peak": Curve(record.time, record.field_pressure), "spread": Curve(looks[burnt], spread[burnt])},
        )


def early_peak(result: Result) -> dict[str, float]:
    """The highest field pressure after `EARLY`: how high, when and where, mirror images taken as one."""
    record, scene = result.record, result.state.model.scene
    step = int(np.argmax(np.where(record.time >= EARLY, record.field_pressure, 0.0)))
    peak, time = float(record.field_pressure[step]), float(record.time[step])
    near = [picture.pressure for picture in result.pictures if abs(picture.time - time) <= 2.0 * LOOKS]
    section = max(near, key=np.max)
    place = np.unravel_index(np.argmax(section), section.shape)
    side, middle = (
        place[number] / (section.shape[number] - 1) * (scene.domain.upper[axis] - scene.domain.lower[axis])
        for number, axis in enumerate(scene.section.in_plane)
    )
    return {
        "early_peak_p_cj": peak / CJ_PRESSURE,
        "early_peak_time_s": time,
        "early_peak_from_side_m": float(min(side, WIDTH - side)),
        "early_peak_from_middle_m": float(abs(middle - HEIGHT / 2)),
    }


PROBLEMS = (QuietBox(),)
