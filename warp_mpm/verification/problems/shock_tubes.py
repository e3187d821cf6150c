"""Riemann problems: two gases of different states meet. Sod's shock tube, and Toro's other four."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from warp_mpm.builder import SceneBuilder
from warp_mpm.exact import riemann
from warp_mpm.geometry import Box
from warp_mpm.kernels.eos.ideal_gas import IdealGas
from warp_mpm.materials import Material
from warp_mpm.result import Result
from warp_mpm.scene import Scene, Wall, Walls
from warp_mpm.verification.fields import (
    FIELD_NAMES,
    ExactFlow,
    computed_fields,
    exact_curves,
    field_errors,
    planar_curves,
    planar_means,
)
from warp_mpm.verification.problem import Bound, Curve, Level, Measurement, Problem, ladder
from warp_mpm.verification.problems._gas import POSITION, gas_panels, part_of

CURVE_POINTS = 2001


@dataclass(frozen=True)
class ShockTube(Problem):
    """Two gases on [0, 1] m, one cell across between slip walls.

    Where gas runs out of [0, 1], or has to run in, the tube is longer and its ends are open. The waves that start at
    these ends do not reach [0, 1] before the end.
    """

    name: str
    title: str
    flow: riemann.RiemannProblem
    time: float  # at which it is compared [s]
    room: tuple[float, float] = (0.0, 0.0)  # by how much the tube is longer, left and right [m]
    remark: str = ""  # of the statement
    levels: tuple[Level, ...] = ladder(100, 200)
    more_levels: tuple[Level, ...] = ladder(400)
    bounds: tuple[Bound, ...] = ()

    reference = "E. F. Toro, Riemann Solvers and Numerical Methods for Fluid Dynamics, 3rd ed. 2009, table 4.1"
    cells_across = "[0, 1]"
    panels = gas_panels(POSITION)

    def __post_init__(self) -> None:
        """Say what the states are."""
        left, right = self.flow.left, self.flow.right
        statement = (
            f"Ideal gas, gamma = {self.flow.gamma:g}; density, velocity and pressure are {left.density:g}, "
            f"{left.velocity:g} and {left.pressure:g} on the left of x = {self.flow.origin:g}, {right.density:g}, "
            f"{right.velocity:g} and {right.pressure:g} on its right (SI units). The cells of [0, 1] are compared with "
            f"the exact Riemann problem at t = {self.time:g} s."
        )
        object.__setattr__(self, "statement", f"{statement} {self.remark}".rstrip())

    def scene(self, level: Level) -> Scene:
        """The two gases, the tube as long as its room asks for."""
        edge = 1.0 / level.cells
        before, after = (round(room * level.cells) for room in self.room)
        start, end, middle = -before * edge, 1.0 + after * edge, self.flow.origin
        builder = SceneBuilder(self.name)
        builder.domain((start, 0.0, 0.0), (end, edge, edge), cells=(before + level.cells + after, 1, 1))
        builder.walls(Walls(Wall.OPEN if before else Wall.SLIP, Wall.OPEN if after else Wall.SLIP))
        for name, low, high, gas in (("left", start, middle, self.flow.left), ("right", middle, end, self.flow.right)):
            energy = gas.pressure / ((self.flow.gamma - 1.0) * gas.density)
            material = Material(name, gas.density, IdealGas(self.flow.gamma), energy)
            builder.charge(Box((low, 0.0, 0.0), (high, edge, edge)), material, velocity=(gas.velocity, 0.0, 0.0))
        builder.end_time(self.time)
        return builder.build()

    def measure(self, level: Level, result: Result) -> Measurement:
        """Errors of the three fields in the cells of [0, 1]."""
        domain = result.state.model.scene.domain
        kept = slice(round(self.room[0] * level.cells), round(self.room[0] * level.cells) + level.cells)
        computed = computed_fields(result.state)
        exact = planar_means(self.flow, domain, self.time)
        curves = {name: Curve(curve.x[kept], curve.y[kept]) for name, curve in planar_curves(computed, domain).items()}
        return Measurement(field_errors(part_of(computed, kept), part_of(exact, kept)), curves=curves)

    def exact_curves(self, level: Level) -> Mapping[str, Curve]:
        """The exact fields on [0, 1]."""
        flow = ExactFlow(self.flow.pressure, self.flow.velocity, self.flow.density)
        return exact_curves(flow, np.linspace(0.0, 1.0, CURVE_POINTS), self.time)


# What it means that the method holds a problem.
HELD = tuple(Bound(f"{name}_l1", high=0.05, from_cells=200, why="200 cells resolve it to 5 %") for name in FIELD_NAMES)

PROBLEMS = (
    ShockTube(
        "sod",
        "Sod's shock tube",
        riemann.SOD,
        0.2,
        bounds=(Bound("density_l1", high=0.015, from_cells=200, why="200 cells resolve it to 1.5 %"), *HELD[:2]),
    ),
    ShockTube(
        "double_rarefaction",
        "Two streams part and leave next to nothing between them (Toro 2)",
        riemann.DOUBLE_RAREFACTION,
        riemann.TORO_TIMES[1],
        room=(0.1, 0.1),
        remark="Particles cannot hold this: the gas in the middle becomes 45 times as thin, so that the two particles "
        "of a cell should end 23 cells apart. Once they are out of reach of each other's nodes no pressure acts "
        "between them, and they keep the density at which they parted. It is here to show that, and has no bound.",
        levels=(),
        more_levels=ladder(100, 200, 400),
    ),
    ShockTube(
        "left_blast",
        "A strong shock to the right (Toro 3)",
        riemann.LEFT_BLAST,
        riemann.TORO_TIMES[2],
        bounds=HELD,
    ),
    ShockTube(
        "right_blast",
        "A strong shock to the left (Toro 4)",
        riemann.RIGHT_BLAST,
        riemann.TORO_TIMES[3],
        bounds=HELD,
    ),
    ShockTube(
        "colliding_streams",
        "Two streams collide (Toro 5)",
        riemann.COLLIDING_STREAMS,
        riemann.TORO_TIMES[4],
        room=(1.1, 0.4),
        bounds=HELD,
    ),
)
