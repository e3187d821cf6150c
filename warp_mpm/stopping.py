"""Stops in good order: Ctrl-C (SIGINT) and SIGTERM wait for the end of a step."""

import signal
import threading
import time
from types import FrameType, TracebackType
from typing import Any

from warp_mpm.errors import Terminated

SIGNALS = (signal.SIGINT, signal.SIGTERM)
TOGETHER = 1.0  # signals in so short a time are one request [s]


class StopRequest:
    """Notes that the run is asked to stop, inside a `with` statement; asked again, after a second, it stops at once.

    Before that it is the same request: a pool whose processes Ctrl-C has reached sends them SIGTERM, too. Signals reach
    the main thread alone: in another one nothing is noted.
    """

    def __init__(self) -> None:
        self.signal: signal.Signals | None = None  # that has come first
        self._came = 0.0  # when [s]
        self._before: dict[signal.Signals, Any] = {}  # handlers

    def __enter__(self) -> "StopRequest":
        """Begin to take note."""
        if threading.current_thread() is threading.main_thread():
            self._before = {number: signal.signal(number, self._note) for number in SIGNALS}
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        """Leave signals to those who had them before."""
        self._restore()

    def exception(self, text: str) -> BaseException:
        """What to raise when the run has stopped: KeyboardInterrupt for SIGINT, else `Terminated`."""
        return Terminated(text) if self.signal is signal.SIGTERM else KeyboardInterrupt(text)

    def _note(self, number: int, _frame: FrameType | None) -> None:
        if self.signal is None:
            self.signal, self._came = signal.Signals(number), time.monotonic()
        elif time.monotonic() - self._came > TOGETHER:
            self._restore()
            signal.raise_signal(number)

    def _restore(self) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler if handler is not None else signal.SIG_DFL)
        self._before = {}
