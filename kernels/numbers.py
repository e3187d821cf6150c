"""What counts as a number among the parameters that a user gives."""

import math
from numbers import Real
from typing import Any


def is_number(value: Any) -> bool:
    """Whether a value is a finite real number; True and False are none, nor are whole numbers that no float holds."""
    try:
        return isinstance(value, Real) and not isinstance(value, bool) and math.isfinite(value)
    except OverflowError:
        return False
