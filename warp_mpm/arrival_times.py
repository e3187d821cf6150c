"""Arrival times of all particles: straight where nothing is in the way, by the eikonal equation elsewhere.

A charge that is convex and touches no other explosive needs no grid. For all others there are *media*, one for each
detonation speed: the union of its charges, as signed distances on a lattice finer than the grid.
`kernels/eikonal.py` finds the ways through them.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import warp as wp

from warp_mpm.checks import mistake
from warp_mpm.ignition import Source, sources_of
from warp_mpm.kernels import arrival, eikonal
from warp_mpm.kernels.arrival import Ignition
from warp_mpm.kernels.passage import Passage
from warp_mpm.kernels.precision import NEVER, scalar, vector3
from warp_mpm.kernels.records import BurnTimes, Grid, Particles, Position
from warp_mpm.kernels.routes import Route
from warp_mpm.kernels.taut import Fan
from warp_mpm.launch import SMALLEST_SHARED_WORK, Launcher
from warp_mpm.places import cells_of
from warp_mpm.scene import Charge, Domain, Scene

LATTICE_PER_CELL = 2  # spacings of the lattice a cell: an obstacle of one cell is seen
LATTICE_MARGIN = 1.5  # of the lattice around the media [cells]
TOLERANCE = 0.02  # how deep a clear way may cut an obstacle [cells]
REACH = 0.51  # how far outside its charge a detonator may lie [cells]; half a cell, and round-off
WINDOW = 0.5  # how far the fastest wave runs while nodes are settled together [cells]
WINDOWS_AT_ONCE = 8  # between two looks at how far the waves have come
SAME_SPEED = 1e-6  # relative difference of the speeds of one medium
PARTS_A_THREAD = 8  # of a launch: some parts have far more to do than others
CHUNK = 200_000  # lattice points whose distances are computed at a time


@dataclass(frozen=True)
class Explosive:
    """A charge that burns, and what lights it."""

    charge: Charge
    speed: float  # of the detonation [m/s]
    begin: int  # its first particle
    near: tuple[Ignition, ...]  # detonators in it, or within half a cell
    remote: tuple[Ignition, ...]  # detonators elsewhere that name it: their waves run straight, whatever lies between


@dataclass(frozen=True)
class Medium:
    """Explosives of one detonation speed, lit by what lights any of them."""

    explosives: tuple[Explosive, ...]

    @property
    def speed(self) -> float:
        """Of the detonation [m/s]."""
        return self.explosives[0].speed

    @property
    def ignitions(self) -> list[Ignition]:
        """All that are in it."""
        return [ignition for explosive in self.explosives for ignition in explosive.near]

    def signed_distance(self, points: np.ndarray) -> np.ndarray:
        """Of points (n, 3) [m] to its surface (n,) [m], negative inside."""
        return np.min([explosive.charge.solid.signed_distance(points) for explosive in self.explosives], axis=0)


def light_particles(
    scene: Scene, particles: Particles, grid: Grid, launcher: Launcher, places: np.ndarray
) -> np.ndarray:
    """Set the arrival and booster times of particles that are in creation order.

    Args:
        scene: the charges and what lights them.
        particles: whose `burn_times` are set; before, they are never.
        grid: the cells.
        launcher: launches on the device where they are.
        places: where else the times are wanted (n, 3) [m].

    Returns:
        When the first wave comes to the places (n,) [s]; NaN where none does, and outside of the explosives.

    Raises:
        InputError: no wave comes to an explosive that may not stay unlit.
    """
    waves = _Waves(scene, grid, launcher)
    times = np.full(len(places), float(NEVER))
    for explosive in waves.explosives:
        waves.light(explosive, particles, explosive.begin, len(explosive.charge.positions))
        slack = TOLERANCE * min(scene.domain.spacing)
        within = np.flatnonzero(explosive.charge.solid.signed_distance(places) <= slack)
        if len(within):
            probes = _probes(scene.domain, places[within], launcher.device)
            waves.light(explosive, probes, 0, len(within))
            times[within] = np.minimum(times[within], probes.burn_times.numpy()["arrival_time"])
    _check_reached(scene, waves.explosives, particles)
    return np.where(times < float(NEVER), times, np.nan)


class _Waves:
    """What the waves of a scene are computed from: detonators, and nodes' routes where something is in the way."""

    def __init__(self, scene: Scene, grid: Grid, launcher: Launcher) -> None:
        device = launcher.device
        self.explosives = _explosives(scene)
        self._grid, self._launcher = grid, launcher
        cell = max(scene.domain.spacing)
        hindered = [one for one in self.explosives if not _is_open(one, self.explosives, cell)]
        self._media = _media(hindered)
        self._ignitions = [_array(medium.ignitions, Ignition, device) for medium in self._media]
        if hindered:
            self._passage = _passage(scene.domain, self._media, device)
            self._nodes = _nodes(scene.domain, self._media, device)
            _settle_nodes(self._passage, self._nodes, self._media, self._ignitions, launcher)

    def light(self, explosive: Explosive, particles: Particles, begin: int, count: int) -> None:
        """Set the arrival and booster times of `count` particles of an explosive, from `begin` on."""
        medium = next((n for n, medium in enumerate(self._media) if explosive in medium.explosives), None)
        straight = explosive.remote if medium is not None else explosive.near + explosive.remote
        if straight:
            ignitions = _array(straight, Ignition, self._launcher.device)
            inputs = [particles, self._grid, ignitions, explosive.speed]
            _launch(self._launcher, arrival.light, count, inputs, begin)
        if medium is not None:
            inputs = [particles, self._grid, self._passage, self._nodes, self._ignitions[medium], medium]
            _launch(self._launcher, eikonal.light_around, count, inputs, begin)


def _probes(domain: Domain, places: np.ndarray, device: wp.Device) -> Particles:
    """Particles that are nothing but places (n, 3) [m], not yet lit."""
    position = np.zeros(len(places), dtype=Position.numpy_dtype())
    position["cell"], position["fraction"] = cells_of(domain, places)
    times = np.zeros(len(places), dtype=BurnTimes.numpy_dtype())
    for name in BurnTimes.vars:
        times[name] = NEVER
    probes = Particles()
    probes.position = wp.array(position, dtype=Position, device=device)
    probes.burn_times = wp.array(times, dtype=BurnTimes, device=device)
    return probes


def _explosives(scene: Scene) -> list[Explosive]:
    """The charges that burn."""
    found, begin = [], 0
    spacing = max(scene.domain.spacing)
    for charge in scene.charges:
        if charge.material.burn is not None:
            near, remote = sources_of(scene.detonators, charge, spacing)
            ignitions = (tuple(_ignition(scene.domain, source, spacing) for source in part) for part in (near, remote))
            found.append(Explosive(charge, charge.material.burn.detonation_speed, begin, *ignitions))
        begin += len(charge.positions)
    return found


def _ignition(domain: Domain, source: Source, booster_radius: float) -> Ignition:
    """A source as the kernels take it."""
    ignition = Ignition()
    ignition.position = vector3(*(np.array(source.position) - domain.lower))
    ignition.along = vector3(*source.along)
    ignition.normal = vector3(*source.normal)
    ignition.radius = source.radius
    ignition.time = source.time
    ignition.delay = source.delay
    ignition.booster_radius = booster_radius if source.booster else 0.0
    return ignition


def _is_open(explosive: Explosive, explosives: Sequence[Explosive], cell: float) -> bool:
    """Whether nothing can be in the way: it is convex, and no other explosive comes within a cell [m]."""
    if not explosive.charge.solid.convex:
        return False
    lower, upper = explosive.charge.solid.bounds()
    others = [one.charge.solid.bounds() for one in explosives if one is not explosive]
    return all(np.any(low > upper + cell) or np.any(high < lower - cell) for low, high in others)


def _media(explosives: Sequence[Explosive]) -> list[Medium]:
    """The explosives by their speeds."""
    by_speed: list[list[Explosive]] = []
    for explosive in sorted(explosives, key=lambda one: one.speed):
        if by_speed and explosive.speed <= by_speed[-1][0].speed * (1.0 + SAME_SPEED):
            by_speed[-1].append(explosive)
        else:
            by_speed.append([explosive])
    return [Medium(tuple(group)) for group in by_speed]


def _settle_nodes(
    passage: Passage,
    nodes: eikonal.Nodes,
    media: Sequence[Medium],
    ignitions: Sequence[wp.array],
    launcher: Launcher,
) -> None:
    """Give all nodes to which waves come their routes, around what is in the way and through several explosives."""
    wp.launch(eikonal.place_nodes, (len(media), nodes.count), inputs=[passage, nodes], device=launcher.device)
    for number, lit_by in enumerate(ignitions):
        _launch(launcher, eikonal.light_nodes, nodes.count, [passage, nodes, number, lit_by])
    _run_waves(passage, nodes, max(medium.speed for medium in media), launcher)


def _run_waves(passage: Passage, nodes: eikonal.Nodes, fastest: float, launcher: Launcher) -> None:
    """Settle all nodes to which a wave comes, in the order of their times."""
    device = launcher.device
    open_nodes = _array(_open_nodes(nodes), int, device)
    duration = WINDOW * float(nodes.size) / fastest
    window, end = 0, 0.0
    following = wp.zeros(1, dtype=scalar, device=device)
    while True:
        following.fill_(NEVER)
        wp.launch(eikonal.find_next, len(open_nodes), inputs=[nodes, open_nodes, following], device=device)
        earliest = float(following.numpy()[0])
        if earliest >= float(NEVER):
            break
        end = max(end, earliest)
        for _ in range(WINDOWS_AT_ONCE):
            end += duration
            window += 1
            _launch(launcher, eikonal.settle, len(open_nodes), [nodes, open_nodes, window, end])
            _launch(launcher, eikonal.spread, len(open_nodes), [passage, nodes, open_nodes, window])
    wp.launch(eikonal.look_around, len(nodes.certain), inputs=[nodes], device=device)
    _launch(launcher, eikonal.spread_fans, len(open_nodes), [passage, nodes, open_nodes])


def _launch(launcher: Launcher, kernel: wp.Kernel, count: int, inputs: Sequence[object], begin: int = 0) -> None:
    """Launch a kernel that takes the first of its indices last, in parts that the launcher's threads share."""
    shared = launcher.threads > 1 and count >= SMALLEST_SHARED_WORK
    parts = launcher.threads * PARTS_A_THREAD if shared else 1
    cuts = np.linspace(0, count, parts + 1).astype(int)
    pairs = [(int(low), int(high)) for low, high in pairwise(cuts) if high > low]
    tasks = [[launcher.record(kernel, high - low, [*inputs, begin + low])] for low, high in pairs]
    launcher.run(tasks, count)


def _open_nodes(nodes: eikonal.Nodes) -> np.ndarray:
    """Indices of the nodes whose times are not certain, and of their neighbors (n,)."""
    shape = (nodes.media, *nodes.cells)
    present = (nodes.window.numpy() != int(eikonal.ABSENT)).reshape(shape)
    wanted = present & (nodes.certain.numpy() == 0).reshape(shape)
    near = wanted.any(axis=0)
    for axis in range(3):
        near = np.moveaxis(near, axis, 0)
        spread = near.copy()
        spread[1:] |= near[:-1]
        spread[:-1] |= near[1:]
        near = np.moveaxis(spread, 0, axis)
    return np.flatnonzero(present & near).astype(np.int32)


def _bounds(media: Sequence[Medium]) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper corner of the box around all of them, (3,) each [m]."""
    boxes = np.array([one.charge.solid.bounds() for medium in media for one in medium.explosives])
    return boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)


def _passage(domain: Domain, media: Sequence[Medium], device: wp.Device) -> Passage:
    """The media, measured on the lattice."""
    cell = np.array(domain.spacing)
    spacing = cell / LATTICE_PER_CELL
    lower, upper = _bounds(media)
    first = np.floor((lower - domain.lower) / cell - LATTICE_MARGIN) * LATTICE_PER_CELL  # lattice points on faces
    points = np.ceil((upper - domain.lower) / spacing + LATTICE_MARGIN * LATTICE_PER_CELL - first).astype(int) + 1
    # What ends at a face of the domain goes on behind it, as in a mirror: half a cell before it no face is seen.
    places = (
        np.clip((first[n] + np.arange(points[n])) / LATTICE_PER_CELL, 0.5, domain.cells[n] - 0.5) for n in range(3)
    )
    axes = [domain.lower[n] + place * cell[n] for n, place in enumerate(places)]
    layers = max(1, CHUNK // int(points[1] * points[2]))
    distance = [
        medium.signed_distance(np.stack(np.meshgrid(part, axes[1], axes[2], indexing="ij"), axis=-1).reshape(-1, 3))
        for medium in media
        for part in np.split(axes[0], range(layers, points[0], layers))
    ]
    passage = Passage()
    passage.distance = wp.array(np.concatenate(distance), dtype=scalar, device=device)
    passage.speed = wp.array([medium.speed for medium in media], dtype=scalar, device=device)
    passage.points = wp.vec3i(*(int(n) for n in points))
    passage.count = int(np.prod(points))
    passage.lower = vector3(*(first * spacing))
    passage.spacing = vector3(*spacing)
    passage.inverse_spacing = vector3(*(1.0 / spacing))
    passage.step = float(spacing.min()) / 2.0
    passage.reach = REACH * float(cell.max())
    passage.tolerance = TOLERANCE * float(cell.min())
    return passage


def _nodes(domain: Domain, media: Sequence[Medium], device: wp.Device) -> eikonal.Nodes:
    """Nodes without places and waves, in a box of cells around the media."""
    cell = np.array(domain.spacing)
    lower, upper = ((corner - domain.lower) / cell for corner in _bounds(media))
    first = np.clip(np.floor(lower) - 1, 0, domain.cells).astype(int)
    cells = np.clip(np.ceil(upper) + 1, 0, domain.cells).astype(int) - first
    nodes = eikonal.Nodes()
    nodes.first, nodes.cells = (wp.vec3i(*(int(n) for n in numbers)) for numbers in (first, cells))
    nodes.count, nodes.media = int(np.prod(cells)), len(media)
    nodes.spacing, nodes.size = vector3(*cell), float(cell.min())
    total = nodes.count * nodes.media
    nodes.place = wp.zeros(total, dtype=vector3, device=device)
    nodes.route = wp.zeros(total, dtype=Route, device=device)
    nodes.fan = wp.zeros(total, dtype=Fan, device=device)
    nodes.window = wp.zeros(total, dtype=int, device=device)
    nodes.touched = wp.zeros(total, dtype=int, device=device)
    nodes.certain = wp.zeros(total, dtype=int, device=device)
    return nodes


def _check_reached(scene: Scene, explosives: Sequence[Explosive], particles: Particles) -> None:
    """Refuse explosive that no wave comes to, unless it may stay unlit."""
    if not explosives:
        return
    times = particles.burn_times.numpy()["arrival_time"]
    for explosive in explosives:
        charge = explosive.charge
        unlit = times[explosive.begin : explosive.begin + len(charge.positions)] >= float(NEVER)
        if unlit.any() and not charge.may_stay_unlit:
            x, y, z = charge.positions[np.argmax(unlit)]
            raise mistake(
                f"scene {scene.name}: charge {charge.name!r}",
                "a detonation wave that comes to all of it",
                f"none at {unlit.sum()} of its {len(unlit)} particles, the first at ({x:g}, {y:g}, {z:g}) m",
                "put a detonator there, or set may_stay_unlit",
            )


def _array(values: Sequence[object] | np.ndarray, dtype: type, device: wp.Device) -> wp.array:
    return wp.array(values, dtype=dtype, device=device) if len(values) else wp.zeros(0, dtype=dtype, device=device)
