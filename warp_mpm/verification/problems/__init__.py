"""The problems of `warp-mpm verify`, one file each; a file with a line `PROBLEMS = (MyProblem(),)` is all it takes.

Files whose names start with an underscore hold what several problems share.
"""

from importlib import import_module
from pkgutil import iter_modules

from warp_mpm.verification.problem import Problem


def all_problems() -> tuple[Problem, ...]:
    """Every problem, in the order of the files' names."""
    files = sorted(module.name for module in iter_modules(__path__) if not module.name.startswith("_"))
    return tuple(problem for file in files for problem in import_module(f"{__name__}.{file}").PROBLEMS)
