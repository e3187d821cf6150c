"""What writing USD costs, by the tool that measures it: disk and memory; times are not asserted."""

import importlib
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tools"))  # a program beside the package
usd_cost = importlib.import_module("usd_cost")

FRAMES = 20
MOST_BYTES = 14e6  # a frame of half a million particles
MOST_MEMORY = 300e6  # [bytes]


def test_disk_and_memory_of_a_large_run():
    found = usd_cost.in_a_new_process("merged, and .usdz", 3e-3, FRAMES)
    assert found["bytes"] < MOST_BYTES * FRAMES
    if found["memory"] is None:
        pytest.skip("this system does not tell how much memory a process took at most")
    assert found["memory"] < MOST_MEMORY
    assert found["memory"] < 0.8 * found["bytes"]  # merging all frames at once would map all of them
