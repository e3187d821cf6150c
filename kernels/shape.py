"""Shape functions: how a particle's extent is spread over the nodes, one axis at a time.

A particle sits at `fraction` (0 <= f < 1) of its cell. Along an axis its stencil is `width` consecutive nodes, the
first one `offset(f)` nodes from the cell's lower node. `weight(s, l)` and `slope(s, l)` = dw/ds take the distance
s = (particle - node) / spacing and the particle's half width l in cells (used by GIMP alone). `affine(s, l, f)` is the
weight with which APIC measures the velocity gradient, w s / sum(w s^2) up to sign, in 1 / cell.

All weights sum to one and reproduce linear fields (tested for every member of `SHAPES`).
"""

from dataclasses import dataclass

import warp as wp

from warp_mpm.kernels.precision import FOUR, HALF, ONE, THREE_QUARTERS, TWO, ZERO, scalar


@dataclass(frozen=True)
class Shape:
    """A shape function, as the device functions that the transfer is composed from."""

    name: str
    width: int  # nodes per axis
    offset: wp.Function  # (fraction) -> int
    weight: wp.Function  # (distance, half_width) -> scalar
    slope: wp.Function  # (distance, half_width) -> scalar, derivative of the weight by the distance
    affine: wp.Function  # (distance, half_width, fraction) -> scalar
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
def linear_weight(distance: scalar, half_width: scalar) -> scalar:
    """Tent function: 1 - |s|."""
    return wp.max(ONE - wp.abs(distance), ZERO)


@wp.func
def linear_slope(distance: scalar, half_width: scalar) -> scalar:
    """-sign(s): one-sided at a node, where the particle belongs to the cell above."""
    return wp.where(distance < ZERO, ONE, -ONE)


@wp.func
def linear_affine(distance: scalar, half_width: scalar, fraction: scalar) -> scalar:
    """W s / (f (1 - f)), which is the slope itself."""
    return linear_slope(distance, half_width)


@wp.func
def bspline_weight(distance: scalar, half_width: scalar) -> scalar:
    """Quadratic B-spline (Steffen, Kirby, Berzins 2008, eq. 21)."""
    s = wp.abs(distance)
    outer = scalar(1.5) - s
    return wp.where(s < HALF, THREE_QUARTERS - s * s, HALF * outer * outer)


@wp.func
def bspline_slope(distance: scalar, half_width: scalar) -> scalar:
    """Derivative of the quadratic B-spline."""
    s = wp.abs(distance)
    outer = wp.where(distance < ZERO, scalar(1.5) - s, s - scalar(1.5))
    return wp.where(s < HALF, -TWO * distance, outer)


@wp.func
def bspline_affine(distance: scalar, half_width: scalar, fraction: scalar) -> scalar:
    """-4 w s: the second moment of the quadratic B-spline is 1/4 cell^2 everywhere (Jiang et al. 2015)."""
    return -FOUR * distance * bspline_weight(distance, half_width)


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
def gimp_affine(distance: scalar, half_width: scalar, fraction: scalar) -> scalar:
    """-w s / sum(w s^2) over the three nodes of the stencil."""
    first = fraction - scalar(offset_nearest_node(fraction))
    second = first - ONE
    third = first - TWO
    moment = gimp_weight(first, half_width) * first * first
    moment += gimp_weight(second, half_width) * second * second
    moment += gimp_weight(third, half_width) * third * third
    return -gimp_weight(distance, half_width) * distance / moment


LINEAR = Shape(
    "linear", 2, offset_lower_node, linear_weight, linear_slope, linear_affine, 0.0
)  # its forces jump from cell to cell: not sharpened
GIMP = Shape(
    "gimp", 3, offset_nearest_node, gimp_weight, gimp_slope, gimp_affine, 3.0 / 16.0
)  # 1/6 + l^2/3, 2 particles an axis
BSPLINE = Shape("bspline", 3, offset_nearest_node, bspline_weight, bspline_slope, bspline_affine, 1.0 / 4.0)

SHAPES = (LINEAR, GIMP, BSPLINE)
