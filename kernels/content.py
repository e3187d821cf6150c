"""What the cells hold, by the measure that the internal force goes by.

    P_c = sum over particles of L(x_p - x_c) V_p p_p / V_c,    J_c = sum of L(x_p - x_c) V_p / V_c,

with L the tent function (linear weights) and x_c the cell's centre: the pressure of a cell and its filling. The slope
of the quadratic B-spline is a difference of two tents, dw_i/dx = (L(x - x_{i-1/2}) - L(x - x_{i+1/2})) / h. So in a
column one cell wide the force f_i = sum V_p p_p dw_i/dx on a node is exactly the difference of P between the two cells
that meet there, and gas at rest has the same P in all cells, however its particles lie. If besides every cell is full,
J = 1, and every particle has the pressure of the cells around it, then all particles have the same pressure; if
volumes fill the *nodes* by the shape function instead, a pattern of several per cent is left in the pressures. In more
dimensions the tents of one axis come with splines across, and this holds nearly.

A cell has the index of the node at its lower corner. What was scattered behind a wall is folded back into the cell in
front of it, which is the mirror image of the one behind.
"""

import warp as wp

from warp_mpm.kernels.precision import HALF, ONE, ZERO, scalar, vector2, vector3
from warp_mpm.kernels.records import Grid, node_index
from warp_mpm.kernels.shape import linear_weight, offset_nearest_node
from warp_mpm.kernels.walls import (
    Boundary,
    image_count,
    image_index,
    image_sides,
    in_front_of_walls,
    mirrored_sides,
)

FULL = wp.constant(scalar(0.95))  # filling from which on a place is inside the material
SPARSE = wp.constant(scalar(0.80))  # and up to which it is at a free surface

PRESSURE = wp.constant(0)  # lanes of a cell's content
FILLING = wp.constant(1)


@wp.func
def inside(filling: scalar) -> scalar:
    """1 inside the material, 0 at a free surface, by the filling of a cell or a node."""
    return wp.clamp((filling - SPARSE) / (FULL - SPARSE), ZERO, ONE)


@wp.func
def lowest_cell(cell: wp.vec3s, fraction: vector3) -> wp.vec3i:
    """The lowest of the eight cells whose centres surround a particle."""
    return wp.vec3i(
        int(cell[0]) + offset_nearest_node(fraction[0]),
        int(cell[1]) + offset_nearest_node(fraction[1]),
        int(cell[2]) + offset_nearest_node(fraction[2]),
    )


@wp.func
def tents(fraction: scalar) -> vector2:
    """Linear weights, along an axis, of the two cells whose centres surround a particle."""
    distance = fraction - HALF - scalar(offset_nearest_node(fraction))
    return vector2(linear_weight(distance, HALF), linear_weight(distance - ONE, HALF))


@wp.func
def scatter_content(grid: Grid, cell: wp.vec3s, fraction: vector3, pressure: scalar, volume: scalar):
    """Particle -> cells: sum L V p [J] and sum L V [m3]."""
    lowest = lowest_cell(cell, fraction)
    first = node_index(grid, lowest[0], lowest[1], lowest[2])
    wx = tents(fraction[0])
    wy = tents(fraction[1])
    wz = tents(fraction[2])
    value = vector2(pressure * volume, volume)
    for i in range(2):
        for j in range(2):
            row = first + i * grid.stride_x + j * grid.stride_y
            for k in range(2):
                wp.atomic_add(grid.content, row + k, wx[i] * wy[j] * wz[k] * value)


@wp.func
def gather_content(grid: Grid, cell: wp.vec3s, fraction: vector3) -> vector2:
    """Pressure [Pa] and filling of the cells around a particle, interpolated: sum L P_c, sum L J_c."""
    lowest = lowest_cell(cell, fraction)
    first = node_index(grid, lowest[0], lowest[1], lowest[2])
    wx = tents(fraction[0])
    wy = tents(fraction[1])
    wz = tents(fraction[2])
    content = vector2()
    for i in range(2):
        for j in range(2):
            row = first + i * grid.stride_x + j * grid.stride_y
            for k in range(2):
                content += wx[i] * wy[j] * wz[k] * grid.content[row + k]
    return content


@wp.func
def last_cell(cells: wp.vec3i) -> wp.vec3i:
    """Index of the cell in the upper corner."""
    return wp.vec3i(cells[0] - 1, cells[1] - 1, cells[2] - 1)


@wp.func
def stands_for_itself(boundary: Boundary, cells: wp.vec3i, cell: wp.vec3i) -> bool:
    """Whether there is such a cell, and it is no ghost behind a wall; those beyond open faces are free."""
    exists = cell[0] <= cells[0] and cell[1] <= cells[1] and cell[2] <= cells[2]
    return exists and in_front_of_walls(boundary, last_cell(cells), cell)


@wp.func
def image_cell(grid: Grid, cell: wp.vec3i, sides: wp.vec3i) -> int:
    """Flat index of an image of a cell (see `walls.py`)."""
    image = image_index(last_cell(grid.cells), cell, sides)
    return node_index(grid, image[0], image[1], image[2])


@wp.func
def solve_cell(grid: Grid, boundary: Boundary, cell: wp.vec3i):
    """Sums of the scatter -> pressure and filling of a cell, and of its ghosts behind walls."""
    owned = mirrored_sides(boundary, last_cell(grid.cells), cell, 0)
    total = vector2()
    for i in range(image_count(owned[0])):
        for j in range(image_count(owned[1])):
            for k in range(image_count(owned[2])):
                total += grid.content[image_cell(grid, cell, image_sides(owned, i, j, k))]
    content = total / (grid.spacing[0] * grid.spacing[1] * grid.spacing[2])
    for i in range(image_count(owned[0])):
        for j in range(image_count(owned[1])):
            for k in range(image_count(owned[2])):
                grid.content[image_cell(grid, cell, image_sides(owned, i, j, k))] = content
