"""Kills runs again and again, resumes them, and compares what comes out with a run that was left alone.

    python tools/resume_kill.py               50 kills (5 minutes on 2 CPU cores)
    python tools/resume_kill.py --kills 10

Each run is `warp-mpm run two_point`, coarse and free, with a checkpoint every 3 steps, on one or two threads. It is
killed (SIGKILL) at a random moment, of its start, its steps, its frames or its end, and resumed until it completes;
then the next one begins. After every kill all frames that were finished must open. At the end all results must be
equal: the files byte by byte, and the summary but for what depends on the machine.
"""

import argparse
import json
import random
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from usd_kill import fault, finished_times

SCENE = ("two_point", "--set", "cell_size=2e-2", "confinement=free", "--frames", "9", "--checkpoint-steps", "3")
OF_THE_MACHINE = ("wall_s", "solver_wall_s", "ns_per_particle_step", "threads", "device", "version")
SOONEST = 0.25  # of the time a run takes; before it does nothing but start
FILES = ("history.csv", "gauges.csv", "steps.npz", "two_point.usdc")


def main() -> int:
    """Kill as often as asked for; 1 if a frame was ever lost, or a result differs."""
    parser = argparse.ArgumentParser(description="Kills and resumes runs, and compares their results.")
    parser.add_argument("--kills", type=int, default=50, help="default: 50")
    kills = parser.parse_args().kills
    chance = random.Random(1)
    with tempfile.TemporaryDirectory() as scratch:
        whole = Path(scratch) / "whole"
        attempt(whole, chance, None)  # once more than need be: kernels may have to be compiled
        begin = time.monotonic()
        attempt(whole, chance, None)
        usual = time.monotonic() - begin
        killed, runs, problems = 0, 0, []
        while killed < kills:
            runs += 1
            directory = Path(scratch) / f"run_{runs}"
            while not attempt(directory, chance, usual * chance.uniform(SOONEST, 0.8)):
                killed += 1
                problems += lost_frames(directory)
                print(f"{killed:3} run {runs}, {newest(directory) or 'no checkpoint yet'}", flush=True)
            problems += differences(directory, whole)
    print("\n".join(problems))
    print(f"{killed} kills, {runs} runs completed, {len(problems)} problems")
    return 1 if problems else 0


def attempt(directory: Path, chance: random.Random, limit: float | None) -> bool:
    """Start or resume a run, and kill it after some time [s]; whether it completed."""
    words = ["--resume"] if newest(directory) else []
    threads = ["--threads", str(chance.choice((1, 2)))]
    command = [sys.executable, "-m", "warp_mpm", "run", *SCENE, *threads, *words, "-o", str(directory)]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL) as run:
        try:
            return run.wait(limit) == 0
        except subprocess.TimeoutExpired:
            run.kill()
    return status(directory) == "complete"


def newest(directory: Path) -> str:
    """Name of the newest checkpoint that is whole; nothing if there is none."""
    names = sorted(file.name for file in directory.glob("checkpoint_*.npz") if ".part" not in file.name)
    return names[-1] if names else ""


def status(directory: Path) -> str:
    """What the summary says of the run."""
    summary = directory / "summary.json"
    return json.loads(summary.read_text())["status"] if summary.exists() else ""


def lost_frames(directory: Path) -> list[str]:
    """What is wrong with the frames that were finished."""
    problem = fault(directory / "two_point.usdc") if finished_times(directory / "history.csv") else ""
    return [f"{directory.name}: {problem}"] if problem else []


def differences(directory: Path, whole: Path) -> list[str]:
    """The results that are not those of the run that was left alone."""
    some, others = (json.loads((of / "summary.json").read_text()) for of in (directory, whole))
    names = [name for name in others if name not in OF_THE_MACHINE and some.get(name) != others[name]]
    names += [name for name in FILES if (directory / name).read_bytes() != (whole / name).read_bytes()]
    return [f"{directory.name}: another {name}" for name in names]


if __name__ == "__main__":
    sys.exit(main())
