"""Plates of metal that meet: pressure, velocity and density between them, and the shock, are those of the Hugoniots."""

from typing import NamedTuple

import numpy as np
import pytest

import warp_mpm as mpm


class Metal(NamedTuple):
    """A Hugoniot U = c + s u."""

    density: float  # [kg/m3]
    sound_speed: float  # c [m/s]
    slope: float  # s

    def pressure(self, velocity):
        """Behind the shock that brings matter at rest to a velocity [m/s]."""
        return self.density * self.shock_speed(velocity) * velocity

    def shock_speed(self, velocity):
        """Of that shock [m/s]."""
        return self.sound_speed + self.slope * velocity


# About those of copper and of stainless steel.
COPPER = Metal(8930.0, 3940.0, 1.489)
STEEL = Metal(7890.0, 4569.0, 1.490)
CELL = 2e-4  # [m]
PLATE = 60  # cells that each is thick
SPEED = 740.0  # at which the copper comes [m/s]: what a layer of explosive gives it


@pytest.fixture(scope="module")
def base():
    """What matter of the steel sees, 15 cells and 30 cells behind the face on which the copper strikes."""
    builder = mpm.SceneBuilder("impact")
    middle = PLATE * CELL
    builder.domain((0.0, 0.0, 0.0), (2.5 * middle, CELL, CELL), cell_size=CELL)
    builder.walls(mpm.Walls(x_low=mpm.Wall.OPEN, x_high=mpm.Wall.OPEN))
    for metal, low, velocity in ((COPPER, 0.0, (SPEED, 0.0, 0.0)), (STEEL, middle, None)):
        law = mpm.MieGruneisen(*metal, gruneisen=2.0)
        material = mpm.inert("metal", density=metal.density, equation_of_state=law)
        builder.charge(mpm.Box((low, 0.0, 0.0), (low + middle, CELL, CELL)), material, velocity=velocity)
    for cells in (15, 30):
        builder.gauge((middle + cells * CELL, CELL / 2, CELL / 2), name=f"at_{cells}", moving=True)
    builder.end_time(2.6e-6)  # the shock is through the steel, and what comes back is not yet half-way
    return mpm.simulate(builder.build(), device="cpu", threads=1).record.gauges


def met():
    """Velocity [m/s] of the faces that have met: that at which both Hugoniots have the same pressure."""
    velocities = np.linspace(0.0, SPEED, 100_001)
    return velocities[np.argmin(np.abs(COPPER.pressure(SPEED - velocities) - STEEL.pressure(velocities)))]


def test_pressure_velocity_and_density_behind_the_shock(base):
    """Means over the plateau, which rings by 8 % (docs/numerics.md) around what is right."""
    gauge, velocity = base["at_15"], met()
    passing = gauge.time[np.argmax(gauge.pressure > 0.5 * gauge.pressure.max())]
    behind = (gauge.time > passing + 0.3e-6) & (gauge.time < passing + 1.9e-6)
    swing = 0.01  # of means over a microsecond, by where it begins
    assert gauge.velocity[behind, 0].mean() == pytest.approx(velocity, rel=swing)
    assert gauge.pressure[behind].mean() == pytest.approx(STEEL.pressure(velocity), rel=swing)
    density = STEEL.density / (1.0 - velocity / STEEL.shock_speed(velocity))
    assert gauge.density[behind].mean() == pytest.approx(density, rel=0.002)


def test_speed_of_the_shock(base):
    """Between two gauges 15 cells apart; a step is a fiftieth of the way."""
    passing = [gauge.time[np.argmax(gauge.pressure > 0.5 * gauge.pressure.max())] for gauge in base.values()]
    assert 15 * CELL / (passing[1] - passing[0]) == pytest.approx(STEEL.shock_speed(met()), rel=0.03)
