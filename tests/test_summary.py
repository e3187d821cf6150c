"""The figures of a run from records made up for the purpose: a front of known speed, height and place."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scenes_for_tests import explosive, inert_gas

from warp_mpm.builder import SceneBuilder
from warp_mpm.detonators import PointDetonator
from warp_mpm.geometry import Box
from warp_mpm.output.frame import GaugeRecord, LineRecord, SectionRecord, StepRecord
from warp_mpm.summary import arrival_times, figures_of_merit, lit_explosive

SPEED = 2800.0
DELAY = 2e-6  # [s] of the right detonator
LENGTH = 0.2  # [m]
NO_SECTION = SectionRecord(np.zeros((0, 0)), np.zeros((0, 0)), np.zeros((0, 0)))
MET = LENGTH / 2 + SPEED * DELAY / 2  # where the two fronts meet


def bar():
    """A bar lit at both ends, the right one a little later."""
    builder = SceneBuilder("bar")
    box = Box((0.0, 0.0, 0.0), (LENGTH, 0.01, 0.01))
    builder.domain(box.lower, box.upper, cell_size=0.005)
    builder.charge(box, explosive(), name="bar")
    builder.detonator(PointDetonator((0.0, 0.005, 0.005)))
    builder.detonator(PointDetonator((LENGTH, 0.005, 0.005), time=DELAY))
    builder.front_path((0.0, 0.005, 0.005), (MET, 0.005, 0.005))
    builder.line((0.0, 0.005, 0.005), (LENGTH, 0.005, 0.005))
    builder.collision_point((MET, 0.005, 0.005))
    builder.end_time(MET / SPEED)
    return builder.build()


def front_record(scene, speed, lag, height):
    """A record in which fronts of a speed, `lag` behind the ideal one, rise linearly over three steps to a height."""
    time = np.linspace(0.0, MET / SPEED, 400)
    rise = 3 * time[1]

    def along(segment, count):
        distance = np.linspace(0.0, segment.length, count)
        expected = np.minimum(distance / SPEED, DELAY + (LENGTH - distance) / SPEED)
        arrival = np.minimum(distance / speed, DELAY + (LENGTH - distance) / speed) + lag / speed
        return LineRecord(time, distance, expected, height * np.clip((time[:, None] - arrival) / rise, 0.0, 1.0))

    path, line = along(scene.front_path, 42), along(scene.line, 41)
    return StepRecord(
        time=time,
        dt=np.full(400, time[1]),
        particle_pressure=np.full(400, 1.5 * height),
        field_pressure=line.pressure.max(axis=1),
        path_pressure=np.linspace(0.0, height, 400),
        point_pressures=np.linspace(0.0, 2.4 * height, 400)[:, None],
        path=path,
        line=line,
        section=NO_SECTION,
    )


def test_figures_of_a_known_front():
    """Speed, offset and residual of the fit, pressures, and where the fronts met: as they were put in.

    An arrival is interpolated between two records, and the foot of the rise lies between them: it is off by up to a
    quarter of the way the front runs in that time.
    """
    scene = bar()
    speed, lag, height = 2790.0, 1e-3, 2e9
    figures = figures_of_merit(scene, front_record(scene, speed, lag, height))
    assert figures["p_cj_pa"] == pytest.approx(2.6133e9, rel=1e-4)
    way = MET / 399
    assert figures["front_speed_m_s"] == pytest.approx(speed, rel=0.25 * way / MET)
    assert figures["front_fit_residual_m"] < 0.25 * way
    # At 5 % of p_CJ: a little later than the foot of the rise. The slower wave falls behind over the fitted part.
    threshold = 0.05 * figures["p_cj_pa"] / height * 3 * way
    middle = 0.55 * MET
    assert figures["front_offset_m"] == pytest.approx(
        -(lag + threshold + middle * (1.0 - speed / SPEED)), abs=0.25 * way
    )
    assert figures["front_pressure_pa"] == pytest.approx(0.7 * height, rel=0.01)  # half-way from 50 to 90 %
    assert figures["collision_pressures_pa"] == [pytest.approx(2.4 * height)]
    assert figures["collision_pressure_pa"] == pytest.approx(2.4 * height)
    assert figures["collision_theory_pa"] == pytest.approx(2.443 * figures["p_cj_pa"], rel=3e-4)  # gamma = 2
    assert figures["peak_pressure_pa"] == pytest.approx(height)
    assert figures["max_particle_pressure_pa"] == pytest.approx(1.5 * height)
    assert figures["collision_positions_m"] == [pytest.approx(LENGTH / 2 + speed * DELAY / 2, abs=0.25 * way)]


def test_arrivals_are_interpolated_in_time():
    """Half-way between two records if the threshold is half-way between their pressures; never if it is not met."""
    pressure = np.array([[0.0, 5.0, 0.0], [0.0, 5.0, 0.0], [2.0, 5.0, 0.5]])
    record = LineRecord(np.array([0.0, 1.0, 2.0]), np.arange(3.0), np.full(3, np.nan), pressure)
    np.testing.assert_allclose(arrival_times(record, 1.0), [1.5, 0.0, math.nan])


def test_a_path_that_is_no_ray():
    """Where the front comes aslant, as behind an obstacle, it runs along the path faster than D: its own speed is D."""
    scene = bar()
    time, distance = np.linspace(0.0, MET / SPEED, 400), np.linspace(0.0, scene.front_path.length, 42)
    expected = (0.02 + np.hypot(distance, 0.03)) / SPEED  # from a point beside the path
    pressure = 2e9 * np.clip((time[:, None] - expected - 1e-6) / (3 * time[1]), 0.0, 1.0)
    record = front_record(scene, SPEED, 0.0, 2e9)
    record = replace(record, path=LineRecord(time, distance, expected, pressure))
    figures = figures_of_merit(scene, record)
    assert figures["front_speed_m_s"] == pytest.approx(SPEED, rel=0.5 * time[1] * SPEED / MET)
    assert figures["front_fit_residual_m"] < SPEED * time[1]
    late = SPEED * (1e-6 + 3 * time[1] * 0.05 * figures["p_cj_pa"] / 2e9)
    assert figures["front_offset_m"] == pytest.approx(-late, abs=0.5 * SPEED * time[1])


def test_what_does_not_apply_is_none():
    """Without front path, line and collision points there are no such figures; before it has run far, no speed."""
    builder = SceneBuilder("plain")
    builder.domain((0.0, 0.0, 0.0), (0.1, 0.1, 0.1), cell_size=0.02)
    builder.charge(Box((0.0, 0.0, 0.0), (0.1, 0.1, 0.1)), explosive(), name="block")
    builder.detonator(PointDetonator((0.0, 0.0, 0.0)))
    builder.end_time(1e-5)
    scene = builder.build()
    ones = np.ones(3)
    record = StepRecord(ones, ones, ones, ones, None, np.zeros((3, 0)), None, None, NO_SECTION)
    figures = figures_of_merit(scene, record)
    assert figures["collision_pressures_pa"] == []
    for name in ("front_pressure_pa", "front_speed_m_s", "front_offset_m", "collision_pressure_pa"):
        assert figures[name] is None
    assert lit_explosive(scene) is scene.charges[0].material
    nothing_yet = front_record(bar(), SPEED, 2 * LENGTH, 2e9)
    assert figures_of_merit(bar(), nothing_yet)["front_speed_m_s"] is None


def test_a_front_arrives_in_air_with_half_of_its_rise():
    """0.05 p_CJ in the explosive; beside it half-way from the gauge's first pressure to its highest; or never."""
    builder = SceneBuilder("pair")
    builder.domain((0.0, 0.0, 0.0), (0.2, 0.1, 0.1), cell_size=0.02)
    builder.charge(Box((0.0, 0.0, 0.0), (0.1, 0.1, 0.1)), explosive(), name="charge")
    builder.charge(Box((0.1, 0.0, 0.0), (0.2, 0.1, 0.1)), inert_gas(), name="gas")
    builder.detonator(PointDetonator((0.0, 0.0, 0.0)))
    builder.end_time(1e-5)
    for name, x in (("inside", 0.05), ("beside", 0.15), ("quiet", 0.16)):
        builder.gauge((x, 0.05, 0.05), name=name)
    time, ones = np.arange(3.0), np.ones(3)
    threshold = 0.05 * explosive().cj.pressure
    seen = {"inside": [0.0, 2.0 * threshold, threshold], "beside": [1e5, 1e5, 9e5], "quiet": [1e5, 1.9e5, 1e5]}
    still, nowhere = np.zeros((3, 3)), np.zeros((3, 0))
    gauges = {name: GaugeRecord(time, np.array(p), still, ones, None) for name, p in seen.items()}
    record = StepRecord(time, ones, ones, ones, None, nowhere, None, None, NO_SECTION, gauges)
    figures = figures_of_merit(builder.build(), record)["gauges"]
    arrivals = [figures[name]["arrival_time_s"] for name in seen]
    assert arrivals == [pytest.approx(0.5), pytest.approx(1.5), None]
