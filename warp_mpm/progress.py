"""What a long run tells the person who waits for it."""

import math
from typing import Protocol, runtime_checkable

from warp_mpm.kernels.precision import PRECISION
from warp_mpm.scene import Scene


@runtime_checkable
class Progress(Protocol):
    """Receives the state of a run; `simulate` calls it often, the receiver decides how often to draw.

    It may be given to one run after the other.
    """

    def message(self, text: str) -> None:
        """Say one line, for example what is being prepared."""

    def update(self, time: float, end_time: float, step: int, note: str) -> None:
        """The run has reached `time` [s] of `end_time` [s] after `step` steps; `note` is a short figure to show."""

    def close(self) -> None:
        """The run is over, whatever way it ended."""


class Silent:
    """Says nothing."""

    def message(self, text: str) -> None:
        """Say nothing."""

    def update(self, time: float, end_time: float, step: int, note: str) -> None:
        """Say nothing."""

    def close(self) -> None:
        """Nothing to close."""


def opening(scene: Scene, device: str, threads: int) -> str:
    """What a run begins with: how large it is, where it is computed, and what is odd about the scene."""
    shared = f"{threads} thread" + ("" if threads == 1 else "s")
    size = f"{scene.particle_count:,} particles in {math.prod(scene.domain.cells):,} cells"
    first = f"{scene.name}: {size} on {device}, {shared}, in {PRECISION} precision; preparing kernels"
    return "\n".join([first, *(f"warning: {text}" for text in scene.warnings)])
