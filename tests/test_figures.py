"""The pictures: right data, right units, right way up, one colour scale; drawn from what a run left behind alone."""

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.image import imread
from scenes_for_tests import OPEN, block

from warp_mpm.errors import SimulationError
from warp_mpm.output.description import scene_values
from warp_mpm.output.figures import PICTURES, draw_figures
from warp_mpm.output.figures.energy import energy_figure
from warp_mpm.output.figures.front import front_figure
from warp_mpm.output.figures.section import section_figure
from warp_mpm.output.figures.style import save
from warp_mpm.output.frame import Frame, LineRecord, SectionPicture, SectionRecord, StepRecord
from warp_mpm.output.steps import write_steps
from warp_mpm.output.tables import HistoryWriter, write_summary
from warp_mpm.output.usd import UsdWriter
from warp_mpm.run_directory import Run, load
from warp_mpm.scene import Scene
from warp_mpm.scene_loading import load_scene

GPA = 1e9


def left_by(directory, scene: Scene, *, pictures=(), line=None, history=(), frames=()) -> Run:
    """A run directory with made-up results of a scene."""
    write_summary(directory / "summary.json", {"status": "complete", **scene_values(scene)})
    nodes = [scene.domain.cells[axis] + 1 for axis in scene.section.in_plane]
    section = SectionRecord(np.zeros(nodes, np.float32), np.full(nodes, np.nan, np.float32))
    time = np.zeros(1) if line is None else line.time
    peaks = np.zeros(len(time), np.float32)
    record = StepRecord(time, peaks, peaks, peaks, None, np.zeros((len(time), 0)), None, line, section)
    write_steps(directory / "steps.npz", record, pictures)
    if history:
        with HistoryWriter(directory / "history.csv", list(history[0])) as table:
            for row in history:
                table.write(row)
    if frames:
        path = directory / f"{scene.name}.usdc"
        with UsdWriter(path, scene, pressure_range=(0.0, GPA), frames=max(len(frames), 2)) as usd:
            for frame in frames:
                usd.write(frame)
    return load(directory)


def first_frame(scene: Scene) -> Frame:
    """The particles where they are at the start."""
    position = np.concatenate([charge.positions for charge in scene.charges]).astype(np.float32)
    section = np.zeros([scene.domain.cells[axis] + 1 for axis in scene.section.in_plane], np.float32)
    count = scene.particle_count
    return Frame(0, 0.0, position, np.zeros(count, np.float32), np.ones(count, bool), section)


def pictures_of(scene: Scene, count: int = 6) -> list[SectionPicture]:
    """Bright in the corner where both axes of the section end, and brighter with time."""
    u, v = (np.linspace(0, 1, scene.domain.cells[axis] + 1) for axis in scene.section.in_plane)
    shape = (u[:, None] * v[None, :]).astype(np.float32)
    return [SectionPicture((k + 1) * 1e-6, shape * (k + 1) * np.float32(GPA)) for k in range(count)]


def record_of(scene: Scene) -> LineRecord:
    """Zero before, one gigapascal after the first front has come, with uneven steps."""
    time = np.linspace(0.0, 1.0, 80) ** 1.5 * scene.end_time
    points = scene.line.points(60)
    distance = np.linalg.norm(points - points[0], axis=1)
    away = [d.time + np.linalg.norm(points - d.position, axis=1) / 2800.0 for d in scene.detonators]
    return LineRecord(time, distance, (time[:, None] > np.min(away, axis=0)).astype(np.float32) * np.float32(GPA))


def history_of(count: int = 5) -> list[dict[str, float]]:
    return [
        {"time_s": k * 1e-6, "kinetic_J": 1e3 * k, "internal_J": 9e3 - 1e3 * k, "released_J": 2e3 * k}
        for k in range(count)
    ]


@pytest.fixture(scope="module")
def scene():
    return load_scene("six_point", cell_size=2e-2)


def panels_of(figure: Figure) -> list:
    return [axes for axes in figure.axes if axes.get_title()]


def test_every_figure_is_a_picture_file(scene, tmp_path):
    run = left_by(tmp_path, scene, pictures=pictures_of(scene), line=record_of(scene), history=history_of())
    assert draw_figures(run, tmp_path / "figures") == {}
    files = sorted((tmp_path / "figures").iterdir())
    assert [file.name for file in files] == sorted(f"{name}.png" for name in PICTURES)
    for file in files:
        pixels = imread(file)[..., :3]
        assert min(pixels.shape[:2]) > 400
        assert pixels.std() > 0.05


def test_section_has_a_panel_an_instant_on_one_scale(scene, tmp_path):
    figure = section_figure(left_by(tmp_path, scene, pictures=pictures_of(scene)))
    panels = panels_of(figure)
    assert [axes.get_title() for axes in panels] == [f"({'abcdef'[k]})  {k + 1}.0 µs" for k in range(6)]
    (limits,) = {axes.images[0].get_clim() for axes in panels}
    assert limits == pytest.approx((0.0, 1.6 * 2.6133), rel=1e-4)
    assert len({(axes.get_xlim(), axes.get_ylim()) for axes in panels}) == 1
    assert (panels[0].get_xlabel(), panels[0].get_ylabel()) == ("x [mm]", "y [mm]")
    assert panels[0].get_aspect() == 1.0
    assert figure.axes[-1].get_ylabel() == "pressure [GPa]"


def test_section_is_the_right_way_up(scene, tmp_path):
    pictures = pictures_of(scene)
    figure = section_figure(left_by(tmp_path, scene, pictures=pictures))
    image = panels_of(figure)[2].images[0]
    left, right, bottom, top = image.get_extent()
    half = 10.0  # of a cell [mm]
    assert (left, right, bottom, top) == pytest.approx((-half, 200 + half, -half, 400 + half))
    assert image.origin == "lower"
    np.testing.assert_allclose(image.get_array(), pictures[2].pressure.T / GPA, rtol=1e-6)


def test_detonators_are_hollow_until_they_are_lit(scene, tmp_path):
    figure = section_figure(left_by(tmp_path, scene, pictures=pictures_of(scene, 2)))  # at 1 and 2 us
    marks = [[line for line in axes.lines if line.get_marker() == "o"] for axes in panels_of(figure)]
    places = [(float(mark.get_xdata()[0]), float(mark.get_ydata()[0])) for mark in marks[0]]
    np.testing.assert_allclose(places, [(100.0, 80.0 * k) for k in range(6)], atol=1e-9)
    lit = [[mark.get_markerfacecolor() != "none" for mark in panel] for panel in marks]
    assert lit == [[True, True, True, False, False, False], [True, True, True, True, True, False]]  # 0.5 us apart


def test_section_shows_a_free_charge_and_its_gas_only(tmp_path):
    scene = block((6, 8, 2), walls=OPEN, margin_cells=20)
    pressure = np.zeros([scene.domain.cells[axis] + 1 for axis in scene.section.in_plane], dtype=np.float32)
    pressure[22, 32] = GPA  # inside along x, at y = 120 mm, above the charge
    run = left_by(tmp_path, scene, pictures=[SectionPicture(1e-6, pressure)], frames=[first_frame(scene)])
    (axes,) = panels_of(section_figure(run))
    assert -5.0 < axes.get_xlim()[0] <= 0.0
    assert 60.0 <= axes.get_xlim()[1] < 65.0
    assert 120.0 < axes.get_ylim()[1] < 130.0
    outline = axes.collections[0].get_paths()[0].get_extents()
    np.testing.assert_allclose([outline.min, outline.max], [[0, 0], [60, 80]], atol=1e-6)


def test_a_column_is_drawn_as_profiles(tmp_path):
    scene = block((30, 1, 1))
    nodes = [scene.domain.cells[axis] + 1 for axis in scene.section.in_plane]
    profile = np.linspace(0.0, 2.0, 31)
    pressure = np.broadcast_to(profile if nodes[1] == 31 else profile[:, None], nodes).astype(np.float32) * GPA
    pictures = [SectionPicture(1e-6, pressure), SectionPicture(2e-6, 2 * pressure)]
    (axes,) = section_figure(left_by(tmp_path, scene, pictures=pictures)).axes
    curves = [line for line in axes.lines if line.get_label().endswith("µs")]
    assert [line.get_label() for line in curves] == ["1.0 µs", "2.0 µs"]
    np.testing.assert_allclose(curves[0].get_xdata(), np.linspace(0.0, 300.0, 31))
    np.testing.assert_allclose(curves[1].get_ydata(), 2 * profile, rtol=1e-6)


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
    assert line.get_label() == "fronts at D = 2800 m/s"
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


def test_energies_are_in_kilojoules_and_add_up(scene, tmp_path):
    (axes,) = energy_figure(left_by(tmp_path, scene, history=history_of())).axes
    curves = {line.get_label(): line.get_ydata() for line in axes.lines}
    np.testing.assert_allclose(curves["kinetic"], [0, 1, 2, 3, 4])
    np.testing.assert_allclose(curves["total"], 9.0)
    np.testing.assert_allclose(axes.lines[0].get_xdata(), [0, 1, 2, 3, 4])


def test_a_picture_that_cannot_be_written_is_one_line(tmp_path):
    (tmp_path / "file").write_text("not a directory")
    with pytest.raises(SimulationError, match="cannot write") as caught:
        save(Figure(), tmp_path / "file" / "energy.png")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("highest", "limit"), [(1.23, 1.3), (8.7, 1.6 * 2.6133)])
def test_colors_reach_the_highest_pressure_but_not_far_beyond_the_fronts(scene, tmp_path, highest, limit):
    (picture,) = pictures_of(scene, 1)
    level = SectionPicture(1e-6, np.full_like(picture.pressure, highest * GPA))
    figure = section_figure(left_by(tmp_path, scene, pictures=[level]))
    assert panels_of(figure)[0].images[0].get_clim() == pytest.approx((0.0, limit), rel=1e-4)
