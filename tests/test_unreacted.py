"""Explosive with an unreacted state resists, burns by compression where it is struck, and detonates as it should."""

import numpy as np
import pytest
from scenes_for_tests import advance, audited, block, particle_values, start

import warp_mpm as mpm
from warp_mpm.detonators import PlaneDetonator
from warp_mpm.exact.chapman_jouguet import pressure_of
from warp_mpm.scene_loading import load_scene
from warp_mpm.simulation import simulate

SOLID = mpm.MieGruneisen(1630.0, 2390.0, 2.05, 0.9)
LATE = 1.0  # [s]
SPEED = 300.0  # of each half [m/s]


def tnt(burn=mpm.Burn.PROGRAMMED, unreacted=SOLID):
    return mpm.find_material("tnt", burn=burn, unreacted=unreacted)


def impact(material, speed=SPEED):
    """Two halves of a bar, one cell across, run into each other; no wave comes before the end."""
    cells, edge = 60, 1e-3
    builder = mpm.SceneBuilder("impact")
    builder.domain((0.0, 0.0, 0.0), (cells * edge, edge, edge), cells=(cells, 1, 1))
    for name, low, velocity in (("left", 0.0, speed), ("right", cells * edge / 2, -speed)):
        box = mpm.Box((low, 0.0, 0.0), (low + cells * edge / 2, edge, edge))
        builder.charge(box, material, velocity=(velocity, 0.0, 0.0), name=name)
        builder.detonator(PlaneDetonator((low, 0.0, 0.0), normal=(1.0, 0.0, 0.0), time=LATE, charges=(name,)))
    builder.end_time(1.0)
    return builder.build()


def middle(state):
    """Which particles lie in the inner tenth of the bar."""
    return np.abs(state.positions()[:, 0] - 0.03) < 0.003


def compression(speed):
    """V and F behind the shock where halves of TNT meet at `speed` each and burn by compression, found by bisection.

    Mass, momentum: p = rho0 u^2 / (1 - V); energy: e = E0 + p (1 - V) / (2 rho0); p = F p_products + (1 - F) p_solid.
    """
    material = tnt()
    low, high = 0.5, 1.0
    for _ in range(50):
        volume = 0.5 * (low + high)
        burnt = min((1.0 - volume) / (1.0 - 1630.0 / material.cj.density), 1.0)
        stopping = 1630.0 * speed**2 / (1.0 - volume)
        heat = stopping * (1.0 - volume) / (2.0 * 1630.0)
        energy = material.specific_energy + heat
        products = pressure_of(material.equation_of_state, 1630.0 / volume, energy)
        mixed = burnt * products + (1.0 - burnt) * pressure_of(SOLID, 1630.0 / volume, heat)
        low, high = (volume, high) if mixed > stopping else (low, volume)
    return volume, burnt


def test_an_impact_has_the_pressure_of_the_hugoniot(device):
    """p = rho0 (c0 + s u) u behind the shocks into halves that meet at u each: the unreacted state, nothing burns.

    The shocks have run 16 cells, of which their own width takes a quarter.
    """
    solver = start(impact(tnt()), device)
    audit = audited(solver, 140)
    shocked = particle_values(solver.state)["pressure"][middle(solver.state)]
    assert len(shocked) > 40
    assert np.median(shocked) == pytest.approx(1630.0 * (2390.0 + 2.05 * SPEED) * SPEED, rel=0.05)
    assert not solver.state.field("burn_fraction").any()
    assert audit.energy_error < 1e-6  # of E0, which is a hundred times the energy of the impact


def test_without_an_unreacted_state_nothing_resists():
    with pytest.raises(mpm.InputError, match="expected explosive that resists"):
        impact(tnt(unreacted=None))


@pytest.mark.parametrize("speed", [300.0, 1500.0])
def test_compression_burns_what_is_struck(speed, device):
    """As far as it is compressed: V is that of the shock, F a little more, because it keeps what an overshoot burnt."""
    solver = advance(start(impact(tnt(mpm.Burn.COMPRESSION), speed), device), 140)
    inner = middle(solver.state)
    volume, burnt = compression(speed)
    assert 0.2 < burnt < 0.9
    assert np.median(particle_values(solver.state)["density"][inner]) == pytest.approx(1630.0 / volume, rel=0.02)
    assert burnt < np.median(solver.state.field("burn_fraction")[inner]) < burnt + 0.1


def test_expanded_explosive_has_no_tension(device):
    """Halves that part: no pressure below 0, and above it next to none: 1 % of what meeting at this speed makes."""
    solver = advance(start(impact(tnt(), -SPEED), device), 20)
    values = particle_values(solver.state)
    assert values["density"].min() < 1620.0
    assert values["pressure"].min() == 0.0
    assert values["pressure"][middle(solver.state)].max() < 0.01 * 1630.0 * (2390.0 + 2.05 * SPEED) * SPEED


@pytest.mark.parametrize("burn", [mpm.Burn.PROGRAMMED, mpm.Burn.BOTH])
def test_detonation_with_an_unreacted_state(burn, device):
    """The slab's front runs at D and stays below p_CJ, as without it; the plateau behind is where it should be."""
    scene = load_scene("tnt_slab", cell_size=1e-3)
    slab = scene.charges[0]
    lit = mpm.SceneBuilder("slab")
    lit.domain(scene.domain.lower, scene.domain.upper, cells=scene.domain.cells)
    lit.charge(slab.solid, tnt(burn), name="slab")
    lit.detonator(PlaneDetonator((0.0, 0.0, 0.0), normal=(1.0, 0.0, 0.0)))
    lit.front_path(scene.front_path.start, scene.front_path.end)
    lit.end_time(scene.end_time)
    summary = simulate(lit.build(), save=mpm.Save(frames=2), device=device).summary
    assert summary["front_speed_m_s"] == pytest.approx(6929.0, rel=0.01)
    assert 0.8 < summary["front_pressure_pa"] / 21e9 < 0.9
    assert summary["peak_pressure_pa"] < 21e9
    assert summary["energy_error"] < 1e-6


def test_unreacted_matter_at_rest_stays_at_rest(device):
    """Its energy is E0, its pressure 0 to the rounding of Gamma rho0 E0: no force, no motion."""
    late = PlaneDetonator((0.0, 0.0, 0.0), normal=(1.0, 0.0, 0.0), time=LATE)
    solver = advance(start(block((4, 3, 2), material=tnt(), detonators=[late]), device), 20)
    values = particle_values(solver.state)
    assert np.abs(values["pressure"]).max() <= 1e-6 * 0.9 * 7e9
    assert np.abs(values["velocity"]).max() < 1e-3
