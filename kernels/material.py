"""The material update: density, motion, burn fraction and pressure, from what a step did to a particle.

Composed from shape x order of the step x equation of state x burn law x unreacted state, in three parts: the grid
strains and moves a particle (`strained.py`), its material answers (`response.py`), and the answer is kept. A GPU does
them one after the other for each particle. A CPU does each for a batch of particles in turn: answers take numbers
alone, so that it can compute 8 or 16 at a time (`batch.py`).
"""

import functools
from typing import Any

import warp as wp

from warp_mpm.kernels.batch import BATCH, get_function, numbers_in, put_function
from warp_mpm.kernels.motion import Faces, report_fault
from warp_mpm.kernels.precision import ZERO, scalar, vector3
from warp_mpm.kernels.records import Clock, Grid, Matter, Maxima, Particles, raise_maxima
from warp_mpm.kernels.response import (
    Response,
    answer_function,
    raise_burn_speed,
    rates,
    response_function,
    response_of,
)
from warp_mpm.kernels.shape import Shape
from warp_mpm.kernels.strain import Strain
from warp_mpm.kernels.strained import Strained, strained_of, straining_function
from warp_mpm.kernels.viscosity import Viscosity

HUGE = wp.constant(scalar(1.0e30))  # no pressure [Pa] and no energy [J/kg] of any matter


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
        limits = rates(response, viscosity, ambient_pressure, velocity, ZERO, ZERO)
        raise_maxima(maxima, slab, limits)
        if wp.static(burns):
            particles.matter[p].burn_fraction = response.burn_fraction
            raise_burn_speed(maxima, slab, response.burn_fraction, burn_parameters.detonation_speed)

    return initialise


@wp.func
def keep(
    particles: Particles,
    viscosity: Viscosity,
    ambient_pressure: scalar,
    burn_speed: scalar,
    maxima: wp.array(dtype=Maxima),
    faults: wp.array(dtype=int),
    slab: int,
    p: int,
    strained: Strained,
    response: Response,
):
    """Write down a particle's new state, and what it means for the next step."""
    motion = particles.motion[p]
    if motion.mass == ZERO:  # it left, in this step or before
        return
    thrust = response.viscous_thrust
    is_matter = response.density > ZERO and wp.abs(strained.energy) < HUGE
    is_matter = is_matter and wp.abs(response.pressure) < HUGE and wp.dot(thrust, thrust) < HUGE
    if not is_matter:  # nor if one is not a number
        report_fault(particles, p, slab, faults)
    matter = Matter()
    matter.density = response.density
    matter.energy = strained.energy
    matter.pressure = response.pressure
    matter.viscous_pressure = response.viscous_pressure
    matter.viscous_thrust = thrust
    matter.burn_fraction = response.burn_fraction
    matter.sound_speed = response.elastic_speed
    particles.matter[p] = matter
    limits = rates(response, viscosity, ambient_pressure, motion.velocity, wp.trace(strained.gradient), strained.moved)
    raise_maxima(maxima, slab, limits)
    raise_burn_speed(maxima, slab, response.burn_fraction, burn_speed)


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
    batched: bool = False,
) -> wp.Kernel:
    """Strain, energy, density, damping, motion (`move`), then burn fraction and pressure for the next forces.

    A thread has one particle of the `count` from `begin` on; or, if `batched`, all of them, batch by batch.
    """
    burns = burn is not None
    strain_particle = straining_function(shape, strain, damped, move, eos, burns, thin)
    answer = answer_function(damped, eos, burn, unreacted)
    put_strained, get_strained = put_function(Strained), get_function(Strained)
    put_response, get_response = put_function(Response), get_function(Response)
    eos_record = eos.Record
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
        count: int,
    ):
        now = clock[0]
        dt = now.dt
        burn_speed = ZERO
        if wp.static(burns):
            burn_speed = burn_parameters.detonation_speed
        if wp.static(batched):
            strained_batch = wp.zeros(shape=wp.static(BATCH * numbers_in(Strained)), dtype=scalar)
            response_batch = wp.zeros(shape=wp.static(BATCH * numbers_in(Response)), dtype=scalar)
            for first in range(begin, begin + count, BATCH):
                size = wp.min(BATCH, begin + count - first)
                for i in range(size):
                    p = first + i
                    strained = strain_particle(
                        particles, grid, faces, now, half_width, ambient_pressure, tallies, faults, slab, p
                    )
                    put_strained(strained_batch, i, strained)
                n = int(0)
                while n < size:  # not `for`: so it is vectorised, see `batch.py`
                    response = answer(
                        strained_of(get_strained(strained_batch, n)),
                        eos_parameters,
                        burn_parameters,
                        unreacted_parameters,
                        chemical_energy,
                        viscosity,
                        ambient_pressure,
                        dt,
                    )
                    put_response(response_batch, n, response)
                    n += 1
                for j in range(size):
                    strained = strained_of(get_strained(strained_batch, j))
                    response = response_of(get_response(response_batch, j))
                    p = first + j
                    keep(
                        particles, viscosity, ambient_pressure, burn_speed, maxima, faults, slab, p, strained, response
                    )
        else:
            p = begin + wp.tid()
            strained = strain_particle(
                particles, grid, faces, now, half_width, ambient_pressure, tallies, faults, slab, p
            )
            response = answer(
                strained,
                eos_parameters,
                burn_parameters,
                unreacted_parameters,
                chemical_energy,
                viscosity,
                ambient_pressure,
                dt,
            )
            keep(particles, viscosity, ambient_pressure, burn_speed, maxima, faults, slab, p, strained, response)

    return update
