"""Noh's problem: cold gas runs into a wall, an axis or a point, and a shock brings it to rest.

Problem: at t = 0 an ideal gas of density rho0 and no pressure moves towards the plane, axis or point r = 0 everywhere
with the speed U. What arrives is stopped by a shock that runs outwards. k = 1, 2, 3 dimensions converge: a wall, an
axis, a point.

Equations: cold gas is in free flight, so r^(k-1) rho is carried along the paths r + U t, and behind the shock all is
uniform and at rest:

    rho = rho0 (1 + U t / r)^(k-1),                 u = -U,  p = 0                       for r > S t,
    rho = rho0 ((gamma + 1) / (gamma - 1))^k,       u = 0,   p = (gamma - 1) rho U^2 / 2   for r < S t,

with S = (gamma - 1) U / 2: all kinetic energy has become heat, e = U^2 / 2. Gas that began within an outer radius ends
at that radius less U t; it is cold, so its free surface sends no wave inwards, and nothing else changes until the shock
arrives there at t = 2 / (gamma + 1) outer_radius / U.

Reference: W. F. Noh, Errors for calculations of strong shocks using an artificial viscosity and an artificial heat
flux, J. Comput. Phys. 72 (1987) 78.
"""

import math
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class NohImplosion:
    """Exact flow of the implosion of a cold gas.

    Radii, not negative, are arrays [m], times above 0 [s]. Velocities are radial, negative inwards.

    Raises:
        ValueError: gamma is not above 1, there are not 1, 2 or 3 dimensions, or density, speed or outer radius is not
            positive.
    """

    dimensions: int  # k: 1 planar, 2 cylindrical, 3 spherical
    gamma: float = 5.0 / 3.0
    initial_density: float = 1.0  # rho0 [kg/m3]
    speed: float = 1.0  # U [m/s], inwards
    outer_radius: float = math.inf  # of the gas at t = 0 [m], with a vacuum around it

    def __post_init__(self) -> None:
        """Check the parameters."""
        if self.dimensions not in (1, 2, 3):
            raise ValueError(f"NohImplosion: dimensions: expected 1, 2 or 3, got {self.dimensions}")
        if not 1.0 < self.gamma < math.inf:
            raise ValueError(f"NohImplosion: gamma: expected a finite number above 1, got {self.gamma}")
        for name in ("initial_density", "speed", "outer_radius"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"NohImplosion: {name}: expected a positive number, got {getattr(self, name)}")

    @property
    def shock_speed(self) -> float:
        """S = (gamma - 1) U / 2 [m/s], outwards."""
        return 0.5 * (self.gamma - 1.0) * self.speed

    @property
    def plateau_density(self) -> float:
        """Density behind the shock [kg/m3]: 4, 16, 64 times the initial one for gamma = 5/3."""
        return self.initial_density * ((self.gamma + 1.0) / (self.gamma - 1.0)) ** self.dimensions

    @property
    def plateau_energy(self) -> float:
        """Specific internal energy behind the shock, U^2 / 2 [J/kg]."""
        return 0.5 * self.speed**2

    @property
    def plateau_pressure(self) -> float:
        """Pressure behind the shock [Pa]."""
        return (self.gamma - 1.0) * self.plateau_density * self.plateau_energy

    @property
    def last_time(self) -> float:
        """When the shock reaches the edge of the gas, and the solution ends [s]."""
        return self.outer_radius / (self.speed + self.shock_speed)

    def shock_radius(self, time: float) -> float:
        """Where the shock is [m]."""
        return self.shock_speed * time

    def edge_radius(self, time: float) -> float:
        """Where the gas ends [m]."""
        return self.outer_radius - self.speed * time

    def density(self, radius: np.ndarray, time: float) -> np.ndarray:
        """Density [kg/m3]."""
        behind, falling = self._places(radius, time)
        place = np.maximum(np.asarray(radius, dtype=float), self.shock_radius(time))
        crowded = self.initial_density * (1.0 + self.speed * time / place) ** (self.dimensions - 1)
        return np.where(behind, self.plateau_density, np.where(falling, crowded, 0.0))

    def velocity(self, radius: np.ndarray, time: float) -> np.ndarray:
        """Radial velocity [m/s]; 0 in the vacuum."""
        return np.where(self._places(radius, time)[1], -self.speed, 0.0)

    def pressure(self, radius: np.ndarray, time: float) -> np.ndarray:
        """Pressure [Pa]."""
        return np.where(self._places(radius, time)[0], self.plateau_pressure, 0.0)

    def energy(self, radius: np.ndarray, time: float) -> np.ndarray:
        """Specific internal energy [J/kg]."""
        return np.where(self._places(radius, time)[0], self.plateau_energy, 0.0)

    def mean_density(self, edges: np.ndarray, time: float) -> np.ndarray:
        """Mean density [kg/m3] of each shell between consecutive radii (n + 1,) [m], integrated exactly."""
        k = self.dimensions
        shock, edge = self.shock_radius(time), self.edge_radius(time)
        behind = self.plateau_density * np.minimum(edges, shock) ** k
        # Where the gas was at t = 0, it had the volume to which its mass is proportional.
        ahead = self.initial_density * (np.clip(edges, shock, edge) + self.speed * time) ** k
        return np.diff(behind + ahead) / np.diff(np.asarray(edges, dtype=float) ** k)

    def mean_velocity(self, edges: np.ndarray, time: float) -> np.ndarray:
        """Mean radial velocity [m/s] of each shell by volume, integrated exactly; the vacuum counts with 0."""
        return -self.speed * self._shares(edges, self.shock_radius(time), self.edge_radius(time))

    def mean_pressure(self, edges: np.ndarray, time: float) -> np.ndarray:
        """Mean pressure [Pa] of each shell, integrated exactly."""
        return self.plateau_pressure * self._shares(edges, 0.0, self.shock_radius(time))

    def _places(self, radius: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
        """Which radii lie behind the shock, and which in the gas that still falls."""
        place = np.asarray(radius, dtype=float)
        behind = place < self.shock_radius(time)
        return behind, ~behind & (place < self.edge_radius(time))

    def _shares(self, edges: np.ndarray, inner: float, outer: float) -> np.ndarray:
        """Share of each shell's volume that lies between two radii."""
        inside = np.clip(edges, inner, outer)
        return np.diff(inside**self.dimensions) / np.diff(np.asarray(edges, dtype=float) ** self.dimensions)
