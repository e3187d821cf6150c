"""Writes the pressure field as time-sampled USD, frame by frame.

While the run goes on, every frame is a file of its own in `clips/`, and a small root layer `<name>.usda` plays them in
turn (USD value clips). A file appears under its name only when it is whole, so a killed run keeps every frame it wrote,
and memory does not grow with their number. `close` merges the frames into one `<name>.usdc`, unless it is too large or
they are to stay apart, and packs the result into `<name>.usdz` if asked to.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from glob import escape
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
from pxr import Gf, Sdf, Tf, Vt

from warp_mpm.checks import mistake
from warp_mpm.config import Layout
from warp_mpm.output.frame import Frame
from warp_mpm.output.usd_frame import FrameSampler
from warp_mpm.output.usd_layout import WORLD, Contents, author_stage_metadata, author_static
from warp_mpm.output.usd_package import pack
from warp_mpm.output.whole_file import whole_file, write_error
from warp_mpm.scene import Scene

MERGE_LIMIT = 1_000_000_000  # [bytes] of frames that Layout.AUTO merges
MERGE_BATCH = 50_000_000  # [bytes] of frames that are in memory at once while merging
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
        particles_every: int = 1,
        isosurface: float | None = None,
        arrival: np.ndarray | None = None,
        layout: Layout = Layout.AUTO,
        usdz: bool = False,
        kept: int = 0,
    ) -> None:
        """Write the parts that do not change, and remove what an earlier run left under the same names.

        Args:
            path: the file to be, `<name>.usdc`; `<name>.usda` and `clips/` appear beside it.
            scene: what is simulated.
            pressure_range: pressures shown in the first and the last colour [Pa].
            frames: number of frames that are planned, at least 2.
            fields: further particle fields, names from `PARTICLE_FIELDS`.
            particles_every: one particle in so many is shown, in creation order.
            isosurface: pressure of the surface to show [Pa]; frames need to have it.
            arrival: arrival times at the nodes of the section (nodes_u, nodes_v) [s], of which lines are shown.
            layout: whether the frames become one file.
            usdz: also pack the result into `<name>.usdz`.
            kept: the first so many frames of that earlier run stay: it is this run that goes on.

        Raises:
            SimulationError: the file system refuses.
            InputError: one of the frames to keep is not there.
        """
        self._path = Path(path).with_suffix(".usdc")
        self._root = self._path.with_suffix(".usda")
        self._package = self._path.with_suffix(".usdz")
        self._clips = self._path.parent / "clips"
        self._layout = layout
        self._usdz = usdz
        self._microseconds_per_time_code = 1e6 * scene.end_time / max(frames - 1, 1)
        self._contents = Contents(scene, pressure_range, tuple(fields), particles_every, isosurface, arrival)
        self._sampler = FrameSampler(self._contents)
        self._indices: list[int] = []
        self._result: Path | None = None
        self._static = _static(self._contents)
        self._start(kept)

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
        self._write_clip(frame.index, self._sampler.samples(frame))
        self._indices.append(frame.index)
        _export(self._root_layer(), self._root)

    def close(self) -> Path:
        """Merge the frames into one file if the layout says so; say where the result is. May be called twice.

        Raises:
            SimulationError: the disk is full or refuses. The frames stay readable through `<name>.usda`.
        """
        if self._result is None:
            try:
                self._result = self._merge() if self._is_merged() else self._root
            except OSError as error:
                raise write_error(self._clips, error) from error
            if self._usdz:
                pack(self._package, self._files(self._result))
        return self._result

    def _is_merged(self) -> bool:
        """Whether the frames become one file; without any there are no clips to play."""
        if not self._indices or self._layout is Layout.SINGLE:
            return True
        size = sum(self._clip(index).stat().st_size for index in self._indices)
        return self._layout is Layout.AUTO and size <= MERGE_LIMIT

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

    def _merge(self) -> Path:
        with whole_file(self._path) as part, _errors_of_usd():
            self._write_merged(part)
        self._remove_working_files()
        return self._path

    def _write_merged(self, part: Path) -> None:
        """Write everything into one file, some frames at a time.

        Samples are views of the mapped clip files. Once the layer is saved it has views of its own file instead, which
        is mapped but not read, and the clips can be let go.
        """
        merged = Sdf.Layer.CreateNew(str(part))
        try:
            merged.TransferContent(self._static)
            self._author_metadata(merged)
            open_clips: list[Any] = []
            size = 0
            for index in self._indices:
                clip = Sdf.Layer.OpenAsAnonymous(str(self._clip(index)))  # afresh, whoever still shows an earlier run
                for path in self._sampler.types:
                    merged.SetTimeSample(path, float(index), clip.QueryTimeSample(path, float(index)))
                open_clips.append(clip)
                size += self._clip(index).stat().st_size
                if size >= MERGE_BATCH:
                    merged.Save()
                    open_clips.clear()
                    size = 0
            merged.Save()
        finally:
            del merged  # an error keeps the variables of this function, and USD allows one layer of a name

    def _start(self, kept: int) -> None:
        """Write what does not change. Frames that are kept can be opened all the time; everything else goes."""
        try:
            if kept:
                self._take_up(kept)
            else:
                self._remove_working_files()
            self._clips.mkdir(parents=True, exist_ok=True)
            _export(self._static, self._clips / STATIC)
            _export(_manifest(self._sampler.types), self._clips / MANIFEST)
            if kept:
                _export(self._root_layer(), self._root)
                self._remove_working_files(kept)
            for old in (self._path, self._package):
                old.unlink(missing_ok=True)
        except OSError as error:
            raise write_error(self._path, error) from error

    def _take_up(self, kept: int) -> None:
        """Go on after the first frames of a run; those that have been merged already become clips again."""
        self._indices = list(range(kept))
        missing = [index for index in self._indices if not self._clip(index).exists()]
        if not missing:
            return
        self._clips.mkdir(exist_ok=True)
        with _errors_of_usd():
            merged = Sdf.Layer.OpenAsAnonymous(str(self._path)) if self._path.exists() else None
            for index in missing:
                samples = {path: merged and merged.QueryTimeSample(path, float(index)) for path in self._sampler.types}
                if any(value is None for value in samples.values()):
                    expected, got = f"the {kept} frames that were saved before the checkpoint", f"no frame {index}"
                    raise mistake(str(self._path.parent), expected, got, "start anew, without --resume")
                self._write_clip(index, samples)

    def _write_clip(self, index: int, samples: Mapping[str, Any]) -> None:
        """Write the value of every animated attribute in a frame, by path."""
        clip = Sdf.Layer.CreateAnonymous(".usdc")
        for path, value in samples.items():
            Sdf.JustCreatePrimAttributeInLayer(clip, path, self._sampler.types[path])
            clip.SetTimeSample(path, float(index), value)
        _export(clip, self._clip(index))

    def _files(self, result: Path) -> list[Path]:
        """The result and all that it needs."""
        if result == self._path:
            return [result]
        return [result, self._clips / STATIC, self._clips / MANIFEST, *map(self._clip, self._indices)]

    def _author_metadata(self, layer: Any) -> None:
        frames = self._indices[-1] + 1 if self._indices else 0
        author_stage_metadata(layer, self._contents, self._microseconds_per_time_code, frames)

    def _clip(self, index: int) -> Path:
        return self._clips / f"frame_{index:05d}.usdc"

    def _remove_working_files(self, kept: int = 0) -> None:
        """Remove the root layer first: without it the clips are just files, without them it would be a broken stage.

        A killed run leaves unfinished files too, `<name>.part.` and then a suffix or some letters that USD makes up.
        With `kept` frames, what plays them stays.
        """
        stay = (
            {self._clips / name for name in (STATIC, MANIFEST)} | set(map(self._clip, range(kept))) if kept else set()
        )
        if not kept:
            self._root.unlink(missing_ok=True)
        files = [*self._path.parent.glob(f"{escape(self._path.stem)}.part.*")]
        files += [file for pattern in ("frame_*", "static.*", "manifest.*") for file in self._clips.glob(pattern)]
        for file in files:
            if file not in stay:
                file.unlink(missing_ok=True)
        if self._clips.is_dir() and not any(self._clips.iterdir()):
            self._clips.rmdir()


def _static(contents: Contents) -> Any:
    """Every prim, and every value that does not change."""
    layer = Sdf.Layer.CreateAnonymous(".usdc")
    author_static(layer, contents)
    return layer


def _manifest(types: Mapping[str, Any]) -> Any:
    """Declare the animated attributes and nothing else: whatever is in a manifest counts as animated."""
    layer = Sdf.Layer.CreateAnonymous(".usda")
    for path, value_type in types.items():
        Sdf.JustCreatePrimAttributeInLayer(layer, path, value_type)
    return layer


def _export(layer: Any, path: Path) -> None:
    with whole_file(path) as part, _errors_of_usd():
        if not path.parent.is_dir():  # USD would make it anew, without the frames before
            raise NotADirectoryError("the directory is gone")
        layer.Export(str(part))


@contextmanager
def _errors_of_usd() -> Iterator[None]:
    """Raise OSError for what USD could not do: its first message, which it wraps in names of source files."""
    try:
        yield
    except Tf.ErrorException as error:
        message = re.search(r": '(.*?)'\s*$", str(error), re.MULTILINE)
        raise OSError(message.group(1) if message else str(error).strip().splitlines()[0]) from error
