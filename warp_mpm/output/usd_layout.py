"""What the USD file is made of: its prims, its metadata, and everything in it that does not change in time.

    /World                  Xform, kind component; time-sampled blast:time [s]
    /World/particles        Points: points, extent, widths, ids, primvars pressure, displayColor, charge, further fields
    /World/section          Mesh: the field pressure on the scene's section plane
    /World/isosurface       Mesh, if asked for: where the field pressure has a given value; time-sampled topology
    /World/detonators       one prim each, with position and ignition time: spheres for points, curves for all else
    /World/isochrones       BasisCurves on the section plane: where the detonation arrives at the same time
    /World/camera           frames the charge
    /World/materials        a material that glows in displayColor and reflects nothing

Pressures are in Pa, lengths in m. Primvars are float[], int[], float3[] or color3f[] only: one primvar of another type
makes Blender drop the rest.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import Gf, Kind, Sdf, Usd, UsdGeom, UsdShade, Vt

from warp_mpm.output import colormap
from warp_mpm.output.usd_marks import author_detonators, author_isochrones, charge_box
from warp_mpm.places import section_nodes
from warp_mpm.scene import Scene, Wall

WORLD = "/World"
PARTICLES = "/World/particles"
SECTION = "/World/section"
ISOSURFACE = "/World/isosurface"
DETONATORS = "/World/detonators"
ISOCHRONES = "/World/isochrones"
CAMERA = "/World/camera"
MATERIALS = "/World/materials"

TIME_CODES_PER_SECOND = 24.0

FIELD_UNITS = {"density": "kg/m3", "burn_fraction": "1", "arrival_time": "s", "particleVelocity": "m/s"}

_FLOATS = Sdf.ValueTypeNames.FloatArray
_INTEGERS = Sdf.ValueTypeNames.IntArray
_VECTORS = Sdf.ValueTypeNames.Float3Array
_POINTS = Sdf.ValueTypeNames.Point3fArray


@dataclass(frozen=True)
class Contents:
    """What of a run a USD file shows."""

    scene: Scene
    pressure_range: tuple[float, float]  # in the first and the last colour [Pa]
    fields: tuple[str, ...] = ()  # further particle fields, keys of `FIELD_UNITS`
    particles_every: int = 1  # one particle in so many, in creation order
    isosurface: float | None = None  # pressure [Pa]
    arrival: np.ndarray | None = None  # times at the nodes of the section (nodes_u, nodes_v) [s]; NaN if never


def animated_attributes(contents: Contents) -> dict[str, Any]:
    """Path and value type of every attribute that has a time sample per frame.

    The widths are among them only where a face is open, because only there a particle can leave.
    """
    attributes = {
        f"{WORLD}.blast:time": Sdf.ValueTypeNames.Double,
        f"{PARTICLES}.points": _POINTS,
        f"{PARTICLES}.extent": _VECTORS,
        f"{PARTICLES}.primvars:pressure": _FLOATS,
        f"{PARTICLES}.primvars:displayColor:indices": _INTEGERS,
        f"{SECTION}.primvars:pressure": _FLOATS,
        f"{SECTION}.primvars:displayColor:indices": _INTEGERS,
    }
    if Wall.OPEN in contents.scene.walls.faces():
        attributes[f"{PARTICLES}.widths"] = _FLOATS
    for name in contents.fields:
        attributes[f"{PARTICLES}.primvars:{name}"] = _field_type(name)
    if contents.isosurface is not None:
        attributes[f"{ISOSURFACE}.points"] = _POINTS
        attributes[f"{ISOSURFACE}.extent"] = _VECTORS
        attributes[f"{ISOSURFACE}.faceVertexCounts"] = _INTEGERS
        attributes[f"{ISOSURFACE}.faceVertexIndices"] = _INTEGERS
        attributes[f"{ISOSURFACE}.visibility"] = Sdf.ValueTypeNames.Token
    return attributes


def author_stage_metadata(layer: Any, contents: Contents, microseconds_per_time_code: float, frames: int) -> None:
    """Say in the layer's header what the stage is: units, time codes of `frames` frames, what the colours mean."""
    layer.defaultPrim = Sdf.Path(WORLD).name
    scene = contents.scene
    layer.documentation = " ".join((scene.description or scene.name).split())
    layer.timeCodesPerSecond = layer.framesPerSecond = TIME_CODES_PER_SECOND
    layer.startTimeCode = 0.0
    layer.endTimeCode = float(max(frames - 1, 0))
    layer.pseudoRoot.SetInfo(UsdGeom.Tokens.upAxis, UsdGeom.Tokens.z)
    layer.pseudoRoot.SetInfo(UsdGeom.Tokens.metersPerUnit, 1.0)
    layer.customLayerData = {
        "scene": scene.name,
        "microsecondsPerTimeCode": microseconds_per_time_code,
        "pressureUnit": "Pa",
        "colorMap": colormap.NAME,
        "colorRange": Gf.Vec2d(*contents.pressure_range),
        "particlesEvery": contents.particles_every,
        "charges": Vt.StringArray([charge.name for charge in scene.charges]),
    }


def author_static(layer: Any, contents: Contents) -> None:
    """Author every prim, every value that does not change, and declare every attribute that does."""
    scene = contents.scene
    stage = Usd.Stage.Open(layer)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    world = UsdGeom.Xform.Define(stage, WORLD).GetPrim()
    Usd.ModelAPI(world).SetKind(Kind.Tokens.component)
    world.CreateAttribute("blast:time", Sdf.ValueTypeNames.Double).SetDocumentation("physical time [s]")
    stage.SetDefaultPrim(world)
    material = _author_material(stage)
    _author_particles(stage, contents, material)
    _author_section(stage, scene, material)
    if contents.isosurface is not None:
        _author_isosurface(stage, contents.isosurface, contents.pressure_range)
    author_detonators(stage, DETONATORS, scene, material)
    if contents.arrival is not None and np.isfinite(contents.arrival).any():
        author_isochrones(stage, ISOCHRONES, scene, contents.arrival, material)
    _author_camera(stage, scene)


def particle_widths(contents: Contents) -> np.ndarray:
    """Diameter at which each particle is drawn [m], (particles shown,) float32.

    It is the edge of a cube of the particle's initial volume, and of that of the particles left out for it.
    """
    volumes = [np.full(len(charge.positions), charge.particle_volume) for charge in contents.scene.charges]
    shown = np.concatenate(volumes)[:: contents.particles_every]
    return np.cbrt(contents.particles_every * shown).astype(np.float32)


def _charge_numbers(contents: Contents) -> np.ndarray:
    """Which charge each particle is of, (particles shown,) int32."""
    counts = [len(charge.positions) for charge in contents.scene.charges]
    numbers = np.repeat(np.arange(len(counts), dtype=np.int32), counts)
    return np.ascontiguousarray(numbers[:: contents.particles_every])


def _author_particles(stage: Any, contents: Contents, material: Any) -> None:
    points = UsdGeom.Points.Define(stage, PARTICLES)
    points.CreatePointsAttr()
    points.CreateExtentAttr()
    points.CreateWidthsAttr(Vt.FloatArray.FromNumpy(particle_widths(contents)))
    points.SetWidthsInterpolation(UsdGeom.Tokens.vertex)
    ids = np.arange(0, contents.scene.particle_count, contents.particles_every, dtype=np.int64)
    points.CreateIdsAttr(Vt.Int64Array.FromNumpy(ids))
    _declare_pressure(points)
    charge = UsdGeom.PrimvarsAPI(points).CreatePrimvar("charge", _INTEGERS, UsdGeom.Tokens.vertex)
    charge.Set(Vt.IntArray.FromNumpy(_charge_numbers(contents)))
    charge.GetAttr().SetDocumentation("number of the particle's charge, as the metadata's charges count, from 0")
    for name in contents.fields:
        primvar = UsdGeom.PrimvarsAPI(points).CreatePrimvar(name, _field_type(name), UsdGeom.Tokens.vertex)
        primvar.GetAttr().SetDocumentation(f"{name} [{FIELD_UNITS[name]}]")
    UsdShade.MaterialBindingAPI.Apply(points.GetPrim()).Bind(material)


def _author_section(stage: Any, scene: Scene, material: Any) -> None:
    """The nodes in the section plane and the quadrilaterals between them; node (i, j) is point i nodes_v + j."""
    plane = section_nodes(scene)
    rows, columns = plane.shape[:2]
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    quads = np.stack([corner, corner + columns, corner + columns + 1, corner + 1], axis=1)

    mesh = UsdGeom.Mesh.Define(stage, SECTION)
    points = Vt.Vec3fArray.FromNumpy(plane.reshape(-1, 3).astype(np.float32))
    mesh.CreatePointsAttr(points)
    mesh.CreateExtentAttr(UsdGeom.PointBased.ComputeExtent(points))
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(quads), 4, dtype=np.int32)))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(quads.ravel().astype(np.int32)))
    normal = np.cross(*np.eye(3, dtype=np.float32)[list(scene.section.in_plane)])
    mesh.CreateNormalsAttr(Vt.Vec3fArray.FromNumpy(np.tile(normal, (len(points), 1))))
    mesh.SetNormalsInterpolation(UsdGeom.Tokens.vertex)
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    mesh.CreateDoubleSidedAttr(True)
    _declare_pressure(mesh)
    UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(material)


def _author_isosurface(stage: Any, pressure: float, pressure_range: tuple[float, float]) -> None:
    """A surface in the one colour of its pressure; no glowing material, because light shows its shape.

    It has no normals, which would have to be sampled too: a subdivision surface is smooth without them.
    """
    mesh = UsdGeom.Mesh.Define(stage, ISOSURFACE)
    mesh.CreatePointsAttr()
    mesh.CreateExtentAttr()
    mesh.CreateFaceVertexCountsAttr()
    mesh.CreateFaceVertexIndicesAttr()
    mesh.CreateVisibilityAttr()
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.loop)
    mesh.CreateDoubleSidedAttr(True)
    color = colormap.linear_table()[colormap.indices(np.float32([pressure]), *pressure_range)]
    mesh.CreateDisplayColorAttr(Vt.Vec3fArray.FromNumpy(color))
    attribute = mesh.GetPrim().CreateAttribute("blast:pressure", Sdf.ValueTypeNames.Double)
    attribute.Set(pressure)
    attribute.SetDocumentation("field pressure on the surface [Pa]")


def _declare_pressure(shape: Any) -> None:
    """Give a shape its pressure, and the colours of the map for time-sampled indices to choose from."""
    primvars = UsdGeom.PrimvarsAPI(shape)
    pressure = primvars.CreatePrimvar("pressure", _FLOATS, UsdGeom.Tokens.vertex)
    pressure.GetAttr().SetDocumentation("pressure [Pa]")
    color = primvars.CreatePrimvar("displayColor", Sdf.ValueTypeNames.Color3fArray, UsdGeom.Tokens.vertex)
    color.Set(Vt.Vec3fArray.FromNumpy(colormap.linear_table()))
    color.CreateIndicesAttr()


def _author_material(stage: Any) -> Any:
    """A surface that only glows, in the colours of displayColor: light and shadow would falsify them."""
    UsdGeom.Scope.Define(stage, MATERIALS)
    material = UsdShade.Material.Define(stage, f"{MATERIALS}/pressure")
    reader = UsdShade.Shader.Define(stage, f"{MATERIALS}/pressure/color")
    reader.CreateIdAttr("UsdPrimvarReader_float3")
    reader.CreateInput("varname", Sdf.ValueTypeNames.String).Set("displayColor")
    color = reader.CreateOutput("result", Sdf.ValueTypeNames.Float3)
    surface = UsdShade.Shader.Define(stage, f"{MATERIALS}/pressure/surface")
    surface.CreateIdAttr("UsdPreviewSurface")
    surface.CreateInput("emissiveColor", Sdf.ValueTypeNames.Color3f).ConnectToSource(color)
    surface.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).Set(Gf.Vec3f(0.0))
    surface.CreateInput("ior", Sdf.ValueTypeNames.Float).Set(1.0)  # as the air: no light is reflected
    material.CreateSurfaceOutput().ConnectToSource(surface.CreateOutput("surface", Sdf.ValueTypeNames.Token))
    return material


def _author_camera(stage: Any, scene: Scene) -> None:
    """A camera that sees the whole charge, along the section plane's normal but a little round the corner."""
    lower, upper = charge_box(scene)
    centre = 0.5 * (lower + upper)
    axes = _camera_axes(scene, turn=math.radians(25.0), lift=math.radians(12.0))
    signs = np.array(np.meshgrid((-1, 1), (-1, 1), (-1, 1))).reshape(3, -1).T
    corners = (0.5 * signs * (upper - lower)) @ axes.T  # (8, 3): right, up, towards the camera
    half_view = 18.0 / 50.0  # half the aperture over the focal length
    distance = 1.15 * float(np.max(corners[:, 2] + np.abs(corners[:, :2]).max(axis=1) / half_view))

    camera = UsdGeom.Camera.Define(stage, CAMERA)
    # Camera lengths are in tenths of a scene unit, here of a metre: a 50 mm lens and a square film of 36 mm.
    camera.CreateFocalLengthAttr(0.5)
    camera.CreateHorizontalApertureAttr(0.36)
    camera.CreateVerticalApertureAttr(0.36)
    camera.CreateFocusDistanceAttr(distance)
    camera.CreateClippingRangeAttr(Gf.Vec2f(0.01 * distance, 100.0 * distance))
    pose = np.eye(4)
    pose[:3, :3] = axes  # USD multiplies row vectors from the left: the rows are where the camera's axes go
    pose[3, :3] = centre + distance * axes[2]
    camera.AddTransformOp().Set(Gf.Matrix4d(pose))


def _camera_axes(scene: Scene, turn: float, lift: float) -> np.ndarray:
    """Right, up and backward (3, 3) of a camera that looks along the section's normal, turned and lifted [rad]."""
    right, up = np.eye(3)[list(scene.section.in_plane)]
    normal = np.cross(right, up)
    backward = math.cos(lift) * (math.cos(turn) * normal + math.sin(turn) * right) + math.sin(lift) * up
    sideways = np.cross(up, backward)
    sideways /= np.linalg.norm(sideways)
    return np.stack([sideways, np.cross(backward, sideways), backward])


def _field_type(name: str) -> Any:
    return _VECTORS if name == "particleVelocity" else _FLOATS
