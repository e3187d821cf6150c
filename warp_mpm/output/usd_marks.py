"""What the USD file has beside the matter: detonators, and lines of equal arrival times."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from pxr import Gf, Sdf, UsdGeom, UsdShade, Vt

from warp_mpm.detonators import Detonator, PlaneDetonator, PointDetonator
from warp_mpm.output.isochrones import contour, round_times
from warp_mpm.output.outlines import outlines
from warp_mpm.scene import Scene

POINT_SIZE = 0.025  # radius, of the diagonal of the charges' box: large enough to show through the side of a thin plate
LINE_WIDTH = 0.008  # of the diagonal
ISOCHRONE_WIDTH = 0.3  # of a cell
BLUE = Gf.Vec3f(0.0, 0.6, 1.0)  # of detonators: a colour that the colour map does not have
WHITE = Gf.Vec3f(0.8, 0.8, 0.8)  # of isochrones


def author_detonators(stage: Any, path: str, scene: Scene, material: Any) -> None:
    """A prim for each detonator, at its position: a sphere for a point, curves for all else."""
    UsdGeom.Scope.Define(stage, path)
    size = float(np.linalg.norm(np.subtract(*charge_box(scene))))
    bounds = np.array([charge.solid.bounds() for charge in scene.charges])
    box = np.clip([bounds[:, 0].min(axis=0), bounds[:, 1].max(axis=0)], scene.domain.lower, scene.domain.upper)
    for number, detonator in enumerate(scene.detonators):
        prim = _author_detonator(stage, f"{path}/detonator_{number}", detonator, box, size)
        UsdGeom.XformCommonAPI(prim).SetTranslate(Gf.Vec3d(*detonator.position))
        if isinstance(detonator, PlaneDetonator):
            prim.CreateAttribute("blast:normal", Sdf.ValueTypeNames.Vector3f).Set(Gf.Vec3f(*detonator.normal))
        if prim.IsA(UsdGeom.Gprim):
            UsdShade.MaterialBindingAPI.Apply(prim).Bind(material)
        time = prim.CreateAttribute("blast:ignitionTime", Sdf.ValueTypeNames.Double)
        time.Set(detonator.time)
        time.SetDocumentation("ignition [s]")


def author_isochrones(stage: Any, path: str, scene: Scene, arrival: np.ndarray, material: Any) -> None:
    """Curves on the section plane where the arrival time (nodes_u, nodes_v) [s] is a multiple of a round one."""
    lines, times = [], []
    for time in round_times(float(np.nanmax(arrival))) if np.nanmax(arrival) > 0.0 else ():
        for line in contour(arrival, time):
            lines.append(_on_section(scene, line))
            times.append(np.full(len(line), time, dtype=np.float32))
    if not lines:
        return
    curves = _author_curves(stage, path, lines, ISOCHRONE_WIDTH * min(scene.domain.spacing), WHITE)
    floats = Sdf.ValueTypeNames.FloatArray
    primvar = UsdGeom.PrimvarsAPI(curves).CreatePrimvar("arrival_time", floats, UsdGeom.Tokens.vertex)
    primvar.Set(Vt.FloatArray.FromNumpy(np.concatenate(times)))
    primvar.GetAttr().SetDocumentation("arrival time [s]")
    UsdShade.MaterialBindingAPI.Apply(curves).Bind(material)


def charge_box(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper corner of the box around all particles [m], (3,) float64 each."""
    lower = np.min([charge.positions.min(axis=0) for charge in scene.charges], axis=0)
    upper = np.max([charge.positions.max(axis=0) for charge in scene.charges], axis=0)
    return lower, upper


def _author_detonator(stage: Any, path: str, detonator: Detonator, box: np.ndarray, size: float) -> Any:
    if isinstance(detonator, PointDetonator):
        radius = POINT_SIZE * size
        sphere = UsdGeom.Sphere.Define(stage, path)
        sphere.CreateRadiusAttr(radius)
        sphere.CreateExtentAttr([Gf.Vec3f(-radius), Gf.Vec3f(radius)])
        sphere.CreateDisplayColorAttr([BLUE])
        return sphere.GetPrim()
    lines = [line - np.array(detonator.position) for line in outlines(detonator, box, np.eye(3))]
    if not lines:  # a plane beside the particles
        return UsdGeom.Xform.Define(stage, path).GetPrim()
    return _author_curves(stage, path, lines, LINE_WIDTH * size, BLUE)


def _author_curves(stage: Any, path: str, lines: Sequence[np.ndarray], width: float, color: Any) -> Any:
    """Polylines (n, 3) [m] as one prim."""
    curves = UsdGeom.BasisCurves.Define(stage, path)
    curves.CreateTypeAttr(UsdGeom.Tokens.linear)
    points = np.concatenate(lines).astype(np.float32)
    curves.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(points))
    curves.CreateCurveVertexCountsAttr([len(line) for line in lines])
    curves.CreateWidthsAttr([width])
    curves.SetWidthsInterpolation(UsdGeom.Tokens.constant)
    half = np.float32(0.5 * width)
    curves.CreateExtentAttr(Vt.Vec3fArray.FromNumpy(np.stack([points.min(axis=0) - half, points.max(axis=0) + half])))
    curves.CreateDisplayColorAttr([color])
    return curves.GetPrim()


def _on_section(scene: Scene, line: np.ndarray) -> np.ndarray:
    """A polyline (n, 2) of rows and columns of nodes on the section plane, in space (n, 3) [m]."""
    places = np.full((len(line), 3), scene.section.coordinate)
    for place, axis in zip(line.T, scene.section.in_plane, strict=True):
        places[:, axis] = scene.domain.lower[axis] + place * scene.domain.spacing[axis]
    return places
