"""The benchmark's picture: where the time of a step goes, beside what the machine's limits would allow.

The colours are those of Okabe and Ito, which colour-blind readers tell apart; every bar also says its number.
"""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.patches import Patch
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from benchmark.runs import SORT
from warp_mpm.output.figures.style import STYLE
from warp_mpm.output.whole_file import whole_file

Record = Mapping[str, Any]
NS = "ns_per_particle_step"
COLORS = ("#56b4e9", "#0072b2", "#009e73", "#f0e442", "#d55e00", "#333333", "#e69f00", "#cc79a7")
DARK = {"#0072b2", "#009e73", "#d55e00", "#333333"}  # on which white is read better
OTHERS, OTHERS_COLOR = "the rest", "#c8c8c8"
LEAST_SHOWN = 0.01  # of the longest phase: what takes less has no colour of its own
LINE = "#0072b2"
FAINT = "#777777"
SHORTEST_LABELLED = 0.05  # of the axis
SHAPE_COLORS = {"bspline": "#0072b2", "gimp": "#e69f00", "linear": "#009e73"}
SHAPE_NAMES = {"bspline": "B-spline", "gimp": "GIMP", "linear": "linear"}


def draw_report(report: Record, path: str | Path) -> bool:
    """Draw what a report has; returns whether that is anything.

    Raises:
        SimulationError: the file cannot be written.
    """
    rows = [[name for name in row if name in report] for row in (("phases", "late"), ("variants", "threads", "sizes"))]
    rows = [row for row in rows if row]
    if not rows:
        return False
    with rc_context({**STYLE, "axes.titleweight": "bold", "axes.titlelocation": "left"}):
        figure = Figure(figsize=(11.0, 0.9 + 3.1 * len(rows)), layout=ConstrainedLayoutEngine(w_pad=0.12, h_pad=0.08))
        bands = figure.subfigures(len(rows), 1, squeeze=False)[:, 0]
        colors = phase_colors(report)
        for band, row in zip(bands, rows, strict=True):
            for name, axes in zip(row, band.subplots(1, len(row), squeeze=False)[0], strict=True):
                PANELS[name](axes, report[name], colors)
            if "phases" in row or "late" in row:
                handles = [Patch(color=color, label=name) for name, color in colors.items()]
                band.legend(handles=handles, loc="outside lower center", ncols=5, handlelength=1.0)
        figure.suptitle(_caption(report), fontsize=9.0, color=FAINT, x=0.01, ha="left")
        FigureCanvasAgg(figure)
        with whole_file(path) as part:
            figure.savefig(part, format="png")
    return True


def phase_colors(report: Record) -> dict[str, str]:
    """Colours of the phases that take most of the time, in the order of the step, and one for the rest and the sort."""
    tables = [column["phases"] for column in report.get("phases", {}).get("columns", ())]
    tables += [instant["phases"] for instant in report.get("late", {}).get("instants", ())]
    longest: dict[str, float] = {}
    for row in (row for table in tables for row in table if row["phase"] != SORT):
        longest[row["phase"]] = max(longest.get(row["phase"], 0.0), row[NS])
    notable = [name for name, time in longest.items() if time > LEAST_SHOWN * max(longest.values())]
    shown = sorted(notable, key=lambda name: -longest[name])[: len(COLORS)]
    order = [name for name in longest if name in shown]
    return {**dict(zip(order, COLORS, strict=False)), OTHERS: OTHERS_COLOR}


def phases(axes: Axes, section: Record, colors: Mapping[str, str]) -> None:
    """For each number of threads what was measured, and below it what the limits would allow."""
    columns = section["columns"]
    axes.set_xlim(0.0, 1.15 * max(max(column[NS], _sum(column["phases"])) for column in columns))
    names = []
    for number, column in enumerate(columns):
        place = 2.4 * number
        _at_end(axes, place, _stack(axes, place, column["phases"], NS, colors), f"{column[NS]:.0f}")
        bound = _stack(axes, place + 1.0, column["phases"], f"limit_{NS}", colors)
        _at_end(axes, place + 1.0, bound, f"{bound:.0f}, or {100.0 * bound / column[NS]:.0f} %")
        names += [(place, _threads(column["threads"])), (place + 1.0, "limit")]
    _bars(axes, names)
    axes.set_title(f"Phases of a step, and what memory and arithmetic allow\n{section['particles']:,} particles")


def late(axes: Axes, section: Record, colors: Mapping[str, str]) -> None:
    """The phases at each instant."""
    instants = section["instants"]
    axes.set_xlim(0.0, 1.15 * max(max(instant[NS], _sum(instant["phases"])) for instant in instants))
    for number, instant in enumerate(instants):
        _at_end(axes, number, _stack(axes, number, instant["phases"], NS, colors), f"{instant[NS]:.0f}")
    _bars(axes, [(n, f"{record['run']},\n{record['instant']}") for n, record in enumerate(instants)])
    ratio = section["free_last_to_first_quarter_ratio"]
    axes.set_title(f"Early and late: {instants[0]['particles']:,} particles\nfree, last / first quarter: {ratio:.2f}")


def variants(axes: Axes, records: Sequence[Record], _: Mapping[str, str]) -> None:
    """A bar for each shape function, in groups of one order."""
    kinds = list(dict.fromkeys((record["order"], record["transfer"]) for record in records))
    shapes = list(dict.fromkeys(record["shape"] for record in records))
    axes.set_xlim(0.0, 1.15 * max(record[f"highest_{NS}"] for record in records))
    for record in records:
        place = kinds.index((record["order"], record["transfer"])) * (len(shapes) + 1) + shapes.index(record["shape"])
        axes.barh(
            place, record[NS], color=SHAPE_COLORS[record["shape"]], height=0.86, xerr=_range(record), ecolor=FAINT
        )
        _at_end(axes, place, record[f"highest_{NS}"], f"{record[NS]:.0f}")
    middle = 0.5 * (len(shapes) - 1)
    words = [f"{order.upper()}\n{'damped' if transfer == 'damped_flip' else 'plain'}" for order, transfer in kinds]
    _bars(axes, [(number * (len(shapes) + 1) + middle, word) for number, word in enumerate(words)])
    handles = [Patch(color=SHAPE_COLORS[shape], label=SHAPE_NAMES[shape]) for shape in shapes]
    axes.legend(
        handles=handles, loc="lower left", bbox_to_anchor=(-0.02, 0.985), ncols=3, handlelength=1.0, borderpad=0
    )
    axes.set_title("Shape functions and orders\n")


def threads(axes: Axes, records: Sequence[Record], _: Mapping[str, str]) -> None:
    """Time against threads, beside that of one thread shared equally."""
    counts = [record["threads"] for record in records]
    _line(axes, counts, records)
    label = "one thread's, shared equally"
    axes.plot(counts, [records[0][NS] / count for count in counts], color=FAINT, linestyle=":", label=label)
    axes.set_xscale("log", base=2)
    _ticks(axes, counts, "{:.0f}")
    axes.set_xlabel("threads")
    axes.legend(loc="lower left")
    axes.set_title("Threads\n")


def sizes(axes: Axes, records: Sequence[Record], _: Mapping[str, str]) -> None:
    """Time against the number of particles."""
    measured = [record for record in records if "skipped" not in record]
    counts = [record["particles"] / 1e6 for record in measured]
    _line(axes, counts, measured)
    axes.set_xscale("log")
    _ticks(axes, counts, "{:.2g}")
    axes.set_xlabel("million particles")
    axes.set_title("Sizes\n")


PANELS: dict[str, Callable[[Axes, Any, Mapping[str, str]], None]] = {
    "phases": phases,
    "late": late,
    "variants": variants,
    "threads": threads,
    "sizes": sizes,
}


def _sum(rows: Sequence[Record]) -> float:
    return sum(row[NS] for row in rows)


def _stack(axes: Axes, place: float, rows: Sequence[Record], key: str, colors: Mapping[str, str]) -> float:
    """A bar of phases end to end, and the rest of them; returns its length."""
    left = 0.0
    values = {row["phase"]: row[key] for row in rows}
    lengths = {name: values.get(name, 0.0) for name in colors if name != OTHERS}
    lengths[OTHERS] = sum(values.values()) - sum(lengths.values())
    for name, value in lengths.items():
        axes.barh(place, value, left=left, color=colors[name], height=0.86, edgecolor="white", linewidth=0.5)
        if value > SHORTEST_LABELLED * axes.get_xlim()[1]:
            ink = "white" if colors[name] in DARK else "black"
            axes.text(left + 0.5 * value, place, f"{value:.0f}", ha="center", va="center", color=ink, fontsize=7.5)
        left += value
    return left


def _at_end(axes: Axes, place: float, end: float, text: str) -> None:
    axes.text(end + 0.01 * axes.get_xlim()[1], place, text, va="center", fontsize=8.0)


def _bars(axes: Axes, names: Sequence[tuple[float, str]]) -> None:
    """Names of horizontal bars, the first on top."""
    axes.set_yticks([place for place, _ in names], [name for _, name in names])
    axes.tick_params(axis="y", length=0.0)
    axes.invert_yaxis()
    axes.set_xlabel("ns per particle and step")


def _line(axes: Axes, places: Sequence[float], records: Sequence[Record]) -> None:
    """Medians with their range, each with its number, from zero on."""
    middle = [record[NS] for record in records]
    ranges = [[_range(record)[side][0] for record in records] for side in (0, 1)]
    axes.errorbar(places, middle, yerr=ranges, color=LINE, marker="o", markersize=4.0, ecolor=FAINT, capsize=2.0)
    for place, record in zip(places, records, strict=True):
        offset: dict[str, Any] = {"xytext": (0.0, 5.0), "textcoords": "offset points"}
        axes.annotate(f"{record[NS]:.0f}", (place, record[f"highest_{NS}"]), ha="center", fontsize=8.0, **offset)
    axes.set_ylim(0.0, 1.15 * max(record[f"highest_{NS}"] for record in records))
    axes.set_ylabel("ns per particle and step")
    axes.margins(x=0.1)


def _range(record: Record) -> list[list[float]]:
    """How far the lowest and the highest are from the median."""
    return [[record[NS] - record[f"lowest_{NS}"]], [record[f"highest_{NS}"] - record[NS]]]


def _ticks(axes: Axes, places: Sequence[float], form: str) -> None:
    axes.xaxis.set_major_locator(FixedLocator(list(places)))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: form.format(value)))


def _threads(number: int) -> str:
    return f"{number} thread{'' if number == 1 else 's'}"


def _caption(report: Record) -> str:
    machine, versions = report["machine"], report["versions"]
    words = f"{machine['processor'] or machine['system']}, {machine['cores']} cores"
    if machine["device"] != "CPU":
        words = machine["device"]
    rates = report.get("limits", ())
    if rates:
        bandwidth, rate = (rates[-1][key] / 1e9 for key in ("memory_bandwidth_bytes_per_s", "multiply_adds_per_s"))
        words += f": {bandwidth:.0f} GB/s, {rate:.0f} G multiply-adds/s"
    return f"{words}   |   warp_mpm {versions['warp_mpm']}, Warp {versions['warp']}"
