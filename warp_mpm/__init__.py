"""3D simulation of detonation with the Material Point Method, on NVIDIA Warp.

    import warp_mpm as mpm
    scene = mpm.load_scene("two_point", cell_size=6e-3)
    result = mpm.simulate(scene, output="out/two_point")
    run = mpm.load("out/two_point")

Names are imported when they are first used, so that `warp-mpm --help` does not wait for Warp.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from warp_mpm import version

if TYPE_CHECKING:
    from warp_mpm.builder import SceneBuilder
    from warp_mpm.config import Layout, Order, Save, ShapeFunction, SolverConfig, Transfer
    from warp_mpm.detonators import (
        CordDetonator,
        LineDetonator,
        PlaneDetonator,
        PointDetonator,
        SphereDetonator,
        grid,
        ring,
        row,
    )
    from warp_mpm.errors import InputError, SimulationError, Terminated
    from warp_mpm.geometry import Box, Cone, Cylinder, HalfSpace, Mesh, Sphere
    from warp_mpm.kernels.eos.ideal_gas import IdealGas
    from warp_mpm.kernels.eos.jwl import JWL
    from warp_mpm.kernels.eos.mie_gruneisen import MieGruneisen
    from warp_mpm.kernels.eos.stiffened_gas import StiffenedGas
    from warp_mpm.material_files import load_materials
    from warp_mpm.material_library import air, find_material, library, water
    from warp_mpm.materials import Burn, Material, OnMismatch, ammonium_nitrate, explosive, inert
    from warp_mpm.mesh_files import load_mesh
    from warp_mpm.output.progress_bar import progress_on
    from warp_mpm.output.tables import print_summary
    from warp_mpm.result import Result
    from warp_mpm.run_directory import Run, load
    from warp_mpm.scene import Scene, Wall, Walls
    from warp_mpm.scene_loading import list_scenes, load_scene
    from warp_mpm.simulation import simulate

__version__ = version.VERSION

__all__ = [
    "JWL",
    "Box",
    "Burn",
    "Cone",
    "CordDetonator",
    "Cylinder",
    "HalfSpace",
    "IdealGas",
    "InputError",
    "Layout",
    "LineDetonator",
    "Material",
    "Mesh",
    "MieGruneisen",
    "OnMismatch",
    "Order",
    "PlaneDetonator",
    "PointDetonator",
    "Result",
    "Run",
    "Save",
    "Scene",
    "SceneBuilder",
    "ShapeFunction",
    "SimulationError",
    "SolverConfig",
    "Sphere",
    "SphereDetonator",
    "StiffenedGas",
    "Terminated",
    "Transfer",
    "Wall",
    "Walls",
    "__version__",
    "air",
    "ammonium_nitrate",
    "explosive",
    "find_material",
    "grid",
    "inert",
    "library",
    "list_scenes",
    "load",
    "load_materials",
    "load_mesh",
    "load_scene",
    "print_summary",
    "progress_on",
    "ring",
    "row",
    "simulate",
    "water",
]

_HOMES = {
    "builder": ("SceneBuilder",),
    "config": ("Layout", "Order", "Save", "ShapeFunction", "SolverConfig", "Transfer"),
    "detonators": (
        "CordDetonator",
        "LineDetonator",
        "PlaneDetonator",
        "PointDetonator",
        "SphereDetonator",
        "grid",
        "ring",
        "row",
    ),
    "errors": ("InputError", "SimulationError", "Terminated"),
    "geometry": ("Box", "Cone", "Cylinder", "HalfSpace", "Mesh", "Sphere"),
    "kernels.eos.ideal_gas": ("IdealGas",),
    "kernels.eos.jwl": ("JWL",),
    "kernels.eos.mie_gruneisen": ("MieGruneisen",),
    "kernels.eos.stiffened_gas": ("StiffenedGas",),
    "material_files": ("load_materials",),
    "material_library": ("air", "find_material", "library", "water"),
    "mesh_files": ("load_mesh",),
    "materials": ("Burn", "Material", "OnMismatch", "ammonium_nitrate", "explosive", "inert"),
    "output.progress_bar": ("progress_on",),
    "output.tables": ("print_summary",),
    "result": ("Result",),
    "run_directory": ("Run", "load"),
    "scene": ("Scene", "Wall", "Walls"),
    "scene_loading": ("list_scenes", "load_scene"),
    "simulation": ("simulate",),
}


def __dir__() -> list[str]:
    """The public names, for completion."""
    return __all__


def __getattr__(name: str) -> Any:
    """Import a public name from the module it lives in."""
    for module, names in _HOMES.items():
        if name in names:
            return getattr(import_module(f"{__name__}.{module}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
