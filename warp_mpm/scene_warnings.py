"""What the user should know about a scene that can be run: each warning says what is odd, and what it leads to."""

from collections.abc import Iterable, Sequence

import numpy as np

from warp_mpm.charges import charge_warnings
from warp_mpm.detonators import Detonator, PointDetonator
from warp_mpm.exact.arrival import straight_arrival
from warp_mpm.geometry import Solid
from warp_mpm.lattice import Lattice
from warp_mpm.scene import Charge, Domain

FEW_CELLS = 5.0  # across an explosive: its waves are as wide
NOTABLE_LOSS = 0.03  # of an explosive's volume, to charges added before it
SPANS = 1.0 - 1e-9  # of the domain's length: such a charge goes from wall to wall, and may be one cell thick
MICROSECOND = 1e-6  # [s]
LEAST_PASCALS = 1e3  # of an ambient pressure: what is less, and not vacuum, may be in bar


def scene_warnings(
    charges: Sequence[Charge],
    wanted: Sequence[Solid],
    detonators: Sequence[Detonator],
    domain: Domain,
    end_time: float,
    ambient_pressure: float,
) -> tuple[str, ...]:
    """Warnings of materials, odd units, charges that lose room or that cells resolve poorly, idle detonators.

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
