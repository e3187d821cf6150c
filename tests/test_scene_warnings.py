"""What is odd about a scene, but no mistake: idle detonators, explosives too small for their cells or cut by others."""

import math
import subprocess
import sys

import pytest
from scenes_for_tests import CELL, OPEN, block, explosive, inert_gas

from warp_mpm import materials
from warp_mpm.builder import SceneBuilder
from warp_mpm.checks import closest_match
from warp_mpm.detonators import PointDetonator, row
from warp_mpm.geometry import Box, Sphere
from warp_mpm.kernels.eos.ideal_gas import IdealGas
from warp_mpm.kernels.eos.mie_gruneisen import MieGruneisen
from warp_mpm.material_library import find_material
from warp_mpm.progress import opening
from warp_mpm.scene import Scene

LENGTH = 20 * CELL
ACROSS = LENGTH / 2800.0  # time of a wave from end to end [s]


def bar(*detonators, end_time=1.0, solid=None) -> Scene:
    """A bar of the paper's explosive in a domain that it fills, or another solid in it."""
    builder = SceneBuilder("bar")
    box = Box((0.0, 0.0, 0.0), (LENGTH, CELL, CELL))
    builder.domain(box.lower, box.upper if solid is None else (LENGTH, LENGTH, LENGTH), cell_size=CELL)
    builder.charge(solid or box, explosive(), name="charge")
    builder.detonator(*detonators)
    builder.end_time(end_time)
    return builder.build()


def at(share, time=0.0):
    return PointDetonator((share * LENGTH, CELL / 2, CELL / 2), time=time)


def test_detonators_that_are_lit_in_time_are_no_matter():
    assert bar(at(0.0), at(1.0), at(0.5, 0.49 * ACROSS)).warnings == ()


def test_detonators_after_the_end():
    (warning,) = bar(at(0.0), at(0.5, 3e-6), at(1.0, 2e-6), end_time=2e-6).warnings
    assert warning.startswith("detonators 2, 3: nothing is lit before the end at 2 us;")


def test_detonators_whose_place_has_burnt():
    (warning,) = bar(at(0.0), at(0.5, 0.51 * ACROSS), at(1.0, 0.2 * ACROSS)).warnings
    assert warning.startswith("detonator 2: others' waves may have passed before it is lit:")
    many = row((0.0, CELL / 2, CELL / 2), (LENGTH, CELL / 2, CELL / 2), 5, delay=ACROSS)
    (warning,) = bar(*many).warnings
    assert warning.startswith("detonators 2, 3, 4, 5: ")


@pytest.mark.parametrize(("radius", "warned"), [(2.4, True), (2.6, False)])
def test_explosives_of_few_cells(radius, warned):
    """A charge from wall to wall may be one cell thick, others may not."""
    middle = (LENGTH / 2, LENGTH / 2, LENGTH / 2)
    warnings = bar(PointDetonator(middle), solid=Sphere(middle, radius * CELL)).warnings
    assert [warning.startswith("charge 'charge': 4.8 cells across") for warning in warnings] == [True] * warned


def test_speeds_that_differ_in_the_fourth_digit_are_the_same():
    gas = IdealGas(2.0)
    energy = 2800.0**2 / 6.0  # E0 = D^2 / (2 (gamma^2 - 1))
    for stated, warned in ((2800.0 * 1.0009, False), (2800.0 * 1.0011, True)):
        made = materials.explosive("gas", density=1000.0, detonation_speed=stated, equation_of_state=gas, energy=energy)
        assert bool(made.warnings) == warned
        assert made.burn.detonation_speed == pytest.approx(2800.0, rel=1e-6)


def side_by_side(*solids, materials) -> tuple[str, ...]:
    """Warnings of a cube of 20 cells with charges "a", "b", ... of these solids, all lit in its middle."""
    builder = SceneBuilder("cube")
    builder.domain((0.0, 0.0, 0.0), (LENGTH, LENGTH, LENGTH), cell_size=CELL)
    names = "abc"[: len(solids)]
    for name, solid, material in zip(names, solids, materials, strict=True):
        builder.charge(solid, material, name=name, may_stay_unlit=material.burn is not None)
    lit = tuple(name for name, material in zip(names, materials, strict=True) if material.burn)
    builder.detonator(PointDetonator((LENGTH / 2, LENGTH / 2, LENGTH / 2), charges=lit))
    builder.end_time(1e-6)
    return builder.build().warnings


def slab(low, high):
    """Part of that cube, between two shares of its length along x."""
    return Box((low * LENGTH, 0.0, 0.0), (high * LENGTH, LENGTH, LENGTH))


def test_an_explosive_that_earlier_charges_cut_is_told():
    """The faces are those of cells, so that the shares of the sites are those of the volume."""
    burning = explosive()
    (warning,) = side_by_side(slab(0.0, 0.5), slab(0.4, 0.9), materials=[burning, burning])
    assert warning.startswith("charge 'b': 20% of it is left out, because it lies in 'a', added before it; ")
    assert "add it before them" in warning
    solids = slab(0.0, 0.4), slab(0.8, 1.0), slab(0.2, 1.0)
    (warning,) = side_by_side(*solids, materials=[burning, inert_gas(), burning])
    assert warning.startswith("charge 'c': 50% of it is left out, because it lies in 'a', 'b', added before it; ")


@pytest.mark.parametrize(
    ("solids", "materials"),
    [
        ((slab(0.0, 0.5), slab(0.4, 0.9)), (explosive(), inert_gas())),  # what does not burn fills what is left
        ((slab(0.0, 0.5), slab(0.5, 1.0)), (explosive(), explosive())),
        ((slab(0.0, 0.1), slab(0.0, 1.0) - slab(0.0, 0.1)), (inert_gas(), explosive())),
        ((Sphere((0.05, 0.05, 0.05), 0.03), slab(0.0, 1.0)), (explosive(), explosive())),  # 1.4 % of it
    ],
)
def test_charges_that_lose_nothing_of_note_say_nothing(solids, materials):
    assert side_by_side(*solids, materials=materials) == ()


@pytest.mark.parametrize(("pressure", "asked"), [(0.0, False), (1.0, True), (999.0, True), (1000.0, False)])
def test_an_ambient_pressure_in_bar_is_asked_for(pressure, asked):
    warnings = block((6, 6, 6), walls=OPEN, ambient_pressure=pressure).warnings
    expected = f"ambient pressure {pressure:g} Pa: is it in pascals? 1 bar is 1e5 Pa"
    assert warnings == ((expected,) if asked else ())


@pytest.mark.parametrize("cells", [10, 40])
@pytest.mark.parametrize("material", [None, inert_gas()], ids=["explosive", "inert"])
def test_an_end_time_in_microseconds_is_asked_for(material, cells):
    """The time in which a wave crosses the block, in seconds and in microseconds: 33 or 133 steps, or millions."""
    speed = 2800.0 if material is None else math.sqrt(1.4 * 0.4 * 1e5)  # c^2 = gamma (gamma - 1) e
    crossing = cells * CELL / speed
    assert block((cells, 1, 1), material=material, end_time=crossing).warnings == ()
    (warning,) = block((cells, 1, 1), material=material, end_time=1e6 * crossing).warnings
    asked, meant = f"end time {1e6 * crossing:g} s: is it in seconds? ", f"{1e6 * crossing:g} us are {crossing:g} s; "
    assert warning.startswith(asked + meant)
    assert warning.endswith(f"it is {1e6 * cells / 0.3:.0e} times the first time step")


def test_no_long_run_that_is_meant_is_asked_about():
    """A slow fuse of a thousand cells; charges in 10 m of water, 25 ms apart; sound that crosses a vessel 10,000 times;
    cold gas for hours.
    """
    slow = materials.explosive("slow", density=1000.0, detonation_speed=300.0, equation_of_state=IdealGas(2.0))
    assert block((1000, 1, 1), material=slow, end_time=10.0 * CELL * 1000 / 300.0).warnings == ()
    builder = SceneBuilder("row")
    builder.domain((0.0, 0.0, 0.0), (10.0, 0.3, 0.3), cell_size=0.05)
    holes = [Box((x, 0.0, 0.0), (x + 0.3, 0.3, 0.3)) for x in (1.0, 5.0, 9.0)]
    for number, hole in enumerate(holes):
        builder.charge(hole, find_material("tnt", unreacted=MieGruneisen(1630.0, 2390.0, 2.05)), name=f"hole_{number}")
        builder.detonator(PointDetonator((hole.lower[0], 0.0, 0.0), time=25e-3 * number))
    builder.charge(Box((0.0, 0.0, 0.0), (10.0, 0.3, 0.3)), find_material("water"))
    builder.end_time(0.1)
    assert builder.build().warnings == ()
    still, cold = inert_gas(), inert_gas(energy=1e-6)
    assert block((50, 1, 1), material=still, end_time=1e4 * 50 * CELL / 237.0).warnings == ()
    assert block((50, 1, 1), material=cold, end_time=1e4).warnings == ()


@pytest.mark.parametrize(
    ("density", "speed", "asked"),
    [
        (1.63, 6930.0, "in g/cm3"),
        (1630.0, 6.93, "in km/s"),
        (1630.0, 6930.0, ""),
        (0.5, 2840.0, ""),
        (200.0, 500.0, ""),
    ],
)
def test_units_are_asked_for(density, speed, asked):
    made = materials.explosive("x", density=density, detonation_speed=speed, equation_of_state=IdealGas(3.0))
    assert [asked in warning for warning in made.warnings] == [True] * bool(asked)


@pytest.mark.parametrize(("typed", "meant"), [("TNT", "tnt"), ("C-4", "c4"), ("Composition B", "composition_b")])
def test_capitals_and_signs_are_no_other_name(typed, meant):
    assert closest_match(typed, ["tnt", "c4", "composition_b"]) == f"did you mean {meant}?"
    assert closest_match("gunpowder", ["tnt", "c4"]) == ""


def test_a_reader_who_has_seen_enough():
    """`warp-mpm list | head -1`: the pipe is closed before all is written."""
    command = [sys.executable, "-m", "warp_mpm", "list"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as program:
        program.stdout.close()
        said = program.stderr.read()
    assert (program.returncode, said) == (0, b"")


def test_a_run_begins_with_the_warnings_of_its_scene():
    """Before its first step: a long run need not be waited for."""
    (said,) = bar(at(0.0, 2.0)).warnings
    first, *warnings = opening(bar(at(0.0, 2.0)), "CPU", 1).splitlines()
    assert first == "bar: 160 particles in 20 cells on CPU, 1 thread, in single precision; preparing kernels"
    assert warnings == [f"warning: {said}"]
