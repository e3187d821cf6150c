"""Fields in the cells of the domain: those of a simulation, and the cell means of exact ones.

All have one value a cell (nx, ny, nz). The solver's own fields, pressure, velocity and density at the nodes, are
averaged over each cell, as linear between them.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from warp_mpm.scene import Domain
from warp_mpm.state import State
from warp_mpm.verification.norms import field_error, relative_l1
from warp_mpm.verification.problem import Curve, FieldError

MIDPOINTS = 6  # per axis of a cube, for the mean of a radial field
FIELD_NAMES = ("pressure", "velocity", "density")


@dataclass(frozen=True)
class Fields:
    """Pressure [Pa], velocity along x or along the radius [m/s] and density [kg/m3]; arrays of one shape."""

    pressure: np.ndarray
    velocity: np.ndarray
    density: np.ndarray


FlowField = Callable[[np.ndarray, float], np.ndarray]  # positions or radii [m], and a time [s]


class ExactFlow(NamedTuple):
    """An exact flow that depends on x, or on the radius, and on time. Without matter everything is 0."""

    pressure: FlowField  # [Pa]
    velocity: FlowField  # [m/s]
    density: FlowField  # of all matter, explosive not yet reached included [kg/m3]


class PlanarFlow(Protocol):
    """An exact flow that depends on x and time, and knows its means between edges (n + 1,) [m]."""

    def mean_pressure(self, edges: np.ndarray, time: float) -> np.ndarray:
        """Mean pressure [Pa] of each cell."""

    def mean_velocity(self, edges: np.ndarray, time: float) -> np.ndarray:
        """Mean velocity [m/s] of each cell."""

    def mean_density(self, edges: np.ndarray, time: float) -> np.ndarray:
        """Mean density [kg/m3] of each cell, of all matter."""


# ---- of a simulation -------------------------------------------------------------------------------------------------


def computed_fields(state: State, dimensions: int = 1) -> Fields:
    """The fields of a state; velocity along x (1), or away from the z axis (2) or the origin (3).

    Without matter the velocity is 0.
    """
    domain = state.model.scene.domain
    velocity = state.field_velocity().astype(np.float64)
    outward = velocity[..., 0]
    if dimensions > 1:
        nodes = np.stack(np.meshgrid(*(edges_of(domain, axis) for axis in range(3)), indexing="ij"), axis=-1)
        away = nodes[..., :dimensions]
        radius = np.linalg.norm(away, axis=-1)
        outward = (away * velocity[..., :dimensions]).sum(axis=-1) / np.maximum(radius, np.finfo(float).tiny)
    return Fields(cell_pressure(state), cell_means(outward), cell_means(state.field_density()))


def cell_pressure(state: State) -> np.ndarray:
    """Field pressure of each cell of the domain (nx, ny, nz) [Pa]."""
    return cell_means(state.field_pressure())


def cell_means(nodal: np.ndarray) -> np.ndarray:
    """Cell means (nx, ny, nz) of a field given at the nodes (nx + 1, ny + 1, nz + 1), linear between them."""
    result = nodal.astype(np.float64)
    for axis in range(3):
        low = np.take(result, np.arange(result.shape[axis] - 1), axis=axis)
        high = np.take(result, np.arange(1, result.shape[axis]), axis=axis)
        result = 0.5 * (low + high)
    return result


# ---- of an exact flow ------------------------------------------------------------------------------------------------


def edges_of(domain: Domain, axis: int = 0) -> np.ndarray:
    """Coordinates of the faces between cells along an axis (cells + 1,) [m]."""
    return np.linspace(domain.lower[axis], domain.upper[axis], domain.cells[axis] + 1)


def radius_of(position: np.ndarray, dimensions: int) -> np.ndarray:
    """Distance of points (n, 3) from the z axis (2), or from the origin (3) [m]."""
    return np.sqrt((position[:, :dimensions] ** 2).sum(axis=1))


def cell_radii(domain: Domain, dimensions: int) -> np.ndarray:
    """Distance of the cells' centres (nx, ny, nz) from the z axis (2), or from the origin (3) [m]."""
    x, y, z = (domain.centres(axis) for axis in range(3))
    squared = x[:, None, None] ** 2 + y[None, :, None] ** 2 + (z**2 if dimensions == 3 else 0.0 * z)
    return np.sqrt(squared)


def planar_means(flow: PlanarFlow, domain: Domain, time: float) -> Fields:
    """Exact cell means of a flow along x, each (nx, ny, nz)."""
    edges = edges_of(domain)
    means = (flow.mean_pressure(edges, time), flow.mean_velocity(edges, time), flow.mean_density(edges, time))
    return Fields(*(np.broadcast_to(mean[:, None, None], domain.cells) for mean in means))


def radial_means(flow: ExactFlow, domain: Domain, time: float, dimensions: int) -> Fields:
    """Cell means of a flow around the z axis (2) or the origin (3), each (nx, ny, nz), by midpoints in each cell."""
    parts = (np.arange(MIDPOINTS) + 0.5) / MIDPOINTS
    fine = [(np.arange(n)[:, None] + parts).reshape(-1) * h for n, h in zip(domain.cells, domain.spacing, strict=True)]
    x, y, z = (low + along for low, along in zip(domain.lower, fine, strict=True))
    if dimensions == 2:
        z = np.zeros(domain.cells[2])  # the flow is the same at every z
    result = Fields(*(np.empty(domain.cells) for _ in FIELD_NAMES))
    per_cell = len(z) // domain.cells[2]
    for layer in range(domain.cells[0]):  # one at a time: all midpoints at once would fill the memory
        here = x[layer * MIDPOINTS : (layer + 1) * MIDPOINTS]
        radius = np.sqrt(here[:, None, None] ** 2 + y[None, :, None] ** 2 + z**2)
        for name in FIELD_NAMES:
            values = getattr(flow, name)(radius, time)
            cells = values.reshape(MIDPOINTS, domain.cells[1], MIDPOINTS, domain.cells[2], per_cell)
            getattr(result, name)[layer] = cells.mean(axis=(0, 2, 4))
    return result


# ---- both ------------------------------------------------------------------------------------------------------------


def field_errors(computed: Fields, exact: Fields) -> dict[str, FieldError]:
    """Distances of the three fields from the exact ones."""
    return {name: field_error(getattr(computed, name), getattr(exact, name)) for name in FIELD_NAMES}


def pressure_error(state: State, exact: PlanarFlow, time: float) -> float:
    """L1 error of the field pressure against an exact flow along x."""
    domain = state.model.scene.domain
    expected = exact.mean_pressure(edges_of(domain), time)[:, None, None]
    return relative_l1(cell_pressure(state), np.broadcast_to(expected, domain.cells))


def planar_curves(computed: Fields, domain: Domain) -> dict[str, Curve]:
    """The three fields along x at the cells' centres, means over the cross-section; where that is empty no velocity."""
    lines = {name: getattr(computed, name).mean(axis=(1, 2)) for name in FIELD_NAMES}
    return _curves(domain.centres(0), lines)


def radial_curves(computed: Fields, domain: Domain, dimensions: int) -> dict[str, Curve]:
    """The three fields along the radius: means over shells one cell thick, as far as these are whole."""
    radius = np.broadcast_to(cell_radii(domain, dimensions), domain.cells)
    whole = radius < min(domain.upper[:dimensions])
    shell = (radius[whole] / max(domain.spacing)).astype(int)
    _, shell, count = np.unique(shell, return_inverse=True, return_counts=True)

    def means(values: np.ndarray) -> np.ndarray:
        return np.bincount(shell, values[whole]) / count

    return _curves(means(radius), {name: means(getattr(computed, name)) for name in FIELD_NAMES})


def _curves(place: np.ndarray, lines: dict[str, np.ndarray]) -> dict[str, Curve]:
    """The fields as curves: without matter the velocity has a gap."""
    lines["velocity"] = np.where(lines["density"] > 0.0, lines["velocity"], np.nan)
    return {name: Curve(place, line) for name, line in lines.items()}


def exact_curves(flow: ExactFlow, position: np.ndarray, time: float) -> dict[str, Curve]:
    """The three exact fields at positions (n,) [m]."""
    return {name: Curve(position, getattr(flow, name)(position, time)) for name in FIELD_NAMES}
