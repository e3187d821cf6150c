"""Every value given in Python is checked: in the place of each, what is none is refused in one line."""

import math

import pytest
from scenes_for_tests import TNT, block, inert_gas

import warp_mpm as mpm
from warp_mpm.progress import Silent

# What is good for each argument of every public class and function that takes numbers; those with a default too.
POINT, VECTOR = (0.01, 0.02, 0.03), (0.0, 1.0, 0.0)
FAR = (0.04, 0.04, 0.04)
BOX = mpm.Box((0.0, 0.0, 0.0), FAR)
GAS = mpm.IdealGas(2.0)


def builder_call(name):
    """A method of a new builder."""

    def call(**arguments):
        getattr(mpm.SceneBuilder("bad"), name)(**arguments)

    return call


def lit_by(kind):
    """A scene lit by a detonator."""

    def call(**arguments):
        mpm.SceneBuilder("bad").detonator(kind(**arguments))

    return call


def simulated(**arguments):
    """A run of a gas that is over soon."""
    return mpm.simulate(block((2, 2, 2), material=inert_gas(), end_time=1e-7), **arguments)


CALLS = {
    "Box": (mpm.Box, {"lower": VECTOR, "upper": (1.0, 2.0, 3.0)}),
    "Sphere": (mpm.Sphere, {"center": POINT, "radius": 0.01}),
    "Cylinder": (mpm.Cylinder, {"start": POINT, "end": FAR, "radius": 0.01}),
    "IdealGas": (mpm.IdealGas, {"gamma": 1.4}),
    "JWL": (mpm.JWL, vars(TNT) | {}),
    "StiffenedGas": (mpm.StiffenedGas, {"gamma": 6.0, "stiffness": 1e8}),
    "MieGruneisen": (mpm.MieGruneisen, {"density": 2e3, "sound_speed": 4e3, "slope": 1.5, "gruneisen": 2.0}),
    "Material": (
        mpm.Material,
        {"name": "gas", "density": 1.0, "equation_of_state": GAS, "specific_energy": 1e5},
    ),
    "explosive": (
        mpm.explosive,
        {
            "name": "it",
            "density": 1000.0,
            "detonation_speed": 2800.0,
            "equation_of_state": GAS,
            "energy": 2800.0**2 / 6.0,
            "cj_pressure": 1000.0 * 2800.0**2 / 3.0,
            "on_mismatch": mpm.OnMismatch.ADJUST,
            "burn": mpm.Burn.PROGRAMMED,
            "unreacted": mpm.MieGruneisen(1000.0, 2000.0),
        },
    ),
    "inert": (mpm.inert, {"name": "gas", "density": 1.0, "equation_of_state": GAS, "pressure": 1e5}),
    "ammonium_nitrate": (
        mpm.ammonium_nitrate,
        {"energy": 2800.0**2 / 6.0, "on_mismatch": mpm.OnMismatch.ADJUST},
    ),
    "PointDetonator": (
        lit_by(mpm.PointDetonator),
        {"position": POINT, "time": 1e-6, "charges": ("a",), "booster": True},
    ),
    "PlaneDetonator": (lit_by(mpm.PlaneDetonator), {"position": POINT, "normal": VECTOR, "time": 1e-6}),
    "LineDetonator": (lit_by(mpm.LineDetonator), {"start": POINT, "end": FAR, "time": 1e-6}),
    "SphereDetonator": (lit_by(mpm.SphereDetonator), {"center": POINT, "radius": 0.01, "time": 1e-6}),
    "CordDetonator": (lit_by(mpm.CordDetonator), {"points": (POINT, FAR), "speed": 6e3, "time": 1e-6}),
    "row": (mpm.row, {"start": POINT, "end": FAR, "count": 3, "time": 1e-6, "delay": 1e-6}),
    "ring": (
        mpm.ring,
        {"center": POINT, "axis": VECTOR, "radius": 0.01, "count": 3, "time": 1e-6, "delay": 1e-6},
    ),
    "grid": (
        mpm.grid,
        {"corner": POINT, "first": VECTOR, "second": FAR, "counts": (2, 3), "time": 1e-6, "delays": (1e-6, 0.0)},
    ),
    "SolverConfig": (
        mpm.SolverConfig,
        {
            "shape": mpm.ShapeFunction.BSPLINE,
            "order": mpm.Order.MUSL,
            "transfer": mpm.Transfer.FLIP,
            "pic_share": 0.5,
            "burn_width": 3.0,
            "viscosity": (1.5, 0.06),
            "cfl": 0.3,
        },
    ),
    "Save": (
        mpm.Save,
        {
            "frames": 3,
            "fields": ("density",),
            "figures": False,
            "layout": mpm.Layout.AUTO,
            "particles_every": 2,
            "isosurface": 1e9,
            "usdz": False,
            "checkpoint_steps": 10,
            "checkpoint_minutes": 1.0,
        },
    ),
    "SceneBuilder": (mpm.SceneBuilder, {"name": "bad"}),
    "simulate": (
        simulated,
        {
            "config": mpm.SolverConfig(),
            "save": mpm.Save(),
            "device": "cpu",
            "threads": 1,
            "progress": Silent(),
            "resume": False,
        },
    ),
    "domain of cell_size": (
        builder_call("domain"),
        {"lower": POINT, "upper": FAR, "cell_size": (0.01, 0.01, 0.01), "margins": (0.0, 0.0, 0.0, 0.0, 0.0, 0.1)},
    ),
    "domain of cells": (builder_call("domain"), {"lower": POINT, "upper": FAR, "cells": (3, 3, 3), "margins": 0.01}),
    "walls": (builder_call("walls"), {"walls": mpm.Walls()}),
    "charge": (
        builder_call("charge"),
        {
            "solid": BOX,
            "material": inert_gas(),
            "particles_per_axis": 2,
            "velocity": VECTOR,
            "may_stay_unlit": True,
            "name": "gas",
        },
    ),
    "gravity": (builder_call("gravity"), {"acceleration": VECTOR}),
    "ambient_pressure": (builder_call("ambient_pressure"), {"pressure": 1e5}),
    "end_time": (builder_call("end_time"), {"time": 1e-5}),
    "burn_width": (builder_call("burn_width"), {"cells": 3.0}),
    "front_path": (builder_call("front_path"), {"start": POINT, "end": FAR}),
    "line": (builder_call("line"), {"start": POINT, "end": FAR}),
    "collision_point": (builder_call("collision_point"), {"point": POINT}),
    "gauge": (builder_call("gauge"), {"point": POINT, "name": "here", "moving": False}),
    "picture_times": (builder_call("picture_times"), {"times": (0.0, 1e-6)}),
    "section": (builder_call("section"), {"axis": 1, "coordinate": 0.02}),
}
NO_NUMBER = (math.nan, math.inf, -math.inf, "1", "nan", None, True, (), 1j, 10**400, [[1.0]], object())
NOTHING_ELSE = (3.5, "x", b"x", (), object)  # where a material, a wall, ... is expected
OPTIONAL = {"threads", "cj_pressure", "unreacted", "velocity", "burn_width", "isosurface", "checkpoint_steps", "name"}


def bad_values(name, good):
    """What may not be in the place of a good value."""
    if isinstance(good, bool):
        return ["yes", 2, None, math.nan]
    if isinstance(good, (int, float)):
        return [bad for bad in NO_NUMBER if not (bad is None and name in OPTIONAL)] + [1.5] * isinstance(good, int)
    if isinstance(good, str):
        return [3, b"x", object(), math.nan]
    if isinstance(good, tuple):
        inside = [
            (*good[:place], bad, *good[place + 1 :])
            for place in range(len(good))
            for bad in bad_values(name, good[place])
        ]
        return [*inside, 1j, "abc", object()]
    return NOTHING_ELSE


@pytest.mark.parametrize("title", CALLS)
def test_what_is_good_is_taken(title):
    call, good = CALLS[title]
    call(**good)


@pytest.mark.parametrize(("title", "name"), [(title, name) for title, (_, good) in CALLS.items() for name in good])
def test_what_is_no_value_is_refused(title, name):
    """In one line; an equation of state, which knows nothing of the rest, raises a bare ValueError."""
    call, good = CALLS[title]
    taken = []
    for bad in bad_values(name, good[name]):
        try:
            call(**{**good, name: bad})
            taken.append(f"{bad!r:.80} was taken")
        except ValueError as refusal:
            if "\n" in str(refusal):
                taken.append(f"{bad!r:.80} took several lines")
        except Exception as error:
            taken.append(f"{bad!r:.80} raised {type(error).__name__}")
    assert not taken


READERS = (mpm.load, mpm.load_scene, mpm.load_materials, mpm.load_mesh)


@pytest.mark.parametrize("call", [*READERS, lambda path: simulated(output=path)])
def test_what_is_no_path_is_refused(call):
    for bad in (3, b"x", math.nan, (), object(), True):
        with pytest.raises(mpm.InputError, match="expected a path, got "):
            call(bad)


def test_what_is_no_summary_is_refused():
    """A result has one, and is none."""
    for bad in (None, "x", simulated()):
        with pytest.raises(mpm.InputError, match=r"expected a summary, .*\.summary$"):
            mpm.print_summary(bad)
