"""Cuts bodies into charges of particles, after checking that they fit the domain, the cells and the memory."""

import functools
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from warp_mpm.checks import mistake
from warp_mpm.errors import InputError
from warp_mpm.geometry import TOUCHING, Solid, Union, certainly_apart
from warp_mpm.lattice import Lattice
from warp_mpm.materials import Material
from warp_mpm.scene import Charge, Domain, Vector
from warp_mpm.volume import TARGET_TOLERANCE, measure_volume, share_nothing

BYTES_PER_PARTICLE = 400  # positions while building, state, sorting and output together, rounded up
LARGEST_VOLUME_DEVIATION = 0.2  # of a particle's volume from its lattice site's, before a warning
OUTSIDE_TOLERANCE = 1e-9  # of the domain's size
OUT_OF_PROPORTION = 100.0  # between a charge and the domain: the unit may be wrong

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
    cut_by: tuple[str, ...] = ()  # the earlier bodies that its solid leaves out

    @property
    def explosive(self) -> bool:
        """Whether it burns."""
        return self.material.burn is not None


def fill_what_is_free(where: str, bodies: Sequence[Body]) -> tuple[Body, ...]:
    """The bodies, each without what the ones before it take: none overlap any more.

    Bodies that are apart keep their solids as they are, and with them exact distances and volumes.

    Raises:
        InputError: nothing is left of one.
    """
    filled: list[Body] = []
    for number, body in enumerate(bodies):
        earlier = [other for other in bodies[:number] if not _are_apart(body.solid, other.solid)]
        rest = body.solid - functools.reduce(Union, (other.solid for other in earlier)) if earlier else body.solid
        empty, volume = TOUCHING * _volume_of_bounds(body.solid), rest.exact_volume()
        body = replace(body, solid=rest, cut_by=tuple(other.name for other in earlier))
        if earlier and (_volume_of_bounds(rest) <= empty or (volume is not None and volume <= empty)):
            raise _no_room(f"{where}: charge {body.name!r}", body, "none, all of it lies in them")
        filled.append(body)
    return tuple(filled)


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
                    "enlarge the domain or move the charge" + _unit_hint(high - low, upper[axis] - lower[axis]),
                )
            size, extent = particle_size[axis] / body.particles_per_axis, upper[axis] - lower[axis]
            if size > extent * (1.0 + OUTSIDE_TOLERANCE):
                raise mistake(
                    here,
                    f"at least one particle across, {letter} extent {extent:g} m",
                    f"particles of {size:g} m",
                    "choose a smaller cell size" + _unit_hint(high - low, extent),
                )


def cut_charges(where: str, bodies: Sequence[Body], domain: Domain) -> tuple[Charge, ...]:
    """The bodies, cut into particles on the lattices of the domain's cells.

    Raises:
        InputError: one gets no particle, a velocity function does not give three finite numbers for each position, or
            together they need more memory than the machine has.
    """
    volumes = [measure_volume(body.solid) for body in bodies]
    lattices = [Lattice(domain, body.particles_per_axis) for body in bodies]
    counts = (volume / lattice.site_volume for (volume, _), lattice in zip(volumes, lattices, strict=True))
    _check_memory(where, sum(counts))
    charges = []
    for body, (volume, tolerance), lattice in zip(bodies, volumes, lattices, strict=True):
        positions = lattice.sites_in(body.solid)
        here = f"{where}: charge {body.name!r}"
        if body.cut_by and (len(positions) == 0 or volume <= 0.0):
            raise _no_room(here, body, "not enough for a single particle")
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
            "choose a larger cell size or fewer particles per axis, or check the units: lengths are in metres",
        )


def _are_apart(first: Solid, second: Solid) -> bool:
    """Whether two solids share nothing; those of odd shapes that touch may be taken for overlapping."""
    return certainly_apart(first, second) or share_nothing(first, second)


def _no_room(here: str, body: Body, got: str) -> InputError:
    """The error of a body that the ones before it leave no room."""
    names = ", ".join(repr(name) for name in body.cut_by)
    return mistake(here, f"room that the charges before it leave free ({names})", got, "move it, or add it before them")


def _unit_hint(room: float, extent: float) -> str:
    """What to say of an extent that is out of all proportion to the domain's [m]."""
    far = max(room, extent) > OUT_OF_PROPORTION * min(room, extent)
    return ", and check its unit: lengths are in metres, load_mesh(path, unit='mm') reads others" if far else ""


def _volume_of_bounds(solid: Solid) -> float:
    """Volume of the box around a solid [m3]."""
    lower, upper = solid.bounds()
    return float(np.prod(upper - lower))
