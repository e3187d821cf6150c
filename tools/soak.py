"""Runs the shipped scenes for many times their usual duration, in all combinations of settings: what drifts or breaks.

python tools/soak.py                         everything
python tools/soak.py --defaults              the default settings alone
python tools/soak.py two_point tnt_slab --times 50 --coarser 2
"""

import argparse
import itertools
import json
import os
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

import warp_mpm as mpm
from warp_mpm.config import Order, ShapeFunction, SolverConfig, Transfer
from warp_mpm.errors import InputError, SimulationError
from warp_mpm.scene import Scene
from warp_mpm.scene_loading import list_scenes

CONFINEMENTS = ("rigid", "free")
FRAMES = 21  # instants of the history

# What the defaults have to keep. Energy: as in `warp-mpm verify`. Mass: no particle may be lost, and sums on the grid
# are round-off, see docs/numerics.md.
LARGEST_ENERGY_ERROR = 1e-5
LARGEST_MASS_ERROR = 1e-6
LARGEST_GROWTH = 0.05  # of memory over the settled run; allocators take a few per cent more now and then
# Highest particle pressure after the usual duration over that during it: a wave may come to a wall only then, which
# turns a front of p_CJ into at most 2.63 p_CJ (see `warp_mpm.exact.collision` for burn zones of finite width).
LARGEST_LATE_RATIO = 2.63
SETTLED = 0.3  # of a run; before it memory is still being taken for the first time

MILLI, MICRO = 1e-3, 1e-6


@dataclass(frozen=True)
class Case:
    """One run: a scene and how it is solved."""

    scene: str
    parameters: dict[str, Any]
    config: SolverConfig

    @property
    def settings(self) -> str:
        """Shape, order and transfer, as on the command line."""
        return " ".join(item.value for item in (self.config.shape, self.config.order, self.config.transfer))

    @property
    def is_default(self) -> bool:
        """Whether it is solved with the defaults, which must hold."""
        return self.config == SolverConfig()


@dataclass
class Memory:
    """Told of every step of a run, it notes how far it is and the memory of this process."""

    settled: int | None = None  # [bytes]
    last: int | None = None  # [bytes]
    reached: float = 0.0  # time of the run [s]

    def message(self, text: str) -> None:
        """Nothing to note."""

    def update(self, time: float, end_time: float, step: int, note: str) -> None:
        """Note both."""
        self.reached = time
        self.last = resident_memory()
        if self.settled is None and time > SETTLED * end_time:
            self.settled = self.last

    def close(self) -> None:
        """Nothing to close."""

    def growth(self, known: int) -> float | None:
        """What was taken of memory since the run had settled, over what was in use then, but for `known` bytes.

        None where the system does not tell.
        """
        return None if self.last is None or self.settled is None else (self.last - self.settled - known) / self.settled


def main() -> int:
    """Soak what is asked for; 1 if the defaults did not hold somewhere, 2 if that was nonsense."""
    parser = argparse.ArgumentParser(description="Runs scenes for many times their duration, in every combination.")
    parser.add_argument("scenes", nargs="*", help="default: all shipped ones")
    parser.add_argument("--times", type=float, default=10.0, help="the usual duration (default: 10)")
    parser.add_argument("--coarser", type=float, default=3.0, help="than the usual cells (default: 3)")
    parser.add_argument("--defaults", action="store_true", help="the default settings alone")
    parser.add_argument("-o", "--output", type=Path, default=Path("out/soak"), help="default: out/soak")
    arguments = parser.parse_args()
    console = Console(width=160)
    rows = []
    try:
        names = arguments.scenes or [file.name for file in list_scenes()]
        for case in cases(names, arguments.coarser, arguments.defaults):
            rows.append(soak(case, arguments.times))
            console.print(f"{len(rows):4} {case.scene} {case.settings} {rows[-1]['verdict']}")
    except InputError as error:
        print(f"soak: {error}", file=sys.stderr)
        return 2
    console.print(table(rows))
    arguments.output.mkdir(parents=True, exist_ok=True)
    (arguments.output / "soak.json").write_text(json.dumps({"times": arguments.times, "runs": rows}, indent=1) + "\n")
    broken = [row for row in rows if row["default"] and row["verdict"] != "held"]
    for row in broken:
        console.print(f"{row['scene']} {row['parameters']}: {row['verdict']}")
    console.print(
        f"{len(rows)} runs, the defaults held in {sum(row['default'] for row in rows) - len(broken)} "
        f"of {sum(row['default'] for row in rows)}"
    )
    return 1 if broken else 0


def cases(names: Sequence[str], coarser: float, defaults: bool) -> Iterator[Case]:
    """Every scene in every confinement, with every combination of settings, the defaults first."""
    for name in names:
        usual = mpm.load_scene(name).parameters
        parameters = {"cell_size": coarser * usual["cell_size"]}
        confined = [{"confinement": kind} for kind in CONFINEMENTS] if "confinement" in usual else [{}]
        for confinement, config in itertools.product(confined, configs(defaults)):
            yield Case(name, {**parameters, **confinement}, config)


def configs(defaults: bool) -> list[SolverConfig]:
    """The default settings, and all other combinations that go together."""
    found = [SolverConfig()]
    for shape, order, transfer in itertools.product(ShapeFunction, Order, Transfer):
        try:
            config = SolverConfig(shape=shape, order=order, transfer=transfer)
        except InputError:  # the damping needs the re-projection
            continue
        if config not in found and not defaults:
            found.append(config)
    return found


def soak(case: Case, times: float) -> dict[str, Any]:
    """Run a case for `times` its usual duration: a row of the table."""
    usual = mpm.load_scene(case.scene, **case.parameters)
    row: dict[str, Any] = {
        "scene": case.scene,
        "parameters": case.parameters,
        "settings": case.settings,
        "default": case.is_default,
        "end_time_s": times * usual.end_time,
    }
    memory = Memory()
    try:
        figures = run(usual, replace(usual, end_time=times * usual.end_time), case.config, memory)
    except SimulationError as error:
        return {**row, "verdict": f"stopped at {memory.reached / usual.end_time:.1f}", "guard": str(error)}
    row |= figures
    return {**row, "verdict": "; ".join(faults(row)) or "held"}


def run(usual: Scene, scene: Scene, config: SolverConfig, memory: Memory) -> dict[str, Any]:
    """What a run leaves to look at."""
    result = mpm.simulate(scene, config=config, save=mpm.Save(frames=FRAMES), progress=memory)
    summary, record = result.summary, result.record
    usually = record.particle_pressure[record.time <= usual.end_time].max()
    late = record.particle_pressure[record.time > usual.end_time].max(initial=0.0)
    kept = sum(array.nbytes for array in (record.time, record.dt, record.particle_pressure, record.field_pressure))
    kept += sum(of.pressure.nbytes for of in (record.path, record.line) if of is not None)
    kept += sum(array.nbytes for gauge in record.gauges.values() for array in vars(gauge).values())
    return {
        "steps": summary["steps"],
        "particles": summary["particles"],
        "mass_error": summary["mass_error"],
        "momentum_error": summary["momentum_error"],
        "energy_error": summary["energy_error"],
        "least_time_step_ratio": summary["min_dt_s"] / summary["first_dt_s"],
        "highest_particle_pressure_pa": float(usually),
        "highest_late_particle_pressure_pa": float(late),
        "cj_pressure_pa": summary["p_cj_pa"],
        "memory_growth_ratio": memory.growth(kept),
        "warnings": summary["warnings"],
    }


def faults(row: dict[str, Any]) -> list[str]:
    """What a run that came to its end did not keep."""
    found = []
    if not row["energy_error"] <= LARGEST_ENERGY_ERROR:
        found.append(f"energy {row['energy_error']:.0e}")
    if not row["mass_error"] <= LARGEST_MASS_ERROR:
        found.append(f"mass {row['mass_error']:.0e}")
    ratio = row["highest_late_particle_pressure_pa"] / row["highest_particle_pressure_pa"]
    if not ratio <= LARGEST_LATE_RATIO:
        found.append(f"late pressures are {ratio:.1f} times those before")
    growth = row["memory_growth_ratio"]
    if growth is not None and growth > LARGEST_GROWTH:
        found.append(f"memory grew by {growth:.0%}")
    return found


def resident_memory() -> int | None:
    """Memory that this process has in use [bytes]; None where the system does not tell."""
    try:
        return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except OSError:
        return None


def table(rows: Sequence[dict[str, Any]]) -> Table:
    """All runs."""
    shown = Table(title="Soak: the scenes for many times their duration")
    for name in ("scene", "settings"):
        shown.add_column(name)
    for name in ("steps", "energy error", "min / first dt", "highest particle", "later, p_CJ", "memory"):
        shown.add_column(name, justify="right")
    shown.add_column("verdict")
    for row in rows:
        name = " ".join((row["scene"], row["parameters"].get("confinement", "")))
        figures = [""] * 6
        if "steps" in row:
            scale = row["cj_pressure_pa"] or 1.0
            late, growth = row["highest_late_particle_pressure_pa"], row["memory_growth_ratio"]
            figures = [
                str(row["steps"]),
                f"{row['energy_error']:.0e}",
                f"{row['least_time_step_ratio']:.2f}",
                f"{row['highest_particle_pressure_pa'] / scale:.2f}",
                f"{late / scale:.2f}",
                "–" if growth is None else f"{growth:+.1%}",
            ]
        shown.add_row(name, row["settings"], *figures, row["verdict"], style="bold" if row["default"] else None)
    return shown


if __name__ == "__main__":
    sys.exit(main())
