"""Real clients: Blender imports a result whole, and in its pictures and Storm's the particles have their own colours.

They live in an environment of their own; without it the tests that need them are skipped, and say how to make it.
"""

import importlib
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from pxr import Usd

import warp_mpm as mpm
from warp_mpm.output import colormap, usd

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tools"))  # they are run by a program beside the package
colors = importlib.import_module("viewers.colors")
comparison = importlib.import_module("viewers.comparison")
environment = importlib.import_module("viewers.environment")

FRAMES = 4
COLLISION = 2  # the frame when the fronts have met: all colours of the map are in it
# Of the pixels that are drawn, and of the particles on the camera's side. What is missing is the detonators, which have
# a colour of their own, and particles that these or an edge hide.
ENOUGH = 0.9


@pytest.fixture(scope="module", params=["single", "clips"])
def result(request, tmp_path_factory):
    """The USD file of a tiny run, in each of its layouts."""
    try:
        environment.interpreter()
    except environment.MissingError as error:
        pytest.skip(str(error))
    output = tmp_path_factory.mktemp(request.param)
    scene = mpm.load_scene("two_point", cell_size=10e-3)
    with pytest.MonkeyPatch.context() as patched:
        if request.param == "clips":
            patched.setattr(usd, "MERGE_LIMIT", 0)
        mpm.simulate(scene, save=mpm.Save(frames=FRAMES, figures=False), output=output)
    return output / ("two_point.usda" if request.param == "clips" else "two_point.usdc")


@pytest.fixture(scope="module")
def imported(result, tmp_path_factory):
    """What Blender has at all frames, and its picture of the collision."""
    order = [frame for frame in range(FRAMES) if frame != COLLISION]
    path = tmp_path_factory.mktemp("blender") / "blender.png"
    return (*comparison.blender(result, [*order, COLLISION], path), path)


def test_blender_has_every_value_of_every_frame(result, imported):
    picture, values, _ = imported
    assert picture.report["frames"] == [0, FRAMES - 1]
    assert picture.report["frames_per_second"] == 24
    objects = picture.report["objects"]
    assert (objects["particles"], objects["section"], objects["camera"]) == ("POINTCLOUD", "MESH", "CAMERA")
    expected = comparison.expected_values(result, range(FRAMES))
    assert set(values) == set(expected)
    for name, array in expected.items():
        np.testing.assert_array_equal(values[name], array, err_msg=name)
    assert len({array.tobytes() for name, array in values.items() if name.endswith("particles/pressure")}) == FRAMES


def test_blender_shows_the_pressures(result, imported):
    picture, _, path = imported
    assert picture.share_in_map >= ENOUGH
    assert picture.share_of_particles >= ENOUGH
    check_that_it_can_fail(result, path)


def test_storm_shows_the_pressures(result, tmp_path):
    path = tmp_path / "storm.png"
    try:
        picture = comparison.storm(result, COLLISION, path)
    except environment.MissingError as error:
        pytest.skip(str(error))
    assert picture.share_in_map >= ENOUGH
    assert picture.share_of_particles >= ENOUGH
    check_that_it_can_fail(result, path)


def check_that_it_can_fail(result, path):
    """Another frame's particles have other colours, and so has a picture whose red and blue are exchanged."""
    drawn = colors.pixels(path)
    stage = Usd.Stage.Open(str(result))
    others = [colors.share_of_true_particles(drawn, stage, frame) for frame in range(FRAMES) if frame != COLLISION]
    assert max(others) < 0.5
    assert colors.share_in_map(drawn[..., [2, 1, 0, 3]]) < 0.5


def test_colours_of_the_map_are_told_from_others():
    """A mixture of two neighbours in the map is one of its colours, grey is not; pixels drawn in part do not count."""
    table = np.round(255.0 * colormap.srgb_table()).astype(np.int16)
    between = (table[:-1] + table[1:]) // 2
    grey = np.full((511, 3), 128, dtype=np.int16)
    opaque = np.full((2 * 511, 1), 255, dtype=np.int16)
    picture = np.column_stack([np.concatenate([table, between, grey]), opaque])[None]
    assert colors.share_in_map(picture) == 0.5
    picture[0, 511:, 3] = 254
    assert colors.share_in_map(picture) == 1.0


@pytest.fixture
def own_client(tmp_path, monkeypatch):
    """Makes a client of some lines of Python, which is run by this interpreter."""
    monkeypatch.setattr(environment, "INTERPRETER", Path(sys.executable))
    monkeypatch.setattr(environment, "CLIENTS", tmp_path)

    def make(code):
        (tmp_path / "client.py").write_text(code)

    return make


def test_what_a_client_says_is_understood(own_client):
    own_client("import json, sys\nprint('noise')\nprint(json.dumps(sys.argv[1:]))")
    assert environment.run_client("client", "--frame", 3) == ["--frame", "3"]
    own_client(f"import sys\nprint('no OpenGL', file=sys.stderr)\nsys.exit({environment.MISSING})")
    with pytest.raises(environment.MissingError, match=r"^client: no OpenGL$"):
        environment.run_client("client")
    own_client("1 / 0")
    with pytest.raises(RuntimeError, match=r"exit code 1\n(.*\n)*ZeroDivisionError"):
        environment.run_client("client")


def test_without_the_wheel_nothing_is_left_and_the_reason_is_said(tmp_path, monkeypatch):
    monkeypatch.setattr(environment, "ENVIRONMENT", tmp_path / "viewers")
    monkeypatch.setattr(environment, "INTERPRETER", tmp_path / "viewers" / "python")
    with pytest.raises(environment.MissingError, match=r"^no viewers with Blender; make it by: python tools/view.py"):
        environment.interpreter()
    monkeypatch.setattr(environment, "PYTHON", (3, 99))
    with pytest.raises(environment.MissingError, match=r"needs Python 3\.99, and there is no python3\.99 on the path$"):
        environment.install()
    monkeypatch.setattr(environment, "PYTHON", sys.version_info[:2])

    def fail(*command):
        (tmp_path / "viewers").mkdir(exist_ok=True)
        if "pip" in command:
            raise subprocess.CalledProcessError(1, command, "", "ERROR: one\nERROR: No matching distribution found\n")

    monkeypatch.setattr(environment, "_quietly", fail)
    with pytest.raises(environment.MissingError, match=r"does not install: ERROR: No matching distribution found$"):
        environment.install()
    assert not any(tmp_path.iterdir())
