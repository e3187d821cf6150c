"""What the problems of inert gases in SI units share."""

import numpy as np

from warp_mpm.verification.fields import FIELD_NAMES, Fields
from warp_mpm.verification.problem import DENSITY, VELOCITY, Axis, Panel

POSITION, RADIUS = Axis("x", "m"), Axis("radius", "m")
COLD = 1e-6  # specific energy of a gas without pressure [J/kg]; that of the problems' flows is about 1


def gas_panels(position: Axis) -> tuple[Panel, ...]:
    """Panels "pressure", "velocity" and "density" against a position, in pascals."""
    named = (("pressure", Axis("pressure", "Pa")), ("velocity", VELOCITY), ("density", DENSITY))
    return tuple(Panel(name, position, axis) for name, axis in named)


def part_of(fields: Fields, cells: slice | np.ndarray) -> Fields:
    """The fields in some of the cells: a slice along x, or a mask (nx, ny, nz)."""
    return Fields(*(getattr(fields, name)[cells] for name in FIELD_NAMES))
