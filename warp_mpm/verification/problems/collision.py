"""Head-on collision of two plane fronts, and reflection of one from a rigid wall: the pressure at the plane."""

from collections.abc import Mapping, Sequence

import numpy as np

from warp_mpm.builder import SceneBuilder
from warp_mpm.detonators import PlaneDetonator
from warp_mpm.exact.collision import PlaneCollision
from warp_mpm.geometry import Box
from warp_mpm.materials import ammonium_nitrate
from warp_mpm.output.frame import LineRecord
from warp_mpm.result import Result
from warp_mpm.scene import Scene, Wall, Walls
from warp_mpm.verification.problem import (
    PRESSURE,
    Axis,
    Bound,
    Curve,
    Level,
    LevelResult,
    Measurement,
    Panel,
    Problem,
    ladder,
)
from warp_mpm.verification.problems._taylor import DENSITY, GAMMA, SPEED

RUN = 0.1  # of each front [m]
EXACT = PlaneCollision(GAMMA, DENSITY, SPEED, RUN)
PRESSURE_TIMES = (0.1, 0.2, 0.5)  # [run times] after contact
IMPULSE_TIMES = (0.5, 1.0)
SINCE_CONTACT = Axis("time since contact", "us", 1e-6)
LAST_TIME = 1.2  # [run times] after contact, when the simulation ends


def _within(deviation: float, name: str, times: tuple[float, ...], from_cells: int) -> tuple[Bound, ...]:
    """Bounds on a relative deviation at several times."""
    why = f"{name} within {100 * deviation:g} % of exact"
    return tuple(Bound(f"{name}_{time:g}", -deviation, deviation, why, from_cells) for time in times)


class Collision(Problem):
    """Two halves, or one half and a slip wall where the other would begin. The rear ends are free."""

    name = "collision"
    title = "Head-on collision of two plane fronts (halves=2), and reflection from a rigid wall (halves=1)"
    statement = (
        "Two plane fronts start at free ends, run 100 mm and meet head-on; or one meets a rigid wall. The plane sees "
        "2.443 p_CJ at contact, and 1.845, 1.434, 0.766 p_CJ 0.1, 0.2, 0.5 run times later. Time counts from when the "
        "computed pressure at the plane first reaches half its own peak, 'delay' after the exact contact. 'p_...' and "
        "'impulse_...' are relative deviations from exact; what the plane got before that instant is in the impulse. "
        "The peak is not judged: two smeared fronts collide inside the burn zone, and it tends to 2.63 p_CJ."
    )
    reference = (
        "K. P. Stanyukovich, Unsteady Motion of Continuous Media, 1960; shock fitting in warp_mpm/exact/collision.py"
    )
    cells_across = "a half"
    levels = (*ladder(50, 100, halves=2), *ladder(50, 100, halves=1))
    more_levels = (*ladder(200, halves=2), *ladder(200, halves=1))
    panels = (
        Panel("pressure", SINCE_CONTACT, PRESSURE),
        Panel("impulse", SINCE_CONTACT, Axis("impulse per area", "kPa s", 1e3)),
    )
    bounds = (
        *_within(0.05, "p", PRESSURE_TIMES, from_cells=50),
        *_within(0.03, "p", PRESSURE_TIMES, from_cells=100),
        *_within(0.05, "impulse", IMPULSE_TIMES, from_cells=50),
        *_within(0.02, "impulse", IMPULSE_TIMES, from_cells=100),
        Bound("halves_apart", high=3e-3, why="a slip wall is an exact mirror, but noise grows from round-off"),
    )

    def scene(self, level: Level) -> Scene:
        """One cell across, with room behind the free ends for all the time; the plane is at x = RUN."""
        cell = RUN / level.cells
        halves = int(level.settings["halves"])
        end = halves * RUN
        room = (2.0 + LAST_TIME) * RUN
        builder = SceneBuilder(self.name)
        rooms = (room, (halves - 1) * room, 0.0, 0.0, 0.0, 0.0)
        builder.domain((0.0, 0.0, 0.0), (end, cell, cell), cell_size=cell, margins=rooms)
        builder.walls(Walls(x_low=Wall.OPEN, x_high=Wall.OPEN if halves == 2 else Wall.SLIP))
        builder.charge(Box((0.0, 0.0, 0.0), (end, cell, cell)), ammonium_nitrate())
        for rear in (0.0, end)[:halves]:
            builder.detonator(PlaneDetonator((rear, 0.0, 0.0), normal=(1.0, 0.0, 0.0)))
        builder.line((RUN, cell / 2, cell / 2), (RUN - cell, cell / 2, cell / 2))
        builder.end_time((1.0 + LAST_TIME) * RUN / SPEED)
        return builder.build()

    def measure(self, level: Level, result: Result) -> Measurement:
        """The gauge at the plane against the exact pressure and impulse, at the same times after contact."""
        record = result.record.line
        assert record is not None  # the scene has a line
        since, pressure, delay = since_half_rise(record)
        impulse = np.concatenate([[0.0], np.cumsum(0.5 * (pressure[1:] + pressure[:-1]) * np.diff(since))])
        figures = {
            "delay_run_times": delay / EXACT.run_time,
            "peak_p_cj": float(pressure.max()) / EXACT.cj_state.pressure,
        }
        for name, times, computed, exact in (
            ("p", PRESSURE_TIMES, pressure, EXACT.plane_pressure),
            ("impulse", IMPULSE_TIMES, impulse, EXACT.impulse),
        ):
            for later in times:
                time = later * EXACT.run_time
                figures[f"{name}_{later:g}"] = float(np.interp(time, since, computed) / exact(np.array(time))) - 1.0
        shown = since > -0.1 * EXACT.run_time
        curves = {"pressure": Curve(since[shown], pressure[shown]), "impulse": Curve(since[shown], impulse[shown])}
        return Measurement(figures=figures, curves=curves)

    def exact_curves(self, level: Level) -> Mapping[str, Curve]:
        """Pressure and impulse at the plane since contact."""
        time = np.linspace(0.0, LAST_TIME * EXACT.run_time, 500)
        pressure = Curve(np.append(0.0, time), np.append(0.0, EXACT.plane_pressure(time)))
        return {"pressure": pressure, "impulse": Curve(time, EXACT.impulse(time))}

    def overall(self, results: Sequence[LevelResult]) -> Mapping[str, float]:
        """How far the two cases are apart in any figure that is judged, at equal resolution."""
        judged = {bound.figure for bound in self.bounds}
        figures: dict[int, list[Mapping[str, float]]] = {}
        for result in results:
            figures.setdefault(result.level.cells, []).append(result.measurement.figures)
        pairs = [pair for pair in figures.values() if len(pair) == 2]
        apart = [abs(one[name] - two[name]) for one, two in pairs for name in judged.intersection(one)]
        return {"halves_apart": max(apart)} if apart else {}


def since_half_rise(record: LineRecord) -> tuple[np.ndarray, np.ndarray, float]:
    """Time since the pressure at the line's start first reached half its peak (steps,) [s], and that pressure [Pa].

    The third value is how much later than the exact contact that instant was [s].
    """
    pressure = record.pressure[:, 0].astype(np.float64)
    half = 0.5 * pressure.max()
    after = int(np.argmax(pressure >= half))
    low, high = pressure[after - 1], pressure[after]
    share = (half - low) / (high - low)
    rise = record.time[after - 1] + share * (record.time[after] - record.time[after - 1])
    return record.time - rise, pressure, float(rise) - EXACT.run_time


PROBLEMS = (Collision(),)
