"""The arrays that kernels work on, gathered in records: particles, grid, clock.

Indices: a *cell* (i, j, k) counts from the lower corner of the domain; a *node* has the index of the cell above it.
Nodes carry one layer of ghosts on every face, because a stencil of three nodes reaches one node past the domain.
"""

import warp as wp

from warp_mpm.kernels.precision import scalar, vector2, vector3, vector4, vector8


@wp.struct
class Particles:
    """State of all particles; every array has one entry a particle, ordered by (slab, charge, cell).

    A position is the particle's cell and the fraction of that cell, 0 <= fraction < 1. In single precision a
    coordinate of 0.1 m resolves 7.5e-9 m, a fraction of a 3 mm cell 1.8e-10 m at worst, everywhere in the domain; and
    the weights, which depend on the fraction alone, are the same in every cell.

    A particle that left through an open face keeps its last position and has no mass: it adds nothing anywhere.
    """

    cell: wp.array(dtype=wp.vec3s)
    fraction: wp.array(dtype=vector3)
    velocity: wp.array(dtype=vector3)  # [m/s]
    affine: wp.array(dtype=wp.types.matrix((3, 3), scalar))  # velocity gradient of APIC [1/s]; empty without it
    mass: wp.array(dtype=scalar)  # [kg]; 0 once it has left
    density: wp.array(dtype=scalar)  # [kg/m3]
    energy: wp.array(dtype=scalar)  # specific internal energy, chemical energy included [J/kg]
    pressure: wp.array(dtype=scalar)  # [Pa]
    viscous_pressure: wp.array(dtype=scalar)  # isotropic part of the artificial viscosity's pressure [Pa]
    viscous_thrust: wp.array(dtype=vector3)  # s: its directed part is the pressure tensor s s^T [Pa]
    burn_fraction: wp.array(dtype=scalar)
    arrival_time: wp.array(dtype=scalar)  # [s]
    booster_time: wp.array(dtype=scalar)  # from which it burns at once [s]
    index: wp.array(dtype=int)  # creation order


@wp.struct
class Grid:
    """The background grid. Nodal quantities turn in place from sums into values (see `grid.py`)."""

    node: wp.array(dtype=vector8)  # momentum, mass, force, volume -> velocity, mass, acceleration, filling; and for
    # the material update of MUSL: velocity that moves the particles, mass, velocity that does the work, filling
    pressure: wp.array(dtype=scalar)  # sum of w V p [J] -> field pressure [Pa]
    content: wp.array(dtype=vector2)  # of cells: L V p [J] and L V [m3] -> pressure [Pa], filling (see `content.py`)
    reprojected: wp.array(dtype=vector4)  # momentum, kinetic energy -> velocity, heat of the damping [J/kg]
    kick: wp.array(dtype=vector8)  # sharpened acceleration in the lanes of `node`; then what `node` holds for the
    # material update, not yet sharpened (see `sharpen.py`)
    cells: wp.vec3i  # cells of the domain per axis
    stride_x: int  # flat index step of a node along x
    stride_y: int  # along y; along z it is 1
    spacing: vector3  # [m]
    stamps: wp.array(dtype=int)  # of each block: the step in which a particle last scattered there (see `blocks.py`)
    blocks: wp.vec3i  # blocks of nodes per axis
    workers: int  # threads that share a block: 1 on a CPU, all its nodes on a GPU
    light_mass: scalar  # nodes with less mass than this count as empty [kg]


@wp.struct
class Clock:
    """Time and time step; on the device, so that no step needs the host."""

    time: wp.float64  # at the end of the latest step [s]
    end_time: wp.float64  # [s]
    dt: scalar  # of the latest step [s]
    smallest_dt: scalar  # of all steps but a clipped last one [s]
    first_dt: scalar  # [s]
    damping: scalar  # alpha of the conservative damping in this step
    drift: scalar  # cells that the fastest particle may have moved since the particles were sorted
    last_drift: scalar  # the same for the latest step alone
    step: int


# What particle kernels reduce by maximum, one vector for each slab, and its lanes.
Maxima = wp.types.vector(9, scalar)
SPEED_X = wp.constant(0)  # c + |v_x| [m/s]; y and z follow
SIGNAL_SPEED = wp.constant(3)  # c + |v| [m/s]
BURN_SPEED = wp.constant(4)  # detonation speed of unburnt matter [m/s]
VISCOUS_RATE = wp.constant(5)  # [1/s]
STRAIN_RATE = wp.constant(6)  # |div v| [1/s]
DISPLACEMENT = wp.constant(7)  # in the latest step [cells]
PARTICLE_PRESSURE = wp.constant(8)  # [Pa]

# What particle kernels tally, one row of double lanes for each slab.
OUTFLOW_MASS = wp.constant(0)  # for each face: mass [kg], momentum (3) [kg m/s], energy [J]
OUTFLOW_LANES = wp.constant(5)
CLAMPED_ENERGY = wp.constant(30)  # added where an energy would have become negative [J]
AMBIENT_WORK = wp.constant(31)  # done by the material on the ambient pressure [J]
TALLIES = 32  # lanes


@wp.func
def raise_maximum(maxima: wp.array(dtype=scalar), index: int, value: scalar):
    """maxima[index] = max(maxima[index], value); reads first, because most values are smaller and atomics are slow."""
    if value > maxima[index]:
        wp.atomic_max(maxima, index, value)


@wp.func
def raise_maxima(maxima: wp.array(dtype=Maxima), slab: int, values: Maxima):
    """The same for all lanes of a slab."""
    known = maxima[slab]
    nothing_new = wp.max(known, values) == known
    if not nothing_new:
        wp.atomic_max(maxima, slab, values)


@wp.func
def node_index(grid: Grid, i: int, j: int, k: int) -> int:
    """Flat index of node (i, j, k), each from -1 to cells + 1."""
    return (i + 1) * grid.stride_x + (j + 1) * grid.stride_y + k + 1
