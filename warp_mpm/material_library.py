"""The library of materials: fits that detonate as they claim, each with its source.

An explosive is here only if the Chapman-Jouguet state of its equation of state has the stated speed and pressure
within 1 %. Widely copied rows that fail are not: HMX 1891 kg/m3 with A 778.3 GPa (implies 8995 m/s for 9110), rows of
nitromethane that imply 7359 m/s, TNT with A 371.2 GPa, w 0.35 and E0 6 GJ/m3, which mixes two fits (p_CJ 2 % low).
"""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, NamedTuple

from warp_mpm.checks import closest_match, instance, mistake, plain_name
from warp_mpm.kernels.eos.ideal_gas import IdealGas
from warp_mpm.kernels.eos.jwl import JWL
from warp_mpm.kernels.eos.stiffened_gas import StiffenedGas
from warp_mpm.materials import Material, ammonium_nitrate, explosive, inert

GIGAPASCAL = 1e9  # [Pa]

HANDBOOK = "B. M. Dobratz, P. C. Crawford, LLNL Explosives Handbook, UCRL-52997 change 2, 1985"


class _Fit(NamedTuple):
    """A JWL fit in the units that it is published in; stated speed and pressure with it."""

    density: float  # rho0 [kg/m3]
    speed: float  # D [m/s]
    pressure: float  # p_CJ [GPa]
    a: float  # [GPa]
    b: float  # [GPa]
    r1: float
    r2: float
    omega: float
    energy: float  # E0, per unit initial volume [GJ/m3]
    citation: str


FITS = {
    "tnt": _Fit(1630, 6930, 21.0, 371.21, 3.231, 4.15, 0.95, 0.30, 7.0, HANDBOOK),
    "tnt_alternative": _Fit(
        1630, 6930, 21.0, 373.8, 3.747, 4.15, 0.90, 0.35, 6.0, "E. L. Lee, M. Finger, W. Collins, UCID-16189, LLNL 1973"
    ),
    "composition_b": _Fit(1717, 7980, 29.5, 524.2, 7.678, 4.2, 1.1, 0.34, 8.5, HANDBOOK),
    "c4": _Fit(1601, 8193, 28.0, 609.77, 12.95, 4.5, 1.4, 0.25, 9.0, HANDBOOK),
    "petn": _Fit(
        1770,
        8300,
        33.5,
        617.0,
        16.926,
        4.4,
        1.2,
        0.25,
        10.1,
        f"{HANDBOOK}, as in L. E. Schwer, S. Rigby, 11th European LS-DYNA Conference 2017",
    ),
    "pbx_9404": _Fit(1840, 8800, 37.0, 854.5, 20.493, 4.6, 1.35, 0.25, 10.2, HANDBOOK),
    "nitromethane": _Fit(1128, 6280, 12.5, 209.25, 5.689, 4.4, 1.2, 0.30, 5.1, HANDBOOK),
    "anfo_931": _Fit(
        931,
        4160,
        5.15,
        49.46,
        1.891,
        3.907,
        1.118,
        0.333,
        2.484,
        "L. L. Davis, L. G. Hill, Shock Compression of Condensed Matter 2001, AIP Conf. Proc. 620, 165",
    ),
    "anfo_820": _Fit(
        820,
        4550,
        5.5,
        42.0,
        0.044,
        3.55,
        0.16,
        0.41,
        3.15,
        "L. E. Schwer, Schwer Engineering & Consulting Services, 2011",
    ),
}


def _explosive(name: str, fit: _Fit, **choices: Any) -> Material:
    """The explosive of a fit."""
    eos = JWL(fit.density, fit.a * GIGAPASCAL, fit.b * GIGAPASCAL, fit.r1, fit.r2, fit.omega)
    return explosive(
        name,
        density=fit.density,
        detonation_speed=fit.speed,
        equation_of_state=eos,
        energy=fit.energy * GIGAPASCAL / fit.density,
        cj_pressure=fit.pressure * GIGAPASCAL,
        citation=fit.citation,
        **choices,
    )


def air() -> Material:
    """Air at 15 degrees Celsius and standard pressure: an ideal gas with gamma = 1.4."""
    return inert(
        "air", density=1.225, equation_of_state=IdealGas(1.4), citation="U.S. Standard Atmosphere 1976, sea level"
    )


def water() -> Material:
    """Water as a stiffened gas, gamma = 4.4, p_inf = 0.6 GPa; its sound is 10 % too fast (1625 m/s)."""
    return inert(
        "water",
        density=1000.0,
        equation_of_state=StiffenedGas(4.4, 6e8),
        citation="R. Saurel, R. Abgrall, J. Comput. Phys. 150 (1999) 425",
    )


_EXPLOSIVES: Mapping[str, Callable[..., Material]] = {
    **{name: partial(_explosive, name, fit) for name, fit in FITS.items()},
    "ammonium_nitrate": ammonium_nitrate,
}
_INERT: Mapping[str, Callable[[], Material]] = {"air": air, "water": water}

NAMES = (*_EXPLOSIVES, *_INERT)
OTHER_NAMES = {"comp_b": "composition_b", "comp_c4": "c4", "composition_c4": "c4"}  # in common use
_BY_PLAIN_NAME = {plain_name(name): meant for name, meant in [*zip(NAMES, NAMES, strict=True), *OTHER_NAMES.items()]}


CHOICES = ("on_mismatch", "burn", "unreacted")  # of an explosive of the library


def find_material(name: str, **choices: Any) -> Material:
    """A material of the library.

    Args:
        name: one of those that `warp-mpm materials` shows, whatever its capitals and the signs between its words.
        choices: of an explosive, as `explosive` takes them: on_mismatch, burn, unreacted.

    Raises:
        InputError: there is no such material, or no such choice.
    """
    expected = f"one of {', '.join(NAMES)}"
    known = _BY_PLAIN_NAME.get(plain_name(instance("material", name, str, expected)), "")
    if not known:
        raise mistake("material", expected, repr(name), closest_match(name, NAMES))
    allowed = CHOICES if known in _EXPLOSIVES else ()
    for other in sorted(choices.keys() - allowed):
        remedy = "a material of your own is made by explosive(...) or inert(...)"
        raise mistake(known, f"no choice but {', '.join(allowed)}" if allowed else "no choices", other, remedy)
    return {**_EXPLOSIVES, **_INERT}[known](**choices)


def library() -> dict[str, Material]:
    """All materials by name."""
    return {name: find_material(name) for name in NAMES}
