"""Kills runs, and counts those that leave a USD file which opens and has every frame that was finished.

    python tools/usd_kill.py               50 runs (6 minutes on 2 CPU cores)
    python tools/usd_kill.py --kills 10

Each is `warp-mpm run two_point`, coarse, of 60 frames, all into one directory. Four in five are killed (SIGKILL) when
history.csv has some number of rows, the others while the frames are merged; always some milliseconds later. A frame is
finished when it has its row in history.csv: the file must have the same time for it, and finite numbers.
"""

import argparse
import collections
import csv
import itertools
import random
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from pxr import Usd, UsdGeom

FRAMES = 60
RUN = ("two_point", "--set", "cell_size=8e-3", "--layout", "single", "--isosurface", "1e9", "--frames", str(FRAMES))
LATEST_FRAME, LATEST_MERGE = 0.03, 0.3  # [s] after the moment: about what a frame takes, and more than merging takes
PATIENCE = 120.0  # [s] for a moment to come


def main() -> int:
    """Kill as often as asked for; 1 if a frame was ever lost."""
    parser = argparse.ArgumentParser(description="Kills runs, and looks at what they leave.")
    parser.add_argument("--kills", type=int, default=50, help="default: 50")
    kills = parser.parse_args().kills
    chance = random.Random(1)
    good = 0
    left: collections.Counter[str] = collections.Counter()
    with tempfile.TemporaryDirectory() as directory:
        whole = Path(directory) / "two_point.usdc"
        for number in range(kills):
            rows = 1 + number * FRAMES // kills
            in_merge = number % 5 == 4
            come = merging(whole) if in_merge else has_rows(whole.with_name("history.csv"), rows)
            delay = chance.random() * (LATEST_MERGE if in_merge else LATEST_FRAME)
            kill_when(come, delay, Path(directory))
            problem = fault(whole)
            good += not problem
            left["the whole file" if whole.exists() else "clips"] += 1
            moment = "merging" if in_merge else f"frame {rows} of {FRAMES}"
            print(f"{number + 1:3} {moment:16} {problem or 'all there'}", flush=True)
    print(f"{good} of {kills} hold every finished frame; left behind: {dict(left)}")
    return 0 if good == kills else 1


def kill_when(come: Callable[[], bool], delay: float, directory: Path) -> None:
    """Start a run and kill it some time after a moment has come."""
    for old in ("history.csv", "two_point.usdc", "two_point.part.usdc"):
        (directory / old).unlink(missing_ok=True)
    command = [sys.executable, "-m", "warp_mpm", "run", *RUN, "-o", str(directory)]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as run:
        deadline = time.monotonic() + PATIENCE
        while not come() and run.poll() is None and time.monotonic() < deadline:
            time.sleep(1e-3)
        time.sleep(delay)
        run.kill()


def has_rows(history: Path, rows: int) -> Callable[[], bool]:
    """Whether so many frames are finished."""
    return lambda: len(finished_times(history)) >= rows


def merging(whole: Path) -> Callable[[], bool]:
    """Whether the merged file is under way."""
    part = whole.with_name(f"{whole.stem}.part.usdc")
    return lambda: part.exists() or whole.exists()


def finished_times(history: Path) -> list[float]:
    """Times of the rows that are whole [s]."""
    if not history.exists():
        return []
    lines = history.read_text(encoding="utf-8").splitlines(keepends=True)
    return [float(row["time_s"]) for row in csv.DictReader(line for line in lines if line.endswith("\n"))]


def fault(whole: Path) -> str:
    """What is wrong with what a run left; nothing if all finished frames are there."""
    finished = finished_times(whole.with_name("history.csv"))
    if not finished:
        return "no frame was finished"
    stage = Usd.Stage.Open(str(whole if whole.exists() else whole.with_suffix(".usda")))
    if problems := stage.GetCompositionErrors():
        return str(problems[0])
    clock = stage.GetAttributeAtPath("/World.blast:time")
    frames = round(stage.GetEndTimeCode()) + 1
    times = [clock.Get(index) for index in range(frames)]
    if frames < len(finished) or times[: len(finished)] != finished:
        return f"{len(finished)} frames finished, {frames} found, or at other times"
    points = UsdGeom.Points(stage.GetPrimAtPath("/World/particles"))
    pressure = UsdGeom.PrimvarsAPI(points).GetPrimvar("pressure")
    count = len(points.GetIdsAttr().Get())
    for index, attribute in itertools.product(range(frames), (points.GetPointsAttr(), pressure)):
        values = np.array(attribute.Get(index))
        if len(values) != count or not np.isfinite(values).all():
            return f"frame {index}: {attribute.GetName()}: not {count} finite values"
    return ""


if __name__ == "__main__":
    sys.exit(main())
