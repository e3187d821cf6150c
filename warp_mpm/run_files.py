"""The files that grow with a run: the USD file, history.csv, gauges.csv."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path

from warp_mpm.config import Save
from warp_mpm.output.frame import Frame
from warp_mpm.output.tables import TableWriter, gauge_columns, gauge_rows, row_values
from warp_mpm.output.usd import UsdWriter
from warp_mpm.recorder import Recorder
from warp_mpm.scene import Scene
from warp_mpm.summary import color_limit

Row = Mapping[str, float]


@contextmanager
def run_files(
    directory: Path, scene: Scene, save: Save, recorder: Recorder, history: Sequence[Row]
) -> Iterator[Callable[[Frame, Row], None]]:
    """A function that writes a frame and its row of the history; files are closed whatever way the run ends.

    Frames that have a row in `history` already are kept: the run goes on.

    Raises:
        SimulationError: the disk is full or refuses.
        InputError: one of the frames to keep is not there.
    """
    with ExitStack() as stack:
        tables: list[TableWriter] = []
        kept = list(history)

        def start_history(row: Row) -> None:
            rows = [row_values(before, row) for before in kept]
            tables.append(stack.enter_context(TableWriter(path, list(row), rows)))

        # What has a row can be shown, so rows go before their frames go, and come after them.
        path = directory / "history.csv"
        if kept:
            start_history(kept[0])
        else:
            path.unlink(missing_ok=True)  # what an earlier run left
        usd = stack.enter_context(
            UsdWriter(
                directory / f"{scene.name}.usdc",
                scene,
                pressure_range=(0.0, color_limit(scene)),
                frames=save.frames,
                fields=save.fields,
                particles_every=save.particles_every,
                isosurface=save.isosurface,
                arrival=recorder.expected.section,
                layout=save.layout,
                usdz=save.usdz,
                kept=len(kept),
            )
        )
        write_gauges = _gauge_writer(directory / "gauges.csv", scene, recorder, stack)

        def write(frame: Frame, row: Row) -> None:
            usd.write(frame)
            if not tables:
                start_history(row)
            tables[0].write(row)
            write_gauges()

        yield write


def _gauge_writer(path: Path, scene: Scene, recorder: Recorder, stack: ExitStack) -> Callable[[], None]:
    """A function that adds to gauges.csv what was recorded since it was last called, as does the end of `stack`."""
    gauges = scene.gauges
    if not gauges:
        path.unlink(missing_ok=True)  # what an earlier run left
        return lambda: None

    def new_rows() -> Iterator[list[str]]:
        return gauge_rows(gauges, *recorder.take_gauges())

    table = stack.enter_context(TableWriter(path, gauge_columns(gauges), new_rows()))

    def write() -> None:
        table.extend(new_rows())

    stack.callback(write)
    return write
