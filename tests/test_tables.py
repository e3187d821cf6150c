"""history.csv, summary.json and the table at the end of a run."""

import csv
import io
import json
from enum import Enum
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from warp_mpm.errors import SimulationError
from warp_mpm.output.tables import TableWriter, print_summary, write_summary

SUMMARY = {
    "scene": "two_point",
    "particles": 499016,
    "steps": 420,
    "end_time_s": 143e-6,
    "wall_s": 55.24,
    "device": "CPU",
    "ns_per_particle_step": 71.23,
    "p_cj_pa": 2.0e9,
    "detonation_speed_m_s": 2800.0,
    "front_pressure_pa": 1.5e9,
    "front_speed_m_s": 2803.0,
    "collision_pressure_pa": 3.6e9,
    "collision_theory_pa": 4.6e9,
    "peak_pressure_pa": 8.7e9,
    "max_particle_pressure_pa": 9.1e9,
    "mass_error": 1.2e-8,
    "momentum_error": 2.3e-7,
    "energy_error": 3.4e-6,
    "warnings": [],
}


class Shape(Enum):
    """A setting."""

    BSPLINE = "bspline"


def rows_of(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def printed(summary: dict) -> str:
    text = io.StringIO()
    print_summary(summary, Console(file=text, width=100))
    return text.getvalue()


def line_with(text: str, start: str) -> list[str]:
    """The words of the line that starts so, after that."""
    (line,) = (line.strip() for line in text.splitlines() if line.strip().startswith(start))
    return line.removeprefix(start).split()


def test_history_is_on_disk_row_by_row_and_reads_back_exactly(tmp_path):
    times = [0.1 + 0.2, np.float64(1) / 3, np.float32(0.1)]
    with TableWriter(tmp_path / "history.csv", ["time_s", "step"]) as history:
        for count, time in enumerate(times, start=1):
            history.write({"step": count, "time_s": time, "not a column": 7})
            assert len(rows_of(tmp_path / "history.csv")) == count
    rows = rows_of(tmp_path / "history.csv")
    assert list(rows[0]) == ["time_s", "step"]
    assert [float(row["time_s"]) for row in rows] == [float(time) for time in times]
    assert [int(row["step"]) for row in rows] == [1, 2, 3]


def test_history_leaves_out_what_is_no_number(tmp_path):
    with TableWriter(tmp_path / "history.csv", ["a", "b", "c"]) as history:
        history.write({"a": np.nan, "b": float("inf"), "c": 1.0})
    assert rows_of(tmp_path / "history.csv") == [{"a": "", "b": "", "c": "1.0"}]


def test_history_misses_no_column(tmp_path):
    with TableWriter(tmp_path / "history.csv", ["a", "b"]) as history, pytest.raises(KeyError, match="b"):
        history.write({"a": 1.0})


def test_summary_is_plain_json(tmp_path):
    summary = {
        "nan": float("nan"),
        "infinite": -np.inf,
        "integer": np.int64(3),
        "array": np.array([1.0, np.nan]),
        "tuple": (1, 2.5),
        "enum": Shape.BSPLINE,
        "path": Path("a") / "b",
        "nested": {"bool": True, "none": None, "float32": np.float32(0.5)},
        "text": "µs",
    }
    write_summary(tmp_path / "summary.json", summary)
    assert [file.name for file in tmp_path.iterdir()] == ["summary.json"]
    assert json.loads((tmp_path / "summary.json").read_text(encoding="utf-8")) == {
        "nan": None,
        "infinite": None,
        "integer": 3,
        "array": [1.0, None],
        "tuple": [1, 2.5],
        "enum": "bspline",
        "path": str(Path("a") / "b"),
        "nested": {"bool": True, "none": None, "float32": 0.5},
        "text": "µs",
    }


def test_a_summary_that_cannot_be_replaced_stays_whole(tmp_path, monkeypatch):
    path = tmp_path / "summary.json"
    write_summary(path, {"steps": 1})

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.replace", full)
    with pytest.raises(SimulationError, match=r"cannot write .*summary\.json: No space left"):
        write_summary(path, {"steps": 2})
    assert json.loads(path.read_text()) == {"steps": 1}
    assert [file.name for file in tmp_path.iterdir()] == ["summary.json"]


@pytest.mark.parametrize("write", [write_summary, TableWriter])
def test_a_file_that_cannot_be_made_is_one_line(tmp_path, write):
    (tmp_path / "file").write_text("not a directory")
    with pytest.raises(SimulationError, match="cannot write") as caught:
        write(tmp_path / "file" / "table", {})
    assert "\n" not in str(caught.value)


def test_the_table_sets_the_run_beside_theory():
    text = printed(SUMMARY)
    assert line_with(text, "front pressure") == ["1.500", "GPa", "2.000", "GPa", "p_CJ", "0.750"]
    assert line_with(text, "front speed") == ["2803.0", "m/s", "2800.0", "m/s", "D", "1.001"]
    contact = ["3.600", "GPa", "4.600", "GPa", "2.300", "p_CJ", "*", "0.783"]
    assert line_with(text, "collision pressure") == contact
    assert line_with(text, "collision / front") == ["2.400", "2.300", "*", "1.043"]
    assert line_with(text, "errors:") == ["mass", "1.2e-08,", "momentum", "2.3e-07,", "energy", "3.4e-06"]
    assert "499,016 particles, 420 steps to 143.0 µs in 55.2 s on CPU, 71.2 ns per particle-step" in text
    assert "warning" not in text


def test_small_pressures_are_in_megapascal():
    gauge = {"arrival_time_s": 1e-6, "peak_pressure_pa": 12.34e6, "peak_time_s": 2e-6, "impulse_pa_s": 1e3}
    text = printed(SUMMARY | {"gauges": {"far": gauge, "near": gauge | {"peak_pressure_pa": 0.1e9}}})
    assert line_with(text, "far")[2:4] == ["12.34", "MPa"]
    assert line_with(text, "near")[2:4] == ["0.100", "GPa"]


def test_a_gauge_in_vacuum_saw_nothing():
    """Unlike one in an explosive without pressure, which the wave did not come to."""
    vacuum = dict.fromkeys(("arrival_time_s", "peak_pressure_pa", "peak_time_s", "impulse_pa_s"))
    unlit = vacuum | {"peak_pressure_pa": 0.0, "impulse_pa_s": 0.0}
    text = printed(SUMMARY | {"gauges": {"far": vacuum, "unlit": unlit}})
    assert line_with(text, "far") == ["–", "–", "nothing", "–", "–"]
    assert line_with(text, "unlit") == ["–", "0.000", "GPa", "–", "0.0", "kPa", "s"]


@pytest.mark.parametrize("missing", [None, "absent"])
def test_what_does_not_apply_is_a_dash(missing):
    summary = {key: None for key in SUMMARY} if missing is None else {}
    text = printed(summary | {"scene": "gas", "warnings": []})
    assert line_with(text, "front pressure") == ["–", "–", "–"]
    assert line_with(text, "collision pressure") == ["–", "–", "–"]
    assert line_with(text, "errors:") == ["mass", "–,", "momentum", "–,", "energy", "–"]
    assert "None" not in text


def test_warnings_are_printed_as_they_are():
    warning = "energy [J/kg] is not the one that fits; [bold]a long line[/bold] " + 20 * "stays one line "
    assert f"warning: {warning}".rstrip() in printed(SUMMARY | {"warnings": [warning]})
