"""Values from text and from Python, checked against annotations."""

import math
import re
from enum import Enum
from typing import Literal

import numpy as np
import pytest

from warp_mpm.config import Order, ShapeFunction, SolverConfig
from warp_mpm.errors import InputError
from warp_mpm.parameters import annotations_of, from_python, from_text


class Color(Enum):
    """Values in mixed case."""

    RED = "red"
    DARK_BLUE = "Dark_Blue"


def function(
    *,
    number: float = 1.0,
    count: int = 1,
    flag: bool = False,
    text: str = "",
    color: Color = Color.RED,
    choice: Literal["rigid", "free"] = "rigid",
    level: Literal[1, 2] = 1,
    pair: tuple[float, float] = (0.0, 0.0),
    many: tuple[int, ...] = (),
    energy: float | Literal["cj"] = "cj",
    width: float | None = None,
    anything: str | float = "",
    written: "float | None" = None,
) -> None: ...


ANNOTATIONS = annotations_of(function, "scene x")


@pytest.mark.parametrize(
    ("assignment", "value"),
    [
        ("number=3e-3", 3e-3),
        ("number=-2", -2.0),
        ("number = 5 ", 5.0),
        ("count=3", 3),
        ("flag=true", True),
        ("flag=No", False),
        ("flag=1", True),
        ("text=a=b", "a=b"),
        ("text=", ""),
        ("color=RED", Color.RED),
        ("color=dark_blue", Color.DARK_BLUE),
        ("choice=Free", "free"),
        ("level=2", 2),
        ("pair=1.5,0.06", (1.5, 0.06)),
        ("pair=(1.5, 0.06)", (1.5, 0.06)),
        ("many=1,2,3", (1, 2, 3)),
        ("many=", ()),
        ("energy=cj", "cj"),
        ("energy=3.8e6", 3.8e6),
        ("width=none", None),
        ("width=2", 2.0),
        ("anything=2", 2.0),
        ("anything=two", "two"),
        ("written=2", 2.0),
    ],
)
def test_text(assignment, value):
    (converted,) = from_text([assignment], ANNOTATIONS, "scene x").values()
    assert converted == value
    assert type(converted) is type(value)


@pytest.mark.parametrize(
    ("assignment", "message"),
    [
        ("number=abc", "scene x: number: expected a finite number, got 'abc'"),
        ("number=nan", "scene x: number: expected a finite number, got 'nan'"),
        ("number=-inf", "scene x: number: expected a finite number, got '-inf'"),
        ("number=1e999", "scene x: number: expected a finite number, got '1e999'"),
        ("number=", "scene x: number: expected a finite number, got ''"),
        ("count=2.0", "scene x: count: expected a whole number, got '2.0'"),
        ("flag=maybe", "scene x: flag: expected true or false, got 'maybe'"),
        ("color=green", "scene x: color: expected red or Dark_Blue, got 'green'"),
        ("choice=loose", "scene x: choice: expected rigid or free, got 'loose'"),
        ("level=3", "scene x: level: expected 1 or 2, got '3'"),
        ("pair=1", "scene x: pair: expected 2 values with commas between: a finite number, a finite number, got '1'"),
        ("pair=1,2,3", "expected 2 values with commas between"),
        ("pair=1,nan", "expected 2 values with commas between"),
        ("many=1,,2", "expected any number of values with commas between, each a whole number, got '1,,2'"),
        ("energy=hot", "scene x: energy: expected a finite number or cj, got 'hot'"),
        ("energy=nan", "scene x: energy: expected a finite number or cj, got 'nan'"),
        ("width=wide", "scene x: width: expected a finite number or none, got 'wide'"),
        ("number", "scene x: expected name=value, got 'number'"),
        ("nubmer=1", "got 'nubmer'; did you mean number?"),
        ("zzz=1", "scene x: expected one of number, count, flag"),
    ],
)
def test_bad_text(assignment, message):
    with pytest.raises(InputError) as caught:
        from_text([assignment], ANNOTATIONS, "scene x")
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("name", "given", "value"),
    [
        ("number", 3, 3.0),
        ("number", np.float32(0.5), 0.5),
        ("count", np.int64(3), 3),
        ("flag", True, True),
        ("color", Color.RED, Color.RED),
        ("color", "red", Color.RED),
        ("choice", "free", "free"),
        ("pair", [1, 2], (1.0, 2.0)),
        ("pair", np.array([1.0, 2.0]), (1.0, 2.0)),
        ("energy", 4, 4.0),
        ("energy", "cj", "cj"),
        ("width", None, None),
        ("anything", "2", "2"),
    ],
)
def test_python_values(name, given, value):
    converted = from_python({name: given}, ANNOTATIONS, "scene x")[name]
    assert converted == value
    assert type(converted) is type(value)


@pytest.mark.parametrize(
    ("name", "given"),
    [
        ("number", "3"),
        ("number", True),
        ("number", math.nan),
        ("number", None),
        ("count", 2.0),
        ("count", True),
        ("flag", 1),
        ("text", 1),
        ("choice", 1),
        ("pair", "1,2"),
        ("pair", 1.0),
        ("energy", math.inf),
        ("width", "none"),
        ("nonsense", 1),
    ],
)
def test_bad_python_values(name, given):
    with pytest.raises(InputError, match=f"scene x: .*{name}"):
        from_python({name: given}, ANNOTATIONS, "scene x")


def test_solver_settings():
    annotations = annotations_of(SolverConfig, "solver")
    settings = ["shape=linear", "order=usl", "burn_width=1.5", "viscosity=1.5,0.06", "cfl=0.2", "transfer=flip"]
    config = SolverConfig(**from_text(settings, annotations, "solver"))
    assert (config.shape, config.order, config.cfl) == (ShapeFunction.LINEAR, Order.USL, 0.2)
    assert (config.burn_width, config.viscosity) == (1.5, (1.5, 0.06))
    assert from_text(["burn_width=none"], annotations, "solver") == {"burn_width": None}


ALL_SHAPES = "one of ShapeFunction.LINEAR, ShapeFunction.GIMP, ShapeFunction.BSPLINE"


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"shape": "gimp"}, f"solver: shape: expected {ALL_SHAPES}, got 'gimp'; did you mean ShapeFunction.GIMP?"),
        (
            {"shape": "B-splin"},
            f"solver: shape: expected {ALL_SHAPES}, got 'B-splin'; did you mean ShapeFunction.BSPLINE?",
        ),
        ({"shape": "cubic"}, f"solver: shape: expected {ALL_SHAPES}, got 'cubic'"),
        ({"shape": Order.USL}, f"solver: shape: expected {ALL_SHAPES}, got <Order.USL: 'usl'>"),
        (
            {"transfer": "damped flip"},
            "solver: transfer: expected one of Transfer.DAMPED_FLIP, Transfer.FLIP, Transfer.APIC, got 'damped flip'; "
            "did you mean Transfer.DAMPED_FLIP?",
        ),
    ],
)
def test_a_text_for_a_choice_in_python_is_told_what_to_write(given, message):
    with pytest.raises(InputError, match=f"^{re.escape(message)}$"):
        SolverConfig(**given)


def test_the_last_of_equal_names_counts():
    assert from_text(["number=1", "number=2"], ANNOTATIONS, "scene x") == {"number": 2.0}


def test_a_parameter_without_annotation_is_refused():
    def bare(*, cell_size=1.0): ...

    with pytest.raises(InputError, match="scene x: cell_size: expected an annotation"):
        annotations_of(bare, "scene x")
