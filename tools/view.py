"""Opens results in the programs people view them with: Blender, and Storm, the renderer of usdview.

    python tools/view.py install                       both, into .venv-viewers (Python 3.11, 370 MB; takes 0.95 GB)
    python tools/view.py check out/two_point           what they make of a result: values, and colours of their pictures
    python tools/view.py picture out/two_point -o render.png --frame 33        a picture to show

No display and no GPU is needed: Blender draws with Cycles on the CPU, Storm with OpenGL through EGL, which may be
Mesa's on the CPU.
"""

import argparse
import math
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table
from viewers.comparison import Picture, blender, expected_values, storm
from viewers.environment import MissingError, install, run_client
from viewers.legend import add_legend

from warp_mpm.errors import InputError
from warp_mpm.output.usd_reading import checked_frame, open_run

WIDTH = 110  # of the table [characters]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code: 2 for a mistake in what was typed, 1 if a viewer is missing."""
    options = _parser().parse_args(arguments)
    try:
        options.command(options)
    except InputError as error:
        print(error, file=sys.stderr)
        return 2
    except MissingError as error:
        print(f"view: {error}", file=sys.stderr)
        return 1
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description="Open results in Blender and Storm.")
    commands = parser.add_subparsers(metavar="COMMAND", required=True)
    command = commands.add_parser("install", help="install Blender, and with it Storm, into .venv-viewers")
    command.set_defaults(command=lambda _: print(install()))
    command = commands.add_parser("check", help="compare what the viewers show with what is in the file")
    command.set_defaults(command=_check)
    _add_result(command)
    command.add_argument("--size", type=int, default=800, help="of the pictures [pixels] (default: %(default)s)")
    command.add_argument("-o", "--output", metavar="DIR", type=Path, help="where to leave the pictures")
    command = commands.add_parser("picture", help="draw a picture to show")
    command.set_defaults(command=_picture)
    _add_result(command)
    command.add_argument("--size", type=int, nargs=2, default=(1080, 540), help="of the picture [pixels]")
    command.add_argument("-o", "--output", metavar="FILE", type=Path, default=Path("render.png"))
    return parser


def _add_result(command: argparse.ArgumentParser) -> None:
    """The arguments that say what is looked at."""
    command.add_argument("result", metavar="RUN", type=Path, help="a run directory or a USD file")
    command.add_argument("--frame", type=int, help="default: the one in the middle")


def _chosen(options: argparse.Namespace) -> tuple[Path, int]:
    """The USD file and the frame to look at.

    Raises:
        InputError: there is no such file, or it has no such frame.
    """
    file, _, times = open_run("view", options.result)
    frame = len(times) // 2 if options.frame is None else options.frame
    return file, checked_frame("view", frame, times)


def _check(options: argparse.Namespace) -> None:
    """Print what each viewer makes of a result.

    Raises:
        InputError: there is no such result or frame.
        MissingError: the viewers are not installed, or lack something.
    """
    file, frame = _chosen(options)
    with tempfile.TemporaryDirectory() as scratch:
        output = options.output or Path(scratch)
        output.mkdir(parents=True, exist_ok=True)
        drawn = storm(file, frame, output / "storm.png", options.size)
        imported, values = blender(file, [0, frame], output / "blender.png", options.size)
    expected = expected_values(file, [0, frame])
    wrong = [name for name, array in expected.items() if not np.array_equal(values.get(name), array)]
    table = Table(title=f"{file.name}, frame {frame}")
    for column in ("viewer", "values", "pixels in the map's colours", "particles in their own colour"):
        table.add_column(column, justify="left" if column == "viewer" else "right")
    _add_row(table, drawn, "-")
    _add_row(table, imported, f"{len(expected) - len(wrong)} of {len(expected)} arrays equal")
    console = Console(width=WIDTH, highlight=False)
    console.print(table)
    console.print(f"Storm by {drawn.report['opengl']}; Blender by Cycles on the CPU")
    for name in wrong:
        console.print(f"Blender has other values of {name}")


def _add_row(table: Table, picture: Picture, values: str) -> None:
    viewer = f"{picture.report['client']} {picture.report['version']}"
    particles = "none in view" if math.isnan(picture.share_of_particles) else f"{picture.share_of_particles:.1%}"
    table.add_row(viewer, values, f"{picture.share_in_map:.1%}", particles)


def _picture(options: argparse.Namespace) -> None:
    """Draw a picture to show, with the instant and the colours' meaning written on it.

    Raises:
        InputError: there is no such result or frame.
        MissingError: Blender is not installed.
    """
    file, frame = _chosen(options)
    with tempfile.TemporaryDirectory() as scratch:
        drawn = Path(scratch) / "drawn.png"
        run_client("studio", file, "--frame", frame, "--size", *options.size, "--picture", drawn)
        add_legend(drawn, file, frame, options.output)
    print(options.output)


if __name__ == "__main__":
    sys.exit(main())
