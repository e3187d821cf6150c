"""Kenamond's three problems: arrival times, and the speed that particles see. Nothing is simulated but one step."""

from collections.abc import Mapping

import numpy as np

from warp_mpm.builder import SceneBuilder
from warp_mpm.detonators import Detonator, LineDetonator, PointDetonator
from warp_mpm.exact import kenamond
from warp_mpm.geometry import Box, Cylinder, Solid, Sphere
from warp_mpm.kernels.eos.ideal_gas import IdealGas
from warp_mpm.materials import Material, explosive
from warp_mpm.result import Result
from warp_mpm.scene import Scene
from warp_mpm.verification.problem import (
    DISTANCE,
    Axis,
    Bound,
    Curve,
    Level,
    Measurement,
    Panel,
    Problem,
    ladder,
)

HALF = 0.1  # half the edge of the box [m]
RADIUS = 0.03  # of the inner explosive or the inert sphere [m]
SPEED, OUTER_SPEED = 8000.0, 4000.0  # [m/s]
LAMP = (0.0, 0.05, 0.0)  # of problems 1 and 3 [m]
OTHERS = ((0.09, 4.5e-6), (0.05, 2.5e-6), (-0.05, 2.5e-6), (-0.09, 4.5e-6))  # of problem 2: y [m] and time [s]
ONE_STEP = 1e-9  # [s]
SPEED_TOLERANCE = 0.005  # of the speed that particles see, relative
SPARED_CELLS = 2  # around detonators and lines where waves meet


def _speed_bound(dimensions: int, aim: bool = False) -> Bound:
    """Where the inert sphere has a radius of six cells or more."""
    why = "front pressure follows the local speed"
    return Bound("speed", high=SPEED_TOLERANCE, why=why, from_cells=40, settings={"dimensions": dimensions}, aim=aim)


class Kenamond(Problem):
    """Problems 1 to 3 in two dimensions, one cell thick, and in three."""

    name = "kenamond"
    title = "Kenamond's problems: arrival times of a programmed burn"
    statement = (
        "A point detonator in a uniform explosive (problem=1); five delayed detonators in two concentric explosives, "
        "the inner one twice as fast (2); a detonator behind an inert sphere (3); in two dimensions (one cell thick, "
        "detonators along z) and in three. 'time_cells' is the largest error of an arrival time in cells of travel, "
        "'time_mean_cells' the mean one, "
        "'speed' the largest relative error of the local speed 1 / |grad t_b| by differences over a cell between "
        "particles, away by two cells from detonators and from lines where waves meet; 'speed_rare' the share of "
        "particles at which it is above 0.5 %."
    )
    reference = "M. A. Kenamond, HE burn table verification problems, LA-UR-11-03096, 2011; warp_mpm/exact/kenamond.py"
    cells_across = "the box"
    levels = (
        *(level for problem in (1, 2, 3) for level in ladder(40, 80, problem=problem, dimensions=2)),
        *(level for problem in (1, 2, 3) for level in ladder(20, 40, problem=problem, dimensions=3)),
    )
    more_levels = (
        *(level for problem in (1, 2, 3) for level in ladder(160, problem=problem, dimensions=2)),
        *(level for problem in (1, 2, 3) for level in ladder(60, problem=problem, dimensions=3)),
    )
    panels = (
        Panel("error", DISTANCE._replace(label="y, beside the axis"), Axis("error of the arrival time", "cells")),
    )
    moves = False
    bounds = (
        Bound("time_cells", high=0.5, why="half a cell of travel time everywhere"),
        _speed_bound(dimensions=2),
        _speed_bound(dimensions=3, aim=True),
    )

    def scene(self, level: Level) -> Scene:
        """The box, with slip walls; in two dimensions its thickness is one cell."""
        cell = 2.0 * HALF / level.cells
        flat = level.settings["dimensions"] == 2
        depth = cell / 2 if flat else HALF
        box = Box((-HALF, -HALF, -depth), (HALF, HALF, depth))
        ends = (0.0, 0.0, -depth), (0.0, 0.0, depth)
        core: Solid = Cylinder(*ends, RADIUS) if flat else Sphere((0.0, 0.0, 0.0), RADIUS)
        builder = SceneBuilder(self.name)
        builder.domain(box.lower, box.upper, cells=(level.cells, level.cells, 1 if flat else level.cells))
        problem = level.settings["problem"]
        if problem == 1:
            builder.charge(box, _explosive("explosive", SPEED))
        elif problem == 2:
            builder.charge(core, _explosive("inner", SPEED), name="inner")
            builder.charge(box - core, _explosive("outer", OUTER_SPEED), name="outer")
        else:
            builder.charge(box - core, _explosive("explosive", SPEED))
            builder.charge(core, Material("inert", 1.0, IdealGas(1.4), 1.0))
        for position, time in _lamps(level):
            builder.detonator(_detonator(position, time, depth if flat else 0.0))
        builder.end_time(ONE_STEP)
        return builder.build()

    def measure(self, level: Level, result: Result) -> Measurement:
        """Arrival times of all explosive particles, and their differences between neighbors."""
        scene = result.state.model.scene
        cell = scene.domain.spacing[0]
        place = np.concatenate([charge.positions for charge in scene.charges])
        speeds = [np.nan if c.material.burn is None else c.material.burn.detonation_speed for c in scene.charges]
        speed = np.repeat(speeds, [len(charge.positions) for charge in scene.charges])
        time, exact = result.state.field("arrival_time").astype(np.float64), _exact(level, place)
        burns = np.isfinite(speed)
        error = np.where(burns, (time - exact) * speed / cell, 0.0)
        lattice = _Lattice(scene, place)
        wrong = np.abs(lattice.speed(time, speed) / speed - 1.0)
        expected = np.abs(lattice.speed(exact, speed) / speed - 1.0)
        judged = np.isfinite(wrong) & ~lattice.near(expected > SPEED_TOLERANCE, 2 * SPARED_CELLS)
        column = np.isclose(place[:, 0], place[np.argmin(np.abs(place[:, 0])), 0])
        column &= np.isclose(place[:, 2], place[np.argmin(np.abs(place[:, 2])), 2]) & burns
        along = np.argsort(place[column, 1])
        return Measurement(
            figures={
                "time_mean_cells": float(np.abs(error[burns]).mean()),
                "time_cells": float(np.abs(error).max()),
                "speed": float(wrong[judged].max(initial=0.0)),
                "speed_rare": float(np.mean(wrong[judged] > SPEED_TOLERANCE)) if judged.any() else 0.0,
            },
            curves={"error": Curve(place[column, 1][along], error[column][along])},
        )

    def exact_curves(self, level: Level) -> Mapping[str, Curve]:
        """No error anywhere."""
        return {"error": Curve(np.array([-HALF, HALF]), np.zeros(2))}


class _Lattice:
    """Values of particles on the lattice that they were cut from."""

    def __init__(self, scene: Scene, place: np.ndarray) -> None:
        spacing = np.array(scene.domain.spacing) / 2
        self.spacing = float(spacing[0])
        self.shape = tuple(2 * n for n in scene.domain.cells)
        self.sites = tuple(np.floor((place - scene.domain.lower) / spacing).astype(int).T)
        self.axes = [axis for axis in range(3) if scene.domain.cells[axis] > 1]

    def speed(self, time: np.ndarray, speed: np.ndarray) -> np.ndarray:
        """1 / |grad t| (n,) [m/s] by central differences; NaN where a neighbor is missing or of another speed."""
        times, speeds = np.full(self.shape, np.nan), np.full(self.shape, np.nan)
        times[self.sites], speeds[self.sites] = time, speed
        square = np.zeros(self.shape)
        for axis in self.axes:
            before, after = (np.roll(times, shift, axis) for shift in (1, -1))
            same = (np.roll(speeds, 1, axis) == speeds) & (np.roll(speeds, -1, axis) == speeds)
            ends = [slice(None)] * 3
            ends[axis] = slice(1, -1)
            inner = np.zeros(self.shape, dtype=bool)
            inner[tuple(ends)] = True
            square += np.where(same & inner, (after - before) / (2.0 * self.spacing), np.nan) ** 2
        with np.errstate(divide="ignore"):
            return (1.0 / np.sqrt(square))[self.sites]

    def near(self, marked: np.ndarray, sites: int) -> np.ndarray:
        """Which particles (n,) are within so many sites of a marked one along every axis."""
        field = np.zeros(self.shape, dtype=bool)
        field[self.sites] = marked
        for axis in self.axes:
            shifted = [np.roll(field, shift, axis) for shift in range(-sites, sites + 1)]
            field = np.logical_or.reduce(shifted)
        return field[self.sites]


def _explosive(name: str, speed: float) -> Material:
    return explosive(name, density=1000.0, detonation_speed=speed, equation_of_state=IdealGas(3.0))


def _lamps(level: Level) -> list[tuple[tuple[float, float, float], float]]:
    """Where and when the detonators of a problem light."""
    if level.settings["problem"] != 2:
        return [(LAMP, 0.0)]
    return [((0.0, 0.0, 0.0), 0.0), *(((0.0, y, 0.0), time) for y, time in OTHERS)]


def _detonator(position: tuple[float, float, float], time: float, depth: float) -> Detonator:
    """A point, or in two dimensions a line through all the thickness."""
    if depth == 0.0:
        return PointDetonator(position, time)
    x, y, _ = position
    return LineDetonator((x, y, -depth), (x, y, depth), time)


def _exact(level: Level, place: np.ndarray) -> np.ndarray:
    """The exact arrival times (n,) [s] at places (n, 3) [m]."""
    flat = level.settings["dimensions"] == 2
    at = place * [1.0, 1.0, 0.0] if flat else place
    lamps = [PointDetonator(position, time) for position, time in _lamps(level)]
    if level.settings["problem"] == 1:
        return kenamond.one_point(at, lamps[0], SPEED)
    if level.settings["problem"] == 3:
        return kenamond.inert_sphere(at, radius=RADIUS, detonator=lamps[0], speed=SPEED, cylinder=flat)
    return kenamond.two_explosives(
        at,
        radius=RADIUS,
        inner_speed=SPEED,
        outer_speed=OUTER_SPEED,
        central_time=lamps[0].time,
        others=lamps[1:],
        cylinder=flat,
    )


PROBLEMS = (Kenamond(),)
