"""What a run is, part by part, as short texts that are equal if and only if the parts are.

Fingerprints are of the resolved data, arrays and numbers: a comment in the scene's file, or a parameter that changes
nothing, does not change them.
"""

import hashlib
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from typing import Any

import numpy as np

from warp_mpm.config import Save, SolverConfig
from warp_mpm.scene import Charge, Scene

# What no result depends on: texts, and when to save what only helps to go on. A charge is its particles.
LEFT_OUT: dict[type, tuple[str, ...]] = {
    Scene: ("description", "parameters", "warnings"),
    Charge: ("solid",),
    Save: ("figures", "checkpoint_steps", "checkpoint_minutes"),
}


def fingerprints(scene: Scene, config: SolverConfig, save: Save) -> dict[str, str]:
    """The fingerprint of every part of what is run, by the part's name."""
    wholes = {"scene": scene, "solver": config, "save": save}
    return {
        f"{whole} {name}": fingerprint(getattr(value, name))
        for whole, value in wholes.items()
        for name in _names(value)
    }


def fingerprint(value: Any) -> str:
    """A text that tells a value from every other: the SHA-256 of its numbers, names and texts.

    Raises:
        TypeError: it holds something that is neither plain data nor made of dataclasses, arrays and containers.
    """
    digest = hashlib.sha256()
    _feed(digest, value)
    return digest.hexdigest()


def _feed(digest: Any, value: Any) -> None:
    """Add a value to a digest, with its type and length before it, so that no two values add the same bytes."""
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, np.ndarray):
        _say(digest, "array", value.dtype.str, value.shape)
        digest.update(np.ascontiguousarray(value).data)
    elif isinstance(value, Enum):
        _say(digest, type(value).__name__, value.name)
    elif value is None or isinstance(value, (bool, int, float, str)):
        _say(digest, type(value).__name__, value)
    elif is_dataclass(value):
        _say(digest, type(value).__name__, _names(value))
        for name in _names(value):
            _feed(digest, getattr(value, name))
    elif isinstance(value, Mapping):
        _say(digest, "mapping", len(value))
        for key in sorted(value):
            _feed(digest, key)
            _feed(digest, value[key])
    elif isinstance(value, (tuple, list)):
        _say(digest, "sequence", len(value))
        for item in value:
            _feed(digest, item)
    else:
        raise TypeError(f"no fingerprint of a {type(value).__name__}")


def _say(digest: Any, *words: Any) -> None:
    digest.update(f"{words!r}\n".encode())


def _names(value: Any) -> list[str]:
    """Names of the fields that count."""
    return [item.name for item in fields(value) if item.name not in LEFT_OUT.get(type(value), ())]
