"""The benchmark command: its files, keys and counts on tiny cubes. No time is asserted, only that times add up."""

import importlib
import itertools
import json
import math
import sys
from pathlib import Path
from unittest.mock import Mock

import pytest
import warp as wp
from scenes_for_tests import ORDERS_AND_TRANSFERS, block

from warp_mpm.config import Order, ShapeFunction, SolverConfig, Transfer
from warp_mpm.errors import InputError
from warp_mpm.launch import Launcher, find_device
from warp_mpm.model import build_model
from warp_mpm.scene import Wall, Walls
from warp_mpm.solver import Solver

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tools"))  # the benchmark is a program beside the package
bench = importlib.import_module("bench")
counts = importlib.import_module("benchmark.counts")
limits = importlib.import_module("benchmark.limits")
memory = importlib.import_module("benchmark.memory")
runs = importlib.import_module("benchmark.runs")
sections = importlib.import_module("benchmark.sections")
timing = importlib.import_module("benchmark.timing")

TINY = sections.Effort(cells=8, free_cells=4, sizes=(4, 8), rounds=2, stream_bytes=2**20)
UNITS = ("_s", "_per_s", "_ns", "_bytes", "_bytes_per_particle", "_per_particle_step", "_ratio")
NUMBERS = {  # figures without a unit: numbers of things, and shares
    *("threads", "rounds", "cores", "steps", "particles", "cells_along_an_edge"),
    *("nodes_per_particle", "percent_of_limit", "share_of_mass_inside", "load_before_processes"),
}


def silent(text):
    pass


@pytest.fixture(scope="module", autouse=True)
def few_variants():
    """Two variants instead of twelve, whose kernels would have to be compiled."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sections, "SHAPES", sections.SHAPES[:1])
        patch.setattr(sections, "ORDERS", sections.ORDERS[:2])
        yield


@pytest.fixture(scope="module")
def report():
    names = [name for name in bench.SECTIONS if name != "memory"]  # which starts a process
    return bench.measure(names, TINY, "cpu", 1, silent)


def figures(value, key=""):
    """All numbers in a report, with their keys."""
    if isinstance(value, dict):
        for name, inner in value.items():
            yield from figures(inner, name)
    elif isinstance(value, (list, tuple)):
        for inner in value:
            yield from figures(inner, key)
    elif isinstance(value, (int, float)) and not isinstance(value, bool):
        yield key, value


def model_of(cells=4, **config):
    return build_model(runs.cube(cells), SolverConfig(**config), find_device("cpu"))


def test_every_section_reports_finite_figures_with_units(report):
    assert set(bench.SECTIONS) - {"memory"} < set(report)
    found = list(figures(report))
    assert [key for key, _ in found if key not in NUMBERS and not key.endswith(UNITS)] == []
    assert [(key, value) for key, value in found if not (math.isfinite(value) and value >= 0.0)] == []


def test_medians_lie_between_the_lowest_and_the_highest(report):
    rows = [*report["variants"], *report["threads"], *report["sizes"], *report["late"]["instants"]]
    rows += [row for column in report["phases"]["columns"] for row in column["phases"]]
    for row in rows:
        name = "ns_per_particle_step"
        assert row[f"lowest_{name}"] <= row[name] <= row[f"highest_{name}"]


def test_what_is_reported_follows_the_counts(report):
    found = counts.phase_counts(model_of(TINY.cells))
    nodes = report["phases"]["nodes_per_particle"]
    (column,), (limit,) = report["phases"]["columns"], report["limits"]
    rows = {row["phase"]: row for row in column["phases"]}
    assert set(rows) == {*found, runs.SORT}
    for name, count in found.items():
        row = rows[name]
        moved = count.particle_bytes + nodes * count.node_bytes
        done = count.particle_operations + nodes * count.node_operations
        assert row["memory_bytes_per_particle_step"] == pytest.approx(moved)
        assert row["operations_per_particle_step"] == pytest.approx(done)
        allowed = 1e9 * max(moved / limit["memory_bandwidth_bytes_per_s"], done / limit["multiply_adds_per_s"])
        assert row["limit_ns_per_particle_step"] == pytest.approx(allowed)
        assert row["percent_of_limit"] == pytest.approx(100.0 * allowed / row["ns_per_particle_step"])


def test_counts_by_hand():
    """B-spline, MUSL, damping: 27 nodes, 9 rows, 3 planes; bytes in numbers of 4 after the 18 of a place."""
    count = counts.phase_counts(model_of())
    # Mass, density, velocity, pressures, sound speed, thrust in; eight lanes, the field's and the cells', in and out.
    assert count["particles to grid"].particle_bytes == 18 + 4 * (1 + 1 + 3 + 2 + 1 + 3)
    assert count["particles to grid"].node_bytes == 2 * 4 * (8 + 2 + 2)
    scattered = 8 * (2 * 27 + 3 * 9 + 4 * 3) + 2 * (27 + 3) + 2 * (8 + 2)
    assert count["particles to grid"].particle_operations == scattered + 36 + 24 + counts.FORCES
    # Mass in, velocity in and out; eight lanes in, four in and out.
    assert count["grid to particles and back"].particle_bytes == 18 + 4 * 7
    assert count["grid to particles and back"].node_bytes == 4 * (8 + 2 * 4)
    assert count["grid to particles and back"].particle_operations == 8 * (27 + 9 + 3) + 4 * (27 + 3) + 36 + 6
    # Sums and field in, start and field out, the re-projected sums emptied; the cells' in, out and emptied.
    assert count["solve grid"].node_bytes == 4 * (8 + 2 + 8 + 2 + 4 + 3 * 2)
    # Seven divisions and products of four, six times a minimum, a difference and a product; two sums, one product.
    assert count["solve grid"].node_operations == counts.SOLVING + 7 * 5 + 6 * 9 + 12
    # Start, re-projected sums and field in; velocities and damping out; sums and field emptied.
    assert count["solve re-projection"].node_bytes == 4 * (8 + 4 + 2 + 8 + 4 + 8 + 2)
    # Two values of four lanes, twice as many differences and products, a minimum and its half.
    assert count["solve re-projection"].node_operations == counts.SOLVING + 7 * 8 + 6 * 18 + 2 * 12
    assert "clear" not in count
    assert count["time step"] == counts.Count()


def test_counts_of_undamped_orders_by_hand():
    """Nothing is sharpened, cells hold nothing; USL and USF empty sums and field in a pass of its own."""
    musl, usl, usf = (
        counts.phase_counts(model_of(order=order, transfer=Transfer.FLIP))
        for order in (Order.MUSL, Order.USL, Order.USF)
    )
    assert musl["solve grid"].node_bytes == 4 * (8 + 2 + 8 + 2 + 4)
    assert usl["solve grid"].node_bytes == 4 * (8 + 2 + 8 + 2)
    assert usl["solve grid"].node_operations == musl["solve re-projection"].node_operations == counts.SOLVING
    assert usl["clear"] == usf["clear"] == counts.Count(node_bytes=4 * (8 + 2))
    assert usf["fold momentum"].node_bytes < usf["fold forces"].node_bytes == usl["fold grid"].node_bytes


@pytest.mark.parametrize("walls", [Walls(), Walls(Wall.OPEN, Wall.STICK, Wall.SLIP, Wall.OPEN), Walls.all(Wall.OPEN)])
@pytest.mark.parametrize("cells", [(1, 2, 3), (6, 5, 4)])
def test_folds_are_counted_where_walls_are(cells, walls):
    """By counting the nodes one by one: on a wall or next to it, and ghosts; no walls, nothing."""
    model = build_model(block(cells, walls=walls), SolverConfig(), find_device("cpu"))
    ends = [(axis, side, face) for face, (axis, side) in enumerate(itertools.product(range(3), range(2)))]
    walled = [(axis, side) for axis, side, face in ends if walls.faces()[face] is not Wall.OPEN]
    kinds = []
    for node in itertools.product(*(range(-1, n + 2) for n in cells)):
        before = [cells[axis] - node[axis] if side else node[axis] for axis, side in walled]  # nodes to each wall
        kinds.append("ghost" if min(before, default=2) < 0 else "owner" if min(before, default=2) < 2 else "apart")
    owners, ghosts = (kinds.count(kind) / len(kinds) for kind in ("owner", "ghost"))
    count = counts.phase_counts(model)
    assert count["fold grid"].node_bytes == pytest.approx(4 * (owners * 2 + ghosts) * (8 + 2))
    assert count["fold re-projection"].node_bytes == pytest.approx(4 * (owners * (2 * 4 + 2) + ghosts * (4 + 2)))
    assert count["fold grid"].node_operations == pytest.approx(owners * counts.FOLDING)
    assert (count["fold grid"].node_bytes > 0.0) == model.has_walls


@pytest.mark.parametrize("width", [2, 3])
def test_formulas_count_the_loops(width):
    """The loops of `kernels/stencil.py`, walked through."""
    gathered = gathered_with_gradient = scattered = scattered_with_gradient = 0
    for _ in range(width):  # the nodes of a row
        for _ in range(width):  # planes
            for _ in range(width):  # rows of a plane
                gathered += 1
                gathered_with_gradient += 2  # plane, plane_y
                scattered += 1
                scattered_with_gradient += 2
            gathered += 1
            gathered_with_gradient += 3  # total, by_x, by_y
            scattered_with_gradient += 3
        gathered += 1
        gathered_with_gradient += 4
        scattered += 1
        scattered_with_gradient += 4
    assert counts.gather(width, 5) == 5 * gathered
    assert counts.gather_gradient(width, 5) == 5 * gathered_with_gradient
    assert counts.scatter(width, 5) == 5 * scattered
    assert counts.scatter_gradient(width, 5) == 5 * scattered_with_gradient


class Unprepared(Solver):
    """A solver that knows its phases but has recorded no launches."""

    def __init__(self, model):
        self.model = model

    def __getattr__(self, name):
        return Mock()


@pytest.mark.parametrize("shape", ShapeFunction)
@pytest.mark.parametrize(("order", "transfer"), ORDERS_AND_TRANSFERS)
def test_every_phase_of_every_variant_is_counted(shape, order, transfer):
    model = model_of(shape=shape, order=order, transfer=transfer)
    assert {name for name, _ in Unprepared(model).phases()} == set(counts.phase_counts(model))


@pytest.mark.parametrize(("shape", "more"), [(ShapeFunction.BSPLINE, 3), (ShapeFunction.LINEAR, 1)])
def test_nodes_per_particle_of_a_full_cube(shape, more):
    solver = runs.start(runs.cube(4), Launcher(find_device("cpu"), 1), SolverConfig(shape=shape))
    assert runs.nodes_per_particle(solver) == (4 + more) ** 3 / (8 * 4**3)


def test_phases_cover_the_time_of_the_step():
    """Between two phases there is nothing but a loop; the best of a few tries, as the system may interrupt any."""
    launcher = Launcher(find_device("cpu"), 1)
    solver = runs.early(8, launcher)
    shares = []
    for _ in range(5):
        found = {}
        whole = timing.timed(launcher.device, lambda found=found: found.update(runs.phase_seconds(solver, launcher)))
        sorting = runs.STEPS_BETWEEN_SORTS * found.pop(runs.SORT)
        shares.append((sorting + runs.TIMED_STEPS * sum(found.values())) / whole)
    assert 0.8 < max(shares) <= 1.0


def test_a_step_has_its_share_of_a_sorting(monkeypatch):
    def one_second(device, work):
        work()
        return 1.0

    monkeypatch.setattr(runs, "timed", one_second)
    launcher = Launcher(find_device("cpu"), 1)
    solver = runs.early(4, launcher)
    share = 1.0 / runs.STEPS_BETWEEN_SORTS
    assert runs.step_seconds(solver, launcher) == pytest.approx(1.0 / runs.TIMED_STEPS + share)
    before = int(solver.state.clock_values()["step"])
    assert runs.phase_seconds(solver, launcher) == pytest.approx(
        {runs.SORT: share, **{name: 1.0 for name, _ in solver.phases()}}
    )
    assert int(solver.state.clock_values()["step"]) == before + runs.TIMED_STEPS


def test_comparisons_take_turns():
    taken = []
    measures = {key: lambda key=key: taken.append(key) or len(taken) for key in "ABC"}
    assert timing.interleaved(measures, 3) == {"A": [1, 6, 8], "B": [2, 4, 9], "C": [3, 5, 7]}
    assert "".join(taken) == "ABCBCACAB"
    assert timing.spread("x_s", [5.0, 1.0, 2.0]) == {"x_s": 2.0, "lowest_x_s": 1.0, "highest_x_s": 5.0}


@pytest.mark.parametrize(
    ("most", "expected"),
    [
        (1, [1]),
        (2, [1, 2]),
        (5, [1, 2, 3, 4, 5]),
        (16, [1, 2, 3, 4, 6, 8, 12, 16]),
        (20, [1, 2, 3, 4, 6, 8, 12, 16, 20]),
    ],
)
def test_thread_counts(most, expected):
    assert timing.thread_counts(most) == expected


def test_the_limits_do_the_work_they_count(device):
    """A stream adds half of ones to zeros; all chains end at their fixed point, 1."""
    launcher = Launcher(find_device(device), 2)
    a = wp.zeros(4 * limits.STREAM_CHUNK, dtype=wp.vec4, device=device)
    b = wp.full(len(a), wp.vec4(1.0, 1.0, 1.0, 1.0), dtype=wp.vec4, device=device)
    launcher.run(limits._stream_tasks(launcher, a, b), limits.SMALLEST_SHARED_WORK)
    assert (a.numpy() == 0.5).all()
    result = wp.zeros(1, dtype=float, device=device)
    wp.launch(limits.multiply_add, 1, inputs=[result, 100_000, 0], device=device)
    # 0.999 x + 0.001 stops where it rounds to x: within 2^-24 / 0.001 of 1
    assert result.numpy()[0] == pytest.approx(limits.REGISTERS, rel=1e-4)
    launcher.close()


@pytest.mark.parametrize("kernel", [limits.stream, limits.multiply_add])
def test_the_limits_compile_for_cuda(kernel, tmp_path):
    wp.compile_aot_module(kernel.module, arch=75, module_dir=str(tmp_path), use_ptx=True)
    assert list(tmp_path.glob("*.ptx"))


def test_a_size_that_does_not_fit_is_left_out(monkeypatch):
    def only_small(model):
        if model.scene.particle_count > 512:
            raise InputError("too large")

    monkeypatch.setattr(runs, "check_memory", only_small)
    said = []
    context = sections.Bench(find_device("cpu"), 1, TINY, said.append)
    small, large = sections.sizes(context)
    context.close()
    assert "skipped" not in small
    assert large == {"cells_along_an_edge": 8, "particles": 4096, "skipped": "too large"}
    assert [text for text in said if "left out: too large" in text]


def test_memory_counts_the_arrays():
    record = memory.memory_record(8, "cpu", 1)
    state = runs.start(runs.cube(8), Launcher(find_device("cpu"), 1)).state
    assert record["particles"] == state.count == 8 * 8**3
    assert record["particle_arrays_bytes_per_particle"] * state.count == memory.array_bytes(state.particles)
    assert memory.array_bytes(state.particles) > 18 * state.count  # more than their places alone
    # Eight lanes a node at the least, ghosts included.
    assert memory.array_bytes(state.grid) > 4 * 8 * 11**3
    assert set(record) - {"particles"} == {
        f"{kind}_bytes_per_particle" for kind in ("particle_arrays", "grid_arrays", "other_arrays", "peak_growth")
    }


def test_the_command_leaves_its_files(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(bench, "SHORT", TINY)
    output = tmp_path / "bench"
    assert bench.main(["--short", "--device", "cpu", "--threads", "1", "--repeats", "1", "-o", str(output)]) == 0
    written = json.loads((output / "bench.json").read_text())
    assert set(written) == {"machine", "versions", "settings", *bench.SECTIONS}
    assert written["settings"] == {"threads": 1, "rounds": 1, "cells_along_an_edge": 8}
    assert (output / "bench.png").read_bytes().startswith(b"\x89PNG")
    printed = capsys.readouterr().out
    assert all(
        name in printed for name in ("whole step", "bspline", "speed-up", "free, last quarter", "bytes / particle")
    )


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--threads", "0"], "threads: expected a whole number of at least 1, got 0"),
        (["--repeats", "0"], "--repeats: expected"),
        (["--device", "abacus"], "device: expected one of"),
        (["--sections", "speed"], "invalid choice: 'speed'"),
    ],
)
def test_mistakes_are_one_line(words, said, tmp_path, capsys):
    assert bench.main([*words, "-o", str(tmp_path)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("bench: ")
    assert said in line
