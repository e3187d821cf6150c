"""What matter answers with: its burn fraction, pressure, viscosity and speeds, from density and energy.

Composed from equation of state x burn law x unreacted state. What has burnt has the pressure of the products,
p(rho, e), the rest that of the unreacted state, p(rho, e - E0), or none without such a state:

    p = F max(p_products(rho, e), 0) + (1 - F) max(p_unreacted(rho, e - E0), 0).

E0 is the energy before the burn, which is chemical. No matter carries tension: a liquid that is pulled cavitates, grows
at no pressure, and resists again once it is as dense as before. (In tension particles clump, see docs/numerics.md.)
"""

import functools
from typing import Any

import warp as wp

from warp_mpm.kernels.batch import numbers_in
from warp_mpm.kernels.content import inside
from warp_mpm.kernels.precision import ONE, ZERO, scalar, vector3
from warp_mpm.kernels.records import Maxima, raise_maxima
from warp_mpm.kernels.relaxation import ACTIVE_EQUALISATION, PASSIVE_EQUALISATION, gas_share, relax_density, yielding
from warp_mpm.kernels.strained import Strained
from warp_mpm.kernels.viscosity import (
    Viscosity,
    closing_rate,
    directedness,
    unit_vector,
    viscous_length,
    viscous_pressure,
    viscous_rate,
)

# Where a wave arrives, whether a particle burns already is a matter of round-off: what a switch would turn into a jump
# sets in over a short part of the burn instead, so that mirror images stay mirror images.
PER_IGNITED = wp.constant(scalar(10.0))  # the viscosity sets in over the first tenth of the burn
BURNT_OUT = wp.constant(scalar(0.9))  # the relaxation over the last tenth
PER_BURNT_OUT = wp.constant(scalar(10.0))


@wp.struct
class Response:
    """What a particle answers with; in the order of `response_of`, `batch.py` holds many of them."""

    density: scalar  # at which it answers [kg/m3]
    burn_fraction: scalar
    pressure: scalar  # [Pa]
    closing_rate: scalar  # d of the viscosity [1/s], where there is any
    viscous_pressure: scalar  # its isotropic part [Pa]
    viscous_thrust: vector3  # its directed part is the pressure tensor s s^T [Pa]
    sound_speed: scalar  # of the products, burnt or not; of the mixture where there is an unreacted state [m/s]
    elastic_speed: scalar  # of small changes of the pressure: 0 where matter not yet burnt has none [m/s]


response_numbers = wp.types.vector(numbers_in(Response), scalar)


@wp.func
def response_of(x: response_numbers) -> Response:
    """The record of these numbers."""
    return Response(x[0], x[1], x[2], x[3], x[4], vector3(x[5], x[6], x[7]), x[8], x[9])


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
        result.density = density
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
        directed = ZERO
        root = ZERO
        if wp.min(closing, divergence) < ZERO and pushes_back:  # nothing closes in most of an expanding gas
            directed = directedness(viscosity, result.sound_speed, divergence)
            axis = directed * direction
            share = wp.dot(axis, axis)
            result.closing_rate = closing_rate(share, closing, divergence)
            length = viscous_length(viscosity, axis)
            q = viscous_pressure(viscosity, length, density, result.sound_speed, result.closing_rate)
            if wp.static(not resists):
                q *= wp.min(burnt * PER_IGNITED, ONE)
            result.viscous_pressure = q * (ONE - share)
            root = wp.sqrt(q)
        result.viscous_thrust = root * (directed * direction)
        return result

    return respond


@functools.cache
def answer_function(damped: bool, eos: Any, burn: Any, unreacted: Any = None) -> wp.Function:
    """Device function: density, burn fraction and pressures for the next forces; it computes with numbers alone."""
    respond = response_function(eos, burn, unreacted)
    sound_speed_squared = eos.sound_speed_squared
    passive = eos.passive_volume
    equalisation = PASSIVE_EQUALISATION if passive else ACTIVE_EQUALISATION
    eos_record = eos.Record
    burns = burn is not None
    burn_record = burn.Record if burns else wp.int32
    unreacted_record = wp.int32 if unreacted is None else unreacted.Record

    @wp.func
    def answer(
        strained: Strained,
        eos_parameters: eos_record,
        burn_parameters: burn_record,
        unreacted_parameters: unreacted_record,
        chemical_energy: scalar,
        viscosity: Viscosity,
        ambient_pressure: scalar,
        dt: scalar,
    ) -> Response:
        energy = strained.energy
        divergence = wp.trace(strained.gradient)
        # Density follows the strain, and inside the material relaxes to the room, and the pressure, around it.
        density = strained.density / (ONE + dt * divergence)
        burnt = ONE
        if wp.static(burns):
            burnt = strained.burn_fraction
        # An ambient pressure pushes on volumes that are passive otherwise: relaxing them would start a motion.
        relaxes = burnt > BURNT_OUT
        if wp.static(passive):
            relaxes = relaxes and ambient_pressure == ZERO
        if wp.static(damped) and relaxes:
            squared = sound_speed_squared(eos_parameters, density, energy)
            onset = (burnt - BURNT_OUT) * PER_BURNT_OUT
            filling = strained.filling
            if squared > ZERO:
                modulus = density * squared
                excess = (strained.pressure - strained.pressure_around) / modulus
                crossing = onset * inside(filling) * dt * wp.sqrt(squared) * viscosity.inverse_length
                if wp.static(not passive):
                    crossing *= gas_share(strained.pressure - ambient_pressure, modulus)
                room = ONE
                if wp.static(not passive):
                    room = yielding(strained.pressure, strained.pressure_around, filling)
                density = relax_density(density, filling, excess, room, crossing, equalisation)
        direction = unit_vector(strained.acceleration)
        return respond(
            eos_parameters,
            burn_parameters,
            unreacted_parameters,
            chemical_energy,
            viscosity,
            density,
            energy,
            divergence,
            wp.dot(direction, strained.gradient * direction),
            direction,
            burnt,
            strained.since_arrival,
            strained.since_booster,
        )

    return answer


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
    velocity: vector3,
    divergence: scalar,
    moved: scalar,
) -> Maxima:
    """What limits the next time step, and health figures."""
    sound_speed = response.sound_speed
    signal = wp.max(sound_speed, crushing_speed(response.pressure, ambient_pressure, response.density))
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
