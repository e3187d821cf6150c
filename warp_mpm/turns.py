"""Runs that several threads of a process ask for take turns: Warp is not made for two at a time.

Where two threads are the first to launch a kernel, Warp 1.19 loads its module twice, and unloads the one that came
first, which its thread goes on to run: the process crashes. On a GPU, what one thread launches while the other records
its step would become part of that.
"""

import functools
import threading
from collections.abc import Callable
from typing import ParamSpec, TypeVar

Arguments = ParamSpec("Arguments")
Returned = TypeVar("Returned")

_turn = threading.RLock()


def taking_turns(function: Callable[Arguments, Returned]) -> Callable[Arguments, Returned]:
    """The function, of which, and of all others that take turns, one thread at a time runs one; the others wait."""

    @functools.wraps(function)
    def in_turn(*positional: Arguments.args, **named: Arguments.kwargs) -> Returned:
        with _turn:
            return function(*positional, **named)

    return in_turn
