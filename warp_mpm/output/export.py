"""Turns the result of a run into files for other programs; the suffix of the target says which."""

from importlib import import_module
from pathlib import Path

from warp_mpm.checks import mistake

# Module and function (source, target, frame or None) -> what to open, by the suffix of the target; "" is a directory.
WRITERS = {
    ".pvd": ("warp_mpm.output.vtk", "write_pvd"),
    "": ("warp_mpm.output.vtk", "write_pvd"),
    ".glb": ("warp_mpm.output.glb", "write_glb"),
}


def export(source: str | Path, target: str | Path, frame: int | None = None) -> Path:
    """Write what a run left in another format.

    Args:
        source: run directory or USD file.
        target: the file to be, or a directory for ParaView.
        frame: the frame, counted from 0, for formats that show one instant; all frames if not given.

    Returns:
        The file to open.

    Raises:
        InputError: nothing writes files of this suffix, the source is not the result of a run, or has no such frame.
        SimulationError: the disk is full or refuses.
    """
    target = Path(target)
    suffix = "" if target.is_dir() else target.suffix.lower()
    if suffix not in WRITERS:
        known = " or ".join(filter(None, WRITERS))
        raise mistake("export: --to", f"a file that ends in {known}, or a directory for ParaView", repr(str(target)))
    module, function = WRITERS[suffix]
    written: Path = getattr(import_module(module), function)(source, target, frame)
    return written
