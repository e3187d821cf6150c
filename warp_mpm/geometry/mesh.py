"""Solids bounded by a closed surface of triangles."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import warp as wp

from warp_mpm.checks import mistake
from warp_mpm.geometry.closed_surface import check_closed, enclosed_volume, is_convex, merged, outward_normals
from warp_mpm.geometry.placement import Placement
from warp_mpm.geometry.solid import Bounds, Solid
from warp_mpm.kernels import surface
from warp_mpm.kernels.precision import single, single_vector3
from warp_mpm.warp_startup import start_quietly

LARGEST = 1e30  # coordinate [m]: volumes stay finite
FLAT = 1e-9  # volume of a surface that encloses nothing, of its size cubed
SAMPLES = 20_000  # points that tell whether the surface encloses its volume once
STANDARD_ERRORS = 6.0  # that what they tell may be off


@dataclass(frozen=True, eq=False)
class Mesh(Solid):
    """What a closed surface of triangles encloses; `load_mesh` reads one from a file.

    Its volume is exact. Distances are those to the triangles, to about 1e-7 of its size.
    """

    vertices: np.ndarray  # (n, 3) float64 [m]
    faces: np.ndarray  # (m, 3) int32 indices of vertices, counter-clockwise seen from outside
    name: str = "Mesh"  # start of the error messages

    def __post_init__(self) -> None:
        """Merge vertices at the same place, and check the surface.

        Raises:
            InputError: there are no faces, a face refers to no vertex, a coordinate is not finite, or the surface is
                open, inverted, flat, cuts itself, or encloses something twice.
        """
        start_quietly()
        vertices, faces = _arrays(self.name, self.vertices, self.faces)
        vertices, faces = merged(self.name, vertices, faces)
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "faces", faces)
        check_closed(self.name, vertices, faces)
        self._check_volume()
        self._check_cuts()
        self._check_samples()
        object.__setattr__(self, "convex", is_convex(self._near, faces))

    def bounds(self) -> Bounds:
        """The tightest box around the vertices."""
        return self.vertices.min(axis=0), self.vertices.max(axis=0)

    def contains(self, points: np.ndarray) -> np.ndarray:
        """Which points lie inside."""
        lower, upper = self.bounds()
        inside = np.all((points >= lower) & (points <= upper), axis=1)
        inside[inside] = self.signed_distance(points[inside]) < 0.0
        return inside

    def signed_distance(self, points: np.ndarray) -> np.ndarray:
        """Distance to the nearest triangle."""
        near = ((points - self._center) / self._size).astype(wp.dtype_to_numpy(single))
        reach = 2.0 + float(np.abs(near).max(initial=0.0)) * 2.0  # farther than any vertex
        distances = wp.zeros(len(near), dtype=single, device="cpu")
        inputs = [self._surface.id, self._normals, reach, wp.array(near, dtype=single_vector3, device="cpu"), distances]
        wp.launch(surface.signed_distances, len(near), inputs=inputs, device="cpu")
        return distances.numpy().astype(float) * self._size

    def exact_volume(self) -> float:
        """By the divergence theorem."""
        return enclosed_volume(self.vertices - self._center, self.faces)

    def placed(self, placement: Placement) -> "Mesh":
        """Another mesh; what was checked of this one is true of it."""
        other = object.__new__(Mesh)
        kept = {"faces": self.faces, "name": self.name, "convex": self.convex}
        for name, value in {"vertices": placement.points(self.vertices), **kept}.items():
            object.__setattr__(other, name, value)
        return other

    def hull(self) -> np.ndarray:
        """The vertices."""
        return self.vertices

    @cached_property
    def _center(self) -> np.ndarray:
        """Middle of its bounds, (3,) [m]."""
        lower, upper = self.bounds()
        return (lower + upper) / 2

    @cached_property
    def _size(self) -> float:
        """Longest edge of its bounds [m]."""
        return float(np.ptp(self.vertices, axis=0).max())

    @cached_property
    def _near(self) -> np.ndarray:
        """Vertices about the middle and in units of the size, (n, 3): in single precision they lose little."""
        return (self.vertices - self._center) / self._size

    @cached_property
    def _surface(self) -> wp.Mesh:
        """What Warp searches."""
        points: wp.array = wp.array(self._near, dtype=single_vector3, device="cpu")
        return wp.Mesh(points, wp.array(self.faces.ravel(), dtype=wp.int32, device="cpu"))

    @cached_property
    def _normals(self) -> wp.array:
        """What tells inside from outside, as `surface.signed_distances` takes it."""
        return wp.array(outward_normals(self._near, self.faces).reshape(-1, 3), dtype=single_vector3, device="cpu")

    def _check_volume(self) -> None:
        """Refuse a surface that is inverted or flat."""
        volume, flat = self.exact_volume(), FLAT * self._size**3
        if abs(volume) <= flat:
            raise mistake(self.name, "a surface that encloses a volume", f"{volume:.3g} m3", "it is flat or folded up")
        if volume < 0.0:
            got = f"one whose faces look inwards (volume {volume:.3g} m3)"
            raise mistake(self.name, "faces that are counter-clockwise seen from outside", got, "flip its faces")

    def _check_cuts(self) -> None:
        """Refuse a surface that goes through itself."""
        found = wp.zeros(len(self.faces), dtype=wp.int32, device="cpu")
        vertices: wp.array = wp.array(self._near, dtype=wp.vec3d, device="cpu")
        wp.launch(surface.find_cuts, len(self.faces), inputs=[self._surface.id, vertices, found], device="cpu")
        cuts = found.numpy()
        if cuts.any():
            first = self.vertices[self.faces[np.argmax(cuts > 0)]].mean(axis=0)
            place = ", ".join(f"{value:g}" for value in first)
            raise mistake(
                self.name,
                "a surface that does not go through itself",
                f"{np.count_nonzero(cuts)} faces that cut others, the first near ({place}) m",
                "unite its parts into one surface",
            )

    def _check_samples(self) -> None:
        """Refuse a surface some of whose parts are inverted or lie within others the same way round."""
        lower, upper = self.bounds()
        box = float(np.prod(upper - lower))
        share = self.exact_volume() / box
        points = np.random.default_rng(seed=0).uniform(lower, upper, (SAMPLES, 3))
        found = np.count_nonzero(self.contains(points)) / SAMPLES
        error = STANDARD_ERRORS * np.sqrt(max(share * (1.0 - share), 1.0 / SAMPLES) / SAMPLES)
        if abs(found - share) > error:
            raise mistake(
                self.name,
                "a surface that encloses its volume once",
                f"one around {self.exact_volume():.3g} m3 that has {found * box:.3g} m3 inside",
                "parts of it are inverted or lie within each other: make them one surface",
            )


def _arrays(where: str, vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (n, 3) float64 and faces (m, 3) int32, checked one by one."""
    try:
        vertices, faces = np.array(vertices, dtype=float), np.array(faces)
    except (TypeError, ValueError):
        raise mistake(where, "numbers for vertices and faces", "something else") from None
    if vertices.size == 0 or faces.size == 0:
        raise mistake(
            where, "a surface of triangles", "none", "is there a surface in it, and not only points or lines?"
        )
    if vertices.ndim != 2 or vertices.shape[1] != 3 or not np.all(np.abs(vertices) < LARGEST):
        expected = f"three finite coordinates for each vertex, below {LARGEST:g} m"
        raise mistake(where, expected, f"others among {len(vertices)} vertices")
    if faces.ndim != 2 or faces.shape[1] != 3 or faces.dtype.kind not in "iu":
        raise mistake(where, "three indices of vertices for each face", f"shape {faces.shape} of {faces.dtype}")
    if faces.min() < 0 or faces.max() >= len(vertices):
        got = f"{faces.min()} to {faces.max()}"
        raise mistake(where, f"faces between vertices 0 to {len(vertices) - 1}", got, "the file may be truncated")
    return vertices, faces.astype(np.int32)
