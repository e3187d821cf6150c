"""Artificial viscosity (von Neumann and Richtmyer 1950, with Landshoff's linear term; as in LS-DYNA and MPM3D)."""

import warp as wp

from warp_mpm.kernels.precision import ZERO, scalar


@wp.struct
class Viscosity:
    """Coefficients and length of the artificial viscosity."""

    quadratic: scalar  # c_Q
    linear: scalar  # c_L
    length: scalar  # l = (hx hy hz)^(1/3) [m]


@wp.func
def viscous_pressure(viscosity: Viscosity, density: scalar, sound_speed: scalar, divergence: scalar) -> scalar:
    """Q = rho l (c_Q l d^2 - c_L c d) [Pa] in compression (d = div v < 0), else 0."""
    compression = wp.min(divergence, ZERO)
    quadratic = viscosity.quadratic * viscosity.length * compression * compression
    return density * viscosity.length * (quadratic - viscosity.linear * sound_speed * compression)


@wp.func
def viscous_rate(viscosity: Viscosity, sound_speed: scalar, divergence: scalar) -> scalar:
    """Viscosity over length squared, nu / l^2 [1/s]: one explicit step may not exceed a Courant number over this."""
    compression = wp.max(-divergence, ZERO)
    active = wp.where(compression > ZERO, viscosity.linear * sound_speed / viscosity.length, ZERO)
    return viscosity.quadratic * compression + active
