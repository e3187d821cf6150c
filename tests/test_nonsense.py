"""Commands, paths and files that make no sense are refused in one line."""

import itertools
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as some

from warp_mpm.cli import main
from warp_mpm.config import Save
from warp_mpm.kernels.precision import PRECISION
from warp_mpm.scene_loading import load_scene
from warp_mpm.simulation import simulate

words = some.one_of(
    some.text(max_size=12), some.sampled_from(("nan", "inf", "-1", "0", "1e999", "é", "../..", "=", "a=b=c"))
)
names = some.sampled_from(("cell_size", "end_time", "confinement", "particles_per_axis", "energy", "cfl", "shape", "x"))
options = some.sampled_from(
    ("--set", "--solver", "--frames", "--threads", "--device", "--layout", "--isosurface", "--fields")
)


@given(some.lists(some.tuples(options, some.booleans(), names, words), min_size=1, max_size=3))
def test_a_command_that_makes_no_sense_is_one_line(tmp_path_factory, given):
    """Whatever follows an option: one line and exit code 2; nothing in it names a scene that exists."""
    arguments = ["run", "no such scene"]
    for option, assigned, name, word in given:
        arguments += [option, f"{name}={word}" if assigned else word.replace("-h", "")]
    assert main(arguments) == 2


CUBE = """
from warp_mpm import *

def scene(*, cell_size: float = 0.02, end_time: float = 1e-7, confinement: str = "", particles_per_axis: int = 1):
    builder = SceneBuilder("cube")
    builder.domain((0, 0, 0), (0.04, 0.04, 0.04), cell_size=cell_size)
    gas = Material("gas", density=1.0, equation_of_state=IdealGas(1.4), specific_energy=1e5)
    builder.charge(Box((0, 0, 0), (0.04, 0.04, 0.04)), gas, particles_per_axis=particles_per_axis)
    builder.end_time(end_time)
    return builder.build()
"""
values = some.sampled_from(("0.02", "1", "2", "3", "1e-8", "cpu", "density", "linear", "usf", "flip", "true")) | words
settings_given = some.builds("{}={}".format, names, values) | values
parts = some.one_of(
    some.tuples(some.sampled_from(("--set", "--solver")), settings_given),
    some.tuples(options, values),
    some.tuples(some.sampled_from(("--resume", "--usdz", "--list", "--full", "--help", "--version", "--debug", "--"))),
    some.tuples(
        some.sampled_from(("--particles-every", "--checkpoint-steps", "--checkpoint-minutes", "--frame")), values
    ),
    some.tuples(some.sampled_from(("-o", "--to", "--frame", "--animate", "--precision", "--levels")), values),
    some.tuples(values),
)
starts = some.sampled_from(
    (
        ("run", "cube.py"),
        ("run", "cube.py"),
        ("run",),
        ("list",),
        ("materials",),
        ("info", "out"),
        ("figures", "out", "section"),
        ("export", "out"),
        ("verify", "nothing"),
        (),
    )
)


@given(start=starts, more=some.lists(parts, max_size=4))
def test_random_arguments_work_or_are_refused(tmp_path_factory, capfd, start, more):
    """With exit code 0, or in one line with exit code 2: never a traceback."""
    with pytest.MonkeyPatch.context() as patch:
        directory = tmp_path_factory.mktemp("arguments") / "below" / "below"  # -o ../.. is no nonsense
        directory.mkdir(parents=True)
        patch.chdir(directory)
        patch.setenv("WARP_MPM_PRECISION", PRECISION)
        Path("cube.py").write_text(CUBE)
        arguments = [*start, *itertools.chain(*more)]
        try:
            code = main(arguments)
        except SystemExit as end:  # of --help and --version
            code = end.code
        error = capfd.readouterr().err
    assert code in (0, 2), arguments
    if code == 2 and "--debug" not in arguments:
        assert error.startswith("warp-mpm: ")
        assert error.count("\n") == 1


COARSE = ("--set", "cell_size=2e-2", "end_time=2e-6", "--frames", "2")
PATHS = {
    "a scene that is a loop of links": ("run", "loop"),
    "a scene that is a directory": ("run", "."),
    "an output that is a loop of links": ("run", "two_point", *COARSE, "-o", "loop"),
    "an output below a loop of links": ("run", "two_point", *COARSE, "-o", "loop/out"),
    "an output that is a device": ("run", "two_point", *COARSE, "-o", "/dev/null"),
    "an output of no name": ("run", "two_point", *COARSE, "-o", "\0"),
    "an output of a very long name": ("run", "two_point", *COARSE, "-o", 300 * "x"),
    "nothing to go on from": ("run", "two_point", *COARSE, "-o", "new", "--resume"),
    "a list of a loop": ("list", "loop"),
    "info on a loop": ("info", "loop"),
    "figures of a loop": ("figures", "loop"),
    "an export of a loop": ("export", "loop", "--to", "x.pvd"),
}


@pytest.mark.parametrize("arguments", PATHS.values(), ids=PATHS)
def test_a_path_that_leads_nowhere_is_one_line(capfd, tmp_path, monkeypatch, arguments):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "loop").symlink_to("loop")
    assert main(arguments) == 2
    output, error = capfd.readouterr()
    assert output == ""
    assert error.startswith("warp-mpm: ")
    assert error.count("\n") == 1


GARBAGE = {"nothing": b"", "text": b"Guten Tag", "bytes": bytes(range(256)), "JSON": b"[1, 2]", "half": None}
FILES = ("summary.json", "history.csv", "gauges.csv", "steps.npz", "two_point.usdc")


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """The directory of a run, with spaces and letters of many alphabets in its name."""
    directory = tmp_path_factory.mktemp("ein Lauf, один пробег, 一次运行")
    simulate(
        load_scene("two_point", cell_size=2e-2, end_time=2e-6), save=Save(frames=2, figures=False), output=directory
    )
    return directory


@pytest.mark.parametrize("file", FILES)
@pytest.mark.parametrize("garbage", GARBAGE)
def test_a_damaged_file_is_one_line(capfd, results, tmp_path, file, garbage):
    """Or it is left out; what is whole is shown all the same."""
    for part in results.iterdir():
        (tmp_path / part.name).write_bytes(part.read_bytes())
    content = GARBAGE[garbage]
    whole = (tmp_path / file).read_bytes()
    (tmp_path / file).write_bytes(whole[: len(whole) // 2] if content is None else content)
    before = sorted(tmp_path.iterdir())
    for command in (["info"], ["figures", "-o", str(tmp_path / "pictures")], ["export", "--to", str(tmp_path / "vtk")]):
        code = main([command[0], str(tmp_path), *command[1:]])
        error = capfd.readouterr().err
        assert code in (0, 2), error
        assert error.count("\n") == (1 if code else 0)
    assert set(tmp_path.iterdir()) - set(before) <= {tmp_path / "pictures", tmp_path / "vtk"}
