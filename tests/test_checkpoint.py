"""A solver made anew from what was saved of another goes on as that one does, bit for bit."""

import pytest
import warp as wp
from scenes_for_tests import ORDERS_AND_TRANSFERS, advance, block, start

from warp_mpm.checkpoint import restore_solver, saved_solver
from warp_mpm.scene import Wall, Walls


@pytest.mark.parametrize(("order", "transfer"), ORDERS_AND_TRANSFERS)
@pytest.mark.parametrize("steps", [0, 3, 31])
def test_a_restored_solver_goes_on_bit_for_bit(order, transfer, steps):
    """Against two walls and into the open; between two sortings, soon after one, and before the first step."""
    walls = Walls(Wall.SLIP, Wall.OPEN, Wall.STICK, Wall.OPEN, Wall.OPEN, Wall.OPEN)
    free = block((8, 6, 4), walls=walls, margin_cells=(0, 2, 0, 2, 2, 2))
    solver = advance(start(free, order=order, transfer=transfer), steps)
    saved = saved_solver(solver)
    restored = start(free, order=order, transfer=transfer)
    restore_solver(restored, saved)
    assert_same_arrays(saved_solver(restored), saved)
    assert_same_arrays(everything(advance(restored, 25)), everything(advance(solver, 25)))


def everything(solver):
    """What is saved, and what should be."""
    state = solver.state
    accounts = [name for name, value in vars(state).items() if isinstance(value, wp.array) and not name.startswith("_")]
    assert {"clock", "impulses", "tallies", "peaks"} <= set(accounts)
    return {**saved_solver(solver), **{name: getattr(state, name).numpy().copy() for name in accounts}}


def assert_same_arrays(some, others):
    assert some.keys() == others.keys()
    for name, array in some.items():
        for field in array.dtype.names or (...,):  # without what is between the fields
            assert array[field].tobytes() == others[name][field].tobytes(), (name, field)
