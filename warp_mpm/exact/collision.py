"""Head-on collision of two plane Chapman-Jouguet fronts, or reflection of one from a rigid wall, gamma law.

Problem: a plane front starts at the free rear face of a charge of length R, runs for T = R / D with its Taylor wave
behind it, and hits a rigid wall. By symmetry, that is one half of the head-on collision of two such fronts. What is the
pressure at the wall (the plane of collision) over the time t since contact?

At contact the state ahead of the reflected shock is the Chapman-Jouguet state and the state behind it is at rest. The
jump conditions give, with g for gamma, 2 g q^2 - (5 g + 1) q + g + 1 = 0 for q = p_2 / p_CJ,

    p_2 / p_CJ = (5 g + 1 + sqrt(17 g^2 + 2 g + 1)) / (4 g),  2.443 for gamma = 2,

and the shock leaves the wall at (g (q - 1) - 1) / (g + 1) D, 0.6287 D for gamma = 2. Afterwards the shock runs into
the Taylor wave, ever thinner, and the layer between wall and shock relaxes; its entropy is that which each particle
got from the shock.

Equations of the layer, with y the distance from the wall, v = dy / dt, m the mass per area between the wall and a
particle, V = 1 / rho, a = rho c: dv / dt = -dp / dm, dV / dt = dv / dm, dp / dt = -a^2 dv / dm, with v = 0 at the wall,
m = 0. At the shock, m = M(t), the jump conditions from the state ahead (subscript 0) hold,

    J^2 = rho_0 ((g + 1) p + (g - 1) p_0) / 2,  dM / dt = J,  v = v_0 + (p - p_0) / J,
    rho / rho_0 = ((g + 1) p + (g - 1) p_0) / ((g - 1) p + (g + 1) p_0),  dY / dt = v_0 + J / rho_0,

and the characteristic that catches up with it, dp + a dv = 0 along dm = a dt; likewise dp - a dv = 0 along dm = -a dt
at the wall. In the Taylor wave ahead, dp_0 = rho_0 c_0 du and drho_0 = rho_0 / c_0 du with du / dxi = 2 / (g + 1).

Method: shock fitting with Chebyshev collocation. In s = m / M(t), from 0 to 1, the layer is smooth at all times, and
p, v and V are polynomials through POINTS + 1 Chebyshev points. Time steps are equal in ln t (the layer grows from
nothing), by the Runge-Kutta scheme of fourth order; the start is the uniform state of contact at t = 1e-6 T. Nothing
captures the shock, so the error falls exponentially with POINTS: at t = 3 T, where it is largest, that of the pressure
at the wall is 2e-5, 7e-7, 9e-8, 5e-9 p_CJ for 4, 6, 8, 12; up to t = T it is below 1e-7 p_CJ with the values here.
For gamma = 2 the pressure at the wall is 1.8453, 1.4344, 0.7656 p_CJ at t = 0.1, 0.2, 0.5 T, and the impulse
to 0.5 and 1.0 T is 0.6904 and 0.9512 p_CJ T.
A rigid rear wall instead of the free face changes nothing at the wall until 1.07 T (gamma = 2): the shock meets the
plateau behind the Taylor wave at 0.42 T, and the wave which that sends takes the rest.

Reference: K. P. Stanyukovich, Unsteady Motion of Continuous Media, Pergamon 1960 (reflection of detonation waves);
R. Courant, K. O. Friedrichs, Supersonic Flow and Shock Waves, Springer 1976, chapter III; C. Canuto, M. Y. Hussaini,
A. Quarteroni, T. A. Zang, Spectral Methods: Evolution to Complex Geometries and Applications to Fluid Dynamics,
Springer 2007, chapter 4 (shock fitting).
"""

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from warp_mpm.exact.chapman_jouguet import ChapmanJouguetState, ideal_gas_state
from warp_mpm.exact.integration import Trajectory, runge_kutta
from warp_mpm.exact.taylor_wave import PlanarTaylorWave

POINTS = 12  # intervals between Chebyshev points
LOG_STEP = 0.01  # in ln t; stable up to about 4 / POINTS^2
FIRST_TIME = 1e-6  # of T: from contact to here the state is taken as that of contact
LAST_TIME = 3.0  # of T: later the thin tail of the wave asks for more points


def contact_pressure(gamma: float) -> float:
    """Pressure p_2 over p_CJ at the instant of contact."""
    return (5.0 * gamma + 1.0 + math.sqrt(17.0 * gamma**2 + 2.0 * gamma + 1.0)) / (4.0 * gamma)


def contact_shock_speed(gamma: float) -> float:
    """Speed of the reflected shock away from the wall over D at the instant of contact."""
    return (gamma * (contact_pressure(gamma) - 1.0) - 1.0) / (gamma + 1.0)


@dataclass(frozen=True)
class ShockedLayer:
    """The gas between the wall and the shock, at (n,) places from the wall to the shock."""

    distance: np.ndarray  # from the wall [m]
    pressure: np.ndarray  # [Pa]
    velocity: np.ndarray  # [m/s], away from the wall
    density: np.ndarray  # [kg/m3]
    mass: np.ndarray  # per area, between the wall and the place [kg/m2]


@dataclass(frozen=True)
class PlaneCollision:
    """Reflection of a plane Chapman-Jouguet front from a rigid wall, or one half of a head-on collision.

    Times are arrays [s] since contact, from 0 to 3 run times.

    Raises:
        ValueError: gamma is not above 1, density, speed or run is not positive, or (later) a time is out of range.
    """

    gamma: float
    density: float  # rho0 [kg/m3]
    detonation_speed: float  # D [m/s]
    run: float  # R: way from the free rear face to the wall [m]

    def __post_init__(self) -> None:
        """Check the parameters."""
        ideal_gas_state(self.gamma, self.density, self.detonation_speed)  # raises what is wrong with them
        if not 0.0 < self.run < math.inf:
            raise ValueError(f"PlaneCollision: run: expected a positive number, got {self.run}")

    @cached_property
    def cj_state(self) -> ChapmanJouguetState:
        """The state behind the front that arrives."""
        return ideal_gas_state(self.gamma, self.density, self.detonation_speed)

    @property
    def run_time(self) -> float:
        """T = R / D [s]."""
        return self.run / self.detonation_speed

    @property
    def contact_pressure(self) -> float:
        """Pressure at the instant of contact [Pa]."""
        return self.cj_state.pressure * contact_pressure(self.gamma)

    @property
    def contact_shock_speed(self) -> float:
        """Speed of the reflected shock away from the wall at the instant of contact [m/s]."""
        return self.detonation_speed * contact_shock_speed(self.gamma)

    def plane_pressure(self, time: np.ndarray) -> np.ndarray:
        """Pressure at the wall [Pa]."""
        return self.density * self.detonation_speed**2 * self._states(time)[..., 0]

    def impulse(self, time: np.ndarray) -> np.ndarray:
        """Integral of the pressure at the wall over the time since contact [Pa s]."""
        return self.density * self.detonation_speed * self.run * self._growing(time)[..., -1]

    def shock_distance(self, time: np.ndarray) -> np.ndarray:
        """Distance of the shock from the wall [m]."""
        return self.run * self._growing(time)[..., -2]

    def layer(self, time: float) -> ShockedLayer:
        """The gas between the wall and the shock at one time [s], at least 1e-6 run times."""
        scaled = max(time / self.run_time, FIRST_TIME)
        layer = _layer(self.gamma, scaled, self._states(np.array(time)))
        speed = self.detonation_speed
        return ShockedLayer(
            distance=self.run * layer.mass * (_integration(POINTS) @ layer.specific_volume),
            pressure=self.density * speed**2 * layer.pressure,
            velocity=speed * layer.velocity,
            density=self.density / layer.specific_volume,
            mass=self.density * self.run * layer.mass * chebyshev_points(POINTS),
        )

    @property
    def _path(self) -> Trajectory:
        return reflection(self.gamma, POINTS, LOG_STEP)

    def _states(self, time: np.ndarray) -> np.ndarray:
        """States (..., unknowns) at times since contact."""
        scaled = np.asarray(time, dtype=float) / self.run_time
        if not np.all((scaled >= 0.0) & (scaled <= LAST_TIME * (1.0 + 1e-12))):
            raise ValueError(f"PlaneCollision: time: expected 0 to {LAST_TIME:g} run times, got {time}")
        return self._path.at(np.log(np.maximum(scaled, FIRST_TIME)))

    def _growing(self, time: np.ndarray) -> np.ndarray:
        """States for quantities that grow from 0 at contact."""
        scaled = np.asarray(time, dtype=float) / self.run_time
        return self._states(time) * np.minimum(scaled / FIRST_TIME, 1.0)[..., None]


# From here on in units of rho0, D and R.


@dataclass(frozen=True)
class _Ahead:
    """State of the Taylor wave right ahead of the shock."""

    xi: float
    pressure: float
    density: float
    velocity: float  # away from the wall
    sound_speed: float


@dataclass(frozen=True)
class _Layer:
    """The layer at one time, at all points from the wall to the shock, and how the shock moves."""

    pressure: np.ndarray
    velocity: np.ndarray
    specific_volume: np.ndarray
    mass: float  # M
    flux: float  # J
    ahead: _Ahead


def _ahead(gamma: float, time: float, distance: float) -> _Ahead:
    """State of the Taylor wave at a distance from the wall, at a time since contact."""
    wave = PlanarTaylorWave(gamma, 1.0, 1.0)
    place, since_start = np.array(1.0 - distance), 1.0 + time
    density, pressure = float(wave.products_density(place, since_start)), float(wave.pressure(place, since_start))
    velocity = -float(wave.velocity(place, since_start))
    return _Ahead(float(place) / since_start, pressure, density, velocity, math.sqrt(gamma * pressure / density))


def _jump(gamma: float, pressure: float, ahead: _Ahead) -> tuple[float, float, float]:
    """Mass flux J, velocity and specific volume behind the shock, from the pressure behind it."""
    strong = (gamma + 1.0) * pressure + (gamma - 1.0) * ahead.pressure
    weak = (gamma - 1.0) * pressure + (gamma + 1.0) * ahead.pressure
    flux = math.sqrt(0.5 * ahead.density * strong)
    return flux, ahead.velocity + (pressure - ahead.pressure) / flux, weak / (strong * ahead.density)


def _layer(gamma: float, time: float, state: np.ndarray) -> _Layer:
    """The layer from the unknowns: p at all points, v between wall and shock, V at all but the shock, M, Y, impulse."""
    points = (len(state) - 3) // 3
    pressure, inner_velocity, inner_volume = np.split(state[:-3], [points + 1, 2 * points])
    mass, distance, _ = state[-3:]
    ahead = _ahead(gamma, time, distance)
    flux, velocity, volume = _jump(gamma, float(pressure[-1]), ahead)
    return _Layer(
        pressure=pressure,
        velocity=np.concatenate([[0.0], inner_velocity, [velocity]]),
        specific_volume=np.append(inner_volume, volume),
        mass=float(mass),
        flux=flux,
        ahead=ahead,
    )


def _rate(gamma: float, log_time: float, state: np.ndarray) -> np.ndarray:
    """d(state) / d(ln t)."""
    time = math.exp(log_time)
    layer = _layer(gamma, time, state)
    place = chebyshev_points(len(layer.pressure) - 1)
    by_mass = chebyshev_derivative(len(layer.pressure) - 1) / layer.mass
    dp, dv, dvolume = by_mass @ layer.pressure, by_mass @ layer.velocity, by_mass @ layer.specific_volume
    impedance = np.sqrt(gamma * layer.pressure / layer.specific_volume)  # a
    drift = layer.flux * place  # of the points through the gas: ds = 0 is dm = s dM
    pressure_rate = drift * dp - impedance**2 * dv
    pressure_rate[0] = impedance[0] * (dp[0] - impedance[0] * dv[0])
    pressure_rate[-1] = _shock_pressure_rate(gamma, time, layer, state[-2], impedance[-1], dp[-1], dv[-1])
    velocity_rate = drift * dv - dp
    volume_rate = drift * dvolume + dv
    volume_rate[0] = -pressure_rate[0] / impedance[0] ** 2
    shock_speed = layer.ahead.velocity + layer.flux / layer.ahead.density
    return time * np.concatenate(
        [pressure_rate, velocity_rate[1:-1], volume_rate[:-1], [layer.flux, shock_speed, layer.pressure[0]]]
    )


def _shock_pressure_rate(
    gamma: float, time: float, layer: _Layer, distance: float, impedance: float, dp: float, dv: float
) -> float:
    """How the pressure right behind the shock changes along with it.

    The characteristic that arrives says p' + a v' = (J - a) (dp + a dv) / dm for the changes along the shock's path.
    There v follows from p and the state ahead, which changes as the shock runs into the Taylor wave.
    """
    ahead, pressure, flux = layer.ahead, float(layer.pressure[-1]), layer.flux
    shock_speed = ahead.velocity + flux / ahead.density
    velocity_rate = 2.0 / (gamma + 1.0) * (-shock_speed - ahead.xi) / (1.0 + time)  # of u ahead
    pressure_rate = ahead.density * ahead.sound_speed * velocity_rate
    density_rate = ahead.density / ahead.sound_speed * velocity_rate
    jump = (pressure - ahead.pressure) / flux  # v - v_0
    share = 0.5 * jump / ((gamma + 1.0) * pressure + (gamma - 1.0) * ahead.pressure)
    by_pressure = 1.0 / flux - share * (gamma + 1.0)
    by_ahead = (
        -velocity_rate
        - (1.0 / flux + share * (gamma - 1.0)) * pressure_rate
        - 0.5 * jump / ahead.density * density_rate
    )
    arriving = (flux - impedance) * (dp + impedance * dv)
    return (arriving - impedance * by_ahead) / (1.0 + impedance * by_pressure)


@lru_cache(maxsize=8)
def reflection(gamma: float, points: int, log_step: float) -> Trajectory:
    """The layer from FIRST_TIME to LAST_TIME against ln t, in units of rho0, D, R: more points, smaller error.

    The state is p (points + 1) from the wall to the shock, v (points - 1) between them, V (points) without the shock's,
    M, the shock's distance from the wall and the impulse.
    """
    cj = ideal_gas_state(gamma, 1.0, 1.0)
    pressure = contact_pressure(gamma) * cj.pressure
    ahead = _Ahead(1.0, cj.pressure, cj.density, -cj.particle_velocity, cj.sound_speed)
    flux, _, volume = _jump(gamma, pressure, ahead)
    rates = [flux, ahead.velocity + flux / ahead.density, pressure]  # of M, of the distance, of the impulse
    start = np.concatenate(
        [np.full(points + 1, pressure), np.zeros(points - 1), np.full(points, volume), FIRST_TIME * np.array(rates)]
    )
    begin, end = math.log(FIRST_TIME), math.log(LAST_TIME)
    steps = math.ceil((end - begin) / log_step)
    return runge_kutta(lambda log_time, state: _rate(gamma, log_time, state), begin, start, end, steps)


@lru_cache(maxsize=8)
def chebyshev_points(count: int) -> np.ndarray:
    """Chebyshev points (count + 1,) from 0 to 1."""
    return 0.5 * (1.0 - np.cos(np.pi * np.arange(count + 1) / count))


@lru_cache(maxsize=8)
def chebyshev_derivative(count: int) -> np.ndarray:
    """Matrix (count + 1, count + 1): values at Chebyshev points to the derivative of the polynomial through them."""
    points = chebyshev_points(count)
    weight = (-1.0) ** np.arange(count + 1)
    weight[[0, -1]] *= 2.0
    apart = points[:, None] - points[None, :] + np.eye(count + 1)
    matrix = weight[:, None] / weight[None, :] / apart
    np.fill_diagonal(matrix, 0.0)
    np.fill_diagonal(matrix, -matrix.sum(axis=1))
    return matrix


@lru_cache(maxsize=8)
def _integration(count: int) -> np.ndarray:
    """Matrix (count + 1, count + 1): values at Chebyshev points to the integral from 0 to each point."""
    inverse = np.linalg.inv(chebyshev_derivative(count)[1:, 1:])
    matrix = np.zeros((count + 1, count + 1))
    matrix[1:, 1:] = inverse
    # A constant's integral is the place itself: the column of the first value is what the others lack.
    matrix[:, 0] = chebyshev_points(count) - matrix.sum(axis=1)
    return matrix
