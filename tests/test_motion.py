"""Where particles go: into cells, out through open faces, never past a wall; one that is lost stops the run."""

import functools

import numpy as np
import pytest
import warp as wp
from scenes_for_tests import CELL, OPEN, ROUND_OFF, advance, block, inert_gas, particle_values, start

from warp_mpm.errors import SimulationError
from warp_mpm.guards import check_state
from warp_mpm.kernels import motion
from warp_mpm.kernels.precision import LAST_FRACTION, scalar, vector3


@functools.cache
def place_kernel():
    """Kernel that moves one particle a thread."""

    @wp.kernel(enable_backward=False, module="unique")
    def evaluate(
        faces: motion.Faces,
        cells: wp.array(dtype=wp.vec3s),
        fractions: wp.array(dtype=vector3),
        ways: wp.array(dtype=vector3),
        rows: wp.array2d(dtype=scalar),
    ):
        n = wp.tid()
        domain = wp.vec3i(10, 10, 10)
        after = motion.place(domain, faces, cells[n], fractions[n], ways[n])
        for axis in range(3):
            rows[n, axis] = scalar(after.cell[axis])
            rows[n, 3 + axis] = after.fraction[axis]
        rows[n, 6] = scalar(after.left_through)
        rows[n, 7] = wp.where(after.fault, scalar(1.0), scalar(0.0))

    return evaluate


PLACES = {  # cell, fraction and displacement along x -> cell, fraction, face left through, fault
    "within its cell": ((3, 0.25, 0.5), (3, 0.75, -1, False)),
    "up a cell": ((3, 0.75, 0.5), (4, 0.25, -1, False)),
    "down two cells": ((3, 0.25, -1.5), (1, 0.75, -1, False)),
    "onto a face": ((3, 0.5, 0.5), (4, 0.0, -1, False)),
    "a rounding below a face": ((3, 0.0, -1e-10), (2, float(LAST_FRACTION), -1, False)),
    "through the open low face": ((0, 0.25, -0.5), (0, 0.0, 0, False)),
    "through the open high face": ((9, 0.75, 3.5), (9, float(LAST_FRACTION), 1, False)),
    "absurdly far": ((3, 0.25, 4.5), (None, None, -1, True)),
}


@pytest.mark.parametrize("case", PLACES.values(), ids=PLACES.keys())
def test_where_a_particle_goes(case, device):
    """A cell and a fraction of it, 0 <= f < 1; out through an open face; a fault where no stencil may go."""
    (cell, fraction, way), (new_cell, new_fraction, face, fault) = case
    row = placed((cell, 5, 5), (fraction, 0.5, 0.5), (way, 0.0, 0.0), device)
    assert row[6] == face
    assert bool(row[7]) is fault
    if new_cell is not None:
        assert row[0] == new_cell
        assert row[3] == np.float32(new_fraction)
        assert tuple(row[1:3]) == (5.0, 5.0)
        assert tuple(row[4:6]) == (0.5, 0.5)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("way", [np.nan, 4.5, -np.inf])
def test_no_way_is_too_far_along_one_axis(axis, way, device):
    """One component that is no number, or too large, is a fault whatever the others are."""
    ways = np.zeros(3)
    ways[axis] = way
    row = placed((3, 5, 5), (0.25, 0.5, 0.5), ways, device)
    assert row[7] == 1.0
    assert row[6] == -1.0


@pytest.mark.parametrize(("cell", "fraction", "way"), [(0, 0.0, -1e-4), (9, 0.99999, 1e-3), (0, 0.5, -0.75)])
def test_no_particle_passes_a_wall(cell, fraction, way, device):
    """Y faces are walls here: what would cross one by round-off, or more, stays on it."""
    row = placed((4, cell, 5), (0.5, fraction, 0.5), (0.0, way, 0.0), device)
    assert row[1] == cell
    assert row[4] == (0.0 if way < 0.0 else float(LAST_FRACTION))
    assert row[6] == -1.0
    assert row[7] == 0.0


def placed(cell, fraction, way, device):
    """Where `motion.place` puts a particle; only the faces along x are open."""
    faces = motion.Faces()
    faces.open[0], faces.open[1] = 1, 1
    rows = wp.zeros((1, 8), dtype=scalar, device=device)
    given = [
        wp.array(np.array([cell], dtype=np.int16), dtype=wp.vec3s, device=device),
        wp.array(np.array([fraction], dtype=np.float32), dtype=vector3, device=device),
        wp.array(np.array([way], dtype=np.float32), dtype=vector3, device=device),
    ]
    wp.launch(place_kernel(), 1, inputs=[faces, *given, rows], device=device)
    return rows.numpy()[0]


def test_a_particle_that_leaves_its_reach_stops_the_run(device):
    """Nodes that run away take a particle along: the error says which, where and when, and no array is overrun."""
    solver = start(block((6, 4, 3)), device)
    state = solver.state
    values = state.grid.start.numpy().copy()
    values[:, 0] = 1e9  # [m/s]
    state.grid.start.assign(values)
    solver.step()
    with pytest.raises(SimulationError) as caught:
        check_state(state, 1)
    message = str(caught.value)
    assert "\n" not in message
    assert "block: step 1 at 1.071 us: particle " in message
    assert "charge 'block' (ammonium nitrate)" in message
    assert "; try a smaller cfl" in message
    cells = particle_values(state)["cell"]
    assert cells.min() >= 0
    assert np.all(cells < (6, 4, 3))


def test_a_fast_particle_shortens_the_step(device):
    """10 km/s at the start: the step is 0.3 h / (c + |v|) along its axis, and it moves 0.3 cells at most."""

    def hit(state):
        velocity = state.values("velocity").copy()
        velocity[:, 1] = 1e4
        state.assign("velocity", velocity)

    gas = inert_gas(1.0, 1e5)
    solver = start(block((4, 4, 4), material=gas, walls=OPEN, margin_cells=6), device, prepare=hit)
    before = particle_values(solver.state)["position"]
    advance(solver, 1)
    sound = np.sqrt(1.4 * 0.4 * 1e5)
    dt = float(solver.state.clock_values()["dt"])
    assert dt == pytest.approx(0.3 * CELL / (1e4 + sound), rel=8 * ROUND_OFF)
    moved = np.abs(particle_values(solver.state)["position"] - before).max()
    assert 0.25 * CELL < moved < 0.3 * CELL
