"""Whether anything can reach an explosive before it burns, which must then resist.

Explosive that burns only when its wave arrives, and has no unreacted state, has no pressure until then: what strikes
it before runs through it as through nothing. That is harmless as long as its own wave is the first to come.
"""

import math
from collections.abc import Sequence

import numpy as np

from warp_mpm.checks import mistake
from warp_mpm.detonators import Detonator
from warp_mpm.exact.arrival import straight_arrival
from warp_mpm.exact.general_riemann import MatterState
from warp_mpm.kernels.burn.programmed import ProgrammedBurn
from warp_mpm.materials import Material
from warp_mpm.scene import Charge
from warp_mpm.warp_startup import start_quietly

REMEDY = "give it an unreacted equation of state, such as MieGruneisen, or burn=Burn.BOTH"


def check_resistance(
    where: str, charges: Sequence[Charge], detonators: Sequence[Detonator], spacing: float, end_time: float
) -> None:
    """Refuse explosive without resistance that something else reaches before its own wave, and before the end.

    Explosives that touch are a group, lit by what lights any of them. Its own wave comes straight from one of the
    group's detonators, at the slowest of the group's speeds. What else may come: the wave of another group's detonator,
    straight through whatever lies between, at the highest speed of any detonation, or of sound in anything inert; and
    a charge that moves at the start, after the gap between their bounds.

    Args:
        where: start of the error messages.
        charges: all of them.
        detonators: with the names of the charges that they light.
        spacing: of the cells, the largest [m]: explosives no farther apart than this touch.
        end_time: of the run [s].

    Raises:
        InputError: with the charge, and where and when it is reached.
    """
    explosives = [charge for charge in charges if charge.material.burn is not None]
    for charge in explosives:
        if resists(charge.material):
            continue
        group = _group_of(charge, explosives, spacing)
        own = [detonator for detonator in detonators if not group.isdisjoint(detonator.charges)]
        others = [detonator for detonator in detonators if group.isdisjoint(detonator.charges)]
        slowest = min(_speed_of(one.material) for one in explosives if one.name in group)
        burning = np.minimum(straight_arrival(own, charge.positions, slowest), end_time)
        if others:
            fastest = max(_speed_of(one.material) for one in charges)
            reached = straight_arrival(others, charge.positions, fastest)
            _refuse_if_late(where, charge, burning, reached, "another detonator's wave")
        for other in charges:
            if other is not charge:
                reached = np.full(len(burning), _strike_time(charge, other))
                _refuse_if_late(where, charge, burning, reached, f"charge {other.name!r}, which moves,")


def resists(material: Material) -> bool:
    """Whether an explosive has a pressure before its wave comes, or burns where it is compressed."""
    return material.unreacted is not None or not isinstance(material.burn, ProgrammedBurn)


def _refuse_if_late(where: str, charge: Charge, burning: np.ndarray, reached: np.ndarray, source: str) -> None:
    """Refuse a charge whose particles burn at times (n,) [s], if one of them is reached before, at times (n,) [s]."""
    late = burning - reached
    first = int(np.argmax(late))
    if late[first] > 0.0:
        place = ", ".join(f"{x:g}" for x in charge.positions[first])
        raise mistake(
            f"{where}: charge {charge.name!r}",
            f"explosive that resists, since {source} may be at ({place}) m {1e6 * late[first]:.3g} us before it burns",
            f"{charge.material.name!r}, which has no pressure until then",
            REMEDY,
        )


def _group_of(charge: Charge, explosives: Sequence[Charge], spacing: float) -> set[str]:
    """Names of the explosives that a wave in a charge comes to: those that touch it, those that touch them, ..."""
    group, waiting = {charge.name}, [charge]
    while waiting:
        last = waiting.pop()
        for other in explosives:
            if other.name not in group and _touch(last, other, spacing):
                group.add(other.name)
                waiting.append(other)
    return group


def _touch(first: Charge, second: Charge, spacing: float) -> bool:
    """Whether a particle of one lies within a cell's spacing [m] of the other, or of its surface."""
    lower, upper = first.solid.bounds()
    near = np.all((second.positions >= lower - spacing) & (second.positions <= upper + spacing), axis=1)
    return bool(near.any() and first.solid.signed_distance(second.positions[near]).min() <= spacing)


def _strike_time(charge: Charge, other: Charge) -> float:
    """When another charge may strike one, by their initial velocities [s]; infinite where both move as one."""
    if charge.velocities is None and other.velocities is None:
        return math.inf
    (low, high), (other_low, other_high) = (_range(one.velocities) for one in (charge, other))
    closing = float(np.linalg.norm(np.maximum(high - other_low, other_high - low)))
    (low, high), (other_low, other_high) = charge.solid.bounds(), other.solid.bounds()
    gap = float(np.linalg.norm(np.maximum(np.maximum(low - other_high, other_low - high), 0.0)))
    return gap / closing if closing > 0.0 else math.inf


def _range(velocities: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest velocity along each axis (3,) [m/s] of particles (n, 3); at rest without any."""
    if velocities is None:
        return np.zeros(3), np.zeros(3)
    return velocities.min(axis=0), velocities.max(axis=0)


def _speed_of(material: Material) -> float:
    """How fast news travels in a material at first: detonation, or sound where it is inert [m/s]."""
    if material.burn is not None:
        return material.burn.detonation_speed
    start_quietly()
    return MatterState(material.equation_of_state, material.density, 0.0, material.specific_energy).sound_speed
