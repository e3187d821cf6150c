"""Where and when the detonation starts."""

from dataclasses import dataclass

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class PointDetonator:
    """Lights the charge it lies in, or the named charges, at one point."""

    position: Vector  # [m]
    time: float = 0.0  # ignition [s]
    charges: tuple[str, ...] = ()  # names of the charges it lights; none: the charge it lies in
    booster: bool = True  # particles within one cell burn at once


@dataclass(frozen=True)
class PlaneDetonator:
    """Lights a whole plane at once: the wave runs along +normal and -normal. For one-dimensional waves."""

    position: Vector  # a point of the plane [m]
    normal: Vector  # any length
    time: float = 0.0  # ignition [s]
    charges: tuple[str, ...] = ()  # names of the charges it lights; none: every charge the plane cuts or touches


Detonator = PointDetonator | PlaneDetonator
