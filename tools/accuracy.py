"""Measures how accurate the solver is: the tables of the README.

    python tools/accuracy.py taylor     planar Taylor wave against its exact solution (2 minutes)
    python tools/accuracy.py paper      the paper's two scenes, rigid and free, with refinement (8 minutes)
    python tools/accuracy.py vacuum     gas that expands freely for a long time (6 minutes)
    python tools/accuracy.py box        a closed box for a millisecond (6 minutes)
    python tools/accuracy.py precision  what round-off does to the paper's scenes (3 minutes)

Times are for 2 CPU cores. One set of solver defaults everywhere; what differs is in the first column. All of it is in
the precision that the environment variable WARP_MPM_PRECISION names.
"""

import sys
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

import warp_mpm as mpm
from warp_mpm.exact.taylor_wave import PlanarTaylorWave
from warp_mpm.kernels.precision import PRECISION
from warp_mpm.parameters import annotations_of, from_text
from warp_mpm.verification import pressure_error

TAYLOR_CELLS = (3e-3, 1.5e-3, 0.75e-3)  # [m]
TAYLOR_VARIANTS: tuple[tuple[str, int, str], ...] = (
    # name, particles per axis, solver settings
    ("defaults (burn_width 0.5)", 2, ""),
    ("burn_width 1.5", 2, "burn_width=1.5"),
    ("burn_width 3, the paper's", 2, "burn_width=3"),
    ("1 particle per axis", 1, ""),
    ("3 particles per axis", 3, ""),
    ("4 particles per axis", 4, ""),
    ("plain FLIP", 2, "transfer=flip"),
    ("GIMP", 2, "shape=gimp"),
    ("USL", 2, "order=usl transfer=flip"),
    ("USF", 2, "order=usf transfer=flip"),
    ("APIC", 2, "transfer=apic"),
    ("linear, burn_width 3, as the paper", 2, "shape=linear transfer=flip burn_width=3"),
)
PAPER_RUNS: tuple[tuple[str, Mapping[str, Any]], ...] = (
    ("two_point", {"cell_size": 6e-3}),
    ("two_point", {"cell_size": 4e-3}),
    ("two_point", {"cell_size": 3e-3}),
    ("two_point", {"cell_size": 2e-3}),
    ("two_point", {"confinement": "free"}),
    ("six_point", {}),
    ("six_point", {"confinement": "free"}),
)
PRECISION_RUNS: tuple[tuple[str, Mapping[str, Any]], ...] = (
    ("two_point", {"cell_size": 6e-3}),
    ("two_point", {"cell_size": 6e-3, "confinement": "free"}),
    ("two_point", {"cell_size": 4e-3, "confinement": "free"}),
    ("two_point", {"cell_size": 3e-3, "confinement": "free"}),
    ("six_point", {"cell_size": 4e-3, "confinement": "free"}),
)
VACUUM_RUNS: tuple[Mapping[str, Any], ...] = ({"margin": 1.0, "end_time": 300e-6}, {"end_time": 500e-6})
BOX_RUNS = ((6e-3, ""), (4e-3, ""), (3e-3, ""), (6e-3, "transfer=flip"))

MILLI, MICRO, GIGA = 1e-3, 1e-6, 1e9
QUIET_AFTER = 120e-6  # [s] no particle of the free plate should be high after this
SETTLED_AFTER = 600e-6  # [s] nor any in the closed box after this


def main(arguments: list[str]) -> int:
    """Measure what is asked for, or everything."""
    unknown = [name for name in arguments if name not in TABLES]
    if unknown:
        print(f"accuracy: expected any of {', '.join(TABLES)}, got {unknown[0]!r}", file=sys.stderr)
        return 2
    console = Console(width=150)
    for name in arguments or TABLES:
        console.print(TABLES[name](console))
    return 0


def solver_config(settings: str) -> mpm.SolverConfig:
    """Solver settings from words as on the command line."""
    return mpm.SolverConfig(**from_text(settings.split(), annotations_of(mpm.SolverConfig, "solver"), "solver"))


def taylor_table(console: Console) -> Table:
    """L1 error of the pressure after a run of 300 mm, for each variant and cell size."""
    table = Table(title="Planar Taylor wave, 300 mm run, free rear: relative L1 error of the pressure")
    table.add_column("variant")
    for cell in TAYLOR_CELLS:
        table.add_column(f"{cell / MILLI:g} mm", justify="right")
    table.add_column("order", justify="right")
    table.add_column("energy error", justify="right")
    for name, particles, settings in TAYLOR_VARIANTS:
        console.print(f"taylor: {name}")
        errors, energy = [], 0.0
        for cell in TAYLOR_CELLS:
            scene = mpm.load_scene("taylor_wave", cell_size=cell, particles_per_axis=particles)
            result = mpm.simulate(scene, config=solver_config(settings), save=mpm.Save(frames=5))
            exact = PlanarTaylorWave(gamma=2.0, density=1000.0, detonation_speed=2800.0)
            errors.append(pressure_error(result.state, exact, result.summary["end_time_s"]))
            energy = max(energy, result.summary["energy_error"])
        order = np.log2(errors[0] / errors[-1]) / (len(errors) - 1)
        table.add_row(name, *(f"{error:.4f}" for error in errors), f"{order:.2f}", f"{energy:.0e}")
    return table


def paper_table(console: Console) -> Table:
    """The paper's scenes, with refinement."""
    return _scene_table(console, "paper", PAPER_RUNS)


def precision_table(console: Console) -> Table:
    """The paper's scenes where round-off shows, small ones among them: to be run in single and in double precision."""
    return _scene_table(console, "precision", PRECISION_RUNS)


def _scene_table(console: Console, heading: str, runs: tuple[tuple[str, Mapping[str, Any]], ...]) -> Table:
    """Front and collision pressures of scenes of the paper, conservation errors, and mirror symmetry."""
    columns = (
        "front",
        "gauges",
        "m/s",
        "residual",
        "offset",
        "collisions",
        "ratio",
        "mirror",
        "inner",
        "energy",
        "mass",
    )
    table = _table(
        f"The paper's scenes at the defaults, in {PRECISION} precision: pressures in GPa, residual and offset of the "
        "front in cells, mirror asymmetry in p_CJ over all nodes, and away from open faces",
        ("scene", *columns, "momentum", "s"),
    )
    for name, parameters in runs:
        label = _label(name, parameters)
        console.print(f"{heading}: {label}")
        scene = mpm.load_scene(name, **parameters)
        result = mpm.simulate(scene, save=mpm.Save(frames=31))
        figures = result.summary
        cell = scene.domain.spacing[1]
        collisions = figures["collision_pressures_pa"]
        table.add_row(
            label,
            f"{figures['front_pressure_pa'] / GIGA:.3f}",
            f"{figures['front_gauge_pressure_pa'] / GIGA:.3f}",
            f"{figures['front_speed_m_s']:.0f}",
            f"{figures['front_fit_residual_m'] / cell:.2f}",
            f"{figures['front_offset_m'] / cell:+.2f}",
            " ".join(f"{pressure / GIGA:.2f}" for pressure in collisions),
            f"{max(collisions) / figures['front_pressure_pa']:.2f}",
            *(f"{asymmetry(scene, result.state.field_pressure(), n) / figures['p_cj_pa']:.0e}" for n in (0, 2)),
            *(f"{figures[key]:.0e}" for key in ("energy_error", "mass_error", "momentum_error")),
            f"{figures['wall_s']:.0f}",
        )
    return table


def asymmetry(scene: mpm.Scene, field: np.ndarray, layers: int = 0) -> float:
    """Largest difference of the field pressure at the end from its mirror images [Pa].

    `layers` of nodes next to each open face can be left out: which of two mirror images leaves a step earlier is a
    matter of round-off, and a whole particle's pressure goes with it.
    """
    kept = tuple(
        slice(layers if low is mpm.Wall.OPEN else 0, size - (layers if high is mpm.Wall.OPEN else 0))
        for low, high, size in zip(scene.walls.faces()[0::2], scene.walls.faces()[1::2], field.shape, strict=True)
    )
    inner = field[kept]
    axes = (0, 1, 2) if scene.name == "two_point" else (0, 2)
    return max(float(np.abs(inner - np.flip(inner, axis)).max()) for axis in axes)


def vacuum_table(console: Console) -> Table:
    """A plate that flies apart: what leaves, and how quiet the gas stays."""
    columns = ("highest particle after 120 us, GPa", "smallest / first dt", "energy error", "mass out per face, %")
    table = _table("two_point free at 6 mm, long after", ("run", *columns, "s"))
    for parameters in VACUUM_RUNS:
        label = _label("two_point", parameters)
        console.print(f"vacuum: {label}")
        scene = mpm.load_scene("two_point", cell_size=6e-3, confinement="free", **parameters)
        result = mpm.simulate(scene, save=mpm.Save(frames=31))
        figures, record = result.summary, result.record
        late = record.particle_pressure[record.time > QUIET_AFTER].max()
        out = [100.0 * mass / scene.mass for mass in figures["mass_out_kg"].values()]
        table.add_row(
            label,
            f"{late / GIGA:.2f}",
            f"{figures['min_dt_s'] / figures['first_dt_s']:.2f}",
            f"{figures['energy_error']:.0e}",
            " ".join(f"{share:.2f}" for share in out),
            f"{figures['wall_s']:.0f}",
        )
    return table


def box_table(console: Console) -> Table:
    """two_point in its rigid box to 1 ms: does the gas come to rest, or grow noisy?"""
    columns = ("volumes - box, %", "spread", "of the field", "highest particle after 600 us, p_CJ", "energy error")
    table = _table("two_point rigid to 1 ms", ("run", *columns, "s"))
    for cell, settings in BOX_RUNS:
        label = f"{cell / MILLI:g} mm {settings or 'defaults'}"
        console.print(f"box: {label}")
        scene = mpm.load_scene("two_point", cell_size=cell, end_time=1e-3)
        result = mpm.simulate(scene, config=solver_config(settings), save=mpm.Save(frames=31))
        figures, record = result.summary, result.record
        late = record.particle_pressure[record.time > SETTLED_AFTER].max() / figures["p_cj_pa"]
        field = result.state.field_pressure()
        table.add_row(
            label,
            f"{100.0 * figures['particle_volume_error']:+.2f}",
            f"{figures['pressure_spread']:.3f}",
            f"{field.std() / field.mean():.3f}",
            f"{late:.2f}",
            f"{figures['energy_error']:.0e}",
            f"{figures['wall_s']:.0f}",
        )
    return table


TABLES: dict[str, Callable[[Console], Table]] = {
    "taylor": taylor_table,
    "paper": paper_table,
    "vacuum": vacuum_table,
    "box": box_table,
    "precision": precision_table,
}


def _table(title: str, columns: tuple[str, ...]) -> Table:
    table = Table(title=title)
    for number, column in enumerate(columns):
        table.add_column(column, justify="left" if number == 0 else "right")
    return table


def _label(name: str, parameters: Mapping[str, Any]) -> str:
    units = {"cell_size": (MILLI, "mm"), "end_time": (MICRO, "us")}
    words = [name]
    for key, value in parameters.items():
        scale, unit = units.get(key, (1.0, ""))
        words.append(f"{key}={value / scale:g}{unit}" if isinstance(value, float) else str(value))
    return " ".join(words)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
