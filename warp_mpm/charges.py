"""Cuts bodies into charges of particles, after checking that they fit the domain, the cells and the memory."""

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from warp_mpm.checks import mistake
from warp_mpm.geometry import Solid
from warp_mpm.lattice import Lattice
from warp_mpm.materials import Material
from warp_mpm.scene import Charge, Domain, Vector
from warp_mpm.volume import TARGET_TOLERANCE, measure_volume

BYTES_PER_PARTICLE = 400  # positions while building, state, sorting and output together, rounded up
LARGEST_VOLUME_DEVIATION = 0.2  # of a particle's volume from its lattice site's, before a warning
OUTSIDE_TOLERANCE = 1e-9  # of the domain's size

# An initial velocity: one for all particles, or a function of their positions, (n, 3) [m] to (n, 3) [m/s].
Velocity = Vector | Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Body:
    """A charge before it is cut into particles."""

    name: str
    solid: Solid
    material: Material
    particles_per_axis: int  # along each axis of every cell
    velocity: Velocity | None = None  # at the start [m/s]; None: at rest
    may_stay_unlit: bool = False  # an explosive to which no detonation needs to come

    @property
    def explosive(self) -> bool:
        """Whether it burns."""
        return self.material.burn is not None


def check_fit(where: str, bodies: Sequence[Body], domain: Domain, cell_size: np.ndarray) -> None:
    """Check that each body lies in the domain and is at least a particle across.

    Args:
        where: start of the error messages.
        bodies: what is checked.
        domain: where they must lie.
        cell_size: what the user asked for, before it was fitted to the domain, (3,) [m].

    Raises:
        InputError: one does not fit.
    """
    tolerance = OUTSIDE_TOLERANCE * np.subtract(domain.upper, domain.lower)
    particle_size = np.maximum(cell_size, domain.spacing)
    for body in bodies:
        lower, upper = body.solid.bounds()
        for axis, letter in enumerate("xyz"):
            here = f"{where}: charge {body.name!r}"
            low, high = domain.lower[axis], domain.upper[axis]
            if lower[axis] < low - tolerance[axis] or upper[axis] > high + tolerance[axis]:
                raise mistake(
                    here,
                    f"inside the domain, {letter} from {low:g} to {high:g} m",
                    f"{letter} from {lower[axis]:g} to {upper[axis]:g} m",
                    "enlarge the domain or move the charge",
                )
            size, extent = particle_size[axis] / body.particles_per_axis, upper[axis] - lower[axis]
            if size > extent * (1.0 + OUTSIDE_TOLERANCE):
                raise mistake(
                    here,
                    f"at least one particle across, {letter} extent {extent:g} m",
                    f"particles of {size:g} m",
                    "choose a smaller cell size",
                )


def cut_charges(where: str, bodies: Sequence[Body], domain: Domain) -> tuple[Charge, ...]:
    """The bodies, cut into particles on the lattices of the domain's cells.

    Raises:
        InputError: one gets no particle, two overlap, a velocity function does not give three finite numbers for each
            position, or together they need more memory than the machine has.
    """
    volumes = [measure_volume(body.solid) for body in bodies]
    lattices = [Lattice(domain, body.particles_per_axis) for body in bodies]
    counts = (volume / lattice.site_volume for (volume, _), lattice in zip(volumes, lattices, strict=True))
    _check_memory(where, sum(counts))
    charges = []
    for body, (volume, tolerance), lattice in zip(bodies, volumes, lattices, strict=True):
        positions = lattice.sites_in(body.solid)
        here = f"{where}: charge {body.name!r}"
        if len(positions) == 0:
            raise mistake(here, "at least one particle in it", "none", "choose a smaller cell size")
        velocities = _initial_velocities(f"{here}: velocity", body.velocity, positions)
        per_axis = body.particles_per_axis
        charges.append(
            Charge(
                *(body.name, body.solid, body.material, positions, volume, tolerance),
                *(per_axis, velocities, body.may_stay_unlit),
            )
        )
    for first, second in combinations(charges, 2):
        _check_apart(where, first, second)
    return tuple(charges)


def charge_warnings(charge: Charge, site_volume: float) -> list[str]:
    """What the user should know about a charge whose lattice sites have `site_volume` [m3]."""
    warnings = list(charge.material.warnings)
    deviation = charge.particle_volume / site_volume - 1.0
    if abs(deviation) > LARGEST_VOLUME_DEVIATION:
        warnings.append(
            f"charge {charge.name!r}: its {len(charge.positions)} particles are {deviation:+.0%} off their lattice's "
            "volume, because the cells resolve its shape poorly; choose a smaller cell size"
        )
    if charge.volume_tolerance > TARGET_TOLERANCE:
        warnings.append(
            f"charge {charge.name!r}: its volume is known to {charge.volume_tolerance:.1e} only, "
            "because its shape is thin for its size"
        )
    return warnings


def total_memory() -> int | None:
    """Memory of this machine [bytes]; None where the system does not tell."""
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):
        return None


def _initial_velocities(where: str, velocity: Velocity | None, positions: np.ndarray) -> np.ndarray | None:
    """Velocities (n, 3) float64 [m/s] of particles at `positions` (n, 3) [m]; None when all are at rest."""
    if velocity is None:
        return None
    if not callable(velocity):
        velocities = np.tile(np.array(velocity, dtype=float), (len(positions), 1))
    else:
        given = velocity(positions.copy())  # a copy: the function may work in place
        expected = f"a function that turns positions {positions.shape} into finite velocities {positions.shape}"
        remedy = "return three finite numbers [m/s] for each position, such as np.zeros_like(positions)"
        try:
            velocities = np.array(given, dtype=float)
        except (TypeError, ValueError):
            raise mistake(where, expected, f"one that returns {type(given).__name__}", remedy) from None
        if velocities.shape != positions.shape:
            raise mistake(where, expected, f"one that returns shape {velocities.shape}", remedy)
        wrong = ~np.isfinite(velocities).all(axis=1)
        if wrong.any():
            first = int(np.argmax(wrong))
            got, place = (", ".join(f"{value:g}" for value in row[first]) for row in (velocities, positions))
            raise mistake(where, expected, f"one that returns ({got}) at ({place}) m", remedy)
    return velocities if velocities.any() else None


def _check_memory(where: str, particle_count: float) -> None:
    """Refuse more particles than the memory holds, before any is made."""
    memory = total_memory()
    if memory is not None and particle_count * BYTES_PER_PARTICLE > memory:
        raise mistake(
            f"{where}: particles",
            f"at most {memory / BYTES_PER_PARTICLE:.2g} in this machine's {memory / 1e9:.0f} GB",
            f"{particle_count:.2g}, which need {particle_count * BYTES_PER_PARTICLE / 1e9:.0f} GB",
            "choose a larger cell size or fewer particles per axis",
        )


def _check_apart(where: str, first: Charge, second: Charge) -> None:
    """Refuse two charges that overlap."""
    if first.solid.contains(second.positions).any() or second.solid.contains(first.positions).any():
        raise mistake(
            f"{where}: charges {first.name!r} and {second.name!r}",
            "bodies apart from each other",
            "bodies that overlap",
            f"cut one out of the other: {first.name} - {second.name}",
        )
