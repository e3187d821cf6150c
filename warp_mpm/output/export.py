"""Turns the result of a run into files for other programs; the suffix of the target says which."""

from importlib import import_module
from pathlib import Path

from warp_mpm.checks import mistake

# Module and function (source, target) -> what to open, by the suffix of the target; "" is a directory.
WRITERS = {
    ".pvd": ("warp_mpm.output.vtk", "write_pvd"),
    "": ("warp_mpm.output.vtk", "write_pvd"),
}


def export(source: str | Path, target: str | Path) -> Path:
    """Write what a run left in another format.

    Args:
        source: run directory or USD file.
        target: the file to be, or a directory for ParaView.

    Returns:
        The file to open.

    Raises:
        InputError: nothing writes files of this suffix, or the source is not the result of a run.
        SimulationError: the disk is full or refuses.
    """
    target = Path(target)
    suffix = "" if target.is_dir() else target.suffix.lower()
    if suffix not in WRITERS:
        known = ", ".join(filter(None, WRITERS))
        raise mistake("export: --to", f"a file that ends in {known}, or a directory for ParaView", repr(str(target)))
    module, function = WRITERS[suffix]
    written: Path = getattr(import_module(module), function)(source, target)
    return written
