"""steps.npz: what every step left, and the section at the instants worth a picture.

Plain arrays (NumPy's .npz, no pickles), named after the fields of `StepRecord` and its parts: `time`, `line.pressure`,
`section.peak`, ...; `picture.time` (k,) and `picture.pressure` (k, nodes_u, nodes_v). What a run does not have is left
out.
"""

import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any

import numpy as np

from warp_mpm.checks import mistake
from warp_mpm.output.frame import LineRecord, SectionPicture, SectionRecord, StepRecord
from warp_mpm.output.whole_file import whole_file

PARTS: dict[str, type] = {"path": LineRecord, "line": LineRecord, "section": SectionRecord}  # of a StepRecord
OF_THE_WHOLE = ("time",)  # what parts share with the record they are in


def write_steps(path: str | Path, record: StepRecord, pictures: Sequence[SectionPicture]) -> None:
    """Write the file; under its name it is always whole.

    Raises:
        SimulationError: the disk is full or refuses.
    """
    arrays: dict[str, np.ndarray] = {}
    for item in fields(record):
        value = getattr(record, item.name)
        if value is not None and item.name in PARTS:
            arrays |= {f"{item.name}.{name}": getattr(value, name) for name in _own_fields(PARTS[item.name])}
        elif isinstance(value, np.ndarray):
            arrays[item.name] = value
    if pictures:
        arrays["picture.time"] = np.array([picture.time for picture in pictures])
        arrays["picture.pressure"] = np.stack([picture.pressure for picture in pictures])
    with whole_file(path) as part, part.open("wb") as file:
        np.savez_compressed(file, **arrays)


def read_steps(path: str | Path) -> tuple[StepRecord, tuple[SectionPicture, ...]]:
    """Read what `write_steps` wrote.

    Raises:
        InputError: the file is damaged, or another program's.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        return _record(arrays), _pictures(arrays)
    except (KeyError, ValueError, EOFError, OSError, zipfile.BadZipFile) as error:
        reason = " ".join(str(error).split())
        raise mistake(str(path), "the steps of a run", f"something else ({reason})", "run the scene again") from error


def _record(arrays: Mapping[str, np.ndarray]) -> StepRecord:
    own: dict[str, Any] = {name: arrays.get(name) for name in _own_fields(StepRecord) if name not in PARTS}
    parts = {name: _part(arrays, name, kind) for name, kind in PARTS.items()}
    return StepRecord(time=arrays["time"], **own, **parts)


def _part(arrays: Mapping[str, np.ndarray], name: str, kind: type) -> Any:
    if not any(array.startswith(f"{name}.") for array in arrays):
        return None
    shared = {item.name: arrays[item.name] for item in fields(kind) if item.name in OF_THE_WHOLE}
    return kind(**shared, **{own: arrays[f"{name}.{own}"] for own in _own_fields(kind)})


def _own_fields(kind: type) -> list[str]:
    """Names of the fields that are this record's alone; what has a default is kept elsewhere."""
    return [item.name for item in fields(kind) if item.name not in OF_THE_WHOLE and item.default_factory is MISSING]


def _pictures(arrays: Mapping[str, np.ndarray]) -> tuple[SectionPicture, ...]:
    if "picture.time" not in arrays:
        return ()
    pairs = zip(arrays["picture.time"], arrays["picture.pressure"], strict=True)
    return tuple(SectionPicture(float(time), pressure) for time, pressure in pairs)
