"""Double precision; `test_precision.py` runs these in a process of its own, because a process has one precision.

A free plate is lit at both ends of its mid-line, until its gas is thin but has not left the domain. `EXACT` is a
thousand roundings, 1.1e-16 each, over 40 steps in which gas that flies apart amplifies them; 1e-14 was seen. A single
number that is still held or computed in single precision, 6e-8, is beyond it by orders of magnitude.
"""

import json

import numpy as np
import pytest
from scenes_for_tests import CELL, OPEN, block

from warp_mpm.config import Save
from warp_mpm.detonators import PointDetonator
from warp_mpm.kernels.precision import PRECISION
from warp_mpm.simulation import simulate

PLATE = (4, 8, 3)  # cells
EXACT = 1e-12


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    """The run, with all its files."""
    x, y, z = (cells * CELL for cells in PLATE)
    ends = [PointDetonator((x / 2, 0.0, z / 2)), PointDetonator((x / 2, y, z / 2))]
    scene = block(PLATE, detonators=ends, walls=OPEN, margin_cells=3, end_time=40e-6)
    return simulate(scene, save=Save(frames=3), output=tmp_path_factory.mktemp("double"))


def test_results_say_so(result):
    assert PRECISION == "double"
    assert json.loads((result.output / "summary.json").read_text())["precision"] == "double"
    assert result.state.positions().dtype == np.float64
    assert result.state.field_pressure().dtype == np.float64


@pytest.mark.parametrize("conserved", ["energy", "mass", "momentum"])
def test_it_is_conserved_to_round_off(result, conserved):
    assert result.summary[f"{conserved}_error"] < EXACT


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_mirror_images_are_equal_to_round_off(result, axis):
    field = result.state.field_pressure()
    assert field.max() > 0.0
    np.testing.assert_allclose(field, np.flip(field, axis), rtol=0, atol=EXACT * field.max())


def test_files_hold_what_viewers_read(result):
    """USD has no double points: positions come as their roundings."""
    from pxr import Usd, UsdGeom

    stage = Usd.Stage.Open(str(result.output / "block.usdc"))
    (points,) = (UsdGeom.Points(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.Points))
    last = np.array(points.GetPointsAttr().Get(stage.GetEndTimeCode()))
    np.testing.assert_array_equal(last, result.state.positions().astype(np.float32))
