"""Reads the frames of a USD file of ours back, each when it is asked for, as NumPy arrays.

A run under way or killed can be read through its root layer `<name>.usda` as well as a whole one.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, overload

import numpy as np
from pxr import Tf, Usd, UsdGeom

from warp_mpm.checks import mistake
from warp_mpm.output.usd_layout import PARTICLES, SECTION, WORLD
from warp_mpm.output.usd_reading import open_stage

SHOWN = ("pressure", "displayColor", "displayOpacity")  # primvars that are no further fields


@dataclass(frozen=True)
class SectionGrid:
    """The nodes at which frames have the field pressure: a plane normal to an axis."""

    axis: int  # 0, 1, 2: the plane's normal
    coordinate: float  # [m] along that axis
    u: np.ndarray  # (nodes_u,) float64 [m]: along the first of the two other axes
    v: np.ndarray  # (nodes_v,) float64 [m]: along the second


class SavedFrame:
    """A frame of a run. Its arrays are read from the file when they are first used, and are yours."""

    def __init__(self, frames: "Frames", index: int) -> None:
        self._frames = frames
        self.index = index  # 0, 1, ..., frames - 1
        self.time = float(frames.times[index])  # [s], the true time of its step

    def __repr__(self) -> str:
        return f"<frame {self.index} at {self.time * 1e6:.3f} us>"

    @cached_property
    def position(self) -> np.ndarray:
        """(n, 3) float32 [m], in creation order; a particle that left keeps its last position."""
        return self._frames.read(f"{PARTICLES}.points", self.index)

    @cached_property
    def pressure(self) -> np.ndarray:
        """(n,) float32 [Pa]; 0 for a particle that left."""
        return self._frames.read(f"{PARTICLES}.primvars:pressure", self.index)

    @cached_property
    def inside(self) -> np.ndarray:
        """(n,) bool: False once the particle has left through an open face."""
        return np.broadcast_to(self._frames.read(f"{PARTICLES}.widths", self.index) > 0.0, len(self.pressure)).copy()

    @cached_property
    def section(self) -> np.ndarray:
        """(nodes_u, nodes_v) float32 [Pa]: field pressure at the nodes of the section plane."""
        grid = self._frames.section
        return self._frames.read(f"{SECTION}.primvars:pressure", self.index).reshape(len(grid.u), len(grid.v))

    @cached_property
    def fields(self) -> dict[str, np.ndarray]:
        """Further particle fields, by name: those that were saved, (n,) or (n, 3) float32, SI units, and `charge`.

        That is the number of the particle's charge in `Run.summary["charges"]`, (n,) int32.
        """
        return {name: self._frames.read(f"{PARTICLES}.primvars:{name}", self.index) for name in self._frames.fields}


class Frames(Sequence[SavedFrame]):
    """The frames of a USD file."""

    def __init__(self, path: Path) -> None:
        """Open the file; no array is read yet.

        Raises:
            InputError: it is damaged, or not ours.
        """
        self._path = path
        self._stage = open_stage("load", path)
        self._stage.Reload()  # the same file may have been read earlier, before another run wrote it
        for prim in (PARTICLES, SECTION):
            if not self._stage.GetPrimAtPath(prim):
                raise mistake(str(path), "a USD file that warp_mpm wrote", f"one without {prim}")
        self._codes = self._stage.GetAttributeAtPath(f"{WORLD}.blast:time").GetTimeSamples()
        self.times = np.array([self.read(f"{WORLD}.blast:time", index) for index in range(len(self._codes))])  # [s]

    def __repr__(self) -> str:
        count = f"{len(self)} frame" + ("" if len(self) == 1 else "s")
        span = f" from {self.times[0] * 1e6:.3f} to {self.times[-1] * 1e6:.3f} us" if len(self) else ""
        return f"<{count}{span} in {str(self._path)!r}>"

    def __len__(self) -> int:
        return len(self._codes)

    @overload
    def __getitem__(self, index: int) -> SavedFrame: ...
    @overload
    def __getitem__(self, index: slice) -> "list[SavedFrame]": ...
    def __getitem__(self, index: int | slice) -> "SavedFrame | list[SavedFrame]":
        """A frame, or some; a negative index counts from the end."""
        if isinstance(index, slice):
            return [SavedFrame(self, number) for number in range(len(self))[index]]
        return SavedFrame(self, range(len(self))[index])

    def nearest(self, time: float) -> SavedFrame:
        """The frame whose time is nearest to `time` [s]."""
        return self[int(np.argmin(np.abs(self.times - time)))]

    @cached_property
    def ids(self) -> np.ndarray:
        """(n,) int64: each particle's number in the run, where not all of them are in the file."""
        return np.array(self._value(f"{PARTICLES}.ids", Usd.TimeCode.Default()))

    @cached_property
    def fields(self) -> tuple[str, ...]:
        """Names of the further particle fields."""
        primvars = UsdGeom.PrimvarsAPI(self._stage.GetPrimAtPath(PARTICLES)).GetPrimvars()
        names = (primvar.GetPrimvarName() for primvar in primvars)
        return tuple(name for name in names if name not in SHOWN)

    @cached_property
    def section(self) -> SectionGrid:
        """Where the section is."""
        points = np.array(self._value(f"{SECTION}.points", Usd.TimeCode.Default()), dtype=np.float64)
        places = [np.unique(points[:, axis]) for axis in range(3)]
        axis = int(np.argmin([len(place) for place in places]))
        u, v = (place for number, place in enumerate(places) if number != axis)
        return SectionGrid(axis, float(places[axis][0]), u, v)

    def read(self, path: str, index: int) -> np.ndarray:
        """Copy of an attribute's value in a frame.

        Raises:
            InputError: it cannot be read: a run under way has merged its frames, or the file is damaged.
        """
        return np.array(self._value(path, self._codes[index]))

    def _value(self, path: str, code: Any) -> Any:
        try:
            value = self._stage.GetAttributeAtPath(path).Get(code)
        except Tf.ErrorException:
            value = None
        if value is None:
            raise mistake(str(self._path), f"a value of {path}", "none", "if the run has gone on, load it again")
        return value
