"""What the verification problems of this file's names measure with, apart from running them.

`test_verification_problems.py` runs every problem; here are the geometry and the measurements that have an answer of
their own.
"""

import numpy as np
import pytest

from warp_mpm.config import SolverConfig, Transfer
from warp_mpm.verification.problem import Level
from warp_mpm.verification.problems import angle, noh, quiet_box, sedov, shock_tubes


def test_all_angles_have_the_same_slab():
    """The same mass to the staircase of its sides, and the core line lies in the explosive from end to end."""
    scenes = [angle.PROBLEMS[0].scene(Level(20, {"angle": degrees})) for degrees in angle.ANGLES]
    counts = [scene.particle_count for scene in scenes]
    assert max(counts) < 1.02 * min(counts)
    for scene in scenes:
        assert scene.charges[0].volume == pytest.approx(scenes[0].charges[0].volume)
        assert scene.front_path is not None
        points = scene.front_path.points(50)[1:]
        assert scene.charges[0].solid.contains(points).all()
        assert scene.front_path.length == pytest.approx(40 * angle.CELL)
        assert scene.domain.spacing == pytest.approx((angle.CELL,) * 3)


def test_the_shock_is_where_the_pressure_falls_through_half_its_peak():
    radius = np.array([1.0, 2.0, 3.0, 4.0, 5.0])
    assert sedov.shock_radius(radius, np.array([0.1, 0.7, 1.0, 0.4, 0.0])) == pytest.approx(3.0 + 0.5 / 0.6)
    assert sedov.shock_radius(radius, np.array([1.0, 0.0, 0.0, 0.0, 0.0])) == pytest.approx(1.5)
    assert sedov.shock_radius(radius, np.ones(5)) == 5.0  # it has left the domain


def test_the_table_of_the_blast_is_the_blast():
    """Profiles that are smooth inside, interpolated between 2000 radii, and a jump that stays one."""
    radius = np.concatenate([np.random.default_rng(2).uniform(0.0, 1.2, 500), [0.0, 0.9999, 1.0001]])
    table = sedov.tabulated_flow(sedov.TIME)
    for name in ("pressure", "velocity", "density"):
        exact = getattr(sedov.BLAST, name)(radius, sedov.TIME)
        assert getattr(table, name)(radius, sedov.TIME) == pytest.approx(exact, abs=1e-4 * exact.max())


def test_the_source_holds_the_energy_of_an_octant():
    source, gas = sedov.PROBLEMS[0].scene(Level(20)).charges
    measured = 2e-4  # both volumes are
    assert source.mass * source.material.specific_energy == pytest.approx(sedov.BLAST.blast_energy / 8.0, rel=measured)
    assert source.volume == pytest.approx(np.pi / 6.0 * sedov.SOURCE**3, rel=measured)
    assert source.volume + gas.volume == pytest.approx(sedov.SIZE**3, rel=measured)


@pytest.mark.parametrize("problem", noh.PROBLEMS, ids=lambda problem: problem.name)
def test_cold_gas_runs_inwards_at_one_speed(problem):
    charge = problem.scene(Level(8)).charges[0]
    assert charge.velocities is not None
    assert np.linalg.norm(charge.velocities, axis=1) == pytest.approx(1.0)
    away = charge.positions[:, : problem.dimensions]
    along = charge.velocities[:, : problem.dimensions]
    assert (along * away).sum(axis=1) == pytest.approx(-np.linalg.norm(away, axis=1))


@pytest.mark.parametrize("tube", shock_tubes.PROBLEMS, ids=lambda tube: tube.name)
def test_waves_from_the_ends_of_a_tube_do_not_reach_what_is_compared(tube):
    """A rarefaction that starts at an end runs with u + c of the gas there, inwards.

    Where gas runs out through an end at the edge of [0, 1], it must do so faster than sound.
    """
    for gas, room, sign in ((tube.flow.left, tube.room[0], 1.0), (tube.flow.right, tube.room[1], -1.0)):
        inwards = sign * gas.velocity + gas.sound_speed(tube.flow.gamma)
        if gas.velocity != 0.0:  # a slip wall at rest sends no wave into gas at rest
            assert inwards * tube.time <= room
    waves = [edge for region in tube.flow.regions for edge in (region.lower, region.upper) if np.isfinite(edge)]
    reach = np.array([min(waves), max(waves)]) * tube.time + tube.flow.origin
    assert reach[0] > -tube.room[0]
    assert reach[1] < 1.0 + tube.room[1]


def test_plain_flip_stands_beside_the_default():
    """Only in the rows that say so; everything else is as asked for."""
    config = SolverConfig(cfl=0.2)
    problem = quiet_box.PROBLEMS[0]
    assert problem.solver_config(config, Level(10, quiet_box.DAMPED)) == config
    assert problem.solver_config(config, Level(10, quiet_box.PLAIN)) == SolverConfig(transfer=Transfer.FLIP, cfl=0.2)
