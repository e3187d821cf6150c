"""The figures of a run: how fast and how high the front was, against Chapman-Jouguet theory."""

from dataclasses import dataclass

import numpy as np

from warp_mpm.exact.reflection import collision_pressure
from warp_mpm.materials import Material
from warp_mpm.output.frame import GaugeRecord, LineRecord, StepRecord
from warp_mpm.scene import Scene

ARRIVAL_SHARE = 0.05  # of p_CJ: the front has arrived at a point when the field pressure there reaches it
NOTABLE_RISE = 2.0  # over a gauge's first pressure: less is no front
FITTED_PART = (0.1, 1.0)  # of the front path: what the burning start of the wave does is left out
MEETING_PART = (0.25, 0.85)  # of the way from a detonator to a collision: start and collision zone are left out
PLATEAU_PART = (0.5, 0.9)  # of the travel time: when the front pressure is taken


@dataclass(frozen=True)
class FrontSpeed:
    """Straight-line fit of the front's arrival along the front path over the way of the ideal wave, D t_b.

    On a ray from a detonator that is the distance; elsewhere the front comes to the path around something or aslant.
    """

    speed: float  # [m/s]
    residual: float  # largest distance of an arrival from the line [m]
    offset: float  # how far ahead of (+) or behind (-) the ideal wave the line is at the path's middle [m]


def lit_explosive(scene: Scene) -> Material | None:
    """The explosive that the scene is about: the one in which the middle of the front path lies.

    Without a front path the one that the first detonator lights, or the first one; None without any.
    """
    explosives = {charge.name: charge.material for charge in scene.charges if charge.material.burn is not None}
    if scene.front_path is not None:
        middle = scene.front_path.points(3)[1:2]
        for charge in scene.charges:
            if charge.name in explosives and charge.solid.contains(middle)[0]:
                return charge.material
    for detonator in scene.detonators:
        for name in detonator.charges:
            if name in explosives:
                return explosives[name]
    return next(iter(explosives.values()), None)


def arrival_threshold(scene: Scene) -> float | None:
    """Field pressure at which the front counts as arrived [Pa]; None without an explosive that has a CJ state."""
    material = lit_explosive(scene)
    return None if material is None or material.cj is None else ARRIVAL_SHARE * material.cj.pressure


def color_limit(scene: Scene) -> float:
    """Pressure of the last colour [Pa]: 1.6 p_CJ shows fronts and collisions.

    Without explosive, the energy density rho (e + |v|^2 / 2) of the charge that has most of it at the start.
    """
    material = lit_explosive(scene)
    if material is not None and material.cj is not None:
        return 1.6 * material.cj.pressure
    return max(c.material.density * (c.material.specific_energy + 0.5 * c.greatest_speed**2) for c in scene.charges)


def arrival_times(record: LineRecord, threshold: float) -> np.ndarray:
    """When the pressure at each point of a line first reached a threshold [s], interpolated in time; NaN if never."""
    reached = record.pressure >= threshold
    step = np.argmax(reached, axis=0)
    points = np.arange(reached.shape[1])
    before = np.maximum(step - 1, 0)
    low, high = record.pressure[before, points], record.pressure[step, points]
    share = np.where(high > low, (threshold - low) / np.where(high > low, high - low, 1.0), 1.0)
    times = record.time[before] + share * (record.time[step] - record.time[before])
    return np.where(reached.any(axis=0), times, np.nan)


def front_speed(record: StepRecord, material: Material) -> FrontSpeed | None:
    """Speed of the front along the front path; None if it did not run far enough to tell."""
    if record.path is None or material.cj is None or material.burn is None:
        return None
    distance, expected = record.path.distance, record.path.expected
    arrived = arrival_times(record.path, ARRIVAL_SHARE * material.cj.pressure)
    low, high = (share * distance[-1] for share in FITTED_PART)
    used = np.isfinite(arrived) & np.isfinite(expected) & (distance >= low) & (distance <= high)
    if used.sum() < 3 or np.ptp(arrived[used]) == 0.0:
        return None
    time, way = arrived[used], material.burn.detonation_speed * expected[used]
    speed, start = np.polyfit(time, way, 1)
    residual = float(np.abs(way - (speed * time + start)).max())
    offset = float(np.mean(way - material.burn.detonation_speed * time))
    return FrontSpeed(float(speed), residual, offset)


def meeting_points(scene: Scene, record: StepRecord, material: Material) -> list[float | None]:
    """Where on the line the fronts met, for each collision point: distance from the line's start [m].

    Straight lines are fitted to the arrivals from either side; they cross where the fronts meet, far more exactly than
    the cells resolve. None where a side has too few points.
    """
    if record.line is None or scene.line is None or material.cj is None:
        return [None] * len(scene.collision_points)
    start = np.array(scene.line.start)
    along = (np.array(scene.line.end) - start) / scene.line.length
    arrived = arrival_times(record.line, ARRIVAL_SHARE * material.cj.pressure)
    sources = np.sort([(np.array(detonator.position) - start) @ along for detonator in scene.detonators])
    met: list[float | None] = []
    for point in scene.collision_points:
        place = float((np.array(point) - start) @ along)
        below, above = sources[sources < place], sources[sources > place]
        if len(below) == 0 or len(above) == 0:
            met.append(None)
            continue
        low = _arrival_fit(record.line.distance, arrived, below[-1], place)
        high = _arrival_fit(record.line.distance, arrived, above[0], place)
        met.append((high[1] - low[1]) / (low[0] - high[0]) if low and high and low[0] != high[0] else None)
    return met


def _arrival_fit(distance: np.ndarray, arrived: np.ndarray, source: float, end: float) -> tuple[float, float] | None:
    """Slope [s/m] and intercept [s] of the arrivals between a source and the end of its way; None if too few."""
    share = (distance - source) / (end - source)
    used = np.isfinite(arrived) & (share > MEETING_PART[0]) & (share < MEETING_PART[1])
    if used.sum() < 3:
        return None
    slope, intercept = np.polyfit(distance[used], arrived[used], 1)
    return float(slope), float(intercept)


def collision_theory(material: Material) -> float:
    """Pressure at the instant of contact where two plane fronts in this explosive meet head-on [Pa]."""
    return collision_pressure(material.equation_of_state, material.density, material.specific_energy)


def front_pressure(record: StepRecord) -> float | None:
    """Median over steps of the highest field pressure around the front path, late on its way [Pa]."""
    if record.path is None or record.path_pressure is None or not np.isfinite(record.path.expected).any():
        return None
    came = record.path.expected[np.isfinite(record.path.expected)]
    first, last = (came[0] + share * (came[-1] - came[0]) for share in PLATEAU_PART)
    used = (record.time >= first) & (record.time <= last)
    return float(np.median(record.path_pressure[used])) if used.any() else None


def gauge_pressure(record: StepRecord) -> float | None:
    """What gauges on the front path would show: median over its later part of the highest pressure at a point [Pa].

    A node sees the front's peak only at the step when it passes; between nodes the highest nodal value, of which
    `front_pressure` takes the median over steps, is a per cent or two lower.
    """
    if record.path is None or not np.isfinite(record.path.expected).any():
        return None
    end = record.path.expected[np.isfinite(record.path.expected)][-1]
    before = record.time <= end
    share = record.path.distance / record.path.distance[-1]
    used = (share >= PLATEAU_PART[0]) & (share <= PLATEAU_PART[1])
    if not used.any() or record.time[-1] < end:
        return None
    return float(np.median(record.path.pressure[before][:, used].max(axis=0)))


def gauge_figures(scene: Scene, record: StepRecord, material: Material | None) -> dict[str, dict[str, float | None]]:
    """By gauge: when the front arrived, the highest pressure and its time, and the impulse, the integral of p dt.

    The front has arrived when the pressure reaches 0.05 p_CJ, as along the front path, or in what does not burn half of
    its rise; None if it never did, or without an explosive. A pressure that stayed zero was highest at no time. Of a
    gauge that saw nothing but vacuum everything is None.
    """
    figures: dict[str, dict[str, float | None]] = {}
    for name, gauge in record.gauges.items():
        line = LineRecord(gauge.time, np.zeros(1), np.full(1, np.nan), gauge.pressure[:, None])
        threshold = _gauge_threshold(scene, name, gauge.pressure, material)
        arrival = np.nan if threshold is None else float(arrival_times(line, threshold)[0])
        highest = int(np.argmax(gauge.pressure))
        peak, matter = float(gauge.pressure[highest]), _saw_matter(gauge)
        mean = 0.5 * (gauge.pressure[1:].astype(np.float64) + gauge.pressure[:-1])
        figures[name] = {
            "arrival_time_s": arrival if np.isfinite(arrival) else None,
            "peak_pressure_pa": peak if matter else None,
            "peak_time_s": float(gauge.time[highest]) if peak > 0.0 else None,
            "impulse_pa_s": float(mean @ np.diff(gauge.time)) if matter else None,
        }
    return figures


def gauge_warnings(scene: Scene, record: StepRecord) -> list[str]:
    """What to warn of fixed gauges that saw no matter: their zeros are those of vacuum."""
    fixed = [gauge.name for gauge in scene.gauges if not gauge.moving]
    unseen = [name for name in fixed if not _saw_matter(record.gauges[name])]
    if not unseen:
        return []
    names, end = ", ".join(repr(name) for name in unseen), f"{record.time[-1] * 1e6:g} us"
    return [f"gauges: nothing came to {names} before {end}, it was in vacuum; move it towards a charge, or end later"]


def _saw_matter(gauge: GaugeRecord) -> bool:
    """Whether a gauge was ever anywhere else than in vacuum."""
    return bool(gauge.density.any())


def _gauge_threshold(scene: Scene, name: str, pressure: np.ndarray, material: Material | None) -> float | None:
    """Pressure at which the front has arrived at a gauge that saw pressures (steps,) [Pa]; None if none can have."""
    if material is None or material.cj is None:
        return None
    place = np.array([gauge.position for gauge in scene.gauges if gauge.name == name])
    inert = [charge for charge in scene.charges if charge.material.burn is None]
    if not any(charge.solid.contains(place)[0] for charge in inert):
        return ARRIVAL_SHARE * material.cj.pressure
    first, highest = float(pressure[0]), float(pressure.max())
    return 0.5 * (first + highest) if highest > NOTABLE_RISE * first else None


def theory(scene: Scene) -> dict[str, float | None]:
    """What Chapman-Jouguet theory says of the explosive that the scene is about; None without one."""
    material = lit_explosive(scene)
    return {
        "p_cj_pa": material.cj.pressure if material is not None and material.cj is not None else None,
        "detonation_speed_m_s": material.burn.detonation_speed if material is not None and material.burn else None,
    }


def figures_of_merit(scene: Scene, record: StepRecord) -> dict[str, object]:
    """The keys of summary.json that compare the run with theory; None where they do not apply."""
    material = lit_explosive(scene)
    fit = front_speed(record, material) if material is not None else None
    collisions = [float(value) for value in record.point_pressures.max(axis=0)]
    return {
        **theory(scene),
        "front_pressure_pa": front_pressure(record),
        "front_gauge_pressure_pa": gauge_pressure(record),
        "front_speed_m_s": fit.speed if fit else None,
        "front_fit_residual_m": fit.residual if fit else None,
        "front_offset_m": fit.offset if fit else None,
        "collision_pressure_pa": max(collisions) if collisions else None,
        "collision_pressures_pa": collisions,
        "collision_theory_pa": collision_theory(material) if material is not None and collisions else None,
        "collision_positions_m": meeting_points(scene, record, material) if material is not None else [],
        "peak_pressure_pa": float(record.field_pressure.max()),
        "max_particle_pressure_pa": float(record.particle_pressure.max()),
        "gauges": gauge_figures(scene, record, material),
    }
