"""What a verification problem is, and what comes out of solving it.

A `Problem` makes a scene for each of its levels and measures what the solver made of it. It is run by
`warp_mpm.verification.session`, which also simulates, times, and adds what every problem is asked for: errors of
energy, mass and momentum. Everything here is plain immutable data in SI units.

To add a problem, add one file to `warp_mpm/verification/problems/` with a subclass of `Problem` and a line
`PROBLEMS = (MyProblem(),)`; nothing else has to know of it. `problems/taylor_rigid.py` is the pattern: choices at the
top (levels, panels, bounds), then `scene`, `measure` and `exact_curves`. The tests shrink and run it from then on.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import NamedTuple

import numpy as np

from warp_mpm.config import SolverConfig
from warp_mpm.result import Result
from warp_mpm.scene import Scene

# ---- what is asked ---------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Level:
    """One row of a problem's table: a resolution, and whatever else differs between its rows."""

    cells: int  # across the length that the problem names in `cells_across`
    settings: Mapping[str, float] = field(default_factory=dict)  # the problem's own: overspeed, particles_per_axis, ...

    @property
    def variant(self) -> str:
        """The settings in words; levels of equal words are refinements of each other. Empty without settings."""
        return " ".join(f"{name}={value:g}" for name, value in self.settings.items())


def ladder(*cells: int, **settings: float) -> tuple[Level, ...]:
    """Levels of the given resolutions, coarsest first, with the same settings."""
    return tuple(Level(count, settings) for count in cells)


@dataclass(frozen=True)
class Bound:
    """A figure has to lie between `low` and `high`, at every level of at least `from_cells` cells with these settings.

    Figures are named as in `LevelResult.figures`: "pressure_l1", "density_linf", "pressure_l1_order" (against the next
    coarser level; the coarsest has none), "energy_error", what the problem measured, or what `overall` returned.
    """

    figure: str
    low: float | None = None
    high: float | None = None
    why: str = ""  # where the number is from, in a few words
    from_cells: int = 0
    settings: Mapping[str, float] = field(default_factory=dict)  # empty: whatever the level's are
    aim: bool = False  # where the solver should get to one day: a miss is shown, and breaks nothing

    def applies_to(self, level: Level) -> bool:
        """Whether this level is fine enough and has the bound's settings."""
        same = all(level.settings.get(name) == value for name, value in self.settings.items())
        return level.cells >= self.from_cells and same

    def margin(self, value: float) -> float:
        """How far inside a value lies, negative outside; not-a-number is infinitely far outside."""
        if math.isnan(value):
            return -math.inf
        low = math.inf if self.low is None else value - self.low
        high = math.inf if self.high is None else self.high - value
        return min(low, high)

    def holds_for(self, value: float) -> bool:
        """Whether a value lies within; not-a-number never does."""
        return self.margin(value) >= 0.0


class Axis(NamedTuple):
    """An axis of a picture: what it shows, in which unit, and how much of the SI unit that is."""

    label: str
    unit: str = ""
    scale: float = 1.0


class Panel(NamedTuple):
    """One diagram of a problem's picture."""

    name: str  # the key of its curves
    x: Axis
    y: Axis


class Curve(NamedTuple):
    """A line in a panel: x and y, (n,) each, SI units."""

    x: np.ndarray
    y: np.ndarray


DISTANCE = Axis("distance", "mm", 1e-3)
RADIUS = Axis("radius", "mm", 1e-3)
TIME = Axis("time", "us", 1e-6)
PRESSURE = Axis("pressure", "GPa", 1e9)
VELOCITY = Axis("velocity", "m/s")
DENSITY = Axis("density", "kg/m3")


def field_panels(position: Axis) -> tuple[Panel, ...]:
    """Panels "pressure", "velocity" and "density" against a position."""
    named = (("pressure", PRESSURE), ("velocity", VELOCITY), ("density", DENSITY))
    return tuple(Panel(name, position, axis) for name, axis in named)


# ---- what is measured ------------------------------------------------------------------------------------------------


class FieldError(NamedTuple):
    """Distance of a field from the exact one, see `warp_mpm.verification.norms`."""

    l1: float
    linf: float


@dataclass(frozen=True)
class Measurement:
    """What a problem finds out about one run. Each part may be empty."""

    errors: Mapping[str, FieldError] = field(default_factory=dict)  # by field: "pressure", "velocity", "density"
    figures: Mapping[str, float] = field(default_factory=dict)  # anything else, by name
    curves: Mapping[str, Curve] = field(default_factory=dict)  # the computed curve of each panel


class Problem(ABC):
    """A problem with an exact answer. One set of solver defaults serves all of them: none has settings of its own.

    A scene may recommend a burn width (`SceneBuilder.burn_width`) where the problem is about one.
    """

    name: str  # on the command line, and of the picture
    title: str
    statement: str  # what is solved and what the exact answer is, one paragraph
    reference: str  # where the exact answer is from
    cells_across: str  # what `Level.cells` counts, e.g. "the run"
    levels: tuple[Level, ...] = ()  # solved by default, coarsest first within a variant; none: only with --full
    more_levels: tuple[Level, ...] = ()  # solved besides with --full
    panels: tuple[Panel, ...] = ()  # of the picture
    answer: str = "exact"  # what the picture calls the curves of `exact_curves`
    bounds: tuple[Bound, ...] = ()  # besides those on energy, mass and momentum
    moves: bool = True  # False: a single step shows all there is; conservation is not judged

    @abstractmethod
    def scene(self, level: Level) -> Scene:
        """What is simulated at this level; any number of cells has to work, because tests shrink it."""

    @abstractmethod
    def measure(self, level: Level, result: Result) -> Measurement:
        """Compare the finished run with the exact answer."""

    def solver_config(self, config: SolverConfig, level: Level) -> SolverConfig:
        """The settings for this level: those asked for, but in a row that shows another method beside them."""
        return config

    def exact_curves(self, level: Level) -> Mapping[str, Curve]:
        """The exact curve of each panel that has one, at the level's settings."""
        return {}

    def overall(self, results: Sequence["LevelResult"]) -> Mapping[str, float]:
        """Figures that take several levels together, for example how far variants are apart."""
        return {}


# ---- what comes out --------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class LevelResult:
    """A level, solved and measured."""

    level: Level
    cell_size: float  # largest spacing of the grid [m]
    particles: int
    steps: int
    seconds: float  # wall time, the scene and the measuring included
    measurement: Measurement
    energy_error: float  # relative, as in summary.json
    mass_error: float
    momentum_error: float
    orders: Mapping[str, float] = field(default_factory=dict)  # by figure: against the next coarser level

    @property
    def figures(self) -> dict[str, float]:
        """Every figure by name, the errors and orders included: what bounds speak of."""
        flat: dict[str, float] = {}
        for name, error in self.measurement.errors.items():
            flat |= {f"{name}_l1": error.l1, f"{name}_linf": error.linf}
        flat |= {f"{name}_order": order for name, order in self.orders.items()}
        flat |= dict(self.measurement.figures)
        names = ("energy_error", "mass_error", "momentum_error")
        return flat | {name: getattr(self, name) for name in names}


class Outcome(Enum):
    """What came of a bound."""

    HELD = "held"
    BROKEN = "broken"
    MISSED = "missed"  # an aim
    NOT_MEASURED = "not measured"  # no level that was solved has the figure


@dataclass(frozen=True)
class Verdict:
    """A bound, and the figure it met."""

    bound: Bound
    outcome: Outcome
    value: float | None = None
    level: Level | None = None  # None: an overall figure, or not measured
