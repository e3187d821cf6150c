"""Wilkins' programmed burn (paper, eq. 18): the wave arrives at a known time, and matter burns over a fixed width.

F = 0 before the arrival time t_b, (t - t_b) D / (r_b h) until t_b + r_b h / D, then 1; a booster burns at once.
Reference: M. L. Wilkins, Computer Simulation of Dynamic Phenomena, Springer 1999, section 3.
"""

from dataclasses import dataclass

import warp as wp

from warp_mpm.kernels.numbers import is_number
from warp_mpm.kernels.precision import ONE, ZERO, scalar


@wp.struct
class ProgrammedBurnRecord:
    """Device record of the programmed burn."""

    rate: scalar  # 1 / time to burn through the zone [1/s]
    detonation_speed: scalar  # [m/s]


@wp.func
def burn_fraction(
    burn: ProgrammedBurnRecord, previous: scalar, since_arrival: scalar, since_booster: scalar, density: scalar
) -> scalar:
    """Burn fraction F in [0, 1], latched at its highest value; times [s] since the wave and the booster came."""
    ramp = wp.clamp(since_arrival * burn.rate, ZERO, ONE)
    boosted = wp.where(since_booster >= ZERO, ONE, ZERO)
    return wp.max(previous, wp.max(ramp, boosted))


@dataclass(frozen=True)
class ProgrammedBurn:
    """Programmed burn at the given detonation speed [m/s].

    Raises:
        ValueError: the speed is not a positive finite number.
    """

    detonation_speed: float

    Record = ProgrammedBurnRecord
    burn_fraction = burn_fraction

    def __post_init__(self) -> None:
        """Check the speed."""
        if not (is_number(self.detonation_speed) and self.detonation_speed > 0.0):
            raise ValueError(
                f"programmed burn: detonation_speed: expected a positive number of m/s, got {self.detonation_speed}"
            )

    def record(self, burn_width: float, spacing: float) -> ProgrammedBurnRecord:
        """The device record for a zone of `burn_width` cells of size `spacing` [m]."""
        record = ProgrammedBurnRecord()
        record.rate = self.detonation_speed / (burn_width * spacing)
        record.detonation_speed = self.detonation_speed
        return record
