"""Rig, soil and footing: the ground of a scene, and the footing that follows from it."""

import math
import re
import tomllib
from pathlib import Path

import pytest

from damagepred import Footing, Joint, ReinforcedConcrete, Rig, Scene, Soil
from damagepred.campaign.template import template
from damagepred.errors import InputError
from damagepred.guide import page
from damagepred.scene import site_class, standard_footing, standard_footings, suction_depth
from damagepred.scene.described import build

RIG = {"supports": [0.5, "5.5 m"], "jacks": [2.0, 4.0], "support": "lift_off", "control": "load", "jack_load": "8 kN"}
EVERYTHING = {
    "movement": {"shape": "jacks", "kind": "doming"},
    "footing": {
        "width": "400 mm",
        "segment_length": "120 mm",
        "joint": {"tensile_strength": "0.2 MPa", "fracture_energy": "10 N/m"},
        "concrete": {"bottom": "4-L12TM", "top": "none", "cover": "40 mm", "grade": "N20"},
    },
    "rig": RIG,
    "soil": {"swelling_stiffness": "1000 kPa/m", "shear_stiffness": "2 MPa/m", "friction": 0.4},
    "mound": {"shape": "table", "table": [[0, 1], [0.4, 0.2], [1, 0]], "surface_movement": "40 mm"},
}


def test_all_tables_come_back_from_toml():
    scene = Scene.from_dict(EVERYTHING)
    assert Scene.from_dict(tomllib.loads(scene.to_toml())) == scene
    assert scene.footing.concrete == ReinforcedConcrete(bottom="4-L12TM", top="none", cover=0.04, grade="N20")
    assert scene.footing.joint == Joint(tensile_strength=0.2e6, fracture_energy=10.0)
    assert scene.rig.supports == (0.5, 5.5)
    assert scene.rig.jack_load == 8000.0
    assert scene.mound.table == ((0.0, 1.0), (0.4, 0.2), (1.0, 0.0))
    default = Scene()
    assert Scene.from_dict(tomllib.loads(default.to_toml())) == default
    assert (default.footing.joint, default.footing.concrete, default.footing.segment_length) == (None, None, None)


def test_a_number_that_is_left_out_is_no_misspelling():
    from damagepred.campaign.settings import StudySettings

    with pytest.raises(InputError, match=r"mound\.exponent.*leaves this number out"):
        StudySettings.from_dict(
            {"scene": {}, "variables": {"mound.exponent": {"distribution": "uniform", "lower": 1, "upper": 2}}}
        )


def test_places_at_the_very_ends_and_beyond_the_supports_are_accepted():
    Rig(supports=(0.0, 6.0), jacks=(3.0,)).check_places(6.0)
    Rig(supports=(2.0, 4.0), jacks=(0.0, 6.0)).check_places(6.0)  # jacks on both cantilevers
    Scene.from_dict({"movement": {"shape": "jacks"}, "rig": {"supports": [0.0, 6.0]}})
    Scene.from_dict({"rig": {"supports": [0.0, 60.0]}})  # not read with a prescribed movement


def test_stiffness_of_the_soil_is_the_same_by_default_in_template_guide_statistics_and_study(data_folder: Path) -> None:
    usual = Soil()
    statistics = tomllib.loads((data_folder / "statistics" / "ground.toml").read_text())
    house = tomllib.loads((data_folder.parent / "studies" / "soil_movement" / "house.toml").read_text())
    guide = page("footing-and-ground")
    for name in ("swelling_stiffness", "shrinking_stiffness"):
        expected = getattr(usual, name)
        assert statistics[f"soil.{name}"]["mean"] == expected
        assert house["scene"]["soil"][name] == house["variables"][f"soil.{name}"]["mean"] == expected
        for text in (template("wall", Path("a.toml")), guide):
            assert {float(v) for v in re.findall(rf'{name} = "([\d.]+) kPa/m"', text)} == {1e-3 * expected}


CLASSES = {"A": [0], "S": [0.1, 20], "M": [20.1, 40], "H1": [41, 60], "H2": [60.5, 75], "E": [75.1, 400]}


@pytest.mark.parametrize(("millimetres", "name"), [(y, name) for name, found in CLASSES.items() for y in found])
def test_class_of_a_site(millimetres: float, name: str):
    assert site_class(millimetres * 1e-3).name == name


@pytest.mark.parametrize("wrong", [-0.001, math.nan, math.inf])
def test_impossible_movements_are_refused(wrong: float):
    with pytest.raises(InputError, match="surface_movement"):
        site_class(wrong)


def test_suction_depth_by_zone():
    assert [suction_depth(zone) for zone in range(1, 7)] == [1.5, 1.8, 2.3, 3.0, 4.0, 4.0]
    with pytest.raises(InputError, match="zone = 7"):
        suction_depth(7)


def test_standard_footings_are_footings():
    """Class M: clad 400 x 300 3-L11TM, veneer 500 x 300 3-L12TM, full masonry 900 x 400 4-L12TM (depth x width)."""
    masonry = standard_footing("M", "full_masonry")
    assert (masonry.depth, masonry.width, masonry.mesh) == (0.9, 0.4, "4-L12TM")
    clad, veneer = standard_footing("M", "clad_frame"), standard_footing("M", "masonry_veneer")
    assert (clad.depth, clad.width, clad.mesh) == (0.4, 0.3, "3-L11TM")
    assert (veneer.depth, veneer.width, veneer.mesh) == (0.5, 0.3, "3-L12TM")
    for standard in standard_footings():
        wires = int(standard.mesh[0])
        assert 0.1 * (wires - 1) < standard.width  # wires 100 mm apart fit
        Footing(depth=standard.depth, width=standard.width, concrete=ReinforcedConcrete(bottom=standard.mesh))


def test_what_the_table_does_not_have_is_told():
    with pytest.raises(InputError, match=r"'M full_masonary'.*Did you mean 'M full_masonry'"):
        standard_footing("M", "full_masonary")


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"grade": "N26"}, ["grade = 'N26'", "N20, N25, N32, N40, N50", "Did you mean 'N"]),
        ({"bottom": "3-L10TM"}, ["bottom = '3-L10TM'", "L8TM, L11TM, L12TM", "Did you mean '3-L12TM'?"]),
        ({"bottom": "L8TM"}, ["bottom = 'L8TM'", "number of wires", "Did you mean '3-L8TM'?"]),
        ({"top": "0-L8TM"}, ["top = '0-L8TM'", "'none'"]),
        ({"law": "bransen"}, ["law = 'bransen'", "Did you mean 'branson'?"]),
        ({"elastic_modulus": "300 GPa"}, ["steel_modulus", "must exceed"]),
    ],
)
def test_what_is_wrong_is_said(values, words):
    with pytest.raises(InputError) as caught:
        build(ReinforcedConcrete, values, "file")
    for word in words:
        assert word in str(caught.value)
