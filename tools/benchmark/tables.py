"""The benchmark's tables for the terminal."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from rich.table import Table

Record = Mapping[str, Any]
NS = "ns / particle-step"
GIGA, MEGA, MICRO = 1e9, 1e6, 1e-6


def tables(report: Record) -> Iterator[Table]:
    """A table or more for each section there is in a report."""
    for name, draw in DRAWN.items():
        if name in report:
            yield from draw(report[name])


def limits(records: Sequence[Record]) -> Iterator[Table]:
    """Memory bandwidth and multiply-add rate."""
    table = _table("Limits of this machine, measured", "threads", "memory, GB/s", "G multiply-adds/s")
    for record in records:
        bandwidth = _spread(record, "memory_bandwidth_bytes_per_s", GIGA)
        table.add_row(str(record["threads"]), bandwidth, _spread(record, "multiply_adds_per_s", GIGA))
    yield table


def phases(section: Record) -> Iterator[Table]:
    """A table for each number of threads."""
    for column in section["columns"]:
        title = (
            f"Phases of a step on {_count(column['threads'], 'thread')}: {section['particles']:,} particles, burning"
        )
        table = _table(title, "phase", NS, "bytes", "operations", "memory limit, ns", "arithmetic, ns", "% of limit")
        shown = [row for row in column["phases"] if row["ns_per_particle_step"] > 0.0]
        for row in shown:
            counted = row["limit_ns_per_particle_step"] > 0.0
            table.add_row(row["phase"], _spread(row), *(_counts(row) if counted else ["-"] * 5))
        table.add_section()
        total = {key: sum(row[key] for row in shown) for key in COUNTED}
        share = 100.0 * total["limit_ns_per_particle_step"] / column["ns_per_particle_step"]
        table.add_row("whole step", _spread(column), *_counts({**total, "percent_of_limit": share}))
        yield table


COUNTED = (
    "memory_bytes_per_particle_step",
    "operations_per_particle_step",
    "memory_limit_ns_per_particle_step",
    "arithmetic_limit_ns_per_particle_step",
    "limit_ns_per_particle_step",
)


def _counts(row: Record) -> list[str]:
    moved, done, by_memory, by_arithmetic, _ = (row[key] for key in COUNTED)
    return [f"{moved:.0f}", f"{done:.0f}", f"{by_memory:.1f}", f"{by_arithmetic:.1f}", f"{row['percent_of_limit']:.0f}"]


def variants(records: Sequence[Record]) -> Iterator[Table]:
    """A row for each shape function and order."""
    table = _table("Shape functions and orders", "shape", "order", "transfer", NS, "M particle-steps/s")
    for record in records:
        table.add_row(record["shape"], record["order"], record["transfer"], _spread(record), _speed(record))
    yield table


def threads(records: Sequence[Record]) -> Iterator[Table]:
    """A row for each number of threads."""
    table = _table("Threads", "threads", NS, "M particle-steps/s", "speed-up")
    for record in records:
        table.add_row(str(record["threads"]), _spread(record), _speed(record), _spread(record, "speed_up_ratio", 1, 2))
    yield table


def sizes(records: Sequence[Record]) -> Iterator[Table]:
    """A row for each size."""
    table = _table("Sizes", "particles", NS, "M particle-steps/s")
    for record in records:
        figures = ("left out", "-") if "skipped" in record else (_spread(record), _speed(record))
        table.add_row(f"{record['particles']:,}", *figures)
    yield table


def late(section: Record) -> Iterator[Table]:
    """A column for each instant."""
    instants = section["instants"]
    names = [f"{record['run']}, {record['instant']}" for record in instants]
    ratio = section["free_last_to_first_quarter_ratio"]
    title = f"Early and late, ns / particle-step; free: last quarter / first quarter = {ratio:.2f}"
    table = _table(title, "", *names)
    rows: dict[str, Callable[[Record], str]] = {
        "time, us": lambda r: f"{r['time_s'] / MICRO:.1f}",
        "steps": lambda r: str(r["steps"]),
        "mass inside, %": lambda r: f"{100.0 * r['share_of_mass_inside']:.1f}",
        "nodes per particle": lambda r: f"{r['nodes_per_particle']:.2f}",
    }
    for name, value in rows.items():
        table.add_row(name, *map(value, instants))
    table.add_section()
    for lines in zip(*(record["phases"] for record in instants), strict=True):
        table.add_row(lines[0]["phase"], *map(_spread, lines))
    table.add_section()
    table.add_row("whole step", *map(_spread, instants))
    yield table


def memory(record: Record) -> Iterator[Table]:
    """A row for each kind of memory."""
    table = _table(f"Memory of {record['particles']:,} particles", "what", "bytes / particle")
    words = {"particle_arrays": "arrays of particles", "grid_arrays": "arrays of nodes", "other_arrays": "other arrays"}
    words["peak_growth"] = "peak of the whole run"
    for key, word in words.items():
        value = record[f"{key}_bytes_per_particle"]
        table.add_row(word, "unknown" if value is None else f"{value:.0f}")
    yield table


DRAWN: dict[str, Callable[[Any], Iterator[Table]]] = {
    "limits": limits,
    "phases": phases,
    "variants": variants,
    "threads": threads,
    "sizes": sizes,
    "late": late,
    "memory": memory,
}


def _table(title: str, *columns: str) -> Table:
    table = Table(title=title, title_justify="left")
    for column in columns:
        table.add_column(column, justify="left" if column in WORDS else "right")
    return table


WORDS = ("", "phase", "shape", "order", "transfer", "what")


def _spread(record: Record, name: str = "ns_per_particle_step", unit: float = 1.0, digits: int = 1) -> str:
    low, middle, high = (record[f"{prefix}{name}"] / unit for prefix in ("lowest_", "", "highest_"))
    return f"{middle:.{digits}f} ({low:.{digits}f} - {high:.{digits}f})"


def _speed(record: Record) -> str:
    return f"{record['particle_steps_per_s'] / MEGA:.1f}"


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"
