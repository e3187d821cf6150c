"""The grid's part of the step: sums of the scatter into velocity, acceleration and field pressure (paper eq. 9).

One thread owns a node and its ghosts behind walls (see `walls.py`), so nothing is written twice and the order of the
sums is fixed. Ghost masses stay as they were scattered.
"""

import functools

import warp as wp

from warp_mpm.kernels.content import inside, solve_cell, stands_for_itself
from warp_mpm.kernels.node_pass import Phase, node_kernel
from warp_mpm.kernels.precision import HALF, ONE, TWO, ZERO, scalar, vector2, vector3, vector4, vector8
from warp_mpm.kernels.records import Clock, Grid, node_index, raise_maximum
from warp_mpm.kernels.vectors import first_three, second_three
from warp_mpm.kernels.walls import (
    Boundary,
    free_components,
    ghost_sides,
    image_count,
    image_node,
    image_sides,
    image_signs,
    is_owner,
    node_volume,
    tally_reaction,
)


@wp.func
def empty(grid: Grid, n: int):
    """Empty a node, and the cell of its index."""
    grid.node[n] = vector8()
    grid.field[n] = vector2()
    grid.content[n] = vector2()
    grid.reprojected[n] = vector4()
    if grid.kick.shape[0] > 0:
        grid.kick[n] = vector8()


@wp.func
def clear_node(grid: Grid, boundary: Boundary, now: Clock, phase: Phase, slot: int, index: wp.vec3i):
    """Empty a node, wherever it is; a ghost may hold values without having been scattered to."""
    empty(grid, node_index(grid, index[0], index[1], index[2]))


@wp.func
def clear_inside(grid: Grid, boundary: Boundary, now: Clock, phase: Phase, slot: int, n: int):
    """Empty a node that was scattered to; every stencil that reaches a cell reaches the node of its index."""
    if grid.node[n][3] != ZERO:
        empty(grid, n)


def clear_kernel() -> wp.Kernel:
    """Empty the nodes of the blocks that the last scatter, one step ago, wrote to."""
    return node_kernel(clear_node, clear_inside, 1)


@wp.func
def beyond_face(grid: Grid, index: wp.vec3i) -> bool:
    """Whether a node lies outside the domain."""
    beyond = False
    for axis in range(3):
        if index[axis] < 0 or index[axis] > grid.cells[axis]:
            beyond = True
    return beyond


@wp.func
def occupied_volume(grid: Grid, index: wp.vec3i, filling: scalar) -> scalar:
    """Volume that a node's content is related to [m3].

    Inside the material it is that of the particles, so that the field is a mean of what they have, however they lie; at
    a free surface it is the node's own, so that the field fades towards the vacuum.
    """
    share = inside(filling)
    return node_volume(grid, index) * (share * filling + ONE - share)


@wp.func
def fold(grid: Grid, boundary: Boundary, index: wp.vec3i, owned: wp.vec3i) -> vector8:
    """Sum of a node and its ghosts, with the signs of their walls."""
    total = vector8()
    for i in range(image_count(owned[0])):
        for j in range(image_count(owned[1])):
            for k in range(image_count(owned[2])):
                sides = image_sides(owned, i, j, k)
                s = image_signs(boundary, sides)
                x = grid.node[image_node(grid, index, sides)]
                total += vector8(
                    s[0] * x[0], s[1] * x[1], s[2] * x[2], x[3], s[0] * x[4], s[1] * x[5], s[2] * x[6], x[7]
                )
    return total


@wp.func
def fold_field(grid: Grid, index: wp.vec3i, owned: wp.vec3i) -> vector2:
    """Sums of w V p and w m c^2 [J] of a node and its ghosts."""
    total = vector2()
    for i in range(image_count(owned[0])):
        for j in range(image_count(owned[1])):
            for k in range(image_count(owned[2])):
                total += grid.field[image_node(grid, index, image_sides(owned, i, j, k))]
    return total


@wp.func
def tally_walls(
    grid: Grid,
    boundary: Boundary,
    index: wp.vec3i,
    owned: wp.vec3i,
    force: bool,
    total_mass: scalar,
    share: scalar,
    value: vector3,
    reactions: wp.array(dtype=wp.float64),
    slot: int,
):
    """Tally what walls add to a node and its ghosts: of the forces, or of a share of the momenta.

    `total_mass` is that of the node and its ghosts, whose whole weight counts at the node.
    """
    for i in range(image_count(owned[0])):
        for j in range(image_count(owned[1])):
            for k in range(image_count(owned[2])):
                sides = image_sides(owned, i, j, k)
                x = grid.node[image_node(grid, index, sides)]
                mass = x[3]
                scattered = first_three(x)
                body = vector3()
                if force:
                    scattered = second_three(x)
                    if i + j + k == 0:
                        body = total_mass * boundary.gravity
                tally_reaction(
                    boundary, grid, index, sides, share * scattered, body, share * mass * value, reactions, slot
                )


@wp.func
def mirror(
    grid: Grid,
    boundary: Boundary,
    index: wp.vec3i,
    owned: wp.vec3i,
    velocity: vector3,
    acceleration: vector3,
    filling: scalar,
    field: vector2,
):
    """Write a node's values into its ghosts; their blocks are stamped with the stencil's, so they are cleared too."""
    for i in range(image_count(owned[0])):
        for j in range(image_count(owned[1])):
            for k in range(image_count(owned[2])):
                if i + j + k > 0:
                    sides = image_sides(owned, i, j, k)
                    s = image_signs(boundary, sides)
                    m = image_node(grid, index, sides)
                    v = wp.cw_mul(s, velocity)
                    a = wp.cw_mul(s, acceleration)
                    grid.node[m] = vector8(v[0], v[1], v[2], grid.node[m][3], a[0], a[1], a[2], filling)
                    grid.field[m] = field


@functools.cache
def solve_kernel(momentum: bool, force: bool, cells: bool) -> wp.Kernel:
    """Sums of the scatter -> values: v = P / M, a = f / M + g; filling = V / V_i; the field pressure, sum w V p over
    the occupied volume, and the sound speed, c^2 = sum w m c^2 / M. `cells` solves their content.
    `momentum` solves the first, `force` the second (all at once but for USF, whose forces come later). Tallies what
    walls add: `reactions` to forces [N], `impulses` to momenta [kg m/s], the latter for PIC and APIC, whose particles
    take the nodes' velocity over with a share of `pic_share`. The highest pressure of nodes at least half filled
    inside the domain goes to `peaks`.
    """

    @wp.func
    def solve_node(
        grid: Grid,
        boundary: Boundary,
        phase: Phase,
        slot: int,
        index: wp.vec3i,
    ):
        n = node_index(grid, index[0], index[1], index[2])
        own = grid.node[n]
        total = own
        sums = grid.field[n]
        owned = ghost_sides(boundary, grid.cells, index)
        ghosts = owned[0] + owned[1] + owned[2] > 0
        free = free_components(boundary, grid.cells, index)
        if ghosts:
            total = fold(grid, boundary, index, owned)
            sums = fold_field(grid, index, owned)
        mass = total[3]
        filling = total[7] / node_volume(grid, index)
        velocity = first_three(own)
        if wp.static(not momentum):  # solved before the forces came
            mass = own[3]
            filling = own[7]
        inverse = wp.where(mass > grid.light_mass, ONE / mass, ZERO)
        if wp.static(momentum):
            velocity = wp.cw_mul(free, first_three(total)) * inverse
        acceleration = vector3()
        pressure = ZERO
        if wp.static(force) and mass > grid.light_mass:
            acceleration = wp.cw_mul(free, second_three(total) * inverse + boundary.gravity)
            pressure = sums[0] / occupied_volume(grid, index, filling)
            if not beyond_face(grid, index):
                if filling >= HALF:
                    raise_maximum(phase.peaks, slot, pressure)
            elif filling > ZERO:
                pressure = sums[0] / (node_volume(grid, index) * filling)
        field = vector2(pressure, wp.sqrt(sums[1] * inverse))
        if ghosts or free[0] * free[1] * free[2] == ZERO:
            if wp.static(force):
                tally_walls(grid, boundary, index, owned, True, mass, ONE, acceleration, phase.reactions, slot)
            if wp.static(momentum) and phase.pic_share > ZERO:
                tally_walls(grid, boundary, index, owned, False, mass, phase.pic_share, velocity, phase.impulses, slot)
            mirror(grid, boundary, index, owned, velocity, acceleration, filling, field)
        grid.node[n] = vector8(
            velocity[0], velocity[1], velocity[2], mass, acceleration[0], acceleration[1], acceleration[2], filling
        )
        grid.field[n] = field

    @wp.func
    def visit(grid: Grid, boundary: Boundary, now: Clock, phase: Phase, slot: int, index: wp.vec3i):
        if is_owner(boundary, grid.cells, index):
            solve_node(grid, boundary, phase, slot, index)
        if wp.static(cells) and stands_for_itself(boundary, grid.cells, index):
            solve_cell(grid, boundary, index)

    @wp.func
    def visit_inside(grid: Grid, boundary: Boundary, now: Clock, phase: Phase, slot: int, n: int):
        node = grid.node[n]
        mass = node[3]
        if mass == ZERO:
            return
        per_volume = grid.inverse_spacing[0] * grid.inverse_spacing[1] * grid.inverse_spacing[2]
        if wp.static(cells):
            grid.content[n] = per_volume * grid.content[n]
        inverse = wp.where(mass > grid.light_mass, ONE / mass, ZERO)
        velocity = first_three(node)
        filling = node[7]
        if wp.static(momentum):
            velocity = inverse * velocity
            filling = per_volume * filling
        acceleration = vector3()
        if wp.static(force):
            if mass > grid.light_mass:
                acceleration = inverse * second_three(node) + boundary.gravity
            share = inside(filling)
            sums = grid.field[n]
            pressure = inverse * mass * per_volume * sums[0] / (share * filling + ONE - share)
            grid.field[n] = vector2(pressure, wp.sqrt(inverse * sums[1]))
            if filling >= HALF:
                raise_maximum(phase.peaks, slot, pressure)
        grid.node[n] = vector8(
            velocity[0], velocity[1], velocity[2], mass, acceleration[0], acceleration[1], acceleration[2], filling
        )

    return node_kernel(visit, visit_inside, 0)


@wp.func
def node_density(grid: Grid, index: wp.vec3i) -> scalar:
    """Density at a node of the domain [kg/m3]: mass over the occupied volume, as the field pressure."""
    node = grid.node[node_index(grid, index[0], index[1], index[2])]
    return node[3] / occupied_volume(grid, index, node[7])


@wp.kernel(enable_backward=False)
def measure_density(grid: Grid, density: wp.array3d(dtype=scalar)):
    """Density at the nodes of the domain [kg/m3]."""
    i, j, k = wp.tid()
    density[i, j, k] = node_density(grid, wp.vec3i(i, j, k))


@wp.func
def fold_reprojected(grid: Grid, boundary: Boundary, index: wp.vec3i, owned: wp.vec3i) -> vector4:
    """Sum of a node's re-projected momentum and kinetic energy and those of its ghosts."""
    total = vector4()
    for i in range(image_count(owned[0])):
        for j in range(image_count(owned[1])):
            for k in range(image_count(owned[2])):
                sides = image_sides(owned, i, j, k)
                s = image_signs(boundary, sides)
                x = grid.reprojected[image_node(grid, index, sides)]
                total += vector4(s[0] * x[0], s[1] * x[1], s[2] * x[2], x[3])
    return total


@wp.func
def damped_share(now: Clock, sound_speed: scalar) -> scalar:
    """Alpha of a node: k s / (1 + k s), s the cells that sound crosses in the step."""
    crossing = now.damping * sound_speed
    return crossing / (ONE + crossing)


@functools.cache
def solve_reprojected_kernel(sharpened: bool, damped: bool) -> wp.Kernel:
    """Re-projected sums -> velocity v_r; if `damped` alpha v_r, heat H = alpha (sum w m v^2 / M - |v_r|^2) >= 0, alpha.

    Besides, the nodes' velocity v^n becomes v^n + dt a, which moves the particles, and their acceleration the mean
    velocity (v^n + v_r) / 2, which does the work; when `sharpened`, a comes from `kick`, and both velocities go there.
    The blocks are those of the scatter at the end of the step before.
    """

    @wp.func
    def write(grid: Grid, m: int, sign: vector3, v: vector3, alpha: scalar, heat: scalar, dt: scalar):
        """Write what belongs to a node, or with other signs to a ghost of it."""
        node = grid.node[m]
        before = first_three(node)
        a = second_three(node)
        if wp.static(sharpened):
            a = second_three(grid.kick[m])
        after = wp.cw_mul(sign, v)
        moving = before + dt * a
        mean = HALF * (before + after)
        shown = after
        if wp.static(damped):
            shown = alpha * after
        grid.reprojected[m] = vector4(shown[0], shown[1], shown[2], heat)
        values = vector8(moving[0], moving[1], moving[2], node[3], mean[0], mean[1], mean[2], alpha)
        if wp.static(sharpened):
            grid.kick[m] = values
        else:
            grid.node[m] = values

    @wp.func
    def solve_node(
        grid: Grid,
        boundary: Boundary,
        now: Clock,
        phase: Phase,
        slot: int,
        index: wp.vec3i,
    ):
        n = node_index(grid, index[0], index[1], index[2])
        mass = grid.node[n][3]
        if mass == ZERO or not is_owner(boundary, grid.cells, index):
            return
        alpha = damped_share(now, grid.field[n][1])
        owned = ghost_sides(boundary, grid.cells, index)
        free = free_components(boundary, grid.cells, index)
        total = grid.reprojected[n]
        if owned[0] + owned[1] + owned[2] > 0:
            total = fold_reprojected(grid, boundary, index, owned)
        inverse = wp.where(mass > grid.light_mass, ONE / mass, ZERO)
        velocity = wp.cw_mul(free, vector3(total[0], total[1], total[2])) * inverse
        heat = alpha * wp.max(TWO * total[3] * inverse - wp.dot(velocity, velocity), ZERO)
        for i in range(image_count(owned[0])):
            for j in range(image_count(owned[1])):
                for k in range(image_count(owned[2])):
                    sides = image_sides(owned, i, j, k)
                    m = image_node(grid, index, sides)
                    if owned[0] + owned[1] + owned[2] > 0 or free[0] * free[1] * free[2] == ZERO:
                        x = grid.reprojected[m]
                        momentum = alpha * vector3(x[0], x[1], x[2])
                        value = alpha * grid.node[m][3] * velocity
                        tally_reaction(boundary, grid, index, sides, momentum, vector3(), value, phase.impulses, slot)
                    write(grid, m, image_signs(boundary, sides), velocity, alpha, heat, now.dt)

    @wp.func
    def visit_inside(grid: Grid, boundary: Boundary, now: Clock, phase: Phase, slot: int, n: int):
        mass = grid.node[n][3]
        if mass == ZERO:
            return
        total = grid.reprojected[n]
        inverse = wp.where(mass > grid.light_mass, ONE / mass, ZERO)
        velocity = inverse * first_three(total)
        alpha = damped_share(now, grid.field[n][1])
        heat = alpha * wp.max(TWO * total[3] * inverse - wp.dot(velocity, velocity), ZERO)
        write(grid, n, vector3(ONE, ONE, ONE), velocity, alpha, heat, now.dt)

    return node_kernel(solve_node, visit_inside, 1)
