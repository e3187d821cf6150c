"""Saved frames made without a solver, with other numbers in every place, and the USD file of a run that has them."""

import numpy as np
from scenes_for_tests import OPEN

from warp_mpm.output.frame import Frame
from warp_mpm.output.usd import UsdWriter

FRAMES = 3
TIMES = (0.0, 1.1e-5, 2.3e-5)
FIELDS = ("density", "particleVelocity")


def frame(scene, index, time=None):
    """Values that differ from particle to particle, node to node and frame to frame; of a free block, some leave."""
    count = scene.particle_count
    nodes = [scene.domain.cells[axis] + 1 for axis in scene.section.in_plane]
    inside = np.ones(count, dtype=bool)
    if scene.walls == OPEN:
        inside[5 : 5 + 10 * index] = False
    random = np.random.default_rng(index)
    return Frame(
        index,
        TIMES[index] if time is None else time,
        (scene.charges[0].positions + 0.001 * index).astype(np.float32),
        random.uniform(0.0, 1e9, count).astype(np.float32),
        inside,
        random.uniform(0.0, 1e9, nodes).astype(np.float32),
        {
            "density": random.uniform(1.0, 2.0, count).astype(np.float32),
            "particleVelocity": random.normal(size=(count, 3)).astype(np.float32),
        },
    )


def written(directory, scene, frames=FRAMES):
    """A writer that has written some frames and is not closed."""
    path = directory / "block.usdc"
    writer = UsdWriter(path, scene, pressure_range=(0.0, 1e9), frames=FRAMES, fields=FIELDS)
    for index in range(frames):
        writer.write(frame(scene, index))
    return writer
