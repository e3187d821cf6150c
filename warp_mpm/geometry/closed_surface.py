"""Whether triangles make a closed surface, and what it encloses."""

import numpy as np

from warp_mpm.checks import mistake

SAME_PLACE = 1e-6  # of the size: vertices that are nearer are one
MOST_COMPARED = 300_000_000  # pairs of a vertex and a face: seconds
AT_ONCE = 5_000_000  # of them
SHORTEST = 1e-15  # vector that has a direction: vertices are given in units of the size


def merged(where: str, vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The surface with one vertex at each place, without faces of which nothing is left and vertices of no face.

    Args:
        where: start of the error messages.
        vertices: (n, 3) [m].
        faces: indices of vertices (m, 3).

    Raises:
        InputError: no face is left.
    """
    size = float(np.ptp(vertices[faces.ravel()], axis=0).max())
    if size > 0.0:
        places = np.round((vertices - vertices.min(axis=0)) / (SAME_PLACE * size))
        _, first, same = np.unique(places, axis=0, return_index=True, return_inverse=True)
        faces = first[same.reshape(-1)][faces]
        a, b, c = faces.T
        faces = faces[(a != b) & (b != c) & (c != a)]
    if size == 0.0 or len(faces) == 0:
        raise mistake(where, "a surface that encloses a volume", "triangles without extent", "export the model again")
    used, indices = np.unique(faces, return_inverse=True)
    return vertices[used], indices.reshape(-1, 3).astype(np.int32)


def check_closed(where: str, vertices: np.ndarray, faces: np.ndarray) -> None:
    """Check that two faces meet at every edge, and agree which side of them is outside.

    Args:
        where: start of the error messages.
        vertices: (n, 3) [m].
        faces: indices of vertices (m, 3).

    Raises:
        InputError: they do not.
    """
    ends = faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    first, which = _edges(ends)
    count = np.bincount(which)
    balance = np.bincount(which, weights=np.where(ends[:, 0] < ends[:, 1], 1.0, -1.0))  # 0 if both run opposite ways
    for wrong, got, remedy in (
        (count == 1, "open edges", "close its holes"),
        (count > 2, "edges at which more than two faces meet", "remove inner faces, or part what only touches"),
        (balance != 0.0, "edges whose faces disagree which side is outside", "make its normals consistent"),
    ):
        if wrong.any():
            place = ", ".join(f"{value:g}" for value in vertices[ends[first[np.argmax(wrong)]]].mean(axis=0))
            expected = "a closed surface, each edge shared by two faces"
            raise mistake(where, expected, f"{np.count_nonzero(wrong)} {got}, the first near ({place}) m", remedy)


def enclosed_volume(vertices: np.ndarray, faces: np.ndarray) -> float:
    """Volume [m3] within a closed surface, negative if its faces look inwards.

    By the divergence theorem it is the sum of the tetrahedra from the origin to each face, a . (b x c) / 6.
    """
    a, b, c = (vertices[corner] for corner in faces.T)
    return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6.0


def is_convex(vertices: np.ndarray, faces: np.ndarray) -> bool:
    """Whether no vertex lies before the plane of any face, by more than `SAME_PLACE`; not if that takes long to find.

    Args:
        vertices: (n, 3), in units of the size.
        faces: indices of vertices (m, 3).
    """
    if len(vertices) * len(faces) > MOST_COMPARED:
        return False
    a, b, c = (vertices[corner] for corner in faces.T)
    normals = _unit(np.cross(b - a, c - a))
    at = np.einsum("ij,ij->i", normals, a)
    step = max(1, AT_ONCE // len(vertices))
    starts = range(0, len(faces), step)
    return all(np.max(normals[k : k + step] @ vertices.T - at[k : k + step, None]) <= SAME_PLACE for k in starts)


def outward_normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Normals (m, 7, 3), of any length, of each face, its edges and its vertices; edge k starts at vertex k.

    A point is inside where its way from what is nearest runs against the normal of that: of an edge the sum of those of
    its faces, of a vertex their sum weighted with angles (Baerentzen and Aanaes 2005). A face without area has that of
    its vertices.
    """
    corners = vertices[faces]
    sides = np.roll(corners, -1, axis=1) - corners  # side k starts at vertex k
    normal = _unit(np.cross(sides[:, 0], sides[:, 1]))
    cosine = np.einsum("ijk,ijk->ij", _unit(sides), -_unit(np.roll(sides, 1, axis=1)))
    angle = np.arccos(np.clip(cosine, -1.0, 1.0))
    at_vertex = np.zeros_like(vertices)
    np.add.at(at_vertex, faces, angle[:, :, None] * normal[:, None, :])
    _, which = _edges(np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2))
    at_edge = np.zeros((which.max() + 1, 3))
    np.add.at(at_edge, which, np.repeat(normal, 3, axis=0))
    of_vertices, of_edges = at_vertex[faces], at_edge[which.reshape(-1, 3)]
    of_face = np.where(normal.any(axis=1, keepdims=True), normal, of_vertices.sum(axis=1))
    return np.concatenate([of_face[:, None], of_edges, of_vertices], axis=1)


def _edges(ends: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Which edges there are, by the first side of a face (n, 2) on each, and which of them each side lies on."""
    low, high = ends.min(axis=1).astype(np.int64), ends.max(axis=1)
    _, first, which = np.unique(low * (int(high.max()) + 1) + high, return_index=True, return_inverse=True)
    return first, which.reshape(-1)


def _unit(vectors: np.ndarray) -> np.ndarray:
    """Vectors (..., 3) of length 1; those of no length stay so."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=length > SHORTEST)
