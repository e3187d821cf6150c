"""Stops in good order: Ctrl-C (SIGINT) and SIGTERM wait for the end of a step."""

import signal
import threading
from types import FrameType, TracebackType
from typing import Any

from warp_mpm.errors import Terminated

SIGNALS = (signal.SIGINT, signal.SIGTERM)


class StopRequest:
    """Notes that the run is asked to stop, inside a `with` statement; asked again, it stops at once.

    Signals reach the main thread alone: in another one nothing is noted.
    """

    def __init__(self) -> None:
        self.signal: signal.Signals | None = None  # that has come
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
        self.signal = signal.Signals(number)
        self._restore()

    def _restore(self) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler if handler is not None else signal.SIG_DFL)
        self._before = {}
