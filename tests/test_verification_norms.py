"""Error norms and fields of the verification: known numbers for known fields."""

import math

import numpy as np
import pytest

from warp_mpm.builder import SceneBuilder
from warp_mpm.exact.taylor_wave import RIGID, PlanarTaylorWave
from warp_mpm.geometry import Box
from warp_mpm.kernels.eos.ideal_gas import IdealGas
from warp_mpm.materials import Material
from warp_mpm.scene import Domain
from warp_mpm.simulation import simulate
from warp_mpm.verification import cell_means
from warp_mpm.verification.fields import (
    ExactFlow,
    Fields,
    cell_radii,
    computed_fields,
    edges_of,
    field_errors,
    planar_curves,
    planar_means,
    radial_curves,
    radial_means,
)
from warp_mpm.verification.norms import (
    field_error,
    mean_and_scatter,
    next_coarser,
    observed_order,
    observed_orders,
    relative_l1,
)
from warp_mpm.verification.problem import FieldError, Level, LevelResult, Measurement

CUBE = Domain((0.0, 0.0, 0.0), (0.4, 0.4, 0.4), (4, 4, 4))
GAS = Domain((0.0, 0.0, 0.0), (0.8, 0.8, 0.8), (8, 8, 8))
AWAY_FROM_WALLS = (slice(5), slice(5), slice(5))  # cells whose nodes see nothing of the walls that stop the gas


def result_at(cells, variant=None, **errors):
    """A level's result with the given L1 errors."""
    level = Level(cells, {} if variant is None else {"variant": variant})
    measurement = Measurement({name: FieldError(error, 2.0 * error) for name, error in errors.items()})
    return LevelResult(level, 1.0 / cells, 1, 1, 0.0, measurement, 0.0, 0.0, 0.0)


def test_norms_of_known_fields():
    exact = np.array([1.0, -2.0, 0.0, 1.0])
    computed = np.array([1.5, -2.0, 0.25, 1.0])
    assert field_error(computed, exact) == FieldError(l1=0.75 / 4.0, linf=0.5 / 2.0)
    assert relative_l1(exact, exact) == 0.0


def test_observed_order():
    assert observed_order(0.4, 0.1, 2.0) == pytest.approx(2.0)
    assert observed_order(0.4, 0.2, 4.0) == pytest.approx(0.5)
    assert math.isnan(observed_order(0.4, 0.0, 2.0))


def test_orders_are_against_the_next_coarser_level_of_the_same_variant():
    """50 cells lie between 20 and 100; a variant has no part in another one's order."""
    coarse, middle, other = result_at(20, pressure=0.5), result_at(50, pressure=0.2), result_at(60, 1.0, pressure=1.0)
    fine = result_at(100, pressure=0.1, density=0.3)
    assert next_coarser([other, middle, coarse], fine) is middle
    assert next_coarser([other], fine) is None
    assert observed_orders(middle, fine) == {"pressure_l1": pytest.approx(1.0)}  # density has nothing to compare with


def test_mean_and_scatter():
    assert mean_and_scatter(np.array([3.0, 5.0])) == (4.0, 0.25)
    assert all(math.isnan(value) for value in mean_and_scatter(np.empty(0)))


def test_cell_means_of_a_linear_field_are_its_values_at_the_centres():
    x, y, z = np.meshgrid(np.arange(4.0), np.arange(3.0), np.arange(5.0), indexing="ij")
    expected = (x + 2.0 * y - z)[:-1, :-1, :-1] + 0.5 + 1.0 - 0.5
    np.testing.assert_array_equal(cell_means(x + 2.0 * y - z), expected)


@pytest.fixture(scope="module")
def drifting_gas():
    """A box of gas that has hardly moved: 500 kg/m3, 1 kPa, 40 m/s away from the origin."""
    builder = SceneBuilder("drift")
    builder.domain(GAS.lower, GAS.upper, cells=GAS.cells)
    gas = Material("gas", 500.0, IdealGas(2.0), 2.0)

    def outward(position):
        return 40.0 * position / np.linalg.norm(position, axis=1, keepdims=True)

    builder.charge(Box(GAS.lower, GAS.upper), gas, velocity=outward)
    builder.end_time(1e-9)
    return simulate(builder.build(), device="cpu", threads=1)


def test_fields_of_a_simulation(drifting_gas):
    """Known before the run. Along the radius the velocity is 40 m/s everywhere; along x it vanishes with x.

    Tolerances: single precision, and the change within the one step of 1 ns; the velocity's direction turns by h / r
    from node to node, its smoothing by the shape function takes (h / r)^2 / 4 of it, and averaging as much again.
    """
    fields = computed_fields(drifting_gas.state, dimensions=3)
    np.testing.assert_allclose(fields.density, 500.0, rtol=1e-5)
    np.testing.assert_allclose(fields.pressure, 1000.0, rtol=1e-3)
    radius = cell_radii(GAS, 3)[AWAY_FROM_WALLS]
    lost = 1.0 - fields.velocity[AWAY_FROM_WALLS] / 40.0
    assert np.all(lost[radius > 0.15] < 0.5 * (0.1 / radius[radius > 0.15]) ** 2)
    assert lost.min() > -1e-5
    along_x = computed_fields(drifting_gas.state).velocity[2, 0, 0]
    assert along_x == pytest.approx(40.0 * 0.25 / np.linalg.norm([0.25, 0.05, 0.05]), rel=0.1)  # curved within a cell


def test_a_radial_field_around_the_axis_has_no_part_along_it(drifting_gas):
    """The velocity away from the z axis is 40 m/s times the sine of the angle to it."""
    fields = computed_fields(drifting_gas.state, dimensions=2)
    radius, height = cell_radii(GAS, 2)[AWAY_FROM_WALLS], GAS.centres(2)[:5]
    expected = 40.0 * radius / np.sqrt(radius**2 + height**2)
    lost = 1.0 - fields.velocity[AWAY_FROM_WALLS] / expected
    assert np.all(np.abs(lost[radius > 0.15]) < 0.5 * (0.1 / radius[radius > 0.15]) ** 2)


def test_planar_means_sum_to_what_the_flow_holds():
    """Mass: what was there. Momentum is not a sum of means of velocity, so pressure is checked on the plateau."""
    wave, time = PlanarTaylorWave(2.0, 1000.0, 2800.0, RIGID), 1e-4
    domain = Domain((0.0, 0.0, 0.0), (0.4, 0.01, 0.01), (40, 1, 1))
    means = planar_means(wave, domain, time)
    assert means.density.mean() == pytest.approx(1000.0)
    assert means.pressure[0, 0, 0] == pytest.approx(wave.plateau_pressure)
    assert means.velocity.shape == domain.cells


@pytest.mark.parametrize("dimensions", [2, 3])
def test_radial_means_over_cubes(dimensions):
    """Of r^2 the mean over a cube is that of its axes' squares: 1/3 ((k + 1)^3 - k^3) h^2 each.

    Midpoints fall short of it by h^2 / 12 / 36 an axis. A step has the mean volume share: pi / 4 or pi / 6 of a box.
    """
    flow = ExactFlow(lambda r, t: r**2, lambda r, t: 0.0 * r, lambda r, t: np.where(r < 0.4 * t, 1.0, 0.0))
    means = radial_means(flow, CUBE, 1.0, dimensions)
    square = (np.arange(1, 5) ** 3 - np.arange(4) ** 3) / 3.0 * 0.01
    expected = square[:, None, None] + square[None, :, None] + (square if dimensions == 3 else 0.0 * square)
    np.testing.assert_allclose(means.pressure, expected, rtol=0.0, atol=0.01 / 12.0 / 36.0 * dimensions + 1e-15)
    share = {2: math.pi / 4.0, 3: math.pi / 6.0}[dimensions]
    assert means.density.mean() == pytest.approx(share, abs=5e-3)  # 24 midpoints per axis: a tenth of one
    assert not means.velocity.any()


def test_a_curve_of_the_velocity_has_a_gap_where_there_is_no_matter():
    """In the error it counts as 0; drawn so it would look like a flow that stops."""
    shape = (4, 1, 1)
    values = np.arange(4.0).reshape(shape)
    curves = planar_curves(Fields(values, values, values), Domain((0.0, 0.0, 0.0), (0.4, 0.1, 0.1), shape))
    np.testing.assert_array_equal(curves["velocity"].y, [np.nan, 1.0, 2.0, 3.0])
    np.testing.assert_array_equal(curves["pressure"].y, [0.0, 1.0, 2.0, 3.0])
    np.testing.assert_allclose(curves["pressure"].x, [0.05, 0.15, 0.25, 0.35])


def test_errors_vanish_for_the_exact_fields_and_curves_follow_the_radius():
    flow = ExactFlow(lambda r, t: 1.0 + r, lambda r, t: 2.0 * r, lambda r, t: 1.0 + r**2)
    means = radial_means(flow, CUBE, 1.0, 3)
    assert set(field_errors(means, means).values()) == {FieldError(0.0, 0.0)}
    curve = radial_curves(means, CUBE, 3)["velocity"]
    # A cell's mean radius is more than that of its centre, by h^2 / 12 times half the Laplacian of r, 1 / r.
    np.testing.assert_allclose(curve.y, 2.0 * curve.x, rtol=0.0, atol=2.0 * 0.01 / 12.0 / curve.x.min())
    assert np.all(np.diff(edges_of(CUBE)) > 0.0)
