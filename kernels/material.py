"""The material update: density, motion, burn fraction and pressure, from what a step did to a particle (`strain.py`).

Composed from shape x order of the step x equation of state x burn law x unreacted state. What has burnt has the
pressure of the products, p(rho, e), the rest that of the unreacted state, p(rho, e - E0), or none without such a state:

    p = F max(p_products(rho, e), 0) + (1 - F) max(p_unreacted(rho, e - E0), 0).

E0 is the energy before the burn, which is chemical. No matter carries tension: a liquid that is pulled cavitates, grows
at no pressure, and resists again once it is as dense as before. (In tension particles clump, see docs/numerics.md.)
"""

import functools
from typing import Any

import warp as wp

from warp_mpm.kernels.content import FILLING, PRESSURE, inside
from warp_mpm.kernels.motion import Faces, place, report_fault, settle
from warp_mpm.kernels.precision import ONE, ZERO, scalar, vector3
from warp_mpm.kernels.records import (
    AMBIENT_WORK,
    CLAMPED_ENERGY,
    TALLIES,
    Clock,
    Grid,
    Maxima,
    Particles,
    raise_maxima,
    tally_row,
)
from warp_mpm.kernels.relaxation import ACTIVE_EQUALISATION, PASSIVE_EQUALISATION, gas_share, relax_density, yielding
from warp_mpm.kernels.shape import Shape
from warp_mpm.kernels.strain import Strain, deformation_function
from warp_mpm.kernels.transfer import Ahead, look_ahead_function
from warp_mpm.kernels.vectors import at_rest_if_slow
from warp_mpm.kernels.viscosity import (
    Viscosity,
    closing_rate,
    directedness,
    viscous_length,
    viscous_pressure,
    viscous_rate,
)

# Where a wave arrives, whether a particle burns already is a matter of round-off: what a switch would turn into a jump
# sets in over a short part of the burn instead, so that mirror images stay mirror images.
PER_IGNITED = wp.constant(scalar(10.0))  # the viscosity sets in over the first tenth of the burn
BURNT_OUT = wp.constant(scalar(0.9))  # the relaxation over the last tenth
PER_BURNT_OUT = wp.constant(scalar(10.0))
HUGE = wp.constant(scalar(1.0e30))  # no pressure [Pa] and no energy [J/kg] of any matter


@wp.struct
class Response:
    """What a particle answers with."""

    burn_fraction: scalar
    pressure: scalar  # [Pa]
    closing_rate: scalar  # d of the viscosity [1/s], where there is any
    viscous_pressure: scalar  # its isotropic part [Pa]
    viscous_thrust: vector3  # its directed part is the pressure tensor s s^T [Pa]
    sound_speed: scalar  # of the products, burnt or not; of the mixture where there is an unreacted state [m/s]
    elastic_speed: scalar  # of small changes of the pressure: 0 where matter not yet burnt has none [m/s]


@functools.cache
def response_function(eos: Any, burn: Any, unreacted: Any = None) -> wp.Function:
    """Device function: burn fraction, pressure, viscous pressure and sound speed from density and energy.

    `eos` is a class of `eos/`, `burn` a class of `burn/` or None, `unreacted` a class of `eos/` or None.
    """
    pressure_offset, pressure_slope = eos.pressure_offset, eos.pressure_slope
    sound_speed_squared = eos.sound_speed_squared
    eos_record = eos.Record
    burns = burn is not None
    burn_record = burn.Record if burns else wp.int32
    burn_fraction = burn.burn_fraction if burns else None
    resists = unreacted is not None  # before it burns
    unreacted_record = unreacted.Record if resists else wp.int32
    unreacted_offset = unreacted.pressure_offset if resists else None
    unreacted_slope = unreacted.pressure_slope if resists else None
    unreacted_sound_squared = unreacted.sound_speed_squared if resists else None

    @wp.func
    def respond(
        eos_parameters: eos_record,
        burn_parameters: burn_record,
        unreacted_parameters: unreacted_record,
        chemical_energy: scalar,
        viscosity: Viscosity,
        density: scalar,
        energy: scalar,
        divergence: scalar,
        closing: scalar,
        direction: vector3,
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
        result.pressure = wp.where(products < ZERO, ZERO, burnt * products)  # not wp.max, which may drop a NaN
        squared = sound_speed_squared(eos_parameters, density, energy)
        pushes_back = burnt > ZERO
        if wp.static(resists):
            thermal = energy - chemical_energy
            solid = unreacted_offset(unreacted_parameters, density)
            solid += unreacted_slope(unreacted_parameters, density) * thermal
            result.pressure += (ONE - burnt) * wp.max(solid, ZERO)
            solid_squared = unreacted_sound_squared(unreacted_parameters, density, thermal)
            squared = burnt * squared + (ONE - burnt) * solid_squared
            pushes_back = True
        result.sound_speed = wp.sqrt(wp.max(squared, ZERO))
        result.elastic_speed = result.sound_speed
        if wp.static(not resists):
            result.elastic_speed = wp.sqrt(burnt) * result.sound_speed
        if wp.min(closing, divergence) < ZERO and pushes_back:  # nothing closes in most of an expanding gas
            axis = directedness(viscosity, result.sound_speed, divergence) * direction
            share = wp.dot(axis, axis)
            result.closing_rate = closing_rate(share, closing, divergence)
            length = viscous_length(viscosity, axis)
            q = viscous_pressure(viscosity, length, density, result.sound_speed, result.closing_rate)
            if wp.static(not resists):
                q *= wp.min(burnt * PER_IGNITED, ONE)
            result.viscous_pressure = q * (ONE - share)
            result.viscous_thrust = wp.sqrt(q) * axis
        return result

    return respond


@wp.func
def crushing_speed(pressure: scalar, ambient_pressure: scalar, density: scalar) -> scalar:
    """Speed at which the ambient pressure drives a surface into matter of lower pressure, sqrt((p_a - p) / rho) [m/s].

    A cell at rest moves by cfl^2 h in a step of cfl h over this. Where p_a is 0, or not much above p, sound is faster.
    """
    if ambient_pressure == ZERO:
        return ZERO
    return wp.sqrt(wp.max(ambient_pressure - pressure, ZERO) / density)


@wp.func
def rates(
    response: Response,
    viscosity: Viscosity,
    ambient_pressure: scalar,
    density: scalar,
    velocity: vector3,
    divergence: scalar,
    moved: scalar,
) -> Maxima:
    """What limits the next time step, and health figures."""
    sound_speed = response.sound_speed
    signal = wp.max(sound_speed, crushing_speed(response.pressure, ambient_pressure, density))
    return Maxima(
        signal + wp.abs(velocity[0]),
        signal + wp.abs(velocity[1]),
        signal + wp.abs(velocity[2]),
        viscous_rate(viscosity, sound_speed, response.closing_rate),
        wp.abs(divergence),
        moved,
        response.pressure,
        ZERO,
    )


@wp.func
def raise_burn_speed(maxima: wp.array(dtype=Maxima), slab: int, burnt: scalar, speed: scalar):
    """Through matter not yet burnt the wave may come at its own speed [m/s]."""
    if burnt < ONE:
        raise_maxima(maxima, slab, Maxima(speed, speed, speed, ZERO, ZERO, ZERO, ZERO, ZERO))


@functools.cache
def initial_kernel(eos: Any, burn: Any, unreacted: Any = None) -> wp.Kernel:
    """Burn fraction, pressure and rates at the start, from the initial density and energy."""
    respond = response_function(eos, burn, unreacted)
    eos_record = eos.Record
    burns = burn is not None
    burn_record = burn.Record if burns else wp.int32
    unreacted_record = wp.int32 if unreacted is None else unreacted.Record

    @wp.kernel(enable_backward=False, module="unique")
    def initialise(
        particles: Particles,
        eos_parameters: eos_record,
        burn_parameters: burn_record,
        unreacted_parameters: unreacted_record,
        chemical_energy: scalar,
        viscosity: Viscosity,
        ambient_pressure: scalar,
        maxima: wp.array(dtype=Maxima),
        slab: int,
        begin: int,
    ):
        p = begin + wp.tid()
        since_arrival = ZERO
        since_booster = ZERO
        if wp.static(burns):
            since_arrival = -particles.burn_times[p].arrival_time
            since_booster = -particles.burn_times[p].booster_time
        density = particles.matter[p].density
        energy = particles.matter[p].energy
        response = respond(
            eos_parameters,
            burn_parameters,
            unreacted_parameters,
            chemical_energy,
            viscosity,
            density,
            energy,
            ZERO,
            ZERO,
            vector3(),
            ZERO,
            since_arrival,
            since_booster,
        )
        particles.matter[p].pressure = response.pressure
        particles.matter[p].sound_speed = response.elastic_speed
        velocity = particles.motion[p].velocity
        limits = rates(response, viscosity, ambient_pressure, density, velocity, ZERO, ZERO)
        raise_maxima(maxima, slab, limits)
        if wp.static(burns):
            particles.matter[p].burn_fraction = response.burn_fraction
            raise_burn_speed(maxima, slab, response.burn_fraction, burn_parameters.detonation_speed)

    return initialise


@functools.cache
def update_kernel(
    shape: Shape,
    strain: Strain,
    damped: bool,
    move: bool,
    eos: Any,
    burn: Any,
    unreacted: Any = None,
    thin: bool = False,
) -> wp.Kernel:
    """Strain, energy, density, damping, motion (`move`), then burn fraction and pressure for the next forces."""
    deform = deformation_function(shape, strain, damped)
    look_ahead = look_ahead_function(shape, Ahead.END if strain is Strain.REPROJECTED else Ahead.START)
    respond = response_function(eos, burn, unreacted)
    sound_speed_squared = eos.sound_speed_squared
    passive = eos.passive_volume
    equalisation = PASSIVE_EQUALISATION if passive else ACTIVE_EQUALISATION
    eos_record = eos.Record
    burns = burn is not None
    burn_record = burn.Record if burns else wp.int32
    unreacted_record = wp.int32 if unreacted is None else unreacted.Record

    @wp.kernel(enable_backward=False, module="unique")
    def update(
        particles: Particles,
        grid: Grid,
        faces: Faces,
        clock: wp.array(dtype=Clock),
        eos_parameters: eos_record,
        burn_parameters: burn_record,
        unreacted_parameters: unreacted_record,
        chemical_energy: scalar,
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
        motion = particles.motion[p]
        mass = motion.mass
        if mass == ZERO:
            return
        if wp.static(thin):
            look_ahead(particles, grid, p)
        now = clock[0]
        dt = now.dt
        matter = particles.matter[p]
        position = particles.position[p]
        step = deform(grid, now, position, motion, matter, half_width)
        gained = step.energy
        if wp.static(damped):
            velocity = at_rest_if_slow(motion.velocity + step.damping)
            # What rounding adds to the velocity it takes from the energy: cold fast gas would be heated otherwise by a
            # damping whose changes of velocity are too small to be kept.
            gained -= wp.dot(velocity, (velocity - motion.velocity) - step.damping)
            motion.velocity = velocity
            particles.motion[p] = motion
        if ambient_pressure != ZERO:
            work = wp.float64(ambient_pressure * dt * step.work_divergence) * wp.float64(mass / matter.density)
            wp.atomic_add(tallies, tally_row(tallies, slab, p) * TALLIES + AMBIENT_WORK, work)
        energy = matter.energy + gained
        if wp.static(not eos.negative_energy):
            if energy < ZERO:
                clamped = -wp.float64(energy) * wp.float64(mass)
                wp.atomic_add(tallies, tally_row(tallies, slab, p) * TALLIES + CLAMPED_ENERGY, clamped)
                energy = ZERO

        # Density follows the strain, and inside the material relaxes to the room, and the pressure, around it.
        density = matter.density / (ONE + dt * step.divergence)
        burnt = ONE
        if wp.static(burns):
            burnt = matter.burn_fraction
        # An ambient pressure pushes on volumes that are passive otherwise: relaxing them would start a motion.
        relaxes = burnt > BURNT_OUT
        if wp.static(passive):
            relaxes = relaxes and ambient_pressure == ZERO
        if wp.static(damped) and relaxes:
            squared = sound_speed_squared(eos_parameters, density, energy)
            onset = (burnt - BURNT_OUT) * PER_BURNT_OUT
            filling = step.around[FILLING]
            if squared > ZERO:
                modulus = density * squared
                excess = (matter.pressure - step.around[PRESSURE]) / modulus
                crossing = onset * inside(filling) * dt * wp.sqrt(squared) * viscosity.inverse_length
                if wp.static(not passive):
                    crossing *= gas_share(matter.pressure - ambient_pressure, modulus)
                room = ONE
                if wp.static(not passive):
                    room = yielding(matter.pressure, step.around[PRESSURE], filling)
                density = relax_density(density, filling, excess, room, crossing, equalisation)

        moved = ZERO
        if wp.static(move):
            way = dt * wp.cw_mul(step.carried, grid.inverse_spacing)
            after = place(grid.cells, faces, position.cell, position.fraction, way)
            moved = after.moved
            if not settle(particles, p, after, mass, motion.velocity, energy, slab, tallies, faults):
                return

        # Burn fraction and pressures for the next forces.
        since_arrival = ZERO
        since_booster = ZERO
        if wp.static(burns) and burnt < ONE:
            times = particles.burn_times[p]
            since_arrival = scalar(now.time - wp.float64(times.arrival_time))
            since_booster = scalar(now.time - wp.float64(times.booster_time))
        response = respond(
            eos_parameters,
            burn_parameters,
            unreacted_parameters,
            chemical_energy,
            viscosity,
            density,
            energy,
            step.divergence,
            step.closing,
            step.direction,
            burnt,
            since_arrival,
            since_booster,
        )
        if not (
            density > ZERO and wp.abs(energy) < HUGE and wp.abs(response.pressure) < HUGE
        ):  # nor if one is not a number
            report_fault(particles, p, slab, faults)
        matter.density = density
        matter.energy = energy
        matter.pressure = response.pressure
        matter.viscous_pressure = response.viscous_pressure
        matter.viscous_thrust = response.viscous_thrust
        matter.burn_fraction = response.burn_fraction
        matter.sound_speed = response.elastic_speed
        particles.matter[p] = matter
        velocity = motion.velocity
        limits = rates(response, viscosity, ambient_pressure, density, velocity, step.divergence, moved)
        raise_maxima(maxima, slab, limits)
        if wp.static(burns):
            raise_burn_speed(maxima, slab, response.burn_fraction, burn_parameters.detonation_speed)

    return update
