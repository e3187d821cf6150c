"""The package as others get it: built, installed in an empty environment, and run by name from an empty directory."""

import ast
import json
import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import venv
import zipfile
from email import message_from_bytes
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
LINKS = {"warp_mpm/kernels": "../kernels", "warp_mpm/scenes": "../scenes"}
# Where it is not called as its module.
DISTRIBUTION_OF = {"warp": "warp-lang", "pxr": "usd-core", "PIL": "pillow", "vtkmodules": "vtk"}


def run(*command, cwd):
    """Run a command that must succeed, without what this process adds to the path of imports."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    result = subprocess.run(
        [str(word) for word in command],
        cwd=cwd,
        env=environment,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert result.returncode == 0, result.stdout + result.stderr
    return result.stdout


def copy_of_the_source(destination, *, links):
    """What a clone holds that goes into the package; without `links`, as a file system leaves it that has none."""
    generated = shutil.ignore_patterns("__pycache__", "*.egg-info")
    for name in ("kernels", "scenes", "warp_mpm"):
        shutil.copytree(ROOT / name, destination / name, symlinks=True, ignore=generated)
    for name in ("LICENSE", "README.md", "pyproject.toml"):
        shutil.copy(ROOT / name, destination)
    for link, target in () if links else LINKS.items():
        (destination / link).unlink()
        (destination / link).write_text(target)
    return destination


def build(source, *options):
    """Build in a tree with this environment's setuptools; returns what was built."""
    run(sys.executable, "-m", "build", "--no-isolation", *options, source, cwd=source)
    return sorted((source / "dist").iterdir())


def source_files():
    """Every module of the clone, under the name that it has in the package."""
    own = {path.relative_to(ROOT).as_posix() for path in (ROOT / "warp_mpm").rglob("*.py")}
    rooms = {
        path.relative_to(ROOT).as_posix() for room in ("kernels", "scenes") for path in (ROOT / room).rglob("*.py")
    }
    return {name for name in own if not name.startswith(tuple(LINKS))} | {f"warp_mpm/{name}" for name in rooms}


def modules_in(wheel):
    with zipfile.ZipFile(wheel) as archive:
        return {name for name in archive.namelist() if ".dist-info/" not in name}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """The wheel that is built from the source distribution that is built from a clone."""
    source = copy_of_the_source(tmp_path_factory.mktemp("clone"), links=True)
    built = {path.suffix: path for path in build(source)}
    with tarfile.open(built[".gz"]) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    assert {"LICENSE", "README.md", "kernels/eos/ideal_gas.py", "scenes/two_point.py", "warp_mpm/cli.py"} <= names
    assert not any(name.startswith(tuple(LINKS)) for name in names)
    return built[".whl"]


def test_the_wheel_holds_every_module_in_one_package(wheel):
    assert modules_in(wheel) == source_files()
    assert {"warp_mpm/kernels/eos/ideal_gas.py", "warp_mpm/scenes/two_point.py"} <= source_files()


def test_the_wheel_is_the_same_from_a_clone_without_links(wheel, tmp_path):
    (other,) = build(copy_of_the_source(tmp_path, links=False), "--wheel")
    assert modules_in(other) == modules_in(wheel)


def test_the_wheel_says_what_it_needs(wheel):
    with zipfile.ZipFile(wheel) as archive:
        (name,) = (name for name in archive.namelist() if name.endswith(".dist-info/METADATA"))
        metadata = message_from_bytes(archive.read(name))
        sources = [archive.read(name) for name in modules_in(wheel)]
    assert (metadata["License-Expression"], metadata["Requires-Python"]) == ("Apache-2.0", ">=3.10")
    assert "# warp_mpm" in metadata.get_payload()
    needed = {re.match(r"[\w-]+", text)[0] for text in metadata.get_all("Requires-Dist")}
    assert {DISTRIBUTION_OF.get(module, module) for module in foreign_modules(sources)} <= needed


def foreign_modules(sources):
    """Top-level names imported from neither the standard library nor the package itself."""
    found = set()
    for node in (node for source in sources for node in ast.walk(ast.parse(source))):
        if isinstance(node, ast.Import):
            found |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            found.add(node.module.partition(".")[0])
    return found - sys.stdlib_module_names - {"warp_mpm"}


@pytest.fixture(scope="module")
def installed(wheel, tmp_path_factory):
    """Scripts of an environment that holds the wheel, and sees the dependencies that are installed here."""
    home = tmp_path_factory.mktemp("environment")
    venv.create(home, with_pip=False)
    scripts = home / ("Scripts" if os.name == "nt" else "bin")
    python = scripts / "python"
    run(sys.executable, "-m", "pip", "--python", python, "install", "--no-deps", "--no-index", wheel, cwd=home)
    packages = Path(run(python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))", cwd=home).strip())
    # A path in a .pth file comes after the environment's own packages, and its own .pth files are not read: the clone
    # that may be installed here for development stays invisible.
    (packages / "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n")
    where = run(python, "-c", "import warp_mpm.kernels; print(warp_mpm.kernels.__file__)", cwd=home)
    assert Path(where.strip()).is_relative_to(packages)
    return scripts


def test_a_scene_runs_by_name_from_an_empty_directory(installed, tmp_path):
    assert "two_point" in run(installed / "warp-mpm", "list", cwd=tmp_path)
    coarse = ["--set", "cell_size=2e-2", "end_time=2e-6", "--frames", "2", "--device", "cpu"]
    run(installed / "warp-mpm", "run", "two_point", *coarse, cwd=tmp_path)
    results = tmp_path / "out" / "two_point"
    assert json.loads((results / "summary.json").read_text())["scene"] == "two_point"
    assert (results / "two_point.usdc").stat().st_size > 0
    assert list(results.glob("figures/*.png"))
