"""The isosurface of the field pressure: where it lies, which way it faces, and that it has no flaws."""

import numpy as np
import pytest
from scenes_for_tests import CELL, OPEN, block

from warp_mpm.config import SolverConfig
from warp_mpm.isosurface import pressure_isosurface
from warp_mpm.launch import find_device
from warp_mpm.model import build_model
from warp_mpm.state import State

CENTRE = np.array([0.06, 0.05, 0.07])  # [m]
TOP, FALL = 3e9, 5e10  # pressure in the centre [Pa], and what it loses outwards [Pa/m]


@pytest.fixture
def state(device):
    """A block of 12 x 10 x 14 cells, in vacuum of two."""
    return State(build_model(block((12, 10, 14), walls=OPEN, margin_cells=2), SolverConfig(), find_device(device)))


def put(state: State, pressure_at) -> None:
    """Give every node the pressure that a function has for its distance from the centre (..., 3) [m]."""
    domain = state.model.scene.domain
    nodes = np.moveaxis(np.indices([n + 1 for n in domain.cells]), 0, -1)
    values = pressure_at(nodes * domain.spacing + domain.lower - CENTRE)
    state.field_pressure = lambda: values


def cone(offset):
    return TOP - FALL * np.linalg.norm(offset, axis=-1)


def edges(triangles):
    """Every edge of every triangle, in its direction."""
    return {(int(a), int(b)) for corners in triangles for a, b in zip(corners, np.roll(corners, -1), strict=True)}


def volume(surface):
    """Volume that a closed surface encloses [m3], positive if its front is outside."""
    a, b, c = np.moveaxis(surface.points[surface.triangles].astype(float), 1, 0)
    return np.einsum("ni,ni->", a, np.cross(b, c)) / 6


def test_a_ball_is_a_closed_ball_with_its_front_outside(state):
    put(state, cone)
    level = 1e9
    surface = pressure_isosurface(state, level)
    radius = (TOP - level) / FALL
    distance = np.linalg.norm(surface.points - CENTRE, axis=1)
    # linear interpolation of a distance r along an edge of a cell is off by h^2 / (8 r) at most
    np.testing.assert_allclose(distance, radius, atol=CELL**2 / (8 * (radius - CELL)))
    directed = edges(surface.triangles)
    assert all((b, a) in directed for a, b in directed)
    # chords and interpolation both cut off up to h^2 / (8 r) of the radius
    assert volume(surface) == pytest.approx(4 / 3 * np.pi * radius**3, rel=2 * 3 * CELL**2 / (8 * radius**2))
    assert surface.points.dtype == np.float32
    assert surface.triangles.dtype == np.int32


def test_nothing_exceeds_the_pressure(state):
    put(state, cone)
    surface = pressure_isosurface(state, 2 * TOP)
    assert surface.points.shape == surface.triangles.shape == (0, 3)


def test_a_surface_ends_at_the_faces_of_the_domain(state):
    put(state, lambda offset: TOP - FALL * offset[..., 0])
    surface = pressure_isosurface(state, TOP)
    domain = state.model.scene.domain
    np.testing.assert_allclose(surface.points[:, 0], CENTRE[0], rtol=1e-6)
    np.testing.assert_allclose(surface.points[:, 1:].min(axis=0), domain.lower[1:], rtol=1e-6)
    np.testing.assert_allclose(surface.points[:, 1:].max(axis=0), domain.upper[1:], rtol=1e-6)
    assert len(surface.triangles) == 2 * domain.cells[1] * domain.cells[2]


def test_nodes_at_the_very_pressure_make_no_flat_triangles(state):
    def octahedron(offset):
        return np.float32(6) - np.rint(np.abs(offset / CELL).sum(axis=-1))

    put(state, octahedron)
    surface = pressure_isosurface(state, 3.0)
    corners = surface.points[surface.triangles].astype(float)
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    assert len(area) > 0
    assert area.min() > 1e-3 * CELL**2
    assert set(surface.triangles.ravel()) == set(range(len(surface.points)))
    assert volume(surface) == pytest.approx(4 / 3 * (3 * CELL) ** 3, rel=1e-5)
