"""The diverging Taylor wave: the flow behind a cylindrical or spherical Chapman-Jouguet front, gamma law.

Problem: at t = 0 explosive (density rho0, gamma-law products) that fills all space is lit along a line or at a point.
The front runs at D; what is the flow behind it at time t?

Equations: the entropy is uniform behind the front and, as there is no length, the flow depends on x = r / (D t) alone.
With u = D U(x), c = D C(x), w = x - U and j = 1 (cylindrical) or 2 (spherical), the Euler equations become

    dU / dx = j U C^2 / (x (w^2 - C^2)),  dC / dx = (gamma - 1) / 2 w / C dU / dx.

The Chapman-Jouguet front x = 1 is sonic, w = C: dU / dx is infinite there. Taking ln U as the independent variable
removes the singularity, and the square root with which a solution has to leave the front comes of itself:

    dx / dlnU = x (w^2 - C^2) / (j C^2),  dC / dlnU = (gamma - 1) / 2 w U / C,
    x = 1 - (gamma + 1) / (2 j U_CJ C_CJ) (U_CJ - U)^2 + ... near the front.

It ends at U = 0 and x = C, where a core at rest begins. The core's edge is a weak discontinuity: there U goes as
2 / (gamma + 3) (x - C) for a cylinder, and for a sphere as the solution of x - C = -(gamma + 1) / 2 U ln U. Pressure
and density follow from the uniform entropy: p = p_CJ (C / C_CJ)^(2 gamma / (gamma - 1)),
rho = rho_CJ (C / C_CJ)^(2 / (gamma - 1)).

For gamma = 2 the core's pressure is 0.2718 p_CJ (cylindrical) and 0.2476 p_CJ (spherical).

Reference: G. I. Taylor, The dynamics of the combustion products behind plane and spherical detonation fronts in
explosives, Proc. R. Soc. A 200 (1950) 235; Ya. B. Zeldovich, Zh. Eksp. Teor. Fiz. 12 (1942) 389; L. D. Landau,
E. M. Lifshitz, Fluid Mechanics, 2nd ed., Pergamon 1987, section 130.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from warp_mpm.exact.chapman_jouguet import ChapmanJouguetState, ideal_gas_state
from warp_mpm.exact.integration import hermite, runge_kutta

SMALLEST_VELOCITY = 1e-10  # of that at the front; what is slower is the core
STEPS = 4000  # of the integration in ln U


@dataclass(frozen=True)
class DivergingTaylorWave:
    """Exact flow behind a cylindrical or spherical front that started at r = 0, t = 0.

    Radii, not negative, are arrays [m], times above 0 [s]. Velocities are radial.

    Raises:
        ValueError: there are not 2 or 3 dimensions, gamma is not above 1, or density or speed is not positive.
    """

    dimensions: int  # j + 1: 2 cylindrical, 3 spherical
    gamma: float
    density: float  # rho0 [kg/m3]
    detonation_speed: float  # D [m/s]

    def __post_init__(self) -> None:
        """Check the parameters."""
        if self.dimensions not in (2, 3):
            raise ValueError(f"DivergingTaylorWave: dimensions: expected 2 or 3, got {self.dimensions}")
        ideal_gas_state(self.gamma, self.density, self.detonation_speed)  # raises what is wrong with them

    @cached_property
    def cj_state(self) -> ChapmanJouguetState:
        """The state at the front."""
        return ideal_gas_state(self.gamma, self.density, self.detonation_speed)

    @property
    def cj_pressure(self) -> float:
        """p_CJ = rho0 D^2 / (gamma + 1) [Pa]."""
        return self.cj_state.pressure

    @property
    def core_speed(self) -> float:
        """Speed of the edge of the core at rest [m/s], which is also the speed of sound in it."""
        return self.detonation_speed * self._profile.core_place

    @property
    def core_pressure(self) -> float:
        """Pressure in the core [Pa]."""
        return float(self.pressure(np.array(0.0), 1.0))

    def sound_speed(self, radius: np.ndarray, time: float) -> np.ndarray:
        """Sound speed [m/s] at radii [m]; 0 in unburnt matter."""
        return self.cj_state.sound_speed * self._relative_speed(radius, time)

    def velocity(self, radius: np.ndarray, time: float) -> np.ndarray:
        """Radial velocity [m/s]; 0 in unburnt matter."""
        return self.cj_state.particle_velocity * self._within(radius, time, self._profile.velocity_at)

    def pressure(self, radius: np.ndarray, time: float) -> np.ndarray:
        """Pressure [Pa]; 0 in unburnt matter."""
        return self.cj_pressure * self._relative_speed(radius, time) ** (2.0 * self.gamma / (self.gamma - 1.0))

    def products_density(self, radius: np.ndarray, time: float) -> np.ndarray:
        """Density of the products [kg/m3]; 0 in unburnt matter."""
        return self.cj_state.density * self._relative_speed(radius, time) ** (2.0 / (self.gamma - 1.0))

    def mean_pressure(self, edges: np.ndarray, time: float) -> np.ndarray:
        """Mean pressure [Pa] of each shell between consecutive radii (n + 1,) [m], by volume."""
        exponent = 2.0 * self.gamma / (self.gamma - 1.0)
        return self.cj_pressure * self._shell_means(edges, time, lambda x: self._profile.sound_speed_at(x) ** exponent)

    def mean_density(self, edges: np.ndarray, time: float) -> np.ndarray:
        """Mean density [kg/m3] of each shell, of products and of the unburnt matter ahead of the front alike."""
        exponent = 2.0 / (self.gamma - 1.0)
        products = self._shell_means(edges, time, lambda x: self._profile.sound_speed_at(x) ** exponent)
        volume = np.asarray(edges, dtype=float) ** self.dimensions
        ahead = np.diff(np.maximum(volume, (self.detonation_speed * time) ** self.dimensions)) / np.diff(volume)
        return self.cj_state.density * products + self.density * ahead

    def mean_velocity(self, edges: np.ndarray, time: float) -> np.ndarray:
        """Mean radial velocity [m/s] of each shell by volume; unburnt matter counts with 0."""
        return self.cj_state.particle_velocity * self._shell_means(edges, time, self._profile.velocity_at)

    @property
    def _profile(self) -> "SimilarityProfile":
        return similarity_profile(self.dimensions, self.gamma)

    def _relative_speed(self, radius: np.ndarray, time: float) -> np.ndarray:
        """c / c_CJ."""
        return self._within(radius, time, self._profile.sound_speed_at)

    def _within(self, radius: np.ndarray, time: float, field: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        """A field of x behind the front, and 0 ahead of it."""
        x = np.asarray(radius, dtype=float) / (self.detonation_speed * time)
        return np.where(x <= 1.0, field(np.minimum(x, 1.0)), 0.0)

    def _shell_means(self, edges: np.ndarray, time: float, field: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        """Means by volume over shells of a field of x that is 0 ahead of the front."""
        x = np.asarray(edges, dtype=float) / (self.detonation_speed * time)
        content = self._profile.content(np.minimum(x, 1.0), field)
        return np.diff(content) / np.diff(x**self.dimensions)


@dataclass(frozen=True)
class SimilarityProfile:
    """The flow against q = sqrt(1 - x), in which it is smooth at the front, from there to the core's edge."""

    dimensions: int
    place: np.ndarray  # q (n,), rising from 0
    state: np.ndarray  # U / U_CJ and C / C_CJ (n, 2)
    slope: np.ndarray  # their derivatives with respect to q (n, 2)

    @property
    def core_place(self) -> float:
        """x of the core's edge."""
        return float(1.0 - self.place[-1] ** 2)

    def velocity_at(self, x: np.ndarray) -> np.ndarray:
        """U / U_CJ at places x from 0 to 1; 0 in the core."""
        speed = hermite(self.place, self.state[:, 0], self.slope[:, 0], np.sqrt(1.0 - x))
        return np.where(x > self.core_place, speed, 0.0)

    def sound_speed_at(self, x: np.ndarray) -> np.ndarray:
        """C / C_CJ at places x from 0 to 1."""
        return hermite(self.place, self.state[:, 1], self.slope[:, 1], np.sqrt(1.0 - x))

    def content(self, x: np.ndarray, field: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        """Integral of a field of x over x^dimensions from the centre to places x of 0 to 1.

        From the front inwards by Simpson's rule in q, between the nodes by Hermite interpolation of the integral.
        """

        def integrand(q: np.ndarray) -> np.ndarray:
            x = 1.0 - q**2
            return -2.0 * q * self.dimensions * x ** (self.dimensions - 1) * field(x)

        nodes = integrand(self.place)
        middles = integrand(0.5 * (self.place[1:] + self.place[:-1]))
        parts = np.diff(self.place) / 6.0 * (nodes[1:] + 4.0 * middles + nodes[:-1])
        inwards = np.concatenate([[0.0], np.cumsum(parts)])
        at_core = float(field(np.array(self.core_place)))
        core = at_core * np.minimum(x, self.core_place) ** self.dimensions
        return core + hermite(self.place, inwards, nodes, np.sqrt(1.0 - x)) - inwards[-1]


@lru_cache(maxsize=16)
def similarity_profile(dimensions: int, gamma: float) -> SimilarityProfile:
    """Integrate the similarity equations from the front, ln U = ln U_CJ, to the core, where U is next to nothing."""
    j = dimensions - 1
    front = np.array([1.0 / (gamma + 1.0), gamma / (gamma + 1.0)])  # U and C

    def slope(log_velocity: float, state: np.ndarray) -> np.ndarray:
        x, sound = state
        velocity = front[0] * math.exp(log_velocity)
        relative = x - velocity
        return np.array(
            [
                x * (relative - sound) * (relative + sound) / (j * sound**2),
                0.5 * (gamma - 1.0) * relative * velocity / sound,
            ]
        )

    path = runge_kutta(slope, 0.0, np.array([1.0, front[1]]), math.log(SMALLEST_VELOCITY), STEPS)
    velocity = front[0] * np.exp(path.place)
    place = np.sqrt(1.0 - path.state[:, 0])
    place_slope = -path.slope[1:, 0] / (2.0 * place[1:])  # dq / dlnU; at the front, the square root's own
    root = math.sqrt(2.0 * j * front[0] * front[1] / (gamma + 1.0))  # -dU / dq
    slopes = np.empty((STEPS + 1, 2))
    slopes[0] = -root, -0.5 * (gamma - 1.0) * root
    slopes[1:, 0] = velocity[1:] / place_slope
    slopes[1:, 1] = path.slope[1:, 1] / place_slope
    return SimilarityProfile(dimensions, place, np.column_stack([velocity, path.state[:, 1]]) / front, slopes / front)
