"""What a particle gives to the nodes around it, by its weights w there and by their slopes (paper eqs. 4-8).

    momentum   sum w m v (APIC: v + C (x_i - x_p))        mass     sum w m
    force      sum V (p + q - p_ambient + s s^T) grad w   volume   sum w V
    field      sum w V p and sum w m c^2                  cells    sum L V p and sum L V

q and s s^T are the isotropic and the directed part of the artificial viscosity, L the weights of `content.py`.
"""

import functools

import warp as wp

from warp_mpm.kernels.precision import HALF, ZERO, scalar, vector2, vector3, vector4, vector8
from warp_mpm.kernels.records import Matter


@wp.struct
class Contribution:
    """What a particle gives, before it is weighed."""

    value: vector8  # by the weight: momentum, mass | nothing, volume
    force_x: vector3  # by the weight's slope along x: V sigma, column by column [J]
    force_y: vector3
    force_z: vector3
    field: vector2  # by the weight: V p [J] and m c^2 [J]
    content: vector2  # by the weight of cells: V p [J] and V [m3]


@functools.cache
def contribution_function(momentum: bool, force: bool) -> wp.Function:
    """Device function: what a particle gives of its momentum, mass and volume, and of its force and field."""

    @wp.func
    def contribution(velocity: vector3, mass: scalar, matter: Matter, ambient_pressure: scalar) -> Contribution:
        result = Contribution()
        volume = mass / matter.density
        pressure_volume = matter.pressure * volume
        if wp.static(momentum):
            carried = mass * velocity
            result.value = vector8(carried[0], carried[1], carried[2], mass, ZERO, ZERO, ZERO, volume)
        if wp.static(force):
            push = pressure_volume + (matter.viscous_pressure - ambient_pressure) * volume
            thrust = matter.viscous_thrust
            directed = volume * thrust
            result.force_x = directed[0] * thrust + vector3(push, ZERO, ZERO)
            result.force_y = directed[1] * thrust + vector3(ZERO, push, ZERO)
            result.force_z = directed[2] * thrust + vector3(ZERO, ZERO, push)
            result.field = vector2(pressure_volume, mass * matter.sound_speed * matter.sound_speed)
        result.content = vector2(pressure_volume, volume)
        return result

    return contribution


@wp.func
def force_on(force: vector3) -> vector8:
    """A force in the lanes of a node."""
    return vector8(ZERO, ZERO, ZERO, ZERO, force[0], force[1], force[2], ZERO)


@wp.func
def momentum_on(momentum: vector3) -> vector8:
    """A momentum in the lanes of a node."""
    return vector8(momentum[0], momentum[1], momentum[2], ZERO, ZERO, ZERO, ZERO, ZERO)


@wp.func
def reprojected(velocity: vector3) -> vector4:
    """What a mass gives to the re-projection: its velocity and, for the damping, its kinetic energy."""
    return vector4(velocity[0], velocity[1], velocity[2], HALF * wp.dot(velocity, velocity))
