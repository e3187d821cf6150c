"""The record of every step: peaks, the pressure around front path and collision points and along the line, gauges, and
what is worth keeping of the section plane.

It is kept on the device and fetched in chunks, so that no step waits for the host.
"""

from collections.abc import Mapping

import numpy as np
import warp as wp

from warp_mpm.kernels.gauges import (
    GAUGE_DENSITY,
    GAUGE_LANES,
    GAUGE_POSITION,
    GAUGE_PRESSURE,
    GAUGE_VELOCITY,
    NO_PARTICLE,
    GaugePlaces,
    record_gauges,
)
from warp_mpm.kernels.precision import scalar, vector3
from warp_mpm.kernels.record import (
    RECORD_DT,
    RECORD_FIELD_PRESSURE,
    RECORD_HEAD,
    RECORD_PARTICLE_PRESSURE,
    record_step,
)
from warp_mpm.output.frame import GaugeRecord, LineRecord, StepRecord
from warp_mpm.places import Places, cells_of, recorded_places
from warp_mpm.scene import Domain, Scene, Segment, Vector
from warp_mpm.section import SectionRecorder
from warp_mpm.state import NUMBER, State
from warp_mpm.summary import arrival_threshold

CHUNK = 512  # steps between two fetches
PATH_REACH = 1.0  # cells around the front path in which its pressure is taken
POINT_REACH = 2.0  # cells around a collision point


class Recorder:
    """Records a state, step by step."""

    def __init__(self, state: State) -> None:
        scene = state.model.scene
        self._state = state
        self._scene = scene
        regions = [nodes_near_point(scene.domain, point, POINT_REACH) for point in scene.collision_points]
        if scene.front_path is not None:
            regions.insert(0, nodes_near_segment(scene.domain, scene.front_path, PATH_REACH))
        self._places = recorded_places(scene)
        points = np.concatenate([self._places.path, self._places.line])
        cell, fraction = cells_of(scene.domain, points)
        device = state.device
        self._regions = len(regions)
        self._points = len(points)
        flat = np.concatenate([np.zeros(0, np.int64), *(_flat(scene.domain, nodes) for nodes in regions)])
        region_lanes = RECORD_HEAD + np.repeat(np.arange(len(regions)), [len(nodes) for nodes in regions])
        self._threads = 1 + len(points) + len(flat)
        self._inputs = [
            *(state.grid, state.clock, state.model.slab_count, state.maxima, state.slots, state.peaks),
            wp.array(flat.astype(np.int32), dtype=int, device=device),
            wp.array(region_lanes.astype(np.int32), dtype=int, device=device),
            RECORD_HEAD + len(regions),
            wp.array(_flat(scene.domain, cell).astype(np.int32), dtype=int, device=device),
            wp.array(fraction, dtype=vector3, device=device),
        ]
        self._gauges = len(scene.gauges)
        self._gauge_places = _gauge_places(scene, device)
        self._first_gauge = RECORD_HEAD + self._regions + self._points
        lanes = self._first_gauge + GAUGE_LANES * self._gauges
        self._section = SectionRecorder(state, arrival_threshold(scene))
        self._times = wp.zeros(CHUNK, dtype=wp.float64, device=device)
        self._rows = wp.zeros((CHUNK, lanes), dtype=scalar, device=device)
        self._fetched: list[tuple[np.ndarray, np.ndarray]] = []
        self._first_step = 0
        self._pending = 0
        self._peaks_taken = 0
        self._gauges_taken = 0
        self._sorts_seen = 0

    @property
    def expected(self) -> Places:
        """When the detonation comes to where the state is recorded [s]."""
        return self._state.expected

    def record(self) -> None:
        """Record the state as it is now: once before the first step, then after each."""
        if self._pending == CHUNK:
            self._fetch()
        inputs = [*self._inputs, self._times, self._rows, self._first_step]
        wp.launch(record_step, self._threads, inputs=inputs, device=self._state.device)
        if self._gauges:
            self._record_gauges()
        self._section.record()
        self._pending += 1

    def take_peak(self) -> float:
        """Highest field pressure of the steps recorded since this was last asked [Pa]."""
        self._fetch()
        peak = max(float(rows[:, RECORD_FIELD_PRESSURE].max()) for _, rows in self._fetched[self._peaks_taken :])
        self._peaks_taken = len(self._fetched)
        return peak

    def take_gauges(self) -> tuple[np.ndarray, np.ndarray]:
        """What the gauges showed since this was last asked.

        Returns:
            Times (steps,) float64 [s], and (steps, gauges, 8): pressure [Pa], velocity [m/s], density [kg/m3],
            position [m].
        """
        self._fetch()
        fetched = self._fetched[self._gauges_taken :]
        self._gauges_taken = len(self._fetched)
        rows = np.concatenate([np.empty((0, self._rows.shape[1]), NUMBER), *(rows for _, rows in fetched)])
        return np.concatenate([np.empty(0), *(time for time, _ in fetched)]), self._gauge_lanes(rows)

    def saved(self) -> dict[str, np.ndarray]:
        """Everything recorded so far, for `restore`."""
        self._fetch()
        peaks_taken = sum(len(time) for time, _ in self._fetched[: self._peaks_taken])
        return {
            "time": np.concatenate([time for time, _ in self._fetched]),
            "rows": np.concatenate([rows for _, rows in self._fetched]),
            "peaks_taken": np.array(peaks_taken),
            **{f"section.{name}": values for name, values in self._section.saved().items()},
        }

    def restore(self, saved: Mapping[str, np.ndarray]) -> None:
        """Go on from what `saved` gave. The gauges' part of it counts as not yet taken.

        Raises:
            KeyError, ValueError: it is not of this scene.
        """
        time, rows, taken = saved["time"], saved["rows"], int(saved["peaks_taken"])
        if time.shape != rows.shape[:1] or rows.shape[1:] != self._rows.shape[1:] or not 0 < taken <= len(time):
            raise ValueError(f"record: {time.shape} times, rows {rows.shape}, {taken} taken")
        cuts = [part for part in (slice(0, taken), slice(taken, None)) if len(time[part])]
        self._fetched = [(time[part].astype(np.float64), rows[part].astype(NUMBER)) for part in cuts]
        self._peaks_taken = 1
        self._first_step = len(time)
        self._section.restore({name: saved[f"section.{name}"] for name in self._section.saved()})

    def result(self) -> StepRecord:
        """Everything recorded so far."""
        self._fetch()
        time = np.concatenate([time for time, _ in self._fetched])
        rows = np.concatenate([rows for _, rows in self._fetched])
        has_path = self._scene.front_path is not None
        first_point = RECORD_HEAD + self._regions
        first_on_line = first_point + len(self._places.path)
        on_path, on_line = rows[:, first_point:first_on_line], rows[:, first_on_line : self._first_gauge]
        on_gauges = self._gauge_lanes(rows)
        return StepRecord(
            time=time,
            dt=rows[:, RECORD_DT],
            particle_pressure=rows[:, RECORD_PARTICLE_PRESSURE],
            field_pressure=rows[:, RECORD_FIELD_PRESSURE],
            path_pressure=rows[:, RECORD_HEAD] if has_path else None,
            point_pressures=rows[:, RECORD_HEAD + int(has_path) : first_point],
            path=_line_record(time, self._places.path, self.expected.path, on_path),
            line=_line_record(time, self._places.line, self.expected.line, on_line),
            gauges={
                gauge.name: _gauge_record(time, on_gauges[:, number]) for number, gauge in enumerate(self._scene.gauges)
            },
            section=self._section.result(),
        )

    def _record_gauges(self) -> None:
        """Write what the gauges show into the present row; first find particles that a sorting has moved in memory."""
        state = self._state
        if self._sorts_seen != state.sorts:
            self._gauge_places.particle.assign(self._carriers())
            self._sorts_seen = state.sorts
        inputs = [state.grid, state.particles, state.clock, self._gauge_places]
        inputs += [self._first_gauge, self._rows, self._first_step]
        wp.launch(record_gauges, self._gauges, inputs=inputs, device=state.device)

    def _carriers(self) -> np.ndarray:
        """Where in memory the particle of each gauge is, (gauges,); `NO_PARTICLE` for those that stay."""
        gauges = self._scene.gauges
        carriers = np.array([NO_PARTICLE if gauge.particle is None else gauge.particle for gauge in gauges], np.int32)
        moving = carriers != NO_PARTICLE
        carriers[moving] = self._state.places_in_memory(carriers[moving])
        return carriers

    def _gauge_lanes(self, rows: np.ndarray) -> np.ndarray:
        """The gauges' part of rows, (steps, gauges, 8)."""
        return rows[:, self._first_gauge :].reshape(len(rows), self._gauges, GAUGE_LANES)

    def _fetch(self) -> None:
        if self._pending:
            count = self._pending
            self._fetched.append((self._times.numpy()[:count].copy(), self._rows.numpy()[:count].copy()))
            self._rows.zero_()
            self._first_step += count
            self._pending = 0


def nodes_near_point(domain: Domain, point: Vector, reach: float) -> np.ndarray:
    """Nodes (n, 3) of the domain within `reach` cells of a point."""
    return nodes_near_segment(domain, Segment(point, point), reach)


def nodes_near_segment(domain: Domain, segment: Segment, reach: float) -> np.ndarray:
    """Nodes (n, 3) of the domain within `reach` cells of a segment; distances are taken in cells."""
    start = np.subtract(segment.start, domain.lower) / domain.spacing
    end = np.subtract(segment.end, domain.lower) / domain.spacing
    low = np.maximum(np.floor(np.minimum(start, end) - reach), 0).astype(int)
    high = np.minimum(np.ceil(np.maximum(start, end) + reach), domain.cells).astype(int)
    axes = [np.arange(a, b + 1) for a, b in zip(low, high, strict=True)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    along = end - start
    squared = float(along @ along)
    share = np.clip((nodes - start) @ along / squared, 0.0, 1.0) if squared > 0.0 else np.zeros(len(nodes))
    distance = np.linalg.norm(nodes - start - share[:, None] * along, axis=1)
    return nodes[distance <= reach + 1e-9]


def _flat(domain: Domain, nodes: np.ndarray) -> np.ndarray:
    """Flat index of nodes (n, 3), as `kernels.records.node_index` counts."""
    count_y, count_z = domain.cells[1] + 3, domain.cells[2] + 3
    return ((nodes[:, 0] + 1) * count_y + nodes[:, 1] + 1) * count_z + nodes[:, 2] + 1


def _gauge_places(scene: Scene, device: wp.Device) -> GaugePlaces:
    """Where the scene's gauges are, as the kernels take it."""
    points = np.array([gauge.position for gauge in scene.gauges]).reshape(-1, 3)
    cell, fraction = cells_of(scene.domain, points)
    places = GaugePlaces()
    places.cell = wp.array(cell.astype(np.int32), dtype=wp.vec3i, device=device)
    places.fraction = wp.array(fraction, dtype=vector3, device=device)
    places.particle = wp.zeros(len(points), dtype=int, device=device)
    places.lower = wp.vec3d(*scene.domain.lower)
    places.spacing = wp.vec3d(*scene.domain.spacing)
    return places


def _gauge_record(time: np.ndarray, lanes: np.ndarray) -> GaugeRecord:
    """The record of a gauge from its lanes (steps, 8)."""
    return GaugeRecord(
        time=time,
        pressure=lanes[:, GAUGE_PRESSURE],
        velocity=lanes[:, GAUGE_VELOCITY : GAUGE_VELOCITY + 3],
        density=lanes[:, GAUGE_DENSITY],
        position=lanes[:, GAUGE_POSITION : GAUGE_POSITION + 3],
    )


def _line_record(time: np.ndarray, points: np.ndarray, expected: np.ndarray, pressure: np.ndarray) -> LineRecord | None:
    if len(points) == 0:
        return None
    return LineRecord(time, np.linalg.norm(points - points[0], axis=1), expected, pressure)
