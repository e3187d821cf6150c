"""Files that make no sense: scenes, materials, assignments; each is one line and exit code 2, and leaves nothing."""

import sys

import pytest

from warp_mpm.cli import main
from warp_mpm.errors import InputError
from warp_mpm.material_files import load_materials

BUILDER = """
from warp_mpm import *
def scene(*, size: float = 0.01, upper: float = 0.04, time: float = 1e-7, count: int = 2, name: str = "cube",
          density: float = 1.0, speed: tuple[float, float, float] = (0.0, 0.0, 0.0), wall: Wall = Wall.SLIP):
    builder = SceneBuilder(name)
    builder.domain((0, 0, 0), (upper, upper, upper), cell_size=size)
    builder.walls(Walls.all(wall))
    gas = Material("gas", density=density, equation_of_state=IdealGas(1.4), specific_energy=1e5)
    builder.charge(Box((0, 0, 0), (upper, upper, upper)), gas, particles_per_axis=count, velocity=speed)
    builder.end_time(time)
    return builder.build()
"""
SCENES = {
    "empty": b"",
    "zeros": bytes(100),
    "binary": bytes(range(256)) * 4,
    "no Unicode": 'x = "é"'.encode("latin-1"),
    "a picture": b"\x89PNG\r\n\x1a\n",
    "broken": b"def scene(:\n",
    "deep": b"x = " + 10_000 * b"(" + 10_000 * b")",
    "no scene": b"def scenes(): ...",
    "scene is no function": b"scene = 3",
    "scene is a class": b"class scene: ...",
    "returns nothing": b"def scene(): ...",
    "returns a text": b"def scene(): return 'scene'",
    "needs arguments": b"def scene(x): ...",
    "raises": b"def scene(): raise RuntimeError('no\\nscene\\ntoday')",
    "raises without a word": b"def scene(): raise KeyError",
    "raises at once": b"1 / 0",
    "exits": b"import sys\nsys.exit(0)",
    "exits in scene": b"def scene(): raise SystemExit(3)",
    "recurses": b"def scene(): return scene()",
    "imports what is not there": b"import warp_mpm.nothing",
    "generates": b"def scene():\n    yield 3",
    "odd annotation": b"def scene(*, x: 'no such type' = 3): ...",
    "asserts": b"def scene(): assert False",
}
SETTINGS = (
    "size=1e-12",
    "size=4e-6",  # 10^12 cells
    "size=1e-300",
    "size=1e300",
    "size=nan",
    "size=-0.01",
    "size=0",
    "size=1_0_",
    "size=0x10",
    "size=٣x",
    "size=",
    "size==1",
    "=1",
    "=",
    "",
    "upper=0",
    "upper=-1",
    "upper=1e400",
    "time=-1",
    "time=0",
    "time=inf",
    "count=0",
    "count=-2",
    "count=1000000",
    "count=1e3",
    "count=99999999999999999999",
    "name=",
    "name=../up",
    "name=a/b",
    "name=a b",
    "density=0",
    "density=-1",
    "speed=1,2",
    "speed=1,2,x",
    "speed=nan,0,0",
    "speed=1,2,3,4",
    "speed=()",
    "wall=glass",
    "wall=None",
    "nothing=1",
    "size size=1",
    "size\n=1",
)
MATERIALS = {
    "binary": bytes(range(256)),
    "no TOML": b"[tnt\ndensity = 1",
    "deep": b"x = " + 100_000 * b"[",
    "a number": b"tnt = 3",
    "empty table": b"[tnt]",
    "density is a text": b'[tnt]\ndensity = "1"\nequation_of_state = {law = "ideal_gas", gamma = 1.4}',
    "density is a list": b'[tnt]\ndensity = [1]\nequation_of_state = {law = "ideal_gas", gamma = 1.4}',
    "density is true": b'[tnt]\ndensity = true\nequation_of_state = {law = "ideal_gas", gamma = 1.4}',
    "density is nan": b'[tnt]\ndensity = nan\nequation_of_state = {law = "ideal_gas", gamma = 1.4}',
    "density is infinite": b'[tnt]\ndensity = inf\nequation_of_state = {law = "ideal_gas", gamma = 1.4}',
    "density is negative": b'[tnt]\ndensity = -1\nequation_of_state = {law = "ideal_gas", gamma = 1.4}',
    "density is a date": b'[tnt]\ndensity = 2015-02-15\nequation_of_state = {law = "ideal_gas", gamma = 1.4}',
    "density is huge": b"[tnt]\ndensity = 1" + 400 * b"0" + b'\nequation_of_state = {law = "ideal_gas", gamma = 1.4}',
    "no law": b"[tnt]\ndensity = 1.0",
    "law is a text": b'[tnt]\ndensity = 1.0\nequation_of_state = "ideal_gas"',
    "unknown law": b'[tnt]\ndensity = 1.0\nequation_of_state = {law = "jvl"}',
    "law is a number": b"[tnt]\ndensity = 1.0\nequation_of_state = {law = 3}",
    "law is a path": b'[tnt]\ndensity = 1.0\nequation_of_state = {law = "../../os"}',
    "law is a list": b"[tnt]\ndensity = 1.0\nequation_of_state = {law = []}",
    "parameter missing": b'[tnt]\ndensity = 1.0\nequation_of_state = {law = "ideal_gas"}',
    "parameter unknown": b'[tnt]\ndensity = 1.0\nequation_of_state = {law = "ideal_gas", gama = 2}',
    "parameter nan": b'[tnt]\ndensity = 1.0\nequation_of_state = {law = "ideal_gas", gamma = nan}',
    "parameter text": b'[tnt]\ndensity = 1.0\nequation_of_state = {law = "ideal_gas", gamma = "a"}',
    "burn unknown": b'[tnt]\ndensity = 1.0\ndetonation_speed = 1.0\nburn = "so"\n'
    b'equation_of_state = {law = "ideal_gas", gamma = 2}',
    "speed zero": b'[tnt]\ndensity = 1.0\ndetonation_speed = 0\nequation_of_state = {law = "ideal_gas", gamma = 2}',
}


@pytest.fixture
def refused(capfd, tmp_path, monkeypatch):
    """Runs a command in an empty directory; it must be refused in one line, and leave what was there."""

    def run(*arguments):
        monkeypatch.chdir(tmp_path)
        before = sorted(tmp_path.rglob("*"))
        assert main(list(arguments)) == 2
        output, error = capfd.readouterr()
        assert output == ""
        assert error.startswith("warp-mpm: ")
        assert error.count("\n") == 1
        assert "Traceback" not in error
        assert sorted(path for path in tmp_path.rglob("*") if path.suffix != ".pyc") == before

    return run


@pytest.fixture(autouse=True)
def _no_cache_beside_scenes(monkeypatch):
    monkeypatch.setattr(sys, "dont_write_bytecode", True)


@pytest.mark.parametrize("content", SCENES.values(), ids=SCENES)
def test_a_scene_file_that_is_none_is_one_line(refused, tmp_path, content):
    (tmp_path / "bad.py").write_bytes(content)
    refused("run", "bad.py", "-o", "out")


@pytest.mark.parametrize("setting", SETTINGS, ids=map(repr, SETTINGS))
def test_a_setting_that_makes_no_sense_is_one_line(refused, tmp_path, setting):
    (tmp_path / "cube.py").write_text(BUILDER)
    refused("run", "cube.py", "-o", "out", "--set", setting)


@pytest.mark.parametrize("content", MATERIALS.values(), ids=MATERIALS)
def test_a_file_of_materials_that_is_none_is_one_line(tmp_path, content):
    path = tmp_path / "bad.toml"
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"^[^\n]*bad\.toml[^\n]*$"):
        load_materials(path)


def test_paths_of_all_alphabets_work(capfd, tmp_path):
    """Scene file, directory and run directory, with spaces and quotes besides."""
    folder = tmp_path / 'Взрыв 爆発 it\'s "q" #1 %20 $HOME'
    folder.mkdir()
    (folder / "куб é.py").write_text(BUILDER)
    assert main(["run", str(folder / "куб é.py"), "-o", str(folder / "лог 1"), "--frames", "2"]) == 0
    assert main(["info", str(folder / "лог 1")]) == 0
    assert main(["list", str(folder)]) == 0
    assert "куб é" in capfd.readouterr().out
