"""Bytes that each phase of a step has to move, and operations that it has to do, counted from the algorithm.

**Bytes** are what must come from memory and go back there if caches are perfect: what a phase reads or writes of a
particle, once each way, and what it reads or writes of a node, once each way however many particles share it. Padding
is not counted, nor what one phase hands to the next through the cache.

**Operations** are multiply-adds of one number, the unit of the rate that `limits.py` measures; an addition alone, a
division or a root counts as one, too. With a stencil of w nodes an axis and values of L lanes,

    gather            L (w^3 + w^2 + w)           rows, planes, then all of it: see `kernels/stencil.py`
    gather_gradient   L (2 w^3 + 3 w^2 + 4 w)     two sums along a row, three across, four over planes
    scatter           L (w^3 + w)                 a multiple for each node of a row, added to all rows
    scatter_gradient  L (2 w^3 + 3 w^2 + 4 w)
    weights           12 w                        3 axes, w weights and w slopes of two operations each

What comes on top, such as the equation of state, is counted by hand from the kernels, to some ten per cent.

Sharpening is done where nodes are solved. It computes a node's value anew for each neighbour, and is counted so.
Folding concerns the nodes at walls alone: its count is that of one of them times their share of the domain's nodes,
which is their share of the nodes that particles reach where matter fills the domain, as in the cube that is timed.
"""

from dataclasses import dataclass

import numpy as np
import warp as wp

from warp_mpm.config import Order
from warp_mpm.kernels.precision import scalar
from warp_mpm.model import Model
from warp_mpm.scene import Wall

NUMBER = wp.types.type_size_in_bytes(scalar)  # [bytes]
PLACE = 3 * 2 + 3 * NUMBER  # cell and fraction of a particle [bytes]
NODE, REPROJECTED, CONTENT, FIELD = 8, 4, 2, 2  # lanes of a node's arrays; those of the cells count as nodes' too
AFFINE = 9  # numbers of APIC's velocity gradient
AXES = 3

FORCES = 25  # stresses from pressures, viscosity and volume
STRAINING = 80  # work, divergence, strain rate along the acceleration, damping and its heat
MATERIAL = 140  # energy, density and its relaxation, motion, burn, pressure, viscosity, what limits the time step
MOVING = 30  # a particle's new place alone
SOLVING = 30  # sums of a node to its values
VECTOR = NODE // 2  # lanes that sharpening takes at a time
# Seven values, six differences added with a weight, the sum of three axes, and its share added to a node's value.
SHARPENING_ACCELERATIONS = 7 * (1 + VECTOR) + 6 * (1 + 2 * VECTOR) + 3 * VECTOR
SHARPENING_VELOCITIES = 7 * 2 * VECTOR + 6 * (2 + 4 * VECTOR) + 6 * VECTOR
FOLDING = 40  # a ghost added to its image, held components, and what the wall did to them


@dataclass(frozen=True)
class Count:
    """What a phase moves and does, for each particle and for each node that particles reach."""

    particle_bytes: float = 0.0
    particle_operations: float = 0.0
    node_bytes: float = 0.0
    node_operations: float = 0.0

    def bytes_per_particle(self, nodes_per_particle: float) -> float:
        """Bytes to move for each particle."""
        return self.particle_bytes + nodes_per_particle * self.node_bytes

    def operations_per_particle(self, nodes_per_particle: float) -> float:
        """Operations to do for each particle."""
        return self.particle_operations + nodes_per_particle * self.node_operations


def gather(width: int, lanes: int) -> int:
    """Operations to sum w x."""
    return lanes * (width**3 + width**2 + width)


def gather_gradient(width: int, lanes: int) -> int:
    """Operations to sum w x and its derivatives along three axes."""
    return lanes * (2 * width**3 + 3 * width**2 + 4 * width)


def scatter(width: int, lanes: int) -> int:
    """Operations to add w a to all nodes."""
    return lanes * (width**3 + width)


def scatter_gradient(width: int, lanes: int) -> int:
    """Operations to add w a + dw/dx b + dw/dy c + dw/dz d to all nodes."""
    return lanes * (2 * width**3 + 3 * width**2 + 4 * width)


def weights(width: int) -> int:
    """Operations for the weights and slopes of a stencil."""
    return 2 * AXES * 2 * width


def phase_counts(model: Model) -> dict[str, Count]:
    """The count of every phase of a step, by the names of `Solver.phases`; those of single launches are nothing."""
    counts = {
        "time step": Count(),
        "collect reactions": Count(),
        "end of step": Count(),
        "strain and material": _strain_and_material(model),
    }
    if model.config.order is not Order.MUSL:  # whose re-projection does that besides
        counts["clear"] = Count(node_bytes=NUMBER * (NODE + FIELD))
    if model.config.order is Order.USF:
        counts["grid to particles"] = _advance(model)
        counts["momentum to grid"] = _scatter(model, momentum=True, force=False)
        counts["fold momentum"] = _fold(model, NODE)
        counts["solve momentum"] = Count(node_bytes=2 * NUMBER * NODE, node_operations=SOLVING // 2)
        counts["forces to grid"] = _scatter(model, momentum=False, force=True)
        counts["fold forces"] = _fold(model, NODE + FIELD)
        counts["solve forces"] = Count(node_bytes=2 * NUMBER * (NODE + FIELD), node_operations=SOLVING // 2)
        operations = weights(model.shape.width) + gather(model.shape.width, NODE) + MOVING
        counts["motion"] = Count(2 * PLACE + NUMBER, operations, node_bytes=NUMBER * NODE)
        return counts
    counts["grid to particles and back"] = _advance(model)
    counts["particles to grid"] = _scatter(model, momentum=True, force=True)
    counts["fold grid"] = _fold(model, NODE + FIELD)
    counts["solve grid"] = _solve(model)
    if model.config.order is Order.MUSL:
        counts["fold re-projection"] = _fold(model, REPROJECTED, read_besides=2)  # mass and sound speed
        counts["solve re-projection"] = _solve_reprojected(model)
    return counts


def _solve(model: Model) -> Count:
    """Sums to the start of a step and the field, those of cells to what they hold; the latter sums are emptied."""
    lanes = 2 * (NODE + FIELD)
    operations = SOLVING
    if model.damped:
        lanes += 3 * CONTENT
    if model.config.order is Order.MUSL:
        lanes += REPROJECTED  # emptied
    if model.sharpened:
        operations += SHARPENING_ACCELERATIONS
    return Count(node_bytes=NUMBER * lanes, node_operations=operations)


def _solve_reprojected(model: Model) -> Count:
    """The step's start and the re-projected sums to its velocities and damping; the sums of the scatter are emptied."""
    lanes = 2 * (NODE + REPROJECTED) + NODE + 2 * FIELD
    operations = SOLVING + (SHARPENING_VELOCITIES if model.sharpened else 0)
    return Count(node_bytes=NUMBER * lanes, node_operations=operations)


def _fold(model: Model, lanes: int, read_besides: int = 0) -> Count:
    """Ghosts behind walls read, the nodes that meet walls read and written; nothing of all others."""
    owners, ghosts = wall_shares(model)
    read = (owners + ghosts) * (lanes + read_besides)
    return Count(node_bytes=NUMBER * (read + owners * lanes), node_operations=owners * FOLDING)


def wall_shares(model: Model) -> tuple[float, float]:
    """Shares, of a domain's nodes with their ghosts, of those on walls or next to them, and of the ghosts behind."""
    apart = in_front = 1.0
    for axis, cells in enumerate(model.scene.domain.cells):
        node = np.arange(-1, cells + 2)
        low, high = (wall is not Wall.OPEN for wall in model.scene.walls.faces()[2 * axis : 2 * axis + 2])
        near, behind = np.zeros((2, len(node)), dtype=bool)
        if low:
            near, behind = near | (node <= 1), behind | (node < 0)
        if high:
            near, behind = near | (node >= cells - 1), behind | (node > cells)
        apart *= 1.0 - near.mean()
        in_front *= 1.0 - behind.mean()
    return float(in_front - apart), float(1.0 - in_front)


def _advance(model: Model) -> Count:
    """Nodes to particle velocity, and for MUSL back again."""
    width, musl = model.shape.width, model.config.order is Order.MUSL
    numbers = 1 + 2 * AXES + (AFFINE if model.affine else 0)  # mass in, velocity in and out
    operations = weights(width) + gather(width, NODE) + (scatter(width, REPROJECTED) if musl else 0) + 2 * AXES
    if model.affine:  # an outer product at each node, and a matrix times a vector if the velocity goes back
        operations += width**3 * (2 + AXES + AFFINE + (AFFINE + 2 * AXES if musl else 0))
    return Count(
        particle_bytes=PLACE + NUMBER * numbers,
        particle_operations=operations,
        node_bytes=NUMBER * (NODE + (2 * REPROJECTED if musl else 0)),
    )


def _strain_and_material(model: Model) -> Count:
    """Strain, then the material's answer; between the two nothing leaves the cache."""
    width, order, damped = model.shape.width, model.config.order, model.damped
    musl = order is Order.MUSL
    # In and out: density, energy, pressure, viscous pressure, viscous thrust; sound speed out; mass and velocity in.
    numbers = 2 * (4 + AXES) + 1 + 1 + AXES + (AXES if damped else 0) + (4 if model.burns else 0)
    operations = weights(width) + gather_gradient(width, NODE) + STRAINING + MATERIAL
    lanes = NODE
    if damped:
        operations += gather(width, REPROJECTED) + weights(2) + gather(2, CONTENT)
        lanes += REPROJECTED + CONTENT
    elif musl:
        operations += gather_gradient(width, REPROJECTED)
        lanes += REPROJECTED
    places = 1 if order is Order.USF else 2
    return Count(places * PLACE + NUMBER * numbers, operations, node_bytes=NUMBER * lanes)


def _scatter(model: Model, *, momentum: bool, force: bool) -> Count:
    """Momentum, mass and volume to the nodes, forces and field pressure, and the content of cells."""
    width = model.shape.width
    numbers = (
        2 + AXES * momentum + (3 + AXES) * force
    )  # mass, density | velocity | pressures, sound speed, viscous thrust
    operations = weights(width)
    operations += scatter_gradient(width, NODE) if force else scatter(width, NODE)
    lanes = NODE
    if force:
        operations += scatter(width, FIELD) + FORCES
        lanes += FIELD
    if model.damped:
        operations += weights(2) + scatter(2, CONTENT)
        lanes += CONTENT
    if model.affine and momentum:
        numbers += AFFINE
        operations += width**3 * (2 + AFFINE + AXES + NODE)
    return Count(PLACE + NUMBER * numbers, operations, node_bytes=2 * NUMBER * lanes)
