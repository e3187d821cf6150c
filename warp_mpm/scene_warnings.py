"""What the user should know about a scene that can be run: each warning says what is odd, and what it leads to."""

import math
from collections.abc import Iterable, Sequence

import numpy as np

from warp_mpm.charges import charge_warnings
from warp_mpm.config import SolverConfig
from warp_mpm.detonators import Detonator, PointDetonator
from warp_mpm.exact.arrival import straight_arrival
from warp_mpm.geometry import Solid
from warp_mpm.kernels.eos import evaluate
from warp_mpm.lattice import Lattice
from warp_mpm.materials import Material
from warp_mpm.scene import Charge, Domain

FEW_CELLS = 5.0  # across an explosive: its waves are as wide
NOTABLE_LOSS = 0.03  # of an explosive's volume, to charges added before it
SPANS = 1.0 - 1e-9  # of the domain's length: such a charge goes from wall to wall, and may be one cell thick
MICROSECOND = 1e-6  # [s]
LEAST_PASCALS = 1e3  # of an ambient pressure: what is less, and not vacuum, may be in bar

# Of a run; more are a mistake. Who gives microseconds as seconds asks for a million times the steps that were meant,
# which were more than ten. Nobody means so many: steps are as long as cells and speeds allow, so that a slow fuse, or a
# row of charges with delays of milliseconds, has fewer than a million, and a vessel of a hundred cells that blows out
# through a hole of three, some 5000 times as slowly as sound crosses it, two million. Gas that expands needs fewer.
MOST_STEPS = 1e7


def scene_warnings(
    charges: Sequence[Charge],
    wanted: Sequence[Solid],
    detonators: Sequence[Detonator],
    domain: Domain,
    end_time: float,
    ambient_pressure: float,
) -> tuple[str, ...]:
    """Warnings of materials, odd units, endless runs, charges that lose room or have few cells, idle detonators.

    Args:
        charges: as they fill what earlier ones leave free.
        wanted: the solids that they were given, in the same order.
        detonators: what lights them.
        domain: the cells.
        end_time: [s].
        ambient_pressure: outside open faces [Pa].
    """
    said = [warning for charge in charges for warning in charge_warnings(charge, _site_volume(charge, domain))]
    said = list(dict.fromkeys(said))  # what charges of one material have in common is said once
    if 0.0 < ambient_pressure < LEAST_PASCALS:
        said.append(f"ambient pressure {ambient_pressure:g} Pa: is it in pascals? 1 bar is 1e5 Pa")
    steps = _steps_at_first(charges, domain) * end_time
    if steps > MOST_STEPS:
        meant = f"{end_time:g} us are {end_time * MICROSECOND:g} s"
        said.append(f"end time {end_time:g} s: is it in seconds? {meant}; it is {steps:.0e} times the first time step")
    said += _lost_room(charges, wanted, domain)
    late = [number for number, one in enumerate(detonators, start=1) if one.time >= end_time]
    spent = [
        n for n, one in enumerate(detonators, start=1) if one.time < end_time and _is_spent(one, detonators, charges)
    ]
    end = f"the end at {end_time / MICROSECOND:g} us"
    if late:
        said.append(f"{_named('detonator', late)}: nothing is lit before {end}; light earlier, or end later")
    if spent:
        text = "others' waves may have passed before it is lit: it then does nothing; shorten the delays"
        said.append(f"{_named('detonator', spent)}: {text}")
    for charge in charges:
        across = _cells_across(charge, domain) if charge.material.burn is not None else np.inf
        if across < FEW_CELLS:
            said.append(
                f"charge {charge.name!r}: {across:.1f} cells across, where a front is some {FEW_CELLS:g} wide: its "
                "pressures mean little; choose a smaller cell size"
            )
    return tuple(said)


def _lost_room(charges: Sequence[Charge], wanted: Sequence[Solid], domain: Domain) -> list[str]:
    """What to say of explosives that lose a notable part to charges before them, told from their lattices' sites."""
    said = []
    for number, (charge, solid) in enumerate(zip(charges, wanted, strict=True)):
        if charge.material.burn is None or charge.solid is solid:
            continue
        sites = Lattice(domain, charge.particles_per_axis).sites_in(solid)
        lost = sites[~charge.solid.contains(sites)]
        if len(lost) > NOTABLE_LOSS * len(sites):
            takers = [repr(other.name) for other in charges[:number] if other.solid.contains(lost).any()]
            said.append(
                f"charge {charge.name!r}: {len(lost) / len(sites):.0%} of it is left out, because it lies in "
                f"{', '.join(takers)}, added before it; if that is not meant, move it, or add it before them"
            )
    return said


def _steps_at_first(charges: Sequence[Charge], domain: Domain) -> float:
    """Steps per time [1/s] of the solver's defaults, with the speeds that the scene begins with."""
    fastest = max(_wave_speed(charge.material) + charge.greatest_speed for charge in charges)
    return fastest / (SolverConfig().cfl * min(domain.spacing))


def _wave_speed(material: Material) -> float:
    """Detonation speed, or sound speed at the start of what does not burn [m/s]."""
    if material.burn is not None:
        return material.burn.detonation_speed
    eos = material.equation_of_state
    return math.sqrt(max(evaluate(eos, eos.sound_speed_squared, material.density, material.specific_energy), 0.0))


def _site_volume(charge: Charge, domain: Domain) -> float:
    return Lattice(domain, charge.particles_per_axis).site_volume


def _is_spent(detonator: Detonator, detonators: Sequence[Detonator], charges: Sequence[Charge]) -> bool:
    """Whether the wave of another one may have come to a point before it is lit, by the straight way."""
    if not isinstance(detonator, PointDetonator):
        return False
    mine = set(detonator.charges)
    others = [other for other in detonators if other is not detonator and not mine.isdisjoint(other.charges)]
    speeds = [
        charge.material.burn.detonation_speed for charge in charges if charge.name in mine and charge.material.burn
    ]
    if not others or not speeds:
        return False
    place = np.array([detonator.position])
    return bool(straight_arrival(others, place, max(speeds))[0] < detonator.time)


def _cells_across(charge: Charge, domain: Domain) -> float:
    """The fewest cells across a charge, along the axes on which it does not go from face to face."""
    lower, upper = (np.clip(corner, domain.lower, domain.upper) for corner in charge.solid.bounds())
    extent, length = upper - lower, np.subtract(domain.upper, domain.lower)
    return float(np.min((extent / domain.spacing)[extent < SPANS * length], initial=np.inf))


def _named(noun: str, numbers: Iterable[int]) -> str:
    """Such as "detonators 2, 3"."""
    listed = [str(number) for number in numbers]
    return f"{noun}{'s' if len(listed) > 1 else ''} {', '.join(listed)}"
