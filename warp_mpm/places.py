"""Where a run is recorded: points along the front path and the line, nodes of the section."""

from dataclasses import dataclass

import numpy as np

from warp_mpm.scene import Domain, Scene, Segment


@dataclass(frozen=True)
class Places:
    """The places of a scene, [m]; or when the detonation comes to each of them, [s]."""

    path: np.ndarray  # (points, ...)
    line: np.ndarray  # (points, ...)
    section: np.ndarray  # (nodes_u, nodes_v, ...)

    @property
    def joined(self) -> np.ndarray:
        """All of them, one after the other, (n, 3)."""
        return np.concatenate([self.path, self.line, self.section.reshape(-1, 3)])

    def parted(self, values: np.ndarray) -> "Places":
        """Values (n,) at all of the places, by place again."""
        cuts = np.cumsum([len(self.path), len(self.line)])
        path, line, section = np.split(values, cuts)
        return Places(path, line, section.reshape(self.section.shape[:2]))


def recorded_places(scene: Scene) -> Places:
    """Where a scene is recorded [m]."""
    return Places(
        sample_points(scene.domain, scene.front_path), sample_points(scene.domain, scene.line), section_nodes(scene)
    )


def sample_points(domain: Domain, segment: Segment | None) -> np.ndarray:
    """Points along a segment, (n, 3) [m], about one a cell; none without a segment."""
    if segment is None:
        return np.empty((0, 3))
    return segment.points(max(2, round(segment.length / min(domain.spacing)) + 1))


def section_nodes(scene: Scene) -> np.ndarray:
    """The nodes of the section plane (nodes_u, nodes_v, 3) [m]."""
    domain = scene.domain
    u, v = (np.linspace(domain.lower[a], domain.upper[a], domain.cells[a] + 1) for a in scene.section.in_plane)
    plane = np.full((len(u), len(v), 3), scene.section.coordinate)
    first, second = scene.section.in_plane
    plane[..., first], plane[..., second] = u[:, None], v[None, :]
    return plane


def cells_of(domain: Domain, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Cell (n, 3) and fraction of the cell (n, 3) of points in the domain."""
    place = (points - domain.lower) / domain.spacing
    cell = np.clip(np.floor(place), 0, np.array(domain.cells) - 1)
    return cell.astype(int), np.clip(place - cell, 0.0, 1.0)
