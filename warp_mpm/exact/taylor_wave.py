"""The planar Taylor wave: the flow behind a plane Chapman-Jouguet front in a gamma-law explosive.

Problem: at t = 0 the face x = 0 of a half-space x > 0 of explosive (density rho0, gamma-law products) is lit. The
front runs at D; behind the rear face there is vacuum, or a piston that moves at the constant speed u_R from x = 0 on
(u_R = 0 is a rigid wall). What is the flow at time t?

Equations: behind the front the entropy is uniform and the flow depends on xi = x / t alone. Every C+ characteristic
starts at the origin, u + c = xi, and the C- invariant is that of the front, u - 2 c / (gamma - 1) = K with
K = u_CJ - 2 c_CJ / (gamma - 1), u_CJ = D / (gamma + 1), c_CJ = gamma D / (gamma + 1). Hence the fan

    c = (gamma - 1) / (gamma + 1) (xi - K),  u = xi - c,  p = p_CJ (c / c_CJ)^(2 gamma / (gamma - 1)),
    rho = rho_CJ (c / c_CJ)^(2 / (gamma - 1)).

It reaches from xi = D down to where u = u_R: a plateau of uniform state c_R = (gamma - 1) (u_R - K) / 2 lies between
the piston, xi = u_R, and the fan's end, xi = u_R + c_R. With vacuum, or a piston that recedes faster than the gas can
follow (u_R < K), the fan ends with c = 0 at xi = K. A piston faster than u_CJ overdrives the front: another problem.

For gamma = 2: K = -D, c = (xi + D) / 3, p = p_CJ ((xi / D + 1) / 2)^4; at a rigid wall p = p_CJ (3 / 4)^4 =
0.3164 p_CJ for 0 <= xi <= D / 2.

Reference: G. I. Taylor, The dynamics of the combustion products behind plane and spherical detonation fronts in
explosives, Proc. R. Soc. A 200 (1950) 235; Fickett and Davis, Detonation, section 2C.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from warp_mpm.exact.chapman_jouguet import ChapmanJouguetState, ideal_gas_state

FREE = -math.inf  # rear speed of a face with vacuum behind it: no gas can follow [m/s]
RIGID = 0.0  # rear speed of a wall [m/s]


@dataclass(frozen=True)
class PlanarTaylorWave:
    """Exact flow behind a plane front that started at x = 0, t = 0.

    Positions are arrays [m], times above 0 [s].

    Raises:
        ValueError: gamma is not above 1, density or speed is not positive, or the piston is faster than the products
            behind a Chapman-Jouguet front.
    """

    gamma: float
    density: float  # rho0 [kg/m3]
    detonation_speed: float  # D [m/s]
    piston_speed: float = FREE  # u_R of the rear face [m/s], at most u_CJ: FREE, RIGID or any other

    def __post_init__(self) -> None:
        """Check the parameters."""
        if not self.piston_speed <= self.cj_state.particle_velocity:
            raise ValueError(
                f"PlanarTaylorWave: expected a piston speed of at most u_CJ = {self.cj_state.particle_velocity:g} m/s, "
                f"got {self.piston_speed:g} m/s, which would overdrive the front"
            )

    @cached_property
    def cj_state(self) -> ChapmanJouguetState:
        """The state at the front."""
        return ideal_gas_state(self.gamma, self.density, self.detonation_speed)

    @property
    def cj_pressure(self) -> float:
        """p_CJ = rho0 D^2 / (gamma + 1) [Pa]."""
        return self.cj_state.pressure

    @property
    def tail_speed(self) -> float:
        """K, at which the gas escapes where it can [m/s] (negative: away from the front)."""
        return self.cj_state.particle_velocity - 2.0 / (self.gamma - 1.0) * self.cj_state.sound_speed

    @property
    def rear_speed(self) -> float:
        """Speed of the last gas [m/s]: of the piston, or K."""
        return max(self.piston_speed, self.tail_speed)

    @property
    def fan_end_speed(self) -> float:
        """u_R + c_R, at which the end of the fan moves [m/s]; K with a free rear face."""
        return self.rear_speed + 0.5 * (self.gamma - 1.0) * (self.rear_speed - self.tail_speed)

    @property
    def plateau_pressure(self) -> float:
        """Pressure between the piston and the fan [Pa]; 0 with a free rear face."""
        return float(self.pressure(np.array(self.fan_end_speed), 1.0))

    def sound_speed(self, position: np.ndarray, time: float) -> np.ndarray:
        """Sound speed [m/s] at positions [m]; 0 in vacuum and in unburnt matter."""
        xi = np.asarray(position, dtype=float) / time
        within = (xi >= self.rear_speed) & (xi <= self.detonation_speed)
        return np.where(within, self._fan_sound_speed(np.maximum(xi, self.fan_end_speed)), 0.0)

    def velocity(self, position: np.ndarray, time: float) -> np.ndarray:
        """Particle velocity [m/s]; 0 in vacuum and in unburnt matter."""
        speed = self.sound_speed(position, time)
        return np.where(speed > 0.0, self.tail_speed + 2.0 / (self.gamma - 1.0) * speed, 0.0)

    def pressure(self, position: np.ndarray, time: float) -> np.ndarray:
        """Pressure [Pa]; 0 in vacuum and in unburnt matter."""
        return self.cj_pressure * self._relative_speed(position, time) ** self._pressure_exponent

    def products_density(self, position: np.ndarray, time: float) -> np.ndarray:
        """Density of the products [kg/m3]; 0 in vacuum and in unburnt matter."""
        return self.cj_state.density * self._relative_speed(position, time) ** self._density_exponent

    def mean_pressure(self, edges: np.ndarray, time: float) -> np.ndarray:
        """Mean pressure [Pa] of each cell between consecutive edges (n + 1,) [m], integrated exactly."""
        return self.cj_pressure * self._mean_power(edges, time, self._pressure_exponent)

    def mean_density(self, edges: np.ndarray, time: float) -> np.ndarray:
        """Mean density [kg/m3] of each cell, of products and of the unburnt matter ahead of the front alike."""
        products = self.cj_state.density * self._mean_power(edges, time, self._density_exponent)
        ahead = np.diff(np.maximum(edges, self.detonation_speed * time)) / np.diff(edges)
        return products + self.density * ahead

    def mean_velocity(self, edges: np.ndarray, time: float) -> np.ndarray:
        """Mean over each cell's length of the particle velocity [m/s], which counts as 0 where there are no products.

        The velocity is K + 2 c / (gamma - 1) wherever there are products.
        """
        products = self._mean_power(edges, time, 0.0)
        relative_sound = self._mean_power(edges, time, 1.0)
        return self.tail_speed * products + 2.0 / (self.gamma - 1.0) * self.cj_state.sound_speed * relative_sound

    @property
    def _pressure_exponent(self) -> float:
        """Of c / c_CJ in p / p_CJ."""
        return 2.0 * self.gamma / (self.gamma - 1.0)

    @property
    def _density_exponent(self) -> float:
        """Of c / c_CJ in rho / rho_CJ."""
        return 2.0 / (self.gamma - 1.0)

    def _fan_sound_speed(self, xi: np.ndarray) -> np.ndarray:
        return (self.gamma - 1.0) / (self.gamma + 1.0) * np.maximum(xi - self.tail_speed, 0.0)  # no -0 by rounding

    def _relative_speed(self, position: np.ndarray, time: float) -> np.ndarray:
        """c / c_CJ."""
        return self.sound_speed(position, time) / self.cj_state.sound_speed

    def _mean_power(self, edges: np.ndarray, time: float, exponent: float) -> np.ndarray:
        """Cell means of (c / c_CJ)^exponent, 0 where there are no products: of its primitive in plateau and fan."""
        cj_sound = self.cj_state.sound_speed
        inside = np.clip(edges, self.rear_speed * time, self.detonation_speed * time)
        join = self.fan_end_speed * time
        plateau = float(self._fan_sound_speed(np.array(self.fan_end_speed))) / cj_sound
        relative = self._fan_sound_speed(np.maximum(inside, join) / time) / cj_sound
        slope = (self.gamma - 1.0) / (self.gamma + 1.0) / (cj_sound * time)  # d(c / c_CJ) / dx in the fan
        primitive = plateau**exponent * np.minimum(inside, join) + relative ** (exponent + 1.0) / (
            slope * (exponent + 1.0)
        )
        return np.diff(primitive) / np.diff(edges)
