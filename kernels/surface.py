"""Signed distances to closed surfaces of triangles, in single precision whatever the simulation's, and self-cuts.

The sign is that of the angle-weighted normal at the nearest point: Baerentzen and Aanaes, Signed distance computation
using the angle weighted pseudonormal, IEEE TVCG 11(3), 2005.
"""

import warp as wp

from warp_mpm.kernels.precision import single, single_vector3

EDGE = wp.constant(single(1.0e-6))  # share of a vertex in a point of a face below which it is none

TOUCHING = wp.constant(wp.float64(1.0e-7))  # of the surface's size: what goes in less deep only touches

# Where the outward normals of a face and of what bounds it are, after one another.
NORMALS = wp.constant(7)
FACE, FIRST_EDGE, FIRST_VERTEX = wp.constant(0), wp.constant(1), wp.constant(4)


@wp.func
def feature(u: single, v: single, w: single) -> int:
    """What of a face a point with these shares of its three vertices lies on: the place of its normal.

    Edge k runs from vertex k to the next one.
    """
    found = int(FACE)
    if w < EDGE:
        found = FIRST_EDGE
    if u < EDGE:
        found = FIRST_EDGE + 1
    if v < EDGE:
        found = FIRST_EDGE + 2
    if v < EDGE and w < EDGE:
        found = FIRST_VERTEX
    if w < EDGE and u < EDGE:
        found = FIRST_VERTEX + 1
    if u < EDGE and v < EDGE:
        found = FIRST_VERTEX + 2
    return found


@wp.kernel(enable_backward=False)
def signed_distances(
    surface: wp.uint64,
    normals: wp.array(dtype=single_vector3),
    reach: single,
    points: wp.array(dtype=single_vector3),
    distances: wp.array(dtype=single),
):
    """Distance of each point to the surface, negative inside, in the surface's own unit; none exceeds `reach`.

    Warp's own sign adds up the normals of all places that are equally near, which fails on the axis of a round body.
    """
    i = wp.tid()
    point = points[i]
    nearest = wp.mesh_query_point_no_sign(surface, point, reach)
    distance = reach
    if nearest.result:
        away = point - wp.mesh_eval_position(surface, nearest.face, nearest.u, nearest.v)
        place = feature(nearest.u, nearest.v, single(1.0) - nearest.u - nearest.v)
        distance = wp.length(away)
        if wp.dot(away, normals[nearest.face * NORMALS + place]) < single(0.0):
            distance = -distance
    distances[i] = distance


@wp.func
def share_vertex(a: wp.vec3i, b: wp.vec3i) -> bool:
    """Whether two faces, by the indices of their vertices, have one in common."""
    shared = bool(False)
    for i in range(3):
        for j in range(3):
            shared = shared or a[i] == b[j]
    return shared


@wp.func
def corners(surface: wp.uint64, face: int) -> wp.vec3i:
    """Indices of the vertices of a face."""
    return wp.vec3i(
        wp.mesh_get_index(surface, 3 * face),
        wp.mesh_get_index(surface, 3 * face + 1),
        wp.mesh_get_index(surface, 3 * face + 2),
    )


@wp.func
def pierces(a: wp.vec3d, b: wp.vec3d, p: wp.vec3d, q: wp.vec3d, r: wp.vec3d) -> bool:
    """Whether the straight line from a to b goes through the triangle pqr, not only to it."""
    normal = wp.cross(q - p, r - p)
    depth = TOUCHING * wp.length(normal)
    before, behind = wp.dot(a - p, normal), wp.dot(b - p, normal)
    through = (before > depth and behind < -depth) or (before < -depth and behind > depth)
    along = b - a
    first = wp.dot(along, wp.cross(p - a, q - a))
    second = wp.dot(along, wp.cross(q - a, r - a))
    third = wp.dot(along, wp.cross(r - a, p - a))
    zero = wp.float64(0.0)
    within = (first >= zero and second >= zero and third >= zero) or (
        first <= zero and second <= zero and third <= zero
    )
    return through and within


@wp.kernel(enable_backward=False)
def find_cuts(surface: wp.uint64, vertices: wp.array(dtype=wp.vec3d), cuts: wp.array(dtype=wp.int32)):
    """How many faces the edges of each face go through; neighbours, which share a vertex, do not count."""
    face = wp.tid()
    mesh = wp.mesh_get(surface)
    own = corners(surface, face)
    p, q, r = mesh.points[own[0]], mesh.points[own[1]], mesh.points[own[2]]
    query = wp.mesh_query_aabb(surface, wp.min(wp.min(p, q), r), wp.max(wp.max(p, q), r))
    other = int(0)
    count = int(0)
    while wp.mesh_query_aabb_next(query, other):
        theirs = corners(surface, other)
        if other != face and not share_vertex(own, theirs):
            a, b, c = vertices[theirs[0]], vertices[theirs[1]], vertices[theirs[2]]
            for k in range(3):
                if pierces(vertices[own[k]], vertices[own[(k + 1) % 3]], a, b, c):
                    count += 1
    cuts[face] = count
