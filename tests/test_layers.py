"""The rules of the architecture (CONTRIBUTING.md): which room code goes into, and how long and how named it may be."""

import ast
import re
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
KERNELS = sorted((ROOT / "kernels").rglob("*.py"))
HOST = sorted(path for room in ("warp_mpm", "scenes", "tests", "tools") for path in (ROOT / room).rglob("*.py"))

DEVICE_DECORATORS = {"func", "func_native", "kernel"}
HOST_WORK = "launch.*|array|zeros.*|ones.*|empty.*|full.*|from_.*|clone|copy|synchronize.*|capture_.*|Stream"
EMPTY_WORDS = {"manager", "handler", "helper", "util"}
LONGEST_MODULE = 400  # lines
LONGEST_FUNCTION = 50  # lines of a function of the host; a kernel is one function, and longer


def where(path):
    return path.relative_to(ROOT).as_posix()


def offences(paths, rule):
    """What breaks a rule, by file; `rule` takes a path and its syntax tree."""
    found = {where(path): list(rule(path, ast.parse(path.read_bytes()))) for path in paths}
    return {file: broken for file, broken in found.items() if broken}


def imported_modules(tree):
    """Names of all modules that are imported anywhere in a syntax tree; a relative import begins with a dot."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield "." * node.level + (node.module or "")


def foreign_to_kernels(tree):
    """Imports that a module of kernels/ may not have: anything but Warp, the standard library and kernels/ itself."""

    def allowed(name):
        first = name.partition(".")[0]
        return first == "warp" or first in sys.stdlib_module_names or f"{name}.".startswith("warp_mpm.kernels.")

    return [name for name in imported_modules(tree) if not allowed(name) or name == "__future__"]


def host_work(node):
    """Lines with calls such as `wp.launch(...)` or `wp.zeros(...)` outside of device functions and annotations."""
    if isinstance(node, ast.FunctionDef):
        decorators = [getattr(item, "func", item) for item in node.decorator_list]
        if any(isinstance(item, ast.Attribute) and item.attr in DEVICE_DECORATORS for item in decorators):
            return
        children = node.body
    elif isinstance(node, ast.AnnAssign):
        children = [] if node.value is None else [node.value]
    else:
        children = ast.iter_child_nodes(node)
    if isinstance(node, ast.Call) and re.fullmatch(rf"(wp|warp)\.({HOST_WORK})", ast.unparse(node.func)):
        yield node.lineno
    for child in children:
        yield from host_work(child)


def long_functions(_, tree):
    """Names and lengths of functions that are too long."""
    functions = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
    lengths = [(node.name, node.end_lineno - node.lineno + 1) for node in functions]
    return [(name, lines) for name, lines in lengths if lines > LONGEST_FUNCTION]


def bad_names(path, tree):
    """The module's own name and those of its classes and functions, as far as they say nothing."""
    kinds = (ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    names = [path.stem, *(node.name for node in ast.walk(tree) if isinstance(node, kinds))]
    return [name for name in names if says_nothing(name)]


def says_nothing(name):
    words = re.findall(r"[A-Z]?[a-z]+|[A-Z]+", name)
    return any(word.lower().rstrip("s") in EMPTY_WORDS for word in words)


def test_there_is_something_to_check():
    assert len(KERNELS) > 10
    assert {"warp_mpm/cli.py", "warp_mpm/output/usd.py", "scenes/two_point.py"} <= set(map(where, HOST))


def test_kernels_import_no_host_module():
    assert offences(KERNELS, lambda _, tree: foreign_to_kernels(tree)) == {}


def test_kernels_neither_allocate_nor_launch():
    assert offences(KERNELS, lambda _, tree: host_work(tree)) == {}


@pytest.mark.parametrize(
    ("line", "found"),
    [
        ("import numpy as np", ["numpy"]),
        ("from warp_mpm import scene", ["warp_mpm"]),
        ("from warp_mpm.kernels_extra import x", ["warp_mpm.kernels_extra"]),
        ("from . import shape", ["."]),
        ("from __future__ import annotations", ["__future__"]),
        ("import math, warp.types", []),
        ("from warp_mpm.kernels import shape", []),
        ("def f():\n    from warp_mpm.kernels.eos.ideal_gas import IdealGas, numpy", []),
    ],
)
def test_the_import_rule_can_fail(line, found):
    assert foreign_to_kernels(ast.parse(line)) == found


@pytest.mark.parametrize(
    ("lines", "count"),
    [
        ("wp.launch(kernel, 3)", 1),
        ("def f():\n    return [wp.zeros(3), wp.array([1.0], dtype=float)]", 2),
        ("class A:\n    x: wp.array(dtype=float)\n    y: object = wp.empty_like(x)", 1),
        ("def f(x: wp.array(dtype=float)) -> wp.array(dtype=int):\n    return x", 0),
        ("@wp.func\ndef f():\n    return wp.zeros(shape=3, dtype=int)", 0),
        ("@wp.kernel(enable_backward=False)\ndef f():\n    x = wp.zeros(shape=3, dtype=int)", 0),
        ("vector = wp.types.vector(3, float)", 0),
    ],
)
def test_the_launch_rule_can_fail(lines, count):
    assert len(list(host_work(ast.parse(lines)))) == count


def test_names_say_something():
    assert offences(KERNELS + HOST, bad_names) == {}


def test_modules_are_short():
    lengths = {where(path): len(path.read_bytes().splitlines()) for path in KERNELS + HOST}
    assert {file: lines for file, lines in lengths.items() if lines > LONGEST_MODULE} == {}


def test_functions_of_the_host_are_short():
    assert offences(HOST, long_functions) == {}


@pytest.mark.parametrize("name", ["utils", "kernel_utils", "StateManager", "handler", "string_helpers", "MathUtil"])
def test_the_name_rule_can_fail(name):
    assert says_nothing(name)


@pytest.mark.parametrize("name", ["utilisation", "volume", "Launcher", "handled", "contextmanager"])
def test_the_name_rule_lets_honest_names_pass(name):
    assert not says_nothing(name)
