"""Starts Warp without its greeting, and without its notice on standard error that there is no GPU."""

import functools
import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager

import warp as wp

_starting = threading.Lock()  # two threads that swap standard error at a time would leave it dropped


def start_quietly() -> None:
    """Initialize Warp. What it prints on the way is dropped; its later warnings are not."""
    with _starting:
        _start()


@functools.cache
def _start() -> None:
    wp.config.log_level = wp.LOG_WARNING
    with _standard_error_dropped():
        wp.init()


@contextmanager
def _standard_error_dropped() -> Iterator[None]:
    """Send file descriptor 2 nowhere for a while: the notice comes from C, past `sys.stderr`."""
    kept = os.dup(2)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 2)
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nowhere)
