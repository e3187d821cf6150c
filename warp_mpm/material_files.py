"""Materials from a TOML file: one table each.

    [my_tnt]
    density = 1630                # kg/m3
    detonation_speed = 6930       # m/s; a table without it is inert matter
    cj_pressure = 21e9            # Pa, compared if given
    energy_per_volume = 7e9       # J/m3 before the burn, or energy in J/kg; without both that of the CJ condition
    citation = "..."
    equation_of_state = { law = "jwl", a = 371.21e9, b = 3.231e9, r1 = 4.15, r2 = 0.95, omega = 0.3 }
    unreacted = { law = "mie_gruneisen", sound_speed = 2390, slope = 2.05, gruneisen = 0.9 }   # if it has one
    burn = "both"                 # programmed (default), compression or both

    [brine]
    density = 1030
    pressure = 101325             # Pa, the default
    equation_of_state = { law = "stiffened_gas", gamma = 4.4, stiffness = 6e8 }

A law is the name of a file in `kernels/eos/`, its parameters are those of the class in it; a density that it needs is
that of the material unless it is given.
"""

import sys
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from typing import Any, Literal

import warp_mpm.kernels.eos
from warp_mpm.checks import as_path, closest_match, mistake, positive
from warp_mpm.errors import InputError
from warp_mpm.kernels.eos import EquationOfState
from warp_mpm.materials import ATMOSPHERE, Burn, Material, OnMismatch, explosive, inert
from warp_mpm.parameters import annotations_of, from_python

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

LAWS = "equation_of_state", "unreacted"  # keys of the tables in a material's table


@dataclass(frozen=True)
class _Explosive:
    """Plain keys of an explosive's table."""

    density: float
    detonation_speed: float
    cj_pressure: float | None = None
    energy: float | Literal["cj"] = "cj"
    energy_per_volume: float | None = None
    on_mismatch: OnMismatch = OnMismatch.ADJUST
    burn: Burn = Burn.PROGRAMMED
    citation: str = ""


@dataclass(frozen=True)
class _Inert:
    """Plain keys of the table of inert matter."""

    density: float
    pressure: float = ATMOSPHERE
    citation: str = ""


def load_materials(path: str | Path) -> dict[str, Material]:
    """The materials of a TOML file, by the names of their tables.

    Raises:
        InputError: there is no such file, it is not TOML, or a table is not a material; one line that names file, table
            and key.
    """
    file = as_path("materials", path)
    try:
        tables = tomllib.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise mistake("materials", "a TOML file", repr(str(path)), str(error.strerror)) from error
    except (ValueError, RecursionError) as error:  # no TOML, or no text
        raise mistake(str(path), "TOML", " ".join(str(error).split())) from error
    return {name: _material(str(path), name, table) for name, table in tables.items()}


def _material(file: str, name: str, table: Any) -> Material:
    """The material of a table."""
    where = f"{file}: {name}"
    if not isinstance(table, Mapping):
        raise mistake(where, "a table of a material", repr(table))
    plain = {key: value for key, value in table.items() if key not in LAWS}
    kind = _Explosive if "detonation_speed" in table else _Inert
    known = {**annotations_of(kind, where), **({key: Any for key in LAWS} if kind is _Explosive else {LAWS[0]: Any})}
    for key in table:
        if key not in known:
            raise mistake(where, f"one of {', '.join(known)}", repr(key), closest_match(key, known))
    values = _filled(kind, plain, where)
    density = positive(f"{where}: density", values.density)
    laws = {key: _law(f"{where}: {key}", table[key], density) for key in LAWS if key in table}
    if LAWS[0] not in laws:
        raise mistake(f"{where}: {LAWS[0]}", "a table with a law and its parameters", "none")
    try:
        return _made(name, values, laws)
    except InputError as error:
        raise InputError(f"{file}: {error}") from error


def _made(name: str, values: Any, laws: Mapping[str, EquationOfState]) -> Material:
    """The material of a table's values and laws."""
    if isinstance(values, _Inert):
        law = laws[LAWS[0]]
        return inert(
            name, density=values.density, equation_of_state=law, pressure=values.pressure, citation=values.citation
        )
    energy = values.energy
    if values.energy_per_volume is not None:
        if energy != "cj":
            raise mistake(f"{name}: energy_per_volume", "no energy beside it", f"energy = {energy:g}", "leave one out")
        energy = values.energy_per_volume / values.density
    return explosive(
        name,
        density=values.density,
        detonation_speed=values.detonation_speed,
        cj_pressure=values.cj_pressure,
        energy=energy,
        on_mismatch=values.on_mismatch,
        burn=values.burn,
        citation=values.citation,
        **laws,
    )


def _law(where: str, table: Any, density: float) -> EquationOfState:
    """The equation of state of a table; `density` [kg/m3] is that of the material."""
    if not isinstance(table, Mapping):
        raise mistake(where, "a table with a law and its parameters", repr(table))
    names = [module.name for module in iter_modules(warp_mpm.kernels.eos.__path__)]
    name = table.get("law")
    if name not in names:
        got = "none" if name is None else repr(name)
        raise mistake(f"{where}: law", f"one of {', '.join(names)}", got, closest_match(str(name), names))
    module = import_module(f"{warp_mpm.kernels.eos.__name__}.{name}")
    laws = [member for member in vars(module).values() if hasattr(member, "sound_speed_squared")]
    law: Any = laws[0]
    given = {key: value for key, value in table.items() if key != "law"}
    if any(parameter.name == "density" for parameter in fields(law)):
        given = {"density": density, **given}
    try:
        return _filled(law, given, where)
    except InputError:
        raise
    except ValueError as error:
        raise InputError(f"{where}: {error}") from error


def _filled(kind: Any, given: Mapping[str, Any], where: str) -> Any:
    """A dataclass from given values, checked against its annotations; what has no default must be there."""
    values = from_python(given, annotations_of(kind, where), where)
    for parameter in fields(kind):
        if parameter.default is MISSING and parameter.name not in values:
            raise mistake(f"{where}: {parameter.name}", "a value", "none")
    return kind(**values)
