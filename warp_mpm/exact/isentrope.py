"""The isentrope of any equation of state p = a(rho) + b(rho) e, by numerical integration.

    de / d ln rho = p / rho,    dJ / d ln rho = c,

the first law without heat, and the Riemann function J = integral of c / rho from the start of the isentrope on: along a
simple wave u -+ J stays what it is. The device functions of the equation of state are in single precision, so that
everything here is good to about 1e-6.

Reference: R. Courant, K. O. Friedrichs, Supersonic Flow and Shock Waves, Springer 1976, sections 38 and 40.
"""

import math
from dataclasses import dataclass

import numpy as np

from warp_mpm.exact.chapman_jouguet import pressure_of
from warp_mpm.exact.integration import hermite, runge_kutta
from warp_mpm.kernels.eos import EquationOfState, evaluate

STEPS = 160
REFINEMENT = 12  # of the table, by cubics: between its points straight lines are good to 1e-6
EXPANSION = 1e-2  # of the density, at the end of an isentrope that is not told where to end


@dataclass(frozen=True)
class Isentrope:
    """States on an isentrope, arrays (n,) from its start to ever thinner matter."""

    density: np.ndarray  # [kg/m3], falling
    pressure: np.ndarray  # [Pa]
    sound_speed: np.ndarray  # [m/s]
    riemann: np.ndarray  # J [m/s]: 0 at the start, negative beyond

    def at_pressure(self, pressure: float) -> tuple[float, float, float]:
        """Density [kg/m3], sound speed and J [m/s] where the pressure is as given, at most that of the start."""
        rising = slice(None, None, -1)
        given = self.pressure[rising]
        density, sound, riemann = (
            float(np.interp(pressure, given, values[rising]))
            for values in (self.density, self.sound_speed, self.riemann)
        )
        return density, sound, riemann


def isentrope(eos: EquationOfState, density: float, energy: float, last_density: float | None = None) -> Isentrope:
    """The isentrope from a density [kg/m3] and specific energy [J/kg] down to a last density, by default a hundredth.

    It ends earlier where matter has no pressure or no sound speed left.
    """

    def state(log_density: float, internal: float) -> tuple[float, float]:
        """Pressure [Pa] and sound speed [m/s]."""
        at = math.exp(log_density)
        return pressure_of(eos, at, internal), math.sqrt(max(evaluate(eos, eos.sound_speed_squared, at, internal), 0.0))

    def slope(log_density: float, unknowns: np.ndarray) -> np.ndarray:
        pressure, sound = state(log_density, float(unknowns[0]))
        return np.array([pressure / math.exp(log_density), sound])

    end = math.log(last_density if last_density is not None else EXPANSION * density)
    path = runge_kutta(slope, math.log(density), np.array([energy, 0.0]), end, STEPS)
    rho, sound = np.exp(path.place), path.slope[:, 1]
    pressure = path.slope[:, 0] * rho
    dead = np.flatnonzero((np.diff(pressure) >= 0.0) | (sound[1:] <= 0.0))
    count = int(dead[0]) + 1 if len(dead) else len(rho)
    fine = np.linspace(path.place[0], path.place[count - 1], REFINEMENT * (count - 1) + 1)
    rows = np.stack([pressure, sound, path.state[:, 1]], axis=1)[:count]
    slopes = np.stack([rho * sound**2, np.gradient(sound, path.place), sound], axis=1)[:count]
    values = hermite(-path.place[:count], rows, -slopes, -fine)
    return Isentrope(np.exp(fine), values[:, 0], values[:, 1], values[:, 2])
