"""A plain one-dimensional Lagrangian code for a gamma-law gas: it shares nothing with the solver or exact solutions.

Nodes carry position and velocity, cells mass and energy; artificial viscosity captures shocks; the energy is updated by
the work of the pressure at mid-step. J. von Neumann, R. D. Richtmyer, J. Appl. Phys. 21 (1950) 232.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

QUADRATIC, LINEAR = 1.5, 0.06  # coefficients of the viscosity
COURANT = 0.25


@dataclass
class LagrangianGas:
    """Cells between a free face on the left and a rigid wall on the right."""

    gamma: float
    position: np.ndarray  # of nodes (n + 1,)
    velocity: np.ndarray  # of nodes (n + 1,)
    mass: np.ndarray  # of cells (n,)
    energy: np.ndarray  # specific, of cells (n,)
    burn_fraction: Callable[[float], np.ndarray]  # of cells, against time
    time: float = 0.0
    wall_impulse: float = 0.0
    pressure: np.ndarray = field(init=False)
    viscous: np.ndarray = field(init=False)

    def __post_init__(self):
        self.pressure = self.burn_fraction(self.time) * (self.gamma - 1.0) * self.density * self.energy
        self.viscous = np.zeros_like(self.mass)
        self.step = 1e-3 * np.diff(self.position).min()

    @property
    def density(self):
        """Of cells (n,)."""
        return self.mass / np.diff(self.position)

    def advance(self, end):
        """Go on to a time; returns the gas itself."""
        while self.time < end * (1.0 - 1e-12):
            sound = np.sqrt(self.gamma * (self.gamma - 1.0) * self.energy)
            crossing = np.diff(self.position) / (sound + 2.0 * QUADRATIC * np.abs(np.diff(self.velocity)))
            self.step = min(1.05 * self.step, COURANT * crossing.min())
            self._one(min(self.step, end - self.time), sound)
        return self

    def _one(self, dt, sound):
        stress = self.pressure + self.viscous
        force = -np.diff(np.concatenate([[0.0], stress, [0.0]]))
        force[-1] = 0.0
        nodal_mass = 0.5 * (np.append(self.mass, 0.0) + np.append(0.0, self.mass))
        before = self.density
        self.velocity = self.velocity + dt * force / nodal_mass
        self.position = self.position + dt * self.velocity
        self.time += dt
        self.wall_impulse += dt * stress[-1]
        density, fraction = self.density, self.burn_fraction(self.time)
        closing = np.minimum(np.diff(self.velocity), 0.0)
        viscous = np.where(fraction > 0.0, density * (QUADRATIC * closing**2 - LINEAR * sound * closing), 0.0)
        growth = 1.0 / density - 1.0 / before
        slope = fraction * (self.gamma - 1.0) * density
        work = (0.5 * self.pressure + 0.5 * (viscous + self.viscous)) * growth
        self.energy = (self.energy - work) / (1.0 + 0.5 * slope * growth)
        self.pressure, self.viscous = slope * self.energy, viscous
