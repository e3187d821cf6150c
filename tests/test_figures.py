"""The pictures: right data, right units, right way up, one colour scale; drawn from what a run left behind alone."""

import os
import shutil
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.colors import LogNorm, to_rgb
from matplotlib.figure import Figure
from matplotlib.image import imread
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from runs_for_tests import GAUGES, GPA, first_frame, left_by, pictures_of, record_of, run_of
from scenes_for_tests import OPEN, block

from warp_mpm.builder import SceneBuilder
from warp_mpm.config import Save
from warp_mpm.detonators import CordDetonator, LineDetonator, PointDetonator, SphereDetonator
from warp_mpm.errors import InputError, SimulationError
from warp_mpm.geometry import Box
from warp_mpm.material_library import find_material
from warp_mpm.materials import ammonium_nitrate
from warp_mpm.output.description import scene_values
from warp_mpm.output.figures import PICTURES, draw_figures
from warp_mpm.output.figures.charge import TINTS, charge_figure
from warp_mpm.output.figures.content import faint_pressure, pressure_range
from warp_mpm.output.figures.energy import energy_figure
from warp_mpm.output.figures.field import field_figure
from warp_mpm.output.figures.gauges import gauges_figure
from warp_mpm.output.figures.maps import arrival_figure, peak_figure
from warp_mpm.output.figures.particles import particles_figure
from warp_mpm.output.figures.section import section_figure
from warp_mpm.output.figures.style import save
from warp_mpm.output.frame import SectionPicture
from warp_mpm.output.tables import write_summary
from warp_mpm.progress import Silent
from warp_mpm.run_directory import Run, load
from warp_mpm.scene import Gauge
from warp_mpm.scene_loading import load_scene
from warp_mpm.simulation import simulate


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
    (tmp_path / "gauges.csv").write_text(GAUGES)
    frames = [replace(first_frame(scene), index=k, time=t) for k, t in enumerate((0.0, scene.picture_times[0]))]
    pictures, line = pictures_of(scene), record_of(scene)
    run = left_by(tmp_path, scene, pictures=pictures, line=line, history=history_of(), frames=frames, arrival=1e-6)
    drawn, missing = draw_figures(run, tmp_path / "figures")
    assert missing == {}
    assert drawn == [f"{name}.png" for name in PICTURES]
    assert sorted(drawn) == sorted(os.listdir(tmp_path / "figures"))
    for file in drawn:
        pixels = imread(tmp_path / "figures" / file)[..., :3]
        assert min(pixels.shape[:2]) > 400
        assert pixels.std() > 0.04


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


def test_detonators_that_are_no_points_are_lines(tmp_path):
    """Dotted, and solid as far as they are lit; what is seen end-on is a dot."""
    detonators = (
        CordDetonator(((0.01, 0.01, 0.01), (0.05, 0.01, 0.01)), speed=8000.0, time=1e-6),
        SphereDetonator((0.03, 0.05, 0.01), 0.01, time=3e-6),
        LineDetonator((0.05, 0.07, 0.0), (0.05, 0.07, 0.02)),
    )
    scene = block((6, 8, 2), detonators=detonators)
    (axes,) = panels_of(section_figure(left_by(tmp_path, scene, pictures=pictures_of(scene, 6)[2:3])))  # at 3 us
    solid = [line.get_xydata() for line in axes.lines if line.get_linestyle() == "-" and len(line.get_xydata()) > 1]
    cord, sphere = solid
    np.testing.assert_allclose(cord, [[10.0, 10.0], [26.0, 10.0]], rtol=1e-6)
    np.testing.assert_allclose(np.hypot(*(sphere - [30.0, 50.0]).T), 10.0, rtol=1e-6)
    dotted = [line.get_xydata() for line in axes.lines if line.get_linestyle() == ":"]
    np.testing.assert_allclose(dotted[0], [[10.0, 10.0], [50.0, 10.0]], rtol=1e-6)
    (dot,) = [line.get_xydata() for line in axes.lines if line.get_marker() == "o"]
    np.testing.assert_allclose(dot, [[50.0, 70.0]], rtol=1e-6)


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


@pytest.fixture(scope="module")
def plate(tmp_path_factory) -> Run:
    return run_of(tmp_path_factory.mktemp("plate"))


def test_a_killed_run_is_drawn_as_far_as_it_got(plate, tmp_path):
    """Without steps.npz, with the summary that a run writes at its start."""
    for name in ("two_point.usdc", "history.csv"):
        shutil.copy(plate.directory / name, tmp_path / name)
    write_summary(
        tmp_path / "summary.json", {"status": "running", **scene_values(load_scene("two_point", cell_size=2e-2))}
    )
    drawn, missing = draw_figures(load(tmp_path), tmp_path / "figures")
    assert set(drawn) == {"charge.png", "particles.png", "field.png", "section.png", "energy.png"}
    assert {name: "killed" in reason for name, reason in missing.items()} == {
        "front.png": True,
        "peak.png": True,
        "arrival.png": True,
        "gauges.png": False,
    }


def test_without_usd_what_is_left_is_drawn(plate, tmp_path):
    for name in ("summary.json", "steps.npz", "history.csv"):
        shutil.copy(plate.directory / name, tmp_path / name)
    drawn, missing = draw_figures(load(tmp_path), tmp_path / "figures")
    assert set(drawn) == {"section.png", "front.png", "peak.png", "arrival.png", "energy.png"}
    assert missing["field.png"] == "the frames are gone"


def test_an_interrupted_run_is_drawn(tmp_path):
    class Stopping(Silent):
        def update(self, time: float, end: float, step: int, note: str) -> None:
            if time > 22e-6:
                raise KeyboardInterrupt

    scene = load_scene("two_point", cell_size=2e-2)
    with pytest.raises(KeyboardInterrupt):
        simulate(scene, save=Save(frames=20), output=tmp_path, progress=Stopping())
    first = sorted(os.listdir(tmp_path / "figures"))
    assert "front.png" in first
    assert "field.png" in first
    shutil.rmtree(tmp_path / "figures")
    assert sorted(draw_figures(load(tmp_path), tmp_path / "figures")[0]) == first
    (panel,) = panels_of(section_figure(load(tmp_path)))  # the first of the instants, 20 us
    assert panel.get_title() == f"(a)  {load(tmp_path).pictures[0].time * 1e6:.1f} µs"


def test_the_field_is_the_surface_at_the_frames_nearest_to_the_instants(plate):
    figure = field_figure(plate)
    panels = panels_of(figure)
    frames = [plate.frames.nearest(time) for time in plate.setup.picture_times]
    titles = list(dict.fromkeys(f"{frame.time * 1e6:.1f} µs" for frame in frames))
    assert [axes.get_title()[5:] for axes in panels] == titles
    faces = panels[-1].collections[0]
    assert len(faces.get_paths()) == 10 * 20 + 10 + 20  # front, above and beside: cells of 20 mm, one deep
    last = plate.frames[-1]
    cells = np.floor(last.position.astype(float) / [0.02, 0.02, 0.02]).astype(int).clip(0, [9, 19, 0])
    means = [last.pressure[(cells == cell).all(axis=1)].mean() / GPA for cell in np.unique(cells, axis=0)]
    assert len(means) == 200
    difference = np.abs(np.array(faces.get_array())[:, None] - means).min(axis=1)
    assert difference.max() < 1e-6 * max(means)
    assert {axes.collections[0].get_clim() for axes in panels} == {tuple(p / GPA for p in pressure_range(plate))}


def test_colors_are_logarithmic_where_instants_would_be_dark(scene, tmp_path):
    """From zero while less than half of the instants are dark, else from 1/30 of the weakest, over five decades."""
    nodes = [scene.domain.cells[axis] + 1 for axis in scene.section.in_plane]

    def scale_of(*highest):
        pictures = [SectionPicture(1e-6 * (n + 1), np.full(nodes, value)) for n, value in enumerate(highest)]
        run = left_by(tmp_path, scene, pictures=pictures)
        image = panels_of(section_figure(run))[0].images[0]
        assert image.norm.vmax == pytest.approx(pressure_range(run)[1] / GPA) == 1.0
        return image.norm, faint_pressure(run)

    for linear in ((GPA, GPA / 5.9), (GPA, GPA, GPA / 1000.0), (GPA, 0.0, 0.0)):  # before the wave comes too
        norm, faint = scale_of(*linear)
        assert not isinstance(norm, LogNorm)
        assert (norm.vmin, faint) == (0.0, 0.02 * GPA)
    for highest, first in (
        ((GPA, GPA / 6.1), 1.0 / 6.1 / 30.0),
        ((GPA, GPA / 1e3), 1e-3 / 30.0),
        ((GPA, 1.0), 1e-5),
    ):
        norm, faint = scale_of(*highest)
        assert isinstance(norm, LogNorm)
        assert norm.vmin == pytest.approx(first)
        assert faint == pytest.approx(first * GPA)


def test_peak_map_is_in_multiples_of_cj(plate):
    figure = peak_figure(plate)
    image = figure.axes[0].images[0]
    expected = plate.steps.section.peak.T / plate.summary["p_cj_pa"]
    np.testing.assert_allclose(image.get_array(), expected)
    assert expected.max() > 1.0
    assert figure.axes[1].get_ylabel() == "highest pressure / $p_{CJ}$"


def test_the_front_arrives_when_it_should(plate):
    """Within the time for one and a half cells: the booster burns one at once, its particles reach half a cell on."""
    shown = np.array(arrival_figure(plate).axes[0].images[0].get_array())
    x, y = np.linspace(0.0, 200.0, 11), np.linspace(0.0, 400.0, 21)[:, None]
    expected = np.minimum(np.hypot(x - 100.0, y), np.hypot(x - 100.0, y - 400.0)) / 2.8
    np.testing.assert_allclose(shown, expected, atol=1.5 * 20.0 / 2.8)


def test_the_legend_of_arrivals_has_the_lines_as_they_are(plate):
    """White lines would not show on a page: they lie on a patch of the map's colours."""
    figure = arrival_figure(plate)
    figure.draw_without_rendering()
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == ["expected", "computed"]
    assert [line.get_color() for line in legend.findobj(Line2D)] == ["white", "black"]
    patches = [patch.get_facecolor() for patch in legend.findobj(Patch) if patch is not legend.get_frame()]
    assert len(patches) == 2
    assert all(max(color[:3]) < 0.7 for color in patches)


def test_charge_figure_names_sizes_and_times(scene, tmp_path):
    figure = charge_figure(left_by(tmp_path, scene, frames=[first_frame(scene)]))
    texts = {text.get_text() for text in figure.axes[0].texts}
    assert {"200 mm", "400 mm", "20 mm", "1: 0 µs", "4: 1.5 µs", "6: 2.5 µs"} <= texts
    assert any("ammonium nitrate, 1.6 kg" in text and "its faces: all slip" in text for text in texts)


@pytest.mark.parametrize("outer", ["water", "ammonium nitrate"])
def test_explosive_inside_something_inert_is_seen(tmp_path, outer):
    """The water before its middle is cut away, so that three sides of it are seen; an explosive is not cut."""
    builder = SceneBuilder("core")
    builder.domain((0.0, 0.0, 0.0), (0.06, 0.06, 0.06), cell_size=0.01)
    core = Box((0.02, 0.02, 0.02), (0.04, 0.04, 0.04))
    material = find_material(outer) if outer == "water" else ammonium_nitrate()
    builder.charge(core, ammonium_nitrate(), name="core")
    builder.charge(Box((0.0, 0.0, 0.0), (0.06, 0.06, 0.06)) - core, material, name="around")
    builder.detonator(PointDetonator((0.03, 0.03, 0.03)))
    builder.end_time(1e-5)
    scene = builder.build()
    figure = charge_figure(left_by(tmp_path, scene, frames=[first_frame(scene)]))
    colors = np.unique(figure.axes[0].collections[0].get_facecolors()[:, :3], axis=0)
    core_tint = np.array(to_rgb(TINTS[0]))
    seen = [color for color in colors if np.allclose(color / core_tint, (color / core_tint)[0])]
    assert len(seen) == (3 if outer == "water" else 0)


def test_of_many_detonators_the_first_and_the_last_have_their_times(tmp_path):
    points = tuple(PointDetonator((0.005 + 0.01 * (n % 6), 0.005 + 0.01 * (n // 6), 0.0), 1e-6 * n) for n in range(36))
    scene = block((6, 6, 1), detonators=points)
    figure = charge_figure(left_by(tmp_path, scene, frames=[first_frame(scene)]))
    texts = [text.get_text() for text in figure.axes[0].texts]
    assert [text for text in texts if "µs" in text] == ["1: 0 µs", "36: 35 µs"]
    assert len([text for text in texts if text.isdigit()]) == 17  # every other one


def test_particles_figure_shows_the_particles_of_some_cells(scene, tmp_path):
    figure = particles_figure(left_by(tmp_path, scene, frames=[first_frame(scene)]))
    assert figure.get_suptitle() == "1,600 particles, cells of 20 × 20 × 20 mm"
    dots = np.array(figure.axes[1].lines[-2].get_data()).T  # the last is the detonator
    left, right = figure.axes[1].get_xlim()
    spaced = np.unique(np.round(dots[:, 0], 6))
    np.testing.assert_allclose(np.diff(spaced), 10.0, rtol=1e-5)  # two to a cell
    assert np.all((spaced > left - 20.0) & (spaced < right + 20.0))


def test_gauges_are_shown_with_their_impulse(scene, tmp_path):
    (tmp_path / "gauges.csv").write_text(GAUGES)
    pressure, impulse, speed = gauges_figure(left_by(tmp_path, scene)).axes
    assert [line.get_label() for line in pressure.lines[:2]] == ["a", "b"]
    np.testing.assert_allclose(pressure.lines[0].get_data(), [[0.0, 1.0, 3.0], [0.0, 2.0, 1.0]])
    np.testing.assert_allclose(impulse.lines[0].get_ydata(), [0.0, 1.0, 4.0])  # kPa s
    np.testing.assert_allclose(speed.lines[0].get_ydata(), [0.0, 5.0, 10.0])
    (tmp_path / "gauges.csv").write_text(GAUGES.replace(",1000.0\n", ",0.0\n"))  # the densities of b
    pressure, *_ = gauges_figure(left_by(tmp_path, scene)).axes
    assert [line.get_label() for line in pressure.lines[:2]] == ["a", "b (nothing)"]


@pytest.mark.parametrize(("count", "named"), [(10, 10), (40, 21)])
def test_names_of_gauges_close_together_are_apart(tmp_path, count, named):
    """From the middle to the edge: the last one's name would lie on what is written beside the drawing."""
    gauges = [Gauge(f"gauge_with_a_name_{n}", (0.03 + 0.03 * n / (count - 1), 0.04, 0.01)) for n in range(count)]
    run = left_by(tmp_path, scene := replace(block((6, 8, 2)), gauges=tuple(gauges)), frames=[first_frame(scene)])
    (axes,) = charge_figure(run).axes
    texts = [text for text in axes.texts if text.get_text()]
    names = [text for text in texts if text.get_text().startswith("gauge")]
    crosses = [line.get_window_extent() for line in axes.lines if line.get_marker() == "x"]
    assert (len(crosses), len(names)) == (count, named)
    for name in names:
        others = [text.get_window_extent() for text in texts if text is not name]
        assert name.get_window_extent().count_overlaps([*others, *crosses]) == 0


def test_an_unknown_picture_is_one_line(plate, tmp_path):
    with pytest.raises(InputError, match=r"expected any of charge, .*, got 'feild'"):
        draw_figures(plate, tmp_path, ["feild"])


def test_a_usd_file_alone_cannot_be_drawn(plate, tmp_path):
    with pytest.raises(InputError, match=r"expected a run directory whose summary\.json describes the scene"):
        draw_figures(load(plate.file), tmp_path)


def test_a_run_that_ends_before_its_pictures_shows_its_last_frame(tmp_path):
    run = run_of(tmp_path, end_time=4e-6)
    (panel,) = panels_of(section_figure(run))
    assert panel.get_title() == "(a)  4.0 µs"
    np.testing.assert_allclose(panel.images[0].get_array(), run.frames[-1].section.T / GPA)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("scene", [block((6, 6, 6), walls=OPEN, margin_cells=2), block((1, 1, 30))])
def test_other_bodies_are_drawn(scene, tmp_path):
    """A thick one that is cut open, and a column whose section is a line."""
    frame = first_frame(scene)
    run = left_by(tmp_path, scene, pictures=[SectionPicture(0.0, frame.section)], frames=[frame])
    drawn, _ = draw_figures(run, tmp_path / "figures")
    assert {"charge.png", "particles.png", "section.png", "peak.png"} <= set(drawn)
    assert ("field.png" in drawn) == (scene.domain.cells[0] > 1)
