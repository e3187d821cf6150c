"""`warp-mpm verify`: exit codes, one line for every mistake, and nothing heavy that is not needed."""

import subprocess
import sys

import pytest

from warp_mpm.cli import main
from warp_mpm.verification import problems
from warp_mpm.verification.problem import Bound
from warp_mpm.verification.problems.taylor_rigid import RigidTaylor

COARSE = ["--levels", "1", "--device", "cpu", "--threads", "1"]


def test_list(capfd):
    assert main(["verify", "--list"]) == 0
    lines = capfd.readouterr().out.splitlines()
    assert len(lines) == len(problems.all_problems())
    assert any(line.startswith("taylor_planar ") and "free rear face" in line for line in lines)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["taylor_plane"], "verify: problem: expected any of"),
        (["taylor_plane"], "got 'taylor_plane'; did you mean taylor_planar"),
        (["--levels", "0"], "verify: levels: expected a whole number of at least 1, got 0"),
        (["--levels", "many"], "argument --levels: invalid int value: 'many'"),
        (["--solver", "shape=cubic"], "solver: shape: expected linear or gimp or bspline, got 'cubic'"),
        (["--threads", "0"], "threads: expected a whole number of at least 1, got 0"),
    ],
)
def test_a_mistake_is_one_clear_line(capfd, tmp_path, monkeypatch, words, message):
    monkeypatch.chdir(tmp_path)
    assert main(["verify", *words]) == 2
    output, errors = capfd.readouterr()
    assert (output, errors.count("\n")) == ("", 1)
    assert message in errors


def test_an_unknown_device_is_a_mistake(capfd, tmp_path):
    assert main(["verify", "taylor_rigid", "-o", str(tmp_path), "--levels", "1", "--device", "abacus"]) == 2
    assert "abacus" in capfd.readouterr().err


def test_a_real_problem_at_its_coarsest_level(capfd, tmp_path, monkeypatch):
    """The default directory, the table, the picture; at one level nothing but conservation is bounded."""
    monkeypatch.chdir(tmp_path)
    assert main(["verify", "taylor_rigid", *COARSE]) == 0
    output, errors = capfd.readouterr()
    assert errors == ""
    assert "plateau_scatter" in output
    assert "0.3164 p_CJ" in output
    assert sorted(path.name for path in (tmp_path / "out" / "verify").iterdir()) == ["taylor_rigid.png", "verify.json"]


def test_a_broken_bound_is_exit_code_one_and_one_line(capfd, tmp_path, monkeypatch):
    strict = RigidTaylor()
    strict.bounds = (Bound("pressure_l1", high=1e-6),)
    monkeypatch.setattr(problems, "all_problems", lambda: (strict,))
    assert main(["verify", "-o", str(tmp_path), *COARSE]) == 1
    output, errors = capfd.readouterr()
    assert "broken" in output
    assert errors.startswith("warp-mpm: verify: taylor_rigid: pressure_l1 at 25 cells: expected at most 1e-06, got")
    assert errors.count("\n") == 1


def test_matplotlib_is_imported_to_draw_only():
    code = "import sys, warp_mpm.verification.command; print('matplotlib' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    assert done.stdout == "False\n"
