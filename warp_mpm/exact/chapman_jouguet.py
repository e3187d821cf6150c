"""The Chapman-Jouguet state of an explosive, from its equation of state alone.

Problem: a plane detonation wave runs at the speed D into matter at rest of density rho0 and zero pressure, whose
specific internal energy E0 contains the chemical energy. Which is the slowest steady wave?

Equations (v = 1 / rho): the Hugoniot e - E0 = p (v0 - v) / 2 with p = a(rho) + b(rho) e gives
p_H(v) = (a + b E0) / (1 - b (v0 - v) / 2); the Rayleigh line D^2 = v0^2 p / (v0 - v). The slowest wave touches the
Hugoniot, where it is sonic: rho^2 c^2 (v0 - v) = p_H. Particle velocity u = D (v0 - v) / v0.

For an ideal gas: rho = rho0 (gamma + 1) / gamma, p = rho0 D^2 / (gamma + 1), D^2 = 2 (gamma^2 - 1) E0.

Reference: W. Fickett, W. C. Davis, Detonation: Theory and Experiment, Dover 2000, section 2A.
"""

import math
from dataclasses import dataclass

from warp_mpm.kernels.eos import EquationOfState, evaluate

HIGHEST_COMPRESSION = 20.0  # rho / rho0 up to which the state is searched
SEARCH_STEP = 1.01  # growth of rho in the search
BISECTIONS = 40
ITERATIONS = 20  # at most, for the energy; 3 to 8 are taken
LARGEST_POWER = 8.0  # of D^2 that the energy may follow, where pressure at zero energy matters much


@dataclass(frozen=True)
class ChapmanJouguetState:
    """State at the end of the reaction of a self-sustained detonation."""

    detonation_speed: float  # D [m/s]
    pressure: float  # p_CJ [Pa]
    density: float  # [kg/m3]
    particle_velocity: float  # u [m/s]
    sound_speed: float  # c [m/s] = D - u


def _linear(eos: EquationOfState, density: float) -> tuple[float, float]:
    """The a [Pa] and b [kg/m3] of p = a + b e at a density [kg/m3]."""
    return evaluate(eos, eos.pressure_offset, density), evaluate(eos, eos.pressure_slope, density)


def pressure_of(eos: EquationOfState, density: float, energy: float) -> float:
    """Pressure p = a + b e [Pa] at a density [kg/m3] and a specific energy [J/kg]."""
    offset, slope = _linear(eos, density)
    return offset + slope * energy


def energy_at_pressure(eos: EquationOfState, density: float, pressure: float) -> float:
    """Specific energy e = (p - a) / b [J/kg] at a density [kg/m3] and a pressure [Pa]."""
    offset, slope = _linear(eos, density)
    return (pressure - offset) / slope


def hugoniot_pressure(
    eos: EquationOfState, initial_density: float, energy: float, density: float, initial_pressure: float = 0.0
) -> float:
    """Pressure p_H [Pa] of matter at `density` behind a wave into matter of specific energy `energy` [J/kg].

    Infinite beyond the strongest compression that the Hugoniot e - E0 = (p + p0) (v0 - v) / 2 allows.
    """
    offset, slope = _linear(eos, density)
    half = 0.5 * (1.0 / initial_density - 1.0 / density)
    room = 1.0 - slope * half
    return (offset + slope * (energy + initial_pressure * half)) / room if room > 0.0 else math.inf


def chapman_jouguet_state(eos: EquationOfState, initial_density: float, energy: float) -> ChapmanJouguetState:
    """The Chapman-Jouguet state for an initial density [kg/m3] and specific energy E0 [J/kg].

    Raises:
        ValueError: the equation of state has no such state, with a pressure above zero, up to a compression of 20.
    """
    initial_volume = 1.0 / initial_density

    def excess(density: float) -> float:
        """Sonic condition rho^2 c^2 (v0 - v) - p_H: negative on weak waves, positive on overcompressed ones."""
        pressure = hugoniot_pressure(eos, initial_density, energy, density)
        if math.isinf(pressure):
            return math.inf
        compression = initial_volume - 1.0 / density
        internal = energy + 0.5 * pressure * compression
        return density**2 * evaluate(eos, eos.sound_speed_squared, density, internal) * compression - pressure

    low = initial_density * SEARCH_STEP
    high = low
    while excess(high) < 0.0:
        low, high = high, high * SEARCH_STEP
        if high > HIGHEST_COMPRESSION * initial_density:
            raise _no_state(eos, initial_density, energy)
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if excess(middle) < 0.0 else (low, middle)
    density = 0.5 * (low + high)
    pressure = hugoniot_pressure(eos, initial_density, energy, density)
    if not pressure > 0.0:
        raise _no_state(eos, initial_density, energy)
    compression = initial_volume - 1.0 / density
    speed = initial_volume * math.sqrt(pressure / compression)
    particle_velocity = speed * compression / initial_volume
    return ChapmanJouguetState(speed, pressure, density, particle_velocity, speed - particle_velocity)


def _no_state(eos: EquationOfState, initial_density: float, energy: float) -> ValueError:
    return ValueError(
        f"{eos}: expected a Chapman-Jouguet state below {HIGHEST_COMPRESSION:g} times the initial density "
        f"{initial_density:g} kg/m3 with the energy {energy:g} J/kg, found none; check the parameters' units"
    )


def energy_for_speed(eos: EquationOfState, initial_density: float, detonation_speed: float) -> float:
    """Specific energy E0 [J/kg] with which the equation of state detonates at a given speed [m/s].

    D^2 is proportional to E0 for an ideal gas. For others it follows some power of E0, which the iteration finds:
    secants of the logarithms.

    Raises:
        ValueError: there is no such energy.
    """
    energy, power = 0.25 * detonation_speed**2, 1.0
    before: tuple[float, float] | None = None  # logarithms of the factor in energy and of what it did to D^2 / D'^2
    for _ in range(ITERATIONS):
        implied = chapman_jouguet_state(eos, initial_density, energy).detonation_speed
        ratio = (detonation_speed / implied) ** 2
        if abs(ratio - 1.0) < 5e-7:
            return energy * ratio
        lacking = math.log(ratio)
        if before is not None and before[1] != lacking:
            power = min(max(before[0] / (before[1] - lacking), 1.0), LARGEST_POWER)
        factor = ratio**power
        before = math.log(factor), lacking
        energy *= factor
    raise ValueError(f"{eos}: expected an energy that gives {detonation_speed:g} m/s, found none")


def ideal_gas_state(gamma: float, initial_density: float, detonation_speed: float) -> ChapmanJouguetState:
    """The Chapman-Jouguet state of gamma-law products in closed form, for a density [kg/m3] and a speed D [m/s].

    Raises:
        ValueError: gamma is not above 1, or density or speed is not positive.
    """
    if not 1.0 < gamma < math.inf:
        raise ValueError(f"gamma-law products: gamma: expected a finite number above 1, got {gamma}")
    for name, value in (("initial density", initial_density), ("detonation speed", detonation_speed)):
        if not 0.0 < value < math.inf:
            raise ValueError(f"gamma-law products: {name}: expected a positive number, got {value}")
    velocity = detonation_speed / (gamma + 1.0)
    return ChapmanJouguetState(
        detonation_speed=detonation_speed,
        pressure=initial_density * detonation_speed * velocity,
        density=initial_density * (gamma + 1.0) / gamma,
        particle_velocity=velocity,
        sound_speed=detonation_speed - velocity,
    )


def ideal_gas_energy(gamma: float, detonation_speed: float) -> float:
    """Specific energy E0 [J/kg] with which gamma-law products detonate at the speed D [m/s]."""
    return detonation_speed**2 / (2.0 * (gamma**2 - 1.0))
