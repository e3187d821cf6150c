"""Bytes that each phase of a step has to move, and operations that it has to do, counted from the algorithm.

**Bytes** are what must come from memory and go back there if caches are perfect: what a phase reads or writes of a
particle, once each way, and what it reads or writes of a node, once each way however many particles share it. Padding
is not counted, nor what one phase hands to the next through the cache.

**Operations** are multiply-adds of one number, the unit of the rate that `limits.py` measures; an addition alone, a
division or a root counts as one, too. With a stencil of w nodes an axis and values of L lanes,

    gather            L (w^3 + w^2 + w)           rows, planes, then all of it: see `kernels/stencil.py`
    gather_gradient   L (2 w^3 + 3 w^2 + 4 w)     two sums along a row, three across, four over planes
    scatter           L (w^3 + w^2)               a multiple for each row, added to each node
    scatter_gradient  L (2 w^3 + 4 w^2)
    weights           12 w                        3 axes, w weights and w slopes of two operations each

What comes on top, such as the equation of state, is counted by hand from the kernels, to some ten per cent.
"""

from dataclasses import dataclass

import warp as wp

from warp_mpm.config import Order
from warp_mpm.kernels.precision import scalar
from warp_mpm.model import Model

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
SHARPENING = 6 * (2 * NODE + 1) + NODE  # six neighbours: difference and multiply-add of all lanes, and a minimum


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
    damped, usf = model.damped, model.config.order is Order.USF
    kick = NODE if model.sharpened else 0
    cells = CONTENT if damped else 0
    counts = {
        "time step": Count(),
        "collect reactions": Count(),
        "end of step": Count(),
        "clear": Count(node_bytes=NUMBER * (NODE + FIELD + CONTENT + REPROJECTED + kick)),
        "strain and material": _strain_and_material(model),
        "grid to particles and back": _advance(model),
    }
    if usf:
        counts["grid to particles"] = counts.pop("grid to particles and back")
        counts["momentum to grid"] = _scatter(model, momentum=True, force=False)
        counts["forces to grid"] = _scatter(model, momentum=False, force=True)
        counts["solve momentum"] = Count(node_bytes=2 * NUMBER * NODE, node_operations=SOLVING // 2)
        counts["solve forces"] = Count(node_bytes=2 * NUMBER * (NODE + FIELD), node_operations=SOLVING // 2)
        operations = weights(model.shape.width) + gather(model.shape.width, NODE) + MOVING
        counts["motion"] = Count(2 * PLACE + NUMBER, operations, node_bytes=NUMBER * NODE)
        return counts
    counts["particles to grid"] = _scatter(model, momentum=True, force=True)
    counts["solve grid"] = Count(node_bytes=2 * NUMBER * (NODE + FIELD + cells), node_operations=SOLVING)
    if model.config.order is Order.MUSL:
        # Velocity, mass and acceleration in, both velocities of the step out; the re-projected sums both ways.
        lanes = 2 * NODE + 2 * REPROJECTED + kick
        counts["solve re-projection"] = Count(node_bytes=NUMBER * lanes, node_operations=SOLVING)
    if model.sharpened:
        sharpening = Count(node_bytes=2 * NUMBER * NODE, node_operations=SHARPENING)
        counts |= {"sharpen accelerations": sharpening, "sharpen velocities": sharpening}
    return counts


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
