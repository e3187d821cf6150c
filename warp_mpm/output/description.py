"""What of a scene goes into summary.json, so that its results can be drawn and understood without the scene's file."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any

from warp_mpm.detonators import (
    CordDetonator,
    Detonator,
    LineDetonator,
    PlaneDetonator,
    PointDetonator,
    SphereDetonator,
)
from warp_mpm.scene import Charge, Domain, Gauge, Scene, SectionPlane, Segment, Vector, Wall, Walls
from warp_mpm.summary import theory

DETONATORS: dict[str, type[Detonator]] = {
    "point": PointDetonator,
    "plane": PlaneDetonator,
    "line": LineDetonator,
    "sphere": SphereDetonator,
    "cord": CordDetonator,
}


@dataclass(frozen=True)
class SceneDescription:
    """Where things are and when they happen, as in `Scene`: SI units, no particles, no materials."""

    description: str
    domain: Domain
    walls: Walls
    section: SectionPlane
    detonators: tuple[Detonator, ...]
    front_path: Segment | None
    line: Segment | None
    collision_points: tuple[Vector, ...]
    picture_times: tuple[float, ...]
    gauges: tuple[Gauge, ...]
    end_time: float

    def as_json(self) -> dict[str, Any]:
        """Numbers, texts, lists and dicts by name; walls by face; detonators say of which kind they are."""
        kinds = {kind: name for name, kind in DETONATORS.items()}
        values = {**asdict(self), "walls": {name: wall.value for name, wall in vars(self.walls).items()}}
        values["detonators"] = [{"kind": kinds[type(item)], **asdict(item)} for item in self.detonators]
        return values


def scene_values(scene: Scene) -> dict[str, Any]:
    """The keys of summary.json that a scene alone gives."""
    description = SceneDescription(**{item.name: getattr(scene, item.name) for item in fields(SceneDescription)})
    return {
        "scene": scene.name,
        "parameters": dict(scene.parameters),
        "setup": description.as_json(),
        "particles": scene.particle_count,
        "cells": list(scene.domain.cells),
        "charges": [_charge_values(charge) for charge in scene.charges],
        **theory(scene),
    }


def description_from_json(values: Mapping[str, Any]) -> SceneDescription:
    """The description that `as_json` gave.

    Raises:
        KeyError, TypeError, ValueError: the values are not such.
    """
    return SceneDescription(
        description=str(values["description"]),
        domain=Domain(**_tuples(values["domain"])),
        walls=Walls(**{name: Wall(value) for name, value in values["walls"].items()}),
        section=SectionPlane(**values["section"]),
        detonators=tuple(_detonator(**item) for item in values["detonators"]),
        front_path=_segment(values["front_path"]),
        line=_segment(values["line"]),
        collision_points=_tuples(values["collision_points"]),
        picture_times=_tuples(values["picture_times"]),
        gauges=tuple(Gauge(**_tuples(item)) for item in values["gauges"]),
        end_time=float(values["end_time"]),
    )


def _charge_values(charge: Charge) -> dict[str, Any]:
    """What the summary says of a charge: how exactly its volume is known above all."""
    lower, upper = charge.solid.bounds()
    return {
        "name": charge.name,
        "material": charge.material.name,
        "explosive": charge.material.burn is not None,
        "lower_m": lower.tolist(),
        "upper_m": upper.tolist(),
        "particles": len(charge.positions),
        "mass_kg": charge.mass,
        "volume_m3": charge.volume,
        "volume_tolerance": charge.volume_tolerance,
        "specific_energy_J_kg": charge.material.specific_energy,
    }


def _detonator(kind: str, **values: Any) -> Detonator:
    return DETONATORS[kind](**_tuples(values))


def _segment(values: Mapping[str, Any] | None) -> Segment | None:
    return None if values is None else Segment(**_tuples(values))


def _tuples(value: Any) -> Any:
    """The value with tuples for JSON's lists."""
    if isinstance(value, Mapping):
        return {name: _tuples(item) for name, item in value.items()}
    return tuple(_tuples(item) for item in value) if isinstance(value, list) else value
