"""One picture a problem: the exact curve, and the computed one at each level.

matplotlib is an optional dependency, so import this module only to draw.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import colormaps, rc_context
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from warp_mpm.output.figures.style import SERIES, STYLE
from warp_mpm.output.whole_file import whole_file
from warp_mpm.verification.problem import Axis, Curve, LevelResult, Panel
from warp_mpm.verification.session import ProblemReport, words_of

EXACT_COLOR = "#1b1b1b"
LEVEL_COLORS = colormaps["viridis"]  # from coarse to fine; its lightness changes evenly, for colour-blind readers too
VARIANT_COLORS = (*(color for color in SERIES if color != EXACT_COLOR), "#009e73", "#8c5a2b")
VARIANT_LINES = ("-", "--", "-.", ":")
FAINTEST = 0.35  # the coarsest level of a variant
PANEL_WIDTH, PANEL_HEIGHT, LEAST_WIDTH = 4.0, 3.2, 5.6  # [inch]
LABEL_WIDTH, LETTER_WIDTH = 0.6, 0.065  # of an entry of the legend and of each letter in it [inch]


def draw_problem(path: str | Path, report: ProblemReport) -> None:
    """Draw the panels of a problem side by side.

    Levels run from light to dark as they get finer; of several variants each has its own colour and kind of line.

    Args:
        path: the PNG file to write.
        report: with at least one level solved, of a problem that has panels.

    Raises:
        SimulationError: the file cannot be written.
    """
    panels = report.problem.panels
    with rc_context(STYLE):
        width = max(LEAST_WIDTH, PANEL_WIDTH * len(panels))
        figure = Figure(figsize=(width, PANEL_HEIGHT + 0.7), layout="constrained")
        diagrams = figure.subplots(1, len(panels), squeeze=False)[0]
        for panel, axes in zip(panels, diagrams, strict=True):
            _draw_panel(axes, panel, report)
        labels: dict[str, Artist] = {}
        for axes in diagrams:  # a level need not have a curve in every panel
            for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
                labels.setdefault(label, handle)
        columns = max(1, int(width / (LABEL_WIDTH + LETTER_WIDTH * max(len(label) for label in labels))))
        figure.legend(list(labels.values()), list(labels), loc="outside lower center", ncols=columns)
        figure.suptitle(report.problem.title, fontsize=10.0)
        with whole_file(path) as part:
            part.parent.mkdir(parents=True, exist_ok=True)
            FigureCanvasAgg(figure).print_figure(str(part), format="png", bbox_inches="tight", pad_inches=0.05)


def _draw_panel(axes: Axes, panel: Panel, report: ProblemReport) -> None:
    """The exact (or measured) curves below, the computed ones on top."""
    for number, curve in enumerate(_exact_curves(panel, report)):
        label = report.problem.answer if number == 0 else None
        _plot(axes, panel, curve, color=EXACT_COLOR, linewidth=2.6, alpha=0.45, label=label)
    for result, style in zip(report.results, _styles(report.results), strict=True):
        computed = result.measurement.curves.get(panel.name)
        if computed is not None:
            _plot(axes, panel, computed, linewidth=1.1, label=words_of(result.level), **style)
    axes.set_xlabel(_text(panel.x))
    axes.set_ylabel(_text(panel.y))


def _plot(axes: Axes, panel: Panel, curve: Curve, **style: Any) -> None:
    axes.plot(curve.x / panel.x.scale, curve.y / panel.y.scale, **style)


def _exact_curves(panel: Panel, report: ProblemReport) -> list[Curve]:
    """The different exact curves of a panel: one for each variant, or one for all."""
    finest = {result.level.variant: result.level for result in report.results}
    curves: list[Curve] = []
    for level in finest.values():
        curve = report.problem.exact_curves(level).get(panel.name)
        if curve is not None and not any(_same(curve, other) for other in curves):
            curves.append(curve)
    return curves


def _same(one: Curve, other: Curve) -> bool:
    return all(np.array_equal(a, b) for a, b in zip(one, other, strict=True))


def _styles(results: Sequence[LevelResult]) -> list[dict[str, Any]]:
    """Colour and line of each level."""
    variants = list(dict.fromkeys(result.level.variant for result in results))
    styles: list[dict[str, Any]] = []
    for result in results:
        number = variants.index(result.level.variant)
        ladder = [other.level.cells for other in results if other.level.variant == result.level.variant]
        fineness = (ladder.index(result.level.cells) + 1) / len(ladder)
        if len(variants) == 1:
            styles.append({"color": LEVEL_COLORS(0.9 - 0.75 * fineness)})
        else:
            color = VARIANT_COLORS[number % len(VARIANT_COLORS)]
            alpha = FAINTEST + (1.0 - FAINTEST) * (fineness if len(ladder) > 1 else 1.0)
            styles.append({"color": color, "alpha": alpha, "linestyle": VARIANT_LINES[number % len(VARIANT_LINES)]})
    return styles


def _text(axis: Axis) -> str:
    unit = axis.unit.replace("us", "µs").replace("m3", "m³")
    return f"{axis.label} [{unit}]" if unit else axis.label
