"""What `help` says of the classes that people make, or are given: all of their fields, which no comment would show."""

import re
from dataclasses import fields

import pytest

import warp_mpm as mpm
from warp_mpm.config import PARTICLE_FIELDS

EXPLAINED = (
    mpm.CordDetonator,
    mpm.IdealGas,
    mpm.JWL,
    mpm.LineDetonator,
    mpm.Material,
    mpm.MieGruneisen,
    mpm.PlaneDetonator,
    mpm.PointDetonator,
    mpm.Result,
    mpm.Save,
    mpm.SolverConfig,
    mpm.SphereDetonator,
    mpm.StiffenedGas,
)


@pytest.mark.parametrize("kind", EXPLAINED)
def test_every_field_is_explained(kind):
    attributes = kind.__doc__.partition("Attributes:\n")[2].partition("\n\n")[0]
    named = re.findall(r"^ {8}(\w+): \S", attributes, flags=re.MULTILINE)
    assert named == [field.name for field in fields(kind)]


def test_every_field_that_can_be_saved_is_named():
    assert [name for name in PARTICLE_FIELDS if f'"{name}"' not in mpm.Save.__doc__] == []
