"""How true a picture's colours are to the colour map, and to the particles it shows."""

import math
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image
from pxr import UsdGeom

from warp_mpm.output import colormap

# Colours that follow each other in the map are at most 5 of 255 apart in a channel. A pixel that mixes two of them is
# at most half of that from the nearer one, and rounding to eight bits adds a half at both ends.
DISTANCE = 4  # of 255, in the channel that is farthest off


def pixels(path: Path) -> np.ndarray:
    """A picture as (height, width, 4) int16: red, green, blue as a screen takes them, and coverage, each 0 to 255."""
    return np.asarray(Image.open(path).convert("RGBA"), dtype=np.int16)


def share_in_map(picture: np.ndarray) -> float:
    """Share of the pixels that are drawn over their whole area whose colour is within `DISTANCE` of one of the map's.

    Pixels that are drawn in part lie on an outline, and mix in whatever is behind.
    """
    drawn, counts = np.unique(picture[picture[..., 3] == 255][:, :3], axis=0, return_counts=True)
    table = np.round(255.0 * colormap.srgb_table())
    nearest = np.array([np.abs(table - color).max(axis=1).min() for color in drawn])
    return float(counts[nearest <= DISTANCE].sum() / counts.sum())


def share_of_true_particles(picture: np.ndarray, stage: Any, frame: int) -> float:
    """Share of the particles on the side of the camera that have their own colour in the picture, within `DISTANCE`.

    These are the particles in view of the layer, half a particle thick, that is outermost along the axis on which the
    camera looks most; particles that have left the domain are not drawn.
    """
    points = UsdGeom.Points(stage.GetPrimAtPath("/World/particles"))
    widths = np.array(points.GetWidthsAttr().Get(frame))
    inside = widths > 0.0
    position = np.array(points.GetPointsAttr().Get(frame), dtype=np.float64)[inside]
    color = np.array(UsdGeom.PrimvarsAPI(points).GetPrimvar("displayColor").ComputeFlattened(frame))[inside]
    camera = UsdGeom.Camera(stage.GetPrimAtPath("/World/camera")).GetCamera(frame).frustum
    towards_camera = -np.array(camera.ComputeViewDirection())
    axis = int(np.argmax(np.abs(towards_camera)))
    height = position[:, axis] * np.sign(towards_camera[axis])
    front = height > height.max() - 0.5 * widths.max()
    matrix = np.array(camera.ComputeViewMatrix() * camera.ComputeProjectionMatrix())
    clip = np.column_stack([position[front], np.ones(front.sum())]) @ matrix
    place = 0.5 + np.array([0.5, -0.5]) * clip[:, :2] / clip[:, 3:]  # from the left and from the top, 0 to 1
    in_view = np.all((place >= 0.0) & (place < 1.0), axis=1)
    if not in_view.any():
        return math.nan
    column, row = (place[in_view] * len(picture)).astype(int).T
    expected = np.round(255.0 * srgb(color[front][in_view]))
    return float(np.mean(np.abs(picture[row, column, :3] - expected).max(axis=1) <= DISTANCE))


def srgb(linear: np.ndarray) -> np.ndarray:
    """Linear RGB as a screen takes it (IEC 61966-2-1), same shape, between 0 and 1."""
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1.0 / 2.4) - 0.055)
