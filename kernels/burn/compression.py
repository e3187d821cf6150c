"""Compression burn: matter burns as far as it is compressed towards the Chapman-Jouguet state.

F = (1 - V) / (1 - V_CJ) in [0, 1], V = rho0 / rho, whatever the arrival time; a booster burns at once. Alone it needs
a booster or an impact to start, and runs at the speed that grid and viscosity give it.

Reference: M. L. Wilkins, Computer Simulation of Dynamic Phenomena, Springer 1999, section 3.
"""

from dataclasses import dataclass

import warp as wp

from warp_mpm.kernels.numbers import is_number
from warp_mpm.kernels.precision import ONE, ZERO, scalar


@wp.struct
class CompressionBurnRecord:
    """Device record of the compression burn."""

    density: scalar  # rho0 [kg/m3]
    per_compression: scalar  # 1 / (1 - V_CJ)
    detonation_speed: scalar  # [m/s]


@wp.func
def compression_fraction(burn: CompressionBurnRecord, density: scalar) -> scalar:
    """(1 - V) / (1 - V_CJ) in [0, 1]."""
    return wp.clamp((ONE - burn.density / density) * burn.per_compression, ZERO, ONE)


@wp.func
def burn_fraction(
    burn: CompressionBurnRecord, previous: scalar, since_arrival: scalar, since_booster: scalar, density: scalar
) -> scalar:
    """Burn fraction F in [0, 1], latched at its highest value; time [s] since the booster came."""
    boosted = wp.where(since_booster >= ZERO, ONE, ZERO)
    return wp.max(previous, wp.max(compression_fraction(burn, density), boosted))


@dataclass(frozen=True)
class CompressionBurn:
    """Compression burn of an explosive whose detonation speed [m/s] limits the time step.

    Raises:
        ValueError: the speed or rho0 is not a positive finite number, or the CJ density is not above rho0.
    """

    detonation_speed: float
    density: float  # rho0 [kg/m3]
    cj_density: float  # [kg/m3]

    Record = CompressionBurnRecord
    burn_fraction = burn_fraction

    def __post_init__(self) -> None:
        """Check the values."""
        for name in ("detonation_speed", "density"):
            if not (is_number(getattr(self, name)) and getattr(self, name) > 0.0):
                raise ValueError(f"compression burn: {name}: expected a positive number, got {getattr(self, name)}")
        if not (is_number(self.cj_density) and self.cj_density > self.density):
            raise ValueError(
                f"compression burn: cj_density: expected more than the {self.density:g} kg/m3 at rest, "
                f"got {self.cj_density}"
            )

    def record(self, burn_width: float, spacing: float) -> CompressionBurnRecord:
        """The device record; the burn is as wide as the compression, whatever `burn_width`."""
        record = CompressionBurnRecord()
        record.density = self.density
        record.per_compression = 1.0 / (1.0 - self.density / self.cj_density)
        record.detonation_speed = self.detonation_speed
        return record
