"""The surface on which the field pressure has a given value."""

from typing import Any

import numpy as np
import warp as wp
from warp.geometry import IsoSurfaceMarchingCubes

from warp_mpm.output.frame import Surface
from warp_mpm.state import State


def pressure_isosurface(state: State, pressure: float) -> Surface:
    """Where the field pressure is `pressure` [Pa], by marching cubes between the nodes (Lorensen and Cline 1987).

    The surface is open where it meets a face of the domain, and has no triangles where no node exceeds the pressure.
    """
    domain = state.model.scene.domain
    field = state.field_pressure()
    begin, end = _box_above(field, pressure)
    region = tuple(slice(low, high) for low, high in zip(begin, end, strict=True))
    values: Any = wp.array(np.ascontiguousarray(field[region], dtype=np.float32), device=state.device)
    points, corners = IsoSurfaceMarchingCubes.extract(
        values,
        pressure,
        lower=wp.vec3(*(domain.lower + begin * domain.spacing)),
        upper=wp.vec3(*(domain.lower + (end - 1) * domain.spacing)),
    )
    return _clean(points.numpy(), corners.numpy())


def _box_above(field: np.ndarray, pressure: float) -> tuple[np.ndarray, np.ndarray]:
    """First node and the one past the last (3,) of a box that holds all nodes above a pressure, and their neighbours.

    Empty space takes no memory on a CPU; copies and tables of the whole domain would. So it is searched plane by plane.
    """
    along_y, along_z = (np.array([(plane >= pressure).any(axis=a) for plane in field]) for a in (1, 0))
    begin, end = np.zeros(3, dtype=int), np.full(3, 2)
    for axis, above in enumerate((along_y.any(axis=1), along_y.any(axis=0), along_z.any(axis=0))):
        (nodes,) = np.nonzero(above)
        if len(nodes):
            begin[axis] = max(nodes[0] - 1, 0)
            end[axis] = min(nodes[-1] + 2, field.shape[axis])
    return begin, end


def _clean(points: np.ndarray, corners: np.ndarray) -> Surface:
    """Points (n, 3) and the corners of triangles (3 m,) as Warp makes them, without triangles that have no area.

    There are some where a node has exactly the pressure of the surface: several points lie on that node. Warp's
    triangles turn their front to the higher pressure; these are turned round.
    """
    distinct, place = np.unique(points, axis=0, return_inverse=True)
    triangles = place.reshape(-1)[corners].reshape(-1, 3)[:, ::-1]
    wide = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    used, indices = np.unique(triangles[wide], return_inverse=True)
    return Surface(distinct[used], indices.reshape(-1, 3).astype(np.int32))
