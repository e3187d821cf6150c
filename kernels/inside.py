"""The solution of nodes that have no face near: formulas in C++, for a row of nodes at a time (see `node_rows.py`).

`grid.py` and `reproject.py` have the same for any node, in Warp, with walls. Sharpening (`sharpen.py`) asks for sums
over a node's six neighbours along the axes,

    sum over j of min(M_i, M_j) (x_i - x_j)

with x the acceleration, from the sums of the scatter; or the velocities of the step, from the values at its start and
the re-projected sums. x is computed where it is needed, seven times for each node, which is cheaper than one more pass
over the nodes to store it.
"""

import functools

import warp as wp

from warp_mpm.kernels.content import PER_RISE, SPARSE
from warp_mpm.kernels.node_rows import of_rows
from warp_mpm.kernels.precision import REAL, scalar, vector3
from warp_mpm.kernels.records import Grid

_NEIGHBOURS = """
    const int x = grid.stride_x, y = grid.stride_y;
    const int neighbours[6] = {n - x, n + x, n - y, n + y, n - 1, n + 1};
"""

_SOLVE = """
    const auto spacing = grid.inverse_spacing;
    const auto per_volume = spacing[0] * spacing[1] * spacing[2];
    const number none = {};
    auto inverse_of = [&](number mass) { return choose(mass > grid.light_mass, 1 / mass, none); };
    number sums[8];
    read_eight(grid.sums.data + n, sums);
    if (CELLS) {  // narrow shapes reach cells without the node of their index
        number content[2], empty[2] = {};
        read_two(grid.content_sums.data + n, content);
        content[0] *= per_volume;
        content[1] *= per_volume;
        write_two(grid.content.data + n, content);
        write_two(grid.content_sums.data + n, empty);
    }
    number start[8] = {}, reprojected[4] = {};
    if (REPROJECTS)
        write_four(grid.reprojected.data + n, reprojected);
    const number mass = sums[3];
    const auto pushed = (mass == 0) & ((sums[4] != 0) | (sums[5] != 0) | (sums[6] != 0));
    if (any(pushed)) {  // linear shapes, not sharpened, push where they have no weight
        for (int lane = 4; lane < 7; ++lane)
            sums[lane] = choose(pushed, none, sums[lane]);
        write_eight(grid.sums.data + n, sums);
    }
    if (!any(mass != 0)) {
        write_eight(grid.start.data + n, start);
        return 0;
    }
    const number inverse = inverse_of(mass);
    number *force = sums + 4, pulled[3] = {};
    if (FORCE && SHARPENED) {
#pragma unroll
        for (int axis = 0; axis < 3; ++axis) {
            number along[3] = {};
            for (int side = 0; side < 2; ++side) {
                number other[4];
                read_mass_and_force(grid.sums.data + neighbours[2 * axis + side], other);
                const number link = smaller(other[0], mass), per_mass = inverse_of(other[0]);
                for (int k = 0; k < 3; ++k)
                    along[k] += link * (inverse * force[k] - per_mass * other[1 + k]);
            }
            for (int k = 0; k < 3; ++k)
                pulled[k] += along[k];
        }
    }
    start[3] = mass;
    start[7] = inverse;
    for (int k = 0; k < 3; ++k) {
        start[k] = inverse * sums[k];
        if (FORCE)
            start[4 + k] = choose(inverse > 0, inverse * (force[k] + strength * pulled[k]) + gravity[k], none);
    }
    write_eight(grid.start.data + n, start);
    if (!FORCE)
        return 0;
    number field[2];
    read_two(grid.field.data + n, field);
    const number filling = per_volume * sums[7];
    number share = (filling - SPARSE) * PER_RISE;
    share = choose(share > 0, smaller(share, none + 1), none);
    const number pressure = inverse * mass * per_volume * field[0] / (share * filling + 1 - share);
    field[0] = pressure;
    field[1] = root(inverse * field[1]);
    write_two(grid.field.data + n, field);
    return highest(choose(filling >= HALF, pressure, none));
"""

_SOLVE_REPROJECTED = """
    number start[8], total[4], field[2], end[8] = {}, damping[4] = {};
    read_eight(grid.start.data + n, start);
    const number mass = start[3], inverse = start[7];
    if (!any(mass != 0)) {
        write_eight(grid.end.data + n, end);
        write_four(grid.damping.data + n, damping);
        return;
    }
    read_four(grid.reprojected.data + n, total);
    read_two(grid.field.data + n, field);
    const number crossing = damping_per_speed * field[1], alpha = crossing / (1 + crossing);
    number velocity[3], moves[3], twice_work[3], moves_pulled[3] = {}, work_pulled[3] = {};
    for (int k = 0; k < 3; ++k) {
        velocity[k] = inverse * total[k];
        moves[k] = start[k] + dt * start[4 + k];
        twice_work[k] = start[k] + velocity[k];
    }
    if (SHARPENED) {
#pragma unroll
        for (int axis = 0; axis < 3; ++axis) {
            number moves_along[3] = {}, work_along[3] = {};
            for (int side = 0; side < 2; ++side) {
                number other[8], given[4];
                read_eight(grid.start.data + neighbours[2 * axis + side], other);
                read_four(grid.reprojected.data + neighbours[2 * axis + side], given);
                const number link = smaller(other[3], mass);
                for (int k = 0; k < 3; ++k) {
                    moves_along[k] += link * (moves[k] - (other[k] + dt * other[4 + k]));
                    work_along[k] += link * (twice_work[k] - (other[k] + other[7] * given[k]));
                }
            }
            for (int k = 0; k < 3; ++k) {
                moves_pulled[k] += moves_along[k];
                work_pulled[k] += work_along[k];
            }
        }
    }
    for (int k = 0; k < 3; ++k) {
        end[k] = moves[k] + strength * inverse * moves_pulled[k];
        end[4 + k] = (twice_work[k] + strength * inverse * work_pulled[k]) / 2;
        damping[k] = DAMPED ? alpha * velocity[k] : velocity[k];
    }
    end[3] = mass;
    end[7] = alpha;
    if (DAMPED) {
        const number seen = velocity[0] * velocity[0] + velocity[1] * velocity[1] + velocity[2] * velocity[2];
        const number unseen = 2 * total[3] * inverse - seen, none = {};
        damping[3] = alpha * choose(unseen > 0, unseen, none);
    }
    write_eight(grid.end.data + n, end);
    write_four(grid.damping.data + n, damping);
    number empty[8] = {};
    write_eight(grid.sums.data + n, empty);
    write_two(grid.field.data + n, empty);
"""


def _composed(body: str, **choices: bool | float) -> str:
    """The body with its choices and constants."""
    for name, value in choices.items():
        body = body.replace(name, f"({REAL}){value!r}" if isinstance(value, float) else str(value).lower())
    return _NEIGHBOURS + body


@functools.cache
def solve_inside_function(
    force: bool, cells: bool, sharpened: bool, reprojects: bool, plain: bool = False
) -> wp.Function:
    """Device function (grid, gravity, strength, n) -> highest pressure [Pa]: what `solve_kernel` of `grid.py` does.

    n is the first node of a row.
    """
    choices = {"FORCE": force, "CELLS": cells, "SHARPENED": sharpened, "REPROJECTS": reprojects}
    body = _composed(_SOLVE, **choices, SPARSE=float(SPARSE), PER_RISE=float(PER_RISE), HALF=0.5)

    @wp.func_native(of_rows(body, plain))
    def solve_inside(grid: Grid, gravity: vector3, strength: scalar, n: int) -> scalar: ...

    return solve_inside


@functools.cache
def solve_reprojected_inside_function(sharpened: bool, damped: bool, plain: bool = False) -> wp.Function:
    """Device function (grid, dt, damping_per_speed, strength, n): what the kernel of `reproject.py` does.

    n is the first node of a row.
    """
    body = _composed(_SOLVE_REPROJECTED, SHARPENED=sharpened, DAMPED=damped)

    @wp.func_native(of_rows(body, plain))
    def solve_reprojected_inside(grid: Grid, dt: scalar, damping_per_speed: scalar, strength: scalar, n: int): ...

    return solve_reprojected_inside
