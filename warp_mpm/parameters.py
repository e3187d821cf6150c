"""Values for named parameters, checked against their annotations: from text (the command line) or from Python.

Understands float, int, bool, str, Enum (by value), Literal, tuples of fixed or any length ("1.5,0.06"), None, and
unions of these (`float | Literal["cj"]`). Numbers are plain SI; not-a-number and infinity are refused.
"""

import inspect
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from enum import Enum
from numbers import Integral
from types import NoneType, UnionType
from typing import Any, Literal, NamedTuple, Union, get_args, get_origin, get_type_hints

from warp_mpm.checks import closest_match, mistake
from warp_mpm.kernels.numbers import is_number

_TRUE, _FALSE = ("true", "yes", "on", "1"), ("false", "no", "off", "0")


def annotations_of(function: Callable[..., Any], where: str) -> dict[str, Any]:
    """The annotation of each keyword parameter of a function, or of each field of a dataclass.

    Raises:
        InputError: a parameter has no annotation.
    """
    hints = get_type_hints(function)
    for name in inspect.signature(function).parameters:
        if name not in hints:
            raise mistake(f"{where}: {name}", "an annotation, such as float", "none", "annotate it in the scene file")
    return {name: hints[name] for name in inspect.signature(function).parameters}


def from_text(assignments: Iterable[str], annotations: Mapping[str, Any], where: str) -> dict[str, Any]:
    """Values from texts "name=value", later ones before earlier ones.

    Raises:
        InputError: a text is not of this form, a name is unknown, or a value does not suit its annotation.
    """
    values = {}
    for assignment in assignments:
        name, equals, text = assignment.partition("=")
        if not equals:
            raise mistake(where, "name=value", repr(assignment))
        values[name.strip()] = text.strip()
    return _converted(values, annotations, where, _TEXT)


def from_python(values: Mapping[str, Any], annotations: Mapping[str, Any], where: str) -> dict[str, Any]:
    """Values given in Python, as their annotations have them: an int for a float becomes a float, a list a tuple.

    Raises:
        InputError: a name is unknown, or a value does not suit its annotation.
    """
    return _converted(values, annotations, where, _PYTHON)


class _UnsuitableError(Exception):
    """A value does not suit an annotation."""


class _Source(NamedTuple):
    """How values of one origin, text or Python, are read; both functions raise _UnsuitableError."""

    scalar: Callable[[Any, Any], Any]  # (value, class) -> instance of str, bool, int, float or None
    parts: Callable[[Any], list[Any]]  # value -> its parts


def _converted(
    values: Mapping[str, Any], annotations: Mapping[str, Any], where: str, source: _Source
) -> dict[str, Any]:
    converted = {}
    for name, value in values.items():
        if name not in annotations:
            known = ", ".join(annotations) or "no parameter"
            raise mistake(where, f"one of {known}", repr(name), closest_match(name, annotations))
        try:
            converted[name] = _convert(value, annotations[name], source)
        except _UnsuitableError:
            raise mistake(f"{where}: {name}", _described(annotations[name]), repr(value)) from None
    return converted


def _convert(value: Any, annotation: Any, source: _Source) -> Any:
    """`value` as the annotation has it; `source` reads what has no structure."""
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin in (Union, UnionType):
        return _first_suitable(value, arguments, source)
    if origin is tuple:
        return _convert_tuple(value, arguments, source)
    if origin is Literal:
        return _choose(value, {option: option for option in arguments}, source)
    if inspect.isclass(annotation) and issubclass(annotation, Enum):
        if isinstance(value, annotation):
            return value
        return _choose(value, {member.value: member for member in annotation}, source)
    return source.scalar(value, annotation)


def _first_suitable(value: Any, annotations: Sequence[Any], source: _Source) -> Any:
    """The value as the first annotation that it suits; str comes last, because any text suits it."""
    for annotation in sorted(annotations, key=lambda annotation: annotation is str):
        try:
            return _convert(value, annotation, source)
        except _UnsuitableError:
            continue
    raise _UnsuitableError


def _convert_tuple(value: Any, annotations: Sequence[Any], source: _Source) -> tuple[Any, ...]:
    """A tuple, of fixed length or of any, `tuple[kind, ...]`."""
    parts = source.parts(value)
    if len(annotations) == 2 and annotations[1] is Ellipsis:
        annotations = [annotations[0]] * len(parts)
    if len(parts) != len(annotations):
        raise _UnsuitableError
    return tuple(_convert(part, annotation, source) for part, annotation in zip(parts, annotations, strict=True))


def _choose(value: Any, options: Mapping[Any, Any], source: _Source) -> Any:
    """One of the options by its key; the case of texts does not matter."""
    for key, option in options.items():
        try:
            chosen = source.scalar(value, type(key))
        except _UnsuitableError:
            continue
        if chosen == key or (isinstance(key, str) and chosen.lower() == key.lower()):
            return option
    raise _UnsuitableError


def _scalar_from_text(text: str, kind: Any) -> Any:
    """Text as a str, bool, int, float or None."""
    if kind is str:
        return text
    if kind is NoneType and text.lower() == "none":
        return None
    if kind is bool and text.lower() in _TRUE + _FALSE:
        return text.lower() in _TRUE
    try:
        if kind is int:
            return int(text)
        if kind is float and math.isfinite(number := float(text)):
            return number
    except ValueError:
        pass
    raise _UnsuitableError


def _scalar_from_python(value: Any, kind: Any) -> Any:
    """A Python value as a str, bool, int, float or None."""
    if kind in (str, bool, NoneType) and isinstance(value, kind):
        return value
    if kind is int and isinstance(value, Integral) and not isinstance(value, bool):
        return int(value)
    if kind is float and is_number(value):
        return float(value)
    raise _UnsuitableError


def _parts_of_text(text: str) -> list[str]:
    """What stands between commas; parentheses around it are allowed."""
    inner = text.strip("() ")
    return [part.strip() for part in inner.split(",")] if inner else []


def _parts_of_python(value: Any) -> list[Any]:
    """The items of a sequence that is not text."""
    if isinstance(value, str) or not isinstance(value, Iterable):
        raise _UnsuitableError
    return list(value)


_TEXT = _Source(_scalar_from_text, _parts_of_text)
_PYTHON = _Source(_scalar_from_python, _parts_of_python)

_DESCRIPTIONS = {float: "a finite number", int: "a whole number", bool: "true or false", str: "text", NoneType: "none"}


def _described(annotation: Any) -> str:
    """What suits an annotation, in words."""
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin in (Union, UnionType):
        return " or ".join(_described(argument) for argument in arguments)
    if origin is Literal:
        return " or ".join(str(option) for option in arguments)
    if origin is tuple and len(arguments) == 2 and arguments[1] is Ellipsis:
        return f"any number of values with commas between, each {_described(arguments[0])}"
    if origin is tuple:
        return f"{len(arguments)} values with commas between: {', '.join(_described(part) for part in arguments)}"
    if inspect.isclass(annotation) and issubclass(annotation, Enum):
        return " or ".join(str(member.value) for member in annotation)
    return _DESCRIPTIONS.get(annotation, str(annotation))
