"""Arrival times: the delayed minimum over the detonators that light a charge, and boosters at their own time.

Source: paper, section 2.3; t_b = min over detonators of (t_i + distance / D). A well-known blast code takes the nearest
detonator instead, whatever its delay.

Times are single precision: those here, up to 100 us, carry a rounding of the time, and of the distance over D.
"""

import numpy as np
import pytest
from scenes_for_tests import CELL, ROUND_OFF, block, explosive, start

from warp_mpm.builder import SceneBuilder
from warp_mpm.detonators import PlaneDetonator, PointDetonator
from warp_mpm.geometry import Box
from warp_mpm.kernels.eos.ideal_gas import IdealGas
from warp_mpm.kernels.precision import NEVER
from warp_mpm.materials import ammonium_nitrate
from warp_mpm.materials import explosive as make_explosive

SPEED = 2800.0
EXACT = 4 * ROUND_OFF * 100e-6  # [s]
CELLS = (20, 6, 4)
DELAYED = [
    PointDetonator((0.0, 0.03, 0.02), time=0.0),
    PointDetonator((0.2, 0.03, 0.02), time=30e-6),
    PointDetonator((0.1, 0.0, 0.0), time=25e-6),  # the wave has run 70 mm when it comes, and has 2 mm to go
]


def arrival(detonators, cells=CELLS, device="cpu"):
    """Places (n, 3), arrival times (n,) and booster times (n,) of the particles of a block."""
    state = start(block(cells, detonators=detonators), device).state
    place = np.concatenate([charge.positions for charge in state.model.scene.charges])
    return place, state.field("arrival_time").astype(np.float64), state.field("booster_time").astype(np.float64)


def delays(place, detonators):
    """t_i + |x - x_i| / D for each detonator (detonators, n)."""
    return np.array([d.time + np.linalg.norm(place - d.position, axis=1) / SPEED for d in detonators])


def test_several_delayed_detonators(device):
    """The delayed minimum, where it is not the nearest detonator's too; and a detonator that comes too late."""
    place, times, _ = arrival(DELAYED, device=device)
    candidates = delays(place, DELAYED)
    np.testing.assert_allclose(times, candidates.min(axis=0), rtol=0, atol=EXACT)
    nearest = np.array([np.linalg.norm(place - d.position, axis=1) for d in DELAYED]).argmin(axis=0)
    first = candidates.argmin(axis=0)
    assert np.any(nearest != first)
    assert set(first) == {0, 1, 2}
    too_late = [*DELAYED, PointDetonator((0.1, 0.06, 0.04), time=99e-6)]
    _, unchanged, _ = arrival(too_late, device=device)
    np.testing.assert_array_equal(unchanged, times)


def test_detonators_do_not_depend_on_their_order(device):
    _, times, boosters = arrival(DELAYED, device=device)
    _, reversed_times, reversed_boosters = arrival(DELAYED[::-1], device=device)
    np.testing.assert_array_equal(times, reversed_times)
    np.testing.assert_array_equal(boosters, reversed_boosters)


@pytest.mark.parametrize("normal", [(1.0, 0.0, 0.0), (-2.0, 0.0, 0.0), (3.0, 4.0, 0.0)])
def test_plane_detonators(normal, device):
    """A plane wave runs both ways from its plane: t = t_i + |n . (x - x_i)| / D with the unit normal n; no booster."""
    detonators = [PlaneDetonator((0.08, 0.03, 0.0), normal, time=2e-6)]
    place, times, boosters = arrival(detonators, device=device)
    distance = np.abs((place - detonators[0].position) @ np.array(normal)) / np.linalg.norm(normal)
    np.testing.assert_allclose(times, 2e-6 + distance / SPEED, rtol=0, atol=EXACT)
    assert np.all(boosters == np.float32(float(NEVER)))


def test_points_and_planes_together(device):
    point, plane = PointDetonator((0.0, 0.03, 0.02)), PlaneDetonator((0.2, 0.0, 0.0), (1.0, 0.0, 0.0), time=20e-6)
    place, times, _ = arrival([plane, point], device=device)
    expected = np.minimum(20e-6 + np.abs(place[:, 0] - 0.2) / SPEED, delays(place, [point])[0])
    np.testing.assert_allclose(times, expected, rtol=0, atol=EXACT)


def test_boosters_have_their_own_detonators_time(device):
    """Within a cell of a point detonator the booster burns from that detonator's time on, the earlier of two."""
    detonators = [
        PointDetonator((0.05, 0.03, 0.02), time=3e-6),
        PointDetonator((0.06, 0.03, 0.02), time=1e-6),  # a cell away: their boosters overlap
        PointDetonator((0.15, 0.03, 0.02), time=5e-6, booster=False),
    ]
    place, _, boosters = arrival(detonators, device=device)
    expected = np.full(len(place), float(NEVER))
    for detonator in (detonators[0], detonators[1]):
        inside = np.linalg.norm(place - detonator.position, axis=1) <= CELL
        assert inside.any()
        expected[inside] = np.minimum(expected[inside], detonator.time)
    np.testing.assert_allclose(boosters, expected, rtol=2 * ROUND_OFF)


def two_charges(*detonators):
    """Two explosives of different speeds, 20 mm of room between them, and a domain that does not start at zero."""
    builder = SceneBuilder("two")
    builder.domain((-0.1, 0.0, 0.0), (0.14, 0.04, 0.04), cell_size=CELL)
    builder.charge(Box((-0.1, 0.0, 0.0), (0.0, 0.04, 0.04)), explosive(), name="slow")
    fast = make_explosive("fast", density=1500.0, detonation_speed=7000.0, equation_of_state=IdealGas(3.0))
    builder.charge(Box((0.02, 0.0, 0.0), (0.14, 0.04, 0.04)), fast, name="fast", particles_per_axis=3)
    for detonator in detonators:
        builder.detonator(detonator)
    builder.end_time(1e-6)  # before the wave of either comes to the other, which has no pressure until it burns
    return builder.build()


def test_a_detonator_lights_its_own_charge_alone(device):
    """Each charge has its own detonators and its own speed; one that names both lights both, whatever lies between."""
    left = PointDetonator((-0.1, 0.02, 0.02))
    right = PointDetonator((0.14, 0.02, 0.02), time=1e-6)
    both = PointDetonator((0.0, 0.02, 0.02), time=12e-6, charges=("slow", "fast"))
    for detonators, lit_slow, lit_fast in (
        ([left, right], [left], [right]),
        ([left, right, both], [left, both], [right, both]),
    ):
        scene = two_charges(*detonators)
        state = start(scene, device).state
        times = state.field("arrival_time")
        count = len(scene.charges[0].positions)
        parts = zip(scene.charges, (times[:count], times[count:]), (lit_slow, lit_fast), (SPEED, 7000.0), strict=True)
        for charge, computed, lit, speed in parts:
            ways = [d.time + np.linalg.norm(charge.positions - d.position, axis=1) / speed for d in lit]
            np.testing.assert_allclose(computed, np.min(ways, axis=0), rtol=0, atol=EXACT)


def test_the_adjusted_speed_is_the_one_that_runs(device):
    """An explosive whose stated speed was adjusted has the arrival times of the speed that its energy implies."""
    adjusted = make_explosive(
        "adjusted",
        density=1000.0,
        detonation_speed=2810.0,
        equation_of_state=IdealGas(2.0),
        energy=ammonium_nitrate().specific_energy,
    )
    scene = block((10, 2, 2), material=adjusted)
    times = start(scene, device).state.field("arrival_time")
    expected = np.linalg.norm(scene.charges[0].positions, axis=1) / SPEED
    np.testing.assert_allclose(times, expected, rtol=1e-5)  # the energy has the digits of single precision
