"""The picture of pressure along a line over time: fronts, times and labels in their places."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from matplotlib.colors import LogNorm
from runs_for_tests import GPA, left_by, pictures_of, record_of

from warp_mpm.output.figures.front import front_figure
from warp_mpm.output.frame import SectionPicture
from warp_mpm.scene_loading import load_scene


@pytest.fixture(scope="module")
def scene():
    return load_scene("six_point", cell_size=2e-2)


@pytest.fixture
def front(scene, tmp_path):
    """The x-t picture of a made-up record, and the record."""
    record = record_of(scene)
    return front_figure(left_by(tmp_path, scene, pictures=pictures_of(scene), line=record)), record


def test_front_lines_are_the_first_arrival_of_the_delayed_detonators(front):
    figure, record = front
    peak, axes = figure.axes[:2]
    (line,) = axes.lines
    along, arrival = line.get_data()
    expected = np.min([0.5 * k + np.abs(along - 80.0 * k) / 2.8 for k in range(6)], axis=0)
    np.testing.assert_allclose(arrival, expected, rtol=1e-9, atol=1e-9)
    assert line.get_label() == "expected fronts"
    assert axes.get_xlabel() == "distance along the line [mm]"
    assert axes.get_ylabel() == "time [µs]"
    np.testing.assert_allclose(peak.lines[0].get_ydata(), record.pressure.max(axis=0) / GPA)


def test_front_picture_puts_uneven_steps_at_their_times(scene, front):
    figure, record = front
    image = figure.axes[1].images[0]
    _, _, bottom, top = image.get_extent()
    assert (bottom, top) == pytest.approx((0.0, scene.end_time * 1e6))
    shown = np.array(image.get_array())
    times = np.linspace(0.0, scene.end_time, len(shown))
    step = 1.5 * scene.end_time / 79
    for point in (7, 30, 52):
        arrival = record.time[np.argmax(record.pressure[:, point] > 0)]
        assert times[np.argmax(shown[:, point] > 0.5)] == pytest.approx(arrival, abs=step)


@pytest.mark.parametrize(("span", "scale"), [(2.3, "linear"), (9.0, "linear"), (12.0, "log"), (1e4, "log")])
def test_labels_of_the_peak_axis_keep_apart(scene, tmp_path, span, scale):
    """Beside logarithmic colours too: within a decade it starts at zero."""
    record = record_of(scene)
    highest = np.geomspace(2.6 * GPA, 2.6 * GPA / span, 60)  # below p_CJ, which is shown too
    record = replace(record, pressure=np.float32(record.pressure / GPA * highest))
    pictures = [SectionPicture(time, pictures_of(scene, 1)[0].pressure / time * 1e-9) for time in (1e-9, 1e-6)]
    figure = front_figure(left_by(tmp_path, scene, pictures=pictures, line=record))
    assert isinstance(figure.axes[1].images[0].norm, LogNorm)
    axis = figure.axes[0].yaxis
    assert axis.get_scale() == scale
    figure.draw_without_rendering()
    low, high = figure.axes[0].get_ylim()
    ticks = [*axis.get_major_ticks(), *axis.get_minor_ticks()]
    boxes = [
        tick.label1.get_window_extent() for tick in ticks if tick.label1.get_text() and low <= tick.get_loc() <= high
    ]
    boxes.sort(key=lambda box: box.y0)
    assert boxes
    assert all(below.y1 <= above.y0 for below, above in pairwise(boxes))
