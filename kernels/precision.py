"""The scalar type of the simulation, the vector types built on it, and the literals that kernels use.

Warp does not promote a float literal to another scalar type, so kernels take their constants from here. Time and the
audited sums are always double. Only single precision works: host code still calls device functions with Python numbers,
which Warp does not match to a double `scalar`.
"""

import warp as wp

scalar = wp.float32

vector2 = wp.types.vector(2, scalar)
vector3 = wp.types.vector(3, scalar)
vector4 = wp.types.vector(4, scalar)
vector8 = wp.types.vector(8, scalar)
matrix3 = wp.types.matrix((3, 3), scalar)

ZERO = wp.constant(scalar(0.0))
QUARTER = wp.constant(scalar(0.25))
HALF = wp.constant(scalar(0.5))
THREE_QUARTERS = wp.constant(scalar(0.75))
ONE = wp.constant(scalar(1.0))
TWO = wp.constant(scalar(2.0))
FOUR = wp.constant(scalar(4.0))

NEVER = wp.constant(scalar(1.0e30))
"""A time that never comes [s]: the arrival time of matter that no detonator lights."""
