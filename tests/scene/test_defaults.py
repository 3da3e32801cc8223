"""Defaults are the paper's Tables 1 and 2, typed here from the paper, and the shipped files say the same."""

import dataclasses
import tomllib
from dataclasses import replace
from pathlib import Path

import pytest

from damagepred.campaign.cost_estimate import accuracy_lines
from damagepred.errors import InputError
from damagepred.scene import BlockMaterial, Dpc, Footing, Joint, Scene, Solver
from damagepred.scene.accuracy import PRESETS, measured
from damagepred.uq.variable import Variable


def test_table_1_of_the_paper():
    brick, footing = BlockMaterial(), Footing()
    assert (brick.elastic_modulus, brick.poisson_ratio, brick.density) == (9000e6, 0.19, 2000.0)
    assert (footing.elastic_modulus, footing.poisson_ratio, footing.density) == (7000e6, 0.2, 2130.0)
    assert (footing.width, footing.depth) == (0.3, 0.3)


def test_table_2_of_the_paper():
    joint, dpc = Joint(), Dpc()
    assert joint.tensile_strength == 0.453e6
    assert joint.cohesion == 0.375e6
    assert (joint.friction, joint.dilation) == (0.75, 0.0)
    assert joint.normal_stiffness == 82e9  # 82 N/mm3
    assert joint.shear_stiffness == 36e9
    assert (dpc.friction, dpc.cohesion, dpc.course) == (0.5, 0.0, 2)
    assert dpc.normal_stiffness is None  # as the joint's
    assert dpc.shear_stiffness is None


def test_eq_4_as_printed_keeps_the_cohesion_after_slip_and_loses_tension_when_cracked():
    joint = Joint()
    assert joint.brittle_shear is False
    assert (joint.residual_tensile_strength, joint.residual_cohesion, joint.residual_friction) == (0.0, 0.0, None)
    assert joint.fracture_energy is None


def test_material_file_and_defaults_agree(data_folder: Path):
    tables = tomllib.loads((data_folder / "materials" / "zhuge.toml").read_text())
    for table, described in (
        ("concrete_footing", Footing()),
        ("clay_brick_masonry", BlockMaterial()),
        ("mortar_joint", Joint()),
        ("dpc", Dpc()),
    ):
        numbers = {k: v for k, v in tables[table].items() if isinstance(v, float)}
        assert numbers, table
        assert tables[table]["source"]
        for name, value in numbers.items():
            if (table, name) == ("dpc", "tensile_strength"):
                assert value == 0.0
            else:
                assert getattr(described, name) == value, f"{table}.{name}"


SOLID, WINDOW = ("bryant_dishing", "bryant_doming"), ("bryant_window_dishing", "bryant_window_doming")


@pytest.mark.parametrize("name", SOLID + WINDOW)
def test_reference_scenes_are_the_test(data_folder: Path, name: str):
    scene = Scene.from_toml(data_folder / f"{name}.toml")
    default = Scene(dpc=Dpc())
    assert scene.wall == default.wall
    assert scene.block == default.block
    assert scene.footing == default.footing
    assert scene.dpc == default.dpc
    for field in dataclasses.fields(Joint):
        value, expected = getattr(scene.joint, field.name), getattr(default.joint, field.name)
        if isinstance(expected, float):
            expected = pytest.approx(expected, rel=1e-14)
        assert value == expected, field.name
    assert scene.movement.kind == name.rsplit("_", 1)[1]
    assert scene.movement.central_deflection == (8e-3 if scene.movement.kind == "dishing" else 7e-3)
    assert scene.movement.shape == "three_loads"
    if name in SOLID:
        assert scene.loads.roof == 6000.0
        assert scene.opening == ()
    else:
        assert scene.loads.roof == 0.0
        (window,) = scene.opening
        assert (window.width, window.height) == (0.9, 1.5)  # 900 wide, 1500 deep
        assert window.top == pytest.approx(2.4)  # from the top
        assert window.x + window.right == pytest.approx(6.0)  # at mid-length


def test_study_scene_is_the_window_wall_taken_to_40_mm(data_folder: Path):
    far = Scene.from_toml(data_folder / "bryant_window_dishing_40mm.toml")
    near = Scene.from_toml(data_folder / "bryant_window_dishing.toml")
    assert far.movement.central_deflection == 0.04
    for table in ("wall", "block", "joint", "dpc", "opening", "footing", "loads"):
        assert getattr(far, table) == getattr(near, table)


# quantity: (mean, cov) as published; see data/statistics/masonry.toml
PUBLISHED = (
    {"joint.tensile_strength": (0.453e6, 0.30), "joint.cohesion": (0.375e6, 0.35), "joint.friction": (0.75, 0.15)}
    | {"joint.normal_stiffness": (82e9, 0.30), "joint.shear_stiffness": (36e9, 0.30)}
    | {"block.elastic_modulus": (9e9, 0.25), "block.density": (2000.0, 0.05)}
)


def _statistics(data_folder: Path) -> dict:
    return tomllib.loads((data_folder / "statistics" / "masonry.toml").read_text())


def _variable(entry: dict) -> Variable:
    names = {f.name for f in dataclasses.fields(Variable)} - {"field"}
    return Variable(**{k: v for k, v in entry.items() if k in names})


@pytest.mark.parametrize("place", PUBLISHED)
def test_statistics_file_has_the_moments_of_the_literature(data_folder: Path, place: str):
    marginal = _variable(_statistics(data_folder)[place]).frozen(place, Scene.unit_of(place))
    mean, cov = PUBLISHED[place]
    assert marginal.mean() == pytest.approx(mean, rel=1e-9)
    assert marginal.std() / marginal.mean() == pytest.approx(cov, rel=1e-9)


def test_statistics_say_where_each_number_comes_from(data_folder: Path):
    for place, entry in _statistics(data_folder).items():
        if "." not in place:  # ratios and fracture energies: tables of figures, no variables of a scene
            for figure in entry.values():
                assert figure["source"], place
            continue
        for key in ("mean", "cov"):
            assert entry[f"{key}_source"], place
    assert _statistics(data_folder)["joint.tensile_strength"]["field"]["course_correlation"] == 0.4


def test_study_uses_the_shipped_statistics(data_folder: Path):
    statistics = _statistics(data_folder)
    study = tomllib.loads((data_folder / "bryant_study.toml").read_text())
    for place, entry in study["variables"].items():
        if place == "movement.central_deflection":
            continue
        unit = Scene.unit_of(place)
        mine, shipped = (_variable(e).frozen(place, unit) for e in (entry, statistics[place]))
        for share in (0.05, 0.5, 0.95):
            assert mine.ppf(share) == pytest.approx(shipped.ppf(share), rel=1e-9), place
    assert study["variables"]["movement.central_deflection"]["lower"] == "40 mm"


def solver(**keys: object) -> Solver:
    return Scene.from_dict({"solver": keys}).solver


@pytest.mark.parametrize("keys", [{"accuracy": "draft"}, {"accuracy": "reference", "blocks": "rigid"}])
def test_written_and_read_again_it_is_the_same(keys: dict):
    scene = Scene.from_dict({"solver": keys})
    assert Scene.from_dict(tomllib.loads(scene.to_toml())) == scene


def test_another_preset_in_place_of_one():
    fine = Solver(accuracy="reference")
    assert fine.with_accuracy("fine") == Solver()
    assert fine.with_accuracy("draft") == Solver(accuracy="draft")
    assert replace(fine, tolerance=1e-3).with_accuracy("reference") == fine


def test_unknown_presets_are_named():
    with pytest.raises(InputError, match=r"\[solver\] accuracy = 'standart'.*Did you mean 'standard'"):
        solver(accuracy="standart")
    with pytest.raises(InputError, match="accuracy = 3"):
        solver(accuracy=3)


def test_what_is_told_is_what_was_measured():
    scene = Scene(dpc=Dpc())
    text = "\n".join(accuracy_lines(scene))
    rows = [r for r in measured() if r.method == "quasi_static" and r.dpc and not r.opening]
    assert {r.wall for r in rows} >= {"dishing", "doming"}
    worst = max(r.error for r in rows if r.accuracy == "draft" and r.quantity == "opening of the dpc")
    draft = text[text.index("draft:") : text.index("standard:")]
    assert f"opening of the dpc {100 * worst:.2g} %" in draft
    assert all(f"{key} = " in draft for key in PRESETS["draft"]["quasi_static"])
    assert 'accuracy = "fine";' in text
    assert 'accuracy = "standard";' in accuracy_lines(Scene(solver=Solver(blocks="rigid")))[0]
