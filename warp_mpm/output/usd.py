"""Writes the pressure field as time-sampled USD, frame by frame.

While the run goes on, every frame is a file of its own in `clips/`, and a small root layer `<name>.usda` plays them in
turn (USD value clips). A file appears under its name only when it is whole, so a killed run keeps every frame it wrote,
and memory does not grow with their number. `close` merges the frames into one `<name>.usdc` if they are not too large.
"""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
from pxr import Gf, Sdf, Tf, Vt

from warp_mpm.output import colormap
from warp_mpm.output.frame import Frame
from warp_mpm.output.usd_layout import (
    PARTICLES,
    SECTION,
    WORLD,
    animated_attributes,
    author_stage_metadata,
    author_static,
    particle_widths,
    section_axes,
)
from warp_mpm.output.whole_file import whole_file, write_error
from warp_mpm.scene import Scene

MERGE_LIMIT = 1_000_000_000  # [bytes]; larger results stay in clips, because merging maps all frames at once
STATIC = "static.usdc"  # in clips/: every prim, and every value that does not change
MANIFEST = "manifest.usda"  # in clips/: which attributes the clips animate


class UsdWriter:
    """A USD file in the making: `write` each frame, then `close`; or use it in a `with` statement."""

    def __init__(
        self,
        path: str | Path,
        scene: Scene,
        *,
        pressure_range: tuple[float, float],
        frames: int,
        fields: Sequence[str] = (),
    ) -> None:
        """Write the parts that do not change, and remove what an earlier run left under the same names.

        Args:
            path: the file to be, `<name>.usdc`; `<name>.usda` and `clips/` appear beside it.
            scene: what is simulated.
            pressure_range: pressures shown in the first and the last colour [Pa].
            frames: number of frames that are planned, at least 2.
            fields: further particle fields, names from `PARTICLE_FIELDS`.

        Raises:
            SimulationError: the file system refuses.
        """
        self._path = Path(path).with_suffix(".usdc")
        self._root = self._path.with_suffix(".usda")
        self._clips = self._path.parent / "clips"
        self._scene = scene
        self._fields = tuple(fields)
        self._pressure_range = pressure_range
        self._microseconds_per_time_code = 1e6 * scene.end_time / max(frames - 1, 1)
        self._types = animated_attributes(scene, self._fields)
        self._widths = particle_widths(scene)
        self._section_shape = tuple(len(axis) for axis in section_axes(scene))
        self._indices: list[int] = []
        self._static = Sdf.Layer.CreateAnonymous(".usdc")
        author_static(self._static, scene, self._fields)
        try:
            self._remove_working_files()
            self._path.unlink(missing_ok=True)
            self._clips.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise write_error(self._path, error) from error
        _export(self._static, self._clips / STATIC)
        _export(_manifest(self._types), self._clips / MANIFEST)

    def __enter__(self) -> "UsdWriter":
        """The writer itself."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        """Close, whatever way the block ended: an interrupted run keeps its frames."""
        self.close()

    def write(self, frame: Frame) -> None:
        """Add a frame; frames come in rising order of their index.

        Raises:
            SimulationError: the disk is full or refuses. The frames before stay readable.
            ValueError: an array does not have one entry per particle, or per node of the section.
        """
        clip = Sdf.Layer.CreateAnonymous(".usdc")
        for path, value in self._samples(frame).items():
            Sdf.JustCreatePrimAttributeInLayer(clip, path, self._types[path])
            clip.SetTimeSample(path, float(frame.index), value)
        _export(clip, self._clip(frame.index))
        self._indices.append(frame.index)
        _export(self._root_layer(), self._root)

    def close(self) -> Path:
        """Merge the frames into one file if they are small enough; say where the result is. May be called twice.

        Raises:
            SimulationError: the disk is full or refuses. The frames stay readable through `<name>.usda`.
        """
        if not self._clips.exists():
            return self._path
        size = sum(self._clip(index).stat().st_size for index in self._indices)
        if size > MERGE_LIMIT:
            return self._root
        self._merge()
        try:
            self._remove_working_files()
        except OSError as error:
            raise write_error(self._clips, error) from error
        return self._path

    def _samples(self, frame: Frame) -> dict[str, Any]:
        """The value of every animated attribute in this frame, by path."""
        count = self._scene.particle_count
        position = _checked("position", frame.position, (count, 3))
        inside = _checked("inside", frame.inside, (count,), np.bool_)
        pressure = np.where(inside, _checked("pressure", frame.pressure, (count,)), np.float32(0.0))
        section = _checked("section", frame.section, self._section_shape).ravel()
        widths = np.where(inside, self._widths, np.float32(0.0))
        samples = {
            f"{WORLD}.blast:time": float(frame.time),
            f"{PARTICLES}.points": Vt.Vec3fArray.FromNumpy(position),
            f"{PARTICLES}.extent": _extent(position, widths),
            f"{PARTICLES}.primvars:pressure": Vt.FloatArray.FromNumpy(pressure),
            f"{PARTICLES}.primvars:displayColor:indices": self._color_indices(pressure),
            f"{SECTION}.primvars:pressure": Vt.FloatArray.FromNumpy(section),
            f"{SECTION}.primvars:displayColor:indices": self._color_indices(section),
        }
        if f"{PARTICLES}.widths" in self._types:
            samples[f"{PARTICLES}.widths"] = Vt.FloatArray.FromNumpy(widths)
        for name in self._fields:
            is_vector = self._types[f"{PARTICLES}.primvars:{name}"] == Sdf.ValueTypeNames.Float3Array
            values = _checked(name, frame.fields[name], (count, 3) if is_vector else (count,))
            array_type = Vt.Vec3fArray if is_vector else Vt.FloatArray
            samples[f"{PARTICLES}.primvars:{name}"] = array_type.FromNumpy(values)
        return samples

    def _color_indices(self, pressure: np.ndarray) -> Any:
        return Vt.IntArray.FromNumpy(colormap.indices(pressure, *self._pressure_range))

    def _root_layer(self) -> Any:
        """The layer that plays the clips written so far.

        It holds no values of its own: they would hide those of the clips. Everything else comes from the static layer.
        """
        layer = Sdf.Layer.CreateAnonymous(".usda")
        self._author_metadata(layer)
        layer.subLayerPaths.append(f"./clips/{STATIC}")
        world = Sdf.CreatePrimInLayer(layer, WORLD)
        clips = [Sdf.AssetPath(f"./clips/{self._clip(index).name}") for index in self._indices]
        last = float(self._indices[-1])
        world.SetInfo(
            "clips",
            {
                "default": {
                    "primPath": WORLD,
                    "manifestAssetPath": Sdf.AssetPath(f"./clips/{MANIFEST}"),
                    "assetPaths": Sdf.AssetPathArray(clips),
                    "active": Vt.Vec2dArray([Gf.Vec2d(index, n) for n, index in enumerate(self._indices)]),
                    "times": Vt.Vec2dArray([Gf.Vec2d(0.0, 0.0), Gf.Vec2d(last, last)]),
                }
            },
        )
        return layer

    def _merge(self) -> None:
        """Write everything into one file, then give it its name."""
        merged = Sdf.Layer.CreateAnonymous(".usdc")
        merged.TransferContent(self._static)
        self._author_metadata(merged)
        # Samples are views of the mapped clip files, so these stay open until all is written.
        open_clips = []
        for index in self._indices:
            clip = Sdf.Layer.FindOrOpen(str(self._clip(index)))
            open_clips.append(clip)
            for path in self._types:
                merged.SetTimeSample(path, float(index), clip.QueryTimeSample(path, float(index)))
        _export(merged, self._path)
        del merged

    def _author_metadata(self, layer: Any) -> None:
        frames = self._indices[-1] + 1 if self._indices else 0
        author_stage_metadata(layer, self._scene, self._pressure_range, self._microseconds_per_time_code, frames)

    def _clip(self, index: int) -> Path:
        return self._clips / f"frame_{index:05d}.usdc"

    def _remove_working_files(self) -> None:
        """Remove the root layer first: without it the clips are just files, without them it would be a broken stage."""
        self._root.unlink(missing_ok=True)
        if self._clips.is_dir():
            for file in [*self._clips.glob("frame_*.usdc"), self._clips / STATIC, self._clips / MANIFEST]:
                file.unlink(missing_ok=True)
            if not any(self._clips.iterdir()):
                self._clips.rmdir()


def _manifest(types: Mapping[str, Any]) -> Any:
    """Declare the animated attributes and nothing else: whatever is in a manifest counts as animated."""
    layer = Sdf.Layer.CreateAnonymous(".usda")
    for path, value_type in types.items():
        Sdf.JustCreatePrimAttributeInLayer(layer, path, value_type)
    return layer


def _export(layer: Any, path: Path) -> None:
    with whole_file(path) as part:
        try:
            layer.Export(str(part))
        except Tf.ErrorException as error:
            raise OSError(_reason(error)) from error


def _reason(error: Exception) -> str:
    """The first message of an error of USD, which wraps it in source file names and line numbers."""
    message = re.search(r": '(.*?)'\s*$", str(error), re.MULTILINE)
    return message.group(1) if message else str(error).strip().splitlines()[0]


def _checked(name: str, values: np.ndarray, shape: tuple[int, ...], kind: type = np.float32) -> np.ndarray:
    if values.shape != shape:
        raise ValueError(f"frame: {name}: expected shape {shape}, got {values.shape}")
    return np.ascontiguousarray(values, dtype=kind)


def _extent(position: np.ndarray, widths: np.ndarray) -> Any:
    """Lower and upper corner of the box around all particles, widths included."""
    half = 0.5 * widths[:, None]
    return Vt.Vec3fArray.FromNumpy(np.stack([(position - half).min(axis=0), (position + half).max(axis=0)]))
