"""The soak command: what it runs, what it finds fault with, and the one scene whose liquid was once its undoing."""

import importlib
import json
import sys
from pathlib import Path

import pytest
from scenes_for_tests import ORDERS_AND_TRANSFERS

from warp_mpm.config import ShapeFunction, SolverConfig
from warp_mpm.errors import SimulationError

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tools"))  # it is a program beside the package
soak = importlib.import_module("soak")

GOOD = {
    "energy_error": 1e-7,
    "mass_error": 1e-7,
    "memory_growth_ratio": 0.01,
    "highest_particle_pressure_pa": 2e9,
    "highest_late_particle_pressure_pa": 4e9,
}


def test_every_combination_is_soaked_the_defaults_first():
    cases = list(soak.cases(["two_point", "tnt_slab"], 3.0, defaults=False))
    combinations = len(ShapeFunction) * len(ORDERS_AND_TRANSFERS)
    assert [case.parameters.get("confinement") for case in cases] == [
        *(["rigid"] * combinations),
        *(["free"] * combinations),
        *([None] * combinations),
    ]
    assert len({(case.scene, str(case.parameters), case.settings) for case in cases}) == 3 * combinations
    assert [case.is_default for case in cases] == 3 * [True, *([False] * (combinations - 1))]
    assert [case.config for case in soak.cases(["tnt_slab"], 3.0, defaults=True)] == [SolverConfig()]


@pytest.mark.parametrize(
    ("key", "value", "word"),
    [
        ("energy_error", 2e-5, "energy"),
        ("energy_error", float("nan"), "energy"),
        ("mass_error", 2e-6, "mass"),
        ("memory_growth_ratio", 0.06, "memory"),
        ("highest_late_particle_pressure_pa", 6e9, "late pressures"),
    ],
)
def test_what_a_run_did_not_keep(key, value, word):
    assert soak.faults(GOOD) == []
    assert soak.faults({**GOOD, "memory_growth_ratio": None}) == []
    (fault,) = soak.faults({**GOOD, key: value})
    assert fault.startswith(word)


def test_pulled_water_neither_clumps_nor_runs_away():
    """The lens of the wave shaper, long after the charge is gone: single particles once came to 400 p_CJ."""
    (case,) = soak.cases(["wave_shaper"], 3.0, defaults=True)
    row = soak.soak(case, 10.0)
    assert row["verdict"] == "held"
    assert row["highest_late_particle_pressure_pa"] < row["highest_particle_pressure_pa"]


def test_a_guard_that_stops_a_run_is_an_answer(monkeypatch):
    def stop(*arguments):
        raise SimulationError("step 7: a particle's energy is not a number")

    monkeypatch.setattr(soak, "run", stop)
    (case,) = soak.cases(["tnt_slab"], 3.0, defaults=True)
    row = soak.soak(case, 10.0)
    assert row["verdict"].startswith("stopped at")
    assert "step 7" in row["guard"]


def test_the_command(tmp_path, capsys, monkeypatch):
    """Exit code 0 and a table of all runs where the defaults hold, 1 where they do not, 2 for nonsense."""
    words = ["soak", "taylor_wave", "--defaults", "--times", "1.2", "--coarser", "8", "-o", str(tmp_path)]
    monkeypatch.setattr(sys, "argv", words)
    assert soak.main() == 0
    assert "taylor_wave" in capsys.readouterr().out
    (row,) = json.loads((tmp_path / "soak.json").read_text())["runs"]
    assert row["verdict"] == "held"
    assert row["steps"] > 20
    monkeypatch.setattr(soak, "LARGEST_ENERGY_ERROR", 0.0)
    assert soak.main() == 1
    monkeypatch.setattr(sys, "argv", ["soak", "no_such_scene"])
    assert soak.main() == 2
    assert "no_such_scene" in capsys.readouterr().err
