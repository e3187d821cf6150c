"""A scene with two explosives: its figures are those of the one on the front path; and runs that end early."""

import pytest

import warp_mpm as mpm
from warp_mpm import simulation
from warp_mpm.summary import lit_explosive

CELL = 0.01  # [m]


def two_explosives(path: tuple[float, float] | None, end_time: float = 12e-6, fast_time: float = 0.0) -> mpm.Scene:
    """A fast explosive (x < 0.1 m) beside a slow one, each lit at its own end; the path runs along x."""
    builder = mpm.SceneBuilder("pair")
    builder.domain((0.0, 0.0, 0.0), (0.2, 0.02, 0.02), cell_size=CELL)
    for name, start, speed in (("fast", 0.0, 7000.0), ("slow", 0.1, 4000.0)):
        material = mpm.explosive(
            name, density=1000.0, detonation_speed=speed, equation_of_state=mpm.IdealGas(gamma=3.0)
        )
        builder.charge(mpm.Box((start, 0.0, 0.0), (start + 0.1, 0.02, 0.02)), material, name=name)
    builder.detonator(mpm.PlaneDetonator((0.0, 0.0, 0.0), normal=(1.0, 0.0, 0.0), time=fast_time, charges=("fast",)))
    builder.detonator(mpm.PlaneDetonator((0.2, 0.0, 0.0), normal=(1.0, 0.0, 0.0), time=1e-6, charges=("slow",)))
    builder.end_time(end_time)
    if path is not None:
        builder.front_path((path[0], 0.01, 0.01), (path[1], 0.01, 0.01))
    return builder.build()


@pytest.mark.parametrize(("path", "name"), [((0.0, 0.1), "fast"), ((0.2, 0.11), "slow"), (None, "fast")])
def test_the_explosive_of_the_front_path(path, name):
    assert lit_explosive(two_explosives(path)).name == name


def test_figures_are_those_of_the_slow_explosive(device):
    """The path lies in the slow one, 9 cells from its detonator: the speed is known to a third of a cell in them.

    A programmed burn's front stays below p_CJ; taken with the fast explosive's arrival times it would show nothing. The
    fast one is lit too late for its gas to come to the path.
    """
    scene = two_explosives((0.2, 0.11), end_time=25e-6, fast_time=15e-6)
    summary = mpm.simulate(scene, save=mpm.Save(frames=2), device=device).summary
    assert summary["detonation_speed_m_s"] == 4000.0
    assert summary["p_cj_pa"] == pytest.approx(1000.0 * 4000.0**2 / 4.0, rel=1e-5)
    assert summary["front_speed_m_s"] == pytest.approx(4000.0, rel=1.0 / 27.0)
    assert summary["front_fit_residual_m"] < 0.1 * CELL
    assert 0.0 < summary["front_gauge_pressure_pa"] < summary["p_cj_pa"]


def test_a_front_that_has_not_arrived_has_no_pressure(device):
    summary = mpm.simulate(two_explosives((0.2, 0.11), end_time=3e-6), save=mpm.Save(frames=2), device=device).summary
    assert summary["front_pressure_pa"] is None
    assert summary["front_gauge_pressure_pa"] is None


def test_pictures_without_being_asked():
    assert two_explosives(None).picture_times == pytest.approx([2e-6, 4e-6, 6e-6, 8e-6, 10e-6, 12e-6])


def test_an_interrupt_before_the_first_frame_is_just_that(device, monkeypatch, tmp_path):
    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(simulation, "totals_of", interrupt)
    with pytest.raises(KeyboardInterrupt):
        mpm.simulate(two_explosives(None), save=mpm.Save(frames=2), device=device, output=tmp_path)
    assert not (tmp_path / "summary.json").exists()


@pytest.mark.parametrize(("save", "said"), [(mpm.Save(frames=50), True), (mpm.Save(), False), (None, False)])
def test_more_frames_than_steps_are_said_to_who_asked_for_them(device, save, said):
    summary = mpm.simulate(two_explosives(None, end_time=1e-6), save=save, device=device).summary
    assert summary["steps"] < 50
    assert any("some frames are repeated" in warning for warning in summary["warnings"]) == said
