"""The time samples of one frame in the USD file."""

from typing import Any

import numpy as np
from pxr import Sdf, UsdGeom, Vt

from warp_mpm.output import colormap
from warp_mpm.output.frame import Frame, Surface
from warp_mpm.output.usd_layout import (
    ISOSURFACE,
    PARTICLES,
    SECTION,
    WORLD,
    Contents,
    animated_attributes,
    particle_widths,
)
from warp_mpm.places import section_nodes
from warp_mpm.scene import Domain


class FrameSampler:
    """Turns frames of a run into values of the animated attributes."""

    def __init__(self, contents: Contents) -> None:
        self.types = animated_attributes(contents)  # value type of each attribute, by path
        self._contents = contents
        self._widths = particle_widths(contents)
        self._section_shape = section_nodes(contents.scene).shape[:2]

    def samples(self, frame: Frame) -> dict[str, Any]:
        """The value of every animated attribute in a frame, by path.

        Raises:
            ValueError: an array does not have one entry per particle, or per node of the section.
        """
        section = _checked("section", frame.section, self._section_shape).ravel()
        values = {
            f"{WORLD}.blast:time": float(frame.time),
            f"{SECTION}.primvars:pressure": Vt.FloatArray.FromNumpy(section),
            f"{SECTION}.primvars:displayColor:indices": self._color_indices(section),
            **self._particles(frame),
        }
        if frame.isosurface is not None:
            values.update(_surface(frame.isosurface, self._contents.scene.domain))
        return {path: values[path] for path in self.types}

    def _particles(self, frame: Frame) -> dict[str, Any]:
        """Those of the particles; one that left has no pressure and no width."""
        position = self._shown("position", frame.position, 3)
        inside = self._shown("inside", frame.inside, kind=np.bool_)
        pressure = np.where(inside, self._shown("pressure", frame.pressure), np.float32(0.0))
        widths = np.where(inside, self._widths, np.float32(0.0))
        values = {
            f"{PARTICLES}.points": Vt.Vec3fArray.FromNumpy(position),
            f"{PARTICLES}.extent": _extent(position, widths),
            f"{PARTICLES}.widths": Vt.FloatArray.FromNumpy(widths),
            f"{PARTICLES}.primvars:pressure": Vt.FloatArray.FromNumpy(pressure),
            f"{PARTICLES}.primvars:displayColor:indices": self._color_indices(pressure),
        }
        for name in self._contents.fields:
            path = f"{PARTICLES}.primvars:{name}"
            if self.types[path] == Sdf.ValueTypeNames.Float3Array:
                values[path] = Vt.Vec3fArray.FromNumpy(self._shown(name, frame.fields[name], 3))
            else:
                values[path] = Vt.FloatArray.FromNumpy(self._shown(name, frame.fields[name]))
        return values

    def _shown(self, name: str, values: np.ndarray, *components: int, kind: type = np.float32) -> np.ndarray:
        """The values of the particles that the file shows, out of those of all."""
        all_of_them = _checked(name, values, (self._contents.scene.particle_count, *components), kind)
        return np.ascontiguousarray(all_of_them[:: self._contents.particles_every])

    def _color_indices(self, pressure: np.ndarray) -> Any:
        return Vt.IntArray.FromNumpy(colormap.indices(pressure, *self._contents.pressure_range))


def _surface(surface: Surface, domain: Domain) -> dict[str, Any]:
    """Those of the isosurface. An empty one is a triangle out of sight: validators refuse a mesh without faces."""
    visible = len(surface.triangles) > 0
    if not visible:
        corners = np.array(domain.lower) + np.array(domain.spacing) * [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
        surface = Surface(corners, np.array([[0, 1, 2]]))
    points = Vt.Vec3fArray.FromNumpy(surface.points.astype(np.float32))
    return {
        f"{ISOSURFACE}.points": points,
        f"{ISOSURFACE}.extent": UsdGeom.PointBased.ComputeExtent(points),
        f"{ISOSURFACE}.faceVertexCounts": Vt.IntArray(len(surface.triangles), 3),
        f"{ISOSURFACE}.faceVertexIndices": Vt.IntArray.FromNumpy(surface.triangles.ravel().astype(np.int32)),
        f"{ISOSURFACE}.visibility": UsdGeom.Tokens.inherited if visible else UsdGeom.Tokens.invisible,
    }


def _checked(name: str, values: np.ndarray, shape: tuple[int, ...], kind: type = np.float32) -> np.ndarray:
    if values.shape != shape:
        raise ValueError(f"frame: {name}: expected shape {shape}, got {values.shape}")
    return np.ascontiguousarray(values, dtype=kind)


def _extent(position: np.ndarray, widths: np.ndarray) -> Any:
    """Lower and upper corner of the box around all particles, widths included."""
    half = 0.5 * widths[:, None]
    return Vt.Vec3fArray.FromNumpy(np.stack([(position - half).min(axis=0), (position + half).max(axis=0)]))
