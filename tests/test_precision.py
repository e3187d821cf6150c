"""Single and double precision: the choice, and double at work (single is what all other tests run in)."""

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import warp as wp

from warp_mpm.cli import main
from warp_mpm.kernels.precision import LAST_FRACTION, VARIABLE, scalar

TESTS = Path(__file__).parent


def in_precision(precision, *arguments):
    """Run Python in a process of its own, whose kernels are made in a precision."""
    return subprocess.run(
        [sys.executable, *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
        cwd=TESTS.parent,
        env={**os.environ, VARIABLE: precision},
    )


def test_double_precision():
    """What `double_precision.py` says, and every equation of state on the host."""
    states = f"{TESTS / 'test_material.py'}::test_chapman_jouguet_state_satisfies_its_conditions"
    selected = [TESTS / "double_precision.py", TESTS / "test_equations_of_state.py", states]
    done = in_precision("double", "-m", "pytest", *selected)
    assert done.returncode == 0, done.stdout


def test_one_module_names_the_types_of_single_precision():
    """Elsewhere they would round what is double."""
    types = re.compile(r"\bwp\.(float32|vec[234]f?|mat(22|33|44)f?)\b")
    files = [path for room in ("kernels", "warp_mpm") for path in sorted((TESTS.parent / room).rglob("*.py"))]
    assert {path.name for path in files if types.search(path.read_text(encoding="utf-8"))} == {"precision.py"}


def test_the_last_fraction_is_the_largest_number_below_one():
    one = np.ones((), dtype=wp.dtype_to_numpy(scalar))
    assert float(LAST_FRACTION) == np.nextafter(one, 0.0 * one)


@pytest.mark.parametrize(("variable", "option"), [("half", []), ("", ["--precision", "half"])])
@pytest.mark.parametrize("command", [["run", "two_point"], ["verify", "--list"]], ids=" ".join)
def test_an_unknown_precision_is_one_clear_line(command, variable, option):
    done = in_precision(variable, "-m", "warp_mpm", *command, *option)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == f"warp-mpm: {VARIABLE}: expected single or double, got 'half'\n"


def test_the_option_chooses():
    code = (
        "from warp_mpm.cli import main; main(['verify', '--list', '--precision', 'double']);"
        "from warp_mpm.kernels.precision import PRECISION; print(PRECISION)"
    )
    assert in_precision("single", "-c", code).stdout.endswith("\ndouble\n")


def test_kernels_of_a_process_are_of_one_precision(capfd, monkeypatch):
    monkeypatch.setenv(VARIABLE, "single")  # and put back afterwards
    assert main(["run", "two_point", "--precision", "double"]) == 2
    assert "expected single, for which this process has kernels, got 'double'" in capfd.readouterr().err
