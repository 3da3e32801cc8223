"""Histories on every shape and ground: cut into stages, there and back, from a table, and in studies."""

import dataclasses
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import damagepred
from damagepred import InputError, Movement, Scene, Study, fit_fragility, judge_again, open_study
from damagepred.campaign.replay import replay
from damagepred.campaign.settings import StudySettings
from damagepred.damage import load_table
from damagepred.plotting import draw_fragility, draw_history
from damagepred.scene import Stage

WALL = {"wall": {"length": 1.92, "height": 0.6}, "dpc": {"course": 2}}
FOOTED = {**WALL, "footing": {"width": 0.3, "depth": 0.3}}
SIZE = 4e-3


def history(*ends: float, shape: str = "three_loads", mound: str = "mitchell", steps: int = 2) -> dict[str, object]:
    """Return tables of a movement through signed ends (doming positive)."""
    name = "surface_movement" if shape == "mound" else "central_deflection"
    stages = [{"kind": "doming" if e > 0 else "dishing", name: abs(e), "increments": steps} for e in ends]
    kind = "doming" if max(ends, key=abs) > 0 else "dishing"
    movement: dict[str, object] = {"shape": shape, "kind": kind, "stage": stages}
    if shape == "table":
        movement["table"] = [[0, 0], [0.3, 0.4], [0.5, 1], [1, 0.2]]
    largest = max(map(abs, ends))
    if shape == "mound":
        return {**FOOTED, "movement": movement, "mound": {"shape": mound, "surface_movement": largest}}
    base = FOOTED if shape == "jacks" else WALL
    return {**base, "movement": {**movement, "central_deflection": largest}}


def one_run(tables: dict[str, object], increments: int) -> dict[str, object]:
    movement = {k: v for k, v in tables["movement"].items() if k != "stage"}
    return {**tables, "movement": {**movement, "increments": increments}}


GROUNDS = [{"shape": shape} for shape in ("three_loads", "parabola", "arc", "table", "jacks")]
GROUNDS += [{"shape": "mound", "mound": form} for form in ("mitchell", "walsh")]


@pytest.mark.quick_cases
@pytest.mark.parametrize("method", ["quasi_static", "explicit"])
@pytest.mark.parametrize("ground", GROUNDS, ids=lambda g: "-".join(g.values()))
def test_a_growing_movement_cut_into_stages_is_the_one_run(ground: dict[str, str], method: str) -> None:
    sign = 1.0 if ground["shape"] == "jacks" else -1.0
    tables = history(*(sign * SIZE * share for share in (0.25, 0.5, 1.0)), **ground)
    for stage, count in zip(tables["movement"]["stage"], (1, 1, 2)):
        stage["increments"] = count
    tables["solver"] = {"method": method}
    cut, whole = (damagepred.solve(Scene.from_dict(t)) for t in (tables, one_run(tables, 4)))
    for name in ("block_displacement_x", "block_displacement_y", "contact_opening", "contact_slip"):
        np.testing.assert_allclose(cut[name], whole[name], rtol=0, atol=1e-9 * SIZE)


def energy_balance(path: xr.Dataset) -> None:
    """Check that dissipation never falls and that the balance closes, both but for the energy error stated."""
    error = path["energy_error"].values
    parts = [path[name].values for name in ("friction_work", "fracture_work", "released_energy")]
    for part in parts:
        assert (np.diff(part) >= -np.diff(error) - 1e-9).all()
    balance = path["external_work"].values - path["elastic_energy"].values - sum(parts)
    assert (np.abs(balance) <= error + 1e-9).all()


@pytest.mark.parametrize("ground", GROUNDS, ids=lambda g: "-".join(g.values()))
def test_there_and_back_makes_no_energy(ground: dict[str, str]) -> None:
    ends = (SIZE, 0.25 * SIZE, SIZE) if ground["shape"] == "jacks" else (-SIZE, 0.5 * SIZE, 0.0)
    path = damagepred.solve(Scene.from_dict(history(*ends, steps=4, **ground)))
    assert path.attrs["status"] == "complete"
    energy_balance(path)


def seasons_csv(folder: Path, text: str = "time,movement,increments\n0.5,-0.004,2\n1,0.002,2\n1.5,-0.004,2\n") -> Path:
    (folder / "seasons.csv").write_text(text)
    scene = '[wall]\nlength = 1.92\nheight = 0.6\n[dpc]\ncourse = 2\n[movement]\nhistory = "seasons.csv"\n'
    (folder / "wall.toml").write_text(scene)
    return folder / "wall.toml"


def test_a_history_comes_from_a_csv_file(tmp_path: Path) -> None:
    scene = Scene.from_toml(seasons_csv(tmp_path))
    assert [s.kind for s in scene.movement.stage] == ["dishing", "doming", "dishing"]
    assert scene.movement.central_deflection == 4e-3
    path = damagepred.solve(scene)
    assert path["time"].values.tolist() == [0, 0.25, 0.5, 0.75, 1, 1.25, 1.5]
    assert path["time"].attrs["units"] == "year"
    assert draw_history(path).get_xlabel().startswith("time (years)")
    (tmp_path / "again.toml").write_text(scene.to_toml())
    assert Scene.from_toml(tmp_path / "again.toml") == scene


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("year,movement\n1,2\n", "column 1: .year. is unknown; the columns may be time"),
        ("time,movement\n", "no rows of numbers"),
        ("time,movement\n1,much\n", "line 2, movement = 'much': is no finite number"),
        ("time,movement\n1,0.004\n0.5,0\n", "time must rise"),
    ],
)
def test_a_csv_file_that_is_no_history_is_refused(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        Scene.from_toml(seasons_csv(tmp_path, text))


@pytest.mark.parametrize(
    ("tables", "said"),
    [
        (
            {"movement": {"shape": "mound", "stage": [{"central_deflection": 1e-3}]}},
            "each stage has a surface_movement",
        ),
        (
            {
                "movement": {"shape": "mound", "stage": [{"surface_movement": 1e-3}]},
                "mound": {"surface_movement": 0.04},
            },
            "must be the largest of the stages",
        ),
        ({"movement": {"stage": [{"increments": 2}]}}, "each stage has a central_deflection"),
        (history(SIZE, -SIZE, shape="jacks"), "jacks push one way"),
        ({"movement": {"history": "a.csv"}}, "names a CSV file beside a scene file"),
        (
            {**history(SIZE, shape="jacks"), "rig": {"control": "load", "jack_load": 1e3}},
            "stages need rig.control = 'deflection'",
        ),
    ],
)
def test_stages_that_do_not_fit_are_refused(tables: dict[str, object], said: str) -> None:
    with pytest.raises(InputError, match=said):
        Scene.from_dict(tables)


@pytest.mark.parametrize(("shape", "size"), [("parabola", "central_deflection"), ("mound", "surface_movement")])
def test_the_largest_of_the_stages_is_the_movement_where_nothing_else_is_said(shape: str, size: str) -> None:
    stages = [{size: "3 mm", "kind": "doming"}, {size: 0.012}, {size: 0.0}]
    scene = Scene.from_dict({"movement": {"shape": shape, "stage": stages}})
    full = scene.movement.central_deflection if shape == "parabola" else scene.mound.surface_movement
    assert full == 0.012
    python = Scene(movement=Movement(shape=shape, stage=[Stage(**one) for one in stages]))
    assert python == scene
    with pytest.raises(InputError, match=r"\[\[movement.stage\]\] number 1, .* wrong kind of unit"):
        Scene.from_dict({"movement": {"shape": shape, "stage": [{size: "3 kg"}]}})


def test_a_sampled_movement_scales_the_whole_history() -> None:
    scene = Scene.from_dict(history(-SIZE, 0.5 * SIZE)).with_values({"movement.central_deflection": 6e-3})
    assert [s.central_deflection for s in scene.movement.stage] == [6e-3, pytest.approx(3e-3)]
    scene = Scene.from_dict(history(-SIZE, 0.0, shape="mound")).with_values({"mound.surface_movement": 7e-3})
    assert [s.surface_movement for s in scene.movement.stage] == [7e-3, 0.0]


def test_a_study_of_a_history_runs_resumes_and_replays(tmp_path: Path) -> None:
    tables = history(-SIZE, 0.5 * SIZE, -SIZE, steps=2)
    for number, stage in enumerate(tables["movement"]["stage"]):
        stage["time"] = 0.5 * (number + 1)
    variables = {
        "movement.central_deflection": {"distribution": "uniform", "lower": 2e-3, "upper": 6e-3},
        "joint.cohesion": {"distribution": "lognormal", "mean": 0.4e6, "cov": 0.3},
    }
    settings = {"samples": 6, "stop_at_category": "none"}
    study = Study(StudySettings.from_dict({"scene": tables, "study": settings, "variables": variables}))
    with ThreadPoolExecutor(1) as executor:
        for name, samples in (("a", 3), ("a", 6), ("b", 6)):
            study.run(tmp_path / name, samples=samples, executor=executor)
    first, second = (open_study(tmp_path / n) for n in ("a", "b"))
    for name in ("crack_width_max", "crack_width_worst", "central_deflection", "time", "stage"):
        np.testing.assert_array_equal(first[name], second[name])
    given = first["movement.central_deflection"].values
    np.testing.assert_allclose(first["central_deflection"].values[:, [2, 4]], given[:, None] * [1, 0.5])
    assert first["time"].values[0].tolist() == [0, 0.25, 0.5, 0.75, 1, 1.25, 1.5]
    wall, said = replay(tmp_path / "a", 4)
    assert "bit for bit" in said
    np.testing.assert_array_equal(wall["crack_width_max"], first["crack_width_max"][4])
    # the curve over time is the probability of the worst category so far, by year
    for intensity in ("time", "central_deflection"):
        assert fit_fragility(first, categories=[1], intensity=intensity).sizes["category"] == 1
    ax = draw_fragility(fit_fragility(first, categories=[1], intensity="time"))
    assert ax.get_xlabel() == "time (years)"


DRY = {"tensile_strength": 0.0, "cohesion": 0.0}


def stage(kind: str, deflection: float, increments: int) -> dict[str, object]:
    return {"kind": kind, "central_deflection": deflection, "increments": increments}


def solved(*stages: dict[str, object], **tables: object) -> xr.Dataset:
    movement = {"central_deflection": max(s["central_deflection"] for s in stages), "stage": list(stages)}
    return damagepred.solve(Scene.from_dict({**WALL, "movement": movement, **tables}))


def test_the_worst_width_stays_and_the_present_one_remains_after_the_cycle() -> None:
    path = solved(stage("dishing", 4e-3, 4), stage("dishing", 0.0, 4), joint=DRY)
    widths = path["crack_width_max"].values
    assert (path["crack_width_worst"].values == np.maximum.accumulate(widths)).all()
    ax = draw_history(path)
    assert ax.get_xlabel().startswith("increment")
    turns = [one.get_xdata()[0] for one in ax.lines if one.get_linestyle() == ":" and len(set(one.get_xdata())) == 1]
    assert turns == [4]


def test_the_worst_category_stays_and_is_judged_anew() -> None:
    movement = {"central_deflection": 8e-3, "stage": [stage("dishing", 8e-3, 4), stage("dishing", 0.0, 4)]}
    path = damagepred.solve(Scene.from_dict({"wall": WALL["wall"], "movement": movement}))
    category = path["damage_category"].values
    assert category.max() == 3
    assert category[-1] == 1
    assert (path["damage_category_worst"].values == np.maximum.accumulate(category)).all()
    assert path["damage_category_worst"].attrs["flag_meanings"] == path["damage_category"].attrs["flag_meanings"]
    finer = dataclasses.replace(load_table("as2870"), limits=(1e-5, 2e-5, 3e-5, 4e-5))
    judged = judge_again(path, table=finer)
    assert judged["damage_category_worst"].values[-1] == 4
    assert (judged["damage_category_worst"].values == np.maximum.accumulate(judged["damage_category"].values)).all()


def test_stages_of_time_alone_leave_the_ground_where_it_is() -> None:
    strain = {"movement": {"stage": [{"time": 1.0, "strain": 1e-4}, {"time": 2.0, "strain": 2e-4}]}}
    assert Scene.from_dict(strain).movement.central_deflection == 0.0
    with pytest.raises(InputError, match="nothing moves; give a movement, a strain or creep"):
        Scene.from_dict({"movement": {"stage": [{"time": 1.0}]}})


def test_a_number_of_increments_beside_stages_is_refused() -> None:
    movement = {"central_deflection": 4e-3, "stage": [stage("dishing", 4e-3, 2)]}
    with pytest.raises(InputError, match="stages of the movement have their own"):
        damagepred.solve(Scene.from_dict({**WALL, "movement": movement}), increments=3)
