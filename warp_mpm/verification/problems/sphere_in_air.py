"""The shock of a ball of TNT in air, against measured ones."""

from collections.abc import Mapping

import numpy as np

from warp_mpm.exact.air_blast import incident_overpressure
from warp_mpm.materials import ATMOSPHERE
from warp_mpm.result import Result
from warp_mpm.scene import Scene
from warp_mpm.scenes import sphere_in_air
from warp_mpm.scenes.sphere_in_air import GAUGES, RADIUS, SIZE
from warp_mpm.verification.problem import Axis, Bound, Curve, Level, Measurement, Panel, Problem, ladder

NEAREST = 3  # charge radii from which on the pressures are shown


class SphereInAir(Problem):
    """The shipped scene; the reference is a fit to measurements, not an exact solution."""

    name = "sphere_in_air"
    title = "A ball of TNT in air"
    statement = (
        "A ball of TNT of 50 mm, lit in its center, in air at standard pressure (ideal gas, gamma = 1.4). "
        "'deviation_4' to 'deviation_8' are how far the highest overpressures at 4 to 8 charge radii, on the diagonal "
        "of an octant, are from measured ones. The shocked air is a few cells thick, so that its peak is smeared."
    )
    reference = "C. N. Kingery, G. Bulmash, ARBRL-TR-02555, 1984; warp_mpm/exact/air_blast.py"
    cells_across = "5 charge radii"
    levels = ladder(25, 40)
    more_levels = ladder(50)
    answer = "measured"
    panels = (Panel("overpressure", Axis("distance", "charge radii"), Axis("highest overpressure", "MPa", 1e6)),)
    bounds = tuple(
        Bound(f"deviation_{radii}", low=-0.3, high=0.3, from_cells=40, why="measured shocks scatter by as much")
        for radii in GAUGES
    )

    def scene(self, level: Level) -> Scene:
        """The shipped scene."""
        return sphere_in_air.scene(cell_size=SIZE * RADIUS / level.cells)

    def measure(self, level: Level, result: Result) -> Measurement:
        """The highest overpressures at the gauges, and along the diagonal."""
        measured = dict(zip(GAUGES, _measured(np.array(GAUGES)), strict=True))
        peaks = {radii: result.summary["gauges"][f"at_{radii}_radii"]["peak_pressure_pa"] for radii in GAUGES}
        line = result.record.line
        assert line is not None
        highest = line.pressure.max(axis=0) - ATMOSPHERE
        shown = line.distance >= NEAREST * RADIUS
        return Measurement(
            figures={f"deviation_{radii}": (peaks[radii] - ATMOSPHERE) / measured[radii] - 1.0 for radii in GAUGES},
            curves={"overpressure": Curve(line.distance[shown] / RADIUS, highest[shown])},
        )

    def exact_curves(self, level: Level) -> Mapping[str, Curve]:
        """The measured ones."""
        radii = np.linspace(NEAREST, max(GAUGES), 200)
        return {"overpressure": Curve(radii, _measured(radii))}


def _measured(radii: np.ndarray) -> np.ndarray:
    """Measured highest overpressures (n,) [Pa] at distances (n,) [charge radii]."""
    whole = 1630.0 * 4.0 / 3.0 * np.pi * RADIUS**3
    return incident_overpressure(radii * RADIUS, whole)


PROBLEMS = (SphereInAir(),)
