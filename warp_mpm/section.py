"""The field pressure on the scene's section plane: now, and what of its past is worth keeping."""

from collections.abc import Mapping

import numpy as np
import warp as wp

from warp_mpm.kernels.precision import NEVER, scalar
from warp_mpm.kernels.record import record_section
from warp_mpm.output.frame import SectionRecord
from warp_mpm.scene import Scene
from warp_mpm.state import NUMBER, State


def section_pressure(state: State) -> np.ndarray:
    """Field pressure (nodes_u, nodes_v) [Pa] at the nodes of the section plane.

    Between two layers of nodes it is interpolated linearly.
    """
    pressure = state.field_pressure()
    axis = state.model.scene.section.axis
    below, share = _layer(state.model.scene)
    low = np.take(pressure, below, axis=axis)
    high = np.take(pressure, below + 1, axis=axis)
    return (1 - share) * low + share * high


class SectionRecorder:
    """Keeps the highest pressure and the arrival of a front at every node of the section plane, on the device."""

    def __init__(self, state: State, threshold: float | None) -> None:
        """Begin before the first step; the front has arrived where the pressure has reached a threshold [Pa].

        Without a threshold nothing ever arrives.
        """
        scene, grid = state.model.scene, state.grid
        below, share = _layer(scene)
        strides = (int(grid.stride_x), int(grid.stride_y), 1)
        first, second = scene.section.in_plane
        corner = sum(strides) + below * strides[scene.section.axis]  # the ghosts come before the domain's first node
        shape = (scene.domain.cells[first] + 1, scene.domain.cells[second] + 1)
        self._last = wp.zeros(shape, dtype=scalar, device=state.device)
        self._peak = wp.zeros(shape, dtype=scalar, device=state.device)
        self._arrival = wp.full(shape, NEVER, dtype=scalar, device=state.device)
        plane = [corner, strides[first], strides[second], strides[scene.section.axis], share]
        limit = np.inf if threshold is None else threshold
        inputs = [grid, state.clock, *plane, limit, self._last, self._peak, self._arrival]
        self._expected = state.expected.section
        self._launch = wp.launch(record_section, shape, inputs=inputs, device=state.device, record_cmd=True)

    def record(self) -> None:
        """Take the state as it is now into account: once before the first step, then after each."""
        self._launch.launch()

    def saved(self) -> dict[str, np.ndarray]:
        """Everything kept so far, for `restore`."""
        return {name: array.numpy().copy() for name, array in self._arrays().items()}

    def restore(self, saved: Mapping[str, np.ndarray]) -> None:
        """Go on from what `saved` gave.

        Raises:
            KeyError, ValueError: it is not of this scene.
        """
        for name, array in self._arrays().items():
            if saved[name].shape != array.shape:
                raise ValueError(f"section: {name}: {saved[name].shape} instead of {array.shape}")
            array.assign(saved[name])

    def _arrays(self) -> dict[str, wp.array]:
        return {"last": self._last, "peak": self._peak, "arrival": self._arrival}

    def result(self) -> SectionRecord:
        """What was kept so far."""
        arrival = self._arrival.numpy()
        came = np.where(arrival < NEVER, arrival, NUMBER.type(np.nan))
        return SectionRecord(self._peak.numpy().copy(), came, self._expected)


def _layer(scene: Scene) -> tuple[int, np.floating]:
    """The layer of nodes below the section plane, and how much of a cell above it the plane is."""
    domain, plane = scene.domain, scene.section
    place = (plane.coordinate - domain.lower[plane.axis]) / domain.spacing[plane.axis]
    below = int(np.clip(np.floor(place), 0, domain.cells[plane.axis] - 1))
    return below, NUMBER.type(place - below)
