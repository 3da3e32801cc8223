"""Surveys over time: series of readings, histories of the movement, their posterior, rate and forecast."""

import datetime as dt
import math
from pathlib import Path

import numpy as np
import pytest
from scipy import integrate, stats

from damagepred import InputError, infer
from damagepred.analyses.posterior_tables import posterior_tables
from damagepred.plotting import draw_back_analysis
from damagepred.report.answers import posterior_answer
from damagepred.report.back_analysis import posterior_cautions
from damagepred.uq.discrepancy import Discrepancy
from damagepred.uq.history import Histories, History, drawn_histories, years_from
from damagepred.uq.observations import CrackObservation, LevelObservation, MonitorSeries, Observations, SlopeObservation
from damagepred.uq.survey_likelihood import OWN_SHARE, CrackPrediction, series_fit, vague_log_likelihood
from tests.synthetic_studies import synthetic_study
from tests.validation.test_validation_cases import module

LAST = dt.date(2026, 1, 1)
DAYS = [dt.date(2022, 1, 1), dt.date(2024, 1, 1), LAST]
STUDY = Path(__file__).resolve().parents[2] / "studies" / "back_analysis" / "visits.py"


def histories(**values: float) -> Histories:
    return Histories(*(np.array([values.get(name, 0.0)]) for name in Histories._fields))


def test_histories_are_lines_steps_and_seasons() -> None:
    """Values by hand at -8, -2 and 6 years; all are 1 at the last visit, where the movement so far is largest."""
    years = np.array([-8.0, -2.0, 6.0])
    reached, moved, part = histories(slope=0.2).at(years)  # began 5 years ago
    assert reached[0] == pytest.approx([0.0, 0.6, 2.2])
    assert (moved == reached).all()
    assert (part == 1.0).all()
    reached, *_ = histories(drop=0.3, day=-2.5).at(years)
    assert reached[0] == pytest.approx([0.7, 1.0, 1.0])
    # no trend: the crest of the season is the largest movement, half a year later the movement is 2 amplitudes lower
    reached, moved, part = histories(amplitude=0.25, phase=0.0, recovery=0.4).at(np.array([-0.75, -0.25, 0.0, 0.25]))
    assert reached[0] == pytest.approx(np.ones(4), abs=1e-3)
    assert moved[0] == pytest.approx([1.0, 0.5, 0.75, 1.0], abs=1e-3)
    assert part[0] == pytest.approx([1.0, 1.0 - 0.4 * 0.5, 1.0 - 0.4 * 0.25, 1.0], abs=1e-3)
    assert histories(slope=0.1, amplitude=0.2).at(np.array([0.0]))[0][0, 0] == pytest.approx(1.0)


def test_readings_of_a_series_share_the_discrepancy() -> None:
    """A multivariate normal with one common factor; changes are differences, limits an integral over the factor."""
    model = Discrepancy(width=3e-4, width_share=0.4)
    width = np.array([1e-3, 1.6e-3, 2.1e-3])
    spread = np.hypot(3e-4, 0.4 * width)
    common, own = math.sqrt(1 - OWN_SHARE**2) * spread, np.hypot(2e-4, OWN_SHARE * spread)
    value = np.array([1.3e-3, 1.7e-3, 2.6e-3])
    seen = [CrackObservation(date=d, width=v) for d, v in zip(DAYS, value)]
    predicted = [CrackPrediction(w[None], w[None]) for w in width]
    expected = stats.multivariate_normal(width, np.outer(common, common) + np.diag(own**2))
    fit = series_fit(seen, predicted, model)
    assert fit.log_likelihood[0] == pytest.approx(expected.logpdf(value))
    gap = value - width
    assert fit.misfit[0] == pytest.approx(gap @ np.linalg.solve(expected.cov, gap))
    # changes since the first day: the common factor counts by its change
    changes = [CrackObservation(date=d, since=DAYS[0], change=c) for d, c in zip(DAYS[1:], (5e-4, 1.2e-3))]
    since = [CrackPrediction(w[None], w[None], predicted[0]) for w in width[1:]]
    factor = common[1:] - common[0]
    expected = stats.multivariate_normal(width[1:] - width[0], np.outer(factor, factor) + np.diag(own[1:] ** 2))
    assert series_fit(changes, since, model).log_likelihood[0] == pytest.approx(expected.logpdf([5e-4, 1.2e-3]))
    seen[0] = CrackObservation(date=DAYS[0], none=True, visible=1e-3)

    def density(z: float) -> float:
        rest = stats.norm(width[1:] + common[1:] * z, own[1:]).pdf(value[1:]).prod()
        return float(stats.norm.pdf(z) * rest * stats.norm(width[0] + common[0] * z, own[0]).cdf(1e-3))

    exact = integrate.quad(density, -8, 8, limit=200, epsabs=0.0)[0]
    assert series_fit(seen, predicted, model).log_likelihood[0] == pytest.approx(math.log(exact), abs=2e-3)


@pytest.fixture(scope="module")
def house(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Study of 80 walls whose crack widths grow with the square of the movement, up to 6 mm."""
    return synthetic_study(tmp_path_factory.mktemp("visits") / "house.dp", 80, (2e-3, 4e-3), own_movements=False)


def test_one_visit_is_an_undated_survey_with_the_rate_of_the_prior(house: Path) -> None:
    crack = {"width": 1e-3, "error": 3e-4}
    undated = infer(house, Observations(crack=(CrackObservation(**crack),)))
    prior = History(kind="steady")
    one = infer(house, Observations(crack=(CrackObservation(**crack, date=LAST),), history=prior))
    for name in ("posterior", "movement_quantile", "posterior_odds", "future_probability", "another_cause_posterior"):
        np.testing.assert_allclose(one[name].values, undated[name].values, rtol=1e-12)
    # the rate is the movement over an age that is log-uniform from 1 to 100 years
    random = np.random.default_rng(1)
    state = random.choice(undated["posterior"].size, 200_000, p=undated["posterior"].values.ravel())
    ends = (undated["movement"].values.ravel()[state] + half for half in (-5e-4, 5e-4))  # increments of 1 mm
    rate = random.uniform(*np.clip([*ends], 0.0, 6e-3)) / 100 ** random.random(200_000)
    expected = np.quantile(rate, one["quantile"].values)
    assert one["rate_quantile"].values[0] == pytest.approx(expected, rel=0.08)
    assert posterior_cautions(one)[-1].startswith("One visit shows no rate")
    assert "from the prior alone" in posterior_answer(one)
    assert "until" not in undated


def test_rate_and_forecast_of_a_wall_that_is_known_agree_with_a_grid(tmp_path: Path) -> None:
    """One wall (all are alike), certain discrepancy: the posterior of movement and age on a fine grid."""
    walls = synthetic_study(tmp_path / "one.dp", 60, (2e-3, 4e-3), 0.0, own_movements=False)
    value, error = np.array([3e-4, 6.5e-4, 1.2e-3]), 1e-4
    crack = tuple(CrackObservation(date=d, width=v, error=error) for d, v in zip(DAYS, value))
    certain = Discrepancy(width=1e-5, width_share=0.05)
    prior = History(kind="steady", until="2031")
    found = infer(walls, Observations(crack=crack, discrepancy=certain, history=prior))
    movement = np.linspace(0.0, 6e-3, 7)
    path = 2e-3 * (movement / 4e-3) ** 2  # the archive's, straight between increments
    age, years = 100 ** ((np.arange(400) + 0.5) / 400), years_from(LAST, DAYS)
    width = np.interp(movement[:, None, None] * np.maximum(1 + years / age[:, None], 0.0), movement, path)
    spread = np.hypot(1e-5, 0.05 * width)
    own, common = np.hypot(error, OWN_SHARE * spread), math.sqrt(1 - OWN_SHARE**2) * spread
    log = np.empty(width.shape[:2])
    for state in np.ndindex(log.shape):
        cov = np.outer(common[state], common[state]) + np.diag(own[state] ** 2)
        log[state] = stats.multivariate_normal(width[state], cov).logpdf(value)
    chance = np.exp(log) * np.array([0.5, 1, 1, 1, 1, 1, 0.5])[:, None]
    chance /= chance.sum()
    assert found["posterior"].sum("sample").values == pytest.approx(chance.sum(axis=1), abs=0.02)
    rate = movement[:, None] / age
    mean = float((chance * rate).sum())
    low, *_, middle, _, high = found["rate_quantile"].values[0]
    assert middle == pytest.approx(mean, rel=0.1)
    assert low < mean < high
    # categories of the wall: 1 from 2 mm, 2 from 4 mm, by the nearest increment
    later = movement[:, None] * (1 + years_from(LAST, [dt.date(2031, 1, 1)])[0] / age)
    known = float(found["forecast_known"][0, 0])
    assert known == pytest.approx((chance * (later <= 6e-3)).sum(), abs=0.1)
    lower, upper = (found[f"forecast_probability_{end}"].values[0, 0] for end in ("lower", "upper"))
    assert lower[1] <= (chance * (later >= 4e-3)).sum() + 0.1
    assert upper[2] - lower[2] == pytest.approx(1.0 - known, abs=1e-9)  # beyond the paths nothing is known
    assert posterior_answer(found).endswith(".")


def survey(*widths: float, **more: object) -> Observations:
    crack = tuple(CrackObservation(date=d, width=w, error=1e-4) for d, w in zip(DAYS, widths))
    return Observations(crack=crack, **more)


def test_cracks_that_stand_still_came_by_a_step(house: Path) -> None:
    still, growing = (infer(house, survey(*w)) for w in ((1e-3, 1e-3, 1e-3), (4e-4, 7e-4, 1e-3)))
    assert still["kind"].values.tolist() == ["steady", "step"]
    assert float(still["history_posterior"].sel(kind="step")[0]) > 0.6
    assert float(growing["history_posterior"].sel(kind="step")[0]) < 0.2
    assert float(still["rate_quantile"][0, 2]) == 0.0
    later = growing["forecast_quantile"][0].sel(quantile=0.5).values
    assert (np.diff(later) > 0).all()
    assert (np.diff(growing["forecast_probability_lower"][0, :, 0]) >= 0).all()
    assert growing["until"].values.astype("M8[D]").astype(str).tolist() == ["2027-01-01", "2031-01-01", "2036-01-01"]
    rates, ahead = posterior_tables(growing)[1:3]
    assert rates.rows[0][1].count("(") == 1
    assert [row[1] for row in ahead.rows] == ["2027-01-01", "2031-01-01", "2036-01-01"]
    (ax,) = draw_back_analysis(growing)
    assert ax.get_ylabel() == "central deflection (mm)"
    assert len(ax.get_legend().get_texts()) >= 6


def test_a_monitor_is_a_series_of_its_changes(house: Path) -> None:
    monitor = MonitorSeries(name="M1", date=DAYS, change=[0.0, 2e-4, 4e-4])
    by_hand = tuple(
        CrackObservation(date=d, since=DAYS[0], change=c, error=monitor.error) for d, c in zip(DAYS[1:], (2e-4, 4e-4))
    )
    one, other = Observations(monitor=(monitor,)), Observations(crack=by_hand)
    assert one.count == 2
    first, second = infer(house, one), infer(house, other)
    np.testing.assert_array_equal(first["posterior"].values, second["posterior"].values)
    assert np.isnan(first["visit_quantile"]).all()  # a change says nothing without its first day


def test_another_cause_walks_randomly_between_visits() -> None:
    """The last reading as if alone; earlier ones normal about it, with a variance in proportion to the years."""
    series = survey(1e-3, 1.4e-3, 2e-3)
    alone = vague_log_likelihood(Observations(crack=(CrackObservation(width=2e-3, error=1e-4),)))
    years = np.abs(years_from(LAST, DAYS[:2]))
    cov = 1.6e-3**2 * np.minimum.outer(years, years) + 1e-8 + np.diag([1e-8, 1e-8])
    walk = stats.multivariate_normal([2e-3, 2e-3], cov).logpdf([1e-3, 1.4e-3])
    assert vague_log_likelihood(series) == pytest.approx(alone + walk)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("[[crack]]\nwidth = 1e-3\ndate = 2024-01-01\n[[tilt]]\nvalue = 0.01", "tilt 1: has no date, but other"),
        ("[[tilt]]\nvalue = 0.01\n[history]\nkind = 'step'", "history: needs dates, and the observations have none"),
        (
            "[[tilt]]\nvalue = 0.01\ndate = 2024-01-01\n[history]\nuntil = 2023",
            "until = 2023-01-01: must be later than",
        ),
        ("[[tilt]]\nvalue = 0.01\ndate = 2024-01-01\n[history]\nbegan = [2022, 2020]", "first possible day and then"),
        ("[[tilt]]\nvalue = 0.01\ndate = 2024-01-01\n[history]\nbegan = 2030", "neither after the last visit"),
        ("[[tilt]]\nvalue = 0.01\ndate = 2024-01-01\n[history]\nkind = 'seasons'", "must be 'steady', 'seasonal' or"),
        ("[[tilt]]\nvalue = 0.01\ndate = 2024-01-01\n[history]\nkind = []", "kind"),
        ("[[tilt]]\nvalue = 0.01\ndate = 2024-01-01\n[history]\nkind = ['step', 'step']", "names a kind twice"),
        ("[[tilt]]\nvalue = 0.01\ndate = '1/2/2024'", "must be a date such as 2026-11-28 or"),
        ("[[tilt]]\nvalue = 0.01\ndate = '2024-02-30'", "is no date"),
        ("[[tilt]]\nvalue = 0.01\ndate = 2024", "must be a date such as"),
        ("[[crack]]\nchange = 1e-4\ndate = 2024-01-01", "crack 1: give a change and the day `since`"),
        ("[[crack]]\nwidth = 1e-4\ndate = 2024-01-01\nsince = 2023-01-01", "give a change and the day `since`"),
        ("[[crack]]\nchange = 1e-4\ndate = 2024-01-01\nsince = 2025-01-01", "since = 2025-01-01: must be earlier"),
        ("[[monitor]]\ndate = [2024-01-01, 2023-01-01]\nwidth = [1e-3, 2e-3]", "2023-01-01 follows 2024-01-01; dates"),
        ("[[monitor]]\ndate = [2024-01-01]\nwidth = [1e-3, 2e-3]", "monitor 1: has 1 dates and 2 readings"),
        ("[[monitor]]\nname = 'M'\ndate = [2024-01-01]", "monitor 1 (M): give one of width and change"),
        ("[[monitor]]\ndate = [2023-01-01, 2024-01-01]\nchange = [1e-4, 2e-4]", "change must begin with 0"),
        ("[[monitor]]\ndate = [2023-01-01]\nwidth = ['0 mm']", "width = 0: must be greater than 0"),
        (
            "[[crack]]\nwidth = 1e-3\ndate = 2024-01-01\n[[crack]]\nwidth = 5e-3\ndate = 2024-01-01",
            "crack 2 and crack 1 contradict each other",
        ),
        (
            "[[tilt]]\nvalue = 0.01\ndate = 2024-01-01\n[[tilt]]\nvalue = 0.02\ndate = 2024-01-01",
            "tilt: 0.01 and 0.02 are measurements of one quantity",
        ),
    ],
)
def test_wrong_dates_are_answered_by_a_sentence(text: str, sentence: str, tmp_path: Path) -> None:
    file = tmp_path / "visits.toml"
    file.write_text(text)
    with pytest.raises(InputError) as error:
        Observations.from_toml(file)
    assert sentence in str(error.value)


def test_visits_may_differ_and_changes_count_since_a_day() -> None:
    """A crack and a level that grow are no contradiction; levels since a day form loops of their own."""
    ends = {"x": 0.0, "y": 0.0, "to_x": 3.0, "to_y": 0.0}
    level = tuple(LevelObservation(**ends, date=d, difference=v) for d, v in zip(DAYS, (0.0, 4e-3, 9e-3)))
    change = LevelObservation(**ends, date=LAST, since=DAYS[0], difference=9e-3)
    tilt = tuple(SlopeObservation(date=d, value=v) for d, v in zip(DAYS, (0.0, 2e-3, 6e-3)))
    seen = survey(1e-3, 3e-3, 8e-3, level=(*level, change), tilt=tilt)
    assert [len(readings) for _, readings in seen.series] == [3, 4, 3]
    assert seen.alone(DAYS[0]).count == 3
    assert seen.dates == DAYS


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("visits", "kinds", "count"), [("five visits", ("steady", "step"), 10), ("monitor", ("steady",), 16)]
)
def test_intervals_hold_the_truth_of_new_walls(visits: str, kinds: tuple[str, ...], count: int) -> None:
    """Of walls and histories outside the archive, 90 % within binomial scatter."""
    found = module("visits", STUDY).cases(visits, kinds, count, 7)
    for name in ("rate", "1 year", "5 years", "10 years"):
        assert found[name].mean() >= 0.8, name
    assert found["chance"].mean() == pytest.approx(found["reached"].mean(), abs=0.12)
    assert drawn_histories(History(kind=kinds), 0, np.full((1, 4), 0.5), -4.0, LAST).slope[0] == pytest.approx(0.1)


@pytest.mark.thorough
def test_many_seasonal_histories_are_effective() -> None:
    """Six numbers are unknown; the last rounds draw four times as many histories. Single cases have few."""
    assert np.median(module("visits", STUDY).cases("monitor", ("seasonal",), 5, 2)["effective"]) > 100
