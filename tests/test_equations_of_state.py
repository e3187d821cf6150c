"""Equations of state against their formulas, the slope of the isentrope, and their guards."""

import importlib
import inspect
import math
import pkgutil
from dataclasses import fields, replace

import numpy as np
import pytest
from scenes_for_tests import ROUND_OFF, TNT

from warp_mpm.kernels import eos as eos_package
from warp_mpm.kernels.burn.compression import CompressionBurn
from warp_mpm.kernels.burn.programmed_compression import ProgrammedCompressionBurn
from warp_mpm.kernels.eos import evaluate
from warp_mpm.kernels.eos.ideal_gas import IdealGas
from warp_mpm.kernels.eos.jwl import JWL
from warp_mpm.kernels.eos.mie_gruneisen import MieGruneisen
from warp_mpm.kernels.eos.stiffened_gas import StiffenedGas

ANFO = JWL(820.0, 42.0e9, 0.044e9, 3.55, 0.16, 0.41)
WATER = StiffenedGas(4.4, 6e8)
COPPER = MieGruneisen(8960.0, 3940.0, 1.489, 2.02)
LINEAR = MieGruneisen(1600.0, 2500.0)

# At least one of every class in `kernels/eos/`, with densities [kg/m3] and energies [J/kg] at which it is tested:
# expanded, as it is, and compressed.
STATES = [(1.2, 2e5), (300.0, 4e5), (1000.0, 1.307e6), (1500.0, 2e6)]
STATES_OF = {
    IdealGas(1.4): STATES,
    IdealGas(2.0): STATES,
    IdealGas(3.0): STATES,
    TNT: [(1.2, 2e5), (160.0, 1e6), (800.0, 2e6), (1630.0, 4.294e6), (2227.0, 5.7e6), (3000.0, 8e6), (20000.0, 1e7)],
    ANFO: [(1.0, 1e5), (82.0, 1.5e6), (820.0, 3.84e6), (1213.0, 5e6), (2000.0, 6e6)],
    WATER: [(1000.0, 8e5), (1100.0, 9e5), (2000.0, 5e6)],
    COPPER: [(8700.0, 1e3), (9100.0, 1e3), (10000.0, 1e5), (13000.0, 2e6)],
    LINEAR: [(1500.0, 1e3), (1650.0, 1e3), (2200.0, 1e6)],
}
CASES = [(eos, *state) for eos, states in STATES_OF.items() for state in states]


def eos_classes():
    """The classes of equations of state in `kernels/eos/`."""
    found = set()
    for info in pkgutil.iter_modules(eos_package.__path__, f"{eos_package.__name__}."):
        for value in vars(importlib.import_module(info.name)).values():
            if inspect.isclass(value) and hasattr(value, "pressure_slope"):
                found.add(value)
    return found


def test_every_equation_of_state_is_tested():
    """A new file in `kernels/eos/` must be added to the list above."""
    assert eos_classes() == {type(eos) for eos in STATES_OF}


def pressure(eos, density, energy):
    """Pressure p = a(rho) + b(rho) e [Pa], as the kernels compute it."""
    return evaluate(eos, eos.pressure_offset, density) + evaluate(eos, eos.pressure_slope, density) * energy


@pytest.mark.parametrize(("eos", "density", "energy"), CASES, ids=str)
def test_sound_speed_is_the_slope_of_the_isentrope(eos, density, energy):
    """c^2 = dp/drho along de = p / rho^2 drho (first law), here by a central difference along the isentrope.

    From rho to rho (1 +- s): e changes by p / rho (+-s) + O(s^2); the difference is exact to O(s^2) relative, with a
    factor for the curvature, as p grows like rho^10 at most; rounding adds r / s, times what p is a difference of over
    rho c^2. With s = r^(1/3) both are 2e-5 times such a factor, or 2e-11 in double precision.
    """
    share = ROUND_OFF ** (1.0 / 3.0)

    def on_isentrope(factor):
        """Second order in the step: half a step for the pressure in the middle of it (midpoint rule)."""
        half = density * (1.0 + (factor - 1.0) / 2)
        half_energy = energy + pressure(eos, density, energy) / density**2 * (half - density)
        middle = pressure(eos, half, half_energy)
        return pressure(eos, density * factor, energy + middle / half**2 * density * (factor - 1.0))

    slope = (on_isentrope(1.0 + share) - on_isentrope(1.0 - share)) / (2.0 * share * density)
    assert evaluate(eos, eos.sound_speed_squared, density, energy) == pytest.approx(slope, rel=60.0 * share**2)


@pytest.mark.parametrize("kind", [int, np.float64, np.float32], ids=lambda kind: kind.__name__)
@pytest.mark.parametrize("eos", STATES_OF, ids=str)
def test_numbers_of_any_kind(eos, kind):
    """Whole numbers, and those that a study takes from NumPy, are as good as any."""
    numbers = {item.name: getattr(eos, item.name) for item in fields(eos)}
    others = {name: kind(number) for name, number in numbers.items() if kind is not int or number == int(number)}
    assert others or kind is int
    for density, energy in STATES_OF[eos]:
        assert pressure(replace(eos, **others), density, energy) == pytest.approx(
            pressure(eos, density, energy), rel=1e-5
        )


@pytest.mark.parametrize("eos", STATES_OF, ids=str)
def test_passive_volumes(eos):
    """Whether p V stays when the volume changes at one energy: by more than rounding, or not."""
    products = [pressure(eos, density, 1e6) / density for density in (0.9 * 1200.0, 1200.0, 1.1 * 1200.0)]
    passive = np.ptp(products) < 1e-5 * np.abs(products).max()
    assert passive == eos.passive_volume


@pytest.mark.parametrize("gamma", [1.4, 2.0, 3.0])
@pytest.mark.parametrize(("density", "energy"), STATES)
def test_ideal_gas(gamma, density, energy):
    """Pressure p = (gamma - 1) rho e (paper eq. 17), c^2 = gamma p / rho; gamma - 1 loses a few roundings of gamma."""
    expected = (gamma - 1.0) * density * energy
    gas = IdealGas(gamma)
    assert pressure(gas, density, energy) == pytest.approx(expected, rel=16 * ROUND_OFF)
    squared = evaluate(gas, gas.sound_speed_squared, density, energy)
    assert squared == pytest.approx(gamma * expected / density, rel=16 * ROUND_OFF)


@pytest.mark.parametrize("gamma", [1.0, 0.9, -1.0, math.nan, math.inf])
def test_an_ideal_gas_needs_gamma_above_one(gamma):
    with pytest.raises(ValueError, match="expected a finite number above 1"):
        IdealGas(gamma)


@pytest.mark.parametrize(("density", "energy"), STATES_OF[TNT][:-1])
def test_jwl(density, energy):
    """p and rho c^2 of the definition, in double precision, with E = rho0 e and V = rho0 / rho."""
    rho0, a, b, r1, r2, w = TNT.density, TNT.a, TNT.b, TNT.r1, TNT.r2, TNT.omega
    volume, internal = rho0 / density, rho0 * energy
    first, second = a * math.exp(-r1 * volume), b * math.exp(-r2 * volume)
    expected = first * (1.0 - w / (r1 * volume)) + second * (1.0 - w / (r2 * volume)) + w * internal / volume
    assert pressure(TNT, density, energy) == pytest.approx(expected, rel=1e-5)  # an exponent of up to 80 is rounded
    gas = expected - first - second
    stiffness = r1 * volume * first + r2 * volume * second + (1.0 + w) * gas
    assert evaluate(TNT, TNT.sound_speed_squared, density, energy) == pytest.approx(stiffness / density, rel=1e-5)


@pytest.mark.parametrize("jwl", [TNT, ANFO], ids=["TNT", "ANFO"])
def test_jwl_is_guarded(jwl):
    """From a millionth to a thousand times rho0, however cold: p is finite, p and c^2 grow with energy, c^2 >= 0.

    Compressed beyond rho0 ever further a(rho) does not fall.
    """
    offsets = [0.0]
    for density in (jwl.density * np.geomspace(1e-6, 1e3, 200)).tolist():
        squared = [evaluate(jwl, jwl.sound_speed_squared, density, energy) for energy in (0.0, 1e4, 1e7)]
        pressures = [pressure(jwl, density, energy) for energy in (0.0, 1e4, 1e7)]
        assert np.isfinite([*squared, *pressures]).all()
        assert 0.0 <= squared[0] < squared[1] < squared[2]
        assert pressures[0] < pressures[1] < pressures[2]
        if density > jwl.density:
            offsets.append(pressures[0])
    assert np.diff(offsets).min() >= -1e-6 * max(offsets)


def test_stiffened_gas_and_mie_gruneisen():
    """Water at rest, c^2 = gamma (p + p_inf) / rho; p_H on the Hugoniot, with e = p_H eta / (2 rho0)."""
    energy = (1e5 + 4.4 * 6e8) / (3.4 * 1000.0)
    assert pressure(WATER, 1000.0, energy) == pytest.approx(1e5, abs=3e9 * 8 * ROUND_OFF)
    squared = evaluate(WATER, WATER.sound_speed_squared, 1000.0, energy)
    assert squared == pytest.approx(4.4 * 6.001e8 / 1000.0, rel=1e-5)
    assert evaluate(WATER, WATER.sound_speed_squared, 500.0, energy) == 0.0  # torn apart
    speed = 1000.0  # of the matter behind the shock [m/s]
    shock = COPPER.sound_speed + COPPER.slope * speed
    behind = COPPER.density * shock / (shock - speed)
    assert pressure(COPPER, behind, 0.5 * speed**2) == pytest.approx(COPPER.density * shock * speed, rel=1e-5)
    assert pressure(LINEAR, 2000.0, 1e6) == pytest.approx(1600.0 * 2500.0**2 * 0.2, rel=1e-5)
    for density in (9000.0, 20000.0, 1e6):
        assert evaluate(COPPER, COPPER.sound_speed_squared, density, 0.0) >= 0.0
        assert math.isfinite(pressure(COPPER, density, 0.0))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: JWL(0.0, 1e11, 1e9, 4.0, 1.0, 0.3), "JWL: density: expected a positive finite number, got 0"),
        (lambda: JWL(1600.0, -1e11, 1e9, 4.0, 1.0, 0.3), "JWL: a: expected a finite number of at least 0 Pa"),
        (lambda: JWL(1600.0, 1e11, 1e9, math.nan, 1.0, 0.3), "JWL: r1: expected a positive finite number, got nan"),
        (lambda: StiffenedGas(1.0, 6e8), "stiffened gas: gamma: expected a finite number above 1, got 1"),
        (lambda: StiffenedGas(4.4, -1.0), "stiffened gas: stiffness: expected a finite number of at least 0"),
        (lambda: MieGruneisen(1600.0, 0.0), "Mie-Gruneisen: sound_speed: expected a positive finite number"),
        (lambda: MieGruneisen(1600.0, 2500.0, slope=-1.0), "Mie-Gruneisen: slope: expected a finite number"),
        (lambda: CompressionBurn(0.0, 1.0, 2.0), "compression burn: detonation_speed: expected a positive number"),
        (lambda: ProgrammedCompressionBurn(1.0, 2.0, 2.0), "compression burn: cj_density: expected more than the 2"),
    ],
)
def test_parameters_that_make_no_sense(make, message):
    with pytest.raises(ValueError, match=f"^{message}"):
        make()
