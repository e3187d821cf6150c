"""Several charges in one scene: later ones fill only what is free, with exact masses."""

import math

import numpy as np
import pytest
from solids_for_tests import ring_mesh

from warp_mpm.builder import SceneBuilder
from warp_mpm.detonators import PointDetonator
from warp_mpm.errors import InputError
from warp_mpm.geometry import Box, Cone, Cylinder, HalfSpace, Mesh, Solid, Sphere
from warp_mpm.materials import ammonium_nitrate
from warp_mpm.scene import Scene
from warp_mpm.volume import measure_volume

CUBE = Box((0, 0, 0), (1, 1, 1))
MIDDLE = (0.5, 0.5, 0.5)
BALL = Sphere(MIDDLE, 0.3)
RING = Mesh(*ring_mesh(0.3, 0.12)).translated(MIDDLE)
SLOPE = HalfSpace(MIDDLE, (1.0, 2.0, 3.0))
SLANTED = Cylinder((0.2, 0.3, 0.2), (0.6, 0.7, 0.2), 0.1)
TURNED = Box((0.3, 0.3, 0.3), (0.6, 0.6, 0.6)).rotated((0, 0, 1), 0.5, (0.3, 0.3, 0.3))
ROD = Cylinder((0.5, 0.5, 0.0), (0.5, 0.5, 1.0), 0.2)


def filled(*solids: Solid) -> Scene:
    """The unit cube in 10 x 10 x 10 cells with charges of these solids, in this order, all lit in the cube's middle."""
    builder = SceneBuilder("filled")
    builder.domain(CUBE.lower, CUBE.upper, cells=(10, 10, 10))
    names = [f"charge_{number}" for number in range(1, len(solids) + 1)]
    for solid in solids:
        builder.charge(solid, ammonium_nitrate())
    builder.detonator(PointDetonator(MIDDLE, charges=tuple(names)))
    builder.end_time(1e-3)
    return builder.build()


@pytest.mark.parametrize(
    ("solids", "volumes"),
    [
        ((BALL, CUBE), (4 / 3 * math.pi * 0.027, 1 - 4 / 3 * math.pi * 0.027)),
        ((Sphere(MIDDLE, 0.1), BALL, CUBE), (4e-3 / 3 * math.pi, 0.104 / 3 * math.pi, 1 - 0.108 / 3 * math.pi)),
        ((ROD, CUBE), (0.04 * math.pi, 1 - 0.04 * math.pi)),
        ((Box((0, 0, 0), (1, 1, 0.6)), Box((0, 0, 0.4), (1, 1, 1))), (0.6, 0.4)),
        ((Box((0, 0, 0), (0.6, 1, 1)), Box((0.4, 0, 0), (1, 0.5, 1)), CUBE), (0.6, 0.2, 0.2)),
        ((BALL, CUBE - Sphere(MIDDLE, 0.4), CUBE), (0.108 / 3 * math.pi, 1 - 0.256 / 3 * math.pi, 0.148 / 3 * math.pi)),
    ],
)
def test_later_charges_fill_what_is_free_and_together_all_of_it(solids, volumes):
    """Masses are exact; every site of the cube's lattice has one particle, of the first charge that contains it."""
    scene = filled(*solids)
    assert [charge.volume for charge in scene.charges] == pytest.approx(volumes, rel=1e-12)
    assert [charge.volume_tolerance for charge in scene.charges] == [0.0] * len(solids)
    positions = np.concatenate([charge.positions for charge in scene.charges])
    assert len(np.unique(np.round(positions, 9), axis=0)) == len(positions) == 20**3
    for number, charge in enumerate(scene.charges):
        assert charge.solid.contains(charge.positions).all()
        assert np.all(charge.solid.signed_distance(charge.positions) <= 0.0)
        assert all(np.all(earlier.solid.signed_distance(charge.positions) >= 0) for earlier in scene.charges[:number])


def test_what_is_filled_is_the_solid_of_the_charge():
    """Arrival times, detonators and pictures see what the charge really fills."""
    assert filled(BALL, CUBE).charges[1].solid == CUBE - BALL
    assert filled(BALL, ROD, CUBE).charges[2].solid == CUBE - (BALL | ROD)


def test_the_rest_of_any_shape_is_measured():
    """A ball that another one cuts a lens out of: pi (4 r + d)(2 r - d)^2 / 12."""
    first, second = Sphere((0.4, 0.5, 0.5), 0.2), Sphere((0.6, 0.5, 0.5), 0.2)
    charge = filled(first, second).charges[1]
    rest = second.exact_volume() - math.pi * (4 * 0.2 + 0.2) * (2 * 0.2 - 0.2) ** 2 / 12
    assert 0.0 < charge.volume_tolerance <= 1e-4
    assert charge.volume == pytest.approx(rest, rel=charge.volume_tolerance)


@pytest.mark.parametrize(
    "solids",
    [
        (Box((0, 0, 0), (1 / 3, 1, 1)), Box((1 / 3, 0, 0), (1, 1, 1))),
        (CUBE - BALL, BALL),
        (CUBE - ROD, ROD),
        (CUBE - Cylinder((0.5, 0.5, -1.0), (0.5, 0.5, 2.0), 0.2), ROD),  # bored right through
        (Sphere((0.3, 0.5, 0.5), 0.2), Sphere((0.7, 0.5, 0.5), 0.2)),
        (Cylinder((0.5, 0.5, 0), (0.5, 0.5, 0.4), 0.3), Cylinder((0.5, 0.5, 0.4), (0.5, 0.5, 1), 0.2)),
        (Cylinder((0.2, 0.2, 0.2), MIDDLE, 0.1), Cone(MIDDLE, (0.7, 0.7, 0.7), 0.1)),  # slanted, end to end
        (SLANTED, SLANTED.translated((math.sqrt(0.02), -math.sqrt(0.02), 0))),  # side by side
        (TURNED, TURNED.translated((0.3 * math.cos(0.5), 0.3 * math.sin(0.5), 0))),
        (CUBE & SLOPE, CUBE - SLOPE),
        (RING, CUBE - RING),
        (RING, Sphere(MIDDLE, 0.15)),
        (RING, Cylinder((0.5, 0.5, 0.1), (0.6, 0.5, 0.9), 0.08)),  # through the hole: a gap, and no plane between
        (SLANTED, SLANTED.rotated((0, 0, 1), math.pi / 2, MIDDLE).translated((0, 0, 0.25))),  # crosswise, with a gap
    ],
)
def test_charges_that_touch_or_are_apart_keep_their_shapes(solids):
    """So distances and volumes stay exact, in either order."""
    for order in (solids, solids[::-1]):
        assert [charge.solid for charge in filled(*order).charges] == list(order)


@pytest.mark.parametrize(
    ("solids", "got"),
    [
        ((CUBE, BALL), "none, all of it lies in them"),
        ((BALL, BALL), "none, all of it lies in them"),
        ((Box((0, 0, 0), (1, 1, 0.5)), Box((0, 0, 0.5), (1, 1, 1)), ROD), "none, all of it lies in them"),
        ((Box((0.4, 0.4, 0.4), (0.6, 0.6, 0.6)), Sphere((0.6, 0.5, 0.5), 0.04)), "not enough for a single particle"),
    ],
)
def test_a_charge_that_finds_no_room_is_refused(solids, got):
    with pytest.raises(InputError) as caught:
        filled(*solids)
    here = f"scene filled: charge 'charge_{len(solids)}': expected room that the charges before it leave free"
    assert str(caught.value).startswith(here)
    assert f", got {got}; move it, or add it before them" in str(caught.value)


def test_an_empty_solid_has_no_volume():
    """Of no formula: the sampling of its volume comes to an end."""
    ball = Sphere((0, 0, 0), 1.0)
    assert measure_volume(ball - (Sphere((0.1, 0, 0), 1.2) - Sphere((5, 5, 5), 0.1))) == (0.0, 0.0)
