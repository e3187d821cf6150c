"""The record that every step leaves: time, peaks, the pressure in regions, along a line and on the section plane."""

import warp as wp

from warp_mpm.kernels.grid import filling_of
from warp_mpm.kernels.precision import HALF, NEVER, ONE, ZERO, scalar, vector3
from warp_mpm.kernels.records import PARTICLE_PRESSURE, Clock, Grid, Maxima

# Lanes at the start of a record's row; regions and points of the line follow.
RECORD_DT = 0  # [s]
RECORD_PARTICLE_PRESSURE = 1  # highest pressure of a particle [Pa]
RECORD_FIELD_PRESSURE = 2  # highest field pressure [Pa]
RECORD_HEAD = 3  # lanes


@wp.func
def interpolate(grid: Grid, node: int, f: vector3) -> scalar:
    """Trilinear field pressure at the fraction f of the cell above a node [Pa]."""
    pressure = ZERO
    for i in range(2):
        for j in range(2):
            for k in range(2):
                w = wp.abs(scalar(1 - i) - f[0]) * wp.abs(scalar(1 - j) - f[1]) * wp.abs(scalar(1 - k) - f[2])
                pressure += w * grid.field[node + i * grid.stride_x + j * grid.stride_y + k][0]
    return pressure


@wp.kernel(enable_backward=False)
def record_step(
    grid: Grid,
    clock: wp.array(dtype=Clock),
    slabs: int,
    maxima: wp.array(dtype=Maxima),
    slots: int,
    peaks: wp.array(dtype=scalar),
    region_nodes: wp.array(dtype=int),
    region_lanes: wp.array(dtype=int),
    line_lane: int,
    line_nodes: wp.array(dtype=int),
    line_fractions: wp.array(dtype=vector3),
    times: wp.array(dtype=wp.float64),
    rows: wp.array2d(dtype=scalar),
    row_offset: int,
):
    """Write one row of the record, until then 0: thread 0 its head, the others a point of the line or a node each.

    The nodes are those of regions: of those at least half filled the highest field pressure is kept. They have a thread
    each, for one that went through a whole region would take longer than a step of a GPU.
    """
    thread = wp.tid()
    row = clock[0].step - row_offset
    points = line_nodes.shape[0]
    if thread == 0:
        times[row] = clock[0].time
        particle_pressure = ZERO
        for slab in range(slabs):
            particle_pressure = wp.max(particle_pressure, maxima[slab][PARTICLE_PRESSURE])
        field_pressure = ZERO
        for slot in range(slots):
            field_pressure = wp.max(field_pressure, peaks[slot])
            peaks[slot] = ZERO
        rows[row, RECORD_DT] = clock[0].dt
        rows[row, RECORD_PARTICLE_PRESSURE] = particle_pressure
        rows[row, RECORD_FIELD_PRESSURE] = field_pressure
    elif thread <= points:
        point = thread - 1
        rows[row, line_lane + point] = interpolate(grid, line_nodes[point], line_fractions[point])
    else:
        n = thread - 1 - points
        node = region_nodes[n]
        lane = region_lanes[n]
        pressure = grid.field[node][0]
        if pressure > rows[row, lane]:  # most are lower than one before
            if filling_of(grid, node) >= HALF:
                wp.atomic_max(rows, row, lane, pressure)


@wp.kernel(enable_backward=False)
def record_section(
    grid: Grid,
    clock: wp.array(dtype=Clock),
    corner: int,
    stride_u: int,
    stride_v: int,
    stride_normal: int,
    share: scalar,
    threshold: scalar,
    last: wp.array2d(dtype=scalar),
    peak: wp.array2d(dtype=scalar),
    arrival: wp.array2d(dtype=scalar),
):
    """Highest field pressure so far [Pa], and when it first reached the threshold [s], at a node of the section plane.

    The plane lies `share` of a cell above the layer of nodes that begins at `corner`; `last`
    is the pressure a step ago.
    """
    u, v = wp.tid()
    node = corner + u * stride_u + v * stride_v
    pressure = (ONE - share) * grid.field[node][0] + share * grid.field[node + stride_normal][0]
    if pressure >= threshold and arrival[u, v] == NEVER:
        since = clock[0].dt * (pressure - threshold) / (pressure - last[u, v])
        arrival[u, v] = scalar(clock[0].time) - since
    last[u, v] = pressure
    peak[u, v] = wp.max(peak[u, v], pressure)
