"""`SceneBuilder`: collects what a scene consists of, checks it, and cuts the charges into particles."""

import re
from collections.abc import Callable, Iterable, Sequence
from typing import TypeVar

import numpy as np

from warp_mpm import checks
from warp_mpm.cells import check_aspect, domain_of_cells
from warp_mpm.charges import Body, check_fit, cut_charges, fill_what_is_free
from warp_mpm.checks import mistake
from warp_mpm.detonators import Detonator, checked
from warp_mpm.gauges import carried_gauges
from warp_mpm.geometry import Solid
from warp_mpm.ignition import resolve_detonators
from warp_mpm.materials import Material
from warp_mpm.resistance import check_resistance
from warp_mpm.scene import Domain, Gauge, Scene, SectionPlane, Segment, Vector, Walls
from warp_mpm.scene_warnings import scene_warnings

OUTSIDE_TOLERANCE = 1e-9  # of the domain's size
NAME = r"\w[\w.-]*"  # that suits a file, and the header of a table
NAME_EXPECTED = "letters, digits, '_', '-' and '.'"
PICTURES = 6  # instants worth a picture, if a scene names none

Given = TypeVar("Given")


class SceneBuilder:
    """Builds a scene step by step; `build` checks it and returns it.

    Each method checks its own values at once, `build` how they fit together. All units are SI. Errors are
    `InputError`s: one line that names the scene, the argument, what was expected, what came, and the remedy.
    """

    def __init__(self, name: str, description: str = "") -> None:
        """Start a scene.

        Args:
            name: also names the output files.
            description: one line for people.

        Raises:
            InputError: the name does not suit a file name.
        """
        if not isinstance(name, str) or not re.fullmatch(NAME, name):
            raise mistake("scene: name", NAME_EXPECTED, repr(name))
        self.name = name
        self.description = description
        self._here = f"scene {name}"
        self._domain: Domain | None = None
        self._cell_size = np.zeros(3)  # as asked for, before it was fitted to the domain
        self._walls = Walls()
        self._bodies: list[Body] = []
        self._detonators: list[Detonator] = []
        self._gravity: Vector = (0.0, 0.0, 0.0)
        self._ambient_pressure = 0.0
        self._end_time: float | None = None
        self._burn_width: float | None = None
        self._front_path: Segment | None = None
        self._line: Segment | None = None
        self._collision_points: list[Vector] = []
        self._gauges: list[Gauge] = []
        self._picture_times: tuple[float, ...] | None = None
        self._section: SectionPlane | None = None

    # ---- where the material may be ---------------------------------------------------------------------------------

    def domain(
        self,
        lower: Sequence[float],
        upper: Sequence[float],
        *,
        cell_size: float | Sequence[float] | None = None,
        cells: Sequence[int] | None = None,
        margins: float | Sequence[float] = 0.0,
    ) -> None:
        """Set the box in which material may be, cut into equal cells.

        Args:
            lower: corner of the smallest coordinates [m].
            upper: corner of the largest [m].
            cell_size: wanted cell size, one for all axes or one each [m]; as many cells as fit best fill the box.
            cells: the number of cells per axis instead.
            margins: room beyond the box, one for all faces or one each in the order of `FACE_NAMES` [m], rounded to
                whole cells: the cells inside the box are the same with and without.

        Raises:
            InputError: a number is not finite or not positive, there are too many cells, or not exactly one of
                `cell_size` and `cells` is given.
        """
        here = f"{self._here}: domain"
        low, high = checks.vector(f"{here}: lower", lower), checks.vector(f"{here}: upper", upper)
        extent = np.subtract(high, low)
        if np.any(extent <= 0.0):
            raise mistake(f"{here}: upper", f"above lower {low} on every axis", high)
        if (cell_size is None) == (cells is None):
            raise mistake(here, "either cell_size or cells", "neither" if cells is None else "both")
        if cells is None:
            self._cell_size = np.array(checks.each(f"{here}: cell_size", cell_size, 3, checks.positive))
            counts = np.maximum(np.round(extent / self._cell_size), 1.0)
        else:
            counts = np.array(checks.each(f"{here}: cells", cells, 3, checks.count))
            self._cell_size = extent / counts
        rooms = checks.each(f"{here}: margins", margins, 6, checks.not_negative)
        self._domain = domain_of_cells(here, low, high, counts, rooms)

    def walls(self, walls: Walls) -> None:
        """Set what the faces of the domain do; without this they are all slip walls.

        Raises:
            InputError: not a `Walls`.
        """
        self._walls = checks.instance(
            f"{self._here}: walls", walls, Walls, "a Walls", "all faces alike: Walls.all(Wall.OPEN)"
        )

    # ---- what it is, and what starts it ----------------------------------------------------------------------------

    def charge(
        self,
        solid: Solid,
        material: Material,
        *,
        particles_per_axis: int = 2,
        velocity: Sequence[float] | Callable[[np.ndarray], np.ndarray] | None = None,
        may_stay_unlit: bool = False,
        name: str | None = None,
    ) -> None:
        """Add a body of one material, where no charge added before it is: later ones fill only what is free.

        Args:
            solid: its shape.
            material: what it is made of.
            particles_per_axis: particles along each axis of every cell.
            velocity: at the start [m/s]: one vector for all of it, or a function that turns positions (n, 3) [m] into
                velocities (n, 3) [m/s] and is called by `build`; without one it is at rest.
            may_stay_unlit: whether parts of an explosive may never detonate; else they are an error.
            name: for detonators and messages; without one "charge_1", "charge_2", ...

        Raises:
            InputError: an argument is of the wrong kind, the solid is without end, or the name is taken.
        """
        name = f"charge_{len(self._bodies) + 1}" if name is None else name
        here = f"{self._here}: charge {name!r}"
        checks.instance(f"{here}: name", name, str, "a text")
        if any(body.name == name for body in self._bodies):
            raise mistake(here, "a name of its own", "one that another charge has")
        checks.instance(f"{here}: solid", solid, Solid, "a Solid, such as Box, Sphere or Cylinder")
        if not np.isfinite(solid.bounds()).all():
            raise mistake(
                f"{here}: solid", "one that has an end", "one without", "intersect it with a box: solid & Box"
            )
        remedy = "find_material() looks one up by its name, explosive() makes one"
        checks.instance(f"{here}: material", material, Material, "a Material", remedy)
        per_axis = checks.count(f"{here}: particles_per_axis", particles_per_axis)
        if velocity is not None and not callable(velocity):
            velocity = checks.vector(
                f"{here}: velocity", velocity, "give (vx, vy, vz) [m/s], or a function of positions"
            )
        checks.flag(f"{here}: may_stay_unlit", may_stay_unlit)
        self._bodies.append(Body(name, solid, material, per_axis, velocity, may_stay_unlit))

    def detonator(self, *detonators: Detonator) -> None:
        """Add a detonator, or several: `detonator(*ring(...))`. One that names no charges lights the charge it lies in.

        Its wave runs through all explosives that touch, around what does not burn. To a charge that it names and does
        not lie in it runs straight, whatever lies between.

        Raises:
            InputError: not a detonator, a number is not finite, the time is negative, a normal or a line has no length,
                or a radius or a speed is not positive.
        """
        for detonator in detonators:
            self._detonators.append(checked(f"{self._here}: detonator {len(self._detonators) + 1}", detonator))

    def gravity(self, acceleration: Sequence[float]) -> None:
        """Set a constant body force [m/s2]; without this there is none.

        Raises:
            InputError: not three finite numbers.
        """
        self._gravity = checks.vector(f"{self._here}: gravity", acceleration)

    def ambient_pressure(self, pressure: float) -> None:
        """Set the pressure outside the open faces [Pa]; without this it is 0.

        Raises:
            InputError: not a finite number of at least 0.
        """
        self._ambient_pressure = checks.not_negative(f"{self._here}: ambient_pressure", pressure)

    def end_time(self, time: float) -> None:
        """Set when the simulation ends [s].

        Raises:
            InputError: not a positive finite number.
        """
        self._end_time = checks.positive(f"{self._here}: end_time", time)

    def burn_width(self, cells: float) -> None:
        """Recommend a width of the burn zone to the solver [cells].

        Raises:
            InputError: not a positive finite number.
        """
        self._burn_width = checks.positive(f"{self._here}: burn_width", cells)

    # ---- what to look at -------------------------------------------------------------------------------------------

    def front_path(self, start: Sequence[float], end: Sequence[float]) -> None:
        """Set the line [m], from a detonator on, along which front pressure and front speed are measured.

        Raises:
            InputError: not two different points.
        """
        self._front_path = self._segment("front_path", start, end)

    def line(self, start: Sequence[float], end: Sequence[float]) -> None:
        """Set the line [m] along which the pressure is recorded at every step; without this it is the front path.

        Raises:
            InputError: not two different points.
        """
        self._line = self._segment("line", start, end)

    def collision_point(self, point: Sequence[float]) -> None:
        """Add a point [m] where fronts are expected to meet.

        Raises:
            InputError: not three finite numbers.
        """
        here = f"{self._here}: collision_point {len(self._collision_points) + 1}"
        self._collision_points.append(checks.vector(here, point))

    def gauge(self, point: Sequence[float], *, name: str | None = None, moving: bool = False) -> None:
        """Add a point where pressure, velocity and density are recorded at every step.

        One that stays shows the field at its place, linear between the eight nodes around it: their field pressure,
        their density (mass over the volume that the matter there takes), and the velocity of that mass. What passes
        through a cell is seen smeared over about a cell; outside of matter all three are 0. One that moves shows its
        particle's own pressure, density and velocity, and where it is; all but the place are 0 once the particle has
        left through an open face. Both go into gauges.csv, what follows from them into summary.json.

        Args:
            point: where it is [m]; one that moves is carried by the particle that is nearest to it at the start.
            name: for tables and pictures; without one "gauge_1", "gauge_2", ...
            moving: whether it moves with the matter.

        Raises:
            InputError: not three finite numbers, or a name that is taken or does not suit the header of a table.
        """
        name = f"gauge_{len(self._gauges) + 1}" if name is None else name
        here = f"{self._here}: gauge {name!r}"
        if not isinstance(name, str) or not re.fullmatch(NAME, name):
            raise mistake(f"{here}: name", NAME_EXPECTED, repr(name))
        if any(gauge.name == name for gauge in self._gauges):
            raise mistake(here, "a name of its own", "one that another gauge has")
        checks.flag(f"{here}: moving", moving)
        self._gauges.append(Gauge(name, checks.vector(f"{here}: point", point), moving))

    def picture_times(self, times: Iterable[float]) -> None:
        """Set the instants worth a picture [s]; without this they are six, equally spaced up to the end.

        Raises:
            InputError: one is not a finite number of at least 0.
        """
        here = f"{self._here}: picture_times"
        checks.instance(here, times, Iterable, "numbers of at least 0")
        self._picture_times = tuple(checks.not_negative(here, time) for time in times)

    def section(self, axis: int, coordinate: float) -> None:
        """Set the plane, normal to `axis` (0, 1, 2) at `coordinate` [m], on which the field pressure is shown.

        Without this it cuts the charges half-way across the axis along which they are thinnest.

        Raises:
            InputError: not an axis, or not a finite number.
        """
        here = f"{self._here}: section"
        if isinstance(axis, bool) or axis not in (0, 1, 2):
            raise mistake(f"{here}: axis", "0, 1 or 2", repr(axis))
        self._section = SectionPlane(int(axis), checks.finite(f"{here}: coordinate", coordinate))

    # ---- the scene -------------------------------------------------------------------------------------------------

    def build(self) -> Scene:
        """Check how everything fits together, cut the charges into particles, and return the scene.

        Raises:
            InputError: something is missing, does not fit, or needs more memory than there is; or explosive that has
                no pressure before it burns may be reached by something else before its own wave (`resistance.py`).
        """
        domain = self._given("domain", self._domain)
        end_time = self._given("end_time", self._end_time)
        if not self._bodies:
            raise mistake(f"{self._here}: charges", "at least one", "none", "add one with charge()")
        check_fit(self._here, self._bodies, domain, self._cell_size)
        check_aspect(self._here, domain)
        bodies = fill_what_is_free(self._here, self._bodies)
        section = self._section if self._section is not None else _mid_plane([body.solid for body in bodies])
        self._check_views(domain, end_time, section)
        reach = max(domain.spacing) / 2
        detonators = resolve_detonators(self._here, self._detonators, bodies, reach)
        charges = cut_charges(self._here, bodies, domain)
        check_resistance(self._here, charges, detonators, 2.0 * reach, end_time)
        pictures = self._picture_times
        if pictures is None:
            pictures = tuple(end_time * part / PICTURES for part in range(1, PICTURES + 1))
        return Scene(
            name=self.name,
            domain=domain,
            walls=self._walls,
            charges=charges,
            detonators=detonators,
            end_time=end_time,
            section=section,
            description=self.description,
            gravity=self._gravity,
            ambient_pressure=self._ambient_pressure,
            burn_width=self._burn_width,
            front_path=self._front_path,
            line=self._line if self._line is not None else self._front_path,
            collision_points=tuple(self._collision_points),
            picture_times=pictures,
            gauges=carried_gauges(self._here, self._gauges, domain, charges),
            warnings=scene_warnings(
                *(charges, [body.solid for body in self._bodies], detonators),
                *(domain, end_time, self._ambient_pressure),
            ),
        )

    def _given(self, name: str, value: Given | None) -> Given:
        if value is None:
            raise mistake(f"{self._here}: {name}", "a value", "none", f"set it with {name}()")
        return value

    def _segment(self, name: str, start: Sequence[float], end: Sequence[float]) -> Segment:
        here = f"{self._here}: {name}"
        segment = Segment(checks.vector(f"{here}: start", start), checks.vector(f"{here}: end", end))
        if segment.length == 0.0:  # their difference may be too small for a number
            raise mistake(f"{here}: end", "another point than start", segment.end)
        return segment

    def _check_views(self, domain: Domain, end_time: float, section: SectionPlane) -> None:
        """Check that what is looked at lies in the domain and before the end."""
        points = {f"collision_point {n}": point for n, point in enumerate(self._collision_points, start=1)}
        points |= {f"gauge {gauge.name!r}": gauge.position for gauge in self._gauges}
        for name, segment in (("front_path", self._front_path), ("line", self._line)):
            if segment is not None:
                points |= {f"{name}: start": segment.start, f"{name}: end": segment.end}
        x, y, z = (section.coordinate if axis == section.axis else domain.lower[axis] for axis in range(3))
        points["section"] = (x, y, z)
        tolerance = OUTSIDE_TOLERANCE * np.subtract(domain.upper, domain.lower)
        for name, point in points.items():
            if np.any(point < domain.lower - tolerance) or np.any(point > domain.upper + tolerance):
                expected = f"inside the domain, from {domain.lower} to {domain.upper} m"
                raise mistake(f"{self._here}: {name}", expected, point)
        for time in self._picture_times or ():
            if time > end_time:
                raise mistake(f"{self._here}: picture_times", f"at most the end time, {end_time:g} s", f"{time:g} s")


def _mid_plane(solids: Sequence[Solid]) -> SectionPlane:
    """The plane half-way across the thinnest axis of the solids; of equally thin axes the last."""
    bounds = np.array([solid.bounds() for solid in solids])
    lower, upper = bounds[:, 0].min(axis=0), bounds[:, 1].max(axis=0)
    extent = upper - lower
    axis = max(axis for axis in range(3) if extent[axis] <= extent.min() * (1.0 + OUTSIDE_TOLERANCE))
    return SectionPlane(axis, float(lower[axis] + upper[axis]) / 2)
