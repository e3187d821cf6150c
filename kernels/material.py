"""The material update: strain from the grid, then density, energy, burn fraction and pressure.

Composed from equation of state x burn law x shape x order of the step. The energy update conserves the total energy
identically for FLIP with MUSL: the particles' kinetic energy changes by dt sum f . w with w = (v^n + v_r) / 2, v_r the
re-projected velocity, so e loses (p + q)^n V^n dt div w, the very pressures and volumes of the force. The default
transfer sharpens w and the velocity that moves the particles and changes their volumes (`sharpen.py`), and the
viscosity is a tensor (`viscosity.py`): its work is s . (grad w) s.

The conservative damping moves a particle's velocity vF by alpha of its distance u = sum w (v_r - vF) from what the
grid sees, and returns the kinetic energy as heat: the node's share H (see `grid.py`) and
alpha / 2 (sum w |v_r - vF|^2 - alpha |u|^2), both non-negative. For momentum to be exact, alpha is one number a step.
"""

import functools
from enum import Enum
from typing import Any

import warp as wp

from warp_mpm.kernels.content import FILLING, PRESSURE, gather_content, inside
from warp_mpm.kernels.motion import Faces, place, settle
from warp_mpm.kernels.precision import HALF, ONE, ZERO, matrix3, scalar, vector3, vector4, vector8
from warp_mpm.kernels.records import (
    AMBIENT_WORK,
    CLAMPED_ENERGY,
    TALLIES,
    Clock,
    Grid,
    Maxima,
    Particles,
    raise_maxima,
)
from warp_mpm.kernels.relaxation import relax_density
from warp_mpm.kernels.shape import Shape
from warp_mpm.kernels.transfer import stencil_functions
from warp_mpm.kernels.vectors import first_three, multiply_add4, multiply_add8, second_three
from warp_mpm.kernels.viscosity import Viscosity, closing_rate, viscous_axis, viscous_pressure, viscous_rate

# Where a wave arrives, whether a particle burns already is a matter of round-off: what a switch would turn into a jump
# sets in over a short part of the burn instead, so that mirror images stay mirror images.
IGNITED = wp.constant(scalar(0.1))  # burn fraction from which on the viscosity acts fully
BURNT_OUT = wp.constant(scalar(0.9))  # the relaxation sets in over the last tenth of the burn


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
    slip: vector3  # u = sum w (v_r - vF) [m/s]
    slip_squared: scalar  # sum w |v_r - vF|^2 [m2/s2]
    heat: scalar  # sum w H [J/kg]


@functools.cache
def strain_function(shape: Shape, strain: Strain, damped: bool) -> wp.Function:
    """Device function: gather the strain increment of a particle."""
    width = shape.width
    first_node, weights, slopes, _ = stencil_functions(shape)
    reprojected = strain is Strain.REPROJECTED
    end = strain is Strain.END

    @wp.func
    def gather_strain(
        grid: Grid, cell: wp.vec3s, fraction: vector3, velocity: vector3, half_width: scalar, dt: scalar
    ) -> StrainIncrement:
        first = first_node(grid, cell, fraction)
        wx = weights(fraction[0], half_width)
        wy = weights(fraction[1], half_width)
        wz = weights(fraction[2], half_width)
        sx = slopes(fraction[0], half_width) / grid.spacing[0]
        sy = slopes(fraction[1], half_width) / grid.spacing[1]
        sz = slopes(fraction[2], half_width) / grid.spacing[2]
        sums = vector8()  # sum w (nodal values)
        nodal_sums = vector4()  # sum w (re-projected values)
        slip_squared = ZERO
        node_x = vector8()  # derivatives by x, y, z of the nodal values
        node_y = vector8()
        node_z = vector8()
        nodal_x = vector4()  # and of the re-projected ones
        nodal_y = vector4()
        nodal_z = vector4()
        for i in range(width):
            for j in range(width):
                row = first + i * grid.stride_x + j * grid.stride_y
                wij = wx[i] * wy[j]
                gx = sx[i] * wy[j]
                gy = wx[i] * sy[j]
                row_sums = vector8()
                row_nodal = vector4()
                row_squared = ZERO
                row_across = vector8()  # the same by slopes along z
                nodal_across = vector4()
                for k in range(width):
                    node = grid.node[row + k]
                    row_sums = multiply_add8(row_sums, wz[k], node)
                    row_across = multiply_add8(row_across, sz[k], node)
                    if wp.static(reprojected):
                        nodal = grid.reprojected[row + k]
                        row_nodal = multiply_add4(row_nodal, wz[k], nodal)
                        if wp.static(damped):
                            relative = first_three(nodal) - velocity
                            row_squared += wz[k] * wp.dot(relative, relative)
                        else:
                            nodal_across = multiply_add4(nodal_across, sz[k], nodal)
                sums = multiply_add8(sums, wij, row_sums)
                nodal_sums = multiply_add4(nodal_sums, wij, row_nodal)
                slip_squared += wij * row_squared
                node_x = multiply_add8(node_x, gx, row_sums)
                node_y = multiply_add8(node_y, gy, row_sums)
                node_z = multiply_add8(node_z, wij, row_across)
                if wp.static(reprojected and not damped):
                    nodal_x = multiply_add4(nodal_x, gx, row_nodal)
                    nodal_y = multiply_add4(nodal_y, gy, row_nodal)
                    nodal_z = multiply_add4(nodal_z, wij, nodal_across)
        result = StrainIncrement()
        result.motion = first_three(sums)
        result.gradient = wp.matrix_from_cols(first_three(node_x), first_three(node_y), first_three(node_z))
        second = wp.matrix_from_cols(second_three(node_x), second_three(node_y), second_three(node_z))
        result.work_gradient = result.gradient
        if wp.static(reprojected):
            result.acceleration = first_three(sums) - second_three(sums)
            result.work_gradient = second
        else:
            result.acceleration = dt * second_three(sums)
            result.motion += result.acceleration
        if wp.static(reprojected and not damped):
            result.gradient = wp.matrix_from_cols(first_three(nodal_x), first_three(nodal_y), first_three(nodal_z))
        if wp.static(end):
            result.gradient += dt * second
            result.work_gradient += HALF * dt * second
        result.slip = first_three(nodal_sums) - velocity
        result.slip_squared = slip_squared
        result.heat = nodal_sums[3]
        return result

    return gather_strain


@wp.struct
class Response:
    """What a particle answers with."""

    burn_fraction: scalar
    pressure: scalar  # [Pa]
    closing_rate: scalar  # d of the viscosity [1/s]
    viscous_pressure: scalar  # its isotropic part [Pa]
    viscous_thrust: vector3  # its directed part is the pressure tensor s s^T [Pa]
    sound_speed: scalar  # of the products [m/s]


@functools.cache
def response_function(eos: Any, burn: Any) -> wp.Function:
    """Device function: burn fraction, pressure, viscous pressure and sound speed from density and energy.

    `eos` is a class of `eos/`, `burn` a class of `burn/` or None.
    """
    pressure_offset, pressure_slope = eos.pressure_offset, eos.pressure_slope
    sound_speed_squared = eos.sound_speed_squared
    eos_record = eos.Record
    burns = burn is not None
    burn_record = burn.Record if burns else wp.int32
    burn_fraction = burn.burn_fraction if burns else None

    @wp.func
    def respond(
        eos_parameters: eos_record,
        burn_parameters: burn_record,
        viscosity: Viscosity,
        density: scalar,
        energy: scalar,
        gradient: matrix3,
        acceleration: vector3,
        burnt_before: scalar,
        since_arrival: scalar,
        since_booster: scalar,
    ) -> Response:
        result = Response()
        burnt = ONE
        if wp.static(burns):
            burnt = burn_fraction(burn_parameters, burnt_before, since_arrival, since_booster, density)
        products = pressure_offset(eos_parameters, density) + pressure_slope(eos_parameters, density) * energy
        result.burn_fraction = burnt
        result.pressure = burnt * products
        result.sound_speed = wp.sqrt(wp.max(sound_speed_squared(eos_parameters, density, energy), ZERO))
        onset = wp.min(burnt / IGNITED, ONE)
        axis = viscous_axis(viscosity, result.sound_speed, acceleration, wp.trace(gradient))
        result.closing_rate = closing_rate(axis, gradient)
        q = onset * viscous_pressure(viscosity, density, result.sound_speed, result.closing_rate)
        result.viscous_pressure = q * (ONE - wp.dot(axis, axis))
        result.viscous_thrust = wp.sqrt(q) * axis
        return result

    return respond


@wp.func
def rates(
    response: Response, viscosity: Viscosity, velocity: vector3, divergence: scalar, burn_speed: scalar, moved: scalar
) -> Maxima:
    """What limits the next time step, and health figures; `burn_speed` is that of matter not yet burnt, else 0."""
    sound_speed = response.sound_speed
    viscous = ZERO
    if response.burn_fraction > ZERO:
        viscous = viscous_rate(viscosity, sound_speed, response.closing_rate)
    return Maxima(
        sound_speed + wp.abs(velocity[0]),
        sound_speed + wp.abs(velocity[1]),
        sound_speed + wp.abs(velocity[2]),
        sound_speed + wp.length(velocity),
        burn_speed,
        viscous,
        wp.abs(divergence),
        moved,
        response.pressure,
    )


@functools.cache
def initial_kernel(eos: Any, burn: Any) -> wp.Kernel:
    """Burn fraction, pressure and rates at the start, from the initial density and energy."""
    respond = response_function(eos, burn)
    eos_record = eos.Record
    burns = burn is not None
    burn_record = burn.Record if burns else wp.int32

    @wp.kernel(enable_backward=False, module="unique")
    def initialise(
        particles: Particles,
        eos_parameters: eos_record,
        burn_parameters: burn_record,
        viscosity: Viscosity,
        maxima: wp.array(dtype=Maxima),
        slab: int,
        begin: int,
    ):
        p = begin + wp.tid()
        since_arrival = ZERO
        since_booster = ZERO
        if wp.static(burns):
            since_arrival = -particles.arrival_time[p]
            since_booster = -particles.booster_time[p]
        density = particles.density[p]
        energy = particles.energy[p]
        response = respond(
            eos_parameters,
            burn_parameters,
            viscosity,
            density,
            energy,
            matrix3(),
            vector3(),
            ZERO,
            since_arrival,
            since_booster,
        )
        particles.pressure[p] = response.pressure
        burn_speed = ZERO
        if wp.static(burns):
            particles.burn_fraction[p] = response.burn_fraction
            if response.burn_fraction < ONE:
                burn_speed = burn_parameters.detonation_speed
        values = rates(response, viscosity, particles.velocity[p], ZERO, burn_speed, ZERO)
        raise_maxima(maxima, slab, values)

    return initialise


@wp.func
def damping_heat(strain: StrainIncrement, alpha: scalar) -> scalar:
    """Heat that the damping leaves in a particle [J/kg]: the nodes' share, and its own slip against them."""
    spread = wp.max(strain.slip_squared - alpha * wp.dot(strain.slip, strain.slip), ZERO)
    return strain.heat + HALF * alpha * spread


@functools.cache
def update_kernel(shape: Shape, strain: Strain, damped: bool, move: bool, eos: Any, burn: Any) -> wp.Kernel:
    """Strain, energy, density, damping, motion (`move`), then burn fraction and pressure for the next forces."""
    gather_strain = strain_function(shape, strain, damped)
    respond = response_function(eos, burn)
    sound_speed_squared = eos.sound_speed_squared
    eos_record = eos.Record
    burns = burn is not None
    burn_record = burn.Record if burns else wp.int32

    @wp.kernel(enable_backward=False, module="unique")
    def update(
        particles: Particles,
        grid: Grid,
        faces: Faces,
        clock: wp.array(dtype=Clock),
        eos_parameters: eos_record,
        burn_parameters: burn_record,
        viscosity: Viscosity,
        half_width: scalar,
        ambient_pressure: scalar,
        maxima: wp.array(dtype=Maxima),
        tallies: wp.array(dtype=wp.float64),
        faults: wp.array(dtype=int),
        slab: int,
        begin: int,
    ):
        p = begin + wp.tid()
        mass = particles.mass[p]
        if mass == ZERO:
            return
        dt = clock[0].dt
        alpha = clock[0].damping
        cell = particles.cell[p]
        fraction = particles.fraction[p]
        velocity = particles.velocity[p]
        strained = gather_strain(grid, cell, fraction, velocity, half_width, dt)

        # Energy: the work of the very pressures of the force, and the heat of the damping.
        divergence = wp.trace(strained.gradient)
        work_divergence = wp.trace(strained.work_gradient)
        expansion = dt * work_divergence / particles.density[p]
        thrust = particles.viscous_thrust[p]
        power = (particles.pressure[p] + particles.viscous_pressure[p]) * work_divergence
        power += wp.dot(thrust, strained.work_gradient * thrust)
        energy = particles.energy[p] - power * dt / particles.density[p]
        if ambient_pressure != ZERO:
            work = wp.float64(ambient_pressure) * wp.float64(expansion) * wp.float64(mass)
            wp.atomic_add(tallies, slab * TALLIES + AMBIENT_WORK, work)
        if wp.static(damped):
            energy += damping_heat(strained, alpha)
            velocity += alpha * strained.slip
            particles.velocity[p] = velocity
        if energy < ZERO:
            wp.atomic_add(tallies, slab * TALLIES + CLAMPED_ENERGY, -wp.float64(energy) * wp.float64(mass))
            energy = ZERO

        # Density follows the strain, and inside the material relaxes to room and pressure around it.
        density = particles.density[p] / (ONE + dt * divergence)
        burnt = ONE
        if wp.static(burns):
            burnt = particles.burn_fraction[p]
        # An ambient pressure pushes on volumes, which the relaxation would then change without doing work.
        if wp.static(damped) and burnt > BURNT_OUT and ambient_pressure == ZERO:
            stiffness = density * sound_speed_squared(eos_parameters, density, energy)
            onset = (burnt - BURNT_OUT) / (ONE - BURNT_OUT)
            around = gather_content(grid, cell, fraction)
            if stiffness > ZERO:
                excess = (particles.pressure[p] - around[PRESSURE]) / stiffness
                crossing = onset * inside(around[FILLING]) * dt * wp.sqrt(stiffness / density) / viscosity.length
                density = relax_density(density, around[FILLING], excess, crossing)

        moved = ZERO
        if wp.static(move):
            step = wp.cw_div(dt * strained.motion, grid.spacing)
            after = place(grid.cells, faces, cell, fraction, step)
            moved = after.moved
            if not settle(particles, p, after, mass, velocity, energy, slab, tallies, faults):
                return

        # Burn fraction and pressures for the next forces.
        since_arrival = ZERO
        since_booster = ZERO
        if wp.static(burns):
            since_arrival = scalar(clock[0].time - wp.float64(particles.arrival_time[p]))
            since_booster = scalar(clock[0].time - wp.float64(particles.booster_time[p]))
        response = respond(
            eos_parameters,
            burn_parameters,
            viscosity,
            density,
            energy,
            strained.gradient,
            strained.acceleration,
            burnt,
            since_arrival,
            since_booster,
        )
        particles.density[p] = density
        particles.energy[p] = energy
        particles.pressure[p] = response.pressure
        particles.viscous_pressure[p] = response.viscous_pressure
        particles.viscous_thrust[p] = response.viscous_thrust
        burn_speed = ZERO
        if wp.static(burns):
            particles.burn_fraction[p] = response.burn_fraction
            if response.burn_fraction < ONE:
                burn_speed = burn_parameters.detonation_speed
        raise_maxima(maxima, slab, rates(response, viscosity, velocity, divergence, burn_speed, moved))

    return update
