"""Run directories for tests of what is read and drawn from them: made up, or of a small run."""

import numpy as np

from warp_mpm.config import Save
from warp_mpm.output.description import scene_values
from warp_mpm.output.frame import Frame, LineRecord, SectionPicture, SectionRecord, StepRecord
from warp_mpm.output.steps import write_steps
from warp_mpm.output.tables import TableWriter, write_summary
from warp_mpm.output.usd import UsdWriter
from warp_mpm.run_directory import Run, load
from warp_mpm.scene import Scene
from warp_mpm.scene_loading import load_scene
from warp_mpm.simulation import simulate

GPA = 1e9
GAUGES = """time_s,a_pressure_pa,a_velocity_x_m_s,a_velocity_y_m_s,a_velocity_z_m_s,a_density_kg_m3,b_pressure_pa,\
b_velocity_x_m_s,b_velocity_y_m_s,b_velocity_z_m_s,b_density_kg_m3
0.0,0.0,0.0,0.0,0.0,1000.0,1e9,0.0,0.0,0.0,1000.0
1e-06,2e9,3.0,0.0,4.0,1200.0,1e9,0.0,0.0,0.0,1000.0
3e-06,1e9,6.0,0.0,8.0,1100.0,1e9,0.0,0.0,0.0,1000.0
"""


def left_by(directory, scene: Scene, *, pictures=(), line=None, history=(), frames=(), arrival=np.nan) -> Run:
    """A run directory with made-up results of a scene."""
    write_summary(directory / "summary.json", {"status": "complete", **scene_values(scene)})
    nodes = [scene.domain.cells[axis] + 1 for axis in scene.section.in_plane]
    highest = np.max([picture.pressure for picture in pictures], axis=0) if pictures else np.zeros(nodes)
    section = SectionRecord(highest, np.full(nodes, arrival), np.full(nodes, np.nan))
    time = np.zeros(1) if line is None else line.time
    peaks = np.zeros(len(time), np.float32)
    record = StepRecord(time, peaks, peaks, peaks, None, np.zeros((len(time), 0)), None, line, section)
    write_steps(directory / "steps.npz", record, pictures)
    if history:
        with TableWriter(directory / "history.csv", list(history[0])) as table:
            for row in history:
                table.write(row)
    if frames:
        path = directory / f"{scene.name}.usdc"
        with UsdWriter(path, scene, pressure_range=(0.0, GPA), frames=max(len(frames), 2)) as usd:
            for frame in frames:
                usd.write(frame)
    return load(directory)


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
    expected = np.min(away, axis=0)
    return LineRecord(time, distance, expected, (time[:, None] > expected).astype(np.float32) * np.float32(GPA))


def first_frame(scene: Scene) -> Frame:
    """The particles where they are at the start."""
    position = np.concatenate([charge.positions for charge in scene.charges]).astype(np.float32)
    section = np.zeros([scene.domain.cells[axis] + 1 for axis in scene.section.in_plane], np.float32)
    count = scene.particle_count
    return Frame(0, 0.0, position, np.zeros(count, np.float32), np.ones(count, bool), section)


def run_of(directory, **settings) -> Run:
    """A real run of a small plate, lit at both ends, without pictures."""
    scene = load_scene("two_point", cell_size=2e-2, **settings)
    simulate(scene, save=Save(frames=12, figures=False), output=directory)
    return load(directory)
