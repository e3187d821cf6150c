"""The kernels of the default solver compile for CUDA, which needs no GPU: Warp brings NVIDIA's run-time compiler."""

import re

import pytest
import warp as wp

from warp_mpm.kernels import eikonal, fold, gauges, grid, material, reduce, reproject, shape, strain, surface, transfer
from warp_mpm.kernels.burn.programmed import ProgrammedBurn
from warp_mpm.kernels.burn.programmed_compression import ProgrammedCompressionBurn
from warp_mpm.kernels.eos.ideal_gas import IdealGas
from warp_mpm.kernels.eos.jwl import JWL
from warp_mpm.kernels.eos.mie_gruneisen import MieGruneisen
from warp_mpm.kernels.initial_strain import initial_strain_kernel

ARCHITECTURE = 75  # the oldest that current Warp supports
HOPPER = 90  # the first that adds four numbers at once

KERNELS = {
    "scatter": lambda: transfer.scatter_kernel(shape.BSPLINE, True, True, False, True),
    "advance": lambda: transfer.advance_kernel(shape.BSPLINE, False, False, True),
    "update": lambda: material.update_kernel(
        shape.BSPLINE, strain.Strain.REPROJECTED, True, True, IdealGas, ProgrammedBurn
    ),
    "update_jwl": lambda: material.update_kernel(
        shape.BSPLINE, strain.Strain.REPROJECTED, True, True, JWL, ProgrammedCompressionBurn, MieGruneisen
    ),
    "fold": lambda: fold.fold_kernel(True, True),
    "solve": lambda: grid.solve_kernel(True, True, True, True),
    "fold_reprojected": fold.fold_reprojected_kernel,
    "solve_reprojected": lambda: reproject.solve_reprojected_kernel(True, True),
    "clear": reproject.clear_kernel,
    "start_step": lambda: reduce.start_step,
    "record_gauges": lambda: gauges.record_gauges,
    "eikonal": lambda: eikonal.spread,
    "surface": lambda: surface.signed_distances,
    "initial_strain": lambda: initial_strain_kernel(shape.BSPLINE),
}


@pytest.mark.parametrize("name", KERNELS)
def test_kernel_compiles_for_cuda(name, tmp_path):
    wp.compile_aot_module(KERNELS[name]().module, arch=ARCHITECTURE, module_dir=str(tmp_path), use_ptx=True)
    (ptx,) = tmp_path.glob("*.ptx")
    assert ".visible .entry" in ptx.read_text()


@pytest.mark.parametrize("name", ["scatter", "advance"])
def test_four_numbers_are_added_at_once_where_that_can_be(name, tmp_path):
    """And two of the pairs; translated down to machine code, so that the instructions are real ones."""
    module = KERNELS[name]().module
    for use_ptx in (True, False):
        wp.compile_aot_module(module, arch=HOPPER, module_dir=str(tmp_path), use_ptx=use_ptx)
    (ptx,) = tmp_path.glob("*.ptx")
    (machine_code,) = tmp_path.glob("*.cubin")
    assert machine_code.stat().st_size > 0
    sizes = set(re.findall(r"red\.relaxed\.gpu\.global\.add\.v(\d)\.f32", ptx.read_text()))
    assert sizes == ({"2", "4"} if name == "scatter" else {"4"})
    assert not re.findall(r"(?:atom|red)\.global\.add\.f32", ptx.read_text())


def test_nodes_are_read_four_numbers_at_a_time(tmp_path):
    wp.compile_aot_module(KERNELS["advance"]().module, arch=HOPPER, module_dir=str(tmp_path), use_ptx=True)
    (ptx,) = tmp_path.glob("*.ptx")
    assert len(re.findall(r"ld\.global\.v4\.f32", ptx.read_text())) == 27  # accelerations; velocities are not needed
