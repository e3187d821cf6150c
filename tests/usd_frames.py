"""A scene and frames of scenes that nobody solved, for tests of the USD file and of what is exported from it."""

from pathlib import Path
from typing import Any

import numpy as np
from scenes_for_tests import OPEN, block

from warp_mpm.detonators import CordDetonator, LineDetonator, PlaneDetonator, PointDetonator, SphereDetonator
from warp_mpm.output.frame import Frame, Surface
from warp_mpm.output.usd import UsdWriter
from warp_mpm.places import section_nodes
from warp_mpm.scene import Scene

RANGE = (0.0, 4.0e9)  # [Pa]
FIELDS = ("density", "particleVelocity")
FRAMES = 3
LEFT = 5  # the particle that leaves, in the last frame, if faces are open
END_TIME = 20e-6  # [s]
TIMES = [END_TIME * index / (FRAMES - 1) for index in range(FRAMES)]


def open_scene() -> Scene:
    """A plate of 8 x 6 x 2 cells in vacuum, with a delayed point detonator, a plane, a cord, a sphere and a line."""
    detonators = (
        PointDetonator((0.0, 0.03, 0.01), time=1e-6),
        PlaneDetonator((0.08, 0.0, 0.0), (1.0, 0.0, 0.0), time=2e-6),
        CordDetonator(((0.01, 0.05, 0.01), (0.03, 0.05, 0.01), (0.04, 0.03, 0.01)), speed=7000.0, time=3e-6),
        SphereDetonator((0.05, 0.02, 0.01), 0.008, time=4e-6),
        LineDetonator((0.06, 0.05, 0.0), (0.06, 0.05, 0.02), time=5e-6),
    )
    return block((8, 6, 2), detonators=detonators, walls=OPEN, margin_cells=2, end_time=END_TIME)


def section_of(scene: Scene) -> np.ndarray:
    """A pressure [Pa] that names its node: 1e6 i + 1e3 j."""
    nodes = [scene.domain.cells[axis] + 1 for axis in scene.section.in_plane]
    i, j = np.indices(nodes)
    return (1e6 * i + 1e3 * j).astype(np.float32)


def arrival_of(scene: Scene) -> np.ndarray:
    """Arrival times [s] that say how far a node is from a corner of the section, and that it is not in its middle."""
    nodes = section_nodes(scene)
    times = np.linalg.norm(nodes - nodes[0, 0], axis=-1) / 2800.0
    times[5:7, 4:6] = np.nan
    return times


def surface_of(index: int) -> Surface:
    """Nothing at first, then pyramids with more and more sides."""
    if index == 0:
        return Surface(np.empty((0, 3), dtype=np.float32), np.empty((0, 3), dtype=np.int32))
    sides = index + 2
    angle = 2.0 * np.pi * np.arange(sides) / sides
    rim = np.stack([np.cos(angle), np.sin(angle), np.zeros(sides)], axis=1)
    points = 1e-2 * np.concatenate([rim, [[0.0, 0.0, 1.0]]])
    corner = np.arange(sides)
    triangles = np.stack([corner, (corner + 1) % sides, np.full(sides, sides)], axis=1)
    return Surface(points.astype(np.float32), triangles.astype(np.int32))


def frame_of(scene: Scene, index: int) -> Frame:
    """Gas that drifts along x, with pressures in and beyond the range; one particle may leave in the last frame."""
    count = scene.particle_count
    position = np.concatenate([charge.positions for charge in scene.charges]) + index * np.array([1e-3, 0.0, 0.0])
    inside = np.ones(count, dtype=bool)
    inside[LEFT] = index < FRAMES - 1 or scene.walls != OPEN
    fields = {
        "density": np.linspace(900.0, 1100.0, count, dtype=np.float32),
        "particleVelocity": np.full((count, 3), index, dtype=np.float32),
    }
    pressure = np.linspace(-1e9, 5e9, count, dtype=np.float32) * np.float32(index + 1)
    place = position.astype(np.float32)
    return Frame(index, TIMES[index], place, pressure, inside, section_of(scene), fields, surface_of(index))


def written(path: Path, scene: Scene, frames: int = FRAMES, **options: Any) -> UsdWriter:
    """A writer after some frames, not closed."""
    writer = UsdWriter(path, scene, pressure_range=RANGE, frames=FRAMES, fields=FIELDS, **options)
    for index in range(frames):
        writer.write(frame_of(scene, index))
    return writer
