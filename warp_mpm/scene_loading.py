"""Finds scenes by name or path, runs their `scene` function with checked parameters, and lists them.

A scene file has a function `scene(*, ...) -> Scene` whose parameters are annotated and have defaults, and a docstring
whose first line says what it is. A name is looked up in `./scenes` first, then among the scenes shipped with warp_mpm.
"""

import ast
import importlib.util
import inspect
import sys
import traceback
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

import warp_mpm.scenes
from warp_mpm.checks import as_path, closest_match, mistake
from warp_mpm.errors import InputError
from warp_mpm.parameters import annotations_of, from_python, from_text

if TYPE_CHECKING:  # listing scenes does without Warp, which a scene imports through its materials
    from warp_mpm.scene import Scene

OWN_DIRECTORY = Path("scenes")  # in the current directory
SHIPPED_DIRECTORY = Path(next(iter(warp_mpm.scenes.__path__)))


@dataclass(frozen=True)
class SceneFile:
    """A scene file, not yet run."""

    path: Path

    @property
    def name(self) -> str:
        """What it is called on the command line."""
        return self.path.stem

    @property
    def summary(self) -> str:
        """First line of its docstring, read without running it; empty when there is none or the file is broken."""
        try:
            docstring = ast.get_docstring(ast.parse(self.path.read_bytes()))
        except (SyntaxError, ValueError, OSError):
            return ""
        return docstring.partition("\n")[0] if docstring else ""


def load_scene(scene: str | Path, **parameters: Any) -> "Scene":
    """The scene of a file or name, made with the given parameters.

    Args:
        scene: path of a scene file, or the name of one in `./scenes` or of a shipped one.
        parameters: for its `scene` function; the others keep their defaults.

    Raises:
        InputError: there is no such scene, a parameter is unknown or of the wrong type, or the scene cannot be made.
    """
    return _make_scene(find_scene(scene), lambda annotations, where: from_python(parameters, annotations, where))


def load_scene_from_text(scene: str | Path, assignments: Iterable[str]) -> "Scene":
    """As `load_scene`, with parameters as texts "name=value".

    Raises:
        InputError: there is no such scene, a parameter is unknown or ill-typed, or the scene cannot be made.
    """
    return _make_scene(find_scene(scene), lambda annotations, where: from_text(assignments, annotations, where))


def find_scene(scene: str | Path) -> SceneFile:
    """The file of a scene, given by path or by name.

    Raises:
        InputError: there is none; the message lists the known ones.
    """
    path = as_path("scene", scene)
    if path.is_file():
        return SceneFile(path)
    known = {file.name: file for file in list_scenes()}
    if str(scene) in known:
        return known[str(scene)]
    expected = f"a scene file, or one of {', '.join(known)}"
    raise mistake("scene", expected, repr(str(scene)), closest_match(path.stem, known))


def list_scenes(directory: str | Path | None = None) -> list[SceneFile]:
    """The scene files of a directory by name; without one those of `./scenes` and the shipped ones they do not hide.

    Raises:
        InputError: the directory does not exist.
    """
    if directory is None:
        directories = [SHIPPED_DIRECTORY, OWN_DIRECTORY]
    elif Path(directory).is_dir():
        directories = [Path(directory)]
    else:
        raise mistake("list", "a directory of scene files", repr(str(directory)))
    paths = {path.stem: path for folder in directories for path in folder.glob("*.py") if not path.stem.startswith("_")}
    return [SceneFile(paths[name]) for name in sorted(paths)]


def _make_scene(file: SceneFile, read_parameters: Callable[[Mapping[str, Any], str], dict[str, Any]]) -> "Scene":
    """Run the file's `scene` function with what `read_parameters(annotations, where)` returns."""
    from warp_mpm.scene import Scene

    where = f"scene {file.name}"
    module = _import_alone(file, where)
    function = getattr(module, "scene", None)
    if not callable(function):
        raise mistake(where, "a function 'scene' that returns a Scene", "none", f"define it in {file.path}")
    given = read_parameters(_guarded(lambda: annotations_of(function, where), file, where), where)
    defaults = {name: parameter.default for name, parameter in inspect.signature(function).parameters.items()}
    parameters = {**defaults, **given}
    for name, value in parameters.items():
        if value is inspect.Parameter.empty:
            raise mistake(f"{where}: {name}", "a value", "none", "give it one, or a default in the scene file")
    scene = _guarded(lambda: function(**parameters), file, where)
    if not isinstance(scene, Scene):
        raise mistake(where, "a Scene from scene()", repr(scene), "end it with return builder.build()")
    plain = {name: value.value if isinstance(value, Enum) else value for name, value in parameters.items()}
    return replace(scene, parameters=plain, description=scene.description or file.summary)


def _import_alone(file: SceneFile, where: str) -> ModuleType:
    """Import a scene file under a name of its own, so that files with equal names do not meet."""
    module_name = f"scene file {file.path.resolve()}"
    specification = importlib.util.spec_from_file_location(module_name, file.path)
    if specification is None or specification.loader is None:
        raise mistake(where, "a Python file, name.py", repr(str(file.path)))
    module = importlib.util.module_from_spec(specification)
    sys.modules[module_name] = module  # dataclasses of the file look themselves up here
    execute = specification.loader.exec_module
    _guarded(lambda: execute(module), file, where)
    return module


def _guarded(run: Callable[[], Any], file: SceneFile, where: str) -> Any:
    """What `run` returns; what the scene file raises becomes an `InputError` of one line that names the scene."""
    try:
        return run()
    except ValueError as error:  # a value that the builder, a material or the scene itself refuses
        text = " ".join(str(error).split())
        raise InputError(text if text.startswith(where) else f"{where}: {text}") from error
    except (Exception, SystemExit) as error:
        text = " ".join(str(error).split())
        line = _line_in(file, error)
        raise InputError(f"{where}: {file.path}:{line}: {type(error).__name__}: {text}") from error


def _line_in(file: SceneFile, error: BaseException) -> int | None:
    """The line of the scene file at which an error arose."""
    if isinstance(error, SyntaxError):
        return error.lineno
    frames = traceback.extract_tb(error.__traceback__)
    lines = [frame.lineno for frame in frames if Path(frame.filename).resolve() == file.path.resolve()]
    return lines[-1] if lines else None
