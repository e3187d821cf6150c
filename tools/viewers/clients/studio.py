"""Draws a frame of a USD file as a picture to show: glowing particles on a dark floor that mirrors them, by Blender.

    python studio.py FILE --frame 33 --size 1600 800 --picture render.png

What glows is exactly what the file says, in its own colours: nothing lights it, and the particles reflect nothing.
"""

import argparse
import json

import blender
import bpy
import numpy as np
from mathutils import Matrix

DIRECTION = (0.68, -0.52, 0.52)  # from the charge to the camera, along its middle, longest and shortest edge
LENS = 62.0  # [mm] on a film 36 mm wide
MARGIN = 1.1  # of the picture around the charge
FLOOR_COLOR = (0.008, 0.008, 0.011, 1.0)
FLOOR_ROUGHNESS = 0.2
FLOOR_INDEX = 2.0  # of refraction: a little more of a mirror than glass
SKY_COLOR = (0.010, 0.012, 0.018, 1.0)
SAMPLES = 32  # rays a pixel; the denoiser smooths what is left in the floor


def main() -> None:
    """Draw what the command line says, and print a JSON object."""
    parser = argparse.ArgumentParser()
    parser.add_argument("file")
    parser.add_argument("--frame", type=int, required=True)
    parser.add_argument("--size", type=int, nargs=2, default=(1600, 800), help="width and height [pixels]")
    parser.add_argument("--picture", required=True)
    options = parser.parse_args()
    blender.open_file(options.file)
    bpy.context.scene.frame_set(options.frame)
    for item in bpy.data.objects:
        item.hide_render = item.name != "particles"
    surface = bpy.data.materials["pressure"]
    surface.cycles.emission_sampling = "NONE"  # half a million lamps: too many to aim at one by one
    position = blender.shown_values()["particles"]["position"]
    build_studio(position.min(axis=0), position.max(axis=0), *options.size)
    draw(options.picture, *options.size)
    print(json.dumps({"client": "Blender", "version": bpy.app.version_string}))


def build_studio(lower: np.ndarray, upper: np.ndarray, width: int, height: int) -> None:
    """Put a floor under the box from `lower` to `upper` (3,) [m], a dim sky over it, and a camera before it."""
    scene = bpy.context.scene
    edges = np.eye(3)[np.argsort(upper - lower)[[1, 2, 0]]]  # (3, 3): middle, longest, shortest; the last one is up
    if np.linalg.det(edges) < 0:
        edges[1] *= -1.0
    centre, size = 0.5 * (lower + upper), np.abs(edges @ (upper - lower))
    under = centre - 0.6 * size[2] * edges[2]
    floor = bpy.data.meshes.new("floor")
    corners = 50.0 * np.max(size) * np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)])
    floor.from_pydata(corners.tolist(), [], [(0, 1, 2, 3)])
    floor.materials.append(floor_material())
    place(bpy.data.objects.new("floor", floor), edges, under)
    scene.world = bpy.data.worlds.new("sky")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = SKY_COLOR

    lens = bpy.data.cameras.new("studio")
    lens.lens = LENS
    scene.camera = bpy.data.objects.new("studio", lens)
    backward = np.array(DIRECTION) @ edges / np.linalg.norm(DIRECTION)
    right = np.cross(edges[2], backward)
    right /= np.linalg.norm(right)
    axes = np.stack([right, np.cross(backward, right), backward])
    signs = np.array(np.meshgrid((-1, 1), (-1, 1), (-1, 1))).reshape(3, -1).T
    seen = (0.5 * signs * (upper - lower)) @ axes.T  # (8, 3): right, up, towards the camera
    place(scene.camera, axes, centre + eye(seen, np.array([1.0, height / width])) @ axes)


def eye(corners: np.ndarray, aspect: np.ndarray) -> np.ndarray:
    """Where the camera stands (3,) for the corners (8, 3) to fill the picture, centred; right, up and backward [m].

    Each corner asks that |x - x0| <= k (d - z) with k half the view's width at unit distance, and the like for y. The
    distance d is the least for which an x0 and a y0 exist.
    """
    half = 18.0 / LENS * aspect / MARGIN
    towards = corners[:, 2:]
    spread = np.max(corners[:, :2] + half * towards, axis=0) - np.min(corners[:, :2] - half * towards, axis=0)
    distance = np.max(spread / (2.0 * half))
    low = np.max(corners[:, :2] - half * (distance - towards), axis=0)
    high = np.min(corners[:, :2] + half * (distance - towards), axis=0)
    return np.array([*(0.5 * (low + high)), distance])


def floor_material() -> bpy.types.Material:
    """Dark and glossy."""
    material = bpy.data.materials.new("floor")
    material.use_nodes = True
    inputs = material.node_tree.nodes["Principled BSDF"].inputs
    inputs["Base Color"].default_value = FLOOR_COLOR
    inputs["Roughness"].default_value = FLOOR_ROUGHNESS
    inputs["IOR"].default_value = FLOOR_INDEX
    return material


def place(item: bpy.types.Object, axes: np.ndarray, origin: np.ndarray) -> None:
    """Add an object to the scene, with its axes (3, 3) as rows and its origin (3,) [m] in world coordinates."""
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = axes.T, origin
    item.matrix_world = Matrix(pose.tolist())
    bpy.context.scene.collection.objects.link(item)


def draw(path: str, width: int, height: int) -> None:
    """Draw the current frame on the CPU."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = SAMPLES
    scene.cycles.max_bounces = 2
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.render.filepath = path
    bpy.ops.render.render(write_still=True)


if __name__ == "__main__":
    main()
