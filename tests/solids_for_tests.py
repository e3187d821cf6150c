"""One solid of every kind and of every way to combine them. What tests ask of all solids, they ask of these."""

import math

import numpy as np

from warp_mpm.geometry import Box, Cone, Cylinder, HalfSpace, Mesh, Solid, Sphere

BOX = Box((0, 0, 0), (1, 2, 3))
BALL = Sphere((0, 0, 0), 1.0)
ROD = Cylinder((0, 0, 0), (0, 0, 2), 0.5)
SLANTED = Cylinder((0, 0, 0), (3, 4, 0), 0.5)
CONE = Cone((0, 0, 0), (0, 0, 2), 1.0)
FRUSTUM = Cone((1, 0, 0), (2, 2, 1), 0.3, 0.9)
SLOPE = HalfSpace((0.5, 1.0, 1.0), (1.0, 2.0, -0.5))

# Faces of a cube with vertices (x, y, z) in {0, 1}, the last one changing fastest; counter-clockwise from outside.
CUBE_FACES = [
    *([0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]),
    *([2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]),
]


def cube_mesh(lower: float = 0.0, upper: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (8, 3) and faces (12, 3) of a cube."""
    corners = np.stack(np.meshgrid(*3 * [[lower, upper]], indexing="ij"), axis=-1).reshape(-1, 3)
    return corners, np.array(CUBE_FACES)


def ring_mesh(ring: float, tube: float, around: int = 24, across: int = 12) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (around * across, 3) and faces of a torus with these radii about the z axis."""
    long, short = np.meshgrid(*(2.0 * math.pi * np.arange(count) / count for count in (around, across)), indexing="ij")
    reach = ring + tube * np.cos(short)
    vertices = np.stack([reach * np.cos(long), reach * np.sin(long), tube * np.sin(short)], axis=-1).reshape(-1, 3)
    number = np.arange(around * across).reshape(around, across)
    a, b = number, np.roll(number, -1, axis=0)
    c, d = np.roll(b, -1, axis=1), np.roll(a, -1, axis=1)
    return vertices, np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)


RING = Mesh(*ring_mesh(1.0, 0.4))

SOLIDS: dict[str, Solid] = {
    "box": BOX,
    "turned box": BOX.rotated((1, 2, 3), 0.7),
    "sphere": BALL,
    "cylinder": ROD,
    "slanted cylinder": SLANTED,
    "cone": CONE,
    "frustum": FRUSTUM,
    "mesh": RING,
    "mesh far away": Mesh(*cube_mesh(1000.0, 1000.5)),
    "union": BOX | BALL,
    "difference": BOX - BALL,
    "difference of round ones": BALL - ROD,
    "intersection": BOX & BALL,
    "intersection of round ones": CONE & Sphere((0, 0, 1.0), 0.8),
    "what a plane cuts off": BOX & SLOPE,
    "what a plane leaves": SLANTED - SLOPE,
    "half a ball": BALL & HalfSpace((0, 0, 0), (0, 0, 3)),
    "box with a ring-shaped hole": Box((-2, -2, -2), (2, 2, 2)) - RING,
    "half a ring": RING & HalfSpace((0, 0, 0), (1, 0, 0)),
    "three": (BOX | BALL) - SLANTED,
}
