"""Steps of analyses by hand: back-analysis, design search, portfolios and rare events, without solving a wall."""

import json
import math
import tomllib
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray as xr

from damagepred.analyses import mean_wall, posterior_dataset, stored_walls
from damagepred.analyses.design_search import Choice, Choices, Option, Target, _values_of_measures, damaged, loss
from damagepred.analyses.epistemic import alternatives
from damagepred.analyses.inference_options import InferenceOptions
from damagepred.analyses.limit_state import Margin, Question, study_for_limit_state
from damagepred.analyses.portfolio import _value, map_columns, portfolio_frame, write_portfolio
from damagepred.analyses.posterior_dataset import movement_cdf
from damagepred.analyses.posterior_states import chosen_samples
from damagepred.analyses.posterior_tables import odds_in_words, posterior_tables, reported
from damagepred.analyses.rare_event_samples import _digest, _logged, _read_log
from damagepred.analyses.stored_walls import Replayed, StoredWalls
from damagepred.analyses.variance_shares import _output_of, study_sensitivity
from damagepred.campaign.settings import StudySettings
from damagepred.errors import ArchiveWarning, InputError
from damagepred.scene.keys import merged
from damagepred.study import open_study
from damagepred.uq.movement_distribution import MovementDistribution
from damagepred.uq.observations import CrackObservation
from tests.conftest import SMALL_STUDY
from tests.synthetic_studies import synthetic_study
from tests.uq.test_fragility import fail, study


def three_walls() -> Any:
    """Movements to 4, 4 and 2 mm; the second is in category 2 from its second increment on and ends before the last."""
    movement = np.array([[0, 1, 2, 4], [0, 1, 2, np.nan], [0, 0.5, 1, 2]]) * 1e-3
    edges = np.array([[0, 0.5, 1.5, 3, 4], [0, 0.5, 1.5, 2, 2], [0, 0.25, 0.75, 1.5, 2]]) * 1e-3
    category = np.array([[0, 0, 1, 1], [0, 2, 2, -1], [0, 0, 0, 3]], dtype=np.int8)
    ds = xr.Dataset({"damage_category": (("sample", "increment"), category)})
    return SimpleNamespace(ds=ds, movement=movement, edges=edges, largest=4e-3, weight=np.array([0.5, 0.3, 0.2]))


def test_the_posterior_of_the_movement_is_uniform_between_edges() -> None:
    walls, weight = three_walls(), np.zeros((3, 4))
    weight[0, 2], weight[2, 3] = 0.6, 0.2
    found = movement_cdf(walls, weight, np.array([0.0, 1.5, 1.75, 3.0, 9.0]) * 1e-3)
    np.testing.assert_allclose(found, [0.0, 0.0, (0.6 * 0.25 / 1.5 + 0.2 * 0.5) / 0.8, 1.0, 1.0], atol=1e-12)
    assert movement_cdf(walls, np.zeros((3, 4)), np.ones(2)).tolist() == [0.0, 0.0]


def test_damage_after_further_movement_and_its_bounds() -> None:
    walls, weight = three_walls(), np.zeros((3, 4))
    weight[0, 1], weight[1, 1], weight[2, 2] = 0.5, 0.3, 0.2
    found = posterior_dataset._future(walls, weight, InferenceOptions(further=(0.0, 0.25)), 3)
    # now: at 1 mm in categories 0, 2 and 0; after 1 mm: 1 at 2 mm, 2 at the end of its path, 3 at 2 mm
    assert found["future_known"].values.tolist() == pytest.approx([1.0, 1.0])
    for end in ("", "_lower", "_upper"):
        assert found[f"future_probability{end}"].values.tolist() == [
            pytest.approx([0.3, 0.3, 0.0]),
            pytest.approx([1.0, 0.5, 0.2]),
        ]
    far = posterior_dataset._future(walls, weight, InferenceOptions(further=(0.5,)), 3)  # the first alone gets there
    assert float(far["future_known"][0]) == pytest.approx(0.5)
    assert far["future_probability"].values[0].tolist() == pytest.approx([1.0, 0.0, 0.0])
    assert far["future_probability_lower"].values[0].tolist() == pytest.approx([1.0, 0.5, 0.2])
    assert far["future_probability_upper"].values[0].tolist() == pytest.approx([1.0, 0.5, 0.5])
    nothing = posterior_dataset._future(walls, np.zeros((3, 4)), InferenceOptions(further=(0.0,)), 3)
    assert np.isnan(nothing["future_probability"]).all()
    assert nothing["future_known"].values.tolist() == [0.0]


def test_the_prior_of_the_movement() -> None:
    """Uniform to the end of each path, or the share of a distribution's points in each cell."""
    walls = three_walls()
    walls.path, walls.measure, walls.units = "a.dp", "central_deflection", "m"
    found = np.exp(StoredWalls.log_prior(walls, None))
    np.testing.assert_allclose(found[0], 0.5 * np.array([0.5, 1.0, 1.5, 1.0]) / 4)
    np.testing.assert_allclose(found[1], 0.3 * np.array([0.5, 1.0, 0.5, 0.0]) / 2)
    given = MovementDistribution("a", (0.4e-3, 1e-3, 1.2e-3, 3.5e-3))
    found = np.exp(StoredWalls.log_prior(walls, given))
    np.testing.assert_allclose(found[0], 0.5 * np.array([1, 2, 0, 1]) / 4)
    with pytest.raises(InputError, match=r"movement = b: 50% of it lies beyond 4 mm, the largest movement of a\.dp"):
        StoredWalls.log_prior(walls, MovementDistribution("b", (1e-3, 5e-3)))


def test_cracks_near_a_place_and_in_cells() -> None:
    """Pieces of three increments; the third increment has none, the fourth is not solved."""
    wall, dpc = stored_walls.PARTS["wall"][0], stored_walls.PARTS["dpc"][0]
    replayed = Replayed(
        np.array(3),
        np.array([0, 1, 1, 1, 1]),
        np.array([wall, wall, wall, wall, dpc]),
        np.array([0, 0, 1, 1, 0]),
        np.array([0.1, 0.1, 0.4, 1.1, 0.1]),
        np.array([0.1, 0.1, 0.5, 0.1, 0.1]),
        np.array([1e-3, 2e-3, 3e-3, 9e-3, 8e-3]),
        np.array([0.0, 1.0]),
        np.array([0.0, 0.0]),
        np.array([[0.0, 0.0], [1e-3, -2e-3], [2e-3, 5e-3]]),
    )
    near = CrackObservation(x=0.1, y=0.1, within=0.5, width=1e-3, direction=stored_walls.ORIENTATIONS[0])
    both = replayed.widest(near, 4)
    np.testing.assert_array_equal(both, [[1e-3, 3e-3, 0, np.nan], [1e-3, 2e-3, 0, np.nan]])  # 0.5 m away counts
    np.testing.assert_array_equal(replayed.widest(CrackObservation(part="dpc", none=True), 3)[0], [0, 8e-3, 0])
    rise = replayed.level((0.2, 0.1), (0.7, -0.1), 4)
    np.testing.assert_allclose(rise, [0, -3e-3, 3e-3, np.nan])
    walls = SimpleNamespace(replayed=lambda sample: replayed, left={None: 0.0})
    weight = np.array([[0.1, 0.2, 0.3], [0.0, 1e-9, 0.0]])
    found = StoredWalls.crack_map(walls, weight, 0.5, 1.5e-3, (2, 2), 1e-4, np.zeros((1, 2)))
    # 0.1, 0.1 twice in increment 1 counts once; 1.1 m lies beyond the last cell, 0.5 m in the upper row
    np.testing.assert_allclose(found, [[0.2, 0.2], [0.2, 0.0]])
    two = SimpleNamespace(
        first=np.array([0, 3, 5]), stores=[SimpleNamespace(read=lambda i, k=k: (k, i)) for k in (0, 1)]
    )
    assert [StoredWalls.replayed(two, i) for i in (0, 2, 3, 4)] == [(0, 0), (0, 2), (1, 0), (1, 1)]


def test_inclusion_probabilities_of_replays() -> None:
    weight = np.array([8.0, 1.0, 1.0, 0.0, 2.0, 4.0])
    drawn, chance = chosen_samples(weight, 3)
    # 8 is sure; of the others 2 by weight: 4 is sure, too; one of 1, 1, 2
    assert {0, 5} <= set(drawn.tolist())
    assert len(drawn) == 3
    by_sample = dict(zip(drawn.tolist(), chance.tolist()))
    assert all(by_sample[i] == pytest.approx({0: 1, 5: 1, 1: 0.25, 2: 0.25, 4: 0.5}[i]) for i in by_sample)
    assert chosen_samples(weight, 5)[0].tolist() == [0, 1, 2, 4, 5]


def test_tables_of_a_posterior() -> None:
    assert "; ".join(odds_in_words(v) for v in (np.nan, 100.0, 99.94, 0.01, 0.0101)) == (
        "–; more than 100 to 1; 99.9; less than 1 to 100; 0.0101"
    )
    each, state = "study", ("study", "further", "category")
    bounds = np.array([[[0.1, 0.0], [0.0, 0.3]], [[0.5, 0.5], [0.2, 0.2]]])
    ds = xr.Dataset(
        (
            {"movement_quantile": ((each, "quantile"), np.array([[1, 2, 3, 4, 5.0], [2, 3, 4, 5, 6.0]]) * 1e-3)}
            | {"movement_cut": (each, [0.06, 0.05]), "movement_largest": (each, [8e-3, 6e-3])}
            | {"movement_words": (each, ["central deflection"] * 2), "movement_units": (each, ["m"] * 2)}
            | {"cause_prior": (each, [0.5, 0.25]), "another_cause_prior": 0.25}
            | {"posterior_odds": (each, [3.0, np.nan]), "another_cause_odds": 0.25}
            | {"effective_samples": (each, [51.26, 4.0]), "resemblance": (each, [0.5, 0.0001])}
            | {"resembles": (each, [True, True])}
            | {"future_probability_lower": (state, bounds)}
            | {"future_probability_upper": (state, bounds + np.array([[0.0, 0.996], [0.2, 0.004]]))}
            | {"future_known": ((each, "further"), [[1.0, 0.5], [0.25, 0.0]]), "log_evidence": (each, [0.0, 0.0])}
        ),
        {each: ["clay", "tree"], "further": [0.0, 0.5], "category": [1, 2]},
        (
            {"discrepancy_points": 7, "discrepancy_width": 4e-4, "discrepancy_interval_width": "0.0002 to 0.0008"}
            | {"discrepancy_confidence_width": "derived", "discrepancy_width_share": 0.5}
            | {"discrepancy_interval_width_share": "-", "discrepancy_confidence_width_share": "given"}
        ),
    )
    causes, further, discrepancy = posterior_tables(ds)
    assert causes.columns[1] == "central deflection, 90 % interval (mm)"
    assert [list(row) for row in causes.rows] == [
        ["clay", "3 (1 to 5), cut at 8", "3", "1", "51.3", "0.50"],
        ["tree", "4 (2 to 6)", "–", "0.333", "4.0", "< 0.001"],
        ["another cause", "–", "0.25", "0.333", "–", "–"],
    ]
    assert further.columns == ["study", "further (mm)", "P(>= 1)", "P(>= 2)", "known"]
    assert [list(row) for row in further.rows] == [
        ["clay", "0", "0.10", "unknown", "100%"],
        ["clay", "4", "0.00 to 0.20", "0.30", "50%"],
        ["tree", "0", "0.50", "unknown", "25%"],
        ["tree", "3", "0.20 to 0.40", "0.20", "0%"],
    ]
    assert discrepancy.caption.endswith("integrated over terms with an interval")
    assert discrepancy.rows == [["width", "0.4 mm", "0.2 to 0.8 mm", "derived"], ["width share", "50 %", "-", "given"]]
    other = posterior_tables(ds.assign(movement_units=(each, ["m", "1"])).assign_attrs(discrepancy_points=1))
    assert other[0].rows[1][1] == "0.004 (0.002 to 0.006) 1 central deflection"
    assert (other[1].columns[1], other[1].rows[1][1], other[1].rows[3][1]) == ("further", "4 mm", "0.003 1")
    assert other[2].caption == "Model discrepancy"
    kept = reported(ds)
    assert kept["cause_posterior"].values[0] == 0.75
    assert float(kept["another_cause_posterior"]) == 0.2
    assert "log_evidence" not in kept


def test_losses_of_walls_and_values_of_measures() -> None:
    """Repair costs are of the worst category reached; a wall that failed before the movement counts at a bound."""
    ds = study(np.array([[1.5, 3.5], [2.5, 9.0], [9.0, 9.0], [9.0, 9.0]]), end=4.0, increments=4, highest_category=2)
    fail(ds, 3, 2)
    ds["central_deflection"].attrs["units"] = "1"
    for unfollowed in (0.0, 1.0):
        assert damaged(ds, 1, "3", unfollowed).tolist() == [1, 1, 0, unfollowed]
        costs = loss(ds, Target(at="4", repair_costs=(10.0, 25.0)), unfollowed)
        assert costs.tolist() == [25.0, 10.0, 0.0, 25.0 * unfollowed]
    assert loss(ds, Target(at="2.25", category=1, probability=0.1)).tolist() == [1.0, 0.25, 0.0, 1.0]
    assert damaged(ds.isel(sample=[1, 1]), 1, "2.5").tolist() == [0.5, 0.5]  # halfway between two increments
    with pytest.raises(InputError, match=r"target\.at = 5: no sample has a result there"):
        damaged(
            study(np.full(2, 9.0), end=4, increments=4).assign(central_deflection=ds["central_deflection"][:2]), 1, "5"
        )
    a, b, c, d = (Option(name=name, cost=cost) for name, cost in (("a", 1.0), ("b", 5.0), ("c", 2.0), ("d", 2.5)))
    choice = (Choice(name="footing", option=(a, b)), Choice(name="joint", option=(c, d)))
    target = Target(at="1", category=1, probability=0.1)
    assert str(target) == "P(category >= 1 at 1) <= 0.1"
    assert str(Target(at="4", repair_costs=(10.0,))) == "expected cost with repairs at 4"
    content = Choices(study="s.toml", target=target, choice=choice)
    built = [(a, c), (a, d), (b, c), (b, d)]
    values = {0: np.array([4.0, 6.0, 5.0]), 1: np.array([1.0, 2.0]), 2: np.array([3.0, 3.0, 1.0]), 3: np.zeros(3)}
    (footing, joint) = _values_of_measures(content, built, values)
    pairs = np.array([[-1.0, -3.0], [-1.0, -2.0]]).mean(axis=0)  # b less a: with c, and with d, of two samples each
    assert footing == ("footing: b", pairs.mean(), pytest.approx(pairs.std(ddof=1) / math.sqrt(2)), 4.0)
    assert (joint[0], joint[3]) == ("joint: d", 0.5)
    unknown = _values_of_measures(content, built, {0: np.ones(3)})
    assert np.isnan([measure[1] for measure in unknown]).all()


def test_cells_and_keys_of_a_table_of_houses(tmp_path: Path) -> None:
    table = SimpleNamespace(units=["", "mm"], decimal=",")
    cells = {"1,5": 1.5, "-2": -2.0, ".5e1": 5.0, "dishing": "dishing", "true": True, "[1, 2]": [1, 2]}
    assert {cell: _value(table, 0, cell) for cell in cells} == cells
    assert _value(table, 1, "1,5") == "1.5 mm"
    assert _value(SimpleNamespace(units=[""], decimal="."), 0, "{ a = 1 }") == {"a": 1}
    tables: dict[str, Any] = {"opening": [{"x": 1.0}, {"x": 2.0}], "wall": {"length": 1.0}}
    for key, value in {"opening.2.x": 3.0, "footing.depth": 0.5, "wall.length": 2.0}.items():
        tables = merged(tables, {key: value})
    assert tables == {"opening": [{"x": 1.0}, {"x": 3.0}], "wall": {"length": 2.0}, "footing": {"depth": 0.5}}
    for step in ("0", "3", "a"):
        with pytest.raises(InputError, match=rf"opening\.{step}: there is no such opening; the study has 1, 2\."):
            merged(tables, {f"opening.{step}.x": 1.0})
    with pytest.raises(InputError, match=r"soil_layer: the study has none; give one there first"):
        merged(tables, {"soil_layer.1.thickness": 1.0})
    two = ("house", "category")
    street = xr.Dataset(
        {f"probability{end}": (two, np.array([[0.5, 0.25]]) + k) for k, end in enumerate(("", "_lower", "_upper"))}
        | {"at": ("house", ["25 mm"]), "walls": ("house", [8]), "failed": ("house", [1]), "easting": ("house", [7.0])},
        {"house": ["12 Elm"], "category": [1, 2]},
    )
    write_portfolio(street, tmp_path / "a.csv")
    assert (tmp_path / "a.csv").read_text().splitlines() == [
        "name,at,walls,failed,easting,p_category_1,p_category_1_lower,p_category_1_upper,p_category_2,"
        "p_category_2_lower,p_category_2_upper",
        "12 Elm,25 mm,8,1,7.0,0.5,1.5,2.5,0.25,1.25,2.25",
    ]
    assert len(portfolio_frame(street)) == 1
    for names, crs, words in (
        (["longitude", "northing"], None, "needs columns longitude and latitude"),
        (["easting", "northing"], None, "--crs EPSG:28354"),
    ):
        with pytest.raises(InputError, match=words):
            map_columns(names, tmp_path / "a.gpkg", crs)


def test_a_log_of_walls_without_damaged_lines(tmp_path: Path) -> None:
    """Lines of this question, of another, of an older version without digest, and an unfinished one."""
    file = tmp_path / "walls.jsonl"
    entries = [[0, 0.25, 1.5, "", 0.25], [1, None, 2.0, "Error: a", -0.5]]
    lines = [json.dumps([*entry, _digest(entry, "asked")]) for entry in entries]
    other = json.dumps([*entries[0], _digest(entries[0], "another")])
    file.write_text("\n".join([*lines, json.dumps([7, 0.5, 1.0, ""]), other, "[1, 2", '[8, 0.5, 1.0, "", 0.5, "c']))
    with pytest.warns(ArchiveWarning, match=r"walls\.jsonl: 2 lines were damaged or of another question"):
        found = _read_log(file, "asked")
    assert found == {0: Margin(0.25, 0.25), 1: Margin(-0.5, np.inf, "Error: a"), 7: Margin(0.5, 0.5)}
    assert file.read_text().splitlines() == [*lines, '[7, 0.5, 1.0, ""]']
    assert _read_log(file, "asked") == found
    assert _read_log(tmp_path / "none", "asked") == {}
    assert _logged(3, None, 1.0, "why") == (3, Margin(-1.0, np.inf, "why"))


def test_the_study_of_a_limit_state_has_no_movement_of_its_own() -> None:
    text = SMALL_STUDY.replace(
        "[correlation]\n", '[correlation]\n"joint.friction" = { "movement.central_deflection" = 0.2 }\n'
    ).replace("seed = 7", 'seed = 7\nreplicates = 2\nmovement = "both"')
    settings = StudySettings.from_dict(tomllib.loads(text))
    asked = study_for_limit_state(settings, Question(3, 4e-3, reach=1.0))
    assert asked.correlation == {"joint.tensile_strength": {"joint.cohesion": 0.7}}
    how = asked.study
    assert (how.sampler, how.replicates, how.movement, how.stop_at_category) == ("random", 1, "path", 3)
    assert (asked.scene.movement.central_deflection, asked.scene.movement.increments) == (4e-3, 6)
    for wrong, words in (({"category": 0}, "from 1 to 4"), ({"at": 0}, "greater than 0"), ({"reach": 0.9}, "or more")):
        with pytest.raises(InputError, match=words):
            Question(**{"category": 1, "at": 1.0} | wrong).check(settings)
    Question(4, 1e-9, 1.0).check(settings)


def test_outputs_of_a_sensitivity() -> None:
    ds = study(np.array([[2.5, 9.0], [3.5, 9.0], [9.0, 9.0], [1.5, 9.0]]), end=np.array([4, 5, 6, 3.0]), increments=12)
    fail(ds, 3, 3)
    ds = ds.assign(weight=("sample", [1.0, 1.0, 2.0, 4.0]), highest_category=0).drop_vars("highest_category")
    own = _output_of(ds, category=1, own_ground=True)
    assert (own.value.tolist(), own.sample.tolist(), own.censored) == ([1, 1, 0], [0, 1, 2], 0.0)
    assert own.name == "damage of category 1 at each sample's own movement"
    ranks = _output_of(ds, category=1)
    assert (ranks.sample.tolist(), ranks.censored) == ([0, 1, 2, 3], 0.75)
    assert ranks.value.shape == (2, 4)
    many = study(np.linspace(1.5, 6.5, 12), end=8.0, increments=80).assign(
        {"joint.friction": ("sample", np.arange(12.0), {"role": "input"}), "y": ("sample", np.arange(12.0) ** 2)}
    )
    found = study_sensitivity(many, output="y", resamples=0)
    assert found["variable"].values.tolist() == ["joint.friction"]
    assert float(found["spearman"][0]) == pytest.approx(1.0)
    attrs = {k: found.attrs[k] for k in ("title", "output", "share_censored", "samples_failed", "bootstrap_samples")}
    assert list(attrs.values()) == ["sensitivity of made up", "y at the end of the movement", 0.0, 0, 0]


def test_alternatives_and_the_mean_wall_of_a_study(tmp_path: Path) -> None:
    """A study of 24 synthetic walls, of which half and more reach category 1 by 3 mm."""
    folder = synthetic_study(tmp_path / "house.dp", 24, own_movements=False)
    own, rarer = alternatives(folder, 1, 3e-3, others={"other": {"joint.friction": {"mean": 0.6}}})
    ds = open_study(folder)
    friction = ds["joint.friction"].values
    s = math.sqrt(math.log1p(0.15**2))
    ratio = np.exp(((np.log(friction / 0.75) + s**2 / 2) ** 2 - (np.log(friction / 0.6) + s**2 / 2) ** 2) / (2 * s**2))
    assert (own.name, own.effective_samples, rarer.name) == ("", 24.0, "other")
    assert rarer.effective_samples == pytest.approx(ratio.sum() ** 2 / (ratio**2).sum())
    hit = ds["damage_category"].values[:, 3] >= 1  # of 1 mm steps
    assert rarer.found.estimate.value == pytest.approx((ratio * hit).mean())
    settings = StudySettings.from_dict(tomllib.loads(SMALL_STUDY))
    wall = ds.isel(sample=0).copy(deep=True)
    wall["damage_category"].values[:] = [0, 0, 1, 1, 1, 1, 1]
    said = mean_wall.beyond_mean_wall(wall, settings, tmp_path / "house.toml")
    share = float((ds["damage_category"].values[:, -1] >= 2).mean())
    assert said.startswith("the mean wall is no worse than category 1 very slight; of 24 sampled walls in house.dp, a ")
    assert f"share of {share:.2f} (90% interval " in said
    assert said.endswith("reaches category 2 slight or worse by 6 mm of central deflection")
    wall["damage_category"].values[-1] = 4
    said = mean_wall.beyond_mean_wall(wall, settings, tmp_path / "house.toml")
    assert said == "the mean wall has the highest category; no sampled wall can exceed it"
    said = mean_wall.beyond_mean_wall(wall, settings, tmp_path / "other.toml")
    assert said == "one wall without scatter; sampled walls may be worse: run `damagepred study other.toml`"
