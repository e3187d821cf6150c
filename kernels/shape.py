"""Shape functions: how a particle's extent is spread over the nodes, one axis at a time.

A particle sits at `fraction` (0 <= f < 1) of its cell. Along an axis its stencil is `width` consecutive nodes, the
first one `offset(f)` nodes from the cell's lower node. `weights(f, l)` and `slopes(f, l)` are those of all its nodes;
l is the particle's half width in cells (used by GIMP alone), slopes are dw/ds, s = (particle - node) / spacing.
`affine(f, l)` are the weights with which APIC measures the velocity gradient, w s / sum(w s^2) up to sign, in 1 / cell.

All weights sum to one and reproduce linear fields (tested for every member of `SHAPES`).
"""

from dataclasses import dataclass

import warp as wp

from warp_mpm.kernels.precision import FOUR, HALF, ONE, THREE_QUARTERS, TWO, ZERO, scalar, vector2, vector3


@dataclass(frozen=True)
class Shape:
    """A shape function, as the device functions that the transfer is composed from."""

    name: str
    width: int  # nodes per axis
    offset: wp.Function  # (fraction) -> int
    weights: wp.Function  # (fraction, half_width) -> vector of `width`
    slopes: wp.Function  # (fraction, half_width) -> vector of `width`, derivatives by the distance
    affine: wp.Function  # (fraction, half_width) -> vector of `width`
    spread: float  # second moment of the weights [cells^2] that sharpening takes back (see `sharpen.py`)


@wp.func
def offset_lower_node(fraction: scalar) -> int:
    """Nodes of the cell itself."""
    return 0


@wp.func
def offset_nearest_node(fraction: scalar) -> int:
    """Three nodes around the nearest one."""
    return wp.where(fraction < HALF, -1, 0)


@wp.func
def from_nearest_node(fraction: scalar) -> scalar:
    """Distance of a particle from the nearest node [cells], -1/2 to 1/2."""
    return wp.where(fraction < HALF, fraction, fraction - ONE)


@wp.func
def linear_weights(fraction: scalar, half_width: scalar) -> vector2:
    """Tent function: 1 - |s|."""
    return vector2(ONE - fraction, fraction)


@wp.func
def linear_slopes(fraction: scalar, half_width: scalar) -> vector2:
    """-sign(s): one-sided at a node, where the particle belongs to the cell above."""
    return vector2(-ONE, ONE)


@wp.func
def linear_affine(fraction: scalar, half_width: scalar) -> vector2:
    """W s / (f (1 - f)), which is the slope itself."""
    return vector2(-ONE, ONE)


@wp.func
def bspline_weights(fraction: scalar, half_width: scalar) -> vector3:
    """Quadratic B-spline (Steffen, Kirby, Berzins 2008, eq. 21): 3/4 - s^2 near a node, (3/2 - |s|)^2 / 2 farther."""
    s = from_nearest_node(fraction)
    below = HALF - s
    above = HALF + s
    return vector3(HALF * below * below, THREE_QUARTERS - s * s, HALF * above * above)


@wp.func
def bspline_slopes(fraction: scalar, half_width: scalar) -> vector3:
    """Derivatives of the quadratic B-spline."""
    s = from_nearest_node(fraction)
    return vector3(s - HALF, -TWO * s, s + HALF)


@wp.func
def bspline_affine(fraction: scalar, half_width: scalar) -> vector3:
    """-4 w s: the second moment of the quadratic B-spline is 1/4 cell^2 everywhere (Jiang et al. 2015)."""
    s = from_nearest_node(fraction)
    return -FOUR * wp.cw_mul(bspline_weights(fraction, half_width), vector3(s + ONE, s, s - ONE))


@wp.func
def gimp_weight(distance: scalar, half_width: scalar) -> scalar:
    """Uniform GIMP: the tent function averaged over the particle's width (Bardenhagen and Kober 2004, eq. 39)."""
    s = wp.abs(distance)
    outer = ONE + half_width - s
    near = ONE - (distance * distance + half_width * half_width) / (TWO * half_width)
    far = HALF * HALF * outer * outer / half_width
    weight = wp.where(s < half_width, near, ONE - s)
    weight = wp.where(s > ONE - half_width, far, weight)
    return wp.where(s < ONE + half_width, weight, ZERO)


@wp.func
def gimp_slope(distance: scalar, half_width: scalar) -> scalar:
    """Derivative of the uniform GIMP function."""
    s = wp.abs(distance)
    side = wp.where(distance < ZERO, ONE, -ONE)
    slope = wp.where(s < half_width, -distance / half_width, side)
    slope = wp.where(s > ONE - half_width, side * HALF * (ONE + half_width - s) / half_width, slope)
    return wp.where(s < ONE + half_width, slope, ZERO)


@wp.func
def gimp_weights(fraction: scalar, half_width: scalar) -> vector3:
    """Uniform GIMP at the three nodes."""
    s = from_nearest_node(fraction)
    return vector3(gimp_weight(s + ONE, half_width), gimp_weight(s, half_width), gimp_weight(s - ONE, half_width))


@wp.func
def gimp_slopes(fraction: scalar, half_width: scalar) -> vector3:
    """Its derivatives."""
    s = from_nearest_node(fraction)
    return vector3(gimp_slope(s + ONE, half_width), gimp_slope(s, half_width), gimp_slope(s - ONE, half_width))


@wp.func
def gimp_affine(fraction: scalar, half_width: scalar) -> vector3:
    """-w s / sum(w s^2) over the three nodes of the stencil."""
    s = from_nearest_node(fraction)
    distances = vector3(s + ONE, s, s - ONE)
    weighted = wp.cw_mul(gimp_weights(fraction, half_width), distances)
    return -weighted / wp.dot(weighted, distances)


LINEAR = Shape(
    "linear", 2, offset_lower_node, linear_weights, linear_slopes, linear_affine, 0.0
)  # its forces jump from cell to cell: not sharpened
GIMP = Shape(
    "gimp", 3, offset_nearest_node, gimp_weights, gimp_slopes, gimp_affine, 3.0 / 16.0
)  # 1/6 + l^2/3, 2 particles an axis
BSPLINE = Shape("bspline", 3, offset_nearest_node, bspline_weights, bspline_slopes, bspline_affine, 1.0 / 4.0)

SHAPES = (LINEAR, GIMP, BSPLINE)
