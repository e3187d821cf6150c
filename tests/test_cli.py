"""The command line: listing, running, and one clear line for every mistake of a user."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

import warp_mpm
from warp_mpm.cli import main

COARSE = ["cell_size=2e-2", "end_time=2e-6"]


def mistake(capfd, *arguments):
    """The line on standard error with which `warp-mpm arguments` refuses a mistake of the user."""
    assert main(arguments) == 2
    output, errors = capfd.readouterr()
    assert output == ""
    assert errors.startswith("warp-mpm: ")
    assert errors.count("\n") == 1
    return errors


def python(*arguments, **environment):
    """Run Python in a process of its own."""
    return subprocess.run(
        [sys.executable, *arguments],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
        env={**os.environ, **environment},
    )


def test_list(capfd):
    assert main(["list"]) == 0
    lines = capfd.readouterr().out.splitlines()
    names = [line.split()[0] for line in lines]
    assert {"six_point", "taylor_wave", "two_point"} <= set(names)
    assert all(len(line.split()) > 3 for line in lines)


def test_list_of_a_directory(capfd, tmp_path):
    (tmp_path / "mine.py").write_text('"""My scene."""')
    assert main(["list", str(tmp_path)]) == 0
    assert capfd.readouterr().out == "mine  My scene.\n"


def test_help_and_version(capfd):
    for arguments in (["--help"], ["run", "--help"], ["--version"]):
        with pytest.raises(SystemExit) as caught:
            main(arguments)
        assert caught.value.code == 0
    assert f"warp-mpm {warp_mpm.__version__}" in capfd.readouterr().out


RUN = ("run", "two_point", "--set")

MISTAKES = [
    ((), "required: COMMAND"),
    (("simulate",), "invalid choice: 'simulate'"),
    (("run",), "required: SCENE"),
    (("run", "two_point", "--bogus"), "unrecognized arguments: --bogus"),
    (("list", "nowhere"), "expected a directory of scene files, got 'nowhere'"),
    (("info", "nowhere"), "expected a run directory or a USD file, got 'nowhere'"),
    (("export", "nowhere"), "the following arguments are required: --to"),
    (("export", "nowhere", "--to", "x.pvd"), "export: expected a run directory or a USD file, got 'nowhere'"),
    (("export", ".", "--to", "x.obj"), "export: --to: expected a file that ends in .pvd or .glb, or a directory"),
    (("figures", "nowhere"), "load: expected a run directory or a USD file, got 'nowhere'"),
    (("figures", "."), "which has neither"),
    (("figures", ".", "--animate", "avi"), "argument --animate: invalid choice: 'avi'"),
    (("run", "two_pont"), "expected a scene file, or one of"),
    (("run", "nowhere/two_point.py"), "got 'nowhere/two_point.py'"),
    ((*RUN, "cel_size=1"), "scene two_point: expected one of cell_size"),
    ((*RUN, "cell_size"), "scene two_point: expected name=value, got 'cell_size'"),
    ((*RUN, "cell_size=small"), "scene two_point: cell_size: expected a finite number, got 'small'"),
    ((*RUN, "cell_size=nan"), "scene two_point: cell_size: expected a finite number, got 'nan'"),
    ((*RUN, "end_time=inf"), "scene two_point: end_time: expected a finite number, got 'inf'"),
    ((*RUN, "cell_size=0"), "cell_size: expected a positive number, got 0.0"),
    ((*RUN, "cell_size=-1"), "cell_size: expected a positive number, got -1.0"),
    ((*RUN, "end_time=0"), "end_time: expected a positive number, got 0.0"),
    ((*RUN, "cell_size=0.1"), "charge 'plate': expected at least one particle across"),
    ((*RUN, "particles_per_axis=1.5"), "particles_per_axis: expected a whole number, got '1.5'"),
    ((*RUN, "particles_per_axis=0"), "particles_per_axis: expected a whole number of at least 1, got 0"),
    ((*RUN, "particles_per_axis=1000"), "choose a larger cell size or fewer particles per axis"),
    ((*RUN, "confinement=loose"), "scene two_point: confinement: expected rigid or free, got 'loose'"),
    ((*RUN, "energy=3.8e6"), "on_mismatch=keep"),
    ((*RUN, "energy=-1"), "energy: expected a positive finite number"),
    (("run", "two_point", "--solver", "shape=cubic"), "solver: shape: expected linear or gimp or bspline, got 'cubic'"),
    (("run", "two_point", "--solver", "shpe=linear"), "got 'shpe'; did you mean shape?"),
    (("run", "two_point", "--solver", "cfl=0"), "solver: cfl: expected"),
    (("run", "two_point", "--solver", "viscosity=1.5"), "solver: viscosity: expected 2 values"),
    (("run", "two_point", "--solver", "order=usf"), "solver: order: expected musl with transfer=damped_flip"),
    (("run", "two_point", "--frames", "1"), "save: frames: expected at least 2"),
    (("run", "two_point", "--checkpoint-steps", "0"), "save: checkpoint_steps: expected a whole number of at least 1"),
    (
        ("run", "two_point", "--checkpoint-minutes", "nan"),
        "save: checkpoint_minutes: expected a positive number, got nan",
    ),
    (("run", "two_point", "--resume", "--set", *COARSE), "resume: expected a checkpoint to go on from, got none in"),
    (("run", "two_point", "--frames", "many"), "argument --frames: invalid int value: 'many'"),
    (("run", "two_point", "--layout", "split"), "argument --layout: invalid choice: 'split'"),
    (("run", "two_point", "--particles-every", "0"), "save: particles_every: expected a whole number of at least 1"),
    (("run", "two_point", "--isosurface", "0"), "save: isosurface: expected a positive number, got 0.0"),
    (("run", "two_point", "--isosurface", "nan"), "save: isosurface: expected a positive number, got nan"),
    (("run", "two_point", "--fields", "density", "hue"), "save: fields: expected any of density, burn_fraction"),
    (("run", "two_point", "--threads", "0"), "threads: expected a whole number of at least 1, got 0"),
    (("run", "row_of_charges", "--set", "cell_size=1e-2", "resists=false"), "expected explosive that resists"),
    (("run", "two_point", "--device", "abacus", "--set", *COARSE), "abacus"),
]


@pytest.mark.parametrize(("arguments", "message"), MISTAKES, ids=[" ".join(words) for words, _ in MISTAKES])
def test_a_mistake_is_one_clear_line(capfd, tmp_path, monkeypatch, arguments, message):
    monkeypatch.chdir(tmp_path)
    assert message in mistake(capfd, *arguments)


CUBE_SCENE = """
from warp_mpm import *

def scene(*, gamma: float = 2.0, density: float = 1000.0, speed: float = 2800.0, detonator: float = 0.05,
          upper: float = 0.1, lit: bool = True, slit: bool = False):
    builder = SceneBuilder("cube")
    builder.domain((0, 0, 0), (0.1, 0.1, 0.1), cell_size=0.02)
    material = explosive("it", density=density, detonation_speed=speed, equation_of_state=IdealGas(gamma))
    solid = Box((0, 0, 0), (upper, 0.1, 0.1))
    builder.charge(solid - Box((0.06, 0, 0), (0.08, 0.1, 0.1)) if slit else solid, material)
    if lit:
        builder.detonator(PointDetonator((detonator, 0.05, 0.05)))
    builder.end_time(1e-6)
    return builder.build()
"""


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("gamma=1", "gamma"),
        ("density=0", "density: expected a positive finite number"),
        ("speed=-2800", "detonation_speed: expected a positive finite number"),
        ("lit=no", "charge 'charge_1': expected a detonator that lights this explosive, got none"),
        ("detonator=0.2", "detonator 1: expected a position in an explosive charge"),
        ("upper=0.2", "charge 'charge_1': expected inside the domain, x from 0 to 0.1 m, got x from 0 to 0.2 m"),
    ],
)
def test_a_mistake_in_a_scene_is_one_clear_line(capfd, tmp_path, setting, message):
    file = tmp_path / "cube.py"
    file.write_text(CUBE_SCENE)
    line = mistake(capfd, "run", str(file), "--set", setting)
    assert line.startswith("warp-mpm: scene cube: ")
    assert message in line


def test_explosive_that_no_wave_reaches_is_one_clear_line(capfd, tmp_path):
    file = tmp_path / "cube.py"
    file.write_text(CUBE_SCENE)
    assert main(["run", str(file), "-o", str(tmp_path / "out"), "--set", "slit=yes"]) == 2
    errors = capfd.readouterr().err
    assert errors.startswith(
        "warp-mpm: scene cube: charge 'charge_1': expected a detonation wave that comes to all of it"
    )
    assert errors.count("\n") == 1


def test_an_output_directory_that_cannot_be_written(capfd, tmp_path):
    (tmp_path / "file").write_text("in the way")
    line = mistake(capfd, "run", "two_point", "-o", str(tmp_path / "file" / "out"), "--set", *COARSE)
    assert str(tmp_path / "file") in line


def test_debug_shows_the_traceback(capfd):
    assert main(["run", "nowhere", "--debug"]) == 2
    errors = capfd.readouterr().err
    assert "Traceback" in errors
    assert errors.splitlines()[-1].startswith("warp-mpm: scene: expected")


@pytest.mark.parametrize(
    ("raised", "exit_code", "text"),
    [
        (KeyboardInterrupt(), 130, "interrupted"),
        (warp_mpm.SimulationError("step 3: negative volume"), 1, "step 3: negative volume"),
        (OSError(28, "No space left on device"), 1, "No space left on device"),
        (ZeroDivisionError("float division"), 1, "ZeroDivisionError: float division; this is a fault of warp_mpm"),
    ],
)
def test_other_ends_are_one_line_too(capfd, monkeypatch, raised, exit_code, text):
    def fail(*_, **__):
        raise raised

    monkeypatch.setattr("warp_mpm.simulation.simulate", fail)
    assert main(["run", "two_point", "--set", *COARSE]) == exit_code
    errors = capfd.readouterr().err
    assert text in errors
    assert errors.count("\n") == 1


def test_run_then_info_figures_and_export(capfd, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["run", "two_point", "--set", *COARSE, "--frames", "2", "--solver", "burn_width=2"]) == 0
    output, errors = capfd.readouterr()
    assert errors == ""
    assert os.path.join("out", "two_point") in output
    summary = json.loads((tmp_path / "out" / "two_point" / "summary.json").read_text())
    assert summary["parameters"]["cell_size"] == 2e-2
    assert main(["info", os.path.join("out", "two_point")]) == 0
    assert "two_point" in capfd.readouterr().out
    assert main(["export", os.path.join("out", "two_point"), "--to", "paraview"]) == 0
    assert capfd.readouterr().out == os.path.join("paraview", "two_point.pvd") + "\n"
    assert main(["export", os.path.join("out", "two_point"), "--frame", "1", "--to", "two_point.glb"]) == 0
    assert capfd.readouterr().out == "two_point.glb\n"
    assert Path("two_point.glb").read_bytes()[:4] == b"glTF"
    assert main(["figures", os.path.join("out", "two_point"), "energy", "gauges", "-o", "again"]) == 0
    assert capfd.readouterr().out == "energy.png, gauges.png in again\n"
    assert "got 'x'" in mistake(capfd, "figures", os.path.join("out", "two_point"), "x")


def test_what_the_usd_file_holds_can_be_chosen(capfd, tmp_path):
    layout = ["--layout", "clips", "--usdz", "--particles-every", "3"]
    contents = ["--fields", "density", "arrival_time", "--isosurface", "1e9", "--no-figures"]
    assert main(["run", "two_point", "--set", *COARSE, "--frames", "2", "-o", str(tmp_path), *layout, *contents]) == 0
    assert main(["info", str(tmp_path / "two_point.usda")]) == 0
    text = capfd.readouterr().out
    for words in ("density", "arrival_time", "/World/isosurface", "particlesEvery: 3"):
        assert words in text
    assert (tmp_path / "two_point.usdz").exists()
    assert not (tmp_path / "figures").exists()


def test_importing_the_package_is_light():
    heavy = ("warp", "pxr", "matplotlib", "pyvista", "vtk", "meshio", "rich")
    code = f"import sys, warp_mpm, warp_mpm.cli; print([name for name in {heavy} if name in sys.modules])"
    assert python("-c", code).stdout == "[]\n"


def test_the_api_needs_no_pictures_and_no_usd():
    code = (
        "import sys, warp_mpm as mpm; [getattr(mpm, name) for name in mpm.__all__];"
        "print([name for name in ('pxr', 'matplotlib', 'pyvista') if name in sys.modules])"
    )
    assert python("-c", code).stdout == "[]\n"


def test_every_public_name_is_there():
    for name in warp_mpm.__all__:
        assert getattr(warp_mpm, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'nonsense'"):
        warp_mpm.__getattr__("nonsense")


def test_in_a_process_of_its_own():
    listing = python("-m", "warp_mpm", "list")
    assert (listing.returncode, listing.stderr) == (0, "")
    assert "two_point" in listing.stdout
    wrong = python("-m", "warp_mpm", "run", "two_point", "--set", "energy=3.8e6")
    assert (wrong.returncode, wrong.stdout, wrong.stderr.count("\n")) == (2, "", 1)
