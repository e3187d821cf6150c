"""Shows the progress of a run: a bar with the time left on a terminal, a line every tenth of the run elsewhere."""

import time as wall_clock

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

from warp_mpm.progress import Progress as ProgressProtocol

LINES = 10  # that a run without a terminal writes, if none of them is long in coming
LONGEST_SILENCE = 30.0  # [s]
MICROSECOND = 1e-6  # [s]


def progress_on(console: Console | None = None) -> ProgressProtocol:
    """A bar if the console, standard output if not given, is a terminal, else plain lines; for `simulate`."""
    console = console or Console()
    return ProgressBar(console) if console.is_terminal else ProgressLines(console)


class ProgressBar:
    """A bar that is redrawn in place, with the time left."""

    def __init__(self, console: Console) -> None:
        """A bar on `console`; it appears with the first update."""
        self._console = console
        self._bar = self._new_bar()

    def message(self, text: str) -> None:
        """Print a line above the bar."""
        self._console.print(text, markup=False, highlight=False)

    def update(self, time: float, end_time: float, step: int, note: str) -> None:
        """Move the bar to `time` [s] of `end_time` [s]."""
        if not self._bar.tasks:
            self._bar.add_task("", total=end_time)
            self._bar.start()
        self._bar.update(self._bar.task_ids[0], completed=time, description=_state(time, end_time, step, note))

    def close(self) -> None:
        """Leave the bar as it is; another run gets another one."""
        self._bar.stop()
        self._bar = self._new_bar()

    def _new_bar(self) -> Progress:
        return Progress(
            BarColumn(),
            TaskProgressColumn(),
            TextColumn("{task.description}", markup=False),
            TimeRemainingColumn(compact=True, elapsed_when_finished=True),
            console=self._console,
        )


class ProgressLines:
    """A line at the start, at every tenth of the run or half a minute, and at its end."""

    def __init__(self, console: Console) -> None:
        """Lines on `console`."""
        self._console = console
        self._started = 0.0  # by the clock on the wall, as the share of the run then [s]
        self._started_at = 0.0
        self._said = 0.0  # when the last line was written [s]
        self._printed = -1  # tenths of the run

    def message(self, text: str) -> None:
        """Print a line."""
        self._console.print(text, markup=False, highlight=False, soft_wrap=True)

    def update(self, time: float, end_time: float, step: int, note: str) -> None:
        """Print a line if the run at `time` [s] of `end_time` [s] has entered another tenth, or was long silent."""
        share, now = min(time / end_time, 1.0), wall_clock.monotonic()
        tenth = int(share * LINES)
        if tenth == self._printed and now - self._said < LONGEST_SILENCE:
            return
        left = ""
        if self._printed < 0:
            self._started, self._started_at = now, share
        elif self._started_at < share < 1.0:
            left = f"  {(now - self._started) * (1.0 - share) / (share - self._started_at):.0f} s left"
        self._printed, self._said = tenth, now
        self.message(f"{share:4.0%}  {_state(time, end_time, step, note)}{left}")

    def close(self) -> None:
        """Another run begins anew."""
        self._printed = -1


def _state(time: float, end_time: float, step: int, note: str) -> str:
    """Where the run is, in a few words."""
    return f"{time / MICROSECOND:.1f} of {end_time / MICROSECOND:.1f} us  step {step}  {note}"
