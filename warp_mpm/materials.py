"""Materials: equation of state, density, energy, and for explosives a burn law that is checked when it is made."""

from dataclasses import dataclass
from enum import Enum
from typing import Any, Literal

from warp_mpm import checks
from warp_mpm.errors import InputError
from warp_mpm.exact.chapman_jouguet import (
    ChapmanJouguetState,
    chapman_jouguet_state,
    energy_at_pressure,
    energy_for_speed,
)
from warp_mpm.kernels.burn import BurnLaw
from warp_mpm.kernels.burn.compression import CompressionBurn
from warp_mpm.kernels.burn.programmed import ProgrammedBurn
from warp_mpm.kernels.burn.programmed_compression import ProgrammedCompressionBurn
from warp_mpm.kernels.eos import EquationOfState, evaluate
from warp_mpm.kernels.eos.ideal_gas import IdealGas
from warp_mpm.kernels.numbers import is_number
from warp_mpm.warp_startup import start_quietly

ROUND_OFF = 1e-5  # relative difference of two speeds that are the same: single precision, and the digits people write
ATMOSPHERE = 101325.0  # standard pressure [Pa]
NOTABLE = 1e-3  # relative difference of a speed that is worth a warning
TOLERANCE = 0.01  # and the largest that is adjusted; more is an error
FAINT = 1e-6  # of the square of a speed: an energy [J/kg] that adds nothing to it
SLOWEST = 200.0  # detonation of anything [m/s]
DENSEST_GAS = 50.0  # that detonates [kg/m3]
FASTEST_IN_GAS = 4500.0  # detonation [m/s]; hydrogen and oxygen come to some 3000


class OnMismatch(Enum):
    """What to do with an explosive whose stated detonation speed is not the one its equation of state implies.

    ADJUST: up to 1 % the wave runs at the implied speed, more is an error. KEEP: run as stated, with a warning.
    """

    ADJUST = "adjust"
    KEEP = "keep"


class Burn(Enum):
    """When an explosive burns.

    PROGRAMMED: when the wave from a detonator arrives, F1 of Wilkins. COMPRESSION: as far as it is compressed, F2 =
    (1 - V) / (1 - V_CJ), so that anything that strikes it hard lights it. BOTH: the larger of the two.
    """

    PROGRAMMED = "programmed"
    COMPRESSION = "compression"
    BOTH = "both"


@dataclass(frozen=True)
class Material:
    """A material. Inert ones are made directly, explosives by `explosive`, which checks them.

    Its initial pressure is that of its equation of state; for an ideal gas (gamma - 1) rho0 e.

    Attributes:
        name: for messages and tables.
        density: initial, rho0 [kg/m3].
        equation_of_state: of inert matter, and of an explosive's products.
        specific_energy: initial, chemical energy included [J/kg].
        burn: the burn law; None: inert, it is products from the start.
        cj: the Chapman-Jouguet state that the equation of state implies.
        warnings: what the check of the explosive has to say.
        unreacted: equation of state of what has not burnt, with energies from E0; None: that has no pressure.
        stated_speed: detonation speed stated for it [m/s].
        stated_pressure: Chapman-Jouguet pressure stated for it [Pa].
        citation: where the numbers are from.

    Raises:
        InputError: density or energy is not a positive finite number.
    """

    name: str
    density: float
    equation_of_state: EquationOfState
    specific_energy: float
    burn: BurnLaw | None = None
    cj: ChapmanJouguetState | None = None
    warnings: tuple[str, ...] = ()
    unreacted: EquationOfState | None = None
    stated_speed: float | None = None
    stated_pressure: float | None = None
    citation: str = ""

    def __post_init__(self) -> None:
        """Check the values."""
        _check_kind(self.name, self.equation_of_state)
        if self.unreacted is not None:
            _check_kind(self.name, self.unreacted, "unreacted")
        _check_positive(self.name, "density", self.density, "kg/m3")
        _check_positive(self.name, "specific_energy", self.specific_energy, "J/kg")


def explosive(
    name: str,
    *,
    density: float,
    detonation_speed: float,
    equation_of_state: EquationOfState,
    energy: float | Literal["cj"] = "cj",
    cj_pressure: float | None = None,
    on_mismatch: OnMismatch = OnMismatch.ADJUST,
    burn: Burn = Burn.PROGRAMMED,
    unreacted: EquationOfState | None = None,
    citation: str = "",
) -> Material:
    """An explosive, checked: does its equation of state detonate at the stated speed?

    `density` [kg/m3] and `detonation_speed` [m/s] are those stated for it; `energy` [J/kg], or "cj" for the one that
    the Chapman-Jouguet condition gives; `cj_pressure` [Pa] is compared if stated. A wave that runs faster than the
    energy allows has a low front, and one that runs 0.5 % slower grows without bound, so they must match.
    `burn` says when it burns. `unreacted` is the equation of state of what has not burnt, such as `MieGruneisen`, with
    energies from E0; without it that has no pressure, and nothing may reach it first (`resistance.py`).

    Raises:
        InputError: a value is not positive and finite, or speed or pressure do not match the equation of state.
    """
    _check_kind(name, equation_of_state)
    checks.member(f"{name}: on_mismatch", on_mismatch, OnMismatch)
    checks.member(f"{name}: burn", burn, Burn)
    _check_positive(name, "density", density, "kg/m3")
    _check_positive(name, "detonation_speed", detonation_speed, "m/s")
    start_quietly()  # the check evaluates device functions, which starts Warp
    _check_heat(name, equation_of_state, density)
    specific_energy = _specific_energy(name, energy, equation_of_state, density, detonation_speed)
    state = _detonation(name, equation_of_state, density, specific_energy)
    speed, warnings = _matched_speed(name, density, detonation_speed, equation_of_state, state, on_mismatch)
    if cj_pressure is not None:
        _check_positive(name, "cj_pressure", cj_pressure, "Pa")
        warnings += _matched_pressure(name, cj_pressure, state, on_mismatch)
    return Material(
        name,
        density,
        equation_of_state,
        specific_energy,
        burn=_burn_law(burn, speed, density, state),
        cj=state,
        warnings=(*warnings, *_odd_units(name, density, detonation_speed)),
        unreacted=unreacted,
        stated_speed=detonation_speed,
        stated_pressure=cj_pressure,
        citation=citation,
    )


def inert(
    name: str, *, density: float, equation_of_state: EquationOfState, pressure: float = ATMOSPHERE, citation: str = ""
) -> Material:
    """Matter that does not burn, at rest at a density [kg/m3] and a pressure [Pa].

    Its energy follows from them, e = (p - a) / b.

    Raises:
        InputError: density or pressure is not positive and finite, or the energy that gives this pressure is not.
    """
    _check_kind(name, equation_of_state)
    _check_positive(name, "density", density, "kg/m3")
    _check_positive(name, "pressure", pressure, "Pa")
    start_quietly()
    _check_heat(name, equation_of_state, density)
    return Material(
        name, density, equation_of_state, energy_at_pressure(equation_of_state, density, pressure), citation=citation
    )


def ammonium_nitrate(*, energy: float | Literal["cj"] = "cj", on_mismatch: OnMismatch = OnMismatch.ADJUST) -> Material:
    """The explosive of Wang et al. 2015: ANFO, rho0 1000 kg/m3, D 2800 m/s, gamma law with gamma = 2.

    The paper states "about 3.8e6 J/kg", with which this gas would detonate at 4775 m/s; the Chapman-Jouguet condition
    gives E0 = D^2 / (2 (gamma^2 - 1)) = 1.307e6 J/kg and p_CJ = 2.613 GPa, which the paper compares with.

    Raises:
        InputError: the energy does not match the speed, and `on_mismatch` is ADJUST.
    """
    return explosive(
        "ammonium nitrate",
        density=1000.0,
        detonation_speed=2800.0,
        equation_of_state=IdealGas(gamma=2.0),
        energy=energy,
        on_mismatch=on_mismatch,
        citation="Wang, Li, Wang, Yan, Sun, Applied Mathematics and Mechanics 36(2), 2015; energy by the CJ condition",
    )


def _specific_energy(name: str, energy: float | str, eos: EquationOfState, density: float, speed: float) -> float:
    """The energy [J/kg] given, or for "cj" that with which the wave runs at `speed` [m/s]."""
    if isinstance(energy, str) and energy == "cj":
        consistent = _consistent_energy(eos, density, speed)
        if consistent is None:
            slowest = _detonation(name, eos, density, FAINT * speed**2).detonation_speed
            expected = f"a speed that some energy gives its equation of state ({slowest:.0f} m/s with hardly any)"
            remedy = "take another equation of state, such as IdealGas"
            raise checks.mistake(f"{name}: detonation_speed", expected, f"{speed:g}", remedy)
        return consistent
    _check_positive(name, "energy", energy, "J/kg")
    return float(energy)


def _consistent_energy(eos: EquationOfState, density: float, speed: float) -> float | None:
    """The energy [J/kg] with which the wave runs at `speed` [m/s], if there is one."""
    try:
        return energy_for_speed(eos, density, speed)
    except ValueError:
        return None


def _detonation(name: str, eos: EquationOfState, density: float, energy: float) -> ChapmanJouguetState:
    """The Chapman-Jouguet state, which an explosive must have."""
    try:
        return chapman_jouguet_state(eos, density, energy)
    except ValueError as error:
        raise InputError(f"{name}: equation_of_state: {error}") from error


def _burn_law(burn: Burn, speed: float, density: float, state: ChapmanJouguetState) -> BurnLaw:
    """The burn law of an explosive of initial `density` [kg/m3] whose wave runs at `speed` [m/s]."""
    if burn is Burn.PROGRAMMED:
        return ProgrammedBurn(speed)
    both = burn is Burn.BOTH
    return (ProgrammedCompressionBurn if both else CompressionBurn)(speed, density, state.density)


def _matched_speed(
    name: str,
    density: float,
    stated: float,
    equation_of_state: EquationOfState,
    state: ChapmanJouguetState,
    on_mismatch: OnMismatch,
) -> tuple[float, tuple[str, ...]]:
    """The speed at which the wave runs [m/s], and what there is to say about it."""
    implied = state.detonation_speed
    mismatch = abs(stated / implied - 1.0)
    if mismatch <= ROUND_OFF:
        return stated, ()
    if on_mismatch is OnMismatch.KEEP:
        consequence = "the front stays below p_CJ" if stated > implied else "the front grows without bound"
        return stated, (
            f"{name}: runs at the stated {stated:g} m/s, but its equation of state implies {implied:.0f} m/s: "
            f"{consequence}",
        )
    if mismatch <= NOTABLE:
        return implied, ()
    if mismatch <= TOLERANCE:
        return implied, (
            f"{name}: runs at {implied:.1f} m/s, which its equation of state implies, not at the stated {stated:g} m/s",
        )
    consistent = _consistent_energy(equation_of_state, density, stated)
    other = "" if consistent is None else f"energy={consistent:.4g} J/kg, energy=cj, or "
    raise InputError(
        f"{name}: detonation_speed: expected the {implied:.0f} m/s (to 1 %) that its equation of state implies with "
        f"this energy, got {stated:g}; use {other}on_mismatch=keep to run it as is"
    )


def _odd_units(name: str, density: float, speed: float) -> tuple[str, ...]:
    """What to ask about figures that no explosive has: gases detonate too, but not as fast, and nothing as slowly."""
    if speed < SLOWEST:
        return (f"{name}: a detonation speed of {speed:g} m/s: is it in km/s?",)
    if density < DENSEST_GAS and speed > FASTEST_IN_GAS:
        return (f"{name}: a density of {density:g} kg/m3 with a detonation speed of {speed:g} m/s: is it in g/cm3?",)
    return ()


def _matched_pressure(name: str, stated: float, state: ChapmanJouguetState, on_mismatch: OnMismatch) -> tuple[str, ...]:
    """What there is to say about the stated Chapman-Jouguet pressure."""
    if abs(stated / state.pressure - 1.0) <= TOLERANCE:
        return ()
    text = f"{name}: cj_pressure: expected {state.pressure:.4g} Pa (to 1 %), which its equation of state implies"
    if on_mismatch is OnMismatch.ADJUST:
        raise InputError(f"{text}, got {stated:.4g}; correct the parameters, or use on_mismatch=keep")
    return (f"{text}, got {stated:.4g}",)


def _check_positive(name: str, quantity: str, value: Any, unit: str) -> None:
    if not (is_number(value) and value > 0.0):
        raise checks.mistake(f"{name}: {quantity}", f"a positive finite number of {unit}", checks.shortened(value))


def _check_heat(name: str, equation_of_state: EquationOfState, density: float) -> None:
    """Refuse an equation of state without heat where an energy is asked of it."""
    if not evaluate(equation_of_state, equation_of_state.pressure_slope, density) > 0.0:
        raise checks.mistake(
            f"{name}: equation_of_state",
            "one whose pressure rises with its energy",
            checks.shortened(equation_of_state),
            "give it a Gruneisen coefficient, or make it by Material(...) with a specific_energy of your own",
        )


def _check_kind(name: str, equation_of_state: object, role: str = "equation_of_state") -> None:
    checks.instance("material: name", name, str, "a text")
    if isinstance(equation_of_state, type) or not isinstance(equation_of_state, EquationOfState):
        got = checks.shortened(equation_of_state)
        raise checks.mistake(f"{name}: {role}", "an equation of state, such as IdealGas(gamma=1.4)", got)
