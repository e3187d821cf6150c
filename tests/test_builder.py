"""The scene builder: cells, particles, and a clear line for everything that does not fit."""

import math

import numpy as np
import pytest

from warp_mpm import charges
from warp_mpm.builder import SceneBuilder
from warp_mpm.detonators import (
    CordDetonator,
    LineDetonator,
    PlaneDetonator,
    PointDetonator,
    SphereDetonator,
)
from warp_mpm.errors import InputError
from warp_mpm.geometry import Box, Cylinder, Sphere
from warp_mpm.kernels.eos.ideal_gas import IdealGas
from warp_mpm.materials import Material, OnMismatch, ammonium_nitrate
from warp_mpm.scene import Segment, Wall, Walls

EXPLOSIVE = ammonium_nitrate()
INERT = Material("inert gas", density=1.0, equation_of_state=IdealGas(gamma=1.4), specific_energy=1e5)
CUBE = Box((0, 0, 0), (0.1, 0.1, 0.1))


def cube_builder(**domain):
    """A builder with everything that the smallest scene needs: a cube of 10 x 10 x 10 cells."""
    builder = SceneBuilder("cube")
    builder.domain(CUBE.lower, CUBE.upper, **(domain or {"cell_size": 0.01}))
    builder.charge(CUBE, EXPLOSIVE, name="cube")
    builder.detonator(PointDetonator((0.05, 0.05, 0.05)))
    builder.end_time(1e-5)
    return builder


def refusal(action):
    """The message of the InputError that `action` raises: one line that names the scene."""
    with pytest.raises(InputError) as caught:
        action()
    message = str(caught.value)
    assert message.startswith("scene cube: ")
    assert "\n" not in message
    return message


def test_the_smallest_scene_has_sensible_defaults():
    scene = cube_builder().build()
    assert scene.walls == Walls()
    assert scene.section.axis == 2
    assert scene.section.coordinate == pytest.approx(0.05)
    assert scene.line is None
    assert scene.warnings == ()
    assert scene.detonators[0].charges == ("cube",)
    assert scene.mass == pytest.approx(1.0)


def test_the_papers_plate_at_3_mm():
    builder = SceneBuilder("plate")
    plate = Box((0, 0, 0), (0.2, 0.4, 0.02))
    builder.domain(plate.lower, plate.upper, cell_size=3e-3)
    builder.charge(plate, EXPLOSIVE)
    builder.detonator(PointDetonator((0.1, 0.0, 0.01)))
    builder.end_time(1e-4)
    scene = builder.build()
    assert scene.domain.cells == (67, 133, 7)
    assert scene.domain.spacing == pytest.approx((2.985e-3, 3.008e-3, 2.857e-3), rel=1e-3)
    assert scene.particle_count == 67 * 133 * 7 * 8 == 499_016
    positions = scene.charges[0].positions
    assert scene.charges[0].particle_volume * len(positions) == pytest.approx(plate.exact_volume(), rel=1e-14)
    mirrored = np.array([0.2, 0.4, 0.02]) - positions[::-1]  # lattice order backwards is the mirror image
    np.testing.assert_allclose(mirrored, positions, rtol=0, atol=1e-15)


def test_particles_are_at_the_centers_of_equal_parts_of_the_cells_in_lattice_order():
    builder = cube_builder(cells=(1, 1, 1))
    x = np.array([0.025, 0.075])
    expected = np.stack(np.meshgrid(x, x, x, indexing="ij"), axis=-1).reshape(-1, 3)
    np.testing.assert_allclose(builder.build().charges[0].positions, expected, atol=1e-17)


@pytest.mark.parametrize("per_axis", [1, 3])
def test_particles_per_axis(per_axis):
    builder = SceneBuilder("cube")
    builder.domain((0, 0, 0), (0.1, 0.1, 0.1), cell_size=0.02)
    builder.charge(CUBE, INERT, particles_per_axis=per_axis)
    builder.end_time(1e-5)
    assert builder.build().particle_count == (5 * per_axis) ** 3


def test_particles_fill_the_shape_only():
    ball = Sphere((0.05, 0.05, 0.05), 0.03)
    builder = SceneBuilder("ball")
    builder.domain((0, 0, 0), (0.1, 0.1, 0.1), cell_size=0.005)
    builder.charge(ball, INERT)
    builder.end_time(1e-5)
    charge = builder.build().charges[0]
    assert ball.contains(charge.positions).all()
    assert charge.particle_volume == pytest.approx(0.0025**3, rel=0.02)


def test_the_lattice_is_the_same_however_it_is_chunked(monkeypatch):
    whole = cube_builder().build().charges[0].positions
    monkeypatch.setattr("warp_mpm.lattice.CHUNK", 1000)
    np.testing.assert_array_equal(cube_builder().build().charges[0].positions, whole)


def test_margins_are_whole_cells_and_change_neither_cells_nor_particles():
    inner = cube_builder().build()
    outer = cube_builder(cell_size=0.01, margins=(0.024, 0.026, 0.0, 0.1, 0.004, 0.006)).build()
    assert outer.domain.cells == (10 + 2 + 3, 10 + 10, 10 + 0 + 1)
    np.testing.assert_allclose(outer.domain.spacing, inner.domain.spacing, rtol=1e-12)
    np.testing.assert_allclose(outer.charges[0].positions, inner.charges[0].positions, atol=1e-15)


def test_cell_size_per_axis_and_number_of_cells():
    assert cube_builder(cell_size=(0.01, 0.02, 0.011)).build().domain.cells == (10, 5, 9)
    assert cube_builder(cells=(10, 7, 8)).build().domain.cells == (10, 7, 8)


def test_what_to_look_at():
    builder = cube_builder()
    builder.front_path((0.05, 0.05, 0.05), (0.1, 0.05, 0.05))
    builder.collision_point((0.1, 0.05, 0.05))
    builder.picture_times([0.0, 1e-5])
    builder.section(axis=0, coordinate=0.02)
    builder.gravity((0, 0, -9.81))
    builder.ambient_pressure(1e5)
    builder.burn_width(2)
    builder.walls(Walls(x_low=Wall.OPEN))
    scene = builder.build()
    assert scene.line == scene.front_path == Segment((0.05, 0.05, 0.05), (0.1, 0.05, 0.05))
    assert scene.collision_points == ((0.1, 0.05, 0.05),)
    assert scene.picture_times == (0.0, 1e-5)
    assert (scene.section.axis, scene.section.coordinate) == (0, 0.02)
    assert scene.gravity == (0.0, 0.0, -9.81)
    assert (scene.ambient_pressure, scene.burn_width, scene.walls.x_low) == (1e5, 2.0, Wall.OPEN)


def test_the_default_section_cuts_the_thinnest_axis():
    builder = SceneBuilder("rod")
    builder.domain((0, 0, 0), (0.1, 0.1, 0.1), cell_size=0.01)
    builder.charge(Box((0.02, 0, 0), (0.04, 0.1, 0.1)), INERT)
    builder.end_time(1e-5)
    section = builder.build().section
    assert section.axis == 0
    assert section.coordinate == pytest.approx(0.03)


# ---- detonators ------------------------------------------------------------------------------------------------------


def two_charge_builder():
    builder = SceneBuilder("cube")
    builder.domain((0, 0, 0), (0.1, 0.1, 0.1), cell_size=0.01)
    builder.charge(Box((0, 0, 0), (0.05, 0.1, 0.1)), EXPLOSIVE, name="left")
    builder.charge(Box((0.05, 0, 0), (0.1, 0.1, 0.1)), EXPLOSIVE, name="right")
    builder.end_time(1e-5)
    return builder


def test_a_detonator_lights_the_charge_it_lies_in_and_both_between_two():
    builder = two_charge_builder()
    builder.detonator(PointDetonator((0.02, 0.05, 0.05)))
    builder.detonator(PointDetonator((0.104, 0.05, 0.05)))  # within half a cell of the surface
    builder.detonator(PointDetonator((0.05, 0.05, 0.05)))
    assert [detonator.charges for detonator in builder.build().detonators] == [("left",), ("right",), ("left", "right")]


def test_a_plane_lights_every_charge_it_cuts_or_touches_and_names_come_first():
    builder = two_charge_builder()
    builder.detonator(PlaneDetonator((0.0, 0.0, 0.0), normal=(0.0, 3.0, 0.0)))
    builder.detonator(PlaneDetonator((0.0, 0.0, 0.0), normal=(1.0, 0.0, 0.0)))
    builder.detonator(PointDetonator((0.02, 0.05, 0.05), charges=("right",)))
    assert [detonator.charges for detonator in builder.build().detonators] == [("left", "right"), ("left",), ("right",)]


def test_every_explosive_needs_a_detonator_or_a_neighbor_that_has_one():
    builder = two_charge_builder()
    builder.detonator(PointDetonator((0.02, 0.05, 0.05)))
    assert builder.build().detonators[0].charges == ("left",)
    builder = SceneBuilder("cube")
    builder.domain((0, 0, 0), (0.1, 0.1, 0.1), cell_size=0.01)
    builder.charge(Box((0, 0, 0), (0.05, 0.1, 0.1)), EXPLOSIVE, name="left")
    builder.charge(Box((0.07, 0, 0), (0.1, 0.1, 0.1)), EXPLOSIVE, name="right")
    builder.detonator(PointDetonator((0.02, 0.05, 0.05)))
    builder.end_time(1e-5)
    assert "charge 'right': expected a detonator that lights this explosive, got none" in refusal(builder.build)


@pytest.mark.parametrize(
    ("detonator", "message"),
    [
        (PointDetonator((0.107, 0.05, 0.05)), "got (0.107, 0.05, 0.05), 0.007 m outside every charge"),
        (PlaneDetonator((-0.02, 0, 0), (1, 0, 0)), "0.02 m outside every charge"),
        (PointDetonator((0.05, 0.05, 0.05), charges=("cub",)), "expected names from cube, gas, got 'cub'"),
        (PointDetonator((0.05, 0.05, 0.05), charges=("gas",)), "expected explosive charges, got 'gas', which is inert"),
    ],
)
def test_detonators_in_the_wrong_place(detonator, message):
    builder = cube_builder(cell_size=0.01, margins=0.1)
    builder.charge(Box((-0.1, 0, 0), (-0.05, 0.1, 0.1)), INERT, name="gas")
    builder.detonator(detonator)
    text = refusal(builder.build)
    assert text.startswith("scene cube: detonator 2: ")
    assert message in text


def test_an_inert_scene_has_nothing_to_light():
    builder = SceneBuilder("cube")
    builder.domain((0, 0, 0), (0.1, 0.1, 0.1), cell_size=0.01)
    builder.charge(CUBE, INERT)
    builder.end_time(1e-5)
    builder.detonator(PointDetonator((0.05, 0.05, 0.05)))
    assert "detonator 1: expected an explosive charge to light, got inert charges only" in refusal(builder.build)


# ---- refusals --------------------------------------------------------------------------------------------------------

CALLS = [
    (lambda b: b.domain((0, 0, 0), (1, 1, math.nan), cell_size=0.1), "domain: upper: expected three finite numbers"),
    (lambda b: b.domain((0, 0, 0), (1, -1, 1), cell_size=0.1), "domain: upper: expected above lower"),
    (lambda b: b.domain((0, 0, 0), (1, 1, 1)), "domain: expected either cell_size or cells, got neither"),
    (lambda b: b.domain((0, 0, 0), (1, 1, 1), cell_size=1, cells=(1, 1, 1)), "either cell_size or cells, got both"),
    (lambda b: b.domain((0, 0, 0), (1, 1, 1), cell_size=0.0), "domain: cell_size: expected a positive number, got 0.0"),
    (lambda b: b.domain((0, 0, 0), (1, 1, 1), cell_size=-1), "domain: cell_size: expected a positive number, got -1"),
    (lambda b: b.domain((0, 0, 0), (1, 1, 1), cell_size=math.inf), "domain: cell_size: expected a positive number"),
    (lambda b: b.domain((0, 0, 0), (1, 1, 1), cell_size=(1, 1)), "domain: cell_size: expected one number or 3"),
    (lambda b: b.domain((0, 0, 0), (1, 1, 1), cells=(1, 0, 1)), "domain: cells: expected a whole number of at least 1"),
    (lambda b: b.domain((0, 0, 0), (1, 1, 1), cell_size=1e-5), "domain: cells: expected at most 32000 per axis"),
    (lambda b: b.domain((0, 0, 0), (1, 1, 1), cell_size=1, margins=-1), "domain: margins: expected a number of at lea"),
    (lambda b: b.walls("open"), "walls: expected a Walls, got 'open'"),
    (lambda b: b.charge("box", EXPLOSIVE), "charge 'charge_2': solid: expected a Solid"),
    (lambda b: b.charge(CUBE, "tnt"), "charge 'charge_2': material: expected a Material, got 'tnt'; find_material()"),
    (lambda b: b.charge(CUBE, EXPLOSIVE, name="cube"), "charge 'cube': expected a name of its own"),
    (lambda b: b.charge(CUBE, EXPLOSIVE, particles_per_axis=0), "particles_per_axis: expected a whole number of at le"),
    (lambda b: b.detonator((0, 0, 0)), "detonator 2: expected a PointDetonator, LineDetonator"),
    (lambda b: b.detonator(PointDetonator((0, 0, math.inf))), "detonator 2: position: expected three finite numbers"),
    (
        lambda b: b.detonator(PointDetonator((0, 0, 0), time=-1e-6)),
        "detonator 2: time: expected a number of at least 0",
    ),
    (lambda b: b.detonator(PointDetonator((0, 0, 0), time=math.nan)), "detonator 2: time: expected a number of at lea"),
    (lambda b: b.detonator(PlaneDetonator((0, 0, 0), (0, 0, 0))), "detonator 2: normal: expected a vector of any leng"),
    (
        lambda b: b.detonator(LineDetonator((0, 0, 0), (0, 0, 0))),
        "detonator 2: expected two points or more, each",
    ),
    (lambda b: b.detonator(SphereDetonator((0, 0, 0), 0.0)), "detonator 2: radius: expected a positive number"),
    (lambda b: b.detonator(CordDetonator(((0, 0, 0),), 7e3)), "detonator 2: points: expected two points or more"),
    (lambda b: b.detonator(CordDetonator(((0, 0, 0), (0, 0, 1)), 0)), "detonator 2: speed: expected a positive number"),
    (lambda b: b.charge(CUBE, EXPLOSIVE, may_stay_unlit=1), "may_stay_unlit: expected True or False, got 1"),
    (lambda b: b.gravity((0, 0)), "gravity: expected three finite numbers"),
    (lambda b: b.ambient_pressure(-1), "ambient_pressure: expected a number of at least 0, got -1"),
    (lambda b: b.end_time(0), "end_time: expected a positive number, got 0"),
    (lambda b: b.end_time(math.inf), "end_time: expected a positive number, got inf"),
    (lambda b: b.burn_width(0), "burn_width: expected a positive number"),
    (lambda b: b.front_path((0, 0, 0), (0, 0, 0)), "front_path: end: expected another point than start"),
    (lambda b: b.line((0, 0, 0), (0, 0, math.nan)), "line: end: expected three finite numbers"),
    (lambda b: b.collision_point((0, 0, math.nan)), "collision_point 1: expected three finite numbers"),
    (lambda b: b.gauge((0, 0)), "gauge 'gauge_1': point: expected three finite numbers, got (0, 0)"),
    (lambda b: b.gauge((0, 0, 0), name="p, q"), "gauge 'p, q': name: expected letters, digits, '_', '-' and '.', got"),
    (lambda b: b.gauge((0, 0, 0), name=7), "gauge 7: name: expected letters, digits, '_', '-' and '.', got 7"),
    (lambda b: [b.gauge((0, 0, 0), name="a") for _ in "ab"], "gauge 'a': expected a name of its own, got one that"),
    (lambda b: b.gauge((0, 0, 0), moving="yes"), "gauge 'gauge_1': moving: expected True or False, got 'yes'"),
    (lambda b: b.picture_times([-1.0]), "picture_times: expected a number of at least 0, got -1.0"),
    (lambda b: b.section(3, 0.0), "section: axis: expected 0, 1 or 2, got 3"),
    (lambda b: b.section(0, math.nan), "section: coordinate: expected a finite number, got nan"),
]


@pytest.mark.parametrize(("call", "message"), CALLS, ids=[message for _, message in CALLS])
def test_values_are_checked_at_once(call, message):
    builder = cube_builder()
    assert message in refusal(lambda: call(builder))


BUILDS = [
    (lambda b: b.charge(Box((0.05, 0, 0), (0.2, 0.1, 0.1)), INERT), "expected inside the domain, x from 0 to 0.1 m"),
    (
        lambda b: b.charge(Sphere((0.05,) * 3, 0.02), INERT),
        "charge 'charge_2': expected room that the charges before it leave free ('cube'), got none",
    ),
    (lambda b: b.domain(CUBE.lower, CUBE.upper, cell_size=0.3), "expected at least one particle across, x extent 0.1"),
    (
        lambda b: b.domain(CUBE.lower, CUBE.upper, cells=(10, 10, 4)),
        "cells: expected edges that differ by a factor of 2",
    ),
    (lambda b: b.collision_point((0.05, 0.05, 0.2)), "collision_point 1: expected inside the domain"),
    (lambda b: b.front_path((0.05, 0.05, 0.05), (0.05, 0.05, 0.2)), "front_path: end: expected inside the domain"),
    (lambda b: b.line((0.05, 0.05, -0.1), (0.05, 0.05, 0.1)), "line: start: expected inside the domain"),
    (lambda b: b.section(2, 0.2), "section: expected inside the domain"),
    (lambda b: b.gauge((0.05, 0.05, 0.2)), "gauge 'gauge_1': expected inside the domain"),
    (lambda b: b.picture_times([2e-5]), "picture_times: expected at most the end time, 1e-05 s, got 2e-05 s"),
]


def test_a_moving_gauge_needs_matter_to_move_with():
    """It is carried by the nearest particle of any charge, at most a cell away; one that stays may be in a vacuum."""
    builder = cube_builder(cell_size=0.01, margins=0.05)
    builder.charge(Box((0.12, 0.0, 0.0), (0.14, 0.1, 0.1)), INERT)
    builder.gauge((0.131, 0.024, 0.099), moving=True)
    builder.gauge((0.11, 0.05, 0.05))
    scene = builder.build()
    carried, fixed = scene.gauges
    positions = np.concatenate([charge.positions for charge in scene.charges])
    assert positions[carried.particle] == pytest.approx((0.1325, 0.0225, 0.0975))
    assert (fixed.name, fixed.moving, fixed.particle) == ("gauge_2", False, None)
    builder.gauge((-0.03, 0.0525, 0.0525), name="far", moving=True)
    expected = "gauge 'far': expected matter within a cell of (-0.03, 0.0525, 0.0525) m to move with, got the nearest"
    assert f"{expected} particle 3.2 cells away; place it" in refusal(builder.build)


@pytest.mark.parametrize(("call", "message"), BUILDS, ids=[message for _, message in BUILDS])
def test_what_does_not_fit_together_is_refused_by_build(call, message):
    builder = cube_builder()
    call(builder)
    assert message in refusal(builder.build)


def test_an_incomplete_scene_is_refused():
    builder = SceneBuilder("cube")
    assert "domain: expected a value, got none; set it with domain()" in refusal(builder.build)
    builder.domain((0, 0, 0), (1, 1, 1), cell_size=0.1)
    assert "end_time: expected a value, got none" in refusal(builder.build)
    builder.end_time(1.0)
    assert "charges: expected at least one, got none" in refusal(builder.build)


def test_a_charge_without_particles_is_refused():
    builder = cube_builder(cell_size=0.01, margins=(0, 0.1, 0, 0, 0, 0))
    shell = Sphere((0.15, 0.05, 0.05), 0.02) - Sphere((0.15, 0.05, 0.05), 0.01999)
    builder.charge(shell, INERT, name="shell", particles_per_axis=1)
    assert "charge 'shell': expected at least one particle in it, got none" in refusal(builder.build)


def test_too_many_particles_are_refused_before_they_are_made(monkeypatch):
    def allocate(*_):
        raise AssertionError("positions were made before the memory was checked")

    monkeypatch.setattr(charges, "total_memory", lambda: 8000 * charges.BYTES_PER_PARTICLE - 1)
    monkeypatch.setattr("warp_mpm.lattice.Lattice.sites_in", allocate)
    message = refusal(cube_builder().build)
    assert "particles: expected at most 8e+03 in this machine's 0 GB, got 8e+03, which need" in message
    assert message.endswith(
        "choose a larger cell size or fewer particles per axis, or check the units: lengths are in metres"
    )


def test_memory_that_is_unknown_refuses_nothing(monkeypatch):
    monkeypatch.setattr(charges, "total_memory", lambda: None)
    assert cube_builder().build().particle_count == 8000


def test_a_poorly_resolved_shape_is_warned_about():
    builder = SceneBuilder("thin")
    builder.domain((0, 0, 0), (0.1, 0.1, 0.1), cell_size=0.02)
    builder.charge(Cylinder((0.05, 0.05, 0), (0.05, 0.05, 0.1), 0.009), INERT, name="rod")
    builder.end_time(1e-5)
    (warning,) = builder.build().warnings
    assert warning.startswith("charge 'rod': its 40 particles are -36% off their lattice's volume")


def test_material_warnings_reach_the_scene():
    builder = SceneBuilder("cube")
    builder.domain(CUBE.lower, CUBE.upper, cell_size=0.02)
    builder.charge(CUBE, ammonium_nitrate(energy=3.8e6, on_mismatch=OnMismatch.KEEP))
    builder.detonator(PointDetonator((0, 0, 0)))
    builder.end_time(1e-5)
    assert "4775 m/s" in builder.build().warnings[0]


@pytest.mark.parametrize("name", ["", "a b", "../a", ".hidden", "a/b"])
def test_names_that_do_not_suit_files_are_refused(name):
    with pytest.raises(InputError, match="scene: name: expected letters, digits"):
        SceneBuilder(name)


def test_walls_are_walls():
    with pytest.raises(InputError, match=r"^walls: x_low: expected one of .*, got 'open'; did you mean Wall\.OPEN\?$"):
        Walls.all("open")
    with pytest.raises(
        InputError, match=r"^walls: z_high: expected one of Wall\.SLIP, Wall\.STICK, Wall\.OPEN, got None$"
    ):
        Walls(z_high=None)
