"""The ripple of the front's pressure: what errors of the arrival times do to it, planar and lit at a point."""

from collections.abc import Mapping, Sequence

import numpy as np

from warp_mpm.builder import SceneBuilder
from warp_mpm.detonators import LineDetonator, PlaneDetonator
from warp_mpm.geometry import Box, Cylinder
from warp_mpm.kernels.eos.ideal_gas import IdealGas
from warp_mpm.materials import ammonium_nitrate, explosive
from warp_mpm.result import Result
from warp_mpm.scene import Scene
from warp_mpm.verification.problem import (
    Axis,
    Bound,
    Curve,
    Level,
    LevelResult,
    Measurement,
    Panel,
    Problem,
)
from warp_mpm.verification.problems._taylor import DENSITY, GAMMA, SPEED, front_end

RUN = 0.1  # of the front [m]
WIDTH = 0.5  # of the planar charge [runs]
DISC_AT, DISC_RADIUS = 0.35, 0.12  # centre from the detonator and radius of the other explosive [runs]
LIKENESS = 1e-4  # relative difference of the detonation speeds of the two explosives
JUDGED = (0.5, 0.9)  # part of the run
SHOWN = 0.75  # share of the run at which the front is drawn
TREND = 2  # degree of the polynomial in the run that is no ripple


class Ripple(Problem):
    """A slab, one cell thick between slip walls, in one piece or with a disc of nearly the same explosive in it."""

    name = "ripple"
    title = "The ripple of the front's pressure"
    statement = (
        "A charge is lit along a plane (point=0) or at a point (point=1). The highest pressure that each node ever saw "
        "should depend on the run of the front alone. What it has besides is ripple, judged from 50 to 90 % of the "
        "run: 'ripple_rms' and 'ripple_max', relative. In one piece (eikonal=0) arrival times are straight and exact. "
        f"With a disc in it whose explosive is {LIKENESS:.0e} faster (eikonal=1) they are those of the eikonal "
        "equation, through two explosives, and all but the same: more ripple would be errors of the local speed."
    )
    reference = "symmetry; a front that is 1 % fast everywhere is in the problem overspeed"
    cells_across = "the run"
    levels = tuple(Level(80, {"point": point, "eikonal": eikonal}) for point in (0, 1) for eikonal in (0, 1))
    panels = (Panel("ripple", Axis("place along the front", "share of it"), Axis("highest pressure / its mean there")),)
    bounds = (Bound("ripple_added", high=0.01, from_cells=40, why="0.1 % of speed, where 1 % costs 12 % of pressure"),)

    def scene(self, level: Level) -> Scene:
        """A tenth longer than the run; lit at a corner, a quarter of a disc with walls for mirrors."""
        cell, cells = RUN / level.cells, front_end(level.cells)
        across = cells if level.settings["point"] else round(WIDTH * level.cells)
        box = Box((0.0, 0.0, 0.0), (cells * cell, across * cell, cell))
        builder = SceneBuilder(self.name)
        builder.domain(box.lower, box.upper, cells=(cells, across, 1))
        if level.settings["eikonal"]:
            place = DISC_AT * RUN * np.array([1.0, 1.0]) / np.sqrt(2.0) if level.settings["point"] else None
            x, y = (DISC_AT * RUN, across * cell / 2) if place is None else place
            disc = Cylinder((x, y, 0.0), (x, y, cell), DISC_RADIUS * RUN)
            speed = SPEED * (1.0 + LIKENESS)
            like = explosive("alike", density=DENSITY, detonation_speed=speed, equation_of_state=IdealGas(GAMMA))
            builder.charge(disc, like, name="disc")
            builder.charge(box - disc, ammonium_nitrate(), name="around")
        else:
            builder.charge(box, ammonium_nitrate(), name="around")
        if level.settings["point"]:
            builder.detonator(LineDetonator((0.0, 0.0, 0.0), (0.0, 0.0, cell), charges=("around",)))
        else:
            builder.detonator(PlaneDetonator((0.0, 0.0, 0.0), normal=(1.0, 0.0, 0.0), charges=("around",)))
        builder.end_time(cells * cell / SPEED)
        return builder.build()

    def measure(self, level: Level, result: Result) -> Measurement:
        """How the highest pressures differ between nodes that the front reaches after the same run."""
        domain = result.state.model.scene.domain
        x, y = (np.linspace(domain.lower[axis], domain.upper[axis], domain.cells[axis] + 1) for axis in (0, 1))
        x, y = np.meshgrid(x, y, indexing="ij")
        run, along = (np.hypot(x, y), np.arctan2(y, x) / (np.pi / 2)) if level.settings["point"] else (x, y / y.max())
        peak = result.record.section.peak.astype(np.float64)
        judged = (run >= JUDGED[0] * RUN) & (run <= JUDGED[1] * RUN)
        trend = np.polynomial.Polynomial.fit(run[judged], peak[judged], TREND)
        ripple = peak / trend(run) - 1.0
        shown = np.abs(run - SHOWN * RUN) <= 0.5 * domain.spacing[0]
        order = np.argsort(along[shown])
        return Measurement(
            figures={
                "ripple_rms": float(np.sqrt(np.mean(ripple[judged] ** 2))),
                "ripple_max": float(np.abs(ripple[judged]).max()),
            },
            curves={"ripple": Curve(along[shown][order], 1.0 + ripple[shown][order])},
        )

    def exact_curves(self, level: Level) -> Mapping[str, Curve]:
        """No ripple."""
        return {"ripple": Curve(np.array([0.0, 1.0]), np.ones(2))}

    def overall(self, results: Sequence[LevelResult]) -> Mapping[str, float]:
        """What the eikonal equation adds to the largest ripple, for the kind of wave where it adds most."""
        ripple = {
            (r.level.cells, r.level.settings["point"], r.level.settings["eikonal"]): r.measurement.figures["ripple_max"]
            for r in results
        }
        pairs = [(cells, point) for cells, point, eikonal in ripple if eikonal and (cells, point, 0) in ripple]
        added = [ripple[cells, point, 1] - ripple[cells, point, 0] for cells, point in pairs]
        return {"ripple_added": max(added)} if added else {}


PROBLEMS = (Ripple(),)
