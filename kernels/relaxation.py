"""Relaxation of the particles' volumes: to the room that there is, and to equal pressure with what is around.

Volumes follow the strain, whose errors add up: particles that fill a cell together may have volumes, and so pressures,
that differ for no reason. For a gamma law the volume is passive, since p V depends on the energy alone, and the
relaxation changes what is shown but no motion. What was measured is in docs/numerics.md.
"""

import warp as wp

from warp_mpm.kernels.precision import HALF, ONE, scalar

RELAXATION = wp.constant(scalar(0.6))  # towards full cells, per cell that sound crosses
EQUALISATION = wp.constant(scalar(0.25))  # towards the pressure around, likewise


@wp.func
def relax_density(density: scalar, filling: scalar, excess: scalar, crossing: scalar) -> scalar:
    """Relax a volume to the room that there is, and to the pressure around it.

    rho J^(a / (1 + a)) exp(-x b / (1 + b)) with J the filling, x = (p - P) / (rho c^2) the excess over the pressure of
    the cells around, clamped to 1/2, and a, b = RELAXATION, EQUALISATION times dt c / h, the `crossing`.
    """
    filling_rate = RELAXATION * crossing
    pressure_rate = EQUALISATION * crossing
    exponent = wp.log(wp.max(filling, HALF)) * filling_rate / (ONE + filling_rate)
    exponent -= wp.clamp(excess, -HALF, HALF) * pressure_rate / (ONE + pressure_rate)
    return density * wp.exp(exponent)
