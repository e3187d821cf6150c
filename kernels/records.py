"""The arrays that kernels work on, gathered in records: particles, grid, clock.

Indices: a *cell* (i, j, k) counts from the lower corner of the domain; a *node* has the index of the cell above it.
Nodes carry one layer of ghosts on every face, because a stencil of three nodes reaches one node past the domain.
"""

import warp as wp

from warp_mpm.kernels.precision import scalar, vector2, vector3, vector4, vector8


@wp.struct
class Position:
    """A particle's place: its cell and the fraction of that cell, 0 <= fraction < 1.

    In single precision a coordinate of 0.1 m resolves 7.5e-9 m, a fraction of a 3 mm cell 1.8e-10 m at worst,
    everywhere in the domain; and the weights, which depend on the fraction alone, are the same in every cell.
    """

    fraction: vector3
    cell: wp.vec3s


@wp.struct
class Motion:
    """A particle's mass and velocity."""

    velocity: vector3  # [m/s]
    mass: scalar  # [kg]; 0 once it has left


@wp.struct
class Matter:
    """The state of a particle's material."""

    density: scalar  # [kg/m3]
    energy: scalar  # specific internal energy, chemical energy included [J/kg]
    pressure: scalar  # [Pa]
    viscous_pressure: scalar  # isotropic part of the artificial viscosity's pressure [Pa]
    viscous_thrust: vector3  # s: its directed part is the pressure tensor s s^T [Pa]
    burn_fraction: scalar
    sound_speed: scalar  # of small changes of the pressure: 0 where matter not yet burnt has none [m/s]


@wp.struct
class BurnTimes:
    """When an explosive particle begins to burn."""

    arrival_time: scalar  # of the wave [s]
    booster_time: scalar  # from which it burns at once [s]


@wp.struct
class Particles:
    """State of all particles; every array has one entry a particle, ordered by (slab, charge, cell).

    What is needed together lies together: a few records are read faster than many numbers. A particle that left
    through an open face keeps its last position and has no mass: it adds nothing anywhere.
    """

    position: wp.array(dtype=Position)
    motion: wp.array(dtype=Motion)
    matter: wp.array(dtype=Matter)
    burn_times: wp.array(dtype=BurnTimes)  # empty without explosives
    affine: wp.array(dtype=wp.types.matrix((3, 3), scalar))  # velocity gradient of APIC [1/s]; empty without it
    index: wp.array(dtype=int)  # creation order


@wp.struct
class Grid:
    """The background grid. Sums are scattered to, and emptied by the pass that has read them last; the rest is written
    for all nodes of active blocks before it is read. What is scattered at the end of a step stays until the next one
    has used it: outputs read the sums and the field.
    """

    sums: wp.array(dtype=vector8)  # momentum, mass | force, volume, as they were scattered
    field: wp.array(dtype=vector2)  # sums of w V p [J] and w m c^2 [J] -> field pressure [Pa], sound speed [m/s]
    content_sums: wp.array(dtype=vector2)  # of cells: L V p [J] and L V [m3]
    content: wp.array(dtype=vector2)  # of cells: pressure [Pa], filling (see `content.py`)
    start: wp.array(dtype=vector8)  # velocity, mass | acceleration, 1 / mass, or 0 where a node counts as empty
    reprojected: wp.array(dtype=vector4)  # sums of momentum and kinetic energy
    end: wp.array(dtype=vector8)  # velocity that moves the particles, mass | velocity that does the work, alpha
    damping: wp.array(dtype=vector4)  # re-projected velocity, or alpha times it [m/s], and the damping's heat [J/kg]
    cells: wp.vec3i  # cells of the domain per axis
    stride_x: int  # flat index step of a node along x
    stride_y: int  # along y; along z it is 1
    spacing: vector3  # [m]
    inverse_spacing: vector3  # [1/m]
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
    damping: scalar  # k dt / l of the conservative damping in this step [s/m]
    drift: scalar  # cells that the fastest particle may have moved since the particles were sorted
    last_drift: scalar  # the same for the latest step alone
    step: int


# What particle kernels reduce by maximum, one vector for each slab, and its lanes.
Maxima = vector8
SPEED_X = wp.constant(0)  # c + |v_x| [m/s], or the detonation speed if higher; y and z follow
VISCOUS_RATE = wp.constant(3)  # [1/s]
STRAIN_RATE = wp.constant(4)  # |div v| [1/s]
DISPLACEMENT = wp.constant(5)  # in the latest step [cells]
PARTICLE_PRESSURE = wp.constant(6)  # [Pa]; the last lane is free

# What particle kernels tally, in rows of double lanes: one for each slab, or on a GPU some for all (see `tally_row`).
OUTFLOW_MASS = wp.constant(0)  # for each face: mass [kg], momentum (3) [kg m/s], energy [J]
OUTFLOW_LANES = wp.constant(5)
CLAMPED_ENERGY = wp.constant(30)  # added where an energy would have become negative [J]
AMBIENT_WORK = wp.constant(31)  # done by the material on the ambient pressure [J]
TALLIES = 32  # lanes


@wp.func_native(f"""
#if defined(__CUDA_ARCH__)
    return p % (tallies.shape[0] / {TALLIES});
#else
    return slab;
#endif
""")
def tally_row(tallies: wp.array(dtype=wp.float64), slab: int, p: int) -> int:
    """The row for a particle: its slab's, which has one thread; on a GPU another than its neighbours have.

    Threads that add to one number wait for each other, and each of them adds its work on an ambient pressure.
    """
    ...


@wp.func
def raise_maximum(maxima: wp.array(dtype=scalar), index: int, value: scalar):
    """maxima[index] = max(maxima[index], value); reads first, because most values are smaller and atomics are slow."""
    if value > maxima[index]:
        wp.atomic_max(maxima, index, value)


@wp.func_native("""
#if defined(__clang__) && !defined(__CUDACC__)
    typedef __typeof__(values.c[0]) lanes __attribute__((ext_vector_type(8)));
    lanes known, given;
    __builtin_memcpy(&known, maxima.data + slab, sizeof(lanes));
    __builtin_memcpy(&given, &values, sizeof(lanes));
    if (__builtin_reduce_or(given > known)) {  // seldom; a write would take the cache line from the other threads
        known = __builtin_elementwise_max(known, given);
        __builtin_memcpy(maxima.data + slab, &known, sizeof(lanes));
    }
#else
    for (int lane = 0; lane < 8; ++lane)
        if (values.c[lane] > maxima.data[slab].c[lane])  // most are not, and atomics are slow
            wp::atomic_max(&maxima.data[slab].c[lane], values.c[lane]);
#endif
""")
def raise_maxima(maxima: wp.array(dtype=Maxima), slab: int, values: Maxima):
    """maxima[slab] = max(maxima[slab], values), lane by lane; on a CPU a slab has one thread."""
    ...


@wp.func
def node_index(grid: Grid, i: int, j: int, k: int) -> int:
    """Flat index of node (i, j, k), each from -1 to cells + 1."""
    return (i + 1) * grid.stride_x + (j + 1) * grid.stride_y + k + 1


@wp.func
def index_of_node(grid: Grid, n: int) -> wp.vec3i:
    """The node (i, j, k) of a flat index."""
    in_plane = n % grid.stride_x
    return wp.vec3i(n // grid.stride_x - 1, in_plane // grid.stride_y - 1, in_plane % grid.stride_y - 1)
