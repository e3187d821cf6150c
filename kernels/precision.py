"""The scalar type of the simulation, the vector types built on it, and the literals that kernels use.

Types are part of every kernel, so the precision is chosen once, before this module is imported, by the environment
variable `WARP_MPM_PRECISION`: single (the default) or double. Warp does not promote a float literal to another scalar
type, so kernels take their constants from here. Time and the audited sums are always double.
"""

import os

import warp as wp

VARIABLE = "WARP_MPM_PRECISION"
SCALARS = {"single": (wp.float32, "float", 24), "double": (wp.float64, "double", 53)}

PRECISION = os.environ.get(VARIABLE) or "single"
if PRECISION not in SCALARS:
    raise ValueError(f"{VARIABLE}: expected {' or '.join(SCALARS)}, got {PRECISION!r}")

scalar, REAL, DIGITS = SCALARS[PRECISION]  # the type, its name in C++, its binary digits
BYTES = wp.types.type_size_in_bytes(scalar)

vector2 = wp.types.vector(2, scalar)
vector3 = wp.types.vector(3, scalar)
vector4 = wp.types.vector(4, scalar)
vector8 = wp.types.vector(8, scalar)
matrix2 = wp.types.matrix((2, 2), scalar)
matrix3 = wp.types.matrix((3, 3), scalar)

single = wp.float32  # of surfaces of triangles, which Warp searches in this precision alone
single_vector3 = wp.vec3f

ZERO = wp.constant(scalar(0.0))
HALF = wp.constant(scalar(0.5))
THREE_QUARTERS = wp.constant(scalar(0.75))
ONE = wp.constant(scalar(1.0))
TWO = wp.constant(scalar(2.0))
FOUR = wp.constant(scalar(4.0))

LAST_FRACTION = wp.constant(scalar(1.0 - 0.5**DIGITS))
"""The largest number below one."""

NEVER = wp.constant(scalar(1.0e30))
"""A time that never comes [s]: the arrival time of matter that no detonator lights."""
