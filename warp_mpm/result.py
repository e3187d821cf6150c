"""What `simulate` gives back."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from warp_mpm.output.frame import SectionPicture, StepRecord
from warp_mpm.state import State


@dataclass(frozen=True)
class Result:
    """What a run gives back.

    Pickled, as `multiprocessing` does with what a process returns, it leaves its `state` behind.

    Attributes:
        summary: as in summary.json.
        history: as in history.csv, one row a frame.
        record: every step: peaks, gauges, pressures along lines and on the section.
        pictures: the section at the scene's picture instants.
        state: all particles and the grid at the end; it takes nearly all memory of the run, for as long as the result
            is kept.
        output: the run directory; None if nothing was written.
    """

    summary: dict[str, Any] = field(repr=False)
    history: list[dict[str, float]] = field(repr=False)
    record: StepRecord = field(repr=False)
    pictures: tuple[SectionPicture, ...] = field(repr=False)
    state: State = field(repr=False)
    output: Path | None

    def __getstate__(self) -> dict[str, Any]:
        """All but the state, which is on the device."""
        return {name: value for name, value in vars(self).items() if name != "state"}
