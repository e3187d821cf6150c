"""Measures how fast the solver is, and how far from what the machine could do.

    python tools/bench.py                      everything (2 minutes on 2 CPU cores)
    python tools/bench.py --short              everything, smaller and fewer times (under a minute)
    python tools/bench.py --sections phases    some of it

Sections, each a table and a part of bench.json, and the middle five a panel of bench.png:

    limits     memory bandwidth and multiply-add rate of this machine
    phases     each phase of a step: time, counted bytes and operations, share of what the limits allow
    variants   every shape function with every order of the step
    threads    1, 2, ... threads
    sizes      50 k to 8 M particles, as far as they fit into the memory
    late       early and late in a closed cube, first and last quarter of a free expansion
    memory     bytes per particle

The case is a cube of the paper's explosive with 3 mm cells, 8 particles each, lit in its centre, at the solver's
defaults. What is compared is measured in turns, A B C, B C A, ...; figures are medians, with the lowest and the highest
beside them. Steps are timed without output and audits, their share of the sorting included.
"""

import argparse
import os
import platform
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import warp as wp
from benchmark import sections
from benchmark.sections import Bench, Effort
from benchmark.tables import tables
from benchmark.timing import Progress
from rich.console import Console

from warp_mpm.checks import count
from warp_mpm.errors import InputError, SimulationError
from warp_mpm.guards import writable_directory
from warp_mpm.launch import Launcher, available_cores, find_device
from warp_mpm.output.tables import write_summary
from warp_mpm.version import VERSION

SECTIONS = ("limits", "phases", "variants", "threads", "sizes", "late", "memory")
SHORT = Effort(cells=24, free_cells=16, sizes=(12, 18, 26), rounds=3, stream_bytes=2**27)
WIDTH = 130  # of the tables [characters]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code: 2 for a mistake in what was typed, 1 if a run breaks down."""
    console = Console(width=WIDTH, highlight=False)
    begin = time.perf_counter()

    def progress(text: str) -> None:
        console.print(f"[dim]{time.perf_counter() - begin:4.0f} s  {text}[/dim]")

    try:
        options = _parser().parse_args(arguments)
        output = writable_directory(options.output)
        report = measure(options.sections, _effort(options), options.device, options.threads, progress)
        write_summary(output / "bench.json", report)
        for table in tables(report):
            console.print(table)
        draw(report, output / "bench.png", progress)
    except InputError as error:
        print(f"bench: {error}", file=sys.stderr)
        return 2
    except SimulationError as error:
        print(f"bench: {error}", file=sys.stderr)
        return 1
    progress(f"written to {output}")
    return 0


def measure(
    names: Sequence[str], effort: Effort, device: str | None, threads: int | None, progress: Progress
) -> dict[str, Any]:
    """Measure some sections.

    Args:
        names: of `SECTIONS`.
        effort: how much.
        device: "cpu", "cuda:0", ...; a GPU if there is one.
        threads: the most that are used on a CPU; one a core.
        progress: told what is going on.

    Returns:
        What is written to bench.json: the machine, the settings, and what each section found.

    Raises:
        InputError: unknown device, fewer than one thread, or a default case that does not fit into the memory.
        SimulationError: a run broke down.
    """
    found = find_device(device)
    bench = Bench(found, Launcher(found, threads).threads, effort, progress)
    results: dict[str, Any] = {}
    try:
        if "limits" in names or "phases" in names:
            results["limits"] = sections.limits(bench)
        if "phases" in names:
            results["phases"] = sections.phases(bench, results["limits"])
        for name in SECTIONS[2:]:
            if name in names:
                results[name] = getattr(sections, name)(bench)
    finally:
        bench.close()
    settings = {"threads": bench.threads, "rounds": effort.rounds, "cells_along_an_edge": effort.cells}
    return {"machine": machine(found), "versions": versions(), "settings": settings, **results}


def machine(device: wp.Device) -> dict[str, Any]:
    """The machine, as far as the system tells."""
    return {
        "device": device.name,
        "processor": _processor(),
        "cores": available_cores(),
        "system": f"{platform.system()} {platform.machine()}",
        "load_before_processes": os.getloadavg()[0] if hasattr(os, "getloadavg") else None,
    }


def versions() -> dict[str, str]:
    """Versions of what the speed depends on."""
    return {"warp_mpm": VERSION, "warp": wp.__version__, "numpy": np.__version__, "python": platform.python_version()}


def draw(report: Mapping[str, Any], path: Path, progress: Progress) -> None:
    """Draw the picture; without matplotlib say so and go on."""
    try:
        from benchmark.picture import draw_report
    except ImportError as error:
        progress(f"no picture: {error}; install the extra 'figures'")
        return
    if not draw_report(report, path):
        progress("no picture: none of these sections has one")


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = []
    named = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return named[0] if named else platform.processor()


def _effort(options: argparse.Namespace) -> Effort:
    effort = SHORT if options.short else Effort()
    if options.repeats is None:
        return effort
    return Effort(**{**vars(effort), "rounds": count("--repeats", options.repeats)})


class _Parser(argparse.ArgumentParser):
    """Reports wrong usage as every other mistake: in one line."""

    def error(self, message: str) -> NoReturn:
        """Raise what argparse found.

        Raises:
            InputError: always.
        """
        raise InputError(f"{message}; see --help")


def _parser() -> argparse.ArgumentParser:
    description, _, rest = (__doc__ or "").partition("\n")
    parser = _Parser(
        "bench.py", description=description, epilog=rest, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--sections", nargs="+", choices=SECTIONS, default=SECTIONS, metavar="NAME", help="only these")
    parser.add_argument("--short", action="store_true", help="smaller and fewer times: under a minute on 2 cores")
    parser.add_argument("--threads", type=int, metavar="N", help="the most threads (default: one a core)")
    parser.add_argument("--device", help="cpu, cuda:0, ... (default: a GPU if there is one)")
    parser.add_argument("--repeats", type=int, metavar="N", help="rounds of each comparison (default: 5; short: 3)")
    parser.add_argument("-o", "--output", type=Path, default=Path("out/bench"), metavar="DIR", help="where to write")
    return parser


if __name__ == "__main__":
    sys.exit(main())
