"""Films of a run, and surfaces that PyVista draws where it can."""

import numpy as np
import pytest
from matplotlib import rcParams
from matplotlib.colors import Normalize, to_rgb
from PIL import Image
from runs_for_tests import run_of

from warp_mpm.cli import main
from warp_mpm.errors import InputError
from warp_mpm.output import colormap
from warp_mpm.output.figures import draw_figures, render
from warp_mpm.output.figures.content import picture_frames
from warp_mpm.output.figures.field import SpacePanels
from warp_mpm.output.figures.style import MARK
from warp_mpm.run_directory import Run


@pytest.fixture(scope="module")
def plate(tmp_path_factory) -> Run:
    return run_of(tmp_path_factory.mktemp("plate"))


def test_a_film_has_every_frame(plate, tmp_path):
    drawn, _ = draw_figures(plate, tmp_path, ["section"], animate="gif")
    assert drawn == ["section.png", "section.gif"]
    with Image.open(tmp_path / "section.gif") as film:
        assert film.n_frames == len(plate.frames)
        film.seek(plate.frames.nearest(40e-6).index)
        pixels = np.asarray(film.convert("RGB"), dtype=float).reshape(-1, 3) / 255.0
    shown = np.unique(pixels[np.ptp(pixels, axis=1) > 0.1], axis=0)  # no greys
    colors = np.vstack([colormap.srgb_table(), to_rgb(MARK)])
    assert np.abs(shown[:, None] - colors).max(axis=2).min(axis=1).max() < 0.005  # half a step of 1/255 at most
    assert len(shown) > 50


def test_mp4_needs_ffmpeg(plate, tmp_path, monkeypatch):
    monkeypatch.setitem(rcParams, "animation.ffmpeg_path", "no-such-program")
    with pytest.raises(InputError, match="ffmpeg") as caught:
        draw_figures(plate, tmp_path, ["field"], animate="mp4")
    assert "\n" not in str(caught.value)


def test_smooth_surfaces_where_pyvista_can_draw_them(plate, tmp_path):
    """The same silhouette, and colours between the same ones, as matplotlib's faces."""
    pytest.importorskip("pyvista")
    fault = render.fault()
    if fault is not None:
        pytest.skip(f"PyVista cannot draw here: {fault}")
    space = SpacePanels(plate, picture_frames(plate), smooth=False)
    corners = np.array([[[0, 0, 0.02], [0.1, 0, 0.02], [0.1, 0.4, 0.02], [0, 0.4, 0.02]]])  # the left half of the front
    image = render.render(space.view, space.window, corners, values=np.array([2.0]), norm=Normalize(0.0, 4.0))
    left, right, bottom, top = space.window
    area = (image[..., 3] / 255.0).mean() * (right - left) * (top - bottom)
    first, second = space.view.project(corners[0, [1, 3]] - corners[0, 0]) * 1e3
    assert area == pytest.approx(abs(first[0] * second[1] - first[1] * second[0]), rel=5e-3)  # its edges are soft
    middle = colormap.srgb_table()[127:129].mean(axis=0)
    np.testing.assert_allclose(np.median(image[image[..., 3] == 255][:, :3], axis=0) / 255.0, middle, atol=0.02)


@pytest.mark.parametrize(
    ("module", "reason"),
    [("import os\nos.abort()", "signal 6"), ("raise OSError('no display')", "OSError: no display")],
)
def test_where_pyvista_cannot_draw_matplotlib_does(plate, tmp_path, monkeypatch, capsys, module, reason):
    (tmp_path / "pyvista.py").write_text(module)
    (tmp_path / "vtkmodules").mkdir()
    (tmp_path / "vtkmodules" / "vtkCommonCore.py").write_text(
        "class vtkLogger:\n    VERBOSITY_OFF = 0\n    SetStderrVerbosity = print\n"
    )
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.setattr(render, "is_installed", lambda: True)
    assert main(["figures", str(plate.directory), "field", "-o", str(tmp_path / "figures")]) == 0
    first, last = capsys.readouterr().out.splitlines()
    assert first.startswith("PyVista cannot draw here (")
    assert reason in first
    assert last == f"field.png in {tmp_path / 'figures'}"
