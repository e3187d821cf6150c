"""The exceptions that a user may meet: mistakes in the input, runs that cannot go on, runs that were stopped."""

import signal


class InputError(ValueError):
    """A mistake in the input: one line that says what, where, expected, got, and the remedy.

    The command line prints it without a traceback and exits with code 2.
    """


class SimulationError(RuntimeError):
    """The run cannot go on: one line that says when, where, what happened, and what to try."""


class VerificationError(RuntimeError):
    """A verification problem's bound is broken: one line that names each, what was expected and what came."""


class Terminated(SystemExit):
    """The run was asked to end (SIGTERM) and did so in good order; a script that does not catch it exits with 143."""

    def __init__(self, text: str) -> None:
        super().__init__(128 + signal.SIGTERM)  # as shells have it
        self.text = text

    def __str__(self) -> str:
        return self.text
