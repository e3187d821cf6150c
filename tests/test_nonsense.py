"""Whatever scene a person describes, it is either refused in one line, or runs with its mass and energy kept."""

import math

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as some
from scenes_for_tests import ROUND_OFF, audited, inert_gas, start

from warp_mpm.builder import SceneBuilder
from warp_mpm.cli import main
from warp_mpm.config import Save
from warp_mpm.detonators import PlaneDetonator, PointDetonator
from warp_mpm.geometry import Box, Cylinder, Sphere
from warp_mpm.kernels.eos.ideal_gas import IdealGas
from warp_mpm.materials import ammonium_nitrate, explosive
from warp_mpm.scene import Wall, Walls
from warp_mpm.scene_loading import load_scene
from warp_mpm.simulation import simulate

LENGTH = 0.1  # edge of the domain [m]
CELLS = 8  # along it
NONSENSE = (0.0, -1.0, math.nan, math.inf, -math.inf, 1e300, 1e-300, "much", None, True, (), [1.0])
NUMBERS = NONSENSE[:7]
FEW = settings(max_examples=100, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))


def seldom(usual, nonsense=NONSENSE):
    """Mostly what makes sense, once in fifty times something that does not."""
    return some.integers(0, 49).flatmap(lambda n: some.sampled_from(nonsense) if n == 7 else usual)


def place(low, high):
    """A point whose coordinates lie between two lengths."""
    return seldom(some.tuples(*3 * [some.floats(low * LENGTH, high * LENGTH)]))


MIDDLE = place(0.45, 0.5)
lengths = seldom(some.floats(0.1 * LENGTH, 0.5 * LENGTH))
solids = some.one_of(
    some.builds(Box, place(0.0, 0.4), place(0.6, 1.0)),
    some.builds(Sphere, MIDDLE, lengths),
    some.builds(Cylinder, place(0.2, 0.4), place(0.6, 0.8), lengths),
)
walls = some.builds(Walls, *6 * [some.sampled_from(Wall)])
times = seldom(some.floats(0.0, 1e-5))
detonators = seldom(
    some.one_of(
        some.builds(PointDetonator, MIDDLE, times), some.builds(PlaneDetonator, MIDDLE, place(0.1, 1.0), times)
    ),
    ("here", None),
)
gases = some.builds(inert_gas, seldom(some.floats(0.1, 8000.0)), seldom(some.floats(1e2, 1e7)))
explosives = some.one_of(
    some.builds(ammonium_nitrate),
    some.builds(
        lambda density, speed, gamma: explosive(
            "it", density=density, detonation_speed=speed, equation_of_state=IdealGas(gamma)
        ),
        seldom(some.floats(500.0, 2000.0)),
        seldom(some.floats(1000.0, 9000.0)),
        seldom(some.floats(1.2, 4.0), NUMBERS),
    ),
)


def built(data):
    """The scene of a person who tries this and that, or None if it was refused in one line."""
    draw = data.draw
    try:
        builder = SceneBuilder("it")
        upper = draw(seldom(some.just((LENGTH, LENGTH, LENGTH))))
        builder.domain(
            (0.0, 0.0, 0.0), upper, cells=draw(seldom(some.just((CELLS, CELLS, CELLS)), (0, 10**6, 1.5, "8")))
        )
        builder.walls(draw(walls))
        burns = draw(some.booleans())
        for _ in range(draw(some.sampled_from((1, 1, 1, 2)))):
            velocity = draw(seldom(some.one_of(some.none(), some.tuples(*3 * [some.floats(-2000.0, 2000.0)]))))
            per_axis = draw(seldom(some.sampled_from((1, 2, 3))))
            material = draw(explosives if burns else gases)
            builder.charge(draw(solids), material, particles_per_axis=per_axis, velocity=velocity)
        for _ in range(draw(some.integers(1, 2)) if burns else draw(some.sampled_from((0, 0, 0, 1)))):
            builder.detonator(draw(detonators))
        builder.gravity(draw(seldom(some.sampled_from(((0.0, 0.0, 0.0), (0.0, 0.0, -9.81))))))
        if burns:  # air around thinner gas: `test_guards.py`
            builder.ambient_pressure(draw(seldom(some.sampled_from((0.0, 1e5)))))
        builder.gauge(draw(MIDDLE), moving=draw(seldom(some.booleans())))
        builder.end_time(draw(seldom(some.floats(1e-6, 1e-3))))
        return builder.build()
    except ValueError as error:  # as InputError is, and as an equation of state raises
        message = str(error)
    assert "\n" not in message
    assert "expected" in message
    return None


@FEW
@given(some.data())
def test_a_scene_is_refused_in_one_line_or_runs(data):
    """Ten steps: mass is kept to the round-off of a sum, and energy to that of ten steps."""
    scene = built(data)
    if scene is None:
        return
    audit = audited(start(scene), 10)
    assert audit.mass_error < 32 * ROUND_OFF
    assert audit.energy_error < 1e-5
    assert np.isfinite(audit.energy_error)


words = some.one_of(
    some.text(max_size=12), some.sampled_from(("nan", "inf", "-1", "0", "1e999", "é", "../..", "=", "a=b=c"))
)
names = some.sampled_from(("cell_size", "end_time", "confinement", "particles_per_axis", "energy", "cfl", "shape", "x"))
options = some.sampled_from(
    ("--set", "--solver", "--frames", "--threads", "--device", "--layout", "--isosurface", "--fields")
)


@FEW
@given(some.lists(some.tuples(options, some.booleans(), names, words), min_size=1, max_size=3))
def test_a_command_that_makes_no_sense_is_one_line(tmp_path_factory, given):
    """Whatever follows an option: one line and exit code 2; nothing in it names a scene that exists."""
    arguments = ["run", "no such scene"]
    for option, assigned, name, word in given:
        arguments += [option, f"{name}={word}" if assigned else word.replace("-h", "")]
    assert main(arguments) == 2


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
