"""The Taylor wave: the flow behind a plane Chapman-Jouguet front in a gamma-law explosive with a free rear face.

Problem: at t = 0 the face x = 0 of a half-space x > 0 of explosive (density rho0, gamma-law products) is lit; behind
the face there is vacuum. The front runs at D; what is the flow behind it at time t?

Equations: behind the front the entropy is uniform and the flow depends on xi = x / t alone. Every C+ characteristic
starts at the origin, u + c = xi, and the C- invariant is that of the front, u - 2 c / (gamma - 1) = K with
K = u_CJ - 2 c_CJ / (gamma - 1), u_CJ = D / (gamma + 1), c_CJ = gamma D / (gamma + 1). Hence

    c = (gamma - 1) / (gamma + 1) (xi - K),  u = xi - c,  p = p_CJ (c / c_CJ)^(2 gamma / (gamma - 1)),
    rho = rho_CJ (c / c_CJ)^(2 / (gamma - 1)),  for K < xi < D; vacuum below K, rest above D.

For gamma = 2: K = -D, c = (xi + D) / 3, p = p_CJ ((xi / D + 1) / 2)^4.

Reference: G. I. Taylor, The dynamics of the combustion products behind plane and spherical detonation fronts in
explosives, Proc. R. Soc. A 200 (1950) 235; Fickett and Davis, Detonation, section 2C.
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class PlanarTaylorWave:
    """Exact flow behind a plane front that started at x = 0, t = 0 from a free face."""

    gamma: float
    density: float  # rho0 [kg/m3]
    detonation_speed: float  # D [m/s]

    @property
    def cj_pressure(self) -> float:
        """p_CJ = rho0 D^2 / (gamma + 1) [Pa]."""
        return self.density * self.detonation_speed**2 / (self.gamma + 1.0)

    @property
    def tail_speed(self) -> float:
        """K, at which the gas escapes into the vacuum [m/s] (negative: away from the front)."""
        cj_velocity = self.detonation_speed / (self.gamma + 1.0)
        return cj_velocity - 2.0 / (self.gamma - 1.0) * self.gamma * cj_velocity

    def sound_speed(self, position: np.ndarray, time: float) -> np.ndarray:
        """Sound speed [m/s] at positions [m]; 0 in vacuum and in unburnt matter."""
        xi = np.asarray(position, dtype=float) / time
        speed = (self.gamma - 1.0) / (self.gamma + 1.0) * (xi - self.tail_speed)
        return np.where((xi > self.tail_speed) & (xi <= self.detonation_speed), speed, 0.0)

    def velocity(self, position: np.ndarray, time: float) -> np.ndarray:
        """Particle velocity [m/s]; 0 in vacuum and in unburnt matter."""
        speed = self.sound_speed(position, time)
        return np.where(speed > 0.0, np.asarray(position, dtype=float) / time - speed, 0.0)

    def pressure(self, position: np.ndarray, time: float) -> np.ndarray:
        """Pressure [Pa]; 0 in vacuum and in unburnt matter."""
        exponent = 2.0 * self.gamma / (self.gamma - 1.0)
        return self.cj_pressure * self._relative_speed(position, time) ** exponent

    def products_density(self, position: np.ndarray, time: float) -> np.ndarray:
        """Density of the products [kg/m3]; 0 in vacuum and in unburnt matter."""
        cj_density = self.density * (self.gamma + 1.0) / self.gamma
        return cj_density * self._relative_speed(position, time) ** (2.0 / (self.gamma - 1.0))

    def mean_pressure(self, edges: np.ndarray, time: float) -> np.ndarray:
        """Mean pressure [Pa] of each cell between consecutive edges (n + 1,) [m], integrated exactly."""
        low, high = self.tail_speed * time, self.detonation_speed * time
        inside = np.clip(edges, low, high)
        cj_sound = self.gamma * self.detonation_speed / (self.gamma + 1.0)
        exponent = 2.0 * self.gamma / (self.gamma - 1.0)
        factor = (self.gamma - 1.0) / (self.gamma + 1.0)
        relative = factor * (inside / time - self.tail_speed) / cj_sound
        primitive = self.cj_pressure * relative ** (exponent + 1.0) * cj_sound * time / (factor * (exponent + 1.0))
        return np.diff(primitive) / np.diff(edges)

    def _relative_speed(self, position: np.ndarray, time: float) -> np.ndarray:
        cj_sound = self.gamma * self.detonation_speed / (self.gamma + 1.0)
        return self.sound_speed(position, time) / cj_sound
