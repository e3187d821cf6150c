"""Ordinary differential equations for the exact solutions that have no closed form.

`runge_kutta` integrates dy / dx = f(x, y) in equal steps with the classical scheme of fourth order; `hermite` reads the
result between the steps, by the cubic that has the values and the slopes of both ends, of fourth order as well.

Reference: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, Springer 1993, sections II.1
and II.6.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Trajectory:
    """A solution of an ordinary differential equation at the ends of its steps."""

    place: np.ndarray  # (steps + 1,), equally spaced, rising or falling
    state: np.ndarray  # (steps + 1, unknowns)
    slope: np.ndarray  # (steps + 1, unknowns): the derivative of the state

    def at(self, place: np.ndarray) -> np.ndarray:
        """The state (n, unknowns) at any places (n,) between the ends."""
        rising = np.sign(self.place[-1] - self.place[0])
        return hermite(rising * self.place, self.state, rising * self.slope, rising * place)


def runge_kutta(
    slope: Callable[[float, np.ndarray], np.ndarray], start: float, state: np.ndarray, end: float, steps: int
) -> Trajectory:
    """Integrate d(state) / d(place) = slope(place, state) from start to end in equal steps."""
    places = np.linspace(start, end, steps + 1)
    step = (end - start) / steps
    states, slopes = [np.asarray(state, dtype=float)], []
    for place in places:
        y = states[-1]
        first = slope(place, y)
        slopes.append(first)
        if len(slopes) > steps:
            break
        second = slope(place + 0.5 * step, y + 0.5 * step * first)
        third = slope(place + 0.5 * step, y + 0.5 * step * second)
        fourth = slope(place + step, y + step * third)
        states.append(y + step / 6.0 * (first + 2.0 * second + 2.0 * third + fourth))
    return Trajectory(places, np.array(states), np.array(slopes))


def hermite(nodes: np.ndarray, values: np.ndarray, slopes: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Cubic Hermite interpolation at places (n,) between rising nodes (m,); the end values beyond.

    Values and slopes are (m,) or (m, unknowns); the result is (n,) or (n, unknowns).
    """
    places = np.clip(places, nodes[0], nodes[-1])
    low = np.clip(np.searchsorted(nodes, places, side="right") - 1, 0, len(nodes) - 2)
    width = nodes[low + 1] - nodes[low]
    share = (places - nodes[low]) / width
    if values.ndim > 1:
        width, share = width[..., None], share[..., None]
    rise = values[low + 1] - values[low]
    left, right = width * slopes[low] - rise, width * slopes[low + 1] - rise
    return values[low] + share * (rise + (1.0 - share) * ((1.0 - share) * left - share * right))
