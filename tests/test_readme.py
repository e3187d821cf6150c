"""The README keeps its word: its commands are those that CI runs, its script runs, its links lead somewhere."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from warp_mpm.cli import main
from warp_mpm.material_files import load_materials

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language):
    return re.findall(rf"^```{language}\n(.*?)^```", README, flags=re.MULTILINE | re.DOTALL)


def test_two_commands_set_up_everything():
    first, second = blocks("bash")
    assert README.index(first) < README.index(second) < README.index("\n## ")
    assert first.count("\n") == second.count("\n") == 1
    assert first.endswith(" && .venv/bin/warp-mpm run two_point -o out/two_point\n")
    assert second in (ROOT / ".ci" / "run").read_text(encoding="utf-8")


def test_the_script_runs_and_its_results_are_read(tmp_path):
    script, reading, _ = blocks("python")
    (tmp_path / "script.py").write_text(script + reading, encoding="utf-8")
    ended = subprocess.run(
        [sys.executable, "script.py"], cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False
    )
    assert (ended.returncode, ended.stderr) == (0, "")
    printed = r"p_CJ 19\.6 GPa, peak 1\d\.\d GPa\n\d+\.\d us: \d+\.\d GPa in \d+ particles\n"
    assert re.fullmatch(printed, ended.stdout)
    assert (tmp_path / "out" / "ball" / "ball.usdc").exists()


def test_the_scene_runs_with_another_parameter(tmp_path, monkeypatch, capsys):
    *_, scene = blocks("python")
    (tmp_path / "my_scene.py").write_text(scene, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    words = ["run", "my_scene.py", "--set", "cell_size=2e-2", "--frames", "3", "-o", "out"]
    assert main(words) == 0
    printed = capsys.readouterr().out
    assert "in_the_water" in printed
    assert "2.0 cells across" in printed


def test_the_materials_are_read(tmp_path):
    (tables,) = blocks("toml")
    (tmp_path / "materials.toml").write_text(tables, encoding="utf-8")
    materials = load_materials(tmp_path / "materials.toml")
    assert list(materials) == ["my_tnt", "brine"]
    assert materials["my_tnt"].cj.pressure == pytest.approx(21e9, rel=0.01)
    assert materials["brine"].burn is None


def test_links_lead_somewhere():
    targets = re.findall(r"\]\((?!https?:|#)([^)]+)\)", README)
    assert "docs/pictures/two_point.png" in targets
    assert [target for target in targets if not (ROOT / target).exists()] == []


def test_headings_that_are_linked_exist():
    headings = {heading.lower().replace(" ", "-") for heading in re.findall(r"^#+ (.*)$", README, flags=re.MULTILINE)}
    anchors = re.findall(r"\]\(#([^)]+)\)", README)
    assert set(anchors) <= headings
