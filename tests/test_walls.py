"""Walls: a slip wall is a mirror plane, exactly; a stick wall holds; a column between slip walls is one-dimensional.

Source: the method of images. Half of a symmetric flow, cut at its plane of symmetry, is the flow against a frictionless
wall there; `kernels/walls.py`.

`SAME` is a bound on 50 steps of single precision, relative to the scale of each quantity at the
Chapman-Jouguet state; seen are differences below 2e-6.
"""

import itertools

import numpy as np
import pytest
from scenes_for_tests import (
    CELL,
    OPEN,
    ORDERS_AND_TRANSFERS,
    ROUND_OFF,
    advance,
    block,
    explosive,
    inert_gas,
    nodes,
    particle_values,
    start,
)

from warp_mpm.config import ShapeFunction
from warp_mpm.detonators import PlaneDetonator, PointDetonator
from warp_mpm.scene import Wall, Walls

SAME = 1e-5
STEPS = 50  # the front crosses the half block and comes back
HALF = (6, 5, 4)  # cells
CJ = explosive().cj
SCALES = {
    "pressure": CJ.pressure,
    "velocity": CJ.particle_velocity,
    "density": CJ.density,
    "energy": explosive().specific_energy,
}

shapes = pytest.mark.parametrize("shape", list(ShapeFunction), ids=lambda shape: shape.value)


def halves_and_whole(axes, high, outer, device, **config):
    """Particle values on their lattices after STEPS steps: of the half block, and of the same half of the whole one.

    The planes of symmetry are slip walls on the low or the high faces of `axes`, through the detonator; the other faces
    are `outer` walls.
    """
    margin = 6 if outer is Wall.OPEN else 0
    whole = tuple(2 * n if axis in axes else n for axis, n in enumerate(HALF))
    faces, margins = [outer] * 6, [margin] * 6
    for axis in axes:
        faces[2 * axis + high], margins[2 * axis + high] = Wall.SLIP, 0

    def lit_at(cells, share):
        place = [CELL * n * (share if axis in axes else 0.3) for axis, n in enumerate(cells)]
        return [PointDetonator((place[0], place[1], place[2]))]

    half_scene = block(HALF, walls=Walls(*faces), margin_cells=margins, detonators=lit_at(HALF, float(high)))
    whole_scene = block(whole, walls=Walls.all(outer), margin_cells=margin, detonators=lit_at(whole, 0.5))
    same_half = tuple(slice(2 * n) if high or axis not in axes else slice(-2 * n, None) for axis, n in enumerate(HALF))
    half = lattice_values(advance(start(half_scene, device, **config), STEPS), HALF)
    full = lattice_values(advance(start(whole_scene, device, **config), STEPS), whole)
    return half, {name: values[same_half] for name, values in full.items()}


def lattice_values(solver, cells):
    """Particle values on the lattice they started from, (2 nx, 2 ny, 2 nz, ...)."""
    counts = [2 * n for n in cells]
    return {name: v.reshape(*counts, *v.shape[1:]) for name, v in particle_values(solver.state).items()}


def assert_same(half, whole, names):
    for name in names:
        difference = np.abs(half[name] - whole[name]).max() / SCALES[name]
        assert difference < SAME, f"{name}: {difference:.1e}"
    assert half["pressure"].max() > 0.1 * CJ.pressure  # something has happened


@shapes
@pytest.mark.parametrize(("axes", "high"), [((0,), 0), ((0,), 1), ((1,), 1), ((2,), 0), ((0, 1, 2), 0), ((1, 2), 1)])
def test_a_slip_wall_is_the_plane_of_symmetry(axes, high, shape, device):
    """Half, quarter and octant of a block in a rigid box are the whole: low and high walls, several axes at once."""
    half, whole = halves_and_whole(axes, high, Wall.SLIP, device, shape=shape)
    assert_same(half, whole, SCALES)


@pytest.mark.parametrize(("order", "transfer"), ORDERS_AND_TRANSFERS)
def test_every_transfer_is_mirrored(order, transfer, device):
    """The same for an octant with every order and transfer: each adds nodal quantities that walls fold and mirror."""
    half, whole = halves_and_whole((0, 1, 2), 0, Wall.SLIP, device, order=order, transfer=transfer)
    assert_same(half, whole, SCALES)


@pytest.mark.parametrize("outer", [Wall.OPEN, Wall.STICK], ids=["open", "stick"])
def test_a_slip_wall_meets_other_walls(outer, device):
    """An octant against slip walls on its low faces, and open or stick walls on the others.

    In thin gas next to a vacuum the velocity of single particles is that of nearly empty nodes, which is ill
    conditioned: it is compared as momentum density.
    """
    half, whole = halves_and_whole((0, 1, 2), 0, outer, device)
    for values in (half, whole):
        values["velocity"] = values["velocity"] * np.minimum(values["density"] / CJ.density, 1.0)[..., None]
    assert_same(half, whole, SCALES)


@shapes
def test_a_column_one_cell_wide_is_one_dimensional(shape, device):
    """One cell between slip walls carries the same plane wave as three times two cells, and nothing moves across.

    A plane wave in a wider column is one-dimensional by symmetry; round-off alone can break it.
    """
    plane = PlaneDetonator((0.0, 0.0, 0.0), normal=(1.0, 0.0, 0.0))
    columns = []
    for cells in ((24, 1, 1), (24, 3, 2)):
        solver = advance(start(block(cells, detonators=[plane]), device, shape=shape), STEPS)
        columns.append(lattice_values(solver, cells))
    narrow, wide = columns
    for name, scale in SCALES.items():
        difference = np.abs(wide[name] - narrow[name][:, :1, :1]).max() / scale
        assert difference < SAME, f"{name}: {difference:.1e}"
    assert np.abs(narrow["velocity"][..., 0]).max() > 0.3 * CJ.particle_velocity
    assert np.abs(narrow["velocity"][..., 1:]).max() < STEPS * ROUND_OFF * CJ.particle_velocity
    assert narrow["pressure"].max() > 0.5 * CJ.pressure


def wall_slices(axis, side):
    """Index of the wall's own nodes, of its ghosts, and of the nodes that these mirror, ghosts of others left out."""
    own, ghost, mirrored = ((1, 0, 2), (-2, -1, -3))[side]
    inside = [slice(1, -1)] * 3
    return [tuple(place if a == axis else inside[a] for a in range(3)) for place in (own, ghost, mirrored)]


def step_velocities(solver):
    """Node values in the middle of one more step: the velocities that move the particles and that do the work."""
    for name, run in solver.phases():
        if name == "strain and material":
            break
        run()
    return nodes(solver)


@pytest.mark.parametrize("shape", [ShapeFunction.BSPLINE, ShapeFunction.LINEAR], ids=["bspline", "linear"])
@pytest.mark.parametrize("wall", [Wall.STICK, Wall.SLIP], ids=["stick", "slip"])
def test_walls_hold_their_nodes(wall, shape, device):
    """Normal velocity and acceleration vanish at a wall's nodes, on a stick wall all components; ghosts are images.

    Behind a slip wall the normal component is reversed, behind a stick wall every one is. So it is with the velocities
    that move the particles and do the work in a step, of which the latter has the re-projected one in it.
    """
    solver = advance(start(block(HALF, walls=Walls.all(wall)), device, shape=shape), STEPS)
    values = nodes(solver)
    fastest = np.abs(values[..., 0:3]).max()
    assert fastest > 0.1 * CJ.particle_velocity
    stepped = step_velocities(solver)
    for axis, side in itertools.product(range(3), range(2)):
        own, ghost, mirrored = wall_slices(axis, side)
        held = [axis] if wall is Wall.SLIP else [0, 1, 2]
        free = [a for a in range(3) if a not in held]
        signs = np.ones(3)
        signs[held] = -1.0
        # Velocity and acceleration; then the velocities that move and work.
        for lanes, of_nodes in itertools.product((slice(0, 3), slice(4, 7)), (values, stepped)):
            lane = of_nodes[..., lanes]
            largest = np.abs(lane).max()
            assert largest > 0.0
            assert not lane[own][..., held].any()
            np.testing.assert_array_equal(lane[ghost], signs * lane[mirrored])
            for component in range(3):
                assert np.abs(lane[mirrored][..., component]).max() > 1e-3 * largest
            if free:
                assert np.abs(lane[own][..., free]).max() > 1e-3 * largest
        assert np.abs(stepped[..., 0:3]).max() > 0.5 * fastest


def test_a_stick_wall_holds_the_material(device):
    """Matter next to a stick wall moves neither into it nor along it, as it does along a slip wall."""
    plane = PlaneDetonator((0.0, 0.0, 0.0), normal=(1.0, 0.0, 0.0))
    cells = (16, 4, 4)

    def at_rest_beside(wall):
        walls = Walls(
            x_low=Wall.SLIP, x_high=Wall.SLIP, y_low=wall, y_high=Wall.SLIP, z_low=Wall.SLIP, z_high=Wall.SLIP
        )
        solver = start(block(cells, walls=walls, detonators=[plane]), device)
        before = lattice_values(solver, cells)["position"]
        after = lattice_values(advance(solver, STEPS), cells)
        assert after["position"].min() > 0.0
        return np.abs(after["position"] - before)[:, 0], np.abs(after["velocity"][:, 0, :, 0]).max()

    held_way, held_velocity = at_rest_beside(Wall.STICK)
    free_way, free_velocity = at_rest_beside(Wall.SLIP)
    # The layer is a quarter cell from the wall: linear from zero at the wall it would move a quarter as fast as the
    # nodes one cell off.
    assert held_velocity < 0.5 * free_velocity
    assert held_way[..., 0].max() < 0.5 * free_way[..., 0].max()
    assert held_way[..., 1].max() < 0.25 * CELL  # not through the wall


def test_open_faces_are_no_walls(device):
    """What reaches an open face goes through it unhindered: a block that coasts loses nothing but what has left."""

    def coast(state):
        velocity = np.broadcast_to(np.array([900.0, 0.0, 0.0], dtype=np.float32), (state.count, 3))
        state.assign("velocity", velocity)

    # Next to no pressure; 0.3 cells a step.
    scene = block(HALF, walls=OPEN, margin_cells=(0, 3, 0, 0, 0, 0), material=inert_gas(1000.0, energy=1.0))
    solver = advance(start(scene, device, prepare=coast), 18)
    values = particle_values(solver.state)
    gone = values["mass"] == 0.0
    way = 900.0 * float(solver.state.clock_values()["time"])
    start_x = scene.charges[0].positions[:, 0]
    reach = (HALF[0] + 3) * CELL
    # A particle leaves when its centre crosses; within a thousandth of a cell of the face it may do so a step later.
    assert np.all(gone[start_x + way > reach + 1e-3 * CELL])
    assert not np.any(gone[start_x + way < reach - 1e-3 * CELL])
    assert 0 < gone.sum() < len(gone)
    np.testing.assert_allclose(values["velocity"][~gone], [[900.0, 0.0, 0.0]] * int((~gone).sum()), atol=0.01)
