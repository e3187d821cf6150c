"""Writes one frame of a run as binary glTF 2.0, which web pages show: points and surfaces with colours at vertices.

Specification: Khronos, glTF 2.0 (https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html). Lengths are in metres, as
there; the y axis is up there, so the node above all others turns our z axis to it. Colours are linear RGB, as there,
and floats: in 8 bits the dark half of the colour map would fall together, and not every reader knows 16. What glows in
the USD file is unlit here (KHR_materials_unlit), so that its colours stay those of the map.
"""

import json
import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from pxr import UsdGeom, UsdShade

from warp_mpm.checks import mistake
from warp_mpm.output.usd_reading import checked_frame, open_run, segments_of
from warp_mpm.output.whole_file import whole_file
from warp_mpm.version import VERSION

MAGIC, CONTAINER_VERSION = b"glTF", 2
JSON_CHUNK, BINARY_CHUNK = b"JSON", b"BIN\0"
ALIGNMENT = 4  # of chunks and of arrays [bytes]
ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963
COMPONENT_TYPES = {np.dtype(np.float32): 5126, np.dtype(np.uint32): 5125}
POINTS, LINES, TRIANGLES = 0, 1, 4  # modes of a primitive
Z_TO_Y = (-(0.5**0.5), 0.0, 0.0, 0.5**0.5)  # a quarter turn about x, as a quaternion (x, y, z, w)

# What glows shows its colours as they are, anything else in the light of the page.
SURFACE = {"doubleSided": True, "pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 1.0}}
MATERIALS: dict[str, dict[str, Any]] = {
    "glowing": {"name": "glowing", **SURFACE, "extensions": {"KHR_materials_unlit": {}}},
    "lit": {"name": "lit", **SURFACE},
}


def write_glb(source: str | Path, target: str | Path, frame: int | None) -> Path:
    """Write a frame of a run: particles as points, the section and further surfaces as triangles, curves as lines.

    Particles that have left through an open face are left out.

    Args:
        source: run directory or USD file.
        target: the .glb file to be.
        frame: which frame, counted from 0; it has to be named.

    Returns:
        The target.

    Raises:
        InputError: the source is not the result of a run, or has no such frame, or none is named.
        SimulationError: the disk is full or refuses.
    """
    file, stage, times = open_run("export", Path(source))
    if frame is None:
        raise mistake("export: --frame", f"one of 0 to {len(times) - 1}, because a .glb shows one instant", "none")
    checked_frame("export", frame, times)
    document = _Document()
    for prim in stage.Traverse():
        shape = UsdGeom.PointBased(prim)
        if shape and shape.ComputeVisibility(frame) != UsdGeom.Tokens.invisible:
            _add_shape(document, shape, frame)
    notes = {"time_s": times[frame], "frame": frame, **_color_notes(stage)}
    path = Path(target)
    with whole_file(path) as part:
        part.write_bytes(document.container(file.stem, notes))
    return path


@dataclass
class _Document:
    """A glTF document in the making: descriptions, and the arrays they describe."""

    nodes: list[dict[str, Any]] = field(default_factory=list)
    meshes: list[dict[str, Any]] = field(default_factory=list)
    materials: list[str] = field(default_factory=list)  # keys of `MATERIALS`
    accessors: list[dict[str, Any]] = field(default_factory=list)
    views: list[dict[str, Any]] = field(default_factory=list)
    binary: bytearray = field(default_factory=bytearray)

    def add_mesh(
        self, name: str, material: str, mode: int, attributes: dict[str, int], indices: dict[str, int]
    ) -> None:
        """A mesh of one primitive, made of accessors, and the node that shows it."""
        if material not in self.materials:
            self.materials.append(material)
        primitive = {"material": self.materials.index(material), "mode": mode, "attributes": attributes, **indices}
        self.nodes.append({"name": name, "mesh": len(self.meshes)})
        self.meshes.append({"name": name, "primitives": [primitive]})

    def add_array(self, values: np.ndarray, target: int = ARRAY_BUFFER, **properties: Any) -> int:
        """An array (n,) or (n, width), and the accessor that describes it; returns the accessor's number."""
        self.binary += bytes(-len(self.binary) % ALIGNMENT)
        data = np.ascontiguousarray(values).tobytes()
        view = {"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data), "target": target}
        self.binary += data
        self.views.append(view)
        kind = "SCALAR" if values.ndim == 1 else f"VEC{values.shape[1]}"
        accessor = {"bufferView": len(self.views) - 1, "componentType": COMPONENT_TYPES[values.dtype]}
        self.accessors.append({**accessor, "count": len(values), "type": kind, **properties})
        return len(self.accessors) - 1

    def container(self, name: str, notes: dict[str, Any]) -> bytes:
        """The whole file: header, JSON chunk, binary chunk; `notes` are kept with the scene."""
        world = {"name": name, "rotation": Z_TO_Y, "children": list(range(len(self.nodes)))}
        materials = [MATERIALS[material] for material in self.materials]
        extensions = sorted({name for material in materials for name in material.get("extensions", ())})
        document = {
            "asset": {"version": "2.0", "generator": f"warp_mpm {VERSION}"},
            **({"extensionsUsed": extensions} if extensions else {}),  # an empty list is not allowed
            "scene": 0,
            "scenes": [{"name": name, "nodes": [len(self.nodes)], "extras": notes}],
            "nodes": [*self.nodes, world],
            "meshes": self.meshes,
            "materials": materials,
            "accessors": self.accessors,
            "bufferViews": self.views,
            "buffers": [{"byteLength": len(self.binary)}],
        }
        text = json.dumps(document, separators=(",", ":")).encode()
        chunks = _chunk(JSON_CHUNK, text, b" ") + _chunk(BINARY_CHUNK, bytes(self.binary), b"\0")
        return struct.pack("<4sII", MAGIC, CONTAINER_VERSION, 12 + len(chunks)) + chunks


def _chunk(kind: bytes, data: bytes, filler: bytes) -> bytes:
    padded = data + filler * (-len(data) % ALIGNMENT)
    return struct.pack("<I4s", len(padded), kind) + padded


def _add_shape(document: _Document, shape: Any, frame: int) -> None:
    """Add particles, curves or a mesh as they are in a frame, unless there is nothing left of them."""
    prim = shape.GetPrim()
    position = _array(shape.GetPointsAttr(), frame, np.float32).reshape(-1, 3)
    color = np.empty((len(position), 3), dtype=np.float32)
    color[:] = np.array(UsdGeom.PrimvarsAPI(prim).GetPrimvar("displayColor").ComputeFlattened(frame))
    mode, corners = POINTS, np.empty(0, dtype=np.uint32)
    if prim.IsA(UsdGeom.Points):
        inside = _array(UsdGeom.Points(prim).GetWidthsAttr(), frame, np.float32) > 0.0
        position, color = position[inside], color[inside]
    elif prim.IsA(UsdGeom.BasisCurves):
        position, segments = segments_of(UsdGeom.BasisCurves(prim), frame)
        mode, corners = LINES, segments.astype(np.uint32).ravel()
    else:
        mode, corners = TRIANGLES, _triangles(UsdGeom.Mesh(prim), frame)
    if len(position) == 0 or (mode != POINTS and len(corners) == 0):
        return
    limits = {"min": position.min(axis=0).tolist(), "max": position.max(axis=0).tolist()}
    attributes = {"POSITION": document.add_array(position, **limits), "COLOR_0": document.add_array(color)}
    indices = {} if mode == POINTS else {"indices": document.add_array(corners, ELEMENT_ARRAY_BUFFER)}
    bound, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
    document.add_mesh(prim.GetName(), "glowing" if bound else "lit", mode, attributes, indices)


def _triangles(mesh: Any, frame: int) -> np.ndarray:
    """Corners of the triangles that a mesh's convex faces fall into, three a triangle, (3 n,) uint32."""
    counts = _array(mesh.GetFaceVertexCountsAttr(), frame, np.int64)
    corners = _array(mesh.GetFaceVertexIndicesAttr(), frame, np.uint32)
    begins = np.cumsum(counts) - counts
    face = np.repeat(np.arange(len(counts)), counts - 2)  # a fan around each face's first corner
    step = np.arange(len(face)) - np.repeat(np.cumsum(counts - 2) - (counts - 2), counts - 2)
    first = begins[face]
    return corners[np.stack([first, first + step + 1, first + step + 2], axis=1)].ravel()


def _color_notes(stage: Any) -> dict[str, Any]:
    """What the colours mean."""
    custom = stage.GetRootLayer().customLayerData
    return {"color_map": custom.get("colorMap"), "color_range_pa": list(custom.get("colorRange", ()))}


def _array(attribute: Any, frame: int, kind: type) -> np.ndarray:
    """An array attribute in a frame; empty if it has no value there."""
    values = attribute.Get(frame)
    return np.asarray(() if values is None else values, dtype=kind)
