"""Which charges a detonator lights: the charge it lies in, or those it names."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from warp_mpm.charges import Body
from warp_mpm.checks import mistake
from warp_mpm.detonators import Detonator, PointDetonator
from warp_mpm.geometry import Solid

# Surfaces nearer to each other than this share of the reach are one: a detonator between two charges lights both.
SAME_SURFACE = 1e-6


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
        InputError: a detonator is outside every charge, or names an unknown or an inert one, or no detonator lights
            one of the explosive charges.
    """
    resolved = tuple(
        replace(detonator, charges=_lit_charges(f"{where}: detonator {number}", detonator, bodies, reach))
        for number, detonator in enumerate(detonators, start=1)
    )
    lit = {name for detonator in resolved for name in detonator.charges}
    for body in bodies:
        if body.explosive and body.name not in lit:
            raise mistake(
                f"{where}: charge {body.name!r}",
                "a detonator that lights this explosive",
                "none",
                "put one in it, or name the charge in a detonator's charges",
            )
    return resolved


def _lit_charges(where: str, detonator: Detonator, bodies: Sequence[Body], reach: float) -> tuple[str, ...]:
    """Names of the charges that one detonator lights, at least one."""
    if detonator.charges:
        return _named_charges(where, detonator.charges, bodies)
    distances = {body.name: _distance(detonator, body.solid) for body in bodies if body.explosive}
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


def _distance(detonator: Detonator, solid: Solid) -> float:
    """Distance of a point to the surface of a solid, or of a plane to its bounds [m]; negative inside."""
    if isinstance(detonator, PointDetonator):
        return float(solid.signed_distance(np.array([detonator.position]))[0])
    lower, upper = solid.bounds()
    unit = np.array(detonator.normal) / np.linalg.norm(detonator.normal)
    to_center = float(((lower + upper) / 2 - np.array(detonator.position)) @ unit)
    return abs(to_center) - float((upper - lower) / 2 @ np.abs(unit))
