"""Comparing times on a machine whose speed drifts: what is compared is measured in turns, and medians count."""

import statistics
import time
from collections.abc import Callable, Hashable, Mapping, Sequence
from typing import TypeVar

import warp as wp

Progress = Callable[[str], None]  # told what is being measured
Key = TypeVar("Key", bound=Hashable)
Measured = TypeVar("Measured")


def timed(device: wp.Device, work: Callable[[], object]) -> float:
    """Seconds that some work takes, until the device has done it."""
    wp.synchronize_device(device)
    begin = time.perf_counter()
    work()
    wp.synchronize_device(device)
    return time.perf_counter() - begin


def interleaved(measures: Mapping[Key, Callable[[], Measured]], rounds: int) -> dict[Key, list[Measured]]:
    """What each measure gives in each round: A B C, B C A, C A B, ... so that none profits from its place."""
    keys = list(measures)
    found: dict[Key, list[Measured]] = {key: [] for key in keys}
    for turn in range(rounds):
        first = turn % len(keys)
        for key in keys[first:] + keys[:first]:
            found[key].append(measures[key]())
    return found


def spread(name: str, values: Sequence[float]) -> dict[str, float]:
    """Median, lowest and highest of repeated measurements, as figures of a record; `name` ends with the unit."""
    return {name: statistics.median(values), f"lowest_{name}": min(values), f"highest_{name}": max(values)}


def thread_counts(most: int) -> list[int]:
    """Numbers of threads worth a measurement: all up to 4, then about one and a half times as many each, and `most`."""
    counts = {*range(1, min(most, 4) + 1), most}
    for power in range(2, most.bit_length()):
        counts |= {count for count in (2**power, 3 * 2 ** (power - 1)) if count <= most}
    return sorted(counts)
