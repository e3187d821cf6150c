"""The steady programmed-burn front of finite width, in a gamma-law explosive.

Problem: a plane front is driven at the prescribed speed D into explosive at rest of density rho0. At time t the burn
fraction of the matter that began at X is F = (D t - X) / L, between 0 and 1, and its pressure is
p = F (gamma - 1) rho e; e starts at E0 and contains the chemical energy, so burning moves no energy: work alone changes
it. Which flow moves along with the front unchanged?

Equations: in a steady flow mass and momentum give rho (D - u) = rho0 D and p = rho0 D u (the Rayleigh line), and
de = -p d(1 / rho) gives e = E0 + u^2 / 2 all through the zone, for every F. With the law for p,

    (1 + b / 2) u^2 - D u + b E0 = 0,  b = F (gamma - 1),  u = (D - sqrt(D^2 - 4 (1 + b / 2) b E0)) / (2 + b):

the root that starts from rest. It is real up to F = 1 if D is at least the Chapman-Jouguet speed of the energy,
D_CJ^2 = 2 (gamma^2 - 1) E0; nothing steady exists below. Behind the zone, with D = d D_CJ (the overspeed law),

    p / p_CJ = d^2 (1 - sqrt(1 - 1 / d^2)),  p_CJ = rho0 D_CJ^2 / (gamma + 1), whatever gamma:

the Chapman-Jouguet state for d = 1, and for d > 1 a plateau on the weak branch, 0.877 at 1.01, 0.835 at 1.02, 0.766 at
1.05. The plateau grows, for it ends at the head of the Taylor wave behind it, which is slower: u + c < D.

Matter is compressed in the zone, so the distance behind the head of the front is

    z = integral of rho0 / rho over X = L integral of (1 - u / D) dF;

for d = 1 and gamma = 2 the zone is 0.8923 L thick.

What the zone costs. The Taylor wave has its full pressure right behind D t; the zone rises to it over its thickness.
To first order in L / R, R the way run, what is missing is A = integral of (p_CJ - p) dz = 0.6214 p_CJ L (gamma = 2)
of 0.4 p_CJ R, behind a free rear face: 0.0466, 0.0233, 0.0117 for L = 9, 4.5, 2.25 mm and R = 300 mm.
`BurnZone.pressure_error` has the wave's own decrease within the zone in it: 0.0448, 0.0229, 0.0115. It is not the whole
error of an infinitely fine grid. The zone holds less mass than the wave in its place, so the fan behind it is held back
by up to the zone's thickness, next to the zone, which costs another 0.031, 0.016, 0.008 (from a Lagrangian code with
4000 cells: that part depends on how the burn began, and has no closed form).

Reference: M. L. Wilkins, Computer Simulation of Dynamic Phenomena, Springer 1999; A. K. Kapila, J. B. Bdzil,
D. S. Stewart, On the structure and accuracy of programmed burn, Combust. Theory Modelling 10 (2006) 289; jump
conditions and the weak branch: Fickett and Davis, Detonation, section 2A.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from warp_mpm.exact.chapman_jouguet import ChapmanJouguetState, ideal_gas_energy, ideal_gas_state
from warp_mpm.exact.taylor_wave import PlanarTaylorWave

POINTS, WEIGHTS = np.polynomial.legendre.leggauss(64)
NEWTON_STEPS = 8


def overspeed_pressure(overspeed: float) -> float:
    """Pressure, over p_CJ, behind a front driven at `overspeed` = D / D_CJ times the speed of its energy.

    Raises:
        ValueError: the front is slower than its energy would drive it: no steady one exists.
    """
    if not overspeed >= 1.0:
        raise ValueError(f"overspeed: expected D / D_CJ of at least 1, got {overspeed}")
    return float(overspeed**2 * (1.0 - np.sqrt(1.0 - 1.0 / overspeed**2)))


@dataclass(frozen=True)
class BurnZone:
    """Steady front of a programmed burn.

    Burn fractions are arrays from 0 to 1, distances arrays [m] behind the head of the front.

    Raises:
        ValueError: gamma is not above 1, density, speed or width is not positive, or overspeed is below 1.
    """

    gamma: float
    density: float  # rho0 [kg/m3]
    detonation_speed: float  # D, at which the front is driven [m/s]
    width: float  # L [m], over which F rises to 1, measured where the matter began: burn_width x cell size
    overspeed: float = 1.0  # D over the Chapman-Jouguet speed of the energy

    def __post_init__(self) -> None:
        """Check the parameters."""
        overspeed_pressure(self.overspeed)  # raises what is wrong with it, the next with the others
        ideal_gas_state(self.gamma, self.density, self.detonation_speed)
        if not self.width > 0.0:
            raise ValueError(f"BurnZone: width: expected a positive number, got {self.width}")

    @cached_property
    def cj_state(self) -> ChapmanJouguetState:
        """The Chapman-Jouguet state of the energy."""
        return ideal_gas_state(self.gamma, self.density, self.detonation_speed / self.overspeed)

    @property
    def initial_energy(self) -> float:
        """E0 [J/kg]."""
        return ideal_gas_energy(self.gamma, self.cj_state.detonation_speed)

    @property
    def end_pressure(self) -> float:
        """Pressure behind the zone [Pa]."""
        return self.cj_state.pressure * overspeed_pressure(self.overspeed)

    @property
    def fan_head_speed(self) -> float:
        """u + c behind the zone, at which the plateau of an overspeed front ends [m/s]; D for a CJ front."""
        velocity, density = float(self.velocity(np.array(1.0))), float(self.products_density(np.array(1.0)))
        return velocity + math.sqrt(self.gamma * self.end_pressure / density)

    @property
    def thickness(self) -> float:
        """Distance from the head of the front to where all is burnt [m]."""
        return float(self.distance(np.array(1.0)))

    @property
    def missing_pressure(self) -> float:
        """A, the integral of what the pressure in the zone lacks of that behind it [Pa m]."""
        fraction, weight = self._quadrature(np.array(1.0))
        lacking = self.end_pressure - self.pressure(fraction)
        return float(self.width * (weight * lacking * self.density / self.products_density(fraction)).sum())

    def velocity(self, fraction: np.ndarray) -> np.ndarray:
        """Particle velocity u [m/s] where the burn fraction is F.

        The root in a form without differences of nearly equal numbers: u = 2 b E0 / (D + D sqrt(...)), with
        1 - 4 (1 + b / 2) b E0 / D^2 = 1 - 1 / d^2 + (1 - F) (1 + b / (gamma + 1)) / d^2 under the root.
        """
        fraction = np.asarray(fraction, dtype=float)
        slope = (self.gamma - 1.0) * fraction
        left = (1.0 - fraction) * (1.0 + slope / (self.gamma + 1.0))
        root = np.sqrt(1.0 - (1.0 - left) / self.overspeed**2)
        return 2.0 * slope * self.initial_energy / (self.detonation_speed * (1.0 + root))

    def pressure(self, fraction: np.ndarray) -> np.ndarray:
        """Pressure p = rho0 D u [Pa]."""
        return self.density * self.detonation_speed * self.velocity(fraction)

    def products_density(self, fraction: np.ndarray) -> np.ndarray:
        """Density rho = rho0 D / (D - u) [kg/m3]."""
        return self.density * self.detonation_speed / (self.detonation_speed - self.velocity(fraction))

    def energy(self, fraction: np.ndarray) -> np.ndarray:
        """Specific internal energy e = E0 + u^2 / 2 [J/kg], the chemical energy included."""
        return self.initial_energy + 0.5 * self.velocity(fraction) ** 2

    def distance(self, fraction: np.ndarray) -> np.ndarray:
        """How far behind the head of the front the burn fraction is F [m]."""
        inner, weight = self._quadrature(np.asarray(fraction, dtype=float))
        return self.width * (weight * self.density / self.products_density(inner)).sum(axis=-1)

    def burn_fraction(self, distance: np.ndarray) -> np.ndarray:
        """F at a distance behind the head of the front: 0 ahead of it, 1 behind the zone.

        By Newton's method: the distance grows with F, ever less, so it comes from below and never oversteps.
        """
        target = np.clip(distance, 0.0, self.thickness)
        fraction = np.zeros_like(target)
        for _ in range(NEWTON_STEPS):
            slope = self.width * self.density / self.products_density(fraction)
            fraction = np.minimum(fraction + (target - self.distance(fraction)) / slope, 1.0)
        return np.where(distance < self.thickness, fraction, 1.0)

    def pressure_error(self, run: float) -> float:
        """Relative L1 distance of the zone from the Taylor wave that it stands for, after a way R = `run` [m].

        The integral over the zone of |p - p_exact|, over the integral of p_exact, with a free rear face.

        Raises:
            ValueError: the front is an overspeed one, which has no Taylor wave right behind it.
        """
        if self.overspeed != 1.0:
            raise ValueError(f"BurnZone.pressure_error: expected an overspeed of 1, got {self.overspeed}")
        wave = PlanarTaylorWave(self.gamma, self.density, self.detonation_speed)
        time = run / self.detonation_speed
        fraction, weight = self._quadrature(np.array(1.0))
        exact = wave.pressure(run - self.distance(fraction), time)
        thickness = self.width * weight * self.density / self.products_density(fraction)
        ends = np.array([wave.tail_speed * time, run])
        total = wave.mean_pressure(ends, time)[0] * (ends[1] - ends[0])
        return float((thickness * np.abs(exact - self.pressure(fraction))).sum() / total)

    def _quadrature(self, end: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Points and weights (..., 64) of an integral over F from 0 to `end` (...).

        Gauss's rule in y = sqrt(1 - F): u goes as y at the end of a Chapman-Jouguet zone, and so is smooth.
        """
        low = np.sqrt(1.0 - end)[..., None]
        y = low + 0.5 * (1.0 - low) * (POINTS + 1.0)
        return 1.0 - y**2, (1.0 - low) * WEIGHTS * y
