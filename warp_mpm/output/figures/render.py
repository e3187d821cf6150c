"""Smooth surfaces, drawn by PyVista off screen.

PyVista is an optional dependency, and large. Where there is neither a screen nor a software renderer, drawing with it
can end the whole process, so it is tried in a process of its own first.
"""

import subprocess
import sys
from importlib.util import find_spec
from typing import Any

import numpy as np
from matplotlib.colors import Normalize

from warp_mpm.output import colormap
from warp_mpm.output.figures.style import MILLIMETRE
from warp_mpm.output.figures.view import View

PIXELS = 1400  # along the longer side of an image
PATIENCE = 60.0  # with the trial [s]
QUIET = "from vtkmodules.vtkCommonCore import vtkLogger; vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)"
TRIAL = f"""{QUIET}
import pyvista
plotter = pyvista.Plotter(off_screen=True, window_size=(64, 64))
plotter.add_mesh(pyvista.Cube(), color="red", lighting=False)
assert plotter.screenshot(return_img=True).std() > 0
"""


def is_installed() -> bool:
    """Whether there is a PyVista to try."""
    return find_spec("pyvista") is not None


def fault() -> str | None:
    """Why PyVista cannot draw here, in a few words; None if it can."""
    command = [sys.executable, "-c", TRIAL]
    try:
        trial = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
    except subprocess.TimeoutExpired:
        return f"no picture within {PATIENCE:.0f} s"
    if trial.returncode == 0:
        return None
    if trial.returncode < 0:
        return f"it ended with signal {-trial.returncode}"
    return (trial.stderr.strip().splitlines() or ["no reason given"])[-1]


def render(view: View, window: tuple[float, float, float, float], corners: np.ndarray, **scale: Any) -> np.ndarray:
    """An image of faces whose values are smoothed over the faces' corners.

    Args:
        view: from where.
        window: left, right, bottom and top of the image [mm].
        corners: of the faces (faces, 4, 3) [m].
        scale: `values` (faces,), and `norm`, their range of colours.

    Returns:
        (rows, columns, 4) uint8, transparent where there is nothing.
    """
    import pyvista
    from vtkmodules.vtkCommonCore import vtkLogger

    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)  # it reports every kind of screen it did not find
    left, right, bottom, top = window
    shape = (top - bottom) / (right - left)
    size = (PIXELS, round(PIXELS * shape)) if shape < 1.0 else (round(PIXELS / shape), PIXELS)
    plotter = pyvista.Plotter(off_screen=True, window_size=size)
    norm: Normalize = scale["norm"]
    surface = _surface(corners / MILLIMETRE, scale["values"])
    look = {"cmap": colormap.NAME, "clim": (norm.vmin, norm.vmax), "lighting": False, "show_scalar_bar": False}
    plotter.add_mesh(surface, scalars="value", interpolate_before_map=True, **look)
    centre = view.axes[0] * 0.5 * (left + right) + view.axes[1] * 0.5 * (bottom + top)
    plotter.camera.focal_point = centre
    plotter.camera.position = centre + view.axes[2] * 10.0 * float(np.abs(corners).max() / MILLIMETRE + top - bottom)
    plotter.camera.up = view.axes[1]
    plotter.camera.parallel_projection = True
    plotter.camera.parallel_scale = 0.5 * (top - bottom)
    plotter.renderer.ResetCameraClippingRange()
    plotter.enable_anti_aliasing("ssaa")
    image = plotter.screenshot(transparent_background=True, return_img=True)
    plotter.close()
    return image


def _surface(corners: np.ndarray, values: np.ndarray) -> Any:
    """The faces as one mesh: a value at each corner, the mean over the faces that meet there."""
    import pyvista

    flat = corners.reshape(-1, 3)
    grain = 1e-6 * float(np.ptp(flat, axis=0).max())  # corners that are nearer to each other than this are one
    _, first, corner = np.unique(
        np.round(flat / grain).astype(np.int64), axis=0, return_index=True, return_inverse=True
    )
    corner = corner.ravel()
    count = np.bincount(corner)
    value = np.bincount(corner, weights=np.repeat(values, 4)) / count
    faces = np.column_stack([np.full(len(corners), 4), corner.reshape(-1, 4)])
    mesh = pyvista.PolyData(flat[first], faces.ravel())
    mesh.point_data["value"] = value
    return mesh
