"""Sums in a fixed order are those of the scatter, and need no atomic additions: so a GPU's answer is reproducible."""

import re

import numpy as np
import pytest
import warp as wp
from scenes_for_tests import (
    CELL,
    ORDERS_AND_TRANSFERS,
    ROUND_OFF,
    advance,
    explosive,
    inert_gas,
    particle_values,
    start,
)

from warp_mpm.builder import SceneBuilder
from warp_mpm.checkpoint import restore_solver, saved_solver
from warp_mpm.config import Order, ShapeFunction, SolverConfig
from warp_mpm.detonators import PointDetonator
from warp_mpm.geometry import Box
from warp_mpm.kernels import bins, fold, grid, material, ordered_sums, reproject, shape, strain, transfer
from warp_mpm.kernels.burn.programmed import ProgrammedBurn
from warp_mpm.kernels.eos.ideal_gas import IdealGas
from warp_mpm.launch import find_device
from warp_mpm.model import build_model
from warp_mpm.scene import Scene, Wall, Walls

# A node's sum has some 200 terms of either sign; a quarter of this was seen.
SUMMED = 64 * ROUND_OFF
# Sums in another order round otherwise; of what 60 steps make of that, a tenth was seen.
OTHER_ORDER = 1e-4


PHASES = {
    Order.MUSL: ("grid to particles and back", "particles to grid"),
    Order.USL: ("particles to grid",),
    Order.USF: ("momentum to grid", "forces to grid"),
}


def two_charges() -> Scene:
    """Explosive and gas, of particles that differ in size, between walls and open faces that some leave through."""
    builder = SceneBuilder("two_charges")
    builder.domain((0.0, 0.0, 0.0), (0.14, 0.07, 0.05), cell_size=CELL)
    builder.walls(Walls(x_high=Wall.OPEN, y_high=Wall.OPEN, z_low=Wall.STICK))
    builder.charge(Box((0.0, 0.0, 0.0), (0.07, 0.06, 0.05)), explosive(), name="explosive")
    builder.charge(Box((0.07, 0.0, 0.0), (0.14, 0.06, 0.05)), inert_gas(100.0), name="gas", particles_per_axis=1)
    builder.detonator(PointDetonator((0.03, 0.03, 0.02)))
    builder.end_time(1.0)
    return builder.build()


def sums_after(solver, phase):
    """Nodal sums (nodes, lanes), by name, after a phase of a step and before a pass over the nodes reads them."""
    due = False
    for name, run in solver.phases():
        if due and name.startswith(("fold", "solve")):
            break
        run()
        due = due or name == phase
    grid = solver.state.grid
    names = ("sums", "field", "content_sums", "reprojected")
    return {name: getattr(grid, name).numpy().copy() for name in names}


@pytest.mark.parametrize("form", list(ShapeFunction), ids=lambda form: form.value)
@pytest.mark.parametrize(("order", "transfer"), ORDERS_AND_TRANSFERS)
def test_sums_are_those_of_the_scatter(form, order, transfer, device):
    """Both solvers take a step from where one has come to."""
    settings = {"shape": form, "order": order, "transfer": transfer}
    scattered = advance(start(two_charges(), device, ordered=False, **settings), 12)
    begun = saved_solver(scattered)
    for phase in PHASES[order]:
        solvers = [start(two_charges(), device, ordered=ordered, **settings) for ordered in (False, True)]
        for solver in solvers:
            restore_solver(solver, begun)
        expected, summed = (sums_after(solver, phase) for solver in solvers)
        for name, values in summed.items():
            scale = np.abs(expected[name]).max(axis=0, initial=0.0)
            difference = np.abs(values.astype(np.float64) - expected[name]).max(axis=0, initial=0.0)
            assert np.all(difference <= SUMMED * scale), (phase, name, difference / scale)
    assert np.all(np.abs(expected["sums"]).max(axis=0) > 0.0)  # of the last phase: all lanes


def run(device="cpu", *, graphs=None, ordered=True, steps=60, begun=None, **config):
    """Everything there is of the particles after some steps in which some leave; from the start, or from a solver's."""
    solver = start(two_charges(), device, graphs=graphs, ordered=ordered, **config)
    if begun is not None:
        restore_solver(solver, begun)
    return advance(solver, steps)


@pytest.mark.parametrize(("order", "transfer"), ORDERS_AND_TRANSFERS)
def test_runs_are_those_of_the_scatter(order, transfer, device):
    """To round-off."""
    expected = particle_values(run(device, ordered=False, order=order, transfer=transfer).state)
    summed = particle_values(run(device, order=order, transfer=transfer).state)
    assert np.any(expected["mass"] == 0.0)
    for name in ("position", "velocity", "density", "energy", "pressure"):
        scale = np.abs(expected[name]).max()
        np.testing.assert_allclose(summed[name], expected[name], rtol=0, atol=OTHER_ORDER * scale, err_msg=name)


def same_bits(one, other):
    """Whether particles and nodes of two solvers are the same, bit for bit."""
    ours, theirs = saved_solver(one), saved_solver(other)
    compared = [name for name in ours.keys() | theirs.keys() if name.startswith(("particles.", "grid."))]
    return all(np.array_equal(ours[name], theirs[name]) for name in compared)


def test_every_run_has_the_same_bits(device):
    """Again, stopped and resumed between two sortings, and with steps as graphs; on a GPU that is the point of it."""
    whole = run(device)
    halfway = saved_solver(run(device, steps=33))
    assert same_bits(run(device), whole)
    assert same_bits(run(device, steps=27, begun=halfway), whole)
    assert same_bits(run(device, graphs=True), whole)


@pytest.mark.parametrize("device", ["cpu"])
def test_a_cpu_does_not_need_it(device):
    """Its scatter has a fixed order as it is."""
    model = build_model(two_charges(), SolverConfig(reproducible=True), find_device(device))
    assert not model.ordered


# Of a reproducible step, all that writes to particles or nodes.
KERNELS = {
    "scatter": lambda: ordered_sums.ordered_scatter_kernel(shape.BSPLINE, True, True, False, True),
    "reprojection": lambda: ordered_sums.ordered_reprojection_kernel(shape.BSPLINE, False),
    "advance": lambda: transfer.advance_kernel(shape.BSPLINE, False, False, False),
    "bins": lambda: bins.fill_bins,
    "update": lambda: material.update_kernel(
        shape.BSPLINE, strain.Strain.REPROJECTED, True, True, IdealGas, ProgrammedBurn
    ),
    "fold": lambda: fold.fold_kernel(True, True),
    "solve": lambda: grid.solve_kernel(True, True, True, True),
    "fold_reprojected": fold.fold_reprojected_kernel,
    "solve_reprojected": lambda: reproject.solve_reprojected_kernel(True, True),
}


@pytest.mark.parametrize("name", KERNELS)
def test_a_gpu_adds_nothing_at_the_same_time(name, tmp_path):
    """But to sums that no step reads, which are double; of what is stamped or raised the order does not matter."""
    wp.compile_aot_module(KERNELS[name]().module, arch=75, module_dir=str(tmp_path), use_ptx=True)
    (ptx,) = tmp_path.glob("*.ptx")
    assert ".visible .entry" in ptx.read_text()
    atomic = set(re.findall(r"\b(?:atom|red)\.[\w.]+", ptx.read_text()))
    assert [kind for kind in atomic if ".add." in kind and not kind.endswith(".add.f64")] == []
    assert atomic == set() or name not in ("scatter", "reprojection", "advance", "bins")
