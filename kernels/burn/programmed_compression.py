"""Programmed and compression burn together: F is the larger of the two (LS-DYNA's and OpenRadioss' default).

The wave arrives when it is told to, and matter that something strikes before burns by compression.
Reference: M. L. Wilkins, Computer Simulation of Dynamic Phenomena, Springer 1999, section 3.
"""

from dataclasses import dataclass

import warp as wp

from warp_mpm.kernels.burn.compression import CompressionBurn, CompressionBurnRecord, compression_fraction
from warp_mpm.kernels.burn.programmed import ProgrammedBurn, ProgrammedBurnRecord
from warp_mpm.kernels.burn.programmed import burn_fraction as programmed_fraction
from warp_mpm.kernels.precision import scalar


@wp.struct
class ProgrammedCompressionBurnRecord:
    """Device record of both burns."""

    programmed: ProgrammedBurnRecord
    compression: CompressionBurnRecord
    detonation_speed: scalar  # [m/s]


@wp.func
def burn_fraction(
    burn: ProgrammedCompressionBurnRecord,
    previous: scalar,
    since_arrival: scalar,
    since_booster: scalar,
    density: scalar,
) -> scalar:
    """Burn fraction F in [0, 1], latched at its highest value; times [s] since the wave and the booster came."""
    programmed = programmed_fraction(burn.programmed, previous, since_arrival, since_booster, density)
    return wp.max(programmed, compression_fraction(burn.compression, density))


@dataclass(frozen=True)
class ProgrammedCompressionBurn:
    """The larger of a programmed and a compression burn of the same explosive.

    Raises:
        ValueError: see `CompressionBurn`.
    """

    detonation_speed: float  # [m/s]
    density: float  # rho0 [kg/m3]
    cj_density: float  # [kg/m3]

    Record = ProgrammedCompressionBurnRecord
    burn_fraction = burn_fraction

    def __post_init__(self) -> None:
        """Check the values: by making the two."""
        self._both()

    def _both(self) -> tuple[ProgrammedBurn, CompressionBurn]:
        speed = self.detonation_speed
        return ProgrammedBurn(speed), CompressionBurn(speed, self.density, self.cj_density)

    def record(self, burn_width: float, spacing: float) -> ProgrammedCompressionBurnRecord:
        """The device record, for a programmed zone of `burn_width` cells of size `spacing` [m]."""
        programmed, compression = self._both()
        record = ProgrammedCompressionBurnRecord()
        record.programmed = programmed.record(burn_width, spacing)
        record.compression = compression.record(burn_width, spacing)
        record.detonation_speed = self.detonation_speed
        return record
