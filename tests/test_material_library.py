"""The library: every explosive detonates as stated and collides as published; user materials from TOML files."""

import math
from functools import partial

import pytest
from scenes_for_tests import TNT

import warp_mpm as mpm
from warp_mpm.checks import plain_name
from warp_mpm.cli import main
from warp_mpm.exact.chapman_jouguet import chapman_jouguet_state, pressure_of
from warp_mpm.exact.reflection import collision_pressure
from warp_mpm.kernels.burn.compression import CompressionBurn
from warp_mpm.kernels.burn.programmed_compression import ProgrammedCompressionBurn
from warp_mpm.kernels.eos import evaluate
from warp_mpm.material_library import FITS, NAMES, OTHER_NAMES

# Implied by the published parameters, as computed by others: D [m/s], p_CJ [GPa], each to the digits given.
IMPLIED = {
    "tnt": (6929, 21.00),
    "tnt_alternative": (6929, 21.00),
    "composition_b": (7980, 29.5),
    "c4": (8193, 28.0),
    "petn": (8301, 33.5),
    "pbx_9404": (8800, 37.0),
    "nitromethane": (6262, 12.5),
    "anfo_931": (4159, 5.15),
    "anfo_820": (4550, 5.50),
}
# Head-on collision of CJ fronts [GPa], and over p_CJ.
COLLISIONS = {
    "tnt": (47.6, 2.27),
    "composition_b": (66.9, 2.27),
    "c4": (63.6, 2.27),
    "petn": (76.4, 2.28),
    "anfo_931": (11.8, 2.30),
}


@pytest.mark.parametrize("name", FITS)
def test_every_explosive_detonates_as_stated(name):
    """Within 1 % of what is stated for it, and to the digits given of what others computed from its parameters."""
    material, fit = mpm.find_material(name), FITS[name]
    assert material.cj.detonation_speed == pytest.approx(fit.speed, rel=0.01)
    assert material.cj.pressure == pytest.approx(fit.pressure * 1e9, rel=0.01)
    assert (material.stated_speed, material.stated_pressure) == (fit.speed, fit.pressure * 1e9)
    speed, pressure = IMPLIED[name]
    assert material.cj.detonation_speed == pytest.approx(speed, abs=1.0)
    assert material.cj.pressure == pytest.approx(pressure * 1e9, rel=1e-3)
    assert material.burn.detonation_speed == material.cj.detonation_speed or not material.warnings
    assert material.citation


@pytest.mark.parametrize("name", COLLISIONS)
def test_collisions_of_fronts(name):
    material = mpm.find_material(name)
    pressure = collision_pressure(material.equation_of_state, material.density, material.specific_energy)
    expected, ratio = COLLISIONS[name]
    assert pressure / 1e9 == pytest.approx(expected, abs=0.06)
    assert pressure / material.cj.pressure == pytest.approx(ratio, abs=0.006)


@pytest.mark.parametrize(
    "row",
    [
        {
            "density": 1891.0,
            "speed": 9110.0,
            "pressure": 42e9,
            "law": (778.3e9, 7.071e9, 4.2, 1.0, 0.3),
            "energy": 10.5e9,
        },
        {
            "density": 1630.0,
            "speed": 6930.0,
            "pressure": 21e9,
            "law": (371.2e9, 3.21e9, 4.15, 0.95, 0.35),
            "energy": 6e9,
        },
    ],
    ids=["HMX", "TNT of two fits"],
)
def test_rows_that_are_copied_wrong_are_refused(row):
    with pytest.raises(mpm.InputError, match=r"(which|that) its equation of state implies"):
        mpm.explosive(
            "row",
            density=row["density"],
            detonation_speed=row["speed"],
            cj_pressure=row["pressure"],
            equation_of_state=mpm.JWL(row["density"], *row["law"]),
            energy=row["energy"] / row["density"],
        )


@pytest.mark.parametrize(
    "make", [mpm.inert, partial(mpm.explosive, detonation_speed=7000.0)], ids=["inert", "explosive"]
)
def test_no_energy_is_found_for_a_pressure_that_does_not_depend_on_it(make):
    linear = mpm.MieGruneisen(density=8930.0, sound_speed=3940.0)
    with pytest.raises(
        mpm.InputError, match=r"^copper: equation_of_state: expected one whose pressure rises .*Gruneisen"
    ):
        make("copper", density=8930.0, equation_of_state=linear)


def test_inert_materials():
    """At standard pressure, which water has to the rounding of gamma p_inf; the sound speeds of their laws."""
    air, water = mpm.air(), mpm.water()
    assert air.burn is None
    assert pressure_of(air.equation_of_state, air.density, air.specific_energy) == pytest.approx(101325.0, rel=1e-5)
    pressure = pressure_of(water.equation_of_state, water.density, water.specific_energy)
    assert pressure == pytest.approx(101325.0, abs=1000.0)
    for material, speed in ((air, 340.3), (water, 1625.0)):
        eos = material.equation_of_state
        squared = evaluate(eos, eos.sound_speed_squared, material.density, material.specific_energy)
        assert math.sqrt(squared) == pytest.approx(speed, rel=1e-3)


def test_choices_and_unknown_names():
    solid = mpm.MieGruneisen(1630.0, 2390.0, 2.05)
    tnt = mpm.find_material("tnt", burn=mpm.Burn.BOTH, unreacted=solid)
    assert isinstance(tnt.burn, ProgrammedCompressionBurn)
    assert tnt.burn.cj_density == tnt.cj.density
    assert tnt.unreacted == solid
    assert isinstance(mpm.find_material("c4", burn=mpm.Burn.COMPRESSION).burn, CompressionBurn)
    assert set(mpm.library()) == set(NAMES)
    with pytest.raises(mpm.InputError, match=r"^material: expected one of tnt, .*, got 'tmt'; did you mean tnt\?$"):
        mpm.find_material("tmt")
    with pytest.raises(mpm.InputError, match=r"^anfo_820: expected no choice but .*, got density; a material"):
        mpm.find_material("anfo_820", density=700.0)
    with pytest.raises(mpm.InputError, match=r"^water: expected no choices, got burn; "):
        mpm.find_material("water", burn=mpm.Burn.BOTH)
    with pytest.raises(mpm.InputError, match=r"^material: expected one of tnt, .*, got 3$"):
        mpm.find_material(3)


@pytest.mark.parametrize(
    ("written", "name"),
    [
        ("TNT", "tnt"),
        ("Composition B", "composition_b"),
        ("Comp B", "composition_b"),
        ("C-4", "c4"),
        ("Composition C-4", "c4"),
        ("pbx-9404", "pbx_9404"),
        ("PBX 9404", "pbx_9404"),
        ("Ammonium Nitrate", "ammonium_nitrate"),
        ("Air", "air"),
    ],
)
def test_names_as_people_write_them(written, name):
    assert mpm.find_material(written) == mpm.find_material(name)


@pytest.mark.parametrize("name", ["anfo", "pbx", "nitro", "comp", "PBX 9501", "", "-"])
def test_part_of_a_name_or_another_one_finds_nothing(name):
    with pytest.raises(mpm.InputError, match=r"^material: expected one of tnt, "):
        mpm.find_material(name)


def test_no_two_names_are_written_alike():
    """Without capitals and signs between words each still means one material."""
    names = [*NAMES, *OTHER_NAMES]
    assert len({plain_name(name) for name in names}) == len(names)


FILE = """
[mine]
density = 1630
detonation_speed = 6930
cj_pressure = 21e9
energy_per_volume = 7e9
citation = "a handbook"
burn = "both"
equation_of_state = { law = "jwl", a = 371.21e9, b = 3.231e9, r1 = 4.15, r2 = 0.95, omega = 0.3 }
unreacted = { law = "mie_gruneisen", sound_speed = 2390, slope = 2.05, gruneisen = 0.9 }

[gas]
density = 1000
detonation_speed = 2800
equation_of_state = { law = "ideal_gas", gamma = 2 }

[brine]
density = 1030
equation_of_state = { law = "stiffened_gas", gamma = 4.4, stiffness = 6e8 }
"""


@pytest.fixture
def file(tmp_path, monkeypatch):
    """Writes a file of materials and returns its name."""
    monkeypatch.chdir(tmp_path)

    def write(text):
        (tmp_path / "my.toml").write_text(text)
        return "my.toml"

    return write


def test_a_file_of_materials(file):
    materials = mpm.load_materials(file(FILE))
    mine = materials["mine"]
    assert mine.name == "mine"
    assert mine.equation_of_state == TNT
    assert mine.specific_energy == pytest.approx(7e9 / 1630.0)
    assert mine.unreacted == mpm.MieGruneisen(1630.0, 2390.0, 2.05, 0.9)
    assert isinstance(mine.burn, ProgrammedCompressionBurn)
    assert mine.citation == "a handbook"
    assert materials["gas"].specific_energy == pytest.approx(2800.0**2 / 6.0, rel=1e-6)
    brine = materials["brine"]
    assert brine.burn is None
    assert pressure_of(brine.equation_of_state, 1030.0, brine.specific_energy) == pytest.approx(101325.0, abs=1000.0)


@pytest.mark.parametrize("energy", ["cj", 3.84e6])
def test_a_speed_below_all_that_a_law_gives_is_one_line(energy):
    """A layer of ANFO runs at 2500 m/s, the fit for wide charges at no less than its law has without any energy."""
    law, density = mpm.find_material("anfo_820").equation_of_state, 820.0
    least = chapman_jouguet_state(law, density, 1.0).detonation_speed
    assert 2500.0 < least < 4550.0
    with pytest.raises(mpm.InputError, match=r"^layer: detonation_speed: expected .*, got 2500; ") as caught:
        mpm.explosive("layer", density=density, detonation_speed=2500.0, equation_of_state=law, energy=energy)
    says = f"{least:.0f} m/s with hardly any" if energy == "cj" else "; use on_mismatch=keep"
    assert says in str(caught.value)


@pytest.mark.parametrize("energy", ["cj", 4e6])
@pytest.mark.parametrize("law", [mpm.MieGruneisen(1e3, 2e3, 0.0, 0.1), mpm.StiffenedGas(4.4, 6e12)])
def test_an_explosive_that_no_wave_can_run_through_is_one_line(law, energy):
    """Without a sonic compression, or with one under tension alone."""
    with pytest.raises(mpm.InputError, match=r"^it: equation_of_state: .* found none; check the parameters' units$"):
        mpm.explosive("it", density=1630.0, detonation_speed=6930.0, equation_of_state=law, energy=energy)


def changed(old, new):
    assert old in FILE
    return FILE.replace(old, new, 1)


MISTAKES = [
    (
        changed("density = 1630", "densty = 1630"),
        "mine: expected one of density, .*, got 'densty'; did you mean density",
    ),
    (changed("density = 1630\n", ""), "mine: density: expected a value, got none"),
    (changed("density = 1630", "density = 'heavy'"), "mine: density: expected a finite number, got 'heavy'"),
    (
        changed("density = 1630", "density = -1630"),
        "mine: density: expected a positive number, got -1630",
    ),
    (changed('"jwl"', '"jwll"'), "mine: equation_of_state: law: expected one of .*jwl.*, got 'jwll'; did you mean jwl"),
    (changed(", omega = 0.3", ""), "mine: equation_of_state: omega: expected a value, got none"),
    (changed("omega = 0.3", "omega = -1"), "mine: equation_of_state: JWL: omega: expected a positive finite number"),
    (changed("6930", "7930"), "mine: detonation_speed: expected the 6929 m/s .* got 7930"),
    (changed("21e9", "25e9"), r"mine: cj_pressure: expected 2\.1e\+10 Pa .* got 2\.5e\+10"),
    (changed('"both"', '"all"'), "mine: burn: expected programmed or compression or both, got 'all'"),
    (changed("citation", "energy = 4e6\ncitation"), "mine: energy_per_volume: expected no energy beside it"),
    (changed("density = 1030", "density = 1030\nburn = 'both'"), "brine: expected one of .*, got 'burn'"),
    (changed('equation_of_state = { law = "ideal_gas", gamma = 2 }', ""), "gas: equation_of_state: expected a table"),
    (
        changed("[gas]", "x = 1\n[gas]").replace("x = 1\n", "", 1).replace("\n[mine]", "x = 1\n[mine]"),
        "x: expected a table",
    ),
    ("[mine", "expected TOML, got"),
]


@pytest.mark.parametrize(("text", "message"), MISTAKES, ids=[message[:40] for _, message in MISTAKES])
def test_a_mistake_in_a_file_is_one_line(file, text, message):
    with pytest.raises(mpm.InputError, match=f"^my.toml: .*{message}") as caught:
        mpm.load_materials(file(text))
    assert "\n" not in str(caught.value)


def test_files_that_are_not_there(tmp_path, capfd):
    with pytest.raises(mpm.InputError, match=r"expected a TOML file, got .*nowhere\.toml"):
        mpm.load_materials(tmp_path / "nowhere.toml")
    assert main(["materials", str(tmp_path / "nowhere.toml")]) == 2
    assert capfd.readouterr().err.count("\n") == 1


def test_the_table_of_materials(capfd, file):
    """One line each: stated and implied D and p_CJ, and the citation."""
    assert main(["materials"]) == 0
    lines = capfd.readouterr().out.splitlines()
    rows = {line.split()[0]: line for line in lines[2:]}
    assert set(rows) == set(NAMES)
    assert rows["nitromethane"].split()[1:7] == ["JWL", "1128", "6280", "6262", "12.50", "12.50"]
    assert "Dobratz" in rows["c4"]
    assert main(["materials", file(FILE)]) == 0
    assert [line.split()[0] for line in capfd.readouterr().out.splitlines()[2:]] == ["mine", "gas", "brine"]
