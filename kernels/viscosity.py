"""Artificial viscosity (von Neumann and Richtmyer 1950, with Landshoff's linear term), directed where it matters.

A shock compresses along its normal; gas that converges smoothly is compressed across its motion too, and must not be
heated for that. M. L. Wilkins (J. Comput. Phys. 36, 281, 1980) therefore takes the strain rate along the acceleration,
which is the shock's normal. Here the viscosity is a pressure tensor

    Q (b b^T + (1 - |b|^2) I),    d = b . (grad v) . b + (1 - |b|^2) div v,    Q = rho l (c_Q l d^2 - c_L c d) if d < 0,
    1 / l^2 = sum b_i^2 / h_i^2 + (1 - |b|^2) / (hx hy hz)^(2/3),

with b along the acceleration: nearly a unit vector where the compression is strong, |b|^2 = x^2 / (x^2 + x0^2) with
x = (l div v)^2 and x0 = (0.2 c)^2, and small where it is weak, so that noise has no say in the direction. Along one
axis it is the scalar viscosity, whatever |b| is. Its length l is that of the cell along b, so that a shock is as many
cells wide along every axis of cells that are no cubes.
"""

import warp as wp

from warp_mpm.kernels.precision import ONE, ZERO, scalar, vector3

DIRECTED = wp.constant(scalar(0.2))  # of the sound speed: velocity jump over a cell from which on it is directed
TINY = wp.constant(scalar(1.0e-30))  # keeps rest from being divided by


@wp.struct
class Viscosity:
    """Coefficients and lengths of the artificial viscosity."""

    quadratic: scalar  # c_Q
    linear: scalar  # c_L
    length: scalar  # (hx hy hz)^(1/3) [m], l without a direction
    inverse_length: scalar  # [1/m]
    inverse_spacing: vector3  # 1 / h_i [1/m]


@wp.func
def unit_vector(value: vector3) -> vector3:
    """Value / |value|, or 0 where that is too small to have a direction."""
    size = wp.dot(value, value)
    return wp.where(size > TINY, ONE / wp.sqrt(size), ZERO) * value


@wp.func
def directedness(viscosity: Viscosity, sound_speed: scalar, divergence: scalar) -> scalar:
    """|b|: 1 where the compression is strong, 0 where it is weak."""
    closing = viscosity.length * divergence
    threshold = DIRECTED * sound_speed
    closing = closing * closing
    threshold = threshold * threshold
    squared = closing * closing + threshold * threshold
    return wp.where(squared > TINY, closing / wp.sqrt(squared), ZERO)


@wp.func
def closing_rate(share: scalar, along: scalar, divergence: scalar) -> scalar:
    """d = b . (grad v) . b + (1 - |b|^2) div v [1/s], with |b|^2 the share and `along` the strain rate along b."""
    return share * along + (ONE - share) * divergence


@wp.func
def viscous_length(viscosity: Viscosity, axis: vector3) -> scalar:
    """l [m] for the axis b."""
    along = wp.cw_mul(axis, viscosity.inverse_spacing)
    rest = (ONE - wp.dot(axis, axis)) * viscosity.inverse_length * viscosity.inverse_length
    return ONE / wp.sqrt(wp.dot(along, along) + rest)


@wp.func
def viscous_pressure(
    viscosity: Viscosity, length: scalar, density: scalar, sound_speed: scalar, rate: scalar
) -> scalar:
    """Q = rho l (c_Q l d^2 - c_L c d) [Pa] for a closing rate d < 0, else 0."""
    compression = wp.min(rate, ZERO)
    quadratic = viscosity.quadratic * length * compression * compression
    return density * length * (quadratic - viscosity.linear * sound_speed * compression)


@wp.func
def viscous_rate(viscosity: Viscosity, sound_speed: scalar, rate: scalar) -> scalar:
    """Viscosity over length squared, nu / l^2 [1/s]: one explicit step may not exceed a Courant number over this."""
    compression = wp.max(-rate, ZERO)
    active = wp.where(compression > ZERO, viscosity.linear * sound_speed * viscosity.inverse_length, ZERO)
    return viscosity.quadratic * compression + active
