"""The command line `warp-mpm`.

A user's mistake is one line on standard error and exit code 2; a run that cannot go on, or a broken bound of `verify`,
code 1; an interrupt, 130; SIGTERM, 143.
Modules that take long to import are imported where they are used: `list` and `--help` answer at once.
"""

import argparse
import os
import sys
import traceback
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NoReturn

from warp_mpm.checks import count, mistake
from warp_mpm.config import PARTICLE_FIELDS, Layout, Save, SolverConfig
from warp_mpm.errors import InputError, SimulationError, Terminated, VerificationError
from warp_mpm.parameters import annotations_of, from_text
from warp_mpm.version import VERSION

SUCCESS, FAILURE, MISTAKE, INTERRUPTED, TERMINATED = 0, 1, 2, 130, 143


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code.

    Args:
        arguments: words after `warp-mpm`; those of this process if not given.
    """
    words = sys.argv[1:] if arguments is None else list(arguments)
    try:
        options = _parser().parse_args(words)
        options.command(options)
        sys.stdout.flush()
    except InputError as error:
        return _report(str(error), MISTAKE, words)
    except BrokenPipeError:  # who read the output has seen enough: `warp-mpm list | head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # or the flush at exit would fail again
        return SUCCESS
    except (SimulationError, VerificationError, OSError) as error:
        return _report(str(error), FAILURE, words)
    except KeyboardInterrupt as error:
        return _report(str(error) or "interrupted; the frames written so far are kept", INTERRUPTED, words)
    except Terminated as error:
        return _report(str(error), TERMINATED, words)
    except Exception as error:
        remedy = "this is a fault of warp_mpm: please report it with what --debug shows"
        return _report(f"{type(error).__name__}: {error}; {remedy}", FAILURE, words)
    return SUCCESS


def _report(text: str, exit_code: int, words: Sequence[str]) -> int:
    """Say in one line what went wrong, after the traceback of the current exception if `--debug` asks for it."""
    if "--debug" in words:
        traceback.print_exc()
    print(f"warp-mpm: {' '.join(text.split())}", file=sys.stderr)
    return exit_code


class _Parser(argparse.ArgumentParser):
    """Reports wrong usage as every other mistake: in one line."""

    def error(self, message: str) -> NoReturn:
        """Raise what argparse found.

        Raises:
            InputError: always.
        """
        raise InputError(f"{message}; see {self.prog} --help")


def _parser() -> argparse.ArgumentParser:
    """All commands and their options."""
    common = _Parser(add_help=False)
    common.add_argument("--debug", action="store_true", help="show the traceback of an error")
    parser = _Parser(prog="warp-mpm", description="3D simulation of detonation with the Material Point Method.")
    parser.add_argument("--version", action="version", version=f"%(prog)s {VERSION}")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)

    run = commands.add_parser("run", parents=[common], help="simulate a scene", description="Simulate a scene.")
    run.set_defaults(command=_run)
    run.add_argument("scene", metavar="SCENE", help="a scene file, or a name that 'warp-mpm list' shows")
    run.add_argument("-o", "--output", metavar="DIR", type=Path, help="where to write (default: out/<scene>)")
    _add_settings(run, "--set", "parameters of the scene, e.g. cell_size=6e-3 confinement=free")
    run.add_argument("--resume", action="store_true", help="go on from the last checkpoint in the output directory")
    _add_saving(run)
    _add_solving(run)

    scenes = commands.add_parser("list", parents=[common], help="list scenes", description="List scenes.")
    scenes.set_defaults(command=_list)
    scenes.add_argument("directory", metavar="DIR", nargs="?", help="default: ./scenes and the shipped scenes")

    text = "Materials with the speed and pressure stated for them, and those that their equation of state implies."
    materials = commands.add_parser("materials", parents=[common], help="list materials", description=text)
    materials.set_defaults(command=_materials)
    materials.add_argument("file", metavar="FILE", nargs="?", help="a TOML file of materials (default: the library)")

    _add_result_commands(commands, common)

    text = "Solve problems with exact answers: error tables, pictures, and exit code 1 when a bound is broken."
    check = commands.add_parser("verify", parents=[common], help="compare with exact solutions", description=text)
    check.set_defaults(command=_verify)
    check.add_argument("problems", metavar="PROBLEM", nargs="*", help="names that --list shows (default: all)")
    check.add_argument("-o", "--output", metavar="DIR", type=Path, help="where to write (default: out/verify)")
    check.add_argument("--full", action="store_true", help="also the levels that take long (about 40 minutes)")
    check.add_argument("--levels", metavar="N", type=int, help="the N coarsest levels of each problem instead")
    check.add_argument("--list", action="store_true", help="list the problems and do nothing else")
    _add_solving(check)
    return parser


def _add_result_commands(commands: Any, common: argparse.ArgumentParser) -> None:
    """The commands that look at what a run left."""
    info = commands.add_parser("info", parents=[common], help="describe a result", description="Describe a result.")
    info.set_defaults(command=_info)
    info.add_argument("path", metavar="PATH", type=Path, help="a run directory or a USD file")

    text = "Write frames of a run, finished or killed, for other programs: .pvd for ParaView, .glb for the web."
    export = commands.add_parser("export", parents=[common], help="write a result as .pvd or .glb", description=text)
    export.set_defaults(command=_export)
    export.add_argument("path", metavar="RUN", type=Path, help="a run directory or a USD file")
    to = "a .pvd or .glb file, or a directory for a .pvd"
    export.add_argument("--to", metavar="FILE", type=Path, required=True, help=to)
    export.add_argument("--frame", metavar="K", type=int, help="one frame, from 0 (.pvd: default all; .glb: needed)")

    text = "Draw the pictures of a run again, from what it left in its directory."
    figures = commands.add_parser("figures", parents=[common], help="draw the pictures of a run", description=text)
    figures.set_defaults(command=_figures)
    figures.add_argument("directory", metavar="DIR", type=Path, help="a run directory")
    figures.add_argument("names", metavar="PICTURE", nargs="*", help="field, section, ... (default: all there are)")
    figures.add_argument("-o", "--output", metavar="DIR", type=Path, help="where to write (default: DIR/figures)")
    figures.add_argument("--animate", choices=("gif", "mp4"), help="field and section at every frame, too")


def _add_saving(parser: argparse.ArgumentParser) -> None:
    """The options that say what is saved."""
    default = Save()
    parser.add_argument("--frames", type=int, default=default.frames, help="saved frames (default: %(default)s)")
    parser.add_argument(
        "--fields",
        metavar="FIELD",
        nargs="+",
        default=list(default.fields),
        help=f"further particle fields in the USD file: {', '.join(PARTICLE_FIELDS)}",
    )
    parser.add_argument(
        "--layout",
        choices=[layout.value for layout in Layout],
        default=default.layout.value,
        help="the USD file: in one, as one clip a frame, or (auto) in one if it is below about 1 GB",
    )
    parser.add_argument(
        "--particles-every",
        metavar="K",
        type=int,
        default=default.particles_every,
        help="one particle in K in the USD file; the section stays whole (default: %(default)s)",
    )
    parser.add_argument(
        "--isosurface",
        metavar="PRESSURE_PA",
        type=float,
        help="also show in the USD file where the pressure has this value [Pa]",
    )
    parser.add_argument("--usdz", action="store_true", help="also pack the USD file into a .usdz")
    parser.add_argument("--no-figures", action="store_true", help="no pictures; 'warp-mpm figures' draws them later")
    parser.add_argument(
        "--checkpoint-steps",
        metavar="N",
        type=int,
        help="a checkpoint, to go on from with --resume, every N steps (default: by the clock alone)",
    )
    parser.add_argument(
        "--checkpoint-minutes",
        metavar="M",
        type=float,
        default=default.checkpoint_minutes,
        help="and every M minutes (default: %(default)g)",
    )


def _save(options: argparse.Namespace) -> Save:
    """What a command saves.

    Raises:
        InputError: a value is out of range, or a field is unknown.
    """
    return Save(
        frames=options.frames,
        fields=tuple(options.fields),
        figures=not options.no_figures,
        layout=Layout(options.layout),
        particles_every=options.particles_every,
        isosurface=options.isosurface,
        usdz=options.usdz,
        checkpoint_steps=options.checkpoint_steps,
        checkpoint_minutes=options.checkpoint_minutes,
    )


def _add_solving(parser: argparse.ArgumentParser) -> None:
    """The options that say how something is solved."""
    _add_settings(parser, "--solver", "settings of the solver, e.g. shape=linear viscosity=1.5,0.06")
    parser.add_argument("--device", help="cpu, cuda:0, ... (default: the GPU if there is one)")
    parser.add_argument("--threads", type=int, help="threads on a CPU (default: one per core)")
    parser.add_argument("--precision", help="single or double (default: WARP_MPM_PRECISION, or single)")


def _choose_precision(precision: str | None) -> None:
    """Have the kernels made in a precision, which is that of the whole process; if none is given, as they would be.

    Raises:
        InputError: there is no such precision, or this process has kernels of the other one.
    """
    if precision is not None:
        os.environ["WARP_MPM_PRECISION"] = precision
    try:
        from warp_mpm.kernels.precision import PRECISION
    except ValueError as error:
        raise InputError(str(error)) from error
    if precision not in (None, PRECISION):
        raise mistake("precision", f"{PRECISION}, for which this process has kernels", repr(precision))


def _solver_config(options: argparse.Namespace) -> SolverConfig:
    """The solver settings of a command, after a look at its threads.

    Raises:
        InputError: a setting is unknown or out of range, or there is not at least one thread.
    """
    if options.threads is not None:
        count("threads", options.threads)
    return SolverConfig(**from_text(options.solver, annotations_of(SolverConfig, "solver"), "solver"))


def _add_settings(parser: argparse.ArgumentParser, option: str, purpose: str) -> None:
    """An option that takes any number of "name=value", and may come more than once."""
    parser.add_argument(option, metavar="name=value", nargs="+", action="extend", default=[], help=purpose)


def _run(options: argparse.Namespace) -> None:
    """Simulate a scene and print how the figures compare with theory.

    Raises:
        InputError: scene, parameters, settings, device or output directory do not work.
        SimulationError: the run cannot go on.
    """
    _choose_precision(options.precision)

    from warp_mpm.output.progress_bar import progress_on
    from warp_mpm.output.tables import print_summary
    from warp_mpm.scene_loading import load_scene_from_text
    from warp_mpm.simulation import simulate
    from warp_mpm.warp_startup import start_quietly

    config = _solver_config(options)
    save = _save(options)
    start_quietly()
    scene = load_scene_from_text(options.scene, options.set)
    result = simulate(
        scene,
        config=config,
        save=save,
        output=options.output if options.output is not None else Path("out") / scene.name,
        device=options.device,
        threads=options.threads,
        progress=progress_on(),
        resume=options.resume,
    )
    print_summary(result.summary)
    print(f"files in {result.output}")


def _list(options: argparse.Namespace) -> None:
    """Print the names of scenes and what they are.

    Raises:
        InputError: the directory does not exist.
    """
    from warp_mpm.scene_loading import list_scenes

    scenes = list_scenes(options.directory)
    width = max((len(scene.name) for scene in scenes), default=0)
    for scene in scenes:
        print(f"{scene.name:{width}}  {scene.summary}")


def _materials(options: argparse.Namespace) -> None:
    """Print the materials of the library, or those of a file.

    Raises:
        InputError: the file is not one of materials.
    """
    from warp_mpm.material_files import load_materials
    from warp_mpm.material_library import library
    from warp_mpm.output.materials_table import print_materials
    from warp_mpm.warp_startup import start_quietly

    start_quietly()
    print_materials(library() if options.file is None else load_materials(options.file))


def _info(options: argparse.Namespace) -> None:
    """Print what a run directory or a USD file holds.

    Raises:
        InputError: there is no such file, or it is none of these.
    """
    if not options.path.exists():
        raise mistake("info", "a run directory or a USD file", repr(str(options.path)))

    from warp_mpm.output.info import describe

    print(describe(options.path))


def _export(options: argparse.Namespace) -> None:
    """Write a result for other programs, and print what to open.

    Raises:
        InputError: there is no such result, or no such format.
        SimulationError: the disk is full or refuses.
    """
    from warp_mpm.output.export import export

    print(export(options.path, options.to, options.frame))


def _figures(options: argparse.Namespace) -> None:
    """Draw the pictures of a run, and print which.

    Raises:
        InputError: no run directory, an unknown picture, or a program that drawing needs is missing.
    """
    from warp_mpm.run_directory import FIGURES, load

    try:
        from warp_mpm.output.figures import draw_figures, render
    except ImportError as error:
        raise mistake("figures", "matplotlib", "none", "pip install matplotlib") from error
    run = load(options.directory)
    wants_pyvista = render.is_installed() and "field" in (options.names or ["field"])
    fault = render.fault() if wants_pyvista else None
    if fault is not None:
        print(f"PyVista cannot draw here ({fault}): matplotlib draws the surfaces, coarser")
    smooth = wants_pyvista and fault is None
    target = options.output if options.output is not None else options.directory / FIGURES
    drawn, missing = draw_figures(run, target, options.names, options.animate, smooth)
    for name, reason in missing.items():
        print(f"{name}: not drawn, {reason}")
    print(f"{', '.join(drawn) or 'nothing'} in {target}")


def _verify(options: argparse.Namespace) -> None:
    """Solve problems with exact answers and judge the solver.

    Raises:
        InputError: unknown problem, wrong settings, device or output directory.
        VerificationError: a bound is broken, or a run could not go on.
    """
    _choose_precision(options.precision)

    from warp_mpm.verification.command import print_problems, verify
    from warp_mpm.verification.problems import all_problems
    from warp_mpm.verification.session import Setup
    from warp_mpm.warp_startup import start_quietly

    start_quietly()
    problems = all_problems()
    if options.list:
        print_problems(problems)
        return
    verify(
        problems,
        options.problems,
        options.output if options.output is not None else Path("out") / "verify",
        full=options.full,
        coarsest=options.levels,
        setup=Setup(_solver_config(options), options.device, options.threads),
    )
