"""What the grid does to a particle in a step: strain, work, the heat of the damping, and where it is carried.

The energy update conserves the total energy identically for FLIP with MUSL: the particles' kinetic energy changes by
dt sum f . w with w = (v^n + v_r) / 2, v_r the re-projected velocity, so e loses (p + q)^n V^n dt div w, the very
pressures and volumes of the force. The default transfer sharpens w and the velocity that moves the particles and
changes their volumes (`sharpen.py`), and the viscosity is a tensor (`viscosity.py`): its work is s . (grad w) s.

The conservative damping moves a particle's velocity vF towards what the grid sees, by u = sum w alpha (v_r - vF), alpha
a number of each node that follows its sound speed: momentum is exact, because at a node the sum of w m (v_r - vF) is
zero. The kinetic energy that this takes, sum over the nodes of 2 alpha (K - M |v_r|^2 / 2) less sum over the particles
of m |u|^2 / 2, returns as heat: the nodes' part by the weights (see `reproject.py`), the particles' to each its own.
"""

import functools
from enum import Enum

import warp as wp

from warp_mpm.kernels.content import gather_content
from warp_mpm.kernels.precision import HALF, matrix3, scalar, vector2, vector3
from warp_mpm.kernels.records import Clock, Grid, Matter, Motion, Position
from warp_mpm.kernels.shape import Shape
from warp_mpm.kernels.stencil import gather_function, gather_gradient_function, stencil_type
from warp_mpm.kernels.transfer import stencil_function
from warp_mpm.kernels.vectors import first_three, second_three


class Strain(Enum):
    """Which nodal velocity strains the material, and which one does the work."""

    REPROJECTED = "re-projected; work on (v^n + v_r) / 2"
    END = "v^n + dt a; work on v^n + dt a / 2"
    START = "v^n for both"


@wp.struct
class StrainIncrement:
    """What the gather brings to the material update."""

    motion: vector3  # the velocity that moves the particle, sum w (v^n + dt a) or the sharpened one [m/s]
    acceleration: vector3  # in direction [m/s]: what the step adds to the velocity
    gradient: matrix3  # grad v [1/s], of the velocity that changes the volume
    work_gradient: matrix3  # of the velocity that does the work [1/s]
    damping: vector3  # u = sum w alpha (v_r - vF) [m/s]
    heat: scalar  # sum w H [J/kg]


@functools.cache
def strain_function(shape: Shape, strain: Strain, damped: bool) -> wp.Function:
    """Device function: gather the strain increment of a particle."""
    stencil_of = stencil_function(shape)
    gather_gradient = gather_gradient_function(shape.width, 8)
    gather_nodal = gather_function(shape.width, 4)
    gather_nodal_gradient = gather_gradient_function(shape.width, 4)
    record = stencil_type(shape.width)
    rows_type = wp.types.matrix((4, 8), scalar)
    reprojected = strain is Strain.REPROJECTED
    end = strain is Strain.END

    @wp.func
    def gather_all(grid: Grid, stencil: record) -> rows_type:
        if wp.static(reprojected):
            return gather_gradient(stencil, grid.end)
        else:
            return gather_gradient(stencil, grid.start)

    @wp.func
    def gather_strain(
        grid: Grid, cell: wp.vec3s, fraction: vector3, velocity: vector3, half_width: scalar, dt: scalar
    ) -> StrainIncrement:
        stencil = stencil_of(grid, cell, fraction, half_width)
        rows = gather_all(grid, stencil)
        sums = rows[0]
        result = StrainIncrement()
        result.motion = first_three(sums)
        result.gradient = wp.matrix_from_cols(first_three(rows[1]), first_three(rows[2]), first_three(rows[3]))
        second = wp.matrix_from_cols(second_three(rows[1]), second_three(rows[2]), second_three(rows[3]))
        result.work_gradient = result.gradient
        if wp.static(reprojected):
            result.acceleration = first_three(sums) - second_three(sums)
            result.work_gradient = second
        else:
            result.acceleration = dt * second_three(sums)
            result.motion += result.acceleration
        if wp.static(reprojected and damped):
            nodal = gather_nodal(stencil, grid.damping)
            result.damping = first_three(nodal) - sums[7] * velocity
            result.heat = nodal[3]
        if wp.static(reprojected and not damped):
            nodal_rows = gather_nodal_gradient(stencil, grid.damping)
            result.gradient = wp.matrix_from_cols(
                first_three(nodal_rows[1]), first_three(nodal_rows[2]), first_three(nodal_rows[3])
            )
        if wp.static(end):
            result.gradient += dt * second
            result.work_gradient += HALF * dt * second
        return result

    return gather_strain


@wp.struct
class Deformation:
    """What the grid gives a particle in a step."""

    carried: vector3  # the velocity that carries it [m/s]
    damping: vector3  # what the damping adds to its velocity [m/s]
    acceleration: vector3  # in direction: the velocity that the step adds [m/s]
    gradient: matrix3  # grad v [1/s], of the velocity that changes its volume
    energy: scalar  # gained by work and by the heat of the damping [J/kg]
    work_divergence: scalar  # of the velocity that does the work [1/s]
    around: vector2  # pressure [Pa] and filling of the cells around it


@wp.func
def damping_heat(strain: StrainIncrement) -> scalar:
    """Heat that the damping leaves in a particle [J/kg]: what its nodes lose, less what its own change keeps."""
    return strain.heat - HALF * wp.dot(strain.damping, strain.damping)


@functools.cache
def deformation_function(shape: Shape, strain: Strain, damped: bool) -> wp.Function:
    """Device function: what a step does to a particle; `matter` and `motion` are the particle's before it.

    The pressures of `matter` are those of the force, and do the work of the step.
    """
    gather_strain = strain_function(shape, strain, damped)

    @wp.func
    def deform(
        grid: Grid,
        now: Clock,
        position: Position,
        motion: Motion,
        matter: Matter,
        half_width: scalar,
    ) -> Deformation:
        strained = gather_strain(grid, position.cell, position.fraction, motion.velocity, half_width, now.dt)
        thrust = matter.viscous_thrust
        result = Deformation()
        result.work_divergence = wp.trace(strained.work_gradient)
        power = (matter.pressure + matter.viscous_pressure) * result.work_divergence
        power += wp.dot(thrust, strained.work_gradient * thrust)
        result.carried = strained.motion
        result.energy = -power * now.dt / matter.density
        result.gradient = strained.gradient
        result.acceleration = strained.acceleration
        if wp.static(damped):
            result.energy += damping_heat(strained)
            result.damping = strained.damping
            result.around = gather_content(grid, position.cell, position.fraction)
        return result

    return deform
