"""The field pressure on the scene's section plane."""

import numpy as np

from warp_mpm.state import State


def section_pressure(state: State) -> np.ndarray:
    """Field pressure (nodes_u, nodes_v) [Pa] at the nodes of the section plane.

    Between two layers of nodes it is interpolated linearly.
    """
    scene = state.model.scene
    domain, plane = scene.domain, scene.section
    pressure = state.field_pressure()
    place = (plane.coordinate - domain.lower[plane.axis]) / domain.spacing[plane.axis]
    below = int(np.clip(np.floor(place), 0, domain.cells[plane.axis] - 1))
    share = pressure.dtype.type(place - below)
    low = np.take(pressure, below, axis=plane.axis)
    high = np.take(pressure, below + 1, axis=plane.axis)
    return (1 - share) * low + share * high
