"""Packs USD files into one .usdz: a zip archive without compression, whose contents begin at multiples of 64 bytes.

https://openusd.org/release/spec_usdz.html. `UsdUtils.CreateNewUsdzPackage` makes the same, but maps whole files for it:
memory in proportion to the number of frames.
"""

import shutil
import struct
import zipfile
from collections.abc import Sequence
from pathlib import Path

from warp_mpm.errors import SimulationError
from warp_mpm.output.whole_file import whole_file

ALIGNMENT = 64  # [bytes]
LIMIT = 2**32 - 1  # [bytes]; offsets have 32 bits
HEADER = 30  # [bytes] of a file in a zip archive, before its name
PADDING = 0x1986  # marks an extra field of a header that only fills it up
CHUNK = 2**20  # [bytes] copied at once


def pack(package: Path, files: Sequence[Path]) -> None:
    """Make a .usdz of files in and below its own directory, the root layer first.

    Raises:
        SimulationError: they are too large for this format, or the disk is full or refuses.
    """
    with whole_file(package) as part:
        size = sum(file.stat().st_size for file in files)
        if size > LIMIT:
            raise SimulationError(
                f"cannot write {package}: expected at most the {LIMIT / 1e9:.1f} GB that a .usdz can hold, got "
                f"{size / 1e9:.1f} GB; show fewer particles, or take {files[0].name} instead"
            )
        with part.open("wb") as stream, zipfile.ZipFile(stream, "w") as archive:
            for file in files:
                entry = zipfile.ZipInfo(file.relative_to(package.parent).as_posix())
                before = stream.tell() + HEADER + len(entry.filename.encode())
                filling = -(before + 4) % ALIGNMENT
                entry.extra = struct.pack("<HH", PADDING, filling) + bytes(filling)
                with file.open("rb") as source, archive.open(entry, "w") as target:
                    shutil.copyfileobj(source, target, CHUNK)
