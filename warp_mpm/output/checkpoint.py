"""Checkpoint files: checkpoint_<step>.npz in the run directory, the last two of a run.

Plain arrays (NumPy's .npz, without pickles: nothing in the file is ever executed), and `header`, a text in JSON that
says which version wrote it and what was run. A checksum of every array is checked when it is read.
"""

import json
import os
import re
import zipfile
import zlib
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from warp_mpm.checks import mistake
from warp_mpm.output.whole_file import whole_file
from warp_mpm.version import VERSION

FORMAT = 1  # of the file
KEPT = 2  # the newest may be damaged with the machine that wrote it
HEADER = "header"
NAME = re.compile(r"checkpoint_(\d+)\.npz")


def write_checkpoint(directory: Path, step: int, header: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> Path:
    """Write the checkpoint of a step, on the disk when this returns, and remove all but the last two.

    Raises:
        SimulationError: the disk is full or refuses. The checkpoints before stay as they are.
    """
    path = directory / f"checkpoint_{step:08d}.npz"
    text = json.dumps({"format": FORMAT, "version": VERSION, **header})
    with whole_file(path) as part, part.open("wb") as file:
        np.savez(file, **{HEADER: np.array(text)}, **arrays)
        file.flush()
        os.fsync(file.fileno())
    _flush_directory(directory)
    for old in checkpoint_files(directory)[KEPT:]:
        with suppress(OSError):
            old.unlink()
    return path


def checkpoint_files(directory: Path) -> list[Path]:
    """The checkpoints of a run directory, the newest first; not what a killed run left half written."""
    found = {path: NAME.fullmatch(path.name) for path in directory.glob("checkpoint_*.npz")}
    steps = {path: int(match[1]) for path, match in found.items() if match}
    return sorted(steps, key=lambda path: steps[path], reverse=True)


def remove_checkpoints(directory: Path) -> None:
    """Remove all checkpoints of a run directory, half written ones too."""
    for path in directory.glob("checkpoint_*.npz"):
        with suppress(OSError):
            path.unlink()


def read_checkpoint(path: Path) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """The header and the arrays of a checkpoint.

    Raises:
        InputError: it is damaged, no checkpoint, or one of another version.
    """
    try:
        with path.open("rb") as file, zipfile.ZipFile(file) as archive:
            arrays = {name.removesuffix(".npy"): _array(archive, name) for name in archive.namelist()}
        header = json.loads(str(arrays.pop(HEADER)))
        written_by = header["format"], header["version"]
    except (
        *(OSError, EOFError, ValueError, KeyError, TypeError, RuntimeError, MemoryError),
        *(zipfile.BadZipFile, zlib.error),
    ) as error:
        reason = " ".join(f"{type(error).__name__}: {error}".split())
        raise mistake(str(path), "a whole checkpoint", f"one that cannot be read ({reason})") from error
    if written_by != (FORMAT, VERSION):
        got = f"one of version {written_by[1]}"
        raise mistake(str(path), f"a checkpoint of version {VERSION}", got, "go on with that version, or start anew")
    return header, arrays


def _array(archive: zipfile.ZipFile, name: str) -> np.ndarray:
    """An array of the archive, read to its end, where its checksum is compared."""
    with archive.open(name) as member:
        array = np.lib.format.read_array(member, allow_pickle=False)
        if member.read(1):
            raise ValueError(f"{name} is longer than it says")
    return array


def _flush_directory(directory: Path) -> None:
    """Have the new name on the disk too, where the system lets a directory be flushed."""
    with suppress(OSError):
        descriptor = os.open(directory, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
