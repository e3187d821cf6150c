"""How fast initial velocities strain the material: the first time step must know it, as later ones do."""

import functools

import warp as wp

from warp_mpm.kernels.precision import ZERO, scalar
from warp_mpm.kernels.records import STRAIN_RATE, Grid, Maxima, Particles, raise_maxima
from warp_mpm.kernels.shape import Shape
from warp_mpm.kernels.strain import Strain, strain_function


@functools.cache
def initial_strain_kernel(shape: Shape) -> wp.Kernel:
    """Raise the strain rate, |div v| of the velocity on the grid at each particle [1/s], among the maxima."""
    gather_strain = strain_function(shape, Strain.START, False)

    @wp.kernel(enable_backward=False, module="unique")
    def measure_strain(
        particles: Particles, grid: Grid, half_width: scalar, maxima: wp.array(dtype=Maxima), slab: int, begin: int
    ):
        p = begin + wp.tid()
        position = particles.position[p]
        velocity = particles.motion[p].velocity
        strain = gather_strain(grid, position.cell, position.fraction, velocity, half_width, ZERO)
        rates = Maxima()
        rates[STRAIN_RATE] = wp.abs(wp.trace(strain.gradient))
        raise_maxima(maxima, slab, rates)

    return measure_strain
