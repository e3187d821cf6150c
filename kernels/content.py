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
from warp_mpm.kernels.shape import offset_nearest_node
from warp_mpm.kernels.stencil import gather_function, scatter_function, stencil_type
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
PER_RISE = wp.constant(scalar(1.0 / 0.15))  # 1 / (FULL - SPARSE): a division takes as long as ten products

PRESSURE = wp.constant(0)  # lanes of a cell's content
FILLING = wp.constant(1)


@wp.func
def inside(filling: scalar) -> scalar:
    """1 inside the material, 0 at a free surface, by the filling of a cell or a node."""
    return wp.clamp((filling - SPARSE) * PER_RISE, ZERO, ONE)


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
    upper = fraction - HALF - scalar(offset_nearest_node(fraction))
    return vector2(ONE - upper, upper)


Tents = stencil_type(2)
gather_cells = gather_function(2, 2)
scatter_cells = scatter_function(2, 2)


@wp.func
def tents_around(grid: Grid, cell: wp.vec3s, fraction: vector3) -> Tents:
    """The stencil of the eight cells whose centres surround a particle."""
    lowest = lowest_cell(cell, fraction)
    stencil = Tents()
    stencil.first = node_index(grid, lowest[0], lowest[1], lowest[2])
    stencil.stride_x = grid.stride_x
    stencil.stride_y = grid.stride_y
    stencil.wx = tents(fraction[0])
    stencil.wy = tents(fraction[1])
    stencil.wz = tents(fraction[2])
    return stencil


@wp.func
def scatter_content(grid: Grid, cell: wp.vec3s, fraction: vector3, given: vector2):
    """Particle -> cells: sum L V p [J] and sum L V [m3], of a particle's V p and V."""
    scatter_cells(tents_around(grid, cell, fraction), grid.content_sums, given)


@wp.func
def gather_content(grid: Grid, cell: wp.vec3s, fraction: vector3) -> vector2:
    """Pressure [Pa] and filling of the cells around a particle, interpolated: sum L P_c, sum L J_c."""
    return gather_cells(tents_around(grid, cell, fraction), grid.content)


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
    """Sums of the scatter -> pressure and filling of a cell, and of its ghosts behind walls; empties the sums."""
    owned = mirrored_sides(boundary, last_cell(grid.cells), cell, 0)
    total = vector2()
    for i in range(image_count(owned[0])):
        for j in range(image_count(owned[1])):
            for k in range(image_count(owned[2])):
                image = image_cell(grid, cell, image_sides(owned, i, j, k))
                total += grid.content_sums[image]
                grid.content_sums[image] = vector2()
    content = total / (grid.spacing[0] * grid.spacing[1] * grid.spacing[2])
    for i in range(image_count(owned[0])):
        for j in range(image_count(owned[1])):
            for k in range(image_count(owned[2])):
                grid.content[image_cell(grid, cell, image_sides(owned, i, j, k))] = content
