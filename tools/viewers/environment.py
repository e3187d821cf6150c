"""The viewers' own environment, and how their scripts are run in it.

Blender is a wheel for one version of Python and brings a USD of its own with it, of another version than the package
needs, and with Storm, which the package's USD lacks. So it lives in `.venv-viewers`, and scripts of the folder
`clients` run there as processes of their own, which nothing that happens in a renderer can take down with us.
"""

import json
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

WHEEL = "bpy==4.5.15"  # Blender as a module, and in it a USD with Storm
PYTHON = (3, 11)  # the only version this wheel is made for
DOWNLOAD_LIMIT = 180  # [s] for each step of the installation
CLIENT_LIMIT = 300  # [s]
MISSING = 3  # exit code of a client that lacks something

ROOT = Path(__file__).resolve().parents[2]
ENVIRONMENT = ROOT / ".venv-viewers"
INTERPRETER = ENVIRONMENT / ("Scripts/python.exe" if sys.platform == "win32" else "bin/python")
CLIENTS = Path(__file__).resolve().parent / "clients"


class MissingError(Exception):
    """The environment, or something a client needs from this machine, is not there; the message says what."""


def install() -> str:
    """Make the environment unless it is there; says what it did.

    Raises:
        MissingError: there is no Python of the right version, or the wheel cannot be had.
    """
    if _works():
        return f"{WHEEL} is in {ENVIRONMENT.name} already"
    wanted = ".".join(map(str, PYTHON))
    python = sys.executable if sys.version_info[:2] == PYTHON else shutil.which(f"python{wanted}")
    if python is None:
        raise MissingError(f"{WHEEL} needs Python {wanted}, and there is no python{wanted} on the path")
    try:
        _quietly(python, "-m", "venv", "--clear", str(ENVIRONMENT))
        options = ("--quiet", "--disable-pip-version-check", "--only-binary", ":all:")
        _quietly(str(INTERPRETER), "-m", "pip", "install", *options, WHEEL)
        _quietly(str(INTERPRETER), "-c", "import bpy")
    except subprocess.SubprocessError as error:
        shutil.rmtree(ENVIRONMENT, ignore_errors=True)
        raise MissingError(f"{WHEEL} does not install: {_reason(error)}") from error
    return f"{WHEEL} installed into {ENVIRONMENT.name}"


def run_client(name: str, *arguments: object) -> dict[str, Any]:
    """Run the script `name` of `clients` in the environment; gives back the JSON object it printed last.

    Raises:
        MissingError: no environment, or the client lacks something of this machine, such as OpenGL.
        RuntimeError: the client failed.
    """
    command = [str(interpreter()), str(CLIENTS / f"{name}.py"), *map(str, arguments)]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=CLIENT_LIMIT, check=False)
    if ended.returncode == MISSING:
        raise MissingError(f"{name}: {ended.stderr.strip().splitlines()[-1]}")
    if ended.returncode != 0:
        raise RuntimeError(f"{name}: exit code {ended.returncode}\n{ended.stdout[-2000:]}\n{ended.stderr[-4000:]}")
    return json.loads(ended.stdout.strip().splitlines()[-1])


def interpreter() -> Path:
    """The environment's Python.

    Raises:
        MissingError: there is none.
    """
    if not INTERPRETER.exists():
        raise MissingError(f"no {ENVIRONMENT.name} with Blender; make it by: python tools/view.py install")
    return INTERPRETER


def _works() -> bool:
    """Whether the environment has the wheel, and it can be imported."""
    if not INTERPRETER.exists():
        return False
    code = f"import bpy; assert bpy.app.version == {tuple(map(int, WHEEL.partition('==')[2].split('.')))}"
    return subprocess.run([str(INTERPRETER), "-c", code], capture_output=True, check=False).returncode == 0


def _quietly(*command: str) -> None:
    subprocess.run(command, capture_output=True, text=True, timeout=DOWNLOAD_LIMIT, check=True)


def _reason(error: subprocess.SubprocessError) -> str:
    """Why a command failed, in one line."""
    if isinstance(error, subprocess.CalledProcessError):
        lines = (error.stderr or error.stdout).strip().splitlines()
        return lines[-1] if lines else f"exit code {error.returncode}"
    return f"not done after {DOWNLOAD_LIMIT} s"
