"""docs/studies.md keeps its word: its program runs, repeats no run that is there, and goes on with one that stopped."""

import csv
import re
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

import warp_mpm as mpm

ROOT = Path(__file__).resolve().parents[1]
PAGE = (ROOT / "docs" / "studies.md").read_text(encoding="utf-8")
(PROGRAM,) = re.findall(r"^```python\n(.*?)^```", PAGE, flags=re.MULTILINE | re.DOTALL)
LAYERS = (0.01, 0.015, 0.02, 0.025, 0.03)


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """The directory in which the program has run on coarse cells."""
    directory = tmp_path_factory.mktemp("study")
    assert PROGRAM.count("CELL = 1e-3 ") == 1
    (directory / "study.py").write_text(PROGRAM.replace("CELL = 1e-3 ", "CELL = 3e-3 "), encoding="utf-8")
    ended = subprocess.run(
        [sys.executable, "study.py"], cwd=directory, capture_output=True, text=True, timeout=300, check=False
    )
    assert (ended.returncode, ended.stderr) == (0, "")
    return directory


@pytest.fixture
def program(study, monkeypatch):
    """The functions of the program, where it has run."""
    monkeypatch.chdir(study)
    return runpy.run_path("study.py")


def test_its_program_makes_a_table(study):
    """The plate is slower than in the end, but not by much; the angle is that of a plate bent by 2 sin(angle / 2)."""
    with (study / "study.csv").open(newline="") as file:
        rows = [{name: float(value) for name, value in row.items()} for row in csv.DictReader(file)]
    assert [row["layer_m"] for row in rows] == list(LAYERS)
    speeds = [row["speed_m_s"] for row in rows]
    assert speeds == sorted(speeds)
    for row in rows:
        assert 0.75 < row["speed_m_s"] / row["gurney_m_s"] < 1.0


def test_its_numbers_are_those_of_gurneys_model(program):
    (line,) = re.findall(r"^\| final speed of Gurney's model, m/s \| (.*) \|$", PAGE, flags=re.MULTILINE)
    assert [float(cell) for cell in line.split(" | ")] == [round(program["gurney"](layer)) for layer in LAYERS]


def test_a_run_that_is_there_is_not_repeated(program, monkeypatch):
    monkeypatch.setattr(mpm, "simulate", None, raising=False)
    assert program["row"](0.02)["layer_m"] == 0.02


@pytest.mark.parametrize("checkpoint", [True, False])
def test_a_run_that_was_stopped_goes_on(program, study, monkeypatch, checkpoint):
    """Killed before its first checkpoint it begins anew."""
    directory = study / "out" / "flyer" / "10_mm"
    whole = (directory / "summary.json").read_text()
    (directory / "summary.json").write_text(whole.replace('"complete"', '"running"'))
    mark = directory / "checkpoint_00000007.npz"
    if checkpoint:
        mark.write_bytes(b"")
    asked = []
    monkeypatch.setattr(mpm, "simulate", lambda *_, resume, **__: asked.append(resume), raising=False)
    program["row"](0.01)
    assert asked == [checkpoint]
    mark.unlink(missing_ok=True)
    (directory / "summary.json").write_text(whole)
