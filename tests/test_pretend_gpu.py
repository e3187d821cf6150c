"""The code for a GPU on machines that have none: see `pretend_gpu/__init__.py`. CI runs all tests of devices on it."""

import os
import subprocess
import sys
from pathlib import Path

import pretend_gpu
import pytest

TESTS = Path(__file__).parent
SELECTED = ("pretend_gpu_faults.py", "test_same_answer.py::test_a_gpu_gives_the_answer_of_the_cpu_and_its_own_again")


@pytest.mark.skipif(sys.platform != "linux", reason="its memory is Linux's")
def test_on_a_pretend_gpu():
    """What it must notice, and one run of the solver; none is skipped."""
    done = subprocess.run(
        [sys.executable, "-X", "faulthandler", "-m", "pytest", "-q", *(str(TESTS / name) for name in SELECTED)],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
        env={**os.environ, pretend_gpu.VARIABLE: "1"},
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "skipped" not in done.stdout
