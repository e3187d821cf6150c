"""Explosive that something reaches before it burns must resist, or the scene is refused."""

import math

import pytest

import warp_mpm as mpm
from warp_mpm.errors import InputError
from warp_mpm.resistance import check_resistance

EDGE = 0.01  # of the cells, and of the charges [m]
SOLID = mpm.MieGruneisen(1000.0, 2000.0)
SPEED = 2800.0  # of the detonation [m/s]


def explosive(**options):
    return mpm.explosive(
        "powder", density=1000.0, detonation_speed=SPEED, equation_of_state=mpm.IdealGas(gamma=2.0), **options
    )


def water():
    return mpm.find_material("water")


def row(
    delay=0.0, *, gap=4, material=None, between=None, second_lit=True, velocity=None, end_time=1e-3, **charge
) -> mpm.Scene:
    """Two cubes with a gap of so many cells between them, each lit where it is nearest to the other one."""
    builder = mpm.SceneBuilder("row")
    length = (2 + gap) * EDGE
    builder.domain((0.0, 0.0, 0.0), (length, EDGE, EDGE), cell_size=EDGE)
    material = material or explosive()
    builder.charge(mpm.Box((0.0, 0.0, 0.0), (EDGE, EDGE, EDGE)), material, name="first")
    second = mpm.Box((length - EDGE, 0.0, 0.0), (length, EDGE, EDGE))
    builder.charge(second, material, velocity=velocity, name="second", **charge)
    if between is not None:
        builder.charge(mpm.Box((EDGE, 0.0, 0.0), (length - EDGE, EDGE, EDGE)), between, name="between")
    builder.detonator(mpm.PointDetonator((EDGE, 0.0, 0.0), charges=("first",)))
    if second_lit:
        builder.detonator(mpm.PointDetonator((length - EDGE, 0.0, 0.0), time=delay, charges=("second",)))
    builder.end_time(end_time)
    return builder.build()


def test_charges_lit_together_need_not_resist():
    row()
    row(between=water())


@pytest.mark.parametrize("between", [None, "water"])
def test_a_delay_longer_than_the_way_of_the_wave_is_refused(between):
    """The wave of the first may be at the second after 40 mm at 2800 m/s; its own reaches its sides a little later."""
    between = between and water()
    way = 4 * EDGE / SPEED
    row(0.75 * way, between=between)
    with pytest.raises(InputError, match="charge 'second': expected explosive that resists, since another"):
        row(1.1 * way, between=between)


@pytest.mark.parametrize("options", [{"unreacted": SOLID}, {"burn": mpm.Burn.BOTH}, {"burn": mpm.Burn.COMPRESSION}])
def test_what_resists_may_be_lit_at_any_time(options):
    row(1e-4, material=explosive(**options))


def test_sound_may_be_faster_than_the_detonation():
    """Through a solid of 6000 m/s the second is reached after 6.7 us, when its own wave has not come through it."""
    solid = mpm.inert("solid", density=2700.0, equation_of_state=mpm.MieGruneisen(2700.0, 6000.0, 1.4, 2.0))
    row(0.7 * 4 * EDGE / SPEED)
    with pytest.raises(InputError, match="charge 'second'"):
        row(0.7 * 4 * EDGE / SPEED, between=solid)


def test_explosive_that_may_stay_unlit_must_resist():
    with pytest.raises(InputError, match=r"charge 'second'.*before it burns"):
        row(second_lit=False, may_stay_unlit=True)
    row(second_lit=False, may_stay_unlit=True, end_time=4 * EDGE / SPEED)  # it is over before the wave is there


def test_touching_explosives_are_one():
    """A wave runs from one into the other, and lights it."""
    row(1e-4, gap=0)


@pytest.mark.parametrize(("speed", "refused"), [(0.0, False), (1.0, False), (1e4, True)])
def test_a_charge_in_motion(speed, refused):
    """One that runs into the other, 40 mm away, is there after the wave, if slow; if fast, before it has burnt."""
    if refused:
        with pytest.raises(InputError, match=r"charge 'first'.*charge 'second', which moves, may be at"):
            row(velocity=(-speed, 0.0, 0.0))
    else:
        row(velocity=(-speed, 0.0, 0.0))


def test_charges_that_move_as_one():
    """Nothing closes in, however fast."""
    scene = row()
    moving = []
    for charge in scene.charges:
        moved = charge.positions * 0.0 + [1e5, 0.0, 0.0]
        moving.append(mpm.scene.Charge(**{**vars(charge), "velocities": moved}))
    check_resistance("scene", moving, scene.detonators, EDGE, math.inf)


def test_the_message_says_where_when_and_what_to_do():
    own, other = (math.hypot(along * EDGE, 0.75 * EDGE, 0.75 * EDGE) / SPEED for along in (0.25, 4.25))
    late = f"{1e6 * (20e-6 + own - other):.3g} us before it burns"
    with pytest.raises(InputError) as caught:
        row(20e-6)
    assert "\n" not in str(caught.value)
    for part in ("scene row", late, "'powder'", "unreacted equation of state", "burn=Burn.BOTH"):
        assert part in str(caught.value)


@pytest.mark.parametrize("scene", ["row_of_charges"])
def test_the_shipped_row_resists_unless_it_is_told_not_to(scene):
    mpm.load_scene(scene, cell_size=1e-2)
    mpm.load_scene(scene, cell_size=1e-2, resists=False, delay=0.0)
    with pytest.raises(InputError, match=r"charge 'charge_2'.*burn=Burn\.BOTH"):
        mpm.load_scene(scene, cell_size=1e-2, resists=False)
