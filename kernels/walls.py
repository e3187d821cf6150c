"""Walls as mirrors: what a stencil left behind a wall is folded back, and the result is mirrored into the ghosts.

A stencil reaches one node past a wall. That ghost's image is the first node inside; a node owns itself and its ghosts,
up to one behind each wall next to it, in every combination of axes. Behind a slip wall the normal component of a
vector changes sign, behind a stick wall all components do; what changes sign vanishes on the wall itself. This holds
for every nodal quantity, so half of a symmetric problem against a slip wall is exactly the whole problem.

An *image* of a node is named by its `sides`: per axis -1 for the node itself, 0 or 1 for its ghost behind the low or
high face.
"""

import warp as wp

from warp_mpm.kernels.precision import HALF, ONE, TWO, ZERO, scalar, vector3
from warp_mpm.kernels.records import Grid, node_index

WALL_OPEN = wp.constant(0)
WALL_SLIP = wp.constant(1)
WALL_STICK = wp.constant(2)

REACTIONS = 18  # tally lanes: force on the material (3) [N] by each of the six faces


@wp.struct
class Boundary:
    """The faces of the domain, in the order x low, x high, y low, y high, z low, z high; and the body force."""

    wall: wp.types.vector(6, wp.int32)  # WALL_OPEN, WALL_SLIP or WALL_STICK
    gravity: vector3  # [m/s2]


@wp.func
def wall_on(boundary: Boundary, cells: wp.vec3i, axis: int, index: int) -> int:
    """The wall on which a node lies along an axis; WALL_OPEN if on none."""
    wall = int(WALL_OPEN)
    if index == 0:
        wall = boundary.wall[2 * axis]
    if index == cells[axis]:
        wall = boundary.wall[2 * axis + 1]
    return wall


@wp.func
def mirrored_sides(boundary: Boundary, last: wp.vec3i, index: wp.vec3i, inset: int) -> wp.vec3i:
    """Per axis, behind which walls a place has a ghost: 1 the low one, 2 the high one, 3 both.

    Places are numbered 0 to `last`; a ghost's image is `inset` places in: 1 for nodes, which may lie on a wall, else 0.
    """
    sides = wp.vec3i()
    for axis in range(3):
        if index[axis] == inset and boundary.wall[2 * axis] != WALL_OPEN:
            sides[axis] = sides[axis] + 1
        if index[axis] == last[axis] - inset and boundary.wall[2 * axis + 1] != WALL_OPEN:
            sides[axis] = sides[axis] + 2
    return sides


@wp.func
def in_front_of_walls(boundary: Boundary, last: wp.vec3i, index: wp.vec3i) -> bool:
    """Whether a place is no ghost behind a wall; places beyond open faces are none."""
    in_front = True
    for axis in range(3):
        if index[axis] < 0 and boundary.wall[2 * axis] != WALL_OPEN:
            in_front = False
        if index[axis] > last[axis] and boundary.wall[2 * axis + 1] != WALL_OPEN:
            in_front = False
    return in_front


@wp.func
def ghost_sides(boundary: Boundary, cells: wp.vec3i, node: wp.vec3i) -> wp.vec3i:
    """Per axis, which ghosts a node owns: 1 behind the low face, 2 behind the high one, 3 both."""
    return mirrored_sides(boundary, cells, node, 1)


@wp.func
def is_owner(boundary: Boundary, cells: wp.vec3i, node: wp.vec3i) -> bool:
    """Whether a node stands for itself: ghosts behind walls do not, nodes beyond open faces do."""
    return in_front_of_walls(boundary, cells, node)


@wp.func
def free_components(boundary: Boundary, cells: wp.vec3i, node: wp.vec3i) -> vector3:
    """0 for the components that a wall holds at a node on it, 1 for the free ones."""
    free = vector3(ONE, ONE, ONE)
    for axis in range(3):
        wall = wall_on(boundary, cells, axis, node[axis])
        if wall == WALL_SLIP:
            free[axis] = ZERO
        if wall == WALL_STICK:
            free = vector3()
    return free


@wp.func
def holds_any(free: vector3) -> bool:
    """Whether a wall holds any component at a node, by its free ones."""
    return free[0] * free[1] * free[2] == ZERO


@wp.func
def meets_wall(boundary: Boundary, cells: wp.vec3i, node: wp.vec3i) -> bool:
    """Whether a node lies on a wall or owns a ghost behind one."""
    meets = False
    for axis in range(3):
        if node[axis] <= 1 and boundary.wall[2 * axis] != WALL_OPEN:
            meets = True
        if node[axis] >= cells[axis] - 1 and boundary.wall[2 * axis + 1] != WALL_OPEN:
            meets = True
    return meets


@wp.func
def image_count(owned: int) -> int:
    """Images of a node along an axis: itself and the ghosts it owns there."""
    return 1 + (owned & 1) + (owned >> 1)


@wp.func
def side_of(owned: int, image: int) -> int:
    """Side of image number 0 (the node), 1 or 2 (its ghosts) along an axis."""
    side = -1
    if image == 1 and (owned & 1) != 0:
        side = 0
    elif image >= 1:
        side = 1
    return side


@wp.func
def image_sides(owned: wp.vec3i, i: int, j: int, k: int) -> wp.vec3i:
    """Sides of image (i, j, k) of a node."""
    return wp.vec3i(side_of(owned[0], i), side_of(owned[1], j), side_of(owned[2], k))


@wp.func
def image_index(last: wp.vec3i, index: wp.vec3i, sides: wp.vec3i) -> wp.vec3i:
    """Index of an image of a place; places are numbered 0 to `last`."""
    image = wp.vec3i(index[0], index[1], index[2])
    for axis in range(3):
        if sides[axis] == 0:
            image[axis] = -1
        if sides[axis] == 1:
            image[axis] = last[axis] + 1
    return image


@wp.func
def image_node(grid: Grid, node: wp.vec3i, sides: wp.vec3i) -> int:
    """Flat index of an image."""
    image = image_index(grid.cells, node, sides)
    return node_index(grid, image[0], image[1], image[2])


@wp.func
def image_signs(boundary: Boundary, sides: wp.vec3i) -> vector3:
    """Signs that a vector's components take at an image."""
    signs = vector3(ONE, ONE, ONE)
    for axis in range(3):
        if sides[axis] >= 0:
            if boundary.wall[2 * axis + sides[axis]] == WALL_STICK:
                signs = -signs
            else:
                signs[axis] = -signs[axis]
    return signs


@wp.func
def acting_face(boundary: Boundary, cells: wp.vec3i, node: wp.vec3i, sides: wp.vec3i, component: int) -> int:
    """The face whose wall acts on a component of an image: the one behind which it lies, else the one it lies on."""
    face = -1
    for axis in range(3):
        nearer = axis == component or face < 0  # a slip wall acts on its normal alone
        wall = wall_on(boundary, cells, axis, node[axis])
        if nearer and (wall == WALL_STICK or (wall == WALL_SLIP and axis == component)):
            face = wp.where(node[axis] == 0, 2 * axis, 2 * axis + 1)
    for axis in range(3):
        if sides[axis] >= 0:
            wall = boundary.wall[2 * axis + sides[axis]]
            if wall == WALL_STICK or axis == component:
                face = 2 * axis + sides[axis]
    return face


@wp.func
def tally_reaction(
    boundary: Boundary,
    grid: Grid,
    node: wp.vec3i,
    sides: wp.vec3i,
    free: vector3,
    scattered: vector3,
    body: vector3,
    value: vector3,
    reactions: wp.array(dtype=wp.float64),
    slot: int,
):
    """Tally what walls add to the momentum that an image gives back to the particles; `free` are the node's components.

    The image received `scattered` (a force f, or a momentum), `body` acts on it besides (M g), and it gives back
    `value`, its mass times the owner's nodal value. Summed over a node's images the difference is -2 (value +
    scattered) where a wall reverses a component, and -(scattered + body) where it holds one.
    """
    signs = image_signs(boundary, sides)
    for component in range(3):
        reaction = ZERO
        if free[component] == ZERO:
            reaction = -(scattered[component] + body[component])
        elif signs[component] < ZERO:
            reaction = -TWO * (value[component] + scattered[component])
        if reaction != ZERO:
            face = acting_face(boundary, grid.cells, node, sides, component)
            wp.atomic_add(reactions, slot * REACTIONS + 3 * face + component, wp.float64(reaction))


@wp.func
def node_volume(grid: Grid, node: wp.vec3i) -> scalar:
    """The node's share of the domain [m3]: halved on every face it lies on; beyond a face a whole cell."""
    volume = grid.spacing[0] * grid.spacing[1] * grid.spacing[2]
    for axis in range(3):
        if node[axis] == 0 or node[axis] == grid.cells[axis]:
            volume = HALF * volume
    return volume
