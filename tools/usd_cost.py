"""Measures what writing USD costs: time, memory and disk, without solving anything.

    python tools/usd_cost.py                              499,016 particles, 60 frames (2 minutes)
    python tools/usd_cost.py --cell-size 6e-3 --frames 20

The particles are those of the scene two_point; they drift, with a little disorder, and carry spherical waves. Each
line of the table is measured in processes of its own. Of times the shortest counts, because a busy machine can only add
to them; "CPU" is what the process itself worked. Memory is the most that the process had above what it had before the
first frame, pages of mapped files included.
"""

import argparse
import multiprocessing
import sys
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
from benchmark.memory import forget_peak, highest
from rich.console import Console
from rich.table import Table

import warp_mpm as mpm
from warp_mpm.launch import find_device
from warp_mpm.output.frame import Frame
from warp_mpm.output.usd import UsdWriter
from warp_mpm.scene import Scene
from warp_mpm.warp_startup import start_quietly

VARIANTS: dict[str, dict[str, Any]] = {  # arguments of the writer
    "clips": {"layout": mpm.Layout.CLIPS},
    "merged": {"layout": mpm.Layout.SINGLE},
    "merged, 1 particle in 4": {"layout": mpm.Layout.SINGLE, "particles_every": 4},
    "merged, and .usdz": {"layout": mpm.Layout.SINGLE, "usdz": True},
}
MEGA, MILLI = 1e6, 1e-3
TOP_PRESSURE = 4e9  # [Pa] in the last colour


def main() -> int:
    """Measure every variant and print the table."""
    parser = argparse.ArgumentParser(description="Measures what writing USD costs.")
    parser.add_argument("--cell-size", type=float, default=3e-3, help="of the scene two_point [m] (default: 3e-3)")
    parser.add_argument("--frames", type=int, default=60, help="default: 60")
    parser.add_argument("--repeats", type=int, default=3, help="measurements of each variant (default: 3)")
    options = parser.parse_args()
    start_quietly()
    count = two_point(options.cell_size).particle_count
    table = Table(title=f"{count:,} particles, {options.frames} frames")
    for column in ("", "ms a frame", "of it closing", "CPU ms a frame", "MB a frame", "MB of memory above"):
        table.add_column(column, justify="right" if column else "left", no_wrap=not column)
    for name in VARIANTS:
        runs = [in_a_new_process(name, options.cell_size, options.frames) for _ in range(options.repeats)]
        best = min(runs, key=lambda run: run["seconds"])
        memory = "unknown" if best["memory"] is None else f"{max(run['memory'] for run in runs) / MEGA:.0f}"
        times = [f"{best[key] / options.frames / MILLI:.0f}" for key in ("seconds", "closing", "cpu")]
        table.add_row(name, *times, f"{best['bytes'] / options.frames / MEGA:.1f}", memory)
    Console().print(table)
    return 0


def in_a_new_process(variant: str, cell_size: float, frames: int) -> dict[str, Any]:
    """What `cost` says of a variant; in a process of its own, because a process hardly gives memory back."""
    fresh = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, mp_context=fresh) as process:
        return process.submit(cost, variant, cell_size, frames).result()


def cost(variant: str, cell_size: float, frames: int) -> dict[str, Any]:
    """Write all frames, and close the file.

    Returns:
        seconds and closing: of writing and closing, and of closing alone [s], without the making of frames. cpu: as
        seconds, but worked by this process. bytes: of the files that stay, without a .usdz. memory: growth to its
        highest [bytes]; None where the system does not tell.
    """
    start_quietly()
    device = find_device("cpu")
    scene = two_point(cell_size)
    source = made_up_frames(scene, frames)
    frame = next(source)
    before = forget_peak(device)
    with tempfile.TemporaryDirectory() as directory:
        path = Path(directory) / "cost.usdc"
        writer = UsdWriter(path, scene, pressure_range=(0.0, TOP_PRESSURE), frames=frames, **VARIANTS[variant])
        spent = [seconds(writer.write, frame), *(seconds(writer.write, frame) for frame in source)]
        closing = seconds(writer.close)
        top = highest(device)
        size = sum(file.stat().st_size for file in Path(directory).rglob("*.usd[ac]"))
    return {
        "seconds": sum(wall for wall, _ in spent) + closing[0],
        "closing": closing[0],
        "cpu": sum(cpu for _, cpu in spent) + closing[1],
        "bytes": size,
        "memory": None if top is None or before is None else top - before,
    }


def seconds(work: Any, *arguments: Any) -> tuple[float, float]:
    """What some work takes, by the clock and by what this process worked [s]."""
    begin, begin_cpu = time.perf_counter(), time.process_time()
    work(*arguments)
    return time.perf_counter() - begin, time.process_time() - begin_cpu


def two_point(cell_size: float) -> Scene:
    """The scene whose particles are written."""
    return mpm.load_scene("two_point", cell_size=cell_size)


def made_up_frames(scene: Scene, frames: int) -> Iterator[Frame]:
    """Frames of a scene that nobody solved."""
    random = np.random.default_rng(1)
    start = np.concatenate([charge.positions for charge in scene.charges]).astype(np.float32)
    inside = np.ones(len(start), dtype=bool)
    section = np.zeros([scene.domain.cells[axis] + 1 for axis in scene.section.in_plane], dtype=np.float32)
    distance = np.linalg.norm(start, axis=1)
    for index in range(frames):
        noise = random.standard_normal(start.shape, dtype=np.float32)
        position = start + np.float32(1e-4) * noise + np.float32(1e-4 * index)
        wave = np.sin(60.0 * (distance - 5e-3 * index)) + 0.02 * noise[:, 0]
        pressure = (TOP_PRESSURE * (0.5 + 0.4 * wave)).astype(np.float32)
        yield Frame(index, 1e-6 * index, position, pressure, inside, section)


if __name__ == "__main__":
    sys.exit(main())
