"""Which charges a detonator lights, the charge it lies in or those it names, and from where."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from warp_mpm.charges import Body
from warp_mpm.checks import mistake
from warp_mpm.detonators import (
    CordDetonator,
    Detonator,
    LineDetonator,
    PlaneDetonator,
    PointDetonator,
    SphereDetonator,
    Vector,
    segments,
)
from warp_mpm.geometry import Solid
from warp_mpm.scene import Charge

# Surfaces nearer to each other than this share of the reach are one: a detonator between two charges lights both.
SAME_SURFACE = 1e-6

SAMPLES_PER_REACH = 8  # places where a line or a cord is tested for being in a charge
MOST_SAMPLES = 20_000  # of one detonator


@dataclass(frozen=True)
class Source:
    """Where waves start: at a point, along a straight line, on a plane or a sphere's surface."""

    position: Vector | np.ndarray  # of the point, the line's start, the sphere's center [m]
    time: float  # [s]
    along: Vector | np.ndarray = (0.0, 0.0, 0.0)  # from the line's start to its end [m]
    delay: float = 0.0  # of the line's end after its start [s]
    normal: Vector | np.ndarray = (0.0, 0.0, 0.0)  # unit normal of a plane
    radius: float = 0.0  # of a sphere [m]
    booster: bool = False


def sources_of(
    detonators: Sequence[Detonator], charge: Charge, spacing: float
) -> tuple[tuple[Source, ...], tuple[Source, ...]]:
    """The sources that light a charge of a grid with cells of `spacing` [m].

    Returns:
        Those in the charge or within half a cell of it, of lines and cords only the parts that are; and those of
        detonators elsewhere that name it.
    """
    near: list[Source] = []
    remote: list[Source] = []
    reach = spacing / 2
    for detonator in detonators:
        if charge.name in detonator.charges:
            if _distance(detonator, charge.solid, reach) > reach:
                remote.extend(_whole(detonator))
            elif isinstance(detonator, LineDetonator | CordDetonator):
                near.extend(_parts_near(detonator, charge.solid, reach))
            else:
                near.extend(_whole(detonator))
    return tuple(near), tuple(remote)


def resolve_detonators(
    where: str, detonators: Sequence[Detonator], bodies: Sequence[Body], reach: float
) -> tuple[Detonator, ...]:
    """The detonators, each with the names of all the charges it lights.

    Args:
        where: start of the error messages, for example "scene two_point".
        detonators: as the user gave them; those that name no charge light what they lie in.
        bodies: the charges.
        reach: a detonator this close to a charge's surface [m] counts as inside.

    Raises:
        InputError: a detonator is outside every charge, or names an unknown or an inert one; or no detonator lights
            one of the explosive charges or another one close by, and it may not stay unlit.
    """
    resolved = tuple(
        replace(detonator, charges=_lit_charges(f"{where}: detonator {number}", detonator, bodies, reach))
        for number, detonator in enumerate(detonators, start=1)
    )
    lit = _with_neighbors({name for detonator in resolved for name in detonator.charges}, bodies, 2.0 * reach)
    for body in bodies:
        if body.explosive and body.name not in lit and not body.may_stay_unlit:
            raise mistake(
                f"{where}: charge {body.name!r}",
                "a detonator that lights this explosive",
                "none",
                "put one in it, name the charge in a detonator's charges, or set may_stay_unlit",
            )
    return resolved


def _lit_charges(where: str, detonator: Detonator, bodies: Sequence[Body], reach: float) -> tuple[str, ...]:
    """Names of the charges that one detonator lights, at least one."""
    if detonator.charges:
        return _named_charges(where, detonator.charges, bodies)
    distances = {body.name: _distance(detonator, body.solid, reach) for body in bodies if body.explosive}
    if not distances:
        raise mistake(where, "an explosive charge to light", "inert charges only", "remove the detonator")
    nearest = min(distances.values())
    if nearest > reach:
        raise mistake(
            where,
            f"a position in an explosive charge or within half a cell, {reach:g} m, of its surface",
            f"{detonator.position}, {nearest:g} m outside every charge",
            "move it, or name the charges it lights",
        )
    limit = nearest + SAME_SURFACE * reach if isinstance(detonator, PointDetonator) else reach
    return tuple(name for name, distance in distances.items() if distance <= limit)


def _named_charges(where: str, names: Sequence[str], bodies: Sequence[Body]) -> tuple[str, ...]:
    """The names, checked."""
    known = {body.name: body for body in bodies}
    for name in names:
        if name not in known:
            raise mistake(f"{where}: charges", f"names from {', '.join(known)}", repr(name))
        if not known[name].explosive:
            raise mistake(f"{where}: charges", "explosive charges", f"{name!r}, which is inert")
    return tuple(names)


def _with_neighbors(lit: set[str], bodies: Sequence[Body], gap: float) -> set[str]:
    """The names of lit charges, and of explosives whose bounds are within a gap [m] of theirs, and so on."""
    explosives = {body.name: body.solid.bounds() for body in bodies if body.explosive}
    reached, waiting = set(lit), [name for name in lit if name in explosives]
    while waiting:
        lower, upper = explosives[waiting.pop()]
        for name, (low, high) in explosives.items():
            if name not in reached and np.all(low <= upper + gap) and np.all(high >= lower - gap):
                reached.add(name)
                waiting.append(name)
    return reached


def _distance(detonator: Detonator, solid: Solid, reach: float) -> float:
    """Distance of a detonator to the surface of a solid, of a plane to its bounds [m]; negative inside."""
    if isinstance(detonator, PlaneDetonator):
        lower, upper = solid.bounds()
        unit = np.array(detonator.normal) / np.linalg.norm(detonator.normal)
        to_center = float(((lower + upper) / 2 - np.array(detonator.position)) @ unit)
        return abs(to_center) - float((upper - lower) / 2 @ np.abs(unit))
    return float(solid.signed_distance(_samples(detonator, reach)).min())


def _samples(detonator: Detonator, reach: float) -> np.ndarray:
    """Places on a detonator, closer together than `reach` [m] unless it is very long, (n, 3) [m]."""
    if isinstance(detonator, SphereDetonator):
        count = int(np.clip(16.0 * np.pi * (detonator.radius / reach) ** 2, 100, MOST_SAMPLES))
        height = 1.0 - (2.0 * np.arange(count) + 1.0) / count  # a spiral with the golden angle between neighbors
        angle = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(count)
        across = np.sqrt(1.0 - height**2)
        spiral = np.stack([across * np.cos(angle), across * np.sin(angle), height], axis=1)
        return np.array(detonator.center) + detonator.radius * spiral
    if isinstance(detonator, LineDetonator | CordDetonator):
        return np.concatenate(
            [start + _shares(start, end, reach)[:, None] * (end - start) for start, end, _, _ in segments(detonator)]
        )
    return np.array([detonator.position])


def _shares(start: np.ndarray, end: np.ndarray, reach: float) -> np.ndarray:
    """Shares of a straight line at which it is looked at, (n,) from 0 to 1."""
    count = SAMPLES_PER_REACH * float(np.linalg.norm(end - start)) / reach
    return np.linspace(0.0, 1.0, int(np.clip(np.ceil(count), 2, MOST_SAMPLES)) + 1)


def _whole(detonator: Detonator) -> list[Source]:
    """All of a detonator."""
    if isinstance(detonator, LineDetonator | CordDetonator):
        return [Source(start, lit, end - start, burnt - lit) for start, end, lit, burnt in segments(detonator)]
    if isinstance(detonator, PlaneDetonator):
        normal = np.array(detonator.normal) / np.linalg.norm(detonator.normal)
        return [Source(detonator.position, detonator.time, normal=normal)]
    if isinstance(detonator, SphereDetonator):
        return [Source(detonator.center, detonator.time, radius=detonator.radius)]
    return [Source(detonator.position, detonator.time, booster=detonator.booster)]


def _parts_near(detonator: LineDetonator | CordDetonator, solid: Solid, reach: float) -> list[Source]:
    """The parts of a line or a cord that lie in a solid or within `reach` [m] of it."""
    parts = []
    for start, end, lit, burnt in segments(detonator):
        shares = _shares(start, end, reach)
        inside = solid.signed_distance(start + shares[:, None] * (end - start)) <= reach
        edges = np.flatnonzero(np.diff(np.concatenate([[False], inside, [False]]).astype(int)))
        for first, last in zip(shares[edges[::2]], shares[edges[1::2] - 1], strict=True):
            part, delay = (last - first) * (end - start), (last - first) * (burnt - lit)
            parts.append(Source(start + first * (end - start), lit + first * (burnt - lit), part, delay))
    return parts
