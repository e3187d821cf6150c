"""The run: steps a scene to its end, saves what was asked for, audits itself, and sums up."""

import math
import time
from collections.abc import Mapping
from contextlib import AbstractContextManager, nullcontext, suppress
from dataclasses import fields
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np

from warp_mpm import checks
from warp_mpm.checkpoint import Checkpoints, part, restore_solver, saved_solver
from warp_mpm.config import Save, SolverConfig
from warp_mpm.conservation import Audit, Totals, history_row, sparse_share, totals_of
from warp_mpm.errors import SimulationError, Terminated
from warp_mpm.fingerprint import fingerprints
from warp_mpm.guards import check_memory, check_state, clamp_warnings, directory_for
from warp_mpm.isosurface import pressure_isosurface
from warp_mpm.kernels.precision import PRECISION
from warp_mpm.launch import Launcher, find_device
from warp_mpm.model import Model, build_model
from warp_mpm.output.description import scene_values
from warp_mpm.output.frame import Frame, SectionPicture, StepRecord
from warp_mpm.progress import Progress, Silent, opening
from warp_mpm.recorder import Recorder
from warp_mpm.result import Result
from warp_mpm.run_directory import FIGURES, STEPS, SUMMARY, load, remove_results
from warp_mpm.scene import Scene, Wall
from warp_mpm.section import section_pressure
from warp_mpm.solver import Solver
from warp_mpm.state import State
from warp_mpm.stopping import StopRequest
from warp_mpm.summary import figures_of_merit, gauge_warnings
from warp_mpm.turns import taking_turns
from warp_mpm.version import VERSION

GROWTH = 1.1  # of the time step, at most; as in kernels.reduce
STEPS_BETWEEN_AUDITS = 100  # at most: errors are looked for between frames too, however few there are
STEPS_AT_ONCE = 4  # on a GPU, so that the drift between two looks at it stays below a cell or two


@taking_turns
def simulate(
    scene: Scene,
    *,
    config: SolverConfig | None = None,
    save: Save | None = None,
    output: str | Path | None = None,
    device: str | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
    resume: bool = False,
) -> Result:
    """Simulate a scene to its end time.

    Asked to stop by SIGINT (Ctrl-C) or SIGTERM, it ends the step, saves what there is with a checkpoint, and raises
    KeyboardInterrupt or `Terminated`; asked again after a second, it stops at once. Called in a thread while another
    runs one, it waits: one run uses all cores, and several at a time want a process each.

    Args:
        scene: what is simulated.
        config: how; the defaults if not given.
        save: when and what to save.
        output: directory for the results, made if need be; nothing is written without it.
        device: "cpu", "cuda:0", ...; a GPU if there is one.
        threads: on a CPU; one a core.
        progress: told how far the run is, and closed; `progress_on()` shows it.
        resume: go on from the last checkpoint in `output`, as if the run had never stopped.

    Raises:
        InputError: unknown device, too little memory, an output directory that cannot be written or holds a run
            of another scene, or to resume there is no checkpoint, or one of something else.
        SimulationError: the run cannot go on.
    """
    config, save = SolverConfig() if config is None else config, Save() if save is None else save
    run = _Run(scene, config, save, output, device, threads, Silent() if progress is None else progress, resume)
    try:
        run.to_the_end()
    except (KeyboardInterrupt, Terminated):
        run.sum_up("interrupted")
        raise
    except SimulationError as error:
        with suppress(SimulationError):  # a disk that was full may still be
            run.sum_up(f"failed: {error}")
        raise SimulationError(f"{error}{run.checkpoints.remedy()}") from error
    finally:
        run.launcher.close()
        run.progress.close()
    result = run.finish("complete")
    run.checkpoints.remove()
    return result


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
        resume: bool,
    ) -> None:
        self.scene = checks.instance(
            "simulate: scene", scene, Scene, "a Scene", "a SceneBuilder makes one: builder.build()"
        )
        self.save = checks.instance("simulate: save", save, Save, "a Save")
        checks.instance("simulate: config", config, SolverConfig, "a SolverConfig")
        checks.flag("simulate: resume", resume)
        self.progress = checks.instance(
            "simulate: progress", progress, Progress, "a Progress", "progress_on() makes one"
        )
        self.begin = time.perf_counter()  # [s]; of a resumed run, as if it had gone on all the time
        self.launcher = Launcher(find_device(device), threads)
        self.steps_at_once = STEPS_AT_ONCE if self.launcher.device.is_cuda else 1
        self.output = None if output is None else directory_for(scene.name, checks.as_path("simulate: output", output))
        self.model = build_model(scene, config, self.launcher.device)
        check_memory(self.model)
        self.checkpoints = Checkpoints(self.output, self._identity(config), save)
        saved = self.checkpoints.read() if resume else None
        progress.message(opening(scene, self.launcher.device.name, self.launcher.threads))
        self.state = State(self.model, self.launcher)
        self.solver = Solver(self.model, self.state, self.launcher)
        self.recorder = Recorder(self.state)
        self.audit = Audit(np.array(scene.gravity), scene.mass)
        self.frame_times = np.linspace(0.0, scene.end_time, save.frames)
        self.picture_times = sorted(scene.picture_times)
        self.history: list[dict[str, float]] = []  # a row for each frame written
        self.pictures: list[SectionPicture] = []
        self.warnings: list[str] = []
        self.solver_seconds = 0.0
        self.steps = 0
        self.audited_step = 0
        if saved is not None:
            self._restore(*saved)

    def to_the_end(self) -> None:
        """Step to the end time; save frames and pictures at the first step at or past their instants."""
        end = self.scene.end_time
        if not self.history:
            self.checkpoints.remove()  # of an earlier run
            self.recorder.record()
        with self._files() as write:
            now = float(self.state.clock_values()["time"])
            self._save_due(write, now)
            self._write_start()
            with StopRequest() as stop:
                while now < end and stop.signal is None:
                    now = self._advance(min(self._instants_to_come()))
                    self._save_due(write, now)
                    peak = self.history[-1]["peak_pressure_pa"]
                    self.progress.update(now, end, self.steps, f"peak {peak / 1e9:.2f} GPa")
                    if now < end and self.checkpoints.due(self.steps):
                        self._write_checkpoint()
                if now < end:
                    self._write_checkpoint()
                    if self.history[-1]["step"] < self.steps:  # the state at the stop; who goes on writes it anew
                        self._save_frames(write, now, 1)
                    raise stop.exception(f"interrupted at {now * 1e6:.3f} us{self.checkpoints.remedy()}")

    def sum_up(self, status: str) -> None:
        """Sum up a run that has stopped before its end; before the first frame there is nothing to sum up."""
        if self.history:
            self.finish(status)

    def finish(self, status: str) -> Result:
        """Sum up what there is, and draw it."""
        record = self.recorder.result()
        summary = {"status": status, **self._summary(record)}
        if self.output is not None:
            from warp_mpm.output.steps import write_steps
            from warp_mpm.output.tables import write_summary

            write_summary(self.output / SUMMARY, summary)
            write_steps(self.output / STEPS, record, self.pictures)
            if self.save.figures:
                self.progress.message("drawing figures")
                summary["warnings"] += self._draw()
            summary["wall_s"] = time.perf_counter() - self.begin
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
        check_state(self.state, self.steps)
        if self.steps % self.steps_at_once == 0:
            self.solver.sort_if_due()
        if self.steps - self.audited_step >= STEPS_BETWEEN_AUDITS:
            self._audit()
        self.solver_seconds += time.perf_counter() - begin
        return float(clock["time"])

    def _safe_steps(self, left: float, dt: float) -> int:
        """Steps that surely end before an instant that is `left` seconds away, then at least one.

        On a CPU looking at the clock costs nothing. On a GPU it waits for all work, so several steps go out at once,
        up to the next that may sort the particles: which those are does not depend on frames, nor on a stop.
        """
        if self.steps_at_once == 1 or dt <= 0.0:
            return 1
        surely = math.floor(math.log1p((GROWTH - 1.0) * left / (GROWTH * dt)) / math.log(GROWTH))
        return max(1, min(surely, self.steps_at_once - self.steps % self.steps_at_once))

    def _instants_to_come(self) -> list[float]:
        """The next frame's and the next picture's [s]."""
        frames, pictures = self.frame_times[len(self.history) :], self.picture_times[len(self.pictures) :]
        return [*frames[:1], *pictures[:1]]

    def _save_due(self, write: Any, now: float) -> None:
        """Save the frames and pictures whose instants have come."""
        while len(self.pictures) < np.searchsorted(self.picture_times, now, side="right"):
            self.pictures.append(SectionPicture(now, section_pressure(self.state)))
        self._save_frames(write, now, int(np.searchsorted(self.frame_times, now, side="right")) - len(self.history))

    def _save_frames(self, write: Any, now: float, count: int) -> None:
        """Save the present state as the next `count` frames."""
        if count == 0:
            return
        totals = self._audit()
        pressure = self.state.field("pressure")
        inside = self.state.field("mass") > 0.0
        row = self._history_row(totals, pressure[inside])
        for index in range(len(self.history), len(self.history) + count):
            self.history.append(row)
            if write is not None:
                write(self._frame(index, now, pressure, inside), row)

    def _write_checkpoint(self) -> None:
        """Save all that it takes to go on from here."""
        values = {
            "steps": self.steps,
            "audited_step": self.audited_step,
            "solver_seconds": self.solver_seconds,
            "wall_seconds": time.perf_counter() - self.begin,
            "history": self.history,
        }
        parts = {"record": self.recorder.saved(), "audit": self.audit.saved()}
        arrays = {f"{part}.{name}": array for part, saved in parts.items() for name, array in saved.items()}
        if self.pictures:
            arrays["pictures.time"] = np.array([picture.time for picture in self.pictures])
            arrays["pictures.pressure"] = np.stack([picture.pressure for picture in self.pictures])
        self.checkpoints.write(self.steps, values, {**saved_solver(self.solver), **arrays})

    def _restore(self, values: Mapping[str, Any], arrays: Mapping[str, np.ndarray], warnings: list[str]) -> None:
        """Go on from a checkpoint.

        Raises:
            InputError: it does not fit.
        """
        self.warnings = warnings
        with self.checkpoints.must_fit():
            restore_solver(self.solver, arrays)
            self.recorder.restore(part(arrays, "record"))
            self.audit.restore(part(arrays, "audit"))
            pictures = zip(arrays.get("pictures.time", ()), arrays.get("pictures.pressure", ()), strict=True)
            self.pictures = [SectionPicture(float(time), pressure) for time, pressure in pictures]
            self.history = values["history"]
            if not self.history:
                raise ValueError("no frames")
            self.steps, self.audited_step = values["steps"], values["audited_step"]
            self.solver_seconds = values["solver_seconds"]
            self.begin -= values["wall_seconds"]
        self.progress.message(f"going on from {self.checkpoints.latest}, step {self.steps}")

    def _identity(self, config: SolverConfig) -> dict[str, str]:
        """What a checkpoint of this run goes on with, and none else."""
        device = "a GPU" if self.launcher.device.is_cuda else "a CPU"
        return {**fingerprints(self.scene, config, self.save), "device": device, "precision": PRECISION}

    def _audit(self) -> Totals:
        """The present totals, compared with those at the start."""
        totals = totals_of(self.solver)
        self.audit.add(totals)
        self.audited_step = self.steps
        return totals

    def _history_row(self, totals: Totals, pressure: np.ndarray) -> dict[str, float]:
        clock = self.state.clock_values()
        pressure = pressure.astype(np.float64)  # the square of an absurd one may be beyond single precision
        mean = float(pressure.mean()) if len(pressure) else 0.0
        spread = float(pressure.std()) / mean if mean > 0.0 else 0.0
        peak, sparse = self.recorder.take_peak(), sparse_share(self.state)
        return history_row(totals, self.steps, float(clock["dt"]), peak, spread, sparse)

    def _files(self) -> AbstractContextManager[Any]:
        """A function that writes a frame and a row of the history, or None; closed whatever way the run ends."""
        if self.output is None:
            return nullcontext()
        from warp_mpm.run_files import run_files

        return run_files(self.output, self.scene, self.save, self.recorder, self.history)

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

            remove_results(self.output)
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

    def _summary(self, record: StepRecord) -> dict[str, Any]:
        clock = self.state.clock_values()
        final = self.history[-1]
        warnings = [*self.scene.warnings, *self.warnings, *self._frame_warnings(), *clamp_warnings(self.audit)]
        return {
            **self._given(),
            "steps": self.steps,
            "end_time_s": float(clock["time"]),
            "wall_s": time.perf_counter() - self.begin,
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
            "sparse_share": final["sparse_share"],
            "particle_volume_error": self._volume_error(),
            "warnings": [*warnings, *gauge_warnings(self.scene, record)],
        }

    def _volume_error(self) -> float | None:
        """Relative difference of the particles' volume from the charges'; None where gas may expand out of faces."""
        if Wall.OPEN in self.scene.walls.faces():
            return None
        return self.history[-1]["particle_volume_m3"] / sum(charge.volume for charge in self.scene.charges) - 1.0

    def _frame_warnings(self) -> list[str]:
        asked_for = self.save.frames != Save().frames  # the default is for runs of any length
        if not asked_for or self.save.frames <= self.steps + 1:
            return []
        return [f"frames: {self.save.frames} asked for, but only {self.steps} steps taken: some frames are repeated"]


def _solver_values(model: Model) -> dict[str, Any]:
    """The settings as the summary shows them, the burn width resolved."""
    values = {item.name: getattr(model.config, item.name) for item in fields(model.config)}
    values = {name: value.value if isinstance(value, Enum) else value for name, value in values.items()}
    return {**values, "burn_width": model.burn_width}
