"""What a run records: the field pressure by its formula, peaks, regions around the front path, and lines.

The field pressure at a node is sum w V p / sum w V inside the material, and sum w V p / V_i in nodes at most 0.8 full,
V_i being the node's share of the domain; from 0.8 to 0.95 full the divisor goes linearly from one to the other
(`kernels/grid.py`). Nodes less than half filled stay out of peaks.
"""

from dataclasses import replace

import numpy as np
import pytest
from scenes_for_tests import (
    CELL,
    OPEN,
    ROUND_OFF,
    advance,
    block,
    inert_gas,
    node_array,
    particle_values,
    scatter,
    start,
)

from warp_mpm import recorder as recorder_module
from warp_mpm.builder import SceneBuilder
from warp_mpm.detonators import PointDetonator
from warp_mpm.geometry import Box
from warp_mpm.materials import ammonium_nitrate
from warp_mpm.recorder import Recorder, nodes_near_point, nodes_near_segment
from warp_mpm.scene import Domain, SectionPlane, Segment, Wall, Walls
from warp_mpm.section import section_pressure
from warp_mpm.state import NUMBER

DOMAIN = Domain((-0.01, 0.0, 0.0), (0.09, 0.06, 0.02), (10, 4, 2))  # cells of 10 x 15 x 10 mm


def node_volumes(domain):
    """Each node's share of the domain (nx + 1, ny + 1, nz + 1) [m3]: halved on every face; rounded as the grid's is."""
    x, y, z = (np.where((np.arange(n + 1) == 0) | (np.arange(n + 1) == n), 0.5, 1.0) for n in domain.cells)
    return x[:, None, None] * y[:, None] * z * np.prod(np.array(domain.spacing, dtype=NUMBER))


def fillings(solver):
    """Filling of the nodes of the domain, from the sums of the last scatter."""
    volume = node_array(solver, "sums")[1:-1, 1:-1, 1:-1, 7].astype(np.float64)
    return volume / node_volumes(solver.model.scene.domain)


def folded(sums):
    """Node sums (nx + 3, ...) with ghosts behind walls on every face folded back onto the nodes inside."""
    for axis in range(3):
        sums = np.moveaxis(sums, axis, 0).copy()
        sums[2] += sums[0]
        sums[-3] += sums[-1]
        sums = np.moveaxis(sums, 0, axis)
    return sums[1:-1, 1:-1, 1:-1]


def folded_momentum(momentum, wall):
    """The same of momenta (nx + 3, ..., 3): a slip wall reverses and holds what is normal to it, a stick wall all."""
    for axis in range(3):
        momentum = np.moveaxis(momentum, axis, 0).copy()
        held = [axis] if wall is Wall.SLIP else [0, 1, 2]
        signs = np.ones(3)
        signs[held] = -1.0
        momentum[2] += signs * momentum[0]
        momentum[-3] += signs * momentum[-1]
        for on_wall in (momentum[1], momentum[-2]):
            on_wall[..., held] = 0.0
        momentum = np.moveaxis(momentum, 0, axis)
    return momentum[1:-1, 1:-1, 1:-1]


@pytest.mark.parametrize("free", [False, True], ids=["closed", "free"])
def test_field_pressure(free, device):
    """The formula, from the sums of a scatter: ghosts folded in a closed box; nodes of a free block partly filled."""
    scene = block((5, 4, 3), walls=OPEN, margin_cells=2) if free else block((5, 4, 3))
    solver = advance(start(scene, device), 16)
    state = solver.state
    state.peaks.zero_()
    advance(solver, 1)
    computed, filling = state.field_pressure().astype(np.float64), fillings(solver)
    peak = float(state.peaks.numpy().max())
    sums, work = scatter(solver)
    volume = sums[..., 7]
    work, volume = (s[1:-1, 1:-1, 1:-1] if free else folded(s) for s in (work, volume))
    share = node_volumes(scene.domain)
    inside = np.clip((volume / share - 0.80) / 0.15, 0.0, 1.0)
    expected = work / (inside * volume + (1.0 - inside) * share)
    np.testing.assert_allclose(computed, expected, rtol=0, atol=32 * ROUND_OFF * expected.max())
    np.testing.assert_allclose(filling, volume / share, rtol=0, atol=32 * ROUND_OFF * filling.max())
    assert peak == computed[filling >= 0.5].max()
    assert (filling.min() < 0.5) == free
    assert free or filling.max() > 1.0
    assert np.any((inside > 0.0) & (inside < 1.0) & (expected > 0.0)) == free


@pytest.mark.parametrize("wall", list(Wall), ids=lambda wall: wall.value)
def test_field_velocity(wall, device):
    """Momentum over mass of a scatter, to the round-off of its sums; at empty nodes and where walls hold it, just 0."""
    margins = 2 if wall is Wall.OPEN else 0
    solver = advance(start(block((5, 4, 3), walls=Walls.all(wall), margin_cells=margins), device), 16)
    computed = solver.state.field_velocity().astype(np.float64)
    sums, _ = scatter(solver)
    # Sizes, besides: a component of a velocity is a mean of the particles', some of which may cancel.
    fastest = np.abs(particle_values(solver.state)["velocity"]).max()
    if wall is Wall.OPEN:
        mass, momentum = sums[1:-1, 1:-1, 1:-1, 3], sums[1:-1, 1:-1, 1:-1, 0:3]
    else:
        mass, momentum = folded(sums[..., 3]), folded_momentum(sums[..., 0:3], wall)
    counted = mass > solver.state.grid.light_mass
    expected = np.divide(momentum, mass[..., None], out=np.zeros_like(momentum), where=counted[..., None])
    np.testing.assert_allclose(computed, expected, rtol=0, atol=32 * ROUND_OFF * fastest)
    assert not computed[expected == 0.0].any()
    assert np.abs(expected).max() > 0.1 * fastest
    assert counted.all() == (wall is not Wall.OPEN)
    assert np.any(expected == 0.0)


def test_peaks_leave_out_nodes_less_than_half_filled(device):
    """The highest pressure of the nodes at least half filled, though thin hot gas has far higher ones elsewhere."""

    def heat_one_end(state):
        x = particle_values(state)["position"][state.particles.index.numpy(), 0]
        hot = x > 4 * CELL
        state.assign("density", np.where(hot, 4000.0, 1000.0).astype(np.float32))  # a quarter of the volume
        energy = np.where(hot, 5e6, 1e6) * np.random.default_rng(7).uniform(0.5, 1.5, state.count)
        state.assign("energy", energy.astype(np.float32))

    solver = start(block((7, 4, 3), material=inert_gas(1000.0, 1e6), walls=OPEN), device, prepare=heat_one_end)
    pressure, filling = solver.state.field_pressure(), fillings(solver)
    peak = solver.state.peaks.numpy().max()
    assert peak == pressure[filling >= 0.5].max()
    assert pressure.max() > 1.5 * peak


def recorded_scene():
    """A plate with a front path, two collision points and a line, in cells that are no cubes."""
    builder = SceneBuilder("recorded")
    builder.domain(DOMAIN.lower, DOMAIN.upper, cells=DOMAIN.cells)
    builder.charge(Box((0.0, 0.0, 0.0), DOMAIN.upper), ammonium_nitrate())
    builder.detonator(PointDetonator((0.0, 0.03, 0.01)))
    builder.front_path((0.0, 0.03, 0.01), (0.05, 0.03, 0.01))
    builder.line((-0.005, 0.01, 0.005), (0.085, 0.05, 0.015))
    builder.collision_point((0.06, 0.04, 0.01))
    builder.collision_point((0.0, 0.0, 0.0))
    builder.end_time(1e-5)
    return builder.build()


def fill_grid(state, pressure, filling):
    """Give the nodes of the domain (nx + 1, ny + 1, nz + 1) a field pressure and a filling; ghosts get far too much."""
    shape = tuple(n + 3 for n in DOMAIN.cells)
    pressures, values = np.full(shape, 1e12), np.zeros((*shape, 8))
    inside = (slice(1, -1),) * 3
    pressures[inside], values[(*inside, 7)] = pressure, filling * node_volumes(DOMAIN)
    field = np.zeros((pressures.size + 1, 2), dtype=NUMBER)  # it has a node to spare
    field[:-1, 0] = pressures.ravel()
    state.grid.field.assign(field)
    state.grid.sums.assign(values.reshape(-1, 8).astype(NUMBER))


def node_places():
    axes = [low + size * np.arange(n + 1) for low, size, n in zip(*domain_parts(), strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)


def domain_parts():
    return DOMAIN.lower, DOMAIN.spacing, DOMAIN.cells


def distances(segment_start, segment_end):
    """Distance of each node from a segment, in cells."""
    place = (node_places() - DOMAIN.lower) / DOMAIN.spacing
    ends = [(np.array(end) - DOMAIN.lower) / DOMAIN.spacing for end in (segment_start, segment_end)]
    along = np.linspace(0.0, 1.0, 2001)[:, None]
    points = ends[0] + along * (ends[1] - ends[0])
    return np.linalg.norm(place[..., None, :] - points, axis=-1).min(axis=-1)


def test_regions_and_lines(device):
    """Highest pressure within a cell of the path and two of each collision point; lines are interpolated linearly.

    Nodes less than half filled do not count in regions. Distances are in cells, which differ per axis.
    """
    scene = recorded_scene()
    solver = start(scene, device)
    recorder = Recorder(solver.state)
    random = np.random.default_rng(9)
    pressure = random.uniform(0.0, 1e9, tuple(n + 1 for n in DOMAIN.cells))
    filling = random.choice([0.0, 0.3, 0.5, 1.0], pressure.shape)
    pressure[filling < 0.5] += 1e9  # what must not count would be the highest
    fill_grid(solver.state, pressure, filling)
    recorder.record()
    record = recorder.result()
    counted = np.where(filling >= 0.5, pressure, 0.0)
    path = distances((0.0, 0.03, 0.01), (0.05, 0.03, 0.01))
    assert record.path_pressure[0] == NUMBER.type(counted[path <= 1.0 + 1e-6].max())
    for number, point in enumerate(scene.collision_points):
        assert record.point_pressures[0, number] == NUMBER.type(counted[distances(point, point) <= 2.0 + 1e-6].max())

    place = node_places()
    fill_grid(solver.state, 1e9 + place @ [1e9, 2e9, -3e9], np.zeros(pressure.shape))
    advance_clock(solver.state)
    recorder.record()
    line = recorder.result().line
    points = np.linspace(scene.line.start, scene.line.end, line.pressure.shape[1])
    np.testing.assert_allclose(line.distance, np.linalg.norm(points - points[0], axis=1), atol=1e-12)
    np.testing.assert_allclose(line.pressure[1], 1e9 + points @ [1e9, 2e9, -3e9], rtol=16 * ROUND_OFF)
    assert np.diff(line.distance).max() <= 1.01 * min(DOMAIN.spacing)


def advance_clock(state, time=0.0):
    """Count a step that ends at a time [s], as `start_step` does."""
    clock = state.clock.numpy().copy()
    clock["step"] += 1
    clock["dt"] = time - clock["time"]
    clock["time"] = time
    state.clock.assign(clock)


@pytest.mark.parametrize("plane", [SectionPlane(0, 0.013), SectionPlane(1, 0.06), SectionPlane(2, 0.0125)])
def test_peak_and_arrival_on_the_section(device, plane):
    """A front arrives where 5 % of p_CJ are reached; between steps, and between layers of nodes, pressure is linear."""
    scene = replace(recorded_scene(), section=plane)
    solver = start(scene, device)
    recorder = Recorder(solver.state)
    place = node_places()
    height = place[..., plane.axis]
    begin = 1e-6 + np.delete(place, plane.axis, axis=-1) @ [40e-6, 50e-6]  # [s]
    threshold = 0.05 * scene.charges[0].material.cj.pressure
    times = [0.0, 2.1e-6, 3e-6, 4.5e-6, 5e-6]
    highest = 0.0
    for time in times:
        if time > 0.0:
            advance_clock(solver.state, time)
        grown = threshold / 1e-6 * (1.0 + 10.0 * height) * (time - begin)
        fill_grid(solver.state, grown if time < times[-1] else 0.7 * grown, np.zeros(height.shape))
        highest = np.maximum(highest, section_pressure(solver.state))
        recorder.record()
    section = recorder.result().section
    np.testing.assert_allclose(section.peak, highest, rtol=4 * ROUND_OFF)
    arrival = begin.take(0, axis=plane.axis) + 1e-6 / (1.0 + 10.0 * plane.coordinate)
    came = arrival < times[-2]
    assert came.any()
    assert not came.all()
    np.testing.assert_allclose(section.arrival[came], arrival[came], rtol=64 * ROUND_OFF)
    assert np.isnan(section.arrival[arrival > times[-1]]).all()


@pytest.mark.parametrize("reach", [1.0, 2.0])
@pytest.mark.parametrize("end", [(0.05, 0.03, 0.01), (0.02, 0.06, 0.0), (0.0, 0.03, 0.01)])
def test_nodes_near_a_segment(end, reach):
    """The nodes of a region are those that a brute-force search finds; a segment may be a point."""
    begin = (0.0, 0.03, 0.01)
    near = distances(begin, end) <= reach + 1e-6
    found = (
        nodes_near_point(DOMAIN, begin, reach)
        if begin == end
        else nodes_near_segment(DOMAIN, Segment(begin, end), reach)
    )
    assert {tuple(node) for node in found} == {tuple(node) for node in np.argwhere(near)}


def test_records_survive_many_steps(device, monkeypatch):
    """Rows are fetched in chunks: here of 7 steps, in a run of 30; every step has its row, in order."""
    monkeypatch.setattr(recorder_module, "CHUNK", 7)
    solver = start(block((6, 4, 3)), device)
    recorder = Recorder(solver.state)
    recorder.record()
    clocks, taken = [(0.0, 0.0)], []
    for _ in range(30):
        advance(solver, 1)
        recorder.record()
        values = solver.state.clock_values()
        clocks.append((float(values["time"]), float(values["dt"])))
        if len(clocks) % 10 == 0:
            taken.append(recorder.take_peak())
    record = recorder.result()
    np.testing.assert_array_equal(record.time, [time for time, _ in clocks])
    np.testing.assert_array_equal(record.dt, [dt for _, dt in clocks])
    peaks = record.field_pressure
    assert taken == [peaks[:10].max(), peaks[10:20].max(), peaks[20:30].max()]
    assert record.path_pressure is None
    assert record.line is None
    assert record.particle_pressure.max() > 0.0
