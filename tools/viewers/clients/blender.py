"""Imports a USD file into Blender, writes down what it has at some frames, and draws the last of them with Cycles.

    python blender.py FILE --frames 0 3 --values values.npz --size 400 --picture blender.png

The file of values has `<frame>/<object>/<attribute>` for each object with pressures.
"""

import argparse
import json

import bpy
import numpy as np

ATTRIBUTES = {"position": ("vector", 3), "pressure": ("value", 1), "displayColor": ("color", 4), "radius": ("value", 1)}
SAMPLES = 16  # rays a pixel: the outlines are smooth, and nothing else needs more, as all that is seen glows


def main() -> None:
    """Do what the command line says, and print a JSON object."""
    parser = argparse.ArgumentParser()
    parser.add_argument("file")
    parser.add_argument("--frames", type=int, nargs="+", required=True)
    parser.add_argument("--values", required=True)
    parser.add_argument("--size", type=int, default=400, help="width of the picture [pixels]")
    parser.add_argument("--picture", required=True)
    options = parser.parse_args()
    open_file(options.file)
    values = {}
    for frame in options.frames:
        bpy.context.scene.frame_set(frame)
        for name, attributes in shown_values().items():
            values.update({f"{frame}/{name}/{attribute}": array for attribute, array in attributes.items()})
    np.savez(options.values, **values)
    draw(options.picture, options.size)
    scene = bpy.context.scene
    report = {
        "client": "Blender",
        "version": bpy.app.version_string,
        "frames": [scene.frame_start, scene.frame_end],
        "frames_per_second": scene.render.fps,
        "objects": {item.name: item.type for item in bpy.data.objects},
    }
    print(json.dumps(report))


def open_file(path: str) -> None:
    """Start from nothing and import a USD file as the menu does, with what the import leaves to the user.

    Point clouds and spheres come without their material (other meshes have it), no camera is chosen, and colours go
    through a view transform made for photographs.
    """
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.usd_import(filepath=path)
    for item in bpy.data.objects:
        if item.type == "POINTCLOUD" or (item.type == "MESH" and item.parent.name == "detonators"):
            item.data.materials.append(bpy.data.materials["pressure"])
    scene = bpy.context.scene
    scene.camera = bpy.data.objects["camera"]
    scene.view_settings.view_transform = "Standard"


def shown_values() -> dict[str, dict[str, np.ndarray]]:
    """Attributes at the current frame, by object, of all objects that have pressures."""
    graph = bpy.context.evaluated_depsgraph_get()
    found = {}
    for item in bpy.data.objects:
        attributes = getattr(item.evaluated_get(graph).data, "attributes", {})
        if "pressure" in attributes:
            found[item.name] = {
                name: _array(attributes[name], *ATTRIBUTES[name]) for name in ATTRIBUTES if name in attributes
            }
    return found


def draw(path: str, size: int) -> None:
    """Draw the current frame on the CPU, on nothing."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = SAMPLES
    scene.cycles.use_denoising = False
    scene.render.film_transparent = True
    scene.render.resolution_x = scene.render.resolution_y = size
    scene.render.filepath = path
    bpy.ops.render.render(write_still=True)


def _array(attribute: bpy.types.Attribute, key: str, width: int) -> np.ndarray:
    """The values of an attribute, (n,) or (n, width) float32."""
    values = np.empty(len(attribute.data) * width, dtype=np.float32)
    attribute.data.foreach_get(key, values)
    return values.reshape(-1, width) if width > 1 else values


if __name__ == "__main__":
    main()
