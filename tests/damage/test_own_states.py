"""Damage states in one's own words: definitions, judgement against numpy on stored values, and their way through."""

import json
from pathlib import Path

import numpy as np
import pytest

import damagepred
from damagepred import Damage, InputError, Scene, Study
from damagepred.damage.table import own_table, share_of_limit
from tests.cli.conftest import command as command

STATES = [
    {"name": "schadlos"},
    {"name": "Haarriss schön", "width": "0.1 mm", "psi": 1.2},
    {"name": "软", "width": "1.4 mm", "count": 5, "length": "3.5 m"},
    {"name": "einsturzgefährdet", "width": "4 mm", "distortion": 0.001, "value": 6.0},
]
STUDY = """
[study]
samples = 6
seed = 3
stop_at_category = "none"
[scene]
wall = { length = "1.92 m", height = "0.6 m" }
opening = [{ kind = "window", x = "0.72 m", y = "0.15 m", width = "0.48 m", height = "0.3 m" }]
joint = { tensile_strength = "0.1 MPa", cohesion = "0.1 MPa" }
movement = { central_deflection = "6 mm", increments = 6 }
solver = { blocks = "rigid" }
[variables]
"joint.tensile_strength" = { distribution = "lognormal", mean = "0.1 MPa", cov = 0.5 }
"""
FUNCTION = """
import numpy as np

def severity(stored):
    return 1e3 * stored["crack_width_max"] * np.sqrt(stored["crack_count"])

def broken(stored):
    return 1 / 0

def short(stored):
    return stored["psi"][:0]
"""


def in_toml(states: list[dict], table: str) -> str:
    rows = [f"[[{table}.state]]\n" + "".join(f"{k} = {json.dumps(v)}\n" for k, v in state.items()) for state in states]
    return "\n".join(rows)


def expected(ds, states: list[dict], function=None) -> np.ndarray:
    """Categories by comparisons of the stored values."""
    mm = {"0.1 mm": 1e-4, "1.4 mm": 1.4e-3, "3.5 m": 3.5, "4 mm": 4e-3, "2.5 m": 2.5}
    names = {"width": "crack_width_max", "band": "crack_band_width_max", "count": "crack_count"}
    names |= {"length": "crack_length_total", "psi": "psi"}
    category = np.zeros(ds["crack_width_max"].shape, dtype=int)
    for number, state in enumerate(states):
        for measure, limit in state.items():
            if measure == "name":
                continue
            if measure == "value":
                values = 1e3 * ds["crack_width_max"].values * np.sqrt(ds["crack_count"].values)
            elif measure == "distortion":
                values = np.nanmax(ds["opening_distortion"].values, axis=-1)
            else:
                values = ds[names[measure]].values
            category = np.where(values >= mm.get(limit, limit) * (1 - 1e-9), np.maximum(category, number), category)
    return category


@pytest.fixture
def study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "own_severity.py").write_text(FUNCTION)
    text = STUDY + '[scene.damage]\nfunction = "own_severity:severity"\n' + in_toml(STATES, "scene.damage")
    (tmp_path / "own.toml").write_text(text, encoding="utf-8")
    Study.from_toml("own.toml").run("own.dp", workers=1)
    return damagepred.open_study("own.dp")


def test_a_study_by_own_states_is_numpy_on_the_stored_values(study, tmp_path: Path) -> None:
    category = study["damage_category"].values
    np.testing.assert_array_equal(category, expected(study, STATES))
    assert set(np.unique(category)) == {0, 1, 2, 3}, "all states are there"
    assert study["damage_category"].attrs["flag_meanings"] == "schadlos Haarriss_schön 软 einsturzgefährdet"
    # the archive again, by the same states, by others from a file, and back
    same = damagepred.judge_again(study)
    np.testing.assert_array_equal(same["damage_category"].values, category)
    other = [{"name": "gut"}, {"name": "schlecht", "length": "2.5 m", "psi": 1.2}]
    (tmp_path / "other.toml").write_text(in_toml(other, "damage"), encoding="utf-8")
    judged = damagepred.judge_again(study, table=tmp_path / "other.toml")
    np.testing.assert_array_equal(judged["damage_category"].values, expected(study, other))
    assert judged.attrs["damage_table"].startswith("own states: gut (below); schlecht (length 2.5 or psi 1.2)")
    np.testing.assert_array_equal(damagepred.judge_again(judged)["damage_category"].values, expected(study, other))
    shipped = damagepred.judge_again(judged, table="as2870")
    widths = shipped["crack_width_max"].values
    assert (shipped["damage_category"].values >= np.searchsorted([1e-4, 1e-3, 5e-3, 1.5e-2], widths, "right")).all()


def test_commands_take_the_names(study, command) -> None:
    asked = ("own.dp", "--category", "haarriss_SCHÖN", "--at", "4 mm")
    found = json.loads(command("estimate", *asked, "--json").out)
    assert found["category"] == 1
    assert found == json.loads(command("estimate", "own.dp", "--category", 1, "--at", "4 mm", "--json").out)
    said = command("fragility", "own.dp", "--categories", "Haarriss schön,软", "--bootstrap", 0, "--goodness", 0)
    assert said.code == 0
    assert "2 软" in said.out
    assert command("export", "own.dp", "openquake", "--categories", "软", "--extrapolated").code == 0
    said = command("estimate", "own.dp", "--category", "Haariss", "--at", "4 mm")
    assert said.code == 2
    assert "category = 'Haariss': must be a number from 1, or one of Haarriss schön, 软, einsturz" in said.err
    said = command("rare", "own.toml", "--category", "slight", "--at", "4 mm")
    assert "category = 'slight': must be a number from 1, or one of Haarriss schön, 软" in said.err


@pytest.mark.filterwarnings("ignore:Glyph")
def test_names_go_to_curves_tables_exports_and_pictures(study, tmp_path: Path) -> None:
    from damagepred import plotting
    from damagepred.exports.programs import openquake_xml

    curves = damagepred.fit_fragility(study, bootstrap=10)
    assert curves["category_name"].values.tolist() == ["Haarriss_schön", "软", "einsturzgefährdet"]
    one = damagepred.exceedance(study, "软", "4 mm")
    reached = (study["damage_category"].values[:, :5] >= 2).any(axis=1).mean()
    assert one.estimate.value == pytest.approx(reached)
    assert "软" in openquake_xml(curves, categories=[2], extrapolated=True)
    again = Study.from_toml("own.toml").settings
    assert Scene.from_dict(again.scene.to_dict()) == again.scene
    with pytest.raises(InputError, match=r"judged by own states: .*reference by AS 2870"):
        damagepred.compare({"a": damagepred.judge_again(study, table="as2870"), "b": study})
    wall = damagepred.solve(again.scene)
    np.testing.assert_array_equal(wall["damage_category"].values, expected(wall, STATES))
    np.testing.assert_array_equal(damagepred.judge_again(wall)["damage_category"].values, expected(wall, STATES))
    for picture in (
        plotting.draw_history(wall),
        plotting.draw_wall(wall),
        plotting.draw_category_shares(study),
        plotting.draw_cracks(wall),
    ):
        picture.figure.savefig(tmp_path / "picture.png")
        assert "AS 2870" not in picture.get_title(loc="left")


def test_the_limit_of_rare_events_is_the_share_of_the_nearest_threshold() -> None:
    table = own_table([{"name": "a"}, {"name": "b", "width": 1e-3, "psi": 2.0}, {"name": "c", "length": 4.0}])
    stored = {"crack_width_max": 0.4e-3, "psi": 1.0, "crack_length_total": 3.0}
    assert share_of_limit(table, stored, 1) == pytest.approx(0.75)  # state b is reached with state c: its length counts
    assert share_of_limit(table, stored | {"psi": 1.9}, 1) == pytest.approx(0.95)
    assert share_of_limit(table, stored, 2) == pytest.approx(0.75)


@pytest.mark.parametrize(
    ("states", "keys", "said"),
    [
        (STATES[:1], {}, "state: there are 1; give 2 to 6"),
        ([*STATES[:1], *[{"name": f"s{c}", "psi": k} for k, c in enumerate("abcdef", 1)]], {}, "there are 7"),
        ([{"name": "a", "psi": 1}, {"name": "b", "psi": 2}], {}, "state 1, 'a', psi: the first state is the undamaged"),
        ([{"name": "a"}, {"name": "b"}], {}, r"state 2, 'b': needs a threshold \(width, band, count"),
        (
            [{"name": "a"}, {"name": "b", "psi": 2}, {"name": "c", "psi": 2}],
            {},
            "psi = 2 of 'c' must be greater than 2",
        ),
        ([{"name": "a b"}, {"name": "a_b", "psi": 2}], {}, "two categories have it"),
        ([{"name": "ö"}, {"name": "o\u0308", "psi": 2}], {}, "'ö': two categories have it"),
        ([{"name": "a"}, {"name": "b;c", "psi": 2}], {}, "name 'b;c': must be at most 40 letters"),
        ([{"name": "a"}, {"name": "b", "colour": 2}], {}, "unknown key .*colour; .* takes name, width, band"),
        ([{"name": "a"}, {"name": "b", "width": -1}], {}, "width = -1: must be greater than 0"),
        ([{"name": "a"}, {"name": "b", "value": 1}], {}, "function: goes with value"),
        ([{"name": "a"}, {"name": "b", "psi": 1}], {"function": "m:f"}, "function: goes with value"),
        ([{"name": "a"}, {"name": "b", "value": 1}], {"function": "m.f"}, "must be module:function"),
        ([{"name": "a"}, {"name": "b", "psi": 1}], {"table": "bre251"}, "own states replace the damage table"),
    ],
)
def test_states_that_are_refused(states: list[dict], keys: dict, said: str) -> None:
    with pytest.raises(InputError, match=said):
        Scene.from_dict({"damage": {"state": states, **keys}})


@pytest.mark.parametrize(
    ("function", "said"),
    [
        ("no_such_module:f", "cannot be imported from the working folder .ModuleNotFoundError"),
        ("own_wrong:nothing", "cannot be imported .*AttributeError"),
        ("own_wrong:np", "is no function"),
        ("own_wrong:broken", "raises ZeroDivisionError"),
        ("own_wrong:short", r"returns an array of shape \(0,\) for arrays of \([12],\)"),
    ],
)
def test_functions_that_are_refused_before_a_wall_is_solved(function, said, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "own_wrong.py").write_text(FUNCTION)
    (tmp_path / "own.toml").write_text(
        STUDY
        + f'[scene.damage]\nfunction = "{function}"\n'
        + in_toml([STATES[0], {"name": "b", "value": 1}], "scene.damage")
    )
    with pytest.raises(InputError, match=said):
        Study.from_toml("own.toml")
    with pytest.raises(InputError, match=said):
        damagepred.solve(Scene(damage=Damage(state=({"name": "a"}, {"name": "b", "value": 1}), function=function)))


def test_a_house_is_in_the_worst_state_of_its_walls() -> None:
    """Its number and length of cracks are the largest of a wall."""
    walls = [
        {"name": name, "start": start, "end": end, "height": 0.45}
        for name, start, end in (("a", [0, 0], [2.4, 0]), ("b", [2.4, 0], [2.4, 1.2]))
    ]
    states = [{"name": "gut"}, {"name": "gerissen", "count": 1, "psi": 0.01}, {"name": "schlecht", "length": "6 m"}]
    ds = damagepred.solve(
        Scene.from_dict(
            {"wall": walls, "joint": {"tensile_strength": 1e4, "cohesion": 1e4}}
            | {"footing": {"depth": 0.1, "width": 0.2, "elastic_modulus": 2e9}}
            | {"mound": {"shape": "tree", "point": [-0.2, 0], "reach": 1.6, "surface_movement": "60 mm"}}
            | {"movement": {"kind": "settle", "increments": 4}, "damage": {"state": states}}
        )
    )
    cracked = ds["wall_crack_count"].values >= 1
    long = ds["wall_crack_length_total"].values >= 6.0
    by_wall = np.where(long, 2, np.where(cracked | (ds["wall_psi"].values >= 0.01), 1, 0))
    np.testing.assert_array_equal(ds["wall_damage_category"].values, by_wall)
    np.testing.assert_array_equal(ds["damage_category"].values, by_wall.max(axis=-1))
    np.testing.assert_array_equal(ds["crack_length_total"].values, ds["wall_crack_length_total"].values.max(axis=-1))
    assert set(np.unique(by_wall)) == {0, 1, 2}
