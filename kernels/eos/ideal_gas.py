"""Ideal gas, the gamma law: p = (gamma - 1) rho e (paper, eq. 17)."""

from dataclasses import dataclass

import warp as wp

from warp_mpm.kernels.numbers import is_number
from warp_mpm.kernels.precision import ONE, ZERO, scalar


@wp.struct
class IdealGasRecord:
    """Device record of the gamma law."""

    gamma: scalar


@wp.func
def pressure_offset(gas: IdealGasRecord, density: scalar) -> scalar:
    """Pressure [Pa] at zero energy: none."""
    return ZERO


@wp.func
def pressure_slope(gas: IdealGasRecord, density: scalar) -> scalar:
    """dp/de [kg/m3] = (gamma - 1) rho."""
    return (gas.gamma - ONE) * density


@wp.func
def sound_speed_squared(gas: IdealGasRecord, density: scalar, energy: scalar) -> scalar:
    """c^2 [m2/s2] = gamma p / rho = gamma (gamma - 1) e."""
    return gas.gamma * (gas.gamma - ONE) * energy


@dataclass(frozen=True)
class IdealGas:
    """The gamma law, p = (gamma - 1) rho e.

    Attributes:
        gamma: above 1.

    Raises:
        ValueError: gamma is not a finite number above 1.
    """

    gamma: float

    Record = IdealGasRecord
    pressure_offset = pressure_offset
    pressure_slope = pressure_slope
    sound_speed_squared = sound_speed_squared
    passive_volume = True
    negative_energy = False

    def __post_init__(self) -> None:
        """Check gamma: at 1 or below, compression would not raise the pressure of a gas with energy."""
        if not (is_number(self.gamma) and self.gamma > 1.0):
            raise ValueError(f"ideal gas: gamma: expected a finite number above 1, got {self.gamma}")

    def record(self) -> IdealGasRecord:
        """The device record."""
        record = IdealGasRecord()
        record.gamma = self.gamma
        return record
