"""Checks of single values that a user gives; each error is one line: where, expected, got."""

import os
from collections.abc import Callable, Iterable
from difflib import get_close_matches
from enum import Enum
from numbers import Integral
from pathlib import Path
from typing import Any, TypeVar

from warp_mpm.errors import InputError
from warp_mpm.kernels.numbers import is_number

Vector = tuple[float, float, float]
Number = TypeVar("Number", int, float)
Member = TypeVar("Member", bound=Enum)

LARGEST_COUNT = 2**31 - 1
LONGEST = 80  # characters of a wrong value that a message shows


def mistake(where: str, expected: str, got: object, remedy: str = "") -> InputError:
    """The error to raise when a value is wrong: one line that says where, expected, got, and the remedy if any."""
    return InputError(f"{where}: expected {expected}, got {got}" + (f"; {remedy}" if remedy else ""))


def closest_match(name: str, known: Iterable[str], prefix: str = "") -> str:
    """The remedy for a misspelt name: "did you mean ...?", or nothing when no known name is near.

    Args:
        name: as it was given.
        known: the names there are.
        prefix: what the remedy puts before a known name, and is not compared.
    """
    plain = {plain_name(one): one for one in known}
    matches = get_close_matches(plain_name(name), list(plain), n=1)
    return f"did you mean {prefix}{plain[matches[0]]}?" if matches else ""


def plain_name(name: str) -> str:
    """A name without what is easily mistaken: capitals, and signs between words."""
    return "".join(letter for letter in name.lower() if letter.isalnum())


def shortened(value: Any) -> str:
    """How a wrong value is shown in a message: in one line that is not too long."""
    shown = " ".join(repr(value).split())
    return shown if len(shown) <= LONGEST else f"{shown[:LONGEST]}..."


def finite(where: str, value: Any, expected: str = "a finite number") -> float:
    """`value` as a float.

    Raises:
        InputError: it is not a finite real number.
    """
    if not is_number(value):
        raise mistake(where, expected, shortened(value))
    return float(value)


def positive(where: str, value: Any) -> float:
    """`value` as a float above zero.

    Raises:
        InputError: it is not a finite number above zero.
    """
    expected = "a positive number"
    number = finite(where, value, expected)
    if number <= 0.0:
        raise mistake(where, expected, shortened(value))
    return number


def not_negative(where: str, value: Any) -> float:
    """`value` as a float of at least zero.

    Raises:
        InputError: it is not a finite number of at least zero.
    """
    expected = "a number of at least 0"
    number = finite(where, value, expected)
    if number < 0.0:
        raise mistake(where, expected, shortened(value))
    return number


def count(where: str, value: Any) -> int:
    """`value` as an int of at least one.

    Raises:
        InputError: it is not a whole number of at least one, or one that 32 bits do not hold.
    """
    if not isinstance(value, Integral) or isinstance(value, bool) or value < 1:
        raise mistake(where, "a whole number of at least 1", shortened(value))
    if int(value) > LARGEST_COUNT:
        raise mistake(where, f"at most {LARGEST_COUNT}", shortened(value))
    return int(value)


def flag(where: str, value: Any) -> bool:
    """`value` itself.

    Raises:
        InputError: it is neither True nor False.
    """
    return bool(instance(where, value, bool, "True or False"))


def as_path(where: str, value: Any) -> Path:
    """`value` as a path.

    Raises:
        InputError: it is neither a text nor a path.
    """
    return Path(instance(where, value, (str, os.PathLike), "a path"))


def names(where: str, value: Any) -> tuple[str, ...]:
    """`value` as a tuple of texts.

    Raises:
        InputError: it is not several texts; one alone is refused too.
    """
    parts = tuple(value) if isinstance(value, Iterable) and not isinstance(value, str) else (None,)
    if not all(isinstance(part, str) for part in parts):
        raise mistake(where, 'names in a tuple, such as ("a", "b")', shortened(value))
    return parts


def vector(where: str, value: Any, remedy: str = "") -> Vector:
    """`value` as three floats.

    Raises:
        InputError: it is not three finite numbers.
    """
    expected = "three finite numbers"
    parts = tuple(value) if isinstance(value, Iterable) and not isinstance(value, str) else ()
    if len(parts) != 3:
        raise mistake(where, expected, shortened(value), remedy)
    for part in parts:
        if not is_number(part):
            raise mistake(where, expected, shortened(part), remedy)
    x, y, z = (float(part) for part in parts)
    return (x, y, z)


def each(where: str, value: Any, length: int, check: Callable[[str, Any], Number]) -> list[Number]:
    """`value` as a list of `length` numbers, each passed through `check`; a single number stands for all of them.

    Raises:
        InputError: there are more or fewer numbers, or one does not pass.
    """
    if not isinstance(value, Iterable) or isinstance(value, str):
        return [check(where, value)] * length
    parts = list(value)
    if len(parts) != length:
        raise mistake(where, f"one number or {length}", shortened(value))
    return [check(where, part) for part in parts]


def member(where: str, value: Any, kind: type[Member]) -> Member:
    """`value` itself.

    Raises:
        InputError: it is not a member of an Enum; the message says what to write, of a text the member that it means.
    """
    if isinstance(value, kind):
        return value
    prefix, known = f"{kind.__name__}.", [one.name for one in kind]
    expected = f"one of {', '.join(prefix + name for name in known)}"
    remedy = closest_match(value, known, prefix) if isinstance(value, str) else ""
    raise mistake(where, expected, shortened(value), remedy)


def instance(where: str, value: Any, kind: Any, expected: str, remedy: str = "") -> Any:
    """`value` itself.

    Raises:
        InputError: it is not an instance of `kind`, which the message calls `expected`.
    """
    if not isinstance(value, kind):
        raise mistake(where, expected, shortened(value), remedy)
    return value
