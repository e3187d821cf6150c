"""The Riemann problem: two uniform states of one ideal gas, apart until t = 0, let go.

Problem: at t = 0 the gas at x < x0 has density, velocity and pressure of the left state, that at x > x0 those of the
right one. No length is given, so the flow depends on xi = (x - x0) / t alone. Sod's shock tube is an example.

Equations: a wave runs into each state K (sign s = -1 to the left, +1 to the right); between them pressure p* and
velocity u* are uniform, and the densities meet at the contact xi = u*. With c^2 = gamma p / rho, p* solves
f_L(p) + f_R(p) + u_R - u_L = 0, where

    f_K = (p - p_K) sqrt(A / (p + B)),  A = 2 / ((gamma + 1) rho_K),  B = (gamma - 1) / (gamma + 1) p_K  for p > p_K,
    f_K = 2 c_K / (gamma - 1) ((p / p_K)^((gamma - 1) / (2 gamma)) - 1)                                  otherwise,

and u* = u_K + s f_K(p*). A shock (p* > p_K) has the speed and density of the jump conditions,

    S = u_K + s sqrt(((gamma + 1) p* + (gamma - 1) p_K) / (2 rho_K)),  rho* = rho_K (S - u_K) / (S - u*).

A rarefaction keeps p / rho^gamma, and fans out from u_K + s c_K to u* + s c*; in it both c and u are linear in xi,

    c = c_K + s (gamma - 1) / (gamma + 1) (xi - u_K - s c_K),  u = u_K + 2 / (gamma + 1) (xi - u_K - s c_K).

If u_R - u_L >= 2 (c_L + c_R) / (gamma - 1), or one state is a vacuum, fans end at u_K - s 2 c_K / (gamma - 1), where
c = 0, and a vacuum lies beyond. All is piecewise a power of a linear function of xi: means over cells are exact.

Reference: E. F. Toro, Riemann Solvers and Numerical Methods for Fluid Dynamics, 3rd ed., Springer 2009, chapter 4
(star state: 4.2, 4.3; sampling: 4.5; vacuum: 4.6; tests: table 4.1). G. A. Sod, J. Comput. Phys. 27 (1978) 1.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

ITERATIONS = 200  # at most; Newton takes 5 to 10, each bisection halves what is left
CONVERGED = 1e-15  # relative change of the pressure at which the iteration ends
LARGEST_LOGARITHM = 700.0  # whose exponential is a number


@dataclass(frozen=True)
class GasState:
    """A uniform state of a gas; a vacuum has neither density nor pressure."""

    density: float  # [kg/m3]
    velocity: float  # [m/s]
    pressure: float  # [Pa]

    @property
    def is_vacuum(self) -> bool:
        """Whether there is nothing."""
        return self.density == 0.0

    def sound_speed(self, gamma: float) -> float:
        """Speed of sound c [m/s]; 0 in a vacuum."""
        return 0.0 if self.is_vacuum else math.sqrt(gamma * self.pressure / self.density)


@dataclass(frozen=True)
class StarState:
    """The state between the two waves."""

    pressure: float  # p* [Pa]
    velocity: float  # u* [m/s], also that of the contact
    left_density: float  # left of the contact [kg/m3]
    right_density: float  # right of it [kg/m3]


@dataclass(frozen=True)
class Region:
    """A part of the flow, lower < xi < upper, in which c / c_K = 1 + k (xi - reference) and u is linear too."""

    lower: float  # [m/s]
    upper: float  # [m/s]
    state: GasState  # at xi = reference
    reference: float = 0.0  # [m/s]
    sound_slope: float = 0.0  # k [s/m], 0 where the flow is uniform
    velocity_slope: float = 0.0  # du / dxi

    def relative_sound(self, xi: np.ndarray) -> np.ndarray:
        """Speed of sound over that at the reference."""
        return np.maximum(1.0 + self.sound_slope * (xi - self.reference), 0.0)

    def velocity(self, xi: np.ndarray) -> np.ndarray:
        """Velocity [m/s]."""
        return self.state.velocity + self.velocity_slope * (xi - self.reference)

    def power_integral(self, xi: np.ndarray, exponent: float) -> np.ndarray:
        """Integral of relative_sound^exponent over xi from the reference [m/s]."""
        if self.sound_slope == 0.0:
            return xi - self.reference
        return (self.relative_sound(xi) ** (exponent + 1.0) - 1.0) / (self.sound_slope * (exponent + 1.0))

    def velocity_integral(self, xi: np.ndarray) -> np.ndarray:
        """Integral of the velocity over xi from the reference [m2/s2]."""
        way = xi - self.reference
        return self.state.velocity * way + 0.5 * self.velocity_slope * way**2


FieldOfRegion = Callable[[Region, np.ndarray], np.ndarray]


@dataclass(frozen=True)
class RiemannProblem:
    """Exact flow from two states that meet at x = `origin` at t = 0.

    Positions are arrays [m], times above 0 [s]. In a vacuum every field is 0, the velocity too.

    Raises:
        ValueError: gamma is not above 1, a density or pressure is negative, a vacuum has a pressure, or both states
            are a vacuum.
    """

    left: GasState
    right: GasState
    gamma: float = 1.4
    origin: float = 0.0  # x0 [m]

    def __post_init__(self) -> None:
        """Check the states."""
        if not 1.0 < self.gamma < math.inf:
            raise ValueError(f"RiemannProblem: gamma: expected a finite number above 1, got {self.gamma}")
        for state in (self.left, self.right):
            if state.density < 0.0 or state.pressure < 0.0 or (state.is_vacuum and state.pressure > 0.0):
                raise ValueError(f"RiemannProblem: expected a gas, or a vacuum without pressure, got {state}")
        if self.left.is_vacuum and self.right.is_vacuum:
            raise ValueError("RiemannProblem: expected gas on one side at least, got two vacua")

    @property
    def has_vacuum(self) -> bool:
        """Whether a vacuum lies, or opens, between the two gases: they part faster than they can follow."""
        return self.left.is_vacuum or self.right.is_vacuum or self._two_rarefaction_pressure() == 0.0

    @cached_property
    def star(self) -> StarState:
        """The state between the waves.

        Raises:
            ValueError: there is a vacuum in its place.
        """
        if self.has_vacuum:
            raise ValueError("RiemannProblem: expected a star state, got a vacuum between the gases")
        pressure = self._star_pressure()
        right, left = (wave_strength(state, self.gamma, pressure)[0] for state in (self.right, self.left))
        velocity = 0.5 * (self.left.velocity + self.right.velocity + right - left)
        densities = (self._star_density(state, pressure) for state in (self.left, self.right))
        return StarState(pressure, velocity, *densities)

    @cached_property
    def regions(self) -> tuple[Region, ...]:
        """The parts of the flow that hold gas, from left to right."""
        left = self._regions_of(self.left, -1.0)
        right = self._regions_of(self.right, 1.0)
        return tuple(region for region in (*left, *reversed(right)) if region.lower < region.upper)

    def density(self, position: np.ndarray, time: float) -> np.ndarray:
        """Density [kg/m3]."""
        power = self._density_power
        return self._sample(position, time, lambda part, xi: part.state.density * part.relative_sound(xi) ** power)

    def velocity(self, position: np.ndarray, time: float) -> np.ndarray:
        """Velocity [m/s]."""
        return self._sample(position, time, lambda part, xi: part.velocity(xi))

    def pressure(self, position: np.ndarray, time: float) -> np.ndarray:
        """Pressure [Pa]."""
        power = self._pressure_power
        return self._sample(position, time, lambda part, xi: part.state.pressure * part.relative_sound(xi) ** power)

    def energy(self, position: np.ndarray, time: float) -> np.ndarray:
        """Specific internal energy p / ((gamma - 1) rho) [J/kg]."""
        return self._sample(position, time, lambda part, xi: self._energy_of(part.state) * part.relative_sound(xi) ** 2)

    def mean_density(self, edges: np.ndarray, time: float) -> np.ndarray:
        """Mean density [kg/m3] of each cell between consecutive edges (n + 1,) [m], integrated exactly."""
        power = self._density_power
        return self._mean(edges, time, lambda part, xi: part.state.density * part.power_integral(xi, power))

    def mean_velocity(self, edges: np.ndarray, time: float) -> np.ndarray:
        """Mean velocity [m/s] of each cell, integrated exactly; a vacuum counts with 0."""
        return self._mean(edges, time, lambda part, xi: part.velocity_integral(xi))

    def mean_pressure(self, edges: np.ndarray, time: float) -> np.ndarray:
        """Mean pressure [Pa] of each cell, integrated exactly."""
        power = self._pressure_power
        return self._mean(edges, time, lambda part, xi: part.state.pressure * part.power_integral(xi, power))

    @property
    def _density_power(self) -> float:
        """Of the speed of sound along an isentrope: rho ~ c^(2 / (gamma - 1))."""
        return 2.0 / (self.gamma - 1.0)

    @property
    def _pressure_power(self) -> float:
        """Of the speed of sound along an isentrope: p ~ c^(2 gamma / (gamma - 1))."""
        return 2.0 * self.gamma / (self.gamma - 1.0)

    def _energy_of(self, state: GasState) -> float:
        return state.pressure / ((self.gamma - 1.0) * state.density)

    def _sample(self, position: np.ndarray, time: float, field: FieldOfRegion) -> np.ndarray:
        """The field at each position: that of the region it lies in, 0 in none."""
        xi = (np.asarray(position, dtype=float) - self.origin) / time
        values = np.zeros_like(xi)
        for region in self.regions:
            values = np.where((xi >= region.lower) & (xi < region.upper), field(region, xi), values)
        return values

    def _mean(self, edges: np.ndarray, time: float, integral: FieldOfRegion) -> np.ndarray:
        """The mean over each cell: of every region, the integral over the part of it that lies in the cell."""
        xi = (np.asarray(edges, dtype=float) - self.origin) / time
        parts = (np.diff(integral(region, np.clip(xi, region.lower, region.upper))) for region in self.regions)
        return sum(parts, np.zeros(len(xi) - 1)) / np.diff(xi)

    def _two_rarefaction_pressure(self) -> float:
        """p* if both waves are rarefactions, as a closed formula [Pa]; 0 if they leave a vacuum (Toro, eq. 4.46)."""
        gamma, states = self.gamma, (self.left, self.right)
        apart = self.right.velocity - self.left.velocity
        room = sum(state.sound_speed(gamma) for state in states) - 0.5 * (gamma - 1.0) * apart
        if room <= 0.0:
            return 0.0
        scale = sum(math.sqrt(gamma / state.density) * state.pressure ** (0.5 / gamma) for state in states)
        logarithm = self._pressure_power * math.log(room / scale) if scale > 0.0 else math.inf
        return math.exp(logarithm) if logarithm < LARGEST_LOGARITHM else math.inf

    def _star_pressure(self) -> float:
        """Root of f_L + f_R + u_R - u_L, which grows with the pressure: Newton, and bisection where that leaves it."""
        low = min(self.left.pressure, self.right.pressure)
        pressure = self._two_rarefaction_pressure()
        if pressure <= low:
            return pressure
        apart = self.right.velocity - self.left.velocity

        def excess(pressure: float) -> tuple[float, float]:
            left, right = (wave_strength(state, self.gamma, pressure) for state in (self.left, self.right))
            return left[0] + right[0] + apart, left[1] + right[1]

        high = max(self.left.pressure, self.right.pressure)
        high += (self.left.density + self.right.density) * apart**2
        while excess(high)[0] < 0.0:
            low, high = high, 2.0 * high
        pressure = high
        for _ in range(ITERATIONS):
            value, slope = excess(pressure)
            low, high = (pressure, high) if value < 0.0 else (low, pressure)
            following = pressure - value / slope
            if following <= 0.0 or not low <= following <= high:
                following = 0.5 * (low + high)
            if abs(following - pressure) <= CONVERGED * following:
                break
            pressure = following
        return following

    def _star_density(self, state: GasState, pressure: float) -> float:
        """Density behind the wave into a state, by the jump conditions or along the isentrope [kg/m3]."""
        gamma = self.gamma
        if pressure > state.pressure:
            rise = (gamma + 1.0) * pressure + (gamma - 1.0) * state.pressure
            return state.density * rise / ((gamma - 1.0) * pressure + (gamma + 1.0) * state.pressure)
        return state.density * (pressure / state.pressure) ** (1.0 / gamma) if pressure > 0.0 else 0.0

    def _regions_of(self, state: GasState, sign: float) -> tuple[Region, ...]:
        """The regions of one gas from its undisturbed state to the contact, or to the edge of the vacuum."""
        if state.is_vacuum:
            return ()
        gamma, sound = self.gamma, state.sound_speed(self.gamma)
        if self.has_vacuum:
            behind = GasState(0.0, state.velocity - sign * 2.0 * sound / (gamma - 1.0), 0.0)
        else:
            density = self.star.left_density if sign < 0.0 else self.star.right_density
            behind = GasState(density, self.star.velocity, self.star.pressure)
        if behind.pressure > state.pressure:
            dynamic = (gamma + 1.0) * behind.pressure + (gamma - 1.0) * state.pressure
            head = tail = state.velocity + sign * math.sqrt(dynamic / (2.0 * state.density))
        else:
            head = state.velocity + sign * sound
            tail = behind.velocity + sign * behind.sound_speed(gamma)
        undisturbed = Region(*_ordered(sign * math.inf, head), state)
        uniform = Region(*_ordered(tail, behind.velocity), behind)
        if sound == 0.0:  # cold gas has no fan
            return (undisturbed, uniform)
        slope = sign * (gamma - 1.0) / (gamma + 1.0) / sound
        fan = Region(*_ordered(head, tail), state, head, slope, 2.0 / (gamma + 1.0))
        return (undisturbed, fan, uniform)


def wave_strength(state: GasState, gamma: float, pressure: float) -> tuple[float, float]:
    """Change of velocity f_K [m/s] across the wave that takes a state to a pressure above 0, and df_K / dp."""
    if pressure > state.pressure:
        a = 2.0 / ((gamma + 1.0) * state.density)
        b = (gamma - 1.0) / (gamma + 1.0) * state.pressure
        root = math.sqrt(a / (pressure + b))
        jump = pressure - state.pressure
        return jump * root, root * (1.0 - 0.5 * jump / (pressure + b))
    sound = state.sound_speed(gamma)
    relative_sound = (pressure / state.pressure) ** (0.5 * (gamma - 1.0) / gamma)
    slope = relative_sound * state.pressure / (pressure * state.density * sound)
    return 2.0 * sound / (gamma - 1.0) * (relative_sound - 1.0), slope


def _ordered(first: float, second: float) -> tuple[float, float]:
    return min(first, second), max(first, second)


# Toro's five tests, table 4.1: gamma = 1.4, on [0, 1], the states apart at 0.5.
SOD = RiemannProblem(GasState(1.0, 0.0, 1.0), GasState(0.125, 0.0, 0.1), origin=0.5)
DOUBLE_RAREFACTION = RiemannProblem(GasState(1.0, -2.0, 0.4), GasState(1.0, 2.0, 0.4), origin=0.5)
LEFT_BLAST = RiemannProblem(GasState(1.0, 0.0, 1000.0), GasState(1.0, 0.0, 0.01), origin=0.5)
RIGHT_BLAST = RiemannProblem(GasState(1.0, 0.0, 0.01), GasState(1.0, 0.0, 100.0), origin=0.5)
COLLIDING_STREAMS = RiemannProblem(
    GasState(5.99924, 19.5975, 460.894), GasState(5.99242, -6.19633, 46.0950), origin=0.5
)
TORO_TESTS = (SOD, DOUBLE_RAREFACTION, LEFT_BLAST, RIGHT_BLAST, COLLIDING_STREAMS)
TORO_TIMES = (0.25, 0.15, 0.012, 0.035, 0.035)  # at which Toro shows them [s]; Sod's is often shown at 0.2
