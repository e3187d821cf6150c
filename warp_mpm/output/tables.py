"""The numbers of a run: history.csv, gauges.csv, summary.json, and the tables that a person reads at the end."""

import csv
import io
import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from enum import Enum
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table

from warp_mpm.checks import instance
from warp_mpm.output.whole_file import whole_file, write_error
from warp_mpm.scene import Gauge

GIGAPASCAL = 1e9  # [Pa]
MEGAPASCAL = 1e6  # [Pa]
KILOPASCAL = 1e3  # [Pa]
SMALL = 0.1 * GIGAPASCAL  # lower pressures are shown in MPa [Pa]
MICROSECOND = 1e-6  # [s]
DASH = "–"
NOTHING = f"{DASH} nothing"  # what a gauge in vacuum saw


# Columns of a gauge, after its name, in the order of its lanes in the record; the last three of moving ones alone.
GAUGE_COLUMNS = (
    "pressure_pa",
    *(f"velocity_{axis}_m_s" for axis in "xyz"),
    "density_kg_m3",
    *(f"{axis}_m" for axis in "xyz"),
)
PLACE_COLUMNS = 3


class TableWriter:
    """A CSV file in the making; rows are on disk when `write` or `extend` returns."""

    def __init__(self, path: str | Path, columns: Sequence[str], rows: Iterable[Sequence[Any]] = ()) -> None:
        """Start the file with its header and some rows, in the order of the columns; until then an older one stays.

        Raises:
            SimulationError: the file system refuses.
        """
        self._path = Path(path)
        self._columns = tuple(columns)
        with whole_file(self._path) as part:
            part.write_bytes(_csv([self._columns, *rows]).encode())
        try:
            self._file = self._path.open("ab", buffering=0)  # what is kept back could not be written at the end either
        except OSError as error:
            raise write_error(self._path, error) from error

    def __enter__(self) -> "TableWriter":
        """The writer itself."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        """Close the file."""
        self.close()

    def write(self, row: Mapping[str, Any]) -> None:
        """Add a row; numbers are written so that they read back exactly, what is not a finite number stays empty.

        Raises:
            KeyError: a column is missing.
            SimulationError: the disk is full or refuses.
        """
        self.extend([row_values(row, self._columns)])

    def extend(self, rows: Iterable[Sequence[Any]]) -> None:
        """Add rows whose values are in the order of the columns, and are written as they are; all of them or none.

        Raises:
            SimulationError: the disk is full or refuses.
        """
        end = self._file.tell()
        left = memoryview(_csv(rows).encode())
        try:
            while left:
                left = left[self._file.write(left) :]
        except OSError as error:
            with suppress(OSError):
                self._file.truncate(end)
            raise write_error(self._path, error) from error

    def close(self) -> None:
        """Close the file. May be called twice."""
        self._file.close()


def row_values(row: Mapping[str, Any], columns: Iterable[str]) -> list[Any]:
    """The row's values in the order of the columns; numbers as they read back exactly, "" for what is not finite.

    Raises:
        KeyError: a column is missing.
    """
    values = [_plain(row[name]) for name in columns]
    return ["" if value is None else value for value in values]


def _csv(rows: Iterable[Sequence[Any]]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()


def gauge_columns(gauges: Sequence[Gauge]) -> list[str]:
    """The header of gauges.csv: the time, and for each gauge its name with what was recorded."""
    names = np.array([[f"{gauge.name}_{column}" for column in GAUGE_COLUMNS] for gauge in gauges])
    return ["time_s", *names[_written(gauges)]]


def gauge_rows(gauges: Sequence[Gauge], time: np.ndarray, values: np.ndarray) -> Iterator[list[str]]:
    """Rows of gauges.csv from times (steps,) [s] and values (steps, gauges, 8); numbers read back exactly."""
    table = values[:, _written(gauges)]
    for now, row in zip(time.astype(str), np.where(np.isfinite(table), table.astype(str), ""), strict=True):
        yield [now, *row]


def _written(gauges: Sequence[Gauge]) -> np.ndarray:
    """Which lanes of which gauges (gauges, 8) are written."""
    written = np.ones((len(gauges), len(GAUGE_COLUMNS)), dtype=bool)
    written[[not gauge.moving for gauge in gauges], -PLACE_COLUMNS:] = False
    return written


def write_summary(path: str | Path, summary: Mapping[str, Any]) -> None:
    """Write summary.json; under its name it is always whole. What is not a finite number becomes null.

    Raises:
        SimulationError: the disk is full or refuses.
    """
    text = json.dumps(_plain(summary), indent=2, ensure_ascii=False, allow_nan=False)
    with whole_file(path) as part:
        part.write_text(f"{text}\n", encoding="utf-8")


def print_summary(summary: Mapping[str, Any], console: Console | None = None) -> None:
    """Print the figures of a run beside theory, its errors, what it cost, and its warnings.

    Args:
        summary: as in summary.json; what is missing or null shows as a dash.
        console: where to; standard output if not given.

    Raises:
        InputError: it is none.
    """
    instance("print_summary: summary", summary, Mapping, "a summary", "a Result and a Run have one: .summary")
    console = console or Console()
    console.print(theory_table(summary))
    if summary.get("gauges"):
        console.print(gauge_table(summary["gauges"]))
    console.print(_errors(summary), highlight=False, markup=False, soft_wrap=True)
    console.print(_cost(summary), highlight=False, markup=False, soft_wrap=True)
    for warning in summary.get("warnings") or ():
        console.print(f"warning: {warning}", style="yellow", highlight=False, markup=False, soft_wrap=True)


def theory_table(summary: Mapping[str, Any]) -> Table:
    """The front and the collision as computed, and as Chapman-Jouguet theory has them."""
    cj_pressure, cj_speed = summary.get("p_cj_pa"), summary.get("detonation_speed_m_s")
    front, collision = summary.get("front_pressure_pa"), summary.get("collision_pressure_pa")
    contact = None if collision is None else summary.get("collision_theory_pa")
    ratio = _ratio(contact, cj_pressure)
    rows = [
        ("front pressure", front, cj_pressure, "p_CJ", _pressure),
        ("front speed", summary.get("front_speed_m_s"), cj_speed, "D", _speed),
        ("collision pressure", collision, contact, f"{_number(ratio)} p_CJ *", _pressure),
        ("collision / front", _ratio(collision, front), ratio, "*", _number),
        ("peak pressure", summary.get("peak_pressure_pa"), None, "", _pressure),
        ("peak at a particle", summary.get("max_particle_pressure_pa"), None, "", _pressure),
    ]
    table = Table(title=str(summary.get("scene", "run")), title_justify="left", title_style="bold", box=box.SIMPLE_HEAD)
    table.add_column("")
    for heading in ("run", "theory"):
        table.add_column(heading, justify="right")
    table.add_column("")
    table.add_column("run / theory", justify="right")
    for name, value, theory, symbol, shown in rows:
        known = theory is not None
        table.add_row(name, shown(value), shown(theory), symbol if known else "", _number(_ratio(value, theory)))
    if contact is not None:
        table.caption, table.caption_justify = "* plane fronts at the instant of contact", "left"
    return table


def gauge_table(gauges: Mapping[str, Mapping[str, float | None]]) -> Table:
    """What the gauges saw, a row each."""
    table = Table(box=box.SIMPLE_HEAD)
    table.add_column("gauge")
    for heading in ("arrival", "peak pressure", "at", "impulse"):
        table.add_column(heading, justify="right")
    for name, figures in gauges.items():
        peak, impulse = figures.get("peak_pressure_pa"), figures.get("impulse_pa_s")
        table.add_row(
            name,
            _time(figures.get("arrival_time_s")),
            NOTHING if peak is None else _pressure(peak),
            _time(figures.get("peak_time_s")),
            DASH if impulse is None else f"{impulse / KILOPASCAL:.1f} kPa s",
        )
    return table


def _errors(summary: Mapping[str, Any]) -> str:
    """One line with the relative errors of the conserved quantities."""
    errors = (f"{name} {_error(summary.get(f'{name}_error'))}" for name in ("mass", "momentum", "energy"))
    return f"errors: {', '.join(errors)}"


def _cost(summary: Mapping[str, Any]) -> str:
    """What was computed, how long it took, and on what."""
    time = _time(summary.get("end_time_s"))
    size = f"{_count(summary.get('particles'))} particles, {_count(summary.get('steps'))} steps to {time}"
    wall, speed = summary.get("wall_s"), summary.get("ns_per_particle_step")
    seconds = DASH if wall is None else f"{wall:.1f} s"
    each = DASH if speed is None else f"{speed:.1f} ns"
    precision = f" in {summary['precision']} precision" if summary.get("precision") else ""
    return f"{size} in {seconds} on {summary.get('device') or DASH}{precision}, {each} per particle-step"


def _pressure(value: float | None) -> str:
    if value is None:
        return DASH
    return f"{value / GIGAPASCAL:.3f} GPa" if not 0.0 < value < SMALL else f"{value / MEGAPASCAL:.2f} MPa"


def _time(value: float | None) -> str:
    return DASH if value is None else f"{value / MICROSECOND:.1f} µs"


def _speed(value: float | None) -> str:
    return DASH if value is None else f"{value:.1f} m/s"


def _number(value: float | None) -> str:
    return DASH if value is None else f"{value:.3f}"


def _error(value: float | None) -> str:
    return DASH if value is None else f"{value:.1e}"


def _count(value: int | None) -> str:
    return DASH if value is None else f"{value:,}"


def _ratio(value: float | None, other: float | None) -> float | None:
    return None if value is None or not other else value / other


def _plain(value: Any) -> Any:
    """The value as JSON and CSV know it; None for a number that is not finite."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if isinstance(value, Enum):
        return _plain(value.value)
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    return str(value)
