"""The scene that detonates a mesh: exact mass, arrival times around the hole of a ring, and any other file."""

import numpy as np
import pytest
import trimesh
from runs_for_tests import first_frame, left_by

from warp_mpm.config import Save
from warp_mpm.detonators import PointDetonator
from warp_mpm.errors import InputError
from warp_mpm.exact.kenamond import inert_sphere
from warp_mpm.material_library import find_material
from warp_mpm.output.figures.particles import particles_figure
from warp_mpm.scene_loading import load_scene
from warp_mpm.scenes.from_mesh import write_ring
from warp_mpm.simulation import simulate


def test_from_mesh():
    """Mass of a regular polygon's way around an axis in n steps, n sin(2 pi/n) R A; waves that go round the hole."""
    scene = load_scene("from_mesh", cell_size=8e-3)
    (body,) = scene.charges
    area = 32 / 2 * 0.02**2 * np.sin(2 * np.pi / 32)
    volume = 96 * np.sin(2 * np.pi / 96) * 0.06 * area
    assert body.volume == pytest.approx(volume, rel=1e-6)  # an STL file is in single precision
    assert body.mass == pytest.approx(1000.0 * body.solid.exact_volume(), rel=1e-14)
    assert body.volume_tolerance == 0.0
    result = simulate(scene, save=Save(frames=2, figures=False))
    lamp = PointDetonator((-0.08, 0.0, 0.0))
    assert scene.detonators[0].position == pytest.approx(lamp.position, abs=1e-6)
    middle = np.abs(body.positions[:, 2]) < 4e-3  # the next layers have to go over the hole's curved side
    exact = inert_sphere(body.positions, radius=0.04, detonator=lamp, speed=2800.0, cylinder=True)
    times = result.state.field("arrival_time").astype(np.float64)
    assert np.abs(times - exact)[middle].max() * 2800.0 / 8e-3 < 0.1
    gauge = result.record.gauges["opposite"]
    around = 2 * np.sqrt(0.08**2 - 0.04**2) + 0.04 * np.pi / 3  # along two tangents and a sixth of the hole's rim
    assert gauge.time[np.argmax(gauge.pressure > 0.1e9)] == pytest.approx(around / 2800.0, abs=8e-3 / 2800.0)


def test_from_mesh_takes_any_mesh(tmp_path):
    write_ring(tmp_path / "part.stl")
    scene = load_scene("from_mesh", mesh=str(tmp_path / "part.stl"), unit="cm", cell_size=8e-2)
    assert scene.mass == pytest.approx(1000.0 * load_scene("from_mesh", cell_size=8e-3).mass)
    with pytest.raises(InputError, match=r"scene from_mesh: mesh 'none.stl': expected a file that can be read, got no"):
        load_scene("from_mesh", mesh="none.stl")


def test_from_mesh_takes_any_explosive_of_the_library():
    scene, tnt = (load_scene("from_mesh", cell_size=8e-3, **choice) for choice in ({}, {"material": "tnt"}))
    assert tnt.charges[0].material == find_material("tnt")
    assert tnt.mass == pytest.approx(1.63 * scene.mass)
    with pytest.raises(InputError, match=r"scene from_mesh: material: expected one of tnt, .*'tn'; did you mean tnt\?"):
        load_scene("from_mesh", material="tn")
    with pytest.raises(InputError, match=r"scene from_mesh: material: expected an explosive, got 'water'"):
        load_scene("from_mesh", material="water")


def stl(path, *bodies):
    """Solids of revolution about the z axis, of 24 steps, from profiles of (radius, height) [mm]; returns the path."""
    meshes = [trimesh.creation.revolve(np.array(profile), sections=24) for profile in bodies]
    trimesh.util.concatenate(meshes).export(path)
    return str(path)


CONE = ((0.0, 0.0), (40.0, 0.0), (0.0, 60.0))
DISK = ((0.0, 80.0), (40.0, 80.0), (40.0, 100.0), (0.0, 100.0))
LOW = ((0.0, 0.0), (40.0, 0.0), (40.0, 10.0), (0.0, 10.0))


@pytest.mark.parametrize(
    ("bodies", "height"), [((CONE,), 0.03), ((LOW, DISK), 0.09), ((CONE, DISK), 0.05)], ids=["cone", "gap", "apart"]
)
def test_the_section_cuts_matter(tmp_path, bodies, height):
    """A flat base is no place for it: half-way up, or where nothing is there through the tallest part."""
    scene = load_scene("from_mesh", mesh=stl(tmp_path / "part.stl", *bodies), cell_size=5e-3)
    assert scene.section.axis == 2
    assert scene.section.coordinate == pytest.approx(height, abs=1e-6)  # an STL file is in single precision
    layer = np.abs(scene.charges[0].positions[:, 2] - height) < 5e-3
    assert layer.any()


def test_the_detail_of_the_particles_shows_some(tmp_path):
    """The detonator is at the rim of the base, beside all that the section cuts."""
    scene = load_scene("from_mesh", mesh=stl(tmp_path / "cone.stl", CONE), cell_size=4e-3)
    axes = particles_figure(left_by(tmp_path, scene, frames=[first_frame(scene)])).axes[1]
    x, y = axes.lines[-1].get_data()  # the detonator is out of the window
    seen = (x > axes.get_xlim()[0]) & (x < axes.get_xlim()[1]) & (y > axes.get_ylim()[0]) & (y < axes.get_ylim()[1])
    assert np.count_nonzero(seen) > 100  # of 256 if all 64 cells were full


def test_the_shipped_ring_is_cut_in_the_middle():
    assert load_scene("from_mesh", cell_size=8e-3).section.coordinate == 0.0
