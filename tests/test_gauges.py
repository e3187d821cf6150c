"""Gauges: what they show of known fields, that they follow their matter, what follows from them, and gauges.csv."""

import csv
from dataclasses import replace

import numpy as np
import pytest
from scenes_for_tests import CELL, OPEN, ROUND_OFF, advance, block, explosive, inert_gas, start

from warp_mpm import launch
from warp_mpm.config import Save
from warp_mpm.detonators import PlaneDetonator, PointDetonator
from warp_mpm.gauges import carried_gauges
from warp_mpm.progress import Silent
from warp_mpm.recorder import Recorder
from warp_mpm.scene import Gauge, Wall, Walls
from warp_mpm.simulation import simulate

NUMBERS_ONLY = Save(frames=4, figures=False)
FACE = PlaneDetonator((0.0, 0.0, 0.0), normal=(1.0, 0.0, 0.0))  # lights a column from x = 0 on


def with_gauges(scene, *gauges):
    """The scene with these gauges, the moving ones on their particles."""
    return replace(scene, gauges=carried_gauges("scene", gauges, scene.domain, scene.charges))


def recorded(solver, steps):
    """A recorder that has seen the start and some steps."""
    recorder = Recorder(solver.state)
    recorder.record()
    for _ in range(steps):
        advance(solver, 1)
        recorder.record()
    return recorder


def column(cells, **options):
    """A column of explosive along x, lit all over its lower end, between slip walls."""
    return block((cells, 1, 1), detonators=[FACE], **options)


def middle(x):
    """A point on the axis of a column [m]."""
    return (x, CELL / 2, CELL / 2)


def test_gas_in_uniform_motion(device):
    """Both kinds show the gas as it is, until its ends are felt; the moving one goes v t far.

    A stencil reaches two nodes, so an end is felt three or four cells farther with every step: here 20 cells away.
    """
    gas, velocity = inert_gas(density=1.3, energy=1e5), (400.0, 0.0, 0.0)
    scene = block(
        (40, 1, 1), material=gas, walls=Walls(x_low=Wall.OPEN, x_high=Wall.OPEN), margin_cells=(3, 3, *4 * [0])
    )
    (charge,) = scene.charges
    moving_gas = replace(charge, velocities=np.tile(velocity, (len(charge.positions), 1)))
    point = middle(0.2037)
    gauges = [Gauge("fixed", point), Gauge("moving", point, moving=True), Gauge("edge", middle(-1.3 * CELL))]
    scene = with_gauges(replace(scene, charges=(moving_gas,)), *gauges)
    solver = start(scene, device)
    recorder = recorded(solver, 4)
    record = recorder.result()
    tolerance = 32 * ROUND_OFF  # sums over eight nodes of sums over 27 particles
    edge = record.gauges["edge"]
    assert 0.0 < edge.density[0] < 0.1 * 1.3
    np.testing.assert_allclose(edge.velocity[0], velocity, atol=tolerance * 400.0)  # of what mass there is
    for gauge in (record.gauges["fixed"], record.gauges["moving"]):
        np.testing.assert_allclose(gauge.pressure, 0.4 * 1.3 * 1e5, rtol=tolerance)
        np.testing.assert_allclose(gauge.density, 1.3, rtol=tolerance)
        np.testing.assert_allclose(gauge.velocity, np.tile(velocity, (5, 1)), atol=tolerance * 400.0)
    fixed, moving = record.gauges["fixed"].position, record.gauges["moving"].position
    np.testing.assert_allclose(fixed, np.tile(point, (5, 1)), rtol=ROUND_OFF)
    assert np.abs(moving[0] - point).max() <= CELL / 4 * (1 + ROUND_OFF)  # two particles along each axis of a cell
    np.testing.assert_allclose(moving - moving[0], np.outer(record.time, velocity), atol=4 * ROUND_OFF * 0.2)


@pytest.mark.parametrize("sheared", [False, True])
def test_fields_between_nodes(device, sheared):
    """Linear pressure; linear density of gas at one velocity, or linear velocity of gas of one density: exact."""
    scene = block((5, 4, 3))
    random = np.random.default_rng(3)
    points = random.uniform(0.0, 1.0, (6, 3)) * scene.domain.upper
    points[0], points[1] = scene.domain.upper, scene.domain.lower  # the last node has no cell above it
    scene = with_gauges(scene, *(Gauge(f"at_{n}", tuple(point)) for n, point in enumerate(points)))
    solver = start(scene, device)
    recorder = Recorder(solver.state)

    def linear(places, constant, slope):
        return constant + places @ np.array(slope)

    nodes = np.stack(np.meshgrid(*(CELL * np.arange(n + 1) for n in (5, 4, 3)), indexing="ij"), axis=-1)
    share = np.prod([np.where((nodes[..., a] == 0) | (nodes[..., a] == upper), 0.5, 1.0)
                     for a, upper in enumerate(CELL * np.arange(6)[[5, 4, 3]])], axis=0)  # fmt: skip
    densities, velocities = (
        ([2e3, -5e3, 9e3], np.zeros((3, 3))) if not sheared else (np.zeros(3), 1e4 * np.eye(3)[[1, 2, 0]])
    )
    shape = tuple(n + 3 for n in (5, 4, 3))
    pressure, values = np.full(shape, 1e12), np.full((*shape, 8), 1e12)
    inside = (slice(1, -1),) * 3
    pressure[inside] = linear(nodes, 1e9, [1e9, 2e9, -3e9])
    mass = linear(nodes, 1000.0, densities) * CELL**3 * share
    values[(*inside, slice(0, 3))] = mass[..., None] * (nodes @ velocities + [100.0, 0.0, -50.0])
    values[(*inside, 3)] = mass
    values[(*inside, 7)] = CELL**3 * share
    field = np.stack([pressure.ravel(), np.zeros(pressure.size)], axis=1)
    solver.state.grid.field.assign(np.append(field, [[0.0, 0.0]], axis=0).astype(np.float32))
    solver.state.grid.sums.assign(values.reshape(-1, 8).astype(np.float32))
    recorder.record()
    gauges = recorder.result().gauges.values()
    tolerance = 32 * ROUND_OFF
    np.testing.assert_allclose([g.pressure[0] for g in gauges], linear(points, 1e9, [1e9, 2e9, -3e9]), rtol=tolerance)
    np.testing.assert_allclose([g.density[0] for g in gauges], linear(points, 1000.0, densities), rtol=tolerance)
    expected = points @ velocities + [100.0, 0.0, -50.0]
    np.testing.assert_allclose([g.velocity[0] for g in gauges], expected, atol=tolerance * 600.0)


def test_a_moving_gauge_stays_with_its_particle(device):
    """Through many sortings it shows what that particle has, to the bit, and the fixed one what the line shows."""
    scene = block((30, 4, 3), walls=Walls(x_high=Wall.OPEN), margin_cells=(0, 10, 0, 0, 0, 0))
    gauges = [Gauge(f"moving_{n}", (x, 0.02, 0.015), moving=True) for n, x in enumerate((0.001, 0.13, 0.299))]
    scene = with_gauges(scene, *gauges, Gauge("fixed", (0.15, 0.02, 0.015)))
    solver = start(scene, device)
    recorder = recorded(solver, 130)
    assert solver.state.sorts > 5
    record = recorder.result()
    for gauge in scene.gauges[:3]:
        shown, state = record.gauges[gauge.name], solver.state
        assert shown.pressure[-1] == state.field("pressure")[gauge.particle]
        assert shown.density[-1] == state.field("density")[gauge.particle]
        np.testing.assert_array_equal(shown.velocity[-1], state.field("velocity")[gauge.particle])
        np.testing.assert_array_equal(shown.position[-1], state.positions()[gauge.particle])
    assert record.gauges["moving_2"].velocity[-1, 0] > 1000.0
    assert record.gauges["fixed"].pressure.max() > 0.3 * explosive().cj.pressure


def test_outside_of_matter_there_is_nothing(device):
    """Vacuum shows zeros; so does a moving gauge once its particle has left, at the place where it left."""
    scene = block((4, 3, 3), material=inert_gas(energy=1.0), walls=OPEN, margin_cells=4)
    (charge,) = scene.charges
    flying = replace(charge, velocities=np.tile((500.0, 0.0, 0.0), (len(charge.positions), 1)))
    scene = with_gauges(
        replace(scene, charges=(flying,)),
        Gauge("vacuum", (-0.03, 0.015, 0.015)),
        Gauge("moving", (0.039, 0.015, 0.015), moving=True),
    )
    solver = start(scene, device)
    recorder = recorded(solver, 30)
    gauges = recorder.result().gauges
    vacuum, moving = gauges["vacuum"], gauges["moving"]
    assert not np.any([vacuum.pressure, vacuum.density, *vacuum.velocity.T])
    left = np.flatnonzero(moving.density == 0.0)
    assert 0 < left[0] < 29
    assert moving.velocity[left[0] - 1, 0] == pytest.approx(500.0, rel=1e-3)
    assert not np.any([moving.pressure[left], *moving.velocity[left].T])
    assert np.all(moving.position[left] == moving.position[-1])


def test_gauges_that_nothing_came_to_are_named_at_the_end():
    """Gas reaches the one two cells away, once the front has come through; the far one is 16 cells away."""
    ends = Walls(x_high=Wall.OPEN)
    scene = block((4, 1, 1), detonators=[FACE], walls=ends, margin_cells=(0, 20, 0, 0, 0, 0), end_time=3e-5)
    gauges = [Gauge("inside", middle(0.02)), Gauge("near", middle(0.06)), Gauge("far", middle(0.2))]
    moving = Gauge("carried", middle(0.02), moving=True)
    summary = simulate(with_gauges(scene, *gauges, moving), save=NUMBERS_ONLY, device="cpu").summary
    assert summary["gauges"]["near"]["peak_pressure_pa"] > 0.0
    assert set(summary["gauges"]["far"].values()) == {None}
    (warning,) = (warning for warning in summary["warnings"] if warning.startswith("gauges:"))
    assert warning.startswith(f"gauges: nothing came to 'far' before {summary['end_time_s'] * 1e6:g} us")


def trapezoid(values, time):
    """Integral over the time of values that are linear from step to step."""
    return sum((time[n] - time[n - 1]) * (float(values[n]) + float(values[n - 1])) / 2 for n in range(1, len(time)))


def test_a_plane_wave_passes_the_gauges_at_its_speed(device):
    """Arrivals at four gauges are those of a front at D, but for a cell, over which the front is smeared."""
    places = (0.1, 0.2, 0.3, 0.4)
    scene = column(50, end_time=0.45 / 2800.0)
    scene = with_gauges(scene, *(Gauge(f"at_{x}", middle(x)) for x in places), Gauge("late", middle(0.5)))
    result = simulate(scene, save=NUMBERS_ONLY, device=device)
    figures = result.summary["gauges"]
    arrivals = np.array([figures[f"at_{x}"]["arrival_time_s"] for x in places])
    assert np.abs(2800.0 * arrivals - places).max() < CELL
    assert figures["late"] == {
        "arrival_time_s": None,
        "peak_pressure_pa": 0.0,
        "peak_time_s": None,
        "impulse_pa_s": 0.0,
    }
    for x in places:
        gauge = result.record.gauges[f"at_{x}"]
        figure = figures[f"at_{x}"]
        assert figure["peak_pressure_pa"] == gauge.pressure.max()
        assert 0.0 <= figure["peak_time_s"] - figure["arrival_time_s"] < 4 * CELL / 2800.0
        assert gauge.pressure[gauge.time == figure["peak_time_s"]] == gauge.pressure.max()
        assert figure["impulse_pa_s"] == pytest.approx(trapezoid(gauge.pressure, gauge.time))


def test_the_impulse_on_a_wall_is_the_momentum_that_it_takes(device):
    """A gauge on the wall at which a front is reflected: integral of p dt times area, against the wall's momentum.

    What the field smears over a cell is missing, of a run of thirty cells: 2.3 %, and half of that in twice the cells.
    """
    cells = 30
    scene = with_gauges(column(cells, end_time=2.0 * cells * CELL / 2800.0), Gauge("wall", middle(cells * CELL)))
    result = simulate(scene, save=NUMBERS_ONLY, device=device)
    momentum = -result.history[-1]["impulse_x_high_x_Ns"]
    assert momentum > 0.0
    assert result.summary["gauges"]["wall"]["impulse_pa_s"] * CELL**2 == pytest.approx(momentum, rel=1 / cells)


def read_table(path):
    """Header and values of gauges.csv, time in double, the rest in single precision."""
    with path.open(newline="") as file:
        header, *rows = csv.reader(file)
    return header, np.array([float(row[0]) for row in rows]), np.array([row[1:] for row in rows], dtype=np.float32)


class Watching(Silent):
    """Counts the rows of gauges.csv after every step, and stops the run after some."""

    def __init__(self, path, last_step):
        self.path, self.last_step = path, last_step
        self.steps_on_disk = []

    def update(self, time, end_time, step, note):
        """Look, then interrupt."""
        self.steps_on_disk.append(len(self.path.read_text().splitlines()) - 2)  # the header, and the start
        if step == self.last_step:
            raise KeyboardInterrupt


def gauged_column():
    return with_gauges(
        column(12, end_time=3e-5), Gauge("fixed", middle(0.06)), Gauge("moving", middle(0.06), moving=True)
    )


def test_the_table_holds_every_step(device, tmp_path):
    """Time, pressure, velocity, density; the place of the moving one too; every number reads back exactly."""
    record = simulate(gauged_column(), save=NUMBERS_ONLY, output=tmp_path, device=device).record
    header, time, values = read_table(tmp_path / "gauges.csv")
    quantities = ["pressure_pa", "velocity_x_m_s", "velocity_y_m_s", "velocity_z_m_s", "density_kg_m3"]
    expected = [f"fixed_{name}" for name in quantities]
    expected += [f"moving_{name}" for name in (*quantities, "x_m", "y_m", "z_m")]
    assert header == ["time_s", *expected]
    np.testing.assert_array_equal(time, record.time)
    fixed, moving = record.gauges["fixed"], record.gauges["moving"]
    memory = [fixed.pressure, *fixed.velocity.T, fixed.density]
    memory += [moving.pressure, *moving.velocity.T, moving.density, *moving.position.T]
    np.testing.assert_array_equal(values, np.array(memory).T)
    simulate(column(12, end_time=1e-5), save=NUMBERS_ONLY, output=tmp_path, device=device)
    assert not (tmp_path / "gauges.csv").exists()  # that of another run


def test_an_interrupted_or_killed_run_keeps_its_table(tmp_path):
    """At every frame all steps so far are on disk, so that a kill loses what came after; an interrupt loses nothing."""
    watching = Watching(tmp_path / "gauges.csv", 20)
    with pytest.raises(KeyboardInterrupt):
        simulate(gauged_column(), save=Save(frames=6, figures=False), output=tmp_path, device="cpu", progress=watching)
    _, time, _ = read_table(tmp_path / "gauges.csv")
    assert len(time) == 21
    assert np.all(np.diff(time) > 0.0)
    frames = np.linspace(0.0, 3e-5, 6)
    saved = np.searchsorted(time, frames[frames <= time[-1]])  # the steps at which frames were written
    last_saved = [max(saved[saved <= step]) for step in range(1, 21)]
    assert watching.steps_on_disk == last_saved


def test_gauges_change_nothing_and_threads_change_no_gauge(monkeypatch):
    monkeypatch.setattr(launch, "SMALLEST_SHARED_WORK", 0)
    scene = block((24, 4, 3), detonators=[PointDetonator((0.0, 0.0, 0.0))], end_time=5e-5)
    gauges = [Gauge("fixed", (0.1, 0.01, 0.01)), Gauge("moving", (0.1, 0.01, 0.01), moving=True)]
    bare = simulate(scene, save=NUMBERS_ONLY, device="cpu", threads=1)
    alone, shared = (
        simulate(with_gauges(scene, *gauges), save=NUMBERS_ONLY, device="cpu", threads=threads) for threads in (1, 3)
    )
    assert bare.history == alone.history == shared.history
    for name, gauge in alone.record.gauges.items():
        for quantity in ("time", "pressure", "velocity", "density", "position"):
            np.testing.assert_array_equal(getattr(gauge, quantity), getattr(shared.record.gauges[name], quantity))
    assert bare.record.gauges == {}
    assert bare.summary["gauges"] == {}
