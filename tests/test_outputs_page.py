"""docs/outputs.md keeps its word: it names every file, every key and every column that a run leaves."""

import csv
import json
import re
from pathlib import Path

import numpy as np
import pytest

from warp_mpm.config import Save
from warp_mpm.output.figures import PICTURES
from warp_mpm.scene import FACE_NAMES
from warp_mpm.scene_loading import load_scene
from warp_mpm.simulation import simulate

PAGE = (Path(__file__).resolve().parents[1] / "docs" / "outputs.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """The directory of a short run."""
    directory = tmp_path_factory.mktemp("run")
    simulate(load_scene("two_point", cell_size=2e-2, end_time=2e-6), save=Save(frames=2), output=directory)
    return directory


def named(section):
    """Everything in backquotes in a section of the page, short forms such as `..._y_m` among it."""
    (text,) = re.findall(rf"^## {section}\n(.*?)(?=^## |\Z)", PAGE, flags=re.MULTILINE | re.DOTALL)
    return set(re.findall(r"`([^`\n]+)`", text))


def header(path):
    with path.open(newline="") as file:
        return next(csv.reader(file))


def unexplained(columns, section, pattern, mark):
    """Columns that a section does not name, in full or by their end; what matches `pattern` is called `mark` there."""
    words = named(section)
    ends = tuple(word.removeprefix("...") for word in words if word.startswith("..."))
    general = {re.sub(pattern, mark, column) for column in columns}
    return sorted(name for name in general if name not in words and not name.endswith(ends))


def test_every_file(run):
    files = {file.relative_to(run).as_posix() for file in run.rglob("*") if file.is_file()}
    known = {"two_point.usdc" if name == "<scene>.usdc" else name for name in named("What a run leaves")}
    assert [file for file in sorted(files) if file not in known and not file.startswith("figures/")] == []


def test_every_key_of_the_summary(run):
    summary = json.loads((run / "summary.json").read_text(encoding="utf-8"))
    keys = {*summary, *summary["charges"][0], *next(iter(summary["gauges"].values()))}
    assert sorted(keys - named(r"summary\.json")) == []


def test_every_key_of_the_setup(run):
    summary = json.loads((run / "summary.json").read_text(encoding="utf-8"))
    assert sorted(set(summary["setup"]) - {"description"} - named(r"summary\.json")) == []


def test_every_array_of_every_step(run):
    with np.load(run / "steps.npz") as steps:
        assert sorted(set(steps.files) - named(r"steps\.npz")) == []


def test_every_picture(run):
    assert sorted({file.name for file in (run / "figures").iterdir()} ^ {f"{name}.png" for name in PICTURES}) == []
    assert sorted({f"{name}.png" for name in PICTURES} - named("Pictures")) == []


def test_every_column(run):
    faces = rf"(?<=_)({'|'.join(FACE_NAMES)})(?=_)"
    assert unexplained(header(run / "history.csv"), r"history\.csv", faces, "<face>") == []
    gauges = r"^(quarter_moving|quarter|collision|side|corner)(?=_)"
    assert unexplained(header(run / "gauges.csv"), r"gauges\.csv", gauges, "<name>") == []
