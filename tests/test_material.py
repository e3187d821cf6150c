"""Materials against their formulas: burn, equations of state, viscosity, Chapman-Jouguet state and its check."""

import functools
import math

import numpy as np
import pytest
import warp as wp
from scenes_for_tests import CELL, ROUND_OFF, TNT, advance, block, explosive, particle_values, start

from warp_mpm.detonators import PointDetonator
from warp_mpm.errors import InputError
from warp_mpm.exact.chapman_jouguet import chapman_jouguet_state, energy_for_speed, hugoniot_pressure
from warp_mpm.kernels.burn.compression import CompressionBurn
from warp_mpm.kernels.burn.programmed import ProgrammedBurn
from warp_mpm.kernels.burn.programmed_compression import ProgrammedCompressionBurn
from warp_mpm.kernels.eos import evaluate
from warp_mpm.kernels.eos.ideal_gas import IdealGas
from warp_mpm.kernels.eos.jwl import JWL
from warp_mpm.kernels.precision import scalar
from warp_mpm.kernels.viscosity import Viscosity, viscous_pressure, viscous_rate
from warp_mpm.materials import OnMismatch, ammonium_nitrate
from warp_mpm.materials import explosive as make_explosive

explosives = pytest.mark.parametrize("eos", [IdealGas(1.4), IdealGas(3.0), TNT], ids=str)


def pressure(eos, density, energy):
    """Pressure p = a(rho) + b(rho) e [Pa], as the kernels compute it."""
    return evaluate(eos, eos.pressure_offset, density) + evaluate(eos, eos.pressure_slope, density) * energy


# ---- burn ------------------------------------------------------------------------------------------------------------


@functools.cache
def burn_kernel(burn_class):
    """Kernel that evaluates a burn fraction."""
    record = burn_class.Record
    burn_fraction = burn_class.burn_fraction

    @wp.kernel(enable_backward=False, module="unique")
    def evaluate(burn: record, given: wp.array2d(dtype=scalar), fractions: wp.array(dtype=scalar)):
        n = wp.tid()
        fractions[n] = burn_fraction(burn, given[n, 0], given[n, 1], given[n, 2], given[n, 3])

    return evaluate


def burn_fractions(burn, rows, device):
    """F for rows of (previous F, time since the wave, time since the booster, density)."""
    given = wp.array(np.array(rows, dtype=np.float32), dtype=scalar, device=device)
    fractions = wp.zeros(len(rows), dtype=scalar, device=device)
    wp.launch(burn_kernel(type(burn)), len(rows), inputs=[burn.record(3.0, CELL), given, fractions], device=device)
    return fractions.numpy()


def test_programmed_burn(device):
    """F = 0 before t_b, (t - t_b) D / (r_b h) after, then 1 (paper eq. 18); never less than it was; booster at once."""
    duration = 3.0 * CELL / 2800.0
    never = -1.0
    cases = {
        (0.0, -1e-9, never): 0.0,
        (0.0, 0.0, never): 0.0,
        (0.0, 0.25 * duration, never): 0.25,
        (0.0, duration, never): 1.0,
        (0.0, 5.0 * duration, never): 1.0,
        (0.75, 0.25 * duration, never): 0.75,  # latched
        (0.2, 0.25 * duration, never): 0.25,
        (0.0, -1e-6, -1e-9): 0.0,  # not before the booster's time
        (0.0, -1e-6, 0.0): 1.0,
        (0.0, -1e30, -1e30): 0.0,  # matter that nothing lights
    }
    computed = burn_fractions(ProgrammedBurn(2800.0), [(*case, 1000.0) for case in cases], device)
    np.testing.assert_allclose(computed, list(cases.values()), rtol=4 * ROUND_OFF, atol=0)


def test_compression_burns(device):
    """F2 = (1 - V) / (1 - V_CJ), latched, whatever the arrival time; and the larger of it and the programmed burn."""
    cj = 4.0 / 3.0 * 1000.0  # kg/m3: V_CJ = 3 / 4
    duration = 3.0 * CELL / 2800.0
    never = -1.0
    half = 1000.0 / (1.0 - 0.125)
    rows = {  # (previous F, time since the wave, since the booster, density): F2, both
        (0.0, never, never, 1000.0): (0.0, 0.0),
        (0.0, never, never, 900.0): (0.0, 0.0),
        (0.0, never, never, half): (0.5, 0.5),
        (0.0, never, never, 2000.0): (1.0, 1.0),
        (0.75, never, never, half): (0.75, 0.75),
        (0.0, 0.25 * duration, never, 1000.0): (0.0, 0.25),
        (0.0, 0.75 * duration, never, half): (0.5, 0.75),
        (0.0, never, 0.0, 1000.0): (1.0, 1.0),
    }
    for column, burn in enumerate((CompressionBurn, ProgrammedCompressionBurn)):
        computed = burn_fractions(burn(2800.0, 1000.0, cj), list(rows), device)
        np.testing.assert_allclose(computed, [row[column] for row in rows.values()], rtol=16 * ROUND_OFF, atol=0)


@pytest.mark.parametrize("speed", [0.0, -1.0, math.nan, math.inf])
def test_a_burn_needs_a_positive_speed(speed):
    with pytest.raises(ValueError, match="expected a positive number"):
        ProgrammedBurn(speed)


def test_particles_burn_as_their_arrival_times_say(device):
    """In a run: F = clamp((t - t_b) / DL) at the end of each step, 1 within a cell of a booster from its own time on.

    Two detonators, the second one later: where its booster lies the first one's wave has not come by then.
    """
    early, late = PointDetonator((0.0, 0.0, 0.0)), PointDetonator((0.16, 0.04, 0.0), time=10e-6)
    solver = start(block((16, 4, 2), detonators=[early, late]), device, burn_width=3.0)
    state = solver.state
    place = solver.model.scene.charges[0].positions
    duration = 3.0 * CELL / 2800.0
    boosted = {d.time: np.linalg.norm(place - d.position, axis=1) <= CELL for d in (early, late)}
    before = np.zeros(state.count)
    lit_late = []
    for _ in range(25):
        now = float(state.clock_values()["time"])
        burnt = state.field("burn_fraction")
        expected = np.clip((now - state.field("arrival_time")) / duration, 0.0, 1.0)
        for time, inside in boosted.items():
            expected[inside & (now >= time)] = 1.0
        # A single-precision time difference is rounded to 6e-8 of the arrival time, up to 20 times the duration.
        np.testing.assert_allclose(burnt, np.maximum(expected, before), rtol=0, atol=40 * ROUND_OFF)
        pure_products = burnt == 1.0
        values = particle_values(state)
        np.testing.assert_allclose(
            values["pressure"], burnt * values["density"] * values["energy"], rtol=8 * ROUND_OFF, atol=0
        )
        lit_late.append(bool(pure_products[boosted[10e-6]].all()))
        before = burnt
        advance(solver, 1)
    assert boosted[0.0].sum() == boosted[10e-6].sum() == 4  # of the particles 2.5 and 7.5 mm along the axes
    assert not lit_late[0]
    assert lit_late[-1]
    assert 0.1 < before.mean() < 0.9


# ---- viscosity -------------------------------------------------------------------------------------------------------


@wp.kernel(enable_backward=False)
def viscosity_kernel(
    viscosity: Viscosity,
    density: scalar,
    sound: scalar,
    divergences: wp.array(dtype=scalar),
    rows: wp.array2d(dtype=scalar),
):
    n = wp.tid()
    rows[n, 0] = viscous_pressure(viscosity, viscosity.length, density, sound, divergences[n])
    rows[n, 1] = viscous_rate(viscosity, sound, divergences[n])


def test_artificial_viscosity(device):
    """Viscous pressure q = rho l (c_Q l d^2 - c_L c d) for d = div v < 0, else 0 (LS-DYNA theory manual).

    Its rate nu / l^2, with q = rho nu |d|, bounds an explicit step.
    """
    viscosity = Viscosity()
    viscosity.quadratic, viscosity.linear, viscosity.length = 1.5, 0.06, 3e-3
    viscosity.inverse_length = 1.0 / 3e-3
    density, sound = 1300.0, 2200.0
    divergences = np.array([-1e5, -3e3, 0.0, 3e3, 1e5])
    rows = wp.zeros((len(divergences), 2), dtype=scalar, device=device)
    given = wp.array(divergences.astype(np.float32), device=device)
    inputs = [viscosity, density, sound, given, rows]
    wp.launch(viscosity_kernel, len(divergences), inputs=inputs, device=device)
    d = np.minimum(divergences, 0.0)
    expected = density * 3e-3 * (1.5 * 3e-3 * d**2 - 0.06 * sound * d)
    rate = np.divide(expected, density * 3e-3**2 * np.abs(d), out=np.zeros_like(d), where=d < 0.0)
    np.testing.assert_allclose(rows.numpy(), np.stack([expected, rate], axis=1), rtol=16 * ROUND_OFF)


def test_unburnt_matter_has_no_viscosity(device):
    """Q acts where F > 0 alone: ahead of the wave compression stays without resistance, behind it does not."""
    solver = advance(start(block((20, 2, 2)), device), 20)
    values = particle_values(solver.state)
    unburnt = solver.state.field("burn_fraction") == 0.0
    assert unburnt.any()
    assert not values["viscous_pressure"][unburnt].any()
    assert not values["pressure"][unburnt].any()
    assert values["viscous_pressure"][~unburnt].max() > 0.01 * explosive().cj.pressure
    without = advance(start(block((20, 2, 2)), device, viscosity=(0.0, 0.0)), 20)
    assert not particle_values(without.state)["viscous_pressure"].any()


# ---- Chapman-Jouguet state and the check of explosives ---------------------------------------------------------------


@pytest.mark.parametrize("gamma", [1.4, 2.0, 2.7, 3.0])
def test_chapman_jouguet_state_of_the_gamma_law(gamma):
    """D^2 = 2 (gamma^2 - 1) E0, p = rho0 D^2 / (gamma + 1), rho = rho0 (gamma + 1) / gamma, u = D / (gamma + 1).

    Fickett and Davis, section 2A; paper eq. 20. The state is where two curves touch: its pressure is determined to the
    square root of the rounding of the functions, times the step to the point of contact.
    """
    density, energy = 1200.0, 2e6
    state = chapman_jouguet_state(IdealGas(gamma), density, energy)
    speed = math.sqrt(2.0 * (gamma**2 - 1.0) * energy)
    assert state.detonation_speed == pytest.approx(speed, rel=1e-6)
    assert state.pressure == pytest.approx(density * speed**2 / (gamma + 1.0), rel=1e-5)
    assert state.density == pytest.approx(density * (gamma + 1.0) / gamma, rel=1e-5)
    assert state.particle_velocity == pytest.approx(speed / (gamma + 1.0), rel=1e-5)
    assert state.sound_speed == pytest.approx(gamma * speed / (gamma + 1.0), rel=1e-5)


@explosives
def test_chapman_jouguet_state_satisfies_its_conditions(eos):
    """Mass, momentum and energy across the front, and the sonic condition u + c = D, for every equation of state."""
    density, energy = (eos.density, 4e6) if isinstance(eos, JWL) else (1000.0, 1.5e6)
    state = chapman_jouguet_state(eos, density, energy)
    speed, velocity = state.detonation_speed, state.particle_velocity
    assert density * speed == pytest.approx(state.density * (speed - velocity), rel=1e-6)
    assert state.pressure == pytest.approx(density * speed * velocity, rel=1e-6)
    internal = energy + 0.5 * state.pressure * (1.0 / density - 1.0 / state.density)
    assert pressure(eos, state.density, internal) == pytest.approx(state.pressure, rel=1e-5)
    sound = math.sqrt(evaluate(eos, eos.sound_speed_squared, state.density, internal))
    assert sound + velocity == pytest.approx(speed, rel=1e-4)
    assert hugoniot_pressure(eos, density, energy, state.density) == pytest.approx(state.pressure, rel=1e-6)
    assert energy_for_speed(eos, density, speed) == pytest.approx(energy, rel=1e-5)


def test_the_papers_explosive():
    """With gamma = 2 and D = 2800 m/s: E0 = D^2 / 6 = 1.307e6 J/kg, p_CJ = 2.613 GPa."""
    anfo = ammonium_nitrate()
    assert anfo.specific_energy == pytest.approx(2800.0**2 / 6.0, rel=1e-6)
    assert anfo.cj.pressure == pytest.approx(2.6133e9, rel=1e-4)
    assert anfo.burn.detonation_speed == 2800.0
    assert anfo.warnings == ()


def made(speed, energy="cj", on_mismatch=OnMismatch.ADJUST, **values):
    """An explosive of the gamma law with gamma = 2."""
    return make_explosive(
        "mixture",
        density=1000.0,
        detonation_speed=speed,
        equation_of_state=IdealGas(2.0),
        energy=energy,
        on_mismatch=on_mismatch,
        **values,
    )


CONSISTENT = 2800.0**2 / 6.0  # J/kg for 2800 m/s


def test_a_consistent_explosive_has_nothing_to_say():
    """Digits people write: 1.3067e6 J/kg for 2800 m/s."""
    assert made(2800.0, CONSISTENT).warnings == ()
    assert made(2800.0, CONSISTENT).burn.detonation_speed == 2800.0
    assert made(2800.0).specific_energy == pytest.approx(CONSISTENT, rel=1e-6)
    assert made(2800.0, cj_pressure=2.61e9).warnings == ()


@pytest.mark.parametrize("factor", [0.991, 1.009])
def test_a_small_mismatch_is_adjusted(factor):
    """Below 1 % in D the wave runs at the speed the equation of state implies, and the warning names both."""
    material_ = made(2800.0 * factor, CONSISTENT)
    assert material_.burn.detonation_speed == pytest.approx(2800.0, rel=1e-5)
    (warning,) = material_.warnings
    assert "2800.0 m/s" in warning
    assert f"{2800.0 * factor:g} m/s" in warning


@pytest.mark.parametrize("factor", [0.98, 1.02])
def test_a_large_mismatch_is_an_error_that_names_the_energy(factor):
    """Above 1 %: one line with the energy that would be consistent with the stated speed."""
    with pytest.raises(InputError) as caught:
        made(2800.0 * factor, CONSISTENT)
    message = str(caught.value)
    assert "\n" not in message
    assert f"energy={CONSISTENT * factor**2:.4g}" in message
    assert "on_mismatch=keep" in message


@pytest.mark.parametrize(("factor", "consequence"), [(0.98, "grows without bound"), (1.02, "stays below p_CJ")])
def test_a_kept_mismatch_is_one_warning(factor, consequence):
    """With keep the wave runs as stated, whatever it does then, with one warning."""
    material_ = made(2800.0 * factor, CONSISTENT, OnMismatch.KEEP)
    assert material_.burn.detonation_speed == 2800.0 * factor
    (warning,) = material_.warnings
    assert consequence in warning


def test_the_papers_energy():
    """3.8e6 J/kg would detonate at sqrt(6 x 3.8e6) = 4775 m/s: an error, or with keep a warning that says so."""
    with pytest.raises(InputError, match="4775 m/s"):
        ammonium_nitrate(energy=3.8e6)
    kept = ammonium_nitrate(energy=3.8e6, on_mismatch=OnMismatch.KEEP)
    assert kept.burn.detonation_speed == 2800.0
    assert kept.specific_energy == 3.8e6
    (warning,) = kept.warnings
    assert "4775 m/s" in warning


def test_a_stated_pressure_is_checked():
    """The same for p_CJ: 2.613 GPa is implied."""
    with pytest.raises(InputError, match=r"expected 2\.613e\+09 Pa .* got 3e\+09"):
        made(2800.0, cj_pressure=3e9)
    (warning,) = made(2800.0, on_mismatch=OnMismatch.KEEP, cj_pressure=3e9).warnings
    assert "3e+09" in warning


@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
def test_values_are_positive_and_finite(value):
    with pytest.raises(InputError, match="detonation_speed: expected a positive finite number"):
        made(value)
    with pytest.raises(InputError, match="energy: expected a positive finite number"):
        made(2800.0, value)
