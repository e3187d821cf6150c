"""Equations of state, one file each. `ideal_gas.py` is the pattern to follow.

All are linear in the specific internal energy, p = a(rho) + b(rho) e, so that nothing iterates. A member is a frozen
dataclass (the host's side) whose class attributes name its device functions, each taking the device record first:

* `pressure_offset(record, density)` -> a [Pa]
* `pressure_slope(record, density)` -> b [kg/m3]
* `sound_speed_squared(record, density, energy)` -> c^2 = (dp/drho)_s [m2/s2]
* `passive_volume`: whether p V depends on the energy alone, a = 0 and b ~ rho, so that a volume which is a little wrong
  moves nothing (see `relaxation.py`)
* `negative_energy`: whether energies may be negative, as they count from the initial state; else none is less than 0
* `Record`: the `wp.struct` they read; `record()` fills one.

Energies are specific internal energies [J/kg] that contain the chemical energy.
"""

from typing import Any, Protocol, runtime_checkable

import warp as wp

from warp_mpm.kernels.precision import scalar


@runtime_checkable
class EquationOfState(Protocol):
    """What a material asks of its equation of state."""

    Record: type
    pressure_offset: wp.Function
    pressure_slope: wp.Function
    sound_speed_squared: wp.Function
    passive_volume: bool
    negative_energy: bool

    def record(self) -> Any:
        """The device record of this equation of state."""


def evaluate(eos: EquationOfState, function: wp.Function, *numbers: float) -> float:
    """A device function of an equation of state on the host, of density [kg/m3] and perhaps energy [J/kg].

    Called from Python, Warp takes a `float` for a single-precision number, and mixes it with no double, no `int` and no
    number of NumPy: every number needs its type, those in the record too.
    """
    number = scalar if scalar is wp.float64 else float
    record = eos.record()
    for name, variable in eos.Record.vars.items():
        if variable.type is scalar:
            setattr(record, name, number(getattr(record, name)))
    return float(function(record, *map(number, numbers)))
