"""Finds the particles that moving gauges are carried by."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from warp_mpm.checks import mistake
from warp_mpm.scene import Charge, Domain, Gauge

REACH = 1.0  # cells from a moving gauge to its particle, at most


def carried_gauges(here: str, gauges: Sequence[Gauge], domain: Domain, charges: Sequence[Charge]) -> tuple[Gauge, ...]:
    """The gauges; each moving one with the particle that is nearest to it at the start, distances taken in cells.

    Raises:
        InputError: there is no particle within a cell of a moving gauge.
    """
    if not any(gauge.moving for gauge in gauges):
        return tuple(gauges)
    positions = np.concatenate([charge.positions for charge in charges])
    return tuple(_carried(here, gauge, domain, positions) if gauge.moving else gauge for gauge in gauges)


def _carried(here: str, gauge: Gauge, domain: Domain, positions: np.ndarray) -> Gauge:
    distance = np.linalg.norm((positions - gauge.position) / domain.spacing, axis=1)
    nearest = int(np.argmin(distance))
    if distance[nearest] > REACH:
        expected = f"matter within a cell of {gauge.position} m to move with"
        got = f"the nearest particle {distance[nearest]:.1f} cells away"
        remedy = "place it in a charge, or leave out moving to fix it in space"
        raise mistake(f"{here}: gauge {gauge.name!r}", expected, got, remedy)
    return replace(gauge, particle=nearest)
