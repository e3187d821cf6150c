"""Stiffened gas: a liquid as a gas under a large constant pressure, p = (gamma - 1) rho e - gamma p_inf.

Reference: F. H. Harlow, A. A. Amsden, Fluid Dynamics, LA-4700, Los Alamos 1971, section 2 (as a stiffened gas; for an
ideal gas p_inf = 0).
"""

from dataclasses import dataclass

import warp as wp

from warp_mpm.kernels.numbers import is_number
from warp_mpm.kernels.precision import ONE, ZERO, scalar


@wp.struct
class StiffenedGasRecord:
    """Device record of a stiffened gas."""

    gamma: scalar
    stiffness: scalar  # p_inf [Pa]


@wp.func
def pressure_offset(gas: StiffenedGasRecord, density: scalar) -> scalar:
    """Pressure at zero energy [Pa] = -gamma p_inf."""
    return -gas.gamma * gas.stiffness


@wp.func
def pressure_slope(gas: StiffenedGasRecord, density: scalar) -> scalar:
    """dp/de [kg/m3] = (gamma - 1) rho."""
    return (gas.gamma - ONE) * density


@wp.func
def sound_speed_squared(gas: StiffenedGasRecord, density: scalar, energy: scalar) -> scalar:
    """c^2 [m2/s2] = gamma (p + p_inf) / rho = gamma (gamma - 1) (e - p_inf / rho); 0 in tension beyond -p_inf."""
    return gas.gamma * (gas.gamma - ONE) * wp.max(energy - gas.stiffness / density, ZERO)


@dataclass(frozen=True)
class StiffenedGas:
    """A stiffened gas. By itself it carries tension down to -p_inf; the solver lets matter in tension cavitate.

    Attributes:
        gamma: above 1.
        stiffness: p_inf [Pa].

    Raises:
        ValueError: gamma is not a finite number above 1, or p_inf not a finite one of at least 0.
    """

    gamma: float
    stiffness: float

    Record = StiffenedGasRecord
    pressure_offset = pressure_offset
    pressure_slope = pressure_slope
    sound_speed_squared = sound_speed_squared
    passive_volume = False
    negative_energy = False

    def __post_init__(self) -> None:
        """Check the parameters."""
        if not (is_number(self.gamma) and self.gamma > 1.0):
            raise ValueError(f"stiffened gas: gamma: expected a finite number above 1, got {self.gamma}")
        if not (is_number(self.stiffness) and self.stiffness >= 0.0):
            raise ValueError(
                f"stiffened gas: stiffness: expected a finite number of at least 0 Pa, got {self.stiffness}"
            )

    def record(self) -> StiffenedGasRecord:
        """The device record."""
        record = StiffenedGasRecord()
        record.gamma = self.gamma
        record.stiffness = self.stiffness
        return record
