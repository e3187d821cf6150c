"""How work is launched: kernels that check themselves, as Warp compiles them for debugging, run on one thread."""

import subprocess
import sys
from pathlib import Path

import warp as wp

from warp_mpm.launch import Launcher, find_device

CHECKED = """
import sys
import warp
warp.config.mode = "debug"
sys.path.insert(0, sys.argv[1])
from scenes_for_tests import block, inert_gas, start
from warp_mpm import launch
launch.SMALLEST_SHARED_WORK = 0
scene = block((40, 4, 4), material=inert_gas())
for _ in range(20):
    start(scene, threads=4)
"""


def test_checked_kernels_run_on_one_thread(monkeypatch):
    device = find_device("cpu")
    assert Launcher(device, 3).threads == 3
    monkeypatch.setattr(wp.config, "mode", "debug")
    assert Launcher(device, 3).threads == 1


def test_checked_kernels_do_not_crash():
    """On several threads they do."""
    command = [sys.executable, "-c", CHECKED, str(Path(__file__).parent)]
    assert subprocess.run(command, check=False, timeout=300).returncode == 0
