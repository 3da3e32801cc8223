"""Back-analysis: movement and cause from what is observed on a wall, with replays kept beside the archive."""

import math
import tomllib
from pathlib import Path
from shutil import copytree
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy import special, stats

from damagepred import InputError, Scene, Study, infer
from damagepred.analyses.back_analysis import prices
from damagepred.analyses.inference_options import InferenceOptions
from damagepred.analyses.posterior_tables import measures, posterior_tables
from damagepred.analyses.stored_walls import StoredWalls, require_on
from damagepred.campaign.settings import StudySettings
from damagepred.plotting import draw_back_analysis
from damagepred.report.back_analysis import posterior_cautions
from damagepred.scene.described import build
from damagepred.uq import observations as observing
from damagepred.uq.discrepancy import Discrepancy, stacked
from damagepred.uq.history import PRESENT
from damagepred.uq.observations import CrackObservation, LevelObservation, Observations, SlopeObservation
from damagepred.uq.survey_likelihood import CrackPrediction, measured, series_fit, vague_log_likelihood
from tests.conftest import SMALL_STUDY

FIXED = SMALL_STUDY.partition('[variables."movement')[0] + '[scene.solver]\nblocks = "rigid"\n'


@pytest.fixture(scope="module")
def causes(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    place = tmp_path_factory.mktemp("causes")
    for kind in ("dishing", "doming"):
        text = FIXED.replace('kind = "doming"', f'kind = "{kind}"').replace("stop_at_category = 4", "")
        Study(StudySettings.from_dict(tomllib.loads(text))).run(place / f"{kind}.dp", samples=16)
    return [place / "dishing.dp", place / "doming.dp"]


def test_the_movement_is_named_after_its_cause(tmp_path: Path) -> None:
    tables = tomllib.loads(FIXED.replace("stop_at_category = 4", ""))
    tables["scene"]["movement"] = {"shape": "mound", "kind": "settle", "increments": 2}
    tables["scene"]["mound"] = {"shape": "tree", "surface_movement": 0.02, "reach": 2.0}
    Study(StudySettings.from_dict(tables)).run(tmp_path / "tree.dp", samples=4)
    level = LevelObservation(x=0.1, y=0.4, to_x=1.3, to_y=0.4, difference=0.0)
    found = infer(tmp_path / "tree.dp", Observations(level=(level,)))
    assert found["movement_words"].values.tolist() == ["ground movement at the tree"]
    assert measures(found)[0] == ("ground movement at the tree", "mm", 1e3)
    assert measures(found.drop_vars("movement_words"))[0].words == "surface movement"  # files of older versions


def among(found: xr.Dataset) -> dict[str, float]:
    """Posterior probability of each study, given that the cause is one of the studies'."""
    whole = found["posterior"].sum("increment").values
    return dict(zip(found["study"].values, np.bincount(found["study_of_sample"].values, whole, found.sizes["study"])))


@pytest.mark.thorough
def test_local_cracks_tell_the_cause_and_the_movement(causes: list[Path]) -> None:
    from damagepred.campaign.replay import replay
    from damagepred.results.wall_cracks import cracks

    wall, _ = replay(causes[1], 3)
    found = cracks(wall).isel(increment=4)
    widest = int(np.nanargmax(found["crack_width"].values))
    x, y, width = (float(found[f"crack_{name}"][widest]) for name in ("x", "y", "width"))
    seen = Observations(
        crack=(
            CrackObservation(x=x, y=y, within=0.2, width=width),
            CrackObservation(x=0.72, y=0.1, within=0.15, none=True),
        ),
        discrepancy=Discrepancy(width_share=0.3),
    )
    done: list[tuple[int, int]] = []
    first = infer(causes, seen, on_replay=lambda *counted: done.append(counted))
    assert float(first["posterior"].sum()) == pytest.approx(1.0)
    assert among(first)["doming"] > 0.9
    low, high = (float(first["movement_quantile"].sel(study="doming", quantile=q)) for q in (0.05, 0.95))
    assert low <= float(wall["central_deflection"][4]) <= high
    assert done == 2 * [(number, 16) for number in range(1, 17)]
    done.clear()
    again = infer(causes, seen, on_replay=lambda *counted: done.append(counted))
    assert not done  # replays were kept
    assert first.identical(again)
    worse = first["future_probability"].sel(study="doming")
    assert (np.diff(worse.sel(category=1).dropna("further").values) >= -0.05).all()
    lower, upper = (first[f"future_probability_{end}"] for end in ("lower", "upper"))
    assert (lower.diff("further") >= -1e-12).all()  # what is not followed is not left out
    assert (upper.diff("further") >= -1e-12).all()
    assert (lower <= first["future_probability"] + 1e-12).isel(further=0).all()
    unknown = 1.0 - first["future_known"]
    assert (upper - lower <= unknown + 1e-9).all()
    assert float((upper - lower).max()) > 0.1
    assert "crack_probability" in first
    with pytest.raises(InputError, match="prior_odds: 'domin': is not a study"):
        infer(causes, Observations(crack=seen.crack, prior_odds={"domin": 2.0}))


def test_prior_odds_multiply_the_posterior_odds(causes: list[Path]) -> None:
    tilt = (SlopeObservation(value=0.001),)
    even = infer(causes, Observations(tilt=tilt))["cause_posterior"].values
    odds = infer(causes, Observations(tilt=tilt, prior_odds={"doming": 4.0}))["cause_posterior"].values
    assert odds[1] / odds[0] == pytest.approx(4.0 * even[1] / even[0])


def test_levels_are_read_from_replays(causes: list[Path]) -> None:
    middle, end = {"x": 0.72, "y": 0.04}, {"to_x": 0.1, "to_y": 0.04}
    for name, difference in (("doming", -4e-3), ("dishing", 4e-3)):
        found = infer(causes, Observations(level=(LevelObservation(**middle, **end, difference=difference),)))
        assert among(found)[name] > 0.8


@pytest.mark.parametrize(("odds", "named"), [(1.0, False), (1.5, True)])
def test_another_cause_is_named_where_it_is_more_probable_than_all_studies(odds: float, named: bool) -> None:
    cause = {"resembles": [True], "effective_samples": [99.0], "advice": [""], "another_cause_odds": odds}
    posterior = xr.Dataset({k: ("study", v) if isinstance(v, list) else v for k, v in cause.items()}, {"study": ["a"]})
    limits = {"least_resemblance": 0.05, "fewest_effective": 50.0}
    assert bool(posterior_cautions(posterior.assign_attrs(limits))) == named


def test_few_effective_samples_have_no_odds(causes: list[Path]) -> None:
    """16 walls per study cannot be 50 effective ones; with a smaller limit the same posterior has odds."""
    tilt = Observations(tilt=(SlopeObservation(value=0.001),))
    few = infer(causes, tilt)
    assert (few["effective_samples"] < 50).all()
    assert [row[2] for row in posterior_tables(few)[0].rows] == ["–"] * 3
    assert "effective samples, fewer than 50, so it has no odds" in posterior_cautions(few)[0]
    known = infer(causes, tilt, options=InferenceOptions(fewest_effective=2.0))
    shares = [*known["cause_posterior"].values, float(known["another_cause_posterior"])]
    assert sum(shares) == pytest.approx(1.0)
    assert 0.02 < shares[2] < 0.98
    assert float(known["another_cause_odds"]) == pytest.approx(shares[2] / (1.0 - shares[2]))
    assert known["posterior_odds"].values == pytest.approx([p / (1.0 - p) for p in shares[:2]])
    # the mean likelihood of a study, and the vague one of any other cause, by Bayes' theorem with even priors
    evidence = np.exp([*known["log_evidence"].values, vague_log_likelihood(tilt)])
    assert shares == pytest.approx((evidence / evidence.sum()).tolist())
    sure = Observations(tilt=tilt.tilt, prior_odds={"doming": 1e6})
    odds = infer(causes, sure, options=InferenceOptions(fewest_effective=2.0))
    assert [row[2] for row in posterior_tables(odds)[0].rows] == [
        "less than 1 to 100",
        "more than 100 to 1",
        "less than 1 to 100",
    ]


def test_paths_that_end_at_the_present_movement_are_named_with_the_movement_to_run_to(causes: list[Path]) -> None:
    """Walls as tilted as the most tilted stored ones: the end of the paths, 6 mm, cuts the interval."""
    tilt = float(StoredWalls(causes[1]).ds["tilt_max"].values[:, -1].max()) + 1e-3
    found = infer(causes[1], Observations(tilt=(SlopeObservation(value=tilt, error=1e-5),)))
    at_end = found["posterior"].values[:, -1].sum()  # all paths go to 6 mm
    assert float(found["movement_cut"][0]) == pytest.approx(at_end)
    assert at_end > 0.3
    said = posterior_cautions(found)[-1]
    assert "lies at the end of the paths, which cut the movement's interval there; damage beyond is unknown" in said
    upper = float(found["movement_quantile"][0, -1])
    target = float(f"{upper + 3e-3:.2g}")  # by half of the study's 6 mm
    assert (
        f"run samples to {1e3 * target:.3g} mm: sed -e 's/^central_deflection = .*/central_deflection = {target:g}/'"
        in said
    )
    causes_, further, _ = posterior_tables(found)
    assert causes_.rows[0][1].endswith("cut at 6")
    assert "unknown" in further.rows[-1]
    (alien,) = posterior_tables(found.assign(resembles=found["resembles"] & False))  # the movement is the prior's
    assert alien.rows[0][1] == "–"


def test_an_observation_that_no_wall_resembles_is_named(causes: list[Path]) -> None:
    """A crack of 30 mm beside a tilt that walls have; the misfits of all observations add up to the least one."""
    tilt = float(StoredWalls(causes[1]).ds["tilt_max"].values[0, -1])
    cracks = CrackObservation(wider_than=1e-6), CrackObservation(width=0.03)
    found = infer(causes[1], Observations(crack=cracks, tilt=(SlopeObservation(value=tilt),)))
    misfit = found["misfit_of_observation"][0]
    assert list(misfit["observation"].values) == ["crack 1", "crack 2", "tilt 1"]
    assert float(misfit.sum()) == pytest.approx(float(found["least_misfit"][0]))
    assert float(misfit[1]) > 0.9 * float(misfit.sum())
    assert (
        f"The nearest state misses crack 2 most: {float(misfit[1]):.3g} of the misfit." in posterior_cautions(found)[0]
    )


def test_densities_of_another_cause_and_of_measurements_add_up_to_one() -> None:
    def chance(**what: Any) -> float:
        return float(np.exp(vague_log_likelihood(Observations(**what))))

    limits = [{"narrower_than": 1e-3}, {"wider_than": 1e-3, "narrower_than": 5e-3}, {"wider_than": 5e-3}]
    assert sum(chance(crack=(CrackObservation(**one),)) for one in limits) == pytest.approx(1.0)
    assert chance(crack=(CrackObservation(none=True),)) == pytest.approx(0.5 + 0.5 * 0.0515, abs=1e-3)
    width = np.geomspace(1e-7, 0.3, 4000)  # wider ones are refused
    density = [chance(crack=(CrackObservation(width=w),)) for w in width]
    assert np.trapezoid(density, width) == pytest.approx(1.0, abs=2e-3)
    value = np.linspace(0.0, 0.2, 4001)
    density = [chance(tilt=(SlopeObservation(value=v),)) for v in value]
    assert np.trapezoid(density, value) == pytest.approx(1.0, abs=1e-3)
    point = {"x": 0.0, "y": 0.0, "to_x": 3.0, "to_y": 0.0}
    value = np.linspace(-0.2, 0.2, 4001)
    density = [chance(level=(LevelObservation(**point, difference=v),)) for v in value]
    assert np.trapezoid(density, value) == pytest.approx(1.0, abs=1e-6)
    assert np.sqrt(np.trapezoid(density * value**2, value)) == pytest.approx(np.sqrt(0.02**2 + 2e-6), rel=1e-3)
    density = np.exp(measured(np.zeros(1), value, 0.01).log_likelihood)
    assert np.trapezoid(density, value) == pytest.approx(1.0)


@pytest.mark.thorough
def test_a_window_that_has_closed_tells_the_movement(tmp_path: Path) -> None:
    text = FIXED.replace("stop_at_category = 4", "").replace(
        "[scene]", "[scene]\nopening = [{ x = 0.48, y = 0.15, width = 0.48, height = 0.3 }]"
    )
    Study(StudySettings.from_dict(tomllib.loads(text))).run(tmp_path / "window.dp", samples=6)
    walls = StoredWalls(tmp_path / "window.dp")
    change = walls.ds["opening_width_change"].values[2, :, 0]
    seen = Observations(window=(observing.WindowObservation(opening=1, width_change=change[4], error="0.05 mm"),))
    model = seen.discrepancy
    fit = walls.fit(seen, PRESENT, model, np.arange(6), replayed=False)
    assert fit.misfit[2, 4] == 0.0
    expected = (change[5] - change[4]) ** 2 / (5e-5**2 + (model.distortion_share * change[5]) ** 2)
    assert fit.misfit[2, 5] == pytest.approx(expected)
    found = infer(tmp_path / "window.dp", seen)
    low, high = (float(found["movement_quantile"].sel(quantile=q)[0]) for q in (0.05, 0.95))
    assert low < walls.movement[2, 4] < high
    assert high - low < 0.9 * walls.largest  # the prior's interval


def test_the_likelihood_is_integrated_over_the_fitted_discrepancy(causes: list[Path]) -> None:
    """The evidence is the mean over discrepancies drawn from the fit; the observations of a survey share one."""
    crack = (*(CrackObservation(width=width) for width in (2e-3, 2.1e-3, 1.9e-3)), CrackObservation(wider_than="1 mm"))
    walls = StoredWalls(causes[1])

    def evidence(model: Discrepancy) -> float:
        alone = Observations(crack=crack, discrepancy=model)
        certain = infer(causes[1], alone, options=InferenceOptions(discrepancy_points=1))
        return float(certain["log_evidence"][0])

    random, log_prior = np.random.default_rng(5), walls.log_prior(None)
    drawn = [Discrepancy().at(normal) for normal in random.standard_normal((2000, 2))]
    fit = walls.fit(Observations(crack=crack), PRESENT, stacked(drawn), np.arange(len(log_prior)), replayed=False)
    expected = special.logsumexp(log_prior[..., None] + fit.log_likelihood) - np.log(len(drawn))
    found = infer(causes[1], Observations(crack=crack))
    assert float(found["log_evidence"][0]) == pytest.approx(expected, abs=0.05)
    assert abs(evidence(Discrepancy()) - expected) > 0.2
    # what the user gives is certain
    given = Discrepancy(width="0.3 mm", width_share=0.4)
    surely = float(infer(causes[1], Observations(crack=crack, discrepancy=given))["log_evidence"][0])
    assert surely == pytest.approx(evidence(given))


@pytest.mark.parametrize(("points", "least", "most"), [(1, 0.75, 0.85), (7, 0.87, 0.93)])
def test_intervals_hold_where_the_discrepancy_is_integrated(points: int, least: float, most: float) -> None:
    """Of surveys of four cracks, whose discrepancy is drawn from the fit; with certain medians intervals hold less."""
    random, nodes = np.random.default_rng(3), Discrepancy().nodes(points)
    movement = np.linspace(0.0, 10e-3, 201)
    held = []
    for _ in range(400):
        true, model, cracks = random.integers(201), Discrepancy().at(random.standard_normal(2)), []
        for width in (slope * movement for slope in (0.1, 0.2, 0.35, 0.5)):
            deviation = np.sqrt(2e-4**2 + model.width**2 + (model.width_share * width[true]) ** 2)
            value = width[true] + deviation * random.standard_normal()
            seen = {"width": value} if value > 3e-4 else {"none": True, "visible": 3e-4}
            cracks.append((CrackObservation(**seen), CrackPrediction(width, width)))
        logs = [
            np.log(w) + sum(series_fit(*([each] for each in crack), one).log_likelihood for crack in cracks)
            for w, one in nodes
        ]
        posterior = special.softmax(special.logsumexp(logs, axis=0))
        held.append(0.05 < posterior[:true].sum() + 0.5 * posterior[true] < 0.95)
    assert least < np.mean(held) < most


@pytest.fixture(scope="module")
def growth(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a study of walls on still ground whose bricks shrink."""
    movement = "central_deflection = 0.0\nstage = [{ central_deflection = 0.0, strain = -1e-3, increments = 5 }]\n"
    tables = tomllib.loads(FIXED.replace("stop_at_category = 4", ""))
    tables["scene"]["movement"] = tomllib.loads(movement)
    place = tmp_path_factory.mktemp("growth") / "growth.dp"
    Study(StudySettings.from_dict(tables)).run(place, samples=12)
    return place


@pytest.mark.thorough
def test_studies_of_other_measures_are_compared(causes: list[Path], growth: Path) -> None:
    walls = StoredWalls(growth)
    assert (walls.measure, walls.units) == ("strain", "1")
    assert walls.movement[0] == pytest.approx(np.linspace(0.0, 1e-3, 6))
    middle, end = {"x": 0.72, "y": 0.04}, {"to_x": 0.1, "to_y": 0.04}
    level = (LevelObservation(**middle, **end, difference="-4 mm"), LevelObservation(**middle, **end, difference=-4e-3))
    found = infer([causes[1], growth], Observations(level=level))
    assert among(found)["doming"] > 0.9
    still = infer([causes[1], growth], Observations(level=(LevelObservation(**middle, **end, difference=0.0),)))
    assert among(still)["growth"] > 0.5
    assert still["movement_measure"].values.tolist() == ["central_deflection", "strain"]
    assert 0 < float(still["movement_quantile"].sel(study="growth", quantile=0.5)) < 1e-3
    rows, further, _ = posterior_tables(still)
    assert "mm/m strain" in rows.rows[1][1]
    assert further.rows[-1][1] == "0.5 mm/m"
    alone = posterior_tables(infer(growth, Observations(crack=(CrackObservation(width="1 mm"),))))
    assert alone[0].columns[1] == "strain, 90 % interval (mm/m)"
    (movement, _) = draw_back_analysis(still)
    assert movement.get_xlabel() == "movement over the largest of the study"
    with pytest.raises(InputError, match="movement = 5 mm: is the prior of one measure, but the studies have central"):
        infer([causes[1], growth], Observations(level=level, movement="5 mm"))


def test_a_movement_that_falls_is_refused(tmp_path: Path) -> None:
    tables = tomllib.loads(FIXED.replace("stop_at_category = 4", ""))
    stages = [{"central_deflection": size, "increments": 2} for size in (2e-3, 1e-3)]
    tables["scene"]["movement"] = {"central_deflection": 2e-3, "stage": stages}
    Study(StudySettings.from_dict(tables)).run(tmp_path / "back.dp", samples=2)
    with pytest.raises(InputError, match="infer needs an increasing movement; its central_deflection also decreases"):
        infer(tmp_path / "back.dp", Observations(tilt=(SlopeObservation(value=0.001),)))


@pytest.mark.thorough
def test_the_price_counts_the_replays_that_are_missing(causes: list[Path], tmp_path: Path) -> None:
    survey, options = tmp_path / "survey.toml", InferenceOptions(replays=10)
    survey.write_text('[[crack]]\nwidth = "2 mm"\n')
    assert prices(causes, survey, options, 1) == []  # the archive answers
    both = [copytree(path, tmp_path / path.name) for path in causes]
    survey.write_text('[[crack]]\nx = "0.7 m"\ny = "0.1 m"\nwidth = "2 mm"\n')
    (price,) = prices(both, survey, options, 1)
    assert "20 samples, about" in price
    infer(both[0], survey, options=options)
    (price,) = prices(both, survey, options, 1)
    assert "10 samples, about" in price
    assert len(prices(both, survey, InferenceOptions(replays=10, new_walls=5), 1)) == 2


def test_a_study_without_a_solved_wall_is_answered_by_a_sentence(causes: list[Path], tmp_path: Path) -> None:
    empty, survey = copytree(causes[0], tmp_path / "empty.dp"), tmp_path / "survey.toml"
    for results in (empty / "results.nc", *(empty / "parts").iterdir()):
        results.unlink()
    survey.write_text('[[crack]]\nx = "0.7 m"\ny = "0.1 m"\nwidth = "2 mm"\n')
    with pytest.raises(InputError, match="no finished sample yet"):
        prices([empty], survey, InferenceOptions(), 1)


def test_surveys_that_fit_the_wall_and_themselves_are_taken(tmp_path: Path) -> None:
    """A crack on a jamb, one around a sound place, repeated measurements, a loop of levels that closes."""
    crack = [{"x": 0.4, "y": 0.3, "none": True, "within": 0.1}, {"x": 0.4, "y": 0.3, "width": 2e-3, "within": 0.5}]
    crack += [{"x": 0.48, "y": 0.2, "width": 2.3e-3}, {"width": 2e-3}, {"width": "2.4 mm"}]
    point = {"a": (0.1, 0.0), "b": (0.7, -0.1), "c": (1.3, 0.0)}
    loop = [("a", "b", 4e-3), ("c", "b", -4e-3), ("a", "c", 8.5e-3)]
    level = [dict(zip(("x", "y", "to_x", "to_y"), point[i] + point[j]), difference=d) for i, j, d in loop]
    window = [{"opening": 1, "sticks": True}, {"opening": 1, "width_change": "1 mm"}]
    seen = build(Observations, {"crack": crack, "level": level, "window": window}, "survey")
    hole = {"x": 0.48, "y": 0.15, "width": 0.48, "height": 0.3}
    scene = {"wall": {"length": 1.44, "height": 0.45}, "opening": [hole], "movement": {"shape": "mound"}}
    require_on(seen, Scene.from_dict(scene), "house.dp")


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "observations: there are none; give a"),
        ("[[crack]]\nx = 1.0\nwidth = 1e-3", "crack 1: give x and y, or neither"),
        ("[[crack]]\nx = 1.0\ny = 1.0", "crack 1: give one of width, none = true"),
        ("[[crack]]\nwidth = 1e-3\nnone = true", "crack 1: give one of width"),
        ('[[crack]]\nwider_than = "5 mm"\nnarrower_than = "1 mm"', "must be less than narrower_than"),
        ('[[crack]]\nwidth = "2 mm"\ndirection = "vertical"', "a direction needs the place"),
        ('[[crack]]\nwidht = "2 mm"', "Did you mean 'width'?"),
        ('movement = "H1"\n[[tilt]]\nvalue = 0.01', "is of the surface movement"),
        (
            "[[window]]\nopening = 1\nsticks = true",
            "window 1: opening = 1: the wall of dishing.dp, 1.44 m long and 0.45 m high, has no opening",
        ),
        ("[[crack]]\nx = -0.1\ny = 0.1\nwidth = 1e-3", "x runs from 0 to 1.44 m, from its left end"),
        ("[[level]]\nx = 0.1\ny = 0.1\nto_x = 3.0\nto_y = 0.1\ndifference = 1e-3", "level 1: to_x = 3 m lies off"),
        ("[[level]]\nx = 0.1\ny = 0.1\nto_x = 0.12\nto_y = 0.1\ndifference = 1e-3", "both points are on one block"),
        ("[[level]]\nx = 0.1\ny = 0.1\nto_x = 0.1\nto_y = 0.1\ndifference = 1e-3", "level 1: both points are one"),
        (
            "[[crack]]\nx = 0.3\ny = 0.1125\nwithin = 1e-3\nwidth = 1e-3",
            "no joint of its part (wall) lies within 1 mm of x = 0.3 m, y = 0.1125 m; the nearest is 37.5 mm away",
        ),
        ('[[crack]]\nx = 1.0\ny = 0.1\nwidth = 1e-3\npart = "dpc"', "part = 'dpc': the wall of dishing.dp"),
        ('[[crack]]\nx = 1.0\ny = 0.1\nwidth = "-1 mm"', "number 1, width = '-1 mm': must be greater than 0"),
        ("[[crack]]\nx = 1.0\ny = 0.1\nwidth = 1e-3\ndate = 2026-02-30", "date"),
        ("[[crack]]\nwidth = 2026-02-03", "[[crack]] number 1, width: expected a number in m"),
        (
            "[[crack]]\nx = 1.0\ny = 0.1\nwidth = 2e-3\n[[crack]]\nx = 1.1\ny = 0.1\nwithin = 0.7\nnone = true",
            "crack 1 and crack 2 contradict each other: one is wider than 1.4 mm, and where it runs none is wider",
        ),
        ("[[crack]]\nx = 1.0\ny = 0.1\nwidth = 5e-3\n[[crack]]\nnarrower_than = 1e-3", "contradict each other"),
        ("[[crack]]\nwidth = 3e-3\n[[crack]]\nwidth = 5e-3", "contradict each other"),
        ("[[tilt]]\nvalue = 0.01\n[[tilt]]\nvalue = 0.02", "tilt: 0.01 and 0.02 are measurements of one quantity"),
        (
            "[[window]]\nopening = 1\nsticks = true\n[[window]]\nopening = 1\nsticks = false",
            "window: opening 1 sticks and does not",
        ),
        (
            "".join(
                f"[[level]]\nx = {x}\ny = 0\nto_x = {to}\nto_y = 0\ndifference = {d}\n"
                for x, to, d in ((0.1, 0.7, 4e-3), (0.7, 1.3, 4e-3), (0.1, 1.3, 2e-3))
            ),
            "contradicts the other levels by 2 mm",
        ),
        ("[[window]]\nopening = 1", "window 1: give one of sticks and width_change"),
        ('[[window]]\nopening = 1\nsticks = true\nwidth_change = "1 mm"', "give one of sticks and width_change"),
    ],
)
def test_wrong_observations_are_answered_by_a_sentence(text: str, sentence: str, causes: list[Path], tmp_path: Path):
    file = tmp_path / "observations.toml"
    file.write_text(text)
    with pytest.raises(InputError) as error:
        infer(causes, file)
    assert sentence in str(error.value)


def test_a_crack_of_another_direction_is_a_mixture_with_its_own_misfit() -> None:
    """Widths of 0.2 mm along the observed direction and 2 mm in any; 2 mm were seen, known to 0.3 mm."""
    seen = CrackObservation(x=0.5, y=0.2, width=2e-3, error=3e-4, direction="vertical")
    model = Discrepancy(width=4e-4, width_share=0.0, direction=0.1)
    fit = series_fit([seen], [CrackPrediction(np.array([2e-3]), np.array([2e-4]))], model)
    deviation = 5e-4  # of 0.3 and 0.4 mm
    densities = stats.norm(2e-3, deviation).pdf([2e-4, 2e-3])
    assert fit.log_likelihood[0] == pytest.approx(math.log(0.9 * densities[0] + 0.1 * densities[1]))
    assert fit.misfit[0] == pytest.approx(-2 * math.log(0.1))  # less than (1.8 / 0.5)**2
    near = series_fit([seen], [CrackPrediction(np.array([2e-3]), np.array([1.5e-3]))], model)
    assert near.misfit[0] == pytest.approx(1.0)
