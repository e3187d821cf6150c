"""What a long run tells the person who waits for it."""

from typing import Protocol


class Progress(Protocol):
    """Receives the state of a run; `simulate` calls it often, the receiver decides how often to draw."""

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
