"""What a person who waits for the problems sees: a bar for the level that runs, or a line a level."""

import time as wall_clock

from rich.console import Console
from rich.progress import BarColumn, TaskProgressColumn, TextColumn, TimeRemainingColumn
from rich.progress import Progress as Bar

from warp_mpm.progress import Progress

SECONDS_BETWEEN_LINES = 20.0


def level_progress(console: Console) -> Progress:
    """A bar that vanishes with its level if the console is a terminal, else plain lines."""
    return LevelBar(console) if console.is_terminal else LevelLines(console)


class LevelBar:
    """A bar with the name of the level."""

    def __init__(self, console: Console) -> None:
        """A bar on `console`; it appears with the first message."""
        columns = (TextColumn("{task.description}", markup=False), BarColumn(), TaskProgressColumn())
        self._bar = Bar(*columns, TimeRemainingColumn(compact=True), console=console, transient=True)

    def message(self, text: str) -> None:
        """A new level begins."""
        for task in self._bar.task_ids:
            self._bar.remove_task(task)
        self._bar.add_task(text, total=None)
        self._bar.start()

    def update(self, time: float, end_time: float, step: int, note: str) -> None:
        """The level has reached `time` [s] of `end_time` [s]."""
        if self._bar.task_ids:
            self._bar.update(self._bar.task_ids[0], completed=time, total=end_time)

    def close(self) -> None:
        """Take the bar away."""
        self._bar.stop()
        for task in self._bar.task_ids:
            self._bar.remove_task(task)


class LevelLines:
    """A line where a level begins, and one now and then in a long one."""

    def __init__(self, console: Console) -> None:
        """Lines on `console`."""
        self._console = console
        self._printed = 0.0

    def message(self, text: str) -> None:
        """A new level begins."""
        self._printed = wall_clock.monotonic()
        self._console.print(f"solving {text}", markup=False, highlight=False, soft_wrap=True)

    def update(self, time: float, end_time: float, step: int, note: str) -> None:
        """The level has reached `time` [s] of `end_time` [s]."""
        now = wall_clock.monotonic()
        if now - self._printed >= SECONDS_BETWEEN_LINES and time < end_time:
            self._printed = now
            self._console.print(f"  {time / end_time:.0%}, step {step}", markup=False, highlight=False)

    def close(self) -> None:
        """Nothing to close."""
