"""Solids from which charges are cut, what they make together, and where they are put.

`a | b` is what lies in either, `a - b` what lies in one and not in the other, `a & b` what lies in both;
`translated`, `rotated` and `scaled` put any of them elsewhere. Points are (n, 3) arrays, all lengths in metres.
"""

from warp_mpm.geometry.mesh import Mesh
from warp_mpm.geometry.primitives import Box, HalfSpace, Sphere, TurnedBox
from warp_mpm.geometry.revolved import Cone, Cylinder
from warp_mpm.geometry.solid import TOUCHING, Bounds, Difference, Intersection, Solid, Union, certainly_apart

__all__ = [
    "TOUCHING",
    "Bounds",
    "Box",
    "Cone",
    "Cylinder",
    "Difference",
    "HalfSpace",
    "Intersection",
    "Mesh",
    "Solid",
    "Sphere",
    "TurnedBox",
    "Union",
    "certainly_apart",
]
