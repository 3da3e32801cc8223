"""Steps of results by hand: contacts of a model, errors, numbers in writing, and words of movements."""

import dataclasses
import pickle

import numpy as np
import pytest
import xarray as xr

import damagepred
from damagepred.damage import load_table
from damagepred.damage.joints import JointMap
from damagepred.errors import ConvergenceError, InputError, likely_unit, require_number, shown
from damagepred.formatting import chance, counted, duration, length, number, plain, quantity, ratio, with_band
from damagepred.one_wall.judged_path import joint_map, model_of
from damagepred.scene import Movement, Opening, Scene, Wall
from damagepred.uq.intensity import attributes, movement_words, shown_measure
from tests.results.test_rejudge import study

SMALL = Scene(
    wall=Wall(length=1.44, height=0.45),
    opening=(Opening(x=0.48, y=0.15, width=0.48, height=0.15),),
    movement=Movement(central_deflection=2e-3, increments=1),
)


def test_joints_of_a_model_are_the_contacts_of_its_archive() -> None:
    """Places, normals, lengths and blocks of every contact, in the same order as in the result."""
    ds, joints = damagepred.solve(SMALL), joint_map(model_of(SMALL, {}))
    for name in ("x", "y"):
        np.testing.assert_allclose(getattr(joints, f"contact_{name}").ravel(), ds[f"contact_{name}"].values)
    again = JointMap.from_dataset(ds, with_blocks=True)
    for name in ("contact_x", "contact_y", "kind"):
        np.testing.assert_allclose(getattr(joints, name), getattr(again, name))
    one = damagepred.judge_again(ds)
    np.testing.assert_array_equal(one["crack_width_max"], ds["crack_width_max"])


def test_categories_by_band_are_the_archived_ones_only_under_the_archived_rules() -> None:
    """The third band was found to be in category 4 along the path; new limits or rules take its width of 6 mm."""
    ds = study([[0.05, 0.5, 2.0]], [[0.0, 0.0, 0.0]])
    both = ("sample", "increment")
    ds["crack_band_width_max"] = both, np.array([[0.05, 2.0, 6.0]]) * 1e-3
    ds["damage_category_band"] = both, np.array([[0, 2, 4]], dtype=np.int8)
    finer = dataclasses.replace(load_table("as2870"), limits=(0.04e-3, 0.1e-3, 3e-3, 7e-3))
    for rules, band in (({}, [0, 2, 4]), ({"table": finer}, [1, 2, 3]), ({"count_rule": False}, [0, 2, 3])):
        judged = damagepred.judge_again(ds, measure="band", **rules)
        assert judged["damage_category"].values.tolist() == [band]
        assert judged["damage_category_band"].values.tolist() == [band]
        joint = damagepred.judge_again(ds, **rules)
        assert joint["damage_category_band"].values.tolist() == [band]


def test_errors_of_solvers_survive_the_trip_from_a_worker() -> None:
    error = pickle.loads(pickle.dumps(ConvergenceError("no equilibrium", increment=3, block=7)))
    assert (type(error), str(error), error.increment, error.block) == (ConvergenceError, "no equilibrium", 3, 7)
    assert (ConvergenceError("a").increment, ConvergenceError("a").block) == (-1, -1)


@pytest.mark.parametrize(
    ("limits", "value", "words"),
    [
        ({"low": 1.0}, 0.5, "a = 0.5: must be a finite number of at least 1."),
        ({"low": 0.0, "open_low": True}, 0, "a = 0: must be a finite number greater than 0."),
        ({"high": 2.0, "unit": "m"}, 3.0, "a = 3.0: must be a finite number of at most 2 m."),
        ({"low": 1.0, "high": 2.0}, True, "a = True: must be a finite number of at least 1 and at most 2."),
        ({}, float("nan"), "a = nan: must be a finite number."),
        ({}, 10**400, "must be a finite number."),
    ],
)
def test_numbers_outside_their_limits(limits: dict, value: object, words: str) -> None:
    with pytest.raises(InputError) as error:
        require_number("a", value, **limits)
    assert words in str(error.value)
    assert require_number("a", 1, 1.0, 1.0) == 1.0


def test_values_in_writing() -> None:
    assert shown("a" * 500)[-3:] == "..."
    assert len(shown("a" * 500)) == len(shown("a" * 1000))
    assert shown(10**5000) == "a number of type int"
    assert likely_unit(30.0, 10.0, "m") == " Did you mean '30 mm'?"
    assert [likely_unit(v, 10.0, u) for v, u in ((29.9, "m"), (10001.0, "m"), ("a", "m"), (30.0, "Pa"))] == [""] * 4
    assert likely_unit(30.0, 1.0, "1") == " Did you mean '30 %'?"
    assert "; ".join(number(v) for v in (np.nan, np.inf, -0.00012345, 123456.7, 1e-5, 12345678.0)) == (
        "–; ∞; −0.0001234; 123500; 1e−05; 1.235e+07"
    )
    given = ((0.05, "m"), (0.2, "m"), (99e3, "Pa"), (1e5, "Pa"), (2e9, "Pa/m"), (0.01, "s"), (3.0, "kg"), (0.5, "1"))
    assert "; ".join(" ".join(quantity(*one)) for one in given) == (
        "50 mm; 0.2 m; 99 kPa; 0.1 MPa; 2 N/mm³; 10 ms; 3 kg; 0.5 –"
    )
    assert (length(1.2345e-3), length(np.nan)) == ("1.23 mm", "–")
    assert [ratio(v) for v in (1 / 300, 0.0, np.inf)] == ["1/300", "0", "∞"]
    assert [chance(v) for v in (0.0, 0.0009, 0.001, 0.0994, 0.0995, 0.99, 0.991, 0.9991, 1.0, np.nan)] == [
        *("0.00", "< 0.001", "0.001", "0.099", "0.10", "0.99", "0.991", "> 0.999", "1.00", "–")
    ]
    assert with_band("2", "1", "3") == "2 (1 to 3)"
    assert (with_band("2", "2", "2"), with_band("2", "–", "3"), with_band("2", "2", "3")) == ("2", "2", "2 (2 to 3)")
    assert with_band("2", "1", "3", "\n") == "2\n(1\xa0to\xa03)"
    assert plain([True, 2.0, {"a": "b_c"}, False]) == "yes, 2, a b c, no"
    assert "; ".join(duration(s) for s in (9.96, 10, 89, 90, 5399, 5400)) == "10.0 s; 10 s; 89 s; 2 min; 90 min; 1.5 h"


@pytest.mark.parametrize(
    ("movement", "words"),
    [
        ("", "largest settlement"),
        ('kind = "heave"', "largest heave"),
        ('shape = "tilt"', "settlement of one end"),
        ('shape = "trough"\nkind = "heave"', "heave at the trough's axis"),
        ('shape = "step"', "step of the ground"),
        ('settlement_is = "range"\nshape = "step"', "differential settlement"),
        ('settlement_is = "centre"', "settlement relative to the ends"),
    ],
)
def test_words_of_a_settlement(movement: str, words: str) -> None:
    ds = xr.Dataset(
        {"settlement": ("increment", [0.0, 1e-3], {"units": "m"})}, attrs={"scene": f"[movement]\n{movement}"}
    )
    assert movement_words(ds) == words
    assert attributes(ds, "settlement") == {"long_name": words, "units": "m"}
    curves = xr.Dataset(coords={"intensity": ("intensity", [0.0], {"long_name": "own words"})})
    assert movement_words(curves.assign_attrs(intensity_measure="settlement")) == "own words"
    assert [shown_measure(*one)[1:] for one in (("a", "m"), ("strain", "1"), ("a", "1"))] == [
        ("mm", 1e3),
        ("mm/m", 1e3),
        ("1", 1.0),
    ]


def test_houses_are_counted_and_keys_of_walls_stay() -> None:
    said = "Walls: 3 walls of 9 (wall.front.thickness, each wall's wall_crack_width_max); a wall."
    assert counted(said, houses=False) == said
    assert counted(said, houses=True) == (
        "Houses: 3 houses of 9 (wall.front.thickness, each house's wall_crack_width_max); a house."
    )
