"""Whatever bodies, walls and detonators there are, a scene is refused in one line, or it runs.

`pytest --hypothesis-profile=thorough tests/test_random_scenes.py` tries thousands of them.
"""

import itertools

import numpy as np
import pytest
from hypothesis import event, given
from hypothesis import strategies as some
from scenes_for_tests import CELL, ROUND_OFF, TNT, explosive, inert_gas

from warp_mpm import launch
from warp_mpm.builder import SceneBuilder
from warp_mpm.config import Save
from warp_mpm.detonators import LineDetonator, PlaneDetonator, PointDetonator, SphereDetonator
from warp_mpm.errors import InputError, SimulationError
from warp_mpm.geometry import Box, Sphere
from warp_mpm.kernels.eos.mie_gruneisen import MieGruneisen
from warp_mpm.kernels.eos.stiffened_gas import StiffenedGas
from warp_mpm.materials import Material, inert
from warp_mpm.scene import Wall, Walls
from warp_mpm.simulation import simulate

STEPS = 10
MATERIALS = {  # and the speed of waves in them [m/s]
    explosive(): 2800.0,
    inert_gas(): 240.0,
    Material("TNT", density=TNT.density, equation_of_state=TNT, specific_energy=7e9 / TNT.density): 7000.0,
    inert("water", density=1000.0, equation_of_state=StiffenedGas(6.12, 3.43e8)): 1450.0,
    inert("copper", density=8930.0, equation_of_state=MieGruneisen(8930.0, 3940.0, 1.49, 1.96)): 3940.0,
}
CRUSHING = 1e9  # an ambient pressure [Pa]
FAST = (2000.0, -2000.0, 100.0)  # [m/s]

few = some.integers(1, 6)
many = some.integers(1, 60)
cell_counts = some.tuples(*3 * [few | many]).filter(lambda cells: np.prod(cells) < 3000)
shares = some.sampled_from((0.0, 0.5, 1.0)) | some.floats(0.0, 1.0)
places = some.tuples(shares, shares, shares)  # in a box, from its lower to its upper corner
gaps = some.sampled_from((0.0, 0.0, 0.0, 0.3, 0.5))  # between a body and the slice of the domain it is in [cells]
walls = some.builds(Walls, *6 * [some.sampled_from(Wall)])


def point(box, share):
    """The place in a box, two corners, that shares of its edges lead to."""
    return tuple(float(x) for x in box[0] + np.array(share) * (box[1] - box[0]))


@some.composite
def boxes(draw, cells):
    """One to three boxes, two corners each in cells, side by side along the longest axis."""
    axis = int(np.argmax(cells))
    cuts = draw(some.sets(some.integers(1, 2 * cells[axis] - 1), max_size=2))
    for begin, end in itertools.pairwise([0, *sorted(cuts), 2 * cells[axis]]):
        low, high = np.zeros(3), np.array(cells, dtype=float)
        low[axis], high[axis] = begin / 2, end / 2
        yield low + draw(some.tuples(gaps, gaps, gaps)), high - draw(some.tuples(gaps, gaps, gaps))


@some.composite
def detonators(draw, box):
    """A detonator of any kind in a box."""
    first, second = point(box, draw(places)), point(box, draw(places))
    kinds = (
        PointDetonator(first),
        PlaneDetonator(first, (1.0, 0.0, 0.5)),
        LineDetonator(first, second, 1e-6),
        SphereDetonator(first, CELL),
    )
    return draw(some.sampled_from(kinds))


@some.composite
def builders(draw):
    """What builds a scene of some ten steps."""
    cells = draw(cell_counts)
    edges = CELL * np.array(draw(some.tuples(*3 * [some.sampled_from((0.7, 1.0, 1.3))])))
    lower = np.array(draw(some.sampled_from(((0.0, 0.0, 0.0), (-0.03, 0.1, 1.0)))))
    domain = lower, lower + cells * edges
    faces = draw(walls)
    builder = SceneBuilder("random")
    builder.domain(*domain, cells=cells)
    builder.walls(faces)
    builder.ambient_pressure(draw(some.sampled_from((0.0, 1e5, CRUSHING))))
    if Wall.OPEN not in faces.faces():  # the audit knows the potential energy of what leaves only nearly
        builder.gravity(draw(some.sampled_from(((0.0, 0.0, 0.0), (0.0, -9.81, 100.0)))))
    fastest = 0.0
    for low, high in draw(boxes(cells)):
        box = lower + low * edges, lower + high * edges
        material, velocity = draw(some.sampled_from(list(MATERIALS))), draw(some.sampled_from((None, None, FAST)))
        radius = min(box[1] - box[0]) / 2
        ball = draw(some.booleans()) and radius > 0.0
        builder.charge(
            Sphere(point(box, (0.5, 0.5, 0.5)), radius) if ball else Box(*box),
            material,
            particles_per_axis=draw(some.integers(1, 3)),
            velocity=velocity,
            may_stay_unlit=draw(some.sampled_from((True, True, False))),
        )
        if material.burn is not None:
            builder.detonator(*draw(some.lists(detonators(box), max_size=2)))
        fastest = max(fastest, MATERIALS[material] + (0.0 if velocity is None else max(velocity)))
    builder.end_time(STEPS * 0.3 * edges.min() / fastest)
    ends = point(domain, draw(places)), point(domain, draw(places))
    if ends[0] != ends[1]:
        builder.front_path(*ends)
    builder.collision_point(ends[0])
    builder.gauge(ends[0])
    builder.gauge(point(box, (0.5, 0.5, 0.5)), moving=True)
    return builder


@pytest.fixture(scope="module", autouse=True)
def _small_work_is_shared():
    """Threads take part in the work on few cells too."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(launch, "SMALLEST_SHARED_WORK", 0)
        yield


@given(data=some.data(), threads=some.sampled_from((1, 2, 5)))
def test_a_random_scene_is_refused_or_runs(data, threads):
    """Mass and energy are kept to the round-off of sums over some hundred particles at a node."""
    try:
        scene = data.draw(builders()).build()
        summary = simulate(scene, threads=threads, device="cpu", save=Save(frames=2, isosurface=1e8)).summary
    except (InputError, SimulationError) as refusal:
        message = str(refusal)
        event("refused" if isinstance(refusal, InputError) else "stopped")
    else:
        message = ""
        event("ran to its end")
        assert summary["mass_error"] < 200 * ROUND_OFF
        if scene.ambient_pressure < CRUSHING:  # whose work is many times the energy that the error is related to
            assert summary["energy_error"] < 200 * ROUND_OFF
    assert "\n" not in message
