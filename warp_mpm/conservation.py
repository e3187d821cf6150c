"""The audit: mass, momentum and energy, with everything that crossed the domain's faces added back."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np

from warp_mpm.config import Order
from warp_mpm.kernels import reduce
from warp_mpm.kernels.records import AMBIENT_WORK, CLAMPED_ENERGY, OUTFLOW_LANES, TALLIES
from warp_mpm.kernels.walls import REACTIONS
from warp_mpm.scene import FACE_NAMES
from warp_mpm.solver import Solver
from warp_mpm.state import State


@dataclass(frozen=True)
class Totals:
    """Sums at one instant, SI units."""

    time: float
    mass: float
    momentum: np.ndarray  # (3,)
    absolute_momentum: float  # sum m |v|
    kinetic: float
    internal: float
    released: float  # sum F m E0 of explosives
    volume: float
    position: np.ndarray  # (3,) sum m x
    grid_mass: float | None  # None where the grid still holds the instant before (USF)
    mass_out: np.ndarray  # (6,) per face
    momentum_out: np.ndarray  # (6, 3) per face
    energy_out: float
    clamped_energy: float
    ambient_work: float
    wall_impulse: np.ndarray  # (6, 3) by each face on the material


@dataclass
class Audit:
    """Compares the totals of a run with those at its start, and keeps the largest errors.

    * mass: |grid - particles| / charge mass, and |particles + outflow - rho0 V| / charge mass;
    * momentum: |P - P(0) + P_out - J_walls - J_gravity| / max of sum m |v|;
    * energy: |E - E(0)| / E(0), outflow, ambient work and potential energy added, clamps taken off.

    Under gravity both figures hold without outflow: the potential energy and the weight of matter that leaves between
    two audits are known to the interval between them only.
    """

    gravity: np.ndarray  # (3,) [m/s2]
    charge_mass: float  # rho0 x volume [kg]
    mass_error: float = 0.0
    energy_error: float = 0.0
    largest_momentum: float = 0.0  # of sum m |v| [kg m/s]
    largest_momentum_defect: float = 0.0  # [kg m/s]
    _first: Totals | None = None
    _last: Totals | None = None
    _gravity_impulse: np.ndarray = field(default_factory=lambda: np.zeros(3))

    @property
    def momentum_error(self) -> float | None:
        """Largest defect over the largest sum m |v|; None before anything has moved."""
        return self.largest_momentum_defect / self.largest_momentum if self.largest_momentum > 0.0 else None

    @property
    def clamped_share(self) -> float:
        """Energy added to particles that would have had less than none, over that of all at the start."""
        if self._first is None or self._last is None:
            return 0.0
        return self._last.clamped_energy / abs(self._energy(self._first))

    def add(self, totals: Totals) -> None:
        """Take the totals of a later instant into account."""
        first = self._first = self._first or totals
        last = self._last or totals
        mean_mass = 0.5 * (last.mass + totals.mass)
        self._gravity_impulse = self._gravity_impulse + self.gravity * mean_mass * (totals.time - last.time)
        self._last = totals
        lost = totals.mass + totals.mass_out.sum() - self.charge_mass
        grid = 0.0 if totals.grid_mass is None else totals.grid_mass - totals.mass
        self.mass_error = float(max(self.mass_error, abs(lost) / self.charge_mass, abs(grid) / self.charge_mass))
        defect = totals.momentum - first.momentum + totals.momentum_out.sum(axis=0)
        defect = defect - totals.wall_impulse.sum(axis=0) - self._gravity_impulse
        self.largest_momentum = max(self.largest_momentum, totals.absolute_momentum)
        self.largest_momentum_defect = max(self.largest_momentum_defect, float(np.linalg.norm(defect)))
        start = self._energy(first)
        self.energy_error = max(self.energy_error, abs(self._energy(totals) - start) / abs(start))

    def saved(self) -> dict[str, np.ndarray]:
        """Everything that was taken into account so far, for `restore`."""
        saved: dict[str, np.ndarray] = {}
        for name, value in vars(self).items():
            parts = (
                {f"{name}.{part}": of for part, of in vars(value).items()}
                if isinstance(value, Totals)
                else {name: value}
            )
            saved |= {part: np.array(of) for part, of in parts.items() if of is not None}
        return saved

    def restore(self, saved: Mapping[str, np.ndarray]) -> None:
        """Go on from what `saved` gave."""
        values = {name: value.item() if value.ndim == 0 else value for name, value in saved.items()}
        for name in [item.name for item in fields(self) if item.name in values]:
            setattr(self, name, values[name])
        self._first, self._last = (_totals(values, name) for name in ("_first", "_last"))

    def _energy(self, totals: Totals) -> float:
        inside = totals.kinetic + totals.internal - float(self.gravity @ totals.position)
        return inside + totals.energy_out + totals.ambient_work - totals.clamped_energy


def _totals(values: Mapping[str, Any], name: str) -> Totals | None:
    """The totals among saved values; what was None was not saved."""
    found: dict[str, Any] = {item.name: values.get(f"{name}.{item.name}") for item in fields(Totals)}
    return None if found["time"] is None else Totals(**found)


def totals_of(solver: Solver) -> Totals:
    """The totals of a solver's present state."""
    state = solver.state
    sums, grid_mass = solver.audit()
    tallies = state.tallies.numpy().reshape(-1, TALLIES).sum(axis=0)
    outflow = tallies[: 6 * OUTFLOW_LANES].reshape(6, OUTFLOW_LANES)
    return Totals(
        time=float(state.clock_values()["time"]),
        mass=float(sums[reduce.AUDIT_MASS]),
        momentum=sums[reduce.AUDIT_MOMENTUM : reduce.AUDIT_MOMENTUM + 3].copy(),
        absolute_momentum=float(sums[reduce.AUDIT_ABSOLUTE_MOMENTUM]),
        kinetic=float(sums[reduce.AUDIT_KINETIC]),
        internal=float(sums[reduce.AUDIT_INTERNAL]),
        released=float(sums[reduce.AUDIT_RELEASED]),
        volume=float(sums[reduce.AUDIT_VOLUME]),
        position=sums[reduce.AUDIT_POSITION : reduce.AUDIT_POSITION + 3].copy(),
        grid_mass=None if solver.model.config.order is Order.USF else grid_mass,
        mass_out=outflow[:, 0].copy(),
        momentum_out=outflow[:, 1:4].copy(),
        energy_out=float(outflow[:, 4].sum()),
        clamped_energy=float(tallies[CLAMPED_ENERGY]),
        ambient_work=float(tallies[AMBIENT_WORK]),
        wall_impulse=state.impulses.numpy().reshape(-1, REACTIONS).sum(axis=0).reshape(6, 3),
    )


def sparse_share(state: State) -> float:
    """Share of the explosives' particles in the domain that are larger than a cell; 0 without any.

    Where gas has become so thin, particles lie farther apart than nodes: cells between them are empty.
    """
    charges, domain = state.model.scene.charges, state.model.scene.domain
    burns = np.repeat([charge.material.burn is not None for charge in charges], [len(c.positions) for c in charges])
    mass, density = state.field("mass"), state.field("density")
    inside = burns & (mass > 0.0)
    return float(np.mean(mass[inside] > density[inside] * domain.cell_volume)) if inside.any() else 0.0


def history_row(
    totals: Totals, step: int, dt: float, peak_pressure: float, spread: float, sparse: float
) -> dict[str, float]:
    """A row of history.csv."""
    row: dict[str, float] = {
        "time_s": totals.time,
        "step": step,
        "dt_s": dt,
        "peak_pressure_pa": peak_pressure,
        "pressure_spread": spread,
        "sparse_share": sparse,
        "mass_kg": totals.mass,
        "momentum_x": totals.momentum[0],
        "momentum_y": totals.momentum[1],
        "momentum_z": totals.momentum[2],
        "kinetic_J": totals.kinetic,
        "internal_J": totals.internal,
        "released_J": totals.released,
        "particle_volume_m3": totals.volume,
    }
    for face, name in enumerate(FACE_NAMES):
        row[f"mass_out_{name}_kg"] = totals.mass_out[face]
        for axis, letter in enumerate("xyz"):
            row[f"impulse_{name}_{letter}_Ns"] = totals.wall_impulse[face, axis]
    return row
