"""The Riemann problem between two materials with any equations of state p = a(rho) + b(rho) e.

Problem: at t = 0 matter at x < x0 has density, velocity and specific energy of the left state, that at x > x0 those of
the right one; each has its own equation of state, and they do not mix. The flow depends on xi = (x - x0) / t alone.

Equations: a wave runs into each state K (sign s = -1 to the left, +1 to the right); between them pressure p* and
velocity u* are the same on both sides of the contact. For p* > p_K the wave is a shock of the speed S: density and
velocity follow from p* by the Hugoniot (`chapman_jouguet.hugoniot_pressure`), with v = 1 / rho,

    e* - e_K = (p* + p_K) (v_K - v*) / 2,  u* = u_K + s sqrt((p* - p_K) (v_K - v*)),
    S = u_K + s v_K sqrt((p* - p_K) / (v_K - v*));

otherwise it is a fan along the isentrope of the state, u = u_K + s J, xi = u + s c, with J the integral of c / rho from
K on (`isentrope.py`). p* is the root of u*_R - u*_L, which grows with it; found by bisection. Equations of state must
be convex, as those of `kernels/eos` are where matter is not torn apart.

Reference: R. Courant, K. O. Friedrichs, Supersonic Flow and Shock Waves, Springer 1976, sections 80 and 81;
P. Colella, H. M. Glaz, J. Comput. Phys. 59 (1985) 264.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from warp_mpm.exact.chapman_jouguet import hugoniot_pressure, pressure_of
from warp_mpm.exact.isentrope import Isentrope, isentrope
from warp_mpm.exact.similar_flow import SimilarFlow
from warp_mpm.kernels.eos import EquationOfState, evaluate

BISECTIONS = 40  # 1e-12 of the first interval
DENSITY_STEP = 1.05  # factor, in the search for a shock's density
LARGEST_COMPRESSION = 1e3  # of a state's density, at which that search gives up
LOWEST_PRESSURE = 1e-6  # of the higher of the two pressures: less counts as a vacuum between the materials


@dataclass(frozen=True)
class MatterState:
    """A uniform state of a material."""

    eos: EquationOfState
    density: float  # [kg/m3]
    velocity: float  # [m/s]
    energy: float  # specific, chemical energy included [J/kg]

    @cached_property
    def pressure(self) -> float:
        """Pressure [Pa]."""
        return pressure_of(self.eos, self.density, self.energy)

    @cached_property
    def sound_speed(self) -> float:
        """Speed of sound [m/s]."""
        return math.sqrt(evaluate(self.eos, self.eos.sound_speed_squared, self.density, self.energy))

    @cached_property
    def isentrope(self) -> Isentrope:
        """The states that it expands to."""
        return isentrope(self.eos, self.density, self.energy)

    def shock_density(self, pressure: float) -> float:
        """Density behind a shock to a pressure above its own [kg/m3].

        Raises:
            ValueError: no compression leads there.
        """

        def lacking(density: float) -> bool:
            return hugoniot_pressure(self.eos, self.density, self.energy, density, self.pressure) < pressure

        low = high = self.density
        while lacking(high):
            low, high = high, high * DENSITY_STEP
            if high > LARGEST_COMPRESSION * self.density:
                raise ValueError(f"{self.eos}: expected a shock to {pressure:g} Pa, found none")
        for _ in range(BISECTIONS):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if lacking(middle) else (low, middle)
        return 0.5 * (low + high)

    def velocity_change(self, pressure: float) -> float:
        """|u* - u_K| with its sign [m/s]: positive behind a shock, negative behind a fan."""
        if pressure > self.pressure:
            volume = 1.0 / self.density - 1.0 / self.shock_density(pressure)
            return math.sqrt((pressure - self.pressure) * volume)
        return self.isentrope.at_pressure(pressure)[2]


@dataclass(frozen=True)
class GeneralRiemannProblem:
    """Two materials, apart until t = 0 at x = `origin` [m]."""

    left: MatterState
    right: MatterState
    origin: float = 0.0

    @cached_property
    def star(self) -> tuple[float, float]:
        """Pressure [Pa] and velocity [m/s] between the waves.

        Raises:
            ValueError: the materials part, and leave a vacuum.
        """

        def closing(pressure: float) -> float:
            """u*_R - u*_L [m/s]."""
            left = self.left.velocity - self.left.velocity_change(pressure)
            return self.right.velocity + self.right.velocity_change(pressure) - left

        high = max(self.left.pressure, self.right.pressure)
        low = max(
            LOWEST_PRESSURE * high, self.left.isentrope.pressure[-1], self.right.isentrope.pressure[-1]
        )  # what the tables hold
        if closing(low) > 0.0:
            raise ValueError("GeneralRiemannProblem: expected materials that stay together, got a vacuum between them")
        while closing(high) < 0.0:
            high *= 2.0
        for _ in range(BISECTIONS):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if closing(middle) < 0.0 else (low, middle)
        pressure = 0.5 * (low + high)
        return pressure, self.left.velocity - self.left.velocity_change(pressure)

    @cached_property
    def flow(self) -> SimilarFlow:
        """The whole flow."""
        left, right = self._side(self.left, -1.0), self._side(self.right, 1.0)
        xi, pressure, velocity, density = np.column_stack([left, right[:, ::-1]])
        return SimilarFlow(xi, pressure, velocity, density, self.origin)

    def _side(self, state: MatterState, sign: float) -> np.ndarray:
        """Rows xi, p, u, rho (4, n) from the undisturbed state to the contact."""
        pressure, contact = self.star
        before = [state.pressure, state.velocity, state.density]
        if pressure > state.pressure:
            density = state.shock_density(pressure)
            flux = math.sqrt((pressure - state.pressure) / (1.0 / state.density - 1.0 / density))
            front = state.velocity + sign * flux / state.density
            behind = [pressure, contact, density]
            return np.array([[front, *before], [front, *behind], [contact, *behind]]).T
        states = state.isentrope
        fan = states.pressure > pressure
        velocity = state.velocity + sign * states.riemann
        xi = velocity + sign * states.sound_speed
        density, sound, _ = states.at_pressure(pressure)
        behind = [pressure, contact, density]
        columns = np.stack([xi, states.pressure, velocity, states.density])[:, fan]
        end = np.array([[contact + sign * sound, *behind], [contact, *behind]]).T
        return np.column_stack([columns, end])
