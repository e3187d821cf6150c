"""Real clients: Blender imports a result whole, and in its pictures and Storm's the particles have their own colours.

They live in an environment of their own; without it these tests are skipped, and say how to make it.
"""

import importlib
import sys
from pathlib import Path

import numpy as np
import pytest
from pxr import Usd

import warp_mpm as mpm
from warp_mpm.output import usd

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
