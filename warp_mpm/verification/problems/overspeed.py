"""Fronts that are driven faster than their energy would drive them: the plateau behind them."""

from collections.abc import Mapping

import numpy as np

from warp_mpm.builder import SceneBuilder
from warp_mpm.detonators import PlaneDetonator
from warp_mpm.exact.burn_zone import BurnZone
from warp_mpm.geometry import Box
from warp_mpm.materials import OnMismatch, ammonium_nitrate
from warp_mpm.result import Result
from warp_mpm.scene import Scene, Wall, Walls
from warp_mpm.verification.fields import cell_pressure
from warp_mpm.verification.norms import mean_and_scatter
from warp_mpm.verification.problem import (
    DISTANCE,
    PRESSURE,
    Bound,
    Curve,
    Level,
    Measurement,
    Panel,
    Problem,
    ladder,
)
from warp_mpm.verification.problems._taylor import DENSITY, GAMMA, SPEED, front_end

RUN = 0.4  # of the front [m]
SPEEDS = (1.01, 1.02, 1.05)  # D over the Chapman-Jouguet speed of the energy
SHOWN_FROM = 0.4 * RUN  # [m] in the picture
BEHIND_HEAD, BEHIND_FRONT = 3, 8  # cells of the plateau that are left to the fan's head, and to the burn zone


class Overspeed(Problem):
    """A column with a free rear face for each speed."""

    name = "overspeed"
    title = "Fronts faster than their energy"
    statement = (
        "The front is driven at d times the Chapman-Jouguet speed of its energy. Then p = d^2 (1 - sqrt(1 - 1 / d^2)) "
        "p_CJ right behind it, whatever the resolution and gamma: 0.877, 0.835 and 0.766 p_CJ at d = 1.01, 1.02 and "
        "1.05. The plateau reaches from the head of the fan, which is slower, to the front. Judged from 3 cells ahead "
        "of the fan's head to 8 cells behind the front, after 400 cells."
    )
    reference = "Fickett and Davis, Detonation, section 2A (weak branch); derived in warp_mpm/exact/burn_zone.py"
    cells_across = "the run"
    levels = tuple(level for speed in SPEEDS for level in ladder(400, overspeed=speed))
    more_levels = tuple(level for speed in SPEEDS for level in ladder(800, overspeed=speed))
    panels = (Panel("pressure", DISTANCE, PRESSURE),)
    bounds = (Bound("plateau_deviation", low=-0.01, high=0.01, from_cells=400, why="mean within 1 % of the law"),)

    def scene(self, level: Level) -> Scene:
        """One cell across; the energy is too low for the speed."""
        cell, overspeed = RUN / level.cells, level.settings["overspeed"]
        energy = (SPEED / overspeed) ** 2 / (2.0 * (GAMMA**2 - 1.0))
        end = front_end(level.cells) * cell
        builder = SceneBuilder(self.name)
        builder.domain((0.0, 0.0, 0.0), (end, cell, cell), cell_size=cell, margins=(RUN, 0.0, 0.0, 0.0, 0.0, 0.0))
        builder.walls(Walls(x_low=Wall.OPEN))
        builder.charge(
            Box((0.0, 0.0, 0.0), (end, cell, cell)), ammonium_nitrate(energy=energy, on_mismatch=OnMismatch.KEEP)
        )
        builder.detonator(PlaneDetonator((0.0, 0.0, 0.0), normal=(1.0, 0.0, 0.0)))
        builder.end_time(RUN / SPEED)
        return builder.build()

    def measure(self, level: Level, result: Result) -> Measurement:
        """Mean and scatter of the plateau."""
        domain, time = result.state.model.scene.domain, result.summary["end_time_s"]
        zone, cell = zone_of(level), domain.spacing[0]
        place, pressure = domain.centres(0), cell_pressure(result.state).mean(axis=(1, 2))
        begin, end = zone.fan_head_speed * time + BEHIND_HEAD * cell, SPEED * time - BEHIND_FRONT * cell
        plateau = (place > begin) & (place < end)
        mean, scatter = mean_and_scatter(pressure[plateau])
        return Measurement(
            figures={
                "plateau_p_cj": mean / zone.cj_state.pressure,
                "plateau_deviation": mean / zone.end_pressure - 1.0,
                "plateau_scatter": scatter,
                "plateau_cells": float(plateau.sum()),
            },
            curves={"pressure": Curve(place[place > SHOWN_FROM], pressure[place > SHOWN_FROM])},
        )

    def exact_curves(self, level: Level) -> Mapping[str, Curve]:
        """The plateau."""
        zone = zone_of(level)
        ends = np.array([zone.fan_head_speed / SPEED, 1.0]) * RUN
        return {"pressure": Curve(ends, np.full(2, zone.end_pressure))}


def zone_of(level: Level) -> BurnZone:
    """The exact front; the plateau behind it does not depend on its width."""
    return BurnZone(GAMMA, DENSITY, SPEED, width=RUN / level.cells, overspeed=level.settings["overspeed"])


PROBLEMS = (Overspeed(),)
