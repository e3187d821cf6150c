"""Files that are whole whenever they are there."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from warp_mpm.errors import SimulationError


@contextmanager
def whole_file(path: str | Path) -> Iterator[Path]:
    """A file beside `path` to write to, `<name>.part.<suffix>`; it takes the name `path` when the block ends well.

    Raises:
        SimulationError: the disk is full or refuses.
    """
    path = Path(path)
    part = path.with_name(f"{path.stem}.part{path.suffix}")
    try:
        yield part
        os.replace(part, path)
    except OSError as error:
        raise write_error(path, error) from error
    finally:
        with suppress(OSError):  # it is gone after a good end, and what hinders this hindered the block
            part.unlink()


def write_error(path: Path, error: OSError) -> SimulationError:
    """The error for a file that cannot be written."""
    reason = error.strerror or str(error)
    return SimulationError(f"cannot write {path}: {reason}; free some space, or choose another output directory")
