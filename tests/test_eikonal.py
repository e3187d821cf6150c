"""Arrival times around obstacles and through several explosives, against exact ones.

Times are judged in cells of travel, dt D / h. Kenamond's problems, and the speed that particles see, are in
`test_kenamond.py`.
"""

from dataclasses import replace

import numpy as np
import pytest
from scenes_for_tests import ROUND_OFF, explosive, inert_gas, start

from warp_mpm.builder import SceneBuilder
from warp_mpm.detonators import CordDetonator, LineDetonator, PlaneDetonator, PointDetonator, SphereDetonator
from warp_mpm.errors import InputError
from warp_mpm.exact.arrival import straight_arrival
from warp_mpm.geometry import Box, Cone, Sphere
from warp_mpm.kernels.eos.ideal_gas import IdealGas
from warp_mpm.kernels.eos.mie_gruneisen import MieGruneisen
from warp_mpm.kernels.precision import NEVER
from warp_mpm.materials import explosive as make_explosive

CELL = 0.01  # [m]
SPEED = 2800.0  # of the paper's explosive [m/s]
FAST = 7000.0  # [m/s]
EXACT = 8 * ROUND_OFF  # of the longest time: straight ways carry the rounding of places and times


def fast_explosive():
    return make_explosive("fast", density=1500.0, detonation_speed=FAST, equation_of_state=IdealGas(3.0))


def arrival(cells, bodies, detonators, device="cpu", **charge):
    """Positions (n, 3) and arrival times (n,) of the particles of each body (name: solid, material) in order."""
    builder = SceneBuilder("way")
    builder.domain((0.0, 0.0, 0.0), tuple(CELL * n for n in cells), cells=cells)
    for name, (solid, material) in bodies.items():
        builder.charge(solid, material, name=name, **(charge if material.burn else {}))
    builder.detonator(*detonators)
    builder.end_time(1e-4)
    scene = builder.build()
    times = start(scene, device).state.field("arrival_time").astype(np.float64)
    parts = np.split(times, np.cumsum([len(one.positions) for one in scene.charges])[:-1])
    return {one.name: (one.positions, part) for one, part in zip(scene.charges, parts, strict=True)}


def block_of(cells):
    return Box((0.0, 0.0, 0.0), tuple(CELL * n for n in cells))


def best_over_line(start, place, edge, direction, slowness=(1 / SPEED, 1 / SPEED), span=0.6):
    """Earliest time from a point over any point of a straight line to places (n, 3), by brute force and a parabola."""
    shares = np.linspace(-span, span, 4001)
    corners = np.array(edge) + np.outer(shares, direction)
    to_corner = np.linalg.norm(corners - start, axis=1) * slowness[0]
    best = []
    for one in place:
        times = to_corner + np.linalg.norm(corners - one, axis=1) * slowness[1]
        n = np.clip(np.argmin(times), 1, len(times) - 2)
        low, mid, high = times[n - 1 : n + 2]
        best.append(mid - (high - low) ** 2 / (8.0 * (high - 2.0 * mid + low)))
    return np.array(best)


def in_cells(error, speed=SPEED):
    return error * speed / CELL


def test_in_sight_times_are_those_without_the_obstacle_to_the_last_bit(device):
    cells = (12, 12, 12)
    box = block_of(cells)
    detonators = [PointDetonator((0.0, 0.0, 0.0)), PointDetonator((0.12, 0.0, 0.1), time=8e-6)]
    ball = Sphere((0.06, 0.07, 0.06), 0.025)
    alone = arrival(cells, {"all": (box, explosive())}, detonators, device)["all"]
    around = arrival(cells, {"all": (box - ball, explosive()), "inert": (ball, inert_gas())}, detonators, device)["all"]
    kept = ~ball.contains(alone[0])
    np.testing.assert_array_equal(around[0], alone[0][kept])
    later = around[1] > alone[1][kept]
    assert 0.005 < later.mean() < 0.5  # in the shadows of both detonators, and nowhere else
    np.testing.assert_array_equal(around[1][~later], alone[1][kept][~later])
    seen = np.linalg.norm(around[0] - detonators[0].position, axis=1) < 0.07  # nearer than the ball
    assert not later[seen].any()


def test_around_the_edge_of_a_plate(device):
    """Two-dimensional: behind a plate with a sharp edge the wave starts anew at the edge."""
    cells = (30, 20, 1)
    plate = Box((0.1, 0.0, 0.0), (0.12, 0.12, CELL))
    lamp = LineDetonator((0.05, 0.05, 0.0), (0.05, 0.05, CELL))
    around = {"all": (block_of(cells) - plate, explosive()), "plate": (plate, inert_gas())}
    place, times = arrival(cells, around, [lamp], device)["all"]
    flat = place * [1, 1, 0]
    straight = np.linalg.norm(flat - [0.05, 0.05, 0.0], axis=1)
    near, far = np.array([0.1, 0.12, 0.0]), np.array([0.12, 0.12, 0.0])
    first = np.linalg.norm(near - [0.05, 0.05, 0.0])
    over = first + np.linalg.norm(flat - near, axis=1)
    down = first + 0.02 + np.linalg.norm(flat - far, axis=1)
    shadow = (flat[:, 0] > 0.1) & (flat[:, 1] < 0.12 + (flat[:, 0] - 0.1) * 0.07 / 0.05)
    exact = np.where(shadow, np.where((flat[:, 0] > 0.12) & (flat[:, 1] < 0.12), down, over), straight) / SPEED
    assert shadow.mean() > 0.3
    np.testing.assert_allclose(times[~shadow], straight[~shadow] / SPEED, rtol=0, atol=EXACT * times.max())
    # The distance is interpolated on half cells: an edge is rounded off by a part of one.
    assert np.abs(in_cells(times - exact)).max() < 0.2


def test_around_a_slanting_way_over_an_edge(device):
    """Three-dimensional: the way turns on the edge where it makes equal angles with it (Fermat)."""
    cells = (20, 14, 24)
    plate = Box((0.09, 0.0, 0.0), (0.11, 0.08, 0.24))
    lamp = PointDetonator((0.03, 0.03, 0.02))
    around = {"all": (block_of(cells) - plate, explosive()), "plate": (plate, inert_gas())}
    place, times = arrival(cells, around, [lamp], device)["all"]
    behind = (place[:, 0] > 0.115) & (place[:, 1] > 0.085) & (place[:, 1] - 0.08 < (place[:, 0] - 0.09) * 0.05 / 0.06)
    exact = best_over_line(np.array(lamp.position), place[behind], (0.09, 0.08, 0.1), (0.0, 0.0, 1.0), span=0.15)
    assert behind.sum() > 500
    assert np.abs(in_cells(times[behind] - exact)).max() < 0.2


@pytest.mark.parametrize("lit", ["slow", "fast"])
def test_refraction_at_a_plane(lit, device):
    """Fermat's principle at a plane between two explosives, from the slow into the fast one and back."""
    cells = (24, 16, 1)
    speeds = {"slow": SPEED, "fast": FAST}
    other = "fast" if lit == "slow" else "slow"
    materials = {"slow": explosive(), "fast": fast_explosive()}
    left, right = Box((0.0, 0.0, 0.0), (0.12, 0.16, CELL)), Box((0.12, 0.0, 0.0), (0.24, 0.16, CELL))
    lamp = LineDetonator((0.06, 0.04, 0.0), (0.06, 0.04, CELL))
    found = arrival(cells, {lit: (left, materials[lit]), other: (right, materials[other])}, [lamp], device)
    slowness = (1 / speeds[lit], 1 / speeds[other])
    place, times = found[other]
    exact = best_over_line(
        np.array([0.06, 0.04, 0.0]), place * [1, 1, 0], (0.12, 0.08, 0.0), (0.0, 1.0, 0.0), slowness, span=0.08
    )
    assert np.abs(in_cells(times - exact, speeds[other])).max() < 0.05
    place, times = found[lit]
    straight = np.linalg.norm(place[:, :2] - [0.06, 0.04], axis=1) / speeds[lit]
    if lit == "fast":
        np.testing.assert_allclose(times, straight, rtol=0, atol=EXACT * times.max())
    else:  # the wave that ran ahead in the fast explosive comes back: a head wave at the critical angle
        sine = SPEED / FAST
        cosine = np.sqrt(1.0 - sine**2)
        along, depths = np.abs(place[:, 1] - 0.04), 0.06 + 0.12 - place[:, 0]
        head = along / FAST + depths * cosine / SPEED
        exists = along > depths * sine / cosine
        exact = np.where(exists, np.minimum(straight, head), straight)
        assert np.mean(exact < straight) > 0.03
        error = np.abs(in_cells(times - exact))
        assert np.quantile(error, 0.99) < 0.01
        assert error.max() < 0.5  # in the one cell where the head wave begins


def test_a_gap_stops_the_wave_and_touching_explosives_pass_it_on(device):
    """Vacuum carries no wave; what it does not come to is an error with its place, unless it may stay unlit."""
    cells = (20, 3, 3)
    lamp = PointDetonator((0.0, 0.015, 0.015))
    left, middle = Box((0.0, 0.0, 0.0), (0.06, 0.03, 0.03)), Box((0.06, 0.0, 0.0), (0.1, 0.03, 0.03))
    right = Box((0.12, 0.0, 0.0), (0.2, 0.03, 0.03))
    bodies = {name: (solid, explosive()) for name, solid in (("left", left), ("middle", middle), ("right", right))}
    touching = {name: bodies[name] for name in ("left", "middle")}
    for place, times in arrival(cells, touching, [lamp], device).values():
        exact = straight_arrival([lamp], place, SPEED)
        np.testing.assert_allclose(times, exact, rtol=0, atol=EXACT * times.max())
    with pytest.raises(InputError, match=r"charge 'right': expected a detonator that lights this explosive, got none"):
        arrival(cells, bodies, [lamp], device)
    resisting = replace(explosive(), unreacted=MieGruneisen(1000.0, 2000.0))  # as what is not lit must be
    bodies["right"] = (right, resisting)
    found = arrival(cells, bodies, [lamp], device, may_stay_unlit=True)
    assert found["right"][1].min() == pytest.approx(float(NEVER))
    parts = {"all": (left | right, explosive())}
    with pytest.raises(
        InputError, match=r"charge 'all': .*none at 576 of its 1008 particles, the first at \(0\.1225, 0"
    ):
        arrival(cells, parts, [lamp], device)


def test_what_wins_need_not_be_what_is_in_sight(device):
    """A delayed detonator in sight is beaten by a wave that comes around the plate from one that is not."""
    cells = (20, 12, 1)
    plate = Box((0.08, 0.0, 0.0), (0.1, 0.06, CELL))
    hidden = LineDetonator((0.04, 0.02, 0.0), (0.04, 0.02, CELL))
    late = LineDetonator((0.18, 0.02, 0.0), (0.18, 0.02, CELL), time=200e-6)
    around = {"all": (block_of(cells) - plate, explosive()), "plate": (plate, inert_gas())}
    _, both = arrival(cells, around, [hidden, late], device)["all"]
    _, alone = arrival(cells, around, [hidden], device)["all"]
    np.testing.assert_array_equal(both, alone)
    assert alone.max() < 200e-6


CORD = CordDetonator(((0.02, 0.05, 0.05), (0.1, 0.05, 0.05), (0.1, 0.09, 0.05)), speed=6500.0, time=2e-6)


@pytest.mark.parametrize(
    "detonator",
    [
        LineDetonator((0.02, 0.03, 0.04), (0.09, 0.05, 0.06), time=3e-6),
        SphereDetonator((0.06, 0.05, 0.05), 0.03, time=1e-6),
        CORD,
        CordDetonator(CORD.points, speed=2000.0),  # slower than the explosive: lit from its start
    ],
)
def test_lines_spheres_and_cords(detonator, device):
    cells = (12, 10, 10)
    place, times = arrival(cells, {"all": (block_of(cells), explosive())}, [detonator], device)["all"]
    exact = straight_arrival([detonator], place, SPEED)
    np.testing.assert_allclose(times, exact, rtol=0, atol=16 * ROUND_OFF * exact.max())


def test_a_cord_lights_only_where_it_touches(device):
    """A cord that comes from outside lights a charge where it enters, at its own time."""
    cells = (10, 10, 10)
    charge = Box((0.04, 0.0, 0.0), (0.1, 0.1, 0.1))
    cord = CordDetonator(((0.0, 0.05, 0.05), (0.1, 0.05, 0.05)), speed=7000.0)
    place, times = arrival(cells, {"all": (charge, explosive())}, [cord], device)["all"]
    entry = 0.035  # half a cell before the surface, which counts as inside
    inside = CordDetonator(((entry, 0.05, 0.05), (0.1, 0.05, 0.05)), speed=7000.0, time=entry / 7000.0)
    exact = straight_arrival([inside], place, SPEED)
    assert np.abs(in_cells(times - exact)).max() < 0.05
    assert np.any(exact > straight_arrival([cord], place, SPEED) + 1e-9)


def test_a_plane_detonator_lights_a_charge_with_a_hole(device):
    """Before the hole the wave is plane; behind it, it closes in from the sides."""
    cells = (20, 12, 1)
    hole = Box((0.08, 0.04, 0.0), (0.1, 0.08, CELL))
    lamp = PlaneDetonator((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    place, times = arrival(cells, {"all": (block_of(cells) - hole, explosive())}, [lamp], device)["all"]
    shadow = (place[:, 0] > 0.1) & (np.abs(place[:, 1] - 0.06) < 0.02)
    np.testing.assert_allclose(times[~shadow], place[~shadow, 0] / SPEED, rtol=0, atol=EXACT * times.max())
    side = 0.02 - np.abs(place[shadow, 1] - 0.06)
    exact = (0.1 + np.hypot(place[shadow, 0] - 0.1, side)) / SPEED
    assert np.abs(in_cells(times[shadow] - exact)).max() < 0.2


@pytest.mark.parametrize("at", [(0.0, 5.0, 0.0), (1.0, 5.0, 0.2), (5.0, 5.0, 0.0), (5.0, 5.0, 9.8)], ids=str)
def test_sharp_edges_are_lit_and_light(at, device):
    """A cone with a rod on its tip, no convex body: lit on its rim, beside it, in the middle and from above.

    The lattice blunts the rim, half a cell deep. In the cone the ways from its base are straight, as it is convex.
    """
    cone, rod = Cone((0.05, 0.05, 0.0), (0.05, 0.05, 0.08), 0.05), Box((0.045, 0.045, 0.06), (0.055, 0.055, 0.1))
    source = CELL * np.array(at)
    ((position, time),) = arrival(
        (10, 10, 12), {"charge": (cone | rod, explosive())}, [PointDetonator(tuple(source))]
    ).values()
    straight = np.linalg.norm(position - source, axis=1) / SPEED
    assert time.max() < NEVER
    assert np.all(time >= straight - EXACT * straight.max())
    in_cone = cone.contains(position)
    if at[2] < 1.0:
        assert np.abs(time - straight)[in_cone].max() * SPEED / CELL < 0.01  # cells
