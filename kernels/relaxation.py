"""Relaxation of the particles' volumes: to the room that there is, and to equal pressure with what is around.

Volumes follow the strain, whose errors add up: particles that fill a cell together may have volumes, and so pressures,
that differ for no reason. For a gamma law the volume is passive, since p V depends on the energy alone, and the
relaxation changes what is shown but no motion. For other laws it moves matter, as it should: without it errors of the
volumes add up to errors of the pressure. But relaxing to equal pressures blunts a front there, because those of the
cells around are smoothed ones, and so it is five times slower. And a liquid must not be relaxed at all where its
pressure is small: at a free surface, where cells are never quite full, it would be torn. See `gas_share`; what was
measured is in docs/numerics.md.
"""

import warp as wp

from warp_mpm.kernels.precision import FOUR, HALF, ONE, TWO, ZERO, scalar

RELAXATION = wp.constant(scalar(0.6))  # towards full cells, per cell that sound crosses
THIRD = wp.constant(scalar(1.0 / 3.0))
FIFTH = wp.constant(scalar(0.2))
TWELFTH = wp.constant(scalar(1.0 / 12.0))
PASSIVE_EQUALISATION = wp.constant(scalar(0.25))  # towards the pressure around, likewise, where the volume is passive
TINY = wp.constant(scalar(1.0e-30))  # no pressure [Pa]
ACTIVE_EQUALISATION = wp.constant(scalar(0.05))  # and where it is not


@wp.func
def logarithm(value: scalar) -> scalar:
    """The natural logarithm near 1, by its series in u = (x - 1) / (x + 1): to 3e-4 of itself from 1/2 to 2.

    A call of the library's would cost a fifth of the material update, and no more is asked of a rate of relaxation.
    """
    u = (value - ONE) / (value + ONE)
    return TWO * u * (ONE + u * u * (THIRD + FIFTH * u * u))


@wp.func
def exponential(value: scalar) -> scalar:
    """The exponential of small numbers, by the (2, 2) Pade approximant: to round-off up to 0.1, to 4e-6 up to 0.3."""
    even = ONE + TWELFTH * value * value
    odd = HALF * value
    return (even + odd) / (even - odd)


@wp.func
def gas_share(pressure: scalar, modulus: scalar) -> scalar:
    """1 in a gas, down to 0 in a liquid at the pressure of its surroundings, by 4 p / (rho c^2).

    `pressure` [Pa] is that above the ambient one; p / (rho c^2) is 1 / gamma in a gas, 4e-5 in water at 1 bar. A
    relative error of a volume is one of the pressure rho c^2 / p times as large.
    """
    return wp.clamp(FOUR * pressure / modulus, ZERO, ONE)


@wp.func
def yielding(pressure: scalar, around: scalar, filling: scalar) -> scalar:
    """Share of the relaxation to the room that a particle takes part in: 1, down to 0 where it would run away.

    Where cells are too full, matter under a pressure that is high already does not shrink, that around it does; where
    they are not full, matter under next to none does not grow. From a ratio of 2 on the share falls, to 0 at 4.
    """
    high = wp.where(filling > ONE, pressure, around)
    low = wp.where(filling > ONE, around, pressure)
    return wp.clamp(TWO - HALF * high / wp.max(low, TINY), ZERO, ONE)


@wp.func
def relax_density(
    density: scalar, filling: scalar, excess: scalar, room: scalar, crossing: scalar, equalisation: scalar
) -> scalar:
    """Relax a volume to the room that there is, and to the pressure around it.

    rho J^(a / (1 + a)) exp(-x b / (1 + b)) with J the filling, x = (p - P) / (rho c^2) the excess over the pressure of
    the cells around, clamped to 1/2, and a, b = `room` RELAXATION, `equalisation` times dt c / h, the `crossing`.
    """
    filling_rate = RELAXATION * room * crossing
    pressure_rate = equalisation * crossing
    exponent = logarithm(wp.max(filling, HALF)) * filling_rate * (ONE + pressure_rate)
    exponent -= wp.clamp(excess, -HALF, HALF) * pressure_rate * (ONE + filling_rate)
    return density * exponential(exponent / ((ONE + filling_rate) * (ONE + pressure_rate)))
