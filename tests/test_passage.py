"""Surfaces seen between lattice points, and corners moved along them, against a sphere's."""

import numpy as np
import warp as wp

from warp_mpm.kernels.passage import Passage, best_corner, surface_at
from warp_mpm.kernels.precision import ZERO, scalar, vector3

RADIUS = 15.0  # of the sphere [spacings of the lattice]
POINTS = 41  # of the lattice per axis
TOLERANCE = 0.04  # what a clear way may cut [spacings]; 0.02 cells
SLOWNESS = (1.0, 2.0)  # within the sphere, and around it


@wp.kernel(enable_backward=False)
def see(passage: Passage, places: wp.array(dtype=vector3), distance: wp.array(dtype=scalar)):
    """Distances of places to the surface."""
    distance[wp.tid()] = surface_at(passage, 0, places[wp.tid()]).distance


@wp.kernel(enable_backward=False)
def bend(
    passage: Passage,
    starts: wp.array(dtype=vector3),
    ends: wp.array(dtype=vector3),
    slowness: scalar,
    slowness_after: scalar,
    corners: wp.array(dtype=vector3),
):
    """Move the corners of ways from the centre."""
    n = wp.tid()
    corners[n] = best_corner(passage, 0, vector3(ZERO, ZERO, ZERO), slowness, starts[n], ends[n], slowness_after)


def passage_of(distance):
    """Of one medium, by its signed distance at places (n, 3), on a lattice around the origin with spacing 1."""
    axis = np.arange(POINTS) - POINTS // 2
    lattice = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    passage = Passage()
    passage.distance = wp.array(distance(lattice), dtype=scalar, device="cpu")
    passage.points = wp.vec3i(POINTS, POINTS, POINTS)
    passage.count = POINTS**3
    passage.lower = vector3(*(3 * [-float(POINTS // 2)]))
    passage.spacing = passage.inverse_spacing = vector3(1.0, 1.0, 1.0)
    passage.step = 0.5
    passage.tolerance = TOLERANCE
    return passage


def sphere(places):
    return np.linalg.norm(places, axis=1) - RADIUS


def seen_from(passage, places):
    found = wp.zeros(len(places), dtype=scalar, device="cpu")
    wp.launch(see, len(places), inputs=[passage, wp.array(places, dtype=vector3, device="cpu"), found], device="cpu")
    return found.numpy()


def directions(count):
    """Unit vectors (n, 3) everywhere."""
    vectors = np.random.default_rng(1).normal(size=(count, 3))
    return vectors / np.linalg.norm(vectors, axis=1)[:, None]


def test_a_curved_surface_has_no_facets():
    """Those of linear interpolation are off by up to 2 / (8 R); what is left is of the next order, 1 / R^2."""
    places = RADIUS * directions(2000)
    assert np.abs(seen_from(passage_of(sphere), places)).max() < 0.3 / RADIUS**2


def test_edges_along_lattice_points_stay_exact():
    """As they are with linear interpolation: a second difference across an edge must not spoil it."""
    passage = passage_of(lambda places: np.abs(places[:, 0]) - 1.0)
    places = np.random.default_rng(2).uniform(-3.0, 3.0, (2000, 3))
    np.testing.assert_allclose(seen_from(passage, places), np.abs(places[:, 0]) - 1.0, atol=1e-5)


def test_corners_are_found_from_afar():
    """Ways from the centre leave along a radius, wherever the search begins: Newton's steps may be too long."""
    outward = directions(4000)
    ends = (RADIUS + np.random.default_rng(3).uniform(0.2, 3.0, (4000, 1))) * outward
    aside = outward + 0.4 * directions(4000)[::-1]
    starts = RADIUS * aside / np.linalg.norm(aside, axis=1)[:, None]
    corners = wp.zeros(len(ends), dtype=vector3, device="cpu")
    ways = (wp.array(places, dtype=vector3, device="cpu") for places in (starts, ends))
    wp.launch(bend, len(ends), inputs=[passage_of(sphere), *ways, *SLOWNESS, corners], device="cpu")
    miss = np.linalg.norm(corners.numpy() - RADIUS * outward, axis=1)
    assert miss.max() < 0.1
