"""Mie-Gruneisen about a Hugoniot U = c0 + s u: solids, and explosives that have not burnt.

    p = p_H (1 - G eta / 2) + G rho0 e,    p_H = rho0 c0^2 eta / (1 - s eta)^2,    eta = 1 - rho0 / rho,

with e = 0 in the initial state and G rho constant. In expansion p_H = rho0 c0^2 eta. Without s and G it is linear,
p = rho0 c0^2 (1 - V). Guard: eta stays at 0.8 / s, well before the pole at 1 / s, for all that is denser; c^2 >= 0.

Reference: M. L. Wilkins, Computer Simulation of Dynamic Phenomena, Springer 1999,
section 3. Hugoniots of explosives: T. R. Gibbs, A. Popolato (eds.), LASL Explosive Property Data, University of
California Press 1980.
"""

from dataclasses import dataclass

import warp as wp

from warp_mpm.kernels.numbers import is_number
from warp_mpm.kernels.precision import HALF, ONE, ZERO, scalar

NEAR_POLE = 0.8  # largest s eta


@wp.struct
class MieGruneisenRecord:
    """Device record of a Mie-Gruneisen law."""

    density: scalar  # rho0 [kg/m3]
    modulus: scalar  # rho0 c0^2 [Pa]
    slope: scalar  # s
    gruneisen: scalar  # G
    largest: scalar  # eta: 0.8 / s


@wp.func
def compression(solid: MieGruneisenRecord, density: scalar) -> scalar:
    """eta = 1 - rho0 / rho, not above 0.8 / s."""
    return wp.min(ONE - solid.density / density, solid.largest)


@wp.func
def pressure_offset(solid: MieGruneisenRecord, density: scalar) -> scalar:
    """Pressure at zero energy [Pa] = p_H (1 - G eta / 2)."""
    eta = compression(solid, density)
    pole = ONE - solid.slope * wp.max(eta, ZERO)
    return solid.modulus * eta / (pole * pole) * (ONE - HALF * solid.gruneisen * eta)


@wp.func
def pressure_slope(solid: MieGruneisenRecord, density: scalar) -> scalar:
    """dp/de [kg/m3] = G rho0."""
    return solid.gruneisen * solid.density


@wp.func
def sound_speed_squared(solid: MieGruneisenRecord, density: scalar, energy: scalar) -> scalar:
    """c^2 [m2/s2] = (d(p_H (1 - G eta / 2)) / d eta rho0 + G rho0 p) / rho^2, not below 0."""
    eta = compression(solid, density)
    stretch = solid.slope * wp.max(eta, ZERO)
    pole = ONE - stretch
    half = HALF * solid.gruneisen
    rise = ZERO
    if eta < solid.largest:
        rise = solid.modulus / (pole * pole) * ((ONE + stretch) / pole * (ONE - half * eta) - half * eta)
    pressure = pressure_offset(solid, density) + pressure_slope(solid, density) * energy
    squared = solid.density * (rise + solid.gruneisen * pressure) / (density * density)
    return wp.max(squared, ZERO)


@dataclass(frozen=True)
class MieGruneisen:
    """A Mie-Gruneisen law about a Hugoniot U = c0 + s u, linear without s and G.

    Attributes:
        density: of the initial state, rho0 [kg/m3].
        sound_speed: there, c0 [m/s].
        slope: of the Hugoniot, s.
        gruneisen: G, with G rho constant.

    Raises:
        ValueError: density or sound speed is not a positive finite number, or s or G not a finite one of at least 0.
    """

    density: float
    sound_speed: float
    slope: float = 0.0
    gruneisen: float = 0.0

    Record = MieGruneisenRecord
    pressure_offset = pressure_offset
    pressure_slope = pressure_slope
    sound_speed_squared = sound_speed_squared
    passive_volume = False
    negative_energy = True

    def __post_init__(self) -> None:
        """Check the parameters."""
        for name in ("density", "sound_speed"):
            if not (is_number(getattr(self, name)) and getattr(self, name) > 0.0):
                raise ValueError(f"Mie-Gruneisen: {name}: expected a positive finite number, got {getattr(self, name)}")
        for name in ("slope", "gruneisen"):
            if not (is_number(getattr(self, name)) and getattr(self, name) >= 0.0):
                raise ValueError(
                    f"Mie-Gruneisen: {name}: expected a finite number of at least 0, got {getattr(self, name)}"
                )

    def record(self) -> MieGruneisenRecord:
        """The device record."""
        record = MieGruneisenRecord()
        record.density = self.density
        record.modulus = self.density * self.sound_speed**2
        record.slope = self.slope
        record.gruneisen = self.gruneisen
        record.largest = NEAR_POLE / self.slope if self.slope > 0.0 else 1.0
        return record
