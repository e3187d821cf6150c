"""The one exception for mistakes a user can make, and the one warning for what a user should know."""


class InputError(ValueError):
    """A mistake in the input: one line that says what, where, expected, got, and the remedy.

    The command line prints it without a traceback and exits with code 2.
    """


class SimulationError(RuntimeError):
    """The run cannot go on: one line that says when, where, what happened, and what to try."""


class VerificationError(RuntimeError):
    """A verification problem's bound is broken: one line that names each, what was expected and what came."""
