"""Sedov's blast wave: a point explosion in a cold gas.

Problem: at t = 0 the energy E is released at a point of an ideal gas at rest, of density rho0 and no pressure. A
spherical shock runs out; where is it, and what is behind it?

Equations: E, rho0 and t make one length only, so the shock is at R = xi0 (E t^2 / rho0)^(1/5), its speed is
R' = 2 R / (5 t), and profiles depend on x = r / R alone. Right behind the shock, which is a strong one,
u = 2 R' / (gamma + 1), rho = rho0 (gamma + 1) / (gamma - 1), p = 2 rho0 R'^2 / (gamma + 1). With V = u / (x R') as the
parameter, which grows from 1 / gamma at the center to V_s = 2 / (gamma + 1) at the shock, the flow is known in closed
form (subscript s: behind the shock):

    x^5 = (V / V_s)^-2 A^n1 B^n2,  p / p_s = x^2 (rho / rho_s) (V / V_s)^2 C / B,
    rho / rho_s = B^n3 A^n4 C^n5,

    A = (gamma + 1) / (7 - gamma) (5 - (3 gamma - 1) V),  B = (gamma + 1) / (gamma - 1) (gamma V - 1),
    C = (gamma + 1) / (gamma - 1) (1 - V),  each 1 at the shock,
    n1 = -(13 gamma^2 - 7 gamma + 12) / ((3 gamma - 1) (2 gamma + 1)),  n2 = 5 (gamma - 1) / (2 gamma + 1),
    n3 = 3 / (2 gamma + 1),  n4 = -n1 / (2 - gamma),  n5 = -2 / (2 - gamma).

For gamma = 2 the last two are infinite; A^n4 C^n5 then is its limit. From gamma = 7 on the center is a vacuum. The mass
within x R grows as R^3, at the rate 4 pi r^2 rho (x R' - u), so it is x^3 (rho / rho0) (1 - V) of that within the
shock. The energy gives xi0: E = alpha rho0 R^5 / t^2 with alpha = xi0^-5 = 16 pi / 25 times the integral over x of
x^2 (rho u^2 / 2 + p / (gamma - 1)) / (rho0 R'^2). For gamma = 1.4, alpha = 0.851072 and xi0 = 1.0328; for gamma = 5/3,
0.493590 and 1.1517.

Reference: L. I. Sedov, Similarity and Dimensional Methods in Mechanics, Academic Press 1959, chapter 4; in the form of
L. D. Landau, E. M. Lifshitz, Fluid Mechanics, 2nd ed., Pergamon 1987, section 106. G. I. Taylor, Proc. R. Soc. A 201
(1950) 159. alpha: J. R. Kamm, F. X. Timmes, On efficient generation of numerically robust Sedov solutions, Los Alamos
LA-UR-07-2849 (2007). For gamma = 5/3: J. P. Ostriker, C. F. McKee, Rev. Mod. Phys. 60 (1988) 1, 1 / alpha = 2.026.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

BISECTIONS = 60  # of an interval of a few units, to round-off
PANELS = 64  # of the quadrature over the radius
POINTS, WEIGHTS = np.polynomial.legendre.leggauss(8)  # in each
SMALLEST_RADIUS = 1e-9  # of R; the pressure no longer changes below, nor does u / r
NEAR_TWO = 1e-8  # from gamma = 2, where the limit is closer than the formula


@dataclass(frozen=True)
class SedovBlast:
    """Exact spherical blast wave from a point.

    Radii, not negative, are arrays [m], times above 0 [s].

    Raises:
        ValueError: gamma is not between 1 and 7, or energy or density is not positive.
    """

    gamma: float = 1.4
    blast_energy: float = 1.0  # E, of the whole sphere [J]
    initial_density: float = 1.0  # rho0 [kg/m3]

    def __post_init__(self) -> None:
        """Check the parameters."""
        if not 1.0 < self.gamma < 7.0:
            raise ValueError(f"SedovBlast: gamma: expected a number above 1 and below 7, got {self.gamma}")
        for name in ("blast_energy", "initial_density"):
            if not 0.0 < getattr(self, name) < math.inf:
                raise ValueError(f"SedovBlast: {name}: expected a positive number, got {getattr(self, name)}")

    @cached_property
    def alpha(self) -> float:
        """E t^2 / (rho0 R^5), by Gauss quadrature."""
        edges = np.linspace(0.0, 1.0, PANELS + 1)
        x, weights = _quadrature(edges[:-1], edges[1:])
        profile = similarity_profile(x, self.gamma)
        energy = profile.density * profile.velocity**2 + profile.pressure
        return float(32.0 * math.pi / 25.0 / (self.gamma**2 - 1.0) * (x**2 * energy * weights).sum())

    @property
    def xi0(self) -> float:
        """R / (E t^2 / rho0)^(1/5)."""
        return self.alpha**-0.2

    def shock_radius(self, time: float) -> float:
        """R [m]."""
        return self.xi0 * (self.blast_energy * time**2 / self.initial_density) ** 0.2

    def shock_speed(self, time: float) -> float:
        """R' = 2 R / (5 t) [m/s]."""
        return 0.4 * self.shock_radius(time) / time

    def shock_pressure(self, time: float) -> float:
        """Pressure behind the shock [Pa]."""
        return 2.0 / (self.gamma + 1.0) * self.initial_density * self.shock_speed(time) ** 2

    def shock_velocity(self, time: float) -> float:
        """Velocity of the gas behind the shock [m/s]."""
        return 2.0 / (self.gamma + 1.0) * self.shock_speed(time)

    @property
    def shock_density(self) -> float:
        """Density behind the shock [kg/m3]."""
        return (self.gamma + 1.0) / (self.gamma - 1.0) * self.initial_density

    def density(self, radius: np.ndarray, time: float) -> np.ndarray:
        """Density [kg/m3]."""
        x = np.asarray(radius, dtype=float) / self.shock_radius(time)
        return np.where(x < 1.0, self.shock_density * similarity_profile(x, self.gamma).density, self.initial_density)

    def velocity(self, radius: np.ndarray, time: float) -> np.ndarray:
        """Radial velocity [m/s]."""
        x = np.asarray(radius, dtype=float) / self.shock_radius(time)
        return np.where(x < 1.0, self.shock_velocity(time) * similarity_profile(x, self.gamma).velocity, 0.0)

    def pressure(self, radius: np.ndarray, time: float) -> np.ndarray:
        """Pressure [Pa]."""
        x = np.asarray(radius, dtype=float) / self.shock_radius(time)
        return np.where(x < 1.0, self.shock_pressure(time) * similarity_profile(x, self.gamma).pressure, 0.0)

    def enclosed_mass(self, radius: np.ndarray, time: float) -> np.ndarray:
        """Mass within a radius [kg]."""
        r = np.asarray(radius, dtype=float)
        x = r / self.shock_radius(time)
        profile = similarity_profile(x, self.gamma)
        inside = self.shock_density * profile.density * (1.0 - 2.0 / (self.gamma + 1.0) * profile.slope)
        return 4.0 / 3.0 * math.pi * r**3 * np.where(x < 1.0, inside, self.initial_density)

    def mean_density(self, edges: np.ndarray, time: float) -> np.ndarray:
        """Mean density [kg/m3] of each shell between consecutive radii (n + 1,) [m], exact."""
        r = np.asarray(edges, dtype=float)
        return np.diff(self.enclosed_mass(r, time)) / (4.0 / 3.0 * math.pi * np.diff(r**3))

    def mean_velocity(self, edges: np.ndarray, time: float) -> np.ndarray:
        """Mean radial velocity [m/s] of each shell by volume, by Gauss quadrature of what lies behind the shock."""
        scale = self.shock_velocity(time)
        return self._shell_means(edges, time, lambda x: scale * similarity_profile(x, self.gamma).velocity)

    def mean_pressure(self, edges: np.ndarray, time: float) -> np.ndarray:
        """Mean pressure [Pa] of each shell, by Gauss quadrature of what lies behind the shock."""
        scale = self.shock_pressure(time)
        return self._shell_means(edges, time, lambda x: scale * similarity_profile(x, self.gamma).pressure)

    def _shell_means(self, edges: np.ndarray, time: float, field: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        """Mean over each shell of a field of x that is 0 ahead of the shock."""
        x = np.asarray(edges, dtype=float) / self.shock_radius(time)
        inside = np.minimum(x, 1.0)
        points, weights = _quadrature(inside[:-1], inside[1:])
        return 3.0 * (points**2 * field(points) * weights).sum(axis=1) / np.diff(x**3)


@dataclass(frozen=True)
class SimilarityProfile:
    """The flow behind the shock, each quantity over its value there."""

    density: np.ndarray
    velocity: np.ndarray
    pressure: np.ndarray
    slope: np.ndarray  # V, velocity over radius


def similarity_profile(x: np.ndarray, gamma: float) -> SimilarityProfile:
    """The flow at radii x = r / R, from 0 to 1; where x is larger, the state at the shock.

    The parameter, found for each x by bisection, is ln B and not V: near the center V is 1 / gamma to all the digits
    that a number holds.
    """
    place = np.clip(x, SMALLEST_RADIUS, 1.0)
    parameter = _parameter_of(place, gamma)
    v, log_v, log_a, log_c = _logarithms(parameter, gamma)
    log_density = 3.0 / (2.0 * gamma + 1.0) * parameter + _density_factor(v, log_a, log_c, gamma)
    log_pressure = 2.0 * np.log(place) + log_density + 2.0 * log_v + log_c - parameter
    slope = np.exp(log_v)
    return SimilarityProfile(np.exp(log_density), np.minimum(x, 1.0) * slope, np.exp(log_pressure), slope)


def _first_exponent(gamma: float) -> float:
    """n1."""
    return -(13.0 * gamma**2 - 7.0 * gamma + 12.0) / ((3.0 * gamma - 1.0) * (2.0 * gamma + 1.0))


def _logarithms(parameter: np.ndarray, gamma: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """V, and the logarithms of V / V_s, A and C, where the parameter is ln B."""
    v = (1.0 + (gamma - 1.0) / (gamma + 1.0) * np.exp(parameter)) / gamma
    log_a = np.log((gamma + 1.0) / (7.0 - gamma) * (5.0 - (3.0 * gamma - 1.0) * v))
    return v, np.log(0.5 * (gamma + 1.0) * v), log_a, np.log((gamma + 1.0) / (gamma - 1.0) * (1.0 - v))


def _density_factor(v: np.ndarray, log_a: np.ndarray, log_c: np.ndarray, gamma: float) -> np.ndarray:
    """Logarithm of A^n4 C^n5; its limit for gamma = 2, by l'Hospital's rule."""
    if abs(gamma - 2.0) < NEAR_TWO:
        return 0.2 * log_a - 2.4 + 1.2 * v / (1.0 - v)
    return -(_first_exponent(gamma) * log_a + 2.0 * log_c) / (2.0 - gamma)


def _parameter_of(x: np.ndarray, gamma: float) -> np.ndarray:
    """The parameter ln B at radii x, by bisection of 5 ln x = n2 ln B + h; h = n1 ln A - 2 ln (V / V_s) is bounded."""
    n1, n2 = _first_exponent(gamma), 5.0 * (gamma - 1.0) / (2.0 * gamma + 1.0)
    _, log_v, log_a, _ = _logarithms(np.array(-np.inf), gamma)  # at the center
    target = 5.0 * np.log(x)
    low = (target + 2.0 * log_v) / n2
    high = np.minimum((target - n1 * log_a) / n2, 0.0)
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        _, log_v, log_a, _ = _logarithms(middle, gamma)
        below = n2 * middle + n1 * log_a - 2.0 * log_v < target
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return 0.5 * (low + high)


def _quadrature(lower: np.ndarray, upper: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points and weights (n, 8) of Gauss's rule in each of n intervals."""
    middle, half = 0.5 * (lower + upper)[:, None], 0.5 * (upper - lower)[:, None]
    return middle + half * POINTS, half * WEIGHTS
