"""On a CPU the answer is the same, bit for bit: again, on more threads, and whatever is saved and how often."""

from functools import cache

import numpy as np
import pytest

from warp_mpm import launch
from warp_mpm.config import Layout, Save
from warp_mpm.scene_loading import load_scene
from warp_mpm.simulation import Result, simulate
from warp_mpm.state import PARTICLE_ARRAYS

NUMBERS = Save(frames=2, figures=False)
OTHER_WAYS = {
    "again": {},
    "on three threads": {"threads": 3},
    "with more frames": {"save": Save(frames=31, figures=False)},
    "with other frames in files": {
        "save": Save(
            frames=8, fields=("density", "particleVelocity"), layout=Layout.CLIPS, isosurface=1e9, figures=False
        ),
        "output": "run",
    },
    "with checkpoints": {"save": Save(frames=2, checkpoint_steps=1, figures=False), "output": "run"},
}


def run(**settings) -> Result:
    """A plate in the open, from which gas leaves."""
    scene = load_scene("two_point", cell_size=2e-2, confinement="free")
    return simulate(scene, **{"save": NUMBERS, "device": "cpu", "threads": 1, **settings})


@cache
def reference() -> tuple[dict[str, bytes], dict[str, object]]:
    return answer(run())


def answer(result: Result) -> tuple[dict[str, bytes], dict[str, object]]:
    """All particles at the end and the record of every step; and the figures that do not depend on when one looks."""
    particles = {}
    for name in PARTICLE_ARRAYS:
        array = getattr(result.state.particles, name).numpy()
        particles |= {f"{name}.{field}": array[field].tobytes() for field in array.dtype.names or (...,)}
    record = {name: np.asarray(value).tobytes() for name, value in vars(result.record).items() if name in RECORDED}
    figures = {name: result.summary[name] for name in FIGURES}
    return {**particles, **record}, figures


RECORDED = ("time", "dt", "particle_pressure", "field_pressure", "point_pressures")
FIGURES = (
    "steps",
    "front_pressure_pa",
    "front_speed_m_s",
    "collision_pressure_pa",
    "peak_pressure_pa",
    "gauges",
    "mass_out_kg",
)


@pytest.mark.parametrize("settings", OTHER_WAYS.values(), ids=OTHER_WAYS)
def test_the_answer_is_the_same(settings, tmp_path, monkeypatch):
    monkeypatch.setattr(launch, "SMALLEST_SHARED_WORK", 0)  # so that all threads work
    monkeypatch.chdir(tmp_path)
    arrays, figures = answer(run(**settings))
    others, others_figures = reference()
    assert figures == others_figures
    assert [name for name, values in arrays.items() if values != others[name]] == []
    assert arrays.keys() == others.keys()
