"""Lines that show what is no point: where a detonator is, as polylines in space."""

import numpy as np

from warp_mpm.detonators import CordDetonator, Detonator, LineDetonator, PlaneDetonator, SphereDetonator, segments

SIDES = 64  # of the polygon that stands for a circle
SLACK = 1e-6  # of a box's edges
CORNERS = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)])  # of a box, in its edges


def outlines(detonator: Detonator, box: np.ndarray, towards: np.ndarray) -> list[np.ndarray]:
    """Polylines (n, 3) [m] that show a detonator; none for a point.

    Args:
        detonator: what is shown.
        box: its lower and upper corner (2, 3) [m]: a plane is shown where it cuts it, if it does.
        towards: directions (k, 3), unit vectors, each of which sees one circle as a sphere's outline.
    """
    if isinstance(detonator, LineDetonator | CordDetonator):
        pieces = segments(detonator)
        return [np.array([pieces[0][0], *(end for _, end, _, _ in pieces)])]
    if isinstance(detonator, PlaneDetonator):
        wider = box + SLACK * np.array([box[0] - box[1], box[1] - box[0]])  # a plane on a face is in it
        polygon = plane_in_box(np.array(detonator.position), np.array(detonator.normal), wider)
        return [np.vstack([polygon, polygon[:1]])] if len(polygon) else []
    if isinstance(detonator, SphereDetonator):
        return [circle(np.array(detonator.center), detonator.radius, normal) for normal in towards]
    return []


def lit_part(detonator: Detonator, outline: np.ndarray, time: float) -> np.ndarray:
    """What of an outline (n, 3) of a detonator has been lit at a time [s]: of a cord as far as it has burnt, (m, 3)."""
    if detonator.time > time:
        return outline[:0]
    if not isinstance(detonator, CordDetonator):
        return outline
    burnt = [outline[0]]
    for start, end, lit, burnt_down in segments(detonator):
        share = np.clip((time - lit) / (burnt_down - lit), 0.0, 1.0)
        if share > 0.0:
            burnt.append(start + share * (end - start))
    return np.array(burnt)


def circle(center: np.ndarray, radius: float, normal: np.ndarray) -> np.ndarray:
    """A closed polygon (n, 3) [m] around a unit normal."""
    first = np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))])
    first /= np.linalg.norm(first)
    angle = np.linspace(0.0, 2.0 * np.pi, SIDES + 1)[:, None]
    return center + radius * (np.cos(angle) * first + np.sin(angle) * np.cross(normal, first))


def plane_in_box(point: np.ndarray, normal: np.ndarray, box: np.ndarray) -> np.ndarray:
    """The polygon (n, 3) in which a plane cuts a box (2, 3); empty if it does not."""
    lower, upper = box
    cuts = []
    for axis in range(3):
        for start in (lower + CORNERS * (upper - lower))[CORNERS[:, axis] == 0]:
            end = start.copy()
            end[axis] = upper[axis]
            from_plane = normal @ (start - point), normal @ (end - point)
            if from_plane[0] * from_plane[1] <= 0.0 and from_plane[0] != from_plane[1]:
                cuts.append(start + from_plane[0] / (from_plane[0] - from_plane[1]) * (end - start))
    if len(cuts) < 3:
        return np.empty((0, 3))
    around = np.array(cuts) - np.mean(cuts, axis=0)
    first = np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))])
    angle = np.arctan2(around @ np.cross(normal, first) / np.linalg.norm(normal), around @ first)
    return np.array(cuts)[np.argsort(angle)]
