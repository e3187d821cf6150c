"""Burn laws, one file each: how much of a particle has turned into products. `programmed.py` is the pattern to follow.

A member is a frozen dataclass (the host's side) whose class attributes name its device function:

* `burn_fraction(record, previous, since_arrival, since_booster, density)` -> F in [0, 1], never below `previous`
* `Record`: the `wp.struct` it reads, with a field `detonation_speed` [m/s] that limits the time step while matter is
  unburnt; `record(burn_width, spacing)` fills one.
* `detonation_speed` [m/s], with which arrival times are computed.
"""

from typing import Any, Protocol

import warp as wp


class BurnLaw(Protocol):
    """What a material asks of its burn law."""

    Record: type
    burn_fraction: wp.Function

    @property
    def detonation_speed(self) -> float:
        """Speed of the wave [m/s]."""

    def record(self, burn_width: float, spacing: float) -> Any:
        """The device record for a burn zone of `burn_width` cells of size `spacing` [m]."""
