"""The run: steps a scene to its end, saves what was asked for, audits itself, and sums up."""

import math
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, fields
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np

from warp_mpm.config import Save, SolverConfig
from warp_mpm.conservation import Audit, Totals, history_row, totals_of
from warp_mpm.errors import SimulationError
from warp_mpm.guards import check_faults, check_memory, writable_directory
from warp_mpm.isosurface import pressure_isosurface
from warp_mpm.kernels.precision import PRECISION
from warp_mpm.launch import Launcher, find_device
from warp_mpm.model import Model, build_model
from warp_mpm.output.description import scene_values
from warp_mpm.output.frame import Frame, SectionPicture, StepRecord
from warp_mpm.progress import Progress, Silent
from warp_mpm.recorder import Recorder
from warp_mpm.run_directory import FIGURES, STEPS, SUMMARY, load
from warp_mpm.scene import Scene, Wall
from warp_mpm.section import section_pressure
from warp_mpm.solver import Solver
from warp_mpm.state import State
from warp_mpm.summary import figures_of_merit, lit_explosive
from warp_mpm.version import VERSION

GROWTH = 1.1  # of the time step, at most; as in kernels.reduce
STEPS_BETWEEN_AUDITS = 100  # at most: errors are looked for between frames too, however few there are
STEPS_AT_ONCE = 4  # on a GPU, so that the drift between two looks at it stays below a cell or two


@dataclass(frozen=True)
class Result:
    """What a run gives back."""

    summary: dict[str, Any]  # as in summary.json
    history: list[dict[str, float]]  # as in history.csv, one row a frame
    record: StepRecord  # every step
    pictures: tuple[SectionPicture, ...]  # the section at the scene's picture instants
    state: State  # at the end
    output: Path | None  # the run directory


def simulate(
    scene: Scene,
    *,
    config: SolverConfig | None = None,
    save: Save | None = None,
    output: str | Path | None = None,
    device: str | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Result:
    """Simulate a scene to its end time.

    Args:
        scene: what is simulated.
        config: how; the defaults if not given.
        save: when and what to save.
        output: directory for the results, made if need be; nothing is written without it.
        device: "cpu", "cuda:0", ...; a GPU if there is one.
        threads: on a CPU; one a core.
        progress: told how far the run is.

    Raises:
        InputError: unknown device, too little memory, or an output directory that cannot be written.
        SimulationError: the run cannot go on.
    """
    begin = time.perf_counter()
    run = _Run(scene, config or SolverConfig(), save or Save(), output, device, threads, progress or Silent())
    try:
        run.to_the_end()
    except (KeyboardInterrupt, SimulationError) as error:
        if run.history:  # before the first frame there is nothing to sum up
            run.finish(begin, "interrupted" if isinstance(error, KeyboardInterrupt) else f"failed: {error}")
        raise
    finally:
        run.launcher.close()
    return run.finish(begin, "complete")


class _Run:
    """A run under way."""

    def __init__(
        self,
        scene: Scene,
        config: SolverConfig,
        save: Save,
        output: str | Path | None,
        device: str | None,
        threads: int | None,
        progress: Progress,
    ) -> None:
        self.scene = scene
        self.save = save
        self.progress = progress
        self.launcher = Launcher(find_device(device), threads)
        self.output = None if output is None else writable_directory(Path(output))
        self.model = build_model(scene, config, self.launcher.device)
        check_memory(self.model)
        progress.message(
            f"{scene.name}: {scene.particle_count:,} particles in {math.prod(scene.domain.cells):,} cells on "
            f"{self.launcher.device.name}, {_counted(self.launcher.threads, 'thread')}, in {PRECISION} precision; "
            "preparing kernels"
        )
        self.state = State(self.model)
        self.solver = Solver(self.model, self.state, self.launcher)
        self.recorder = Recorder(self.state)
        self.audit = Audit(np.array(scene.gravity), scene.mass)
        self.history: list[dict[str, float]] = []
        self.pictures: list[SectionPicture] = []
        self.solver_seconds = 0.0
        self.steps = 0
        self.audited_step = 0

    def to_the_end(self) -> None:
        """Step to the end time; save frames and pictures at the first step at or past their instants."""
        scene, end = self.scene, self.scene.end_time
        frames = np.linspace(0.0, end, self.save.frames)
        pictures = sorted(scene.picture_times)
        self.recorder.record()
        with self._writers() as write:
            next_frame = self._save_due(write, frames, 0, pictures, 0.0)
            self._write_start()
            now = 0.0
            while now < end:
                now = self._advance(min([frames[next_frame], *pictures[:1]]))
                next_frame = self._save_due(write, frames, next_frame, pictures, now)
                peak = self.history[-1]["peak_pressure_pa"]
                self.progress.update(now, end, self.steps, f"peak {peak / 1e9:.2f} GPa")

    def finish(self, begin: float, status: str) -> Result:
        """Sum up what there is, and draw it."""
        record = self.recorder.result()
        summary = {"status": status, **self._summary(record, time.perf_counter() - begin)}
        if self.output is not None:
            from warp_mpm.output.steps import write_steps
            from warp_mpm.output.tables import write_summary

            write_summary(self.output / SUMMARY, summary)
            write_steps(self.output / STEPS, record, self.pictures)
            if self.save.figures:
                self.progress.message("drawing figures")
                summary["warnings"] += self._draw()
            summary["wall_s"] = time.perf_counter() - begin
            write_summary(self.output / SUMMARY, summary)
        return Result(summary, self.history, record, tuple(self.pictures), self.state, self.output)

    def _advance(self, instant: float) -> float:
        """Some steps towards an instant, not past the first step that reaches it; returns the time reached [s]."""
        begin = time.perf_counter()
        clock = self.state.clock_values()
        for _ in range(self._safe_steps(instant - float(clock["time"]), float(clock["dt"]))):
            self.solver.step()
            self.recorder.record()
            self.steps += 1
        clock = self.state.clock_values()
        check_faults(self.state, self.steps)
        self.solver.sort_if_due()
        if self.steps - self.audited_step >= STEPS_BETWEEN_AUDITS:
            self._audit()
        self.solver_seconds += time.perf_counter() - begin
        return float(clock["time"])

    def _safe_steps(self, left: float, dt: float) -> int:
        """Steps that surely end before an instant that is `left` seconds away, then at least one.

        On a CPU looking at the clock costs nothing. On a GPU it waits for all work, so several steps go out at once.
        """
        if not self.launcher.device.is_cuda or dt <= 0.0:
            return 1
        surely = math.floor(math.log1p((GROWTH - 1.0) * left / (GROWTH * dt)) / math.log(GROWTH))
        return max(1, min(surely, STEPS_AT_ONCE))

    def _save_due(self, write: Any, frames: np.ndarray, next_frame: int, pictures: list[float], now: float) -> int:
        """Save the frames and pictures whose instants have come; returns the next frame."""
        while pictures and now >= pictures[0]:
            pictures.pop(0)
            self.pictures.append(SectionPicture(now, section_pressure(self.state)))
        if next_frame < len(frames) and now >= frames[next_frame]:
            totals = self._audit()
            pressure = self.state.field("pressure")
            inside = self.state.field("mass") > 0.0
            row = self._history_row(totals, pressure[inside])
            while next_frame < len(frames) and now >= frames[next_frame]:
                self.history.append(row)
                write(next_frame, now, pressure, inside, row)
                next_frame += 1
        return next_frame

    def _audit(self) -> Totals:
        """The present totals, compared with those at the start."""
        totals = totals_of(self.solver)
        self.audit.add(totals)
        self.audited_step = self.steps
        return totals

    def _history_row(self, totals: Totals, pressure: np.ndarray) -> dict[str, float]:
        clock = self.state.clock_values()
        mean = float(pressure.mean()) if len(pressure) else 0.0
        spread = float(pressure.std()) / mean if mean > 0.0 else 0.0
        return history_row(totals, self.steps, float(clock["dt"]), self.recorder.take_peak(), spread)

    @contextmanager
    def _writers(self) -> Iterator[Any]:
        """A function that writes a frame and a row of the history; files are closed whatever way the run ends."""
        if self.output is None:
            yield lambda *_: None
            return
        from warp_mpm.output.tables import TableWriter
        from warp_mpm.output.usd import UsdWriter

        with ExitStack() as stack:
            usd = stack.enter_context(
                UsdWriter(
                    self.output / f"{self.scene.name}.usdc",
                    self.scene,
                    pressure_range=(0.0, color_limit(self.scene)),
                    frames=self.save.frames,
                    fields=self.save.fields,
                    particles_every=self.save.particles_every,
                    isosurface=self.save.isosurface,
                    layout=self.save.layout,
                    usdz=self.save.usdz,
                )
            )
            write_gauges = self._gauge_writer(self.output / "gauges.csv", stack)
            history: list[TableWriter] = []

            def write(index: int, now: float, pressure: np.ndarray, inside: np.ndarray, row: dict[str, float]) -> None:
                usd.write(self._frame(index, now, pressure, inside))  # before its row: what has a row can be shown
                if not history:
                    path = self.output / "history.csv" if self.output else Path()
                    history.append(stack.enter_context(TableWriter(path, list(row))))
                history[0].write(row)
                write_gauges()

            yield write

    def _gauge_writer(self, path: Path, stack: ExitStack) -> Callable[[], None]:
        """A function that adds to gauges.csv what was recorded since it was last called, as does the end of `stack`."""
        from warp_mpm.output.tables import TableWriter, gauge_columns, gauge_rows

        gauges = self.scene.gauges
        if not gauges:
            path.unlink(missing_ok=True)  # what an earlier run left
            return lambda: None
        table = stack.enter_context(TableWriter(path, gauge_columns(gauges)))

        def write() -> None:
            table.extend(gauge_rows(gauges, *self.recorder.take_gauges()))

        stack.callback(write)
        return write

    def _frame(self, index: int, now: float, pressure: np.ndarray, inside: np.ndarray) -> Frame:
        sources = {"particleVelocity": "velocity"}
        values = {name: self.state.field(sources.get(name, name)) for name in self.save.fields}
        section = section_pressure(self.state)
        level = self.save.isosurface
        surface = None if level is None else pressure_isosurface(self.state, level)
        return Frame(index, now, self.state.positions(), pressure, inside, section, values, surface)

    def _write_start(self) -> None:
        """Say what is run before it is run: a run that is killed leaves frames, and what they show."""
        if self.output is not None:
            from warp_mpm.output.tables import write_summary

            (self.output / STEPS).unlink(missing_ok=True)  # of an earlier run
            write_summary(self.output / SUMMARY, {"status": "running", **self._given()})

    def _draw(self) -> list[str]:
        """Draw the pictures from what is now in the run directory, as the command does; returns what to warn of."""
        assert self.output is not None
        try:
            from warp_mpm.output import figures
        except ImportError:
            return ["figures: not drawn, matplotlib is missing; pip install matplotlib"]
        figures.draw_figures(load(self.output), self.output / FIGURES)
        return []

    def _given(self) -> dict[str, Any]:
        """The keys of summary.json that are known before the first step."""
        return {
            **scene_values(self.scene),
            "solver": _solver_values(self.model),
            "version": VERSION,
            "device": self.launcher.device.name,
            "threads": self.launcher.threads,
            "precision": PRECISION,
        }

    def _summary(self, record: StepRecord, wall: float) -> dict[str, Any]:
        clock = self.state.clock_values()
        final = self.history[-1]
        return {
            **self._given(),
            "steps": self.steps,
            "end_time_s": float(clock["time"]),
            "wall_s": wall,
            "solver_wall_s": self.solver_seconds,
            "ns_per_particle_step": 1e9 * self.solver_seconds / max(1, self.steps * self.scene.particle_count),
            **figures_of_merit(self.scene, record),
            "mass_error": self.audit.mass_error,
            "momentum_error": self.audit.momentum_error,
            "energy_error": self.audit.energy_error,
            "min_dt_s": float(clock["smallest_dt"]),
            "first_dt_s": float(clock["first_dt"]),
            "mass_out_kg": {
                name.removeprefix("mass_out_").removesuffix("_kg"): value
                for name, value in final.items()
                if name.startswith("mass_out_")
            },
            "pressure_spread": final["pressure_spread"],
            "particle_volume_error": self._volume_error(),
            "warnings": [*self.scene.warnings, *self._frame_warnings()],
        }

    def _volume_error(self) -> float | None:
        """Relative difference of the particles' volume from the charges'; None where gas may expand out of faces."""
        if Wall.OPEN in self.scene.walls.faces():
            return None
        return self.history[-1]["particle_volume_m3"] / sum(charge.volume for charge in self.scene.charges) - 1.0

    def _frame_warnings(self) -> list[str]:
        if self.save.frames <= self.steps + 1:
            return []
        return [f"frames: {self.save.frames} asked for, but only {self.steps} steps taken: some frames are repeated"]


def color_limit(scene: Scene) -> float:
    """Pressure of the last colour [Pa]: 1.6 p_CJ shows fronts and collisions.

    Without explosive, the energy density rho (e + |v|^2 / 2) of the charge that has most of it at the start.
    """
    material = lit_explosive(scene)
    if material is not None and material.cj is not None:
        return 1.6 * material.cj.pressure
    return max(c.material.density * (c.material.specific_energy + 0.5 * c.greatest_speed**2) for c in scene.charges)


def _solver_values(model: Model) -> dict[str, Any]:
    """The settings as the summary shows them, the burn width resolved."""
    values = {item.name: getattr(model.config, item.name) for item in fields(model.config)}
    values = {name: value.value if isinstance(value, Enum) else value for name, value in values.items()}
    return {**values, "burn_width": model.burn_width}


def _counted(count: int, noun: str) -> str:
    return f"{count} {noun}" + ("" if count == 1 else "s")
