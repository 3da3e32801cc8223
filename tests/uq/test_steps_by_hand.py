"""Steps of sampling, selection and observations against formulas and hand calculation."""

import itertools
import math

import numpy as np
import pytest
import xarray as xr
from scipy import special, stats
from scipy.stats import kstest

from damagepred.analyses.stored_walls import require_on
from damagepred.errors import InputError
from damagepred.scene import Dpc, Movement, Opening, Scene, Wall
from damagepred.scene.described import build
from damagepred.uq import capacity
from damagepred.uq import observations as observing
from damagepred.uq.capacity import Capacities, category_number, highest_category, require_categories
from damagepred.uq.design import Sampler
from damagepred.uq.discrepancy import Discrepancy
from damagepred.uq.estimate import Estimate, probability, wilson
from damagepred.uq.failure_bounds import failure_bounds
from damagepred.uq.fields import JointPlaces, WallFields, stated_correlation
from damagepred.uq.fragility import normalised_weights
from damagepred.uq.importance import Proposal, cross_entropy_shift, draw
from damagepred.uq.intensity import attributes, chosen_intensity, intensity_values, movement_measure
from damagepred.uq.marginals import Mixture, Table, breaks, from_normal
from damagepred.uq.observations import CrackObservation, Observations, SlopeObservation, WindowObservation
from damagepred.uq.selection import betting_lower_bound, hoeffding_bounds, select_cheapest, select_least_expected
from damagepred.uq.stopping import StopWhen, interim_confidence, interim_sizes
from damagepred.uq.subset import Level, SubsetEstimate, _mean_of_runs, _variation, subset_simulation
from damagepred.uq.survey_likelihood import censored, vague_log_likelihood
from damagepred.uq.variable import JointField, Variable
from studies.validation.scores import coverage, crps, pit
from tests.synthetic_studies import capacities


def test_categories_by_name_and_their_highest_number() -> None:
    flags = {"flag_meanings": "sound very_slight slight"}
    study = xr.Dataset({"damage_category": ("sample", np.zeros(2, dtype=np.int8), flags)})
    curves = xr.Dataset(coords={"category": [1, 3], "category_name": ("category", ["thin", "very wide"])})
    assert [category_number(study, name) for name in ("sound", "very slight", "very_slight", 2)] == [0, 1, 1, 2]
    assert [category_number(curves, name) for name in ("thin", "very_wide")] == [1, 3]
    assert category_number(xr.Dataset(coords={"category": ("category", [0, 1], flags)}), "very slight") == 1
    with pytest.raises(InputError, match=r"'slihgt': must be a number from 1, or one of very slight, slight\. Did you"):
        category_number(study, "slihgt")
    with pytest.raises(InputError, match="no sample is solved yet"):
        category_number(xr.Dataset(), "slight")
    assert [highest_category(ds) for ds in (study, study.assign_attrs(highest_category=7), curves)] == [2, 7, 4]
    require_categories(study, [1, 2])
    with pytest.raises(InputError, match=r"categories = \[1, 3\]: the study's damage table has categories 1 to 2\."):
        require_categories(study, [1, 3])
    with pytest.raises(InputError, match=r"category = 0: the study's"):
        require_categories(study, [0])


def test_intervals_of_hand_made_paths() -> None:
    """The ground falls and rises, increments are unknown, and walls skip categories."""
    both = ("sample", "increment")
    category = [[0, 1, 3, 2], [0, 0, -1, -1], [2, 2, 2, 2], [0, 0, 0, 0], [-1, -1, -1, -1]]
    movement = [[0, 2, 1, 4], [0, 3, np.nan, np.nan], [0, 1, 2, 3], [0, 1, 5, 4], [np.nan] * 4]
    ds = xr.Dataset(
        {
            "damage_category": (both, np.array(category, dtype=np.int8)),
            "central_deflection": (both, movement),
            "status": ("sample", np.array([0, 2, 0, 1, 2], dtype=np.int8)),
        }
    )
    for number, lower, upper in (
        (1, [0, 3, 0, 5, 0], [2, np.inf, 0, np.inf, np.inf]),
        (2, [2, 3, 0, 5, 0], [2, np.inf, 0, np.inf, np.inf]),
        (4, [4, 3, 3, 5, 0], [np.inf] * 5),
    ):
        found = capacities(ds, number)
        assert (found.lower.tolist(), found.upper.tolist()) == (lower, upper)
        assert found.failed.tolist() == [False, True, False, False, True]
        assert found.end.tolist() == [4, 3, 3, 5, 5]  # nothing known of the last: as far as any
    known = Capacities(np.array([0.0, 0.0]), np.array([0.0, 2.0]), np.array([True, True]), np.ones(2))
    other = capacity.without_damaged_at_start(known)
    assert (other.upper.tolist(), other.failed.tolist()) == ([np.inf, 2.0], [False, True])
    undamaged, damaged = failure_bounds(np.ones(2), np.full(2, 9.0), np.array([True, False]), 5.0, np.full(2, 3.0))
    assert [x.tolist() for x in (*undamaged, *damaged)] == [[5, 1], [9, 9], [1, 1], [3, 9]]


@pytest.mark.parametrize(
    ("widths", "limit", "expected"),
    [((1.0, 5.0), 2.0, 2.5), ((1.0, 5.0), 5.0, 4.0), ((2.0, 5.0), 2.0, 4.0), ((1.0, 1.5), 2.0, 4.0)],
)
def test_a_width_passes_its_limit_between_two_increments(widths: tuple, limit: float, expected: float) -> None:
    assert capacity.interpolated_capacity((2.0, 4.0), widths, limit) == expected


def test_weights_of_the_walls_that_reached_a_category_add_up_to_their_number() -> None:
    scaled = normalised_weights(np.array([0.25, 0.5, 0.0, 1.0]), np.array([1.0, 2.0, 3.0, np.inf]))
    assert scaled.tolist() == pytest.approx([2 / 3, 4 / 3, 0.0, 8 / 3])


def test_probabilities_where_all_samples_agree_or_are_one() -> None:
    for hit in (0.0, 1.0):
        e = probability(np.full(20, hit), share=0.5)
        assert (e.value, e.error, e.samples) == (hit, 0.0, 20)
        assert (e.lower, e.upper) == pytest.approx(wilson(hit, 10.0, special.ndtri(0.95)))
        assert probability(np.full(50, hit), replicate=np.arange(50) % 8).half_width == pytest.approx(
            probability(np.full(50, hit)).half_width
        )
    alone = probability(np.ones(1))
    assert (alone.value, alone.upper) == (1.0, 1.0)
    assert alone.lower == pytest.approx(1 / (1 + special.ndtri(0.95) ** 2))
    nothing = probability(np.zeros(0))
    assert np.isnan(nothing.value)
    assert (nothing.lower, nothing.upper, nothing.samples) == (0.0, 1.0, 0)
    half = probability(np.array([0.0, 1.0] * 10), precision=0.5)
    assert (half.lower, half.upper) == pytest.approx(wilson(0.5, 10.0, special.ndtri(0.95)))
    weighted = probability(np.array([1.0, 0, 0, 0] * 5), weight=np.tile([2.0, 0.5, 1.0, 0.5], 5))
    assert weighted.value == pytest.approx(0.5)
    values = np.tile([2.0, 0, 0, 0], 5)
    error, factor = values.std(ddof=1) / np.sqrt(20), stats.t.ppf(0.95, 4)  # five hits of one weight
    assert (weighted.lower, weighted.upper) == pytest.approx(wilson(0.5, 0.25 / error**2, factor))


@pytest.mark.parametrize("nominal", [0.0, 0.25])
def test_weights_are_ratios_of_normal_densities(nominal: float) -> None:
    """Of the stated density over the mixture's, for two correlated variables, one of them shifted and scaled."""
    factor = np.linalg.cholesky(np.array([[1.0, 0.6], [0.6, 1.0]]))
    random = np.random.default_rng(1)
    z, turn = random.standard_normal((50, 2)), random.random(50)
    drawn = draw(z, factor, "ab", {"a": Proposal(shift=1.0, scale=1.5)}, nominal, turn)
    shift, scale = np.array([1.0, 0.6]), np.array([1.5, 1.0])
    plain = z @ factor.T
    moved = np.where((turn < nominal)[:, None], plain, plain * scale + shift)
    np.testing.assert_allclose(drawn.normal, moved)
    assert nominal == 0 or 5 < (turn < nominal).sum() < 20
    covariance = factor @ factor.T
    stated = stats.multivariate_normal(np.zeros(2), covariance).pdf(moved)
    proposed = stats.multivariate_normal(shift, np.outer(scale, scale) * covariance).pdf(moved)
    np.testing.assert_allclose(drawn.weight, stated / (nominal * stated + (1 - nominal) * proposed))
    assert draw(z, factor, "ab", {}).weight.tolist() == [1.0] * 50
    found = cross_entropy_shift(np.array([[0.0], [2.0], [4.0]]), np.array([1.0, 1.0, 2.0]))
    assert found.tolist() == [2.5]


def test_a_table_of_values_has_the_moments_and_quantiles_of_its_weights() -> None:
    table = Table([3.0, 1.0, 3.0, 7.0], [1.0, 2.0, 1.0, 4.0])
    assert (table.values.tolist(), table.probabilities.tolist()) == ([1, 3, 7], [0.25, 0.25, 0.5])
    at = np.array([0.9, 1.0, 2.9, 3.0, 6.9, 7.0])
    assert table.cdf(at).tolist() == [0, 0.25, 0.25, 0.5, 0.5, 1]
    assert table.sf(at).tolist() == [1, 0.75, 0.75, 0.5, 0.5, 0]
    q = np.array([0.01, 0.25, 0.26, 0.5, 0.51, 1.0])
    assert table.ppf(q).tolist() == [1, 1, 3, 3, 7, 7]
    assert table.isf(1 - q).tolist() == [1, 1, 3, 3, 7, 7]
    assert (table.mean(), table.support()) == (4.5, (1.0, 7.0))
    assert table.std() == pytest.approx(math.sqrt(0.25 * 3.5**2 + 0.25 * 1.5**2 + 0.5 * 2.5**2))
    np.testing.assert_allclose(breaks(table), special.ndtri([0.25, 0.5]))
    assert breaks(stats.norm()).size == 0
    z = np.array([-9.0, -0.7, -0.6, 0.0, 0.1, 9.0])
    assert from_normal(table, z).tolist() == [1, 1, 3, 3, 7, 7]


def test_a_mixture_has_the_moments_of_its_parts() -> None:
    parts, share = [stats.norm(1.0, 0.5), stats.uniform(4.0, 2.0), Table([2.0, 5.0])], np.array([0.5, 0.3, 0.2])
    mixture = Mixture(parts, 10 * share)
    means, stds = np.array([1.0, 5.0, 3.5]), np.array([0.5, math.sqrt(1 / 3), 1.5])
    assert mixture.mean() == pytest.approx(share @ means)
    assert mixture.std() == pytest.approx(math.sqrt(share @ (stds**2 + means**2) - (share @ means) ** 2))
    x = np.array([0.3, 2.0, 4.5, 5.0, 6.1])
    below = stats.norm(1.0, 0.5).cdf(x) / 2 + 0.3 * np.array([0, 0, 0.25, 0.5, 1]) + 0.2 * np.array([0, 0.5, 0.5, 1, 1])
    np.testing.assert_allclose(mixture.cdf(x), below)
    np.testing.assert_allclose(mixture.sf(x), 1 - below, atol=1e-15)
    q = np.array([1e-9, 0.1, 0.45, 0.7, 0.99])
    np.testing.assert_allclose(mixture.cdf(mixture.ppf(q)), q, rtol=1e-9)
    np.testing.assert_allclose(mixture.isf(q), mixture.ppf(1 - q), rtol=1e-7)
    assert mixture.quantile(special.ndtri(float(mixture.cdf(2.0)) - 0.05)) == 2.0  # an atom of a tenth
    assert mixture.support() == (-np.inf, np.inf)
    assert Mixture(parts[1:], [1.0, 1.0]).support() == (2.0, 6.0)


def test_levels_are_those_of_the_evaluations_behind_them() -> None:
    """Limits between order statistics, shares, acceptance and the numbers of evaluations, from a record of them."""
    margins: list[float] = []
    said: list[Level] = []

    def g(z: np.ndarray, number: np.ndarray) -> np.ndarray:
        assert number.tolist() == list(range(len(margins), len(margins) + len(z)))
        found = 3.0 - z.sum(axis=1) / math.sqrt(2)
        margins.extend(found.tolist())
        return found

    found = subset_simulation(g, 2, samples=100, level_share=0.2, seed=4, on_level=said.append)
    assert len(found.levels) == len(said) > 3
    first, second, third = found.levels[:3]
    ordered = np.sort(margins[:100])
    assert (first.limit, first.share) == (pytest.approx((ordered[19] + ordered[20]) / 2), 0.2)
    assert np.isnan(first.acceptance)
    assert first.variation == pytest.approx(math.sqrt(0.8 / (0.2 * 100)))
    assert second.acceptance == pytest.approx((np.array(margins[100:180]) <= first.limit).mean())
    assert third.acceptance == pytest.approx((np.array(margins[180:260]) <= second.limit).mean())
    assert found.evaluations == len(margins) == 100 + 80 * (len(found.levels) - 1)
    assert found.levels[-1].limit == 0.0
    assert found.reached
    assert found.probability == pytest.approx(np.prod([level.share for level in found.levels]))
    assert found.variation == pytest.approx(math.sqrt(sum(level.variation**2 for level in found.levels)))
    spread = special.ndtri(0.95) * math.sqrt(math.log1p(found.variation**2))
    assert (found.lower, found.upper) == pytest.approx(
        (found.probability * math.exp(-spread), found.probability * math.exp(spread))
    )
    assert (np.sort(found.margins) <= 0).sum() == round(100 * found.levels[-1].share)
    np.testing.assert_allclose(found.margins, 3.0 - found.samples.sum(axis=1) / math.sqrt(2))
    often = subset_simulation(lambda z, _: 0.5 - z[:, 0], 1, samples=100, seed=1)
    assert len(often.levels) == 1
    assert (often.lower, often.upper) == pytest.approx(wilson(often.probability, 100, special.ndtri(0.95)))
    never = subset_simulation(lambda z, _: 9.0 - z[:, 0], 1, samples=100, seed=1, max_levels=2)
    assert (len(never.levels), never.reached, never.lower) == (2, False, 0.0)
    assert never.probability == never.levels[0].share * never.levels[1].share
    assert never.upper == pytest.approx(never.probability * (1 + 10 * special.ndtri(0.95) * never.variation))


def test_the_variation_of_a_share_along_chains() -> None:
    """Au and Beck (2001), eq. 29, of two chains of three: lag 1 is uncorrelated, lag 2 has correlation -1."""
    reached = np.array([[1, 0], [1, 0], [0, 1]], dtype=bool).ravel()
    assert _variation(reached, 0.5, 2) == pytest.approx(math.sqrt(1 / 6 * (1 - 2 / 3)))
    assert _variation(reached, 0.5, 6) == pytest.approx(math.sqrt(1 / 6))
    assert _variation(reached, 1.0, 2) == 0.0


def test_the_mean_of_runs_has_student_s_interval() -> None:
    def run(p: float, variation: float, reached: bool = True, upper: float = 0.5) -> SubsetEstimate:
        return SubsetEstimate(p, variation, 0.0, upper, 0.9, (), 100, reached, np.zeros(0), np.zeros(0))

    each = np.array([1e-3, 2e-3, 6e-3])
    found = _mean_of_runs([run(p, 0.1) for p in each])
    error = each.std(ddof=1) / math.sqrt(3)
    spread = stats.t.ppf(0.95, 2) * math.sqrt(math.log1p((error / 3e-3) ** 2))
    assert (found.probability, found.variation, found.runs) == (
        pytest.approx(3e-3),
        pytest.approx(error / 3e-3),
        (*each,),
    )
    assert (found.lower, found.upper) == pytest.approx((3e-3 * math.exp(-spread), 3e-3 * math.exp(spread)))
    stated = _mean_of_runs([run(3e-3, 0.6), run(3e-3, 0.8)])  # the runs' own errors are larger
    assert stated.variation == pytest.approx(math.hypot(0.6, 0.8) / 2)
    short = _mean_of_runs([run(1e-3, 0.1), run(2e-3, 0.1, False, 0.7)])
    assert (short.reached, short.lower, short.upper) == (False, 0.0, 0.7)


def test_bounds_in_closed_form() -> None:
    lower, upper = hoeffding_bounds(0.3, 50, 0.05)
    for bound in (lower, upper):
        divergence = 0.3 * math.log(0.3 / bound) + 0.7 * math.log(0.7 / (1 - bound))
        assert divergence == pytest.approx(math.log(20) / 50)
    assert lower < 0.3 < upper
    assert hoeffding_bounds(0.0, 50, 0.05) == pytest.approx((0.0, 1 - 0.05**0.02))
    assert hoeffding_bounds(1.0, 50, 0.05) == pytest.approx((0.05**0.02, 1.0))
    assert hoeffding_bounds(0.99, 10, 0.05)[1] == 1.0  # no probability below 1 - 1e-12 can be excluded
    assert hoeffding_bounds(0.01, 10, 0.05)[0] == 0.0
    values = np.random.default_rng(2).beta(2, 5, 60)
    bound = betting_lower_bound(values, 0.05)
    stakes = np.geomspace(1e-3, 1.0, 16)
    capital = np.prod(1 + stakes[:, None] * (values / bound - 1), axis=1).mean()
    assert capital == pytest.approx(20.0, rel=1e-6)
    assert 0.5 * values.mean() < bound < values.mean()
    assert betting_lower_bound(np.zeros(5), 0.05) == 0.0


def test_rounds_of_the_cheapest_safe_alternative() -> None:
    """Cheap and unsafe, dear and safe, dearest: each is sampled as long as it may be the answer."""
    asked: list[tuple[int, int]] = []
    chance = {0: 0.9, 1: 0.0, 2: 0.5}
    said: list[tuple[int, int]] = []

    def hits(k: int, size: int) -> np.ndarray:
        asked.append((k, size))
        return (np.arange(size) % 10 < 10 * chance[k]).astype(float)

    found = select_cheapest(
        np.array([1.0, 2.0, 3.0]),
        hits,
        0.2,
        interim_sizes(50, 200),
        on_round=lambda size, active: said.append((size, active)),
    )
    assert (found.chosen, found.sure) == (1, True)
    assert (found.meets.tolist(), found.fails.tolist()) == ([False, True, False], [True, False, True])
    assert found.mean.tolist() == pytest.approx([0.9, 0.0, 0.5])
    assert said == [(50, 3)]
    assert asked == [(0, 50), (1, 50), (2, 50)]
    error = 0.05 / (3 * 3)
    for k in range(3):
        assert (found.lower[k], found.upper[k]) == pytest.approx(hoeffding_bounds(chance[k], 50, error))
    assert found.samples.tolist() == [50, 50, 50]
    assert np.isnan(found.regret)


def test_the_least_expected_cost_by_pairs_of_samples() -> None:
    """Two alternatives of which the dearer saves more: its loss is smaller by the same amount in each sample."""
    random = np.random.default_rng(5)
    loss = random.uniform(20.0, 60.0, 400)
    losses = {0: loss + 30.0, 1: loss, 2: np.full(400, 90.0)}
    costs, rounds = np.array([0.0, 10.0, 50.0]), interim_sizes(100, 400)
    found = select_least_expected(costs, lambda k, n: losses[k][:n], 100.0, rounds)
    assert (found.chosen, found.sure, found.regret) == (1, True, 0.0)
    assert (found.meets.tolist(), found.fails.tolist()) == ([False, True, False], [True, False, True])
    n, error = int(found.samples[1]), 0.05 / (3 * 4)
    np.testing.assert_allclose(found.mean, [costs[k] + losses[k][:n].mean() for k in range(3)])
    for k in range(3):
        share = losses[k][:n] / 100.0
        low, high = betting_lower_bound(share, error), 1 - betting_lower_bound(1 - share, error)
        assert (found.lower[k], found.upper[k]) == pytest.approx((costs[k] + 100 * low, costs[k] + 100 * high))
    alike = select_least_expected(np.zeros(2), lambda k, n: loss[:n], 100.0, rounds, tolerance=1.0)
    bound = 200.0 * (betting_lower_bound(np.full(400, 0.5), 0.05 / 6) - 0.5)
    assert (alike.sure, alike.fails.any(), alike.samples.tolist()) == (False, False, [400, 400])
    assert alike.regret == pytest.approx(-bound)
    enough = select_least_expected(np.zeros(2), lambda k, n: loss[:n], 100.0, rounds, tolerance=1.01 * -bound)
    assert enough.sure
    assert enough.meets.tolist() == [True, False]


def test_limits_of_cracks_and_which_contain_which() -> None:
    def crack(**what: object) -> CrackObservation:
        return CrackObservation(**{"width": 2e-3} | what)

    assert crack(error=1e-4).range == pytest.approx((1.7e-3, 2.3e-3))
    assert CrackObservation(none=True).range == (-np.inf, 1e-4)
    assert CrackObservation(wider_than=1e-3).range == (1e-3, np.inf)
    assert CrackObservation(narrower_than=1e-3).range == (-np.inf, 1e-3)
    near, far = crack(x=1.0, y=1.0, within=0.2), crack(x=1.3, y=1.4, within=0.7)
    assert far.contains(near)
    assert not near.contains(far)
    assert not crack(x=1.3, y=1.4, within=0.69).contains(near)
    assert crack().contains(near)
    assert crack().contains(crack())
    assert not near.contains(crack())
    steep, below = crack(x=1.0, y=1.0, within=0.2, direction="vertical"), crack(part="dpc")
    assert near.contains(steep)
    assert not steep.contains(near)
    assert steep.contains(steep)
    assert not below.contains(near)
    assert not crack().contains(below)
    assert below.contains(below)


def test_the_vague_likelihood_is_the_product_of_its_terms() -> None:
    model = Discrepancy(width=4e-4, level=1e-3, direction=0.2)
    widths = stats.lognorm(1.7, scale=1.6e-3)
    error = math.hypot(3e-4, 4e-4)
    chance = [
        0.5 * 2 * stats.norm(0, error).pdf(2e-3) + 0.5 * widths.pdf(2e-3),
        (0.5 + 0.5 * widths.cdf(1e-4)),
        0.5 * (widths.cdf(5e-3) - widths.cdf(1e-3)),
        0.5 * widths.sf(3e-3) * (1 - 0.75 * 0.8),
        stats.norm(0, math.sqrt((5.0 / 150) ** 2 + 2e-6)).pdf(4e-3),
        150 * math.exp(-150 * 0.004),
        150 * math.exp(-150 * 0.006),
        0.5,
        stats.norm(0, math.hypot(5e-3, 5e-4)).pdf(-2e-3),
    ]
    seen = Observations(
        crack=(
            CrackObservation(width=2e-3, error=3e-4, x=2.0, y=1.0),
            CrackObservation(none=True, x=3.0, y=1.0),
            CrackObservation(wider_than=1e-3, narrower_than=5e-3),
            CrackObservation(wider_than=3e-3, x=0.0, y=1.0, direction="stepped"),
        ),
        level=(observing.LevelObservation(x=0.0, y=0.0, to_x=3.0, to_y=4.0, difference=4e-3),),
        slope=(SlopeObservation(value=0.004),),
        tilt=(SlopeObservation(value=0.006),),
        window=(WindowObservation(opening=1, sticks=True), WindowObservation(opening=2, width_change=-2e-3)),
        discrepancy=model,
    )
    assert seen.count == 9
    assert vague_log_likelihood(seen) == pytest.approx(np.log(chance).sum())


def test_a_censored_value_in_either_tail() -> None:
    predicted, spread = np.array([0.0, -40.0, 40.0]), 1.0
    for low, high in ((1.0, 2.0), (-2.0, -1.0), (-np.inf, 1.0), (1.0, np.inf)):
        exact = math.log(stats.norm.cdf(high) - stats.norm.cdf(low))
        fit = censored(predicted[:1], low, high, spread)
        assert fit.log_likelihood[0] == pytest.approx(exact)
        assert fit.misfit[0] == pytest.approx(-2 * exact)
        if np.isfinite(low):  # thirty deviations away, where the probability of the nearer end is all
            far = censored(predicted[1:], low - 10.0, high - 10.0, 1.0)
            assert far.log_likelihood[0] == pytest.approx(stats.norm.logsf(30.0 + low), rel=1e-6)
    whole = censored(predicted, -np.inf, np.inf, spread) + censored(predicted, -41.0, np.inf, spread)
    assert whole.log_likelihood[2] == pytest.approx(0.0, abs=1e-12)
    assert whole.log_likelihood[1] == pytest.approx(math.log(special.ndtr(1.0)))


def test_nodes_of_the_discrepancy_have_the_moments_of_the_fit() -> None:
    """Lognormal terms with the 90 % intervals of the data file; terms that the user gives stay."""
    plain = Discrepancy()
    nodes = plain.nodes(7)
    weight = np.array([w for w, _ in nodes])
    assert (len(nodes), weight.sum()) == (49, pytest.approx(1.0))
    for name in plain.uncertain:
        low, high = (float(end) for end in plain.origins()[name][0].split(" to "))
        logs = np.log([getattr(node, name) for _, node in nodes])
        assert weight @ logs == pytest.approx(math.log(getattr(plain, name)))
        deviation = math.sqrt(weight @ (logs - weight @ logs) ** 2)
        assert deviation == pytest.approx(math.log(high / low) / (2 * 1.6448536))
    assert {node.level for _, node in nodes} == {plain.level}
    given = Discrepancy(width=3e-4)
    assert (given.origins()["width"], given.uncertain) == (("-", "given"), ["width_share"])
    assert {node.width for _, node in given.nodes(3)} == {3e-4}
    assert Discrepancy(width=3e-4, width_share=0.3).nodes(5) == [(1.0, Discrepancy(width=3e-4, width_share=0.3))]


def test_places_off_the_wall_and_in_openings_are_refused_at_their_edges() -> None:
    wall = Wall(length=4.8, height=1.5)
    opening = (Opening(x=0.96, y=0.3, width=0.96, height=0.6), Opening(kind="door", x=2.88, width=0.96, height=1.2))
    dpc = Dpc(course=1)
    scene = Scene(wall=wall, dpc=dpc, opening=opening, movement=Movement(shape="parabola"))
    for x, y in itertools.product((0.0, 4.8), (0.0, 1.5)):
        require_on(Observations(crack=(CrackObservation(x=x, y=y, none=True),)), scene, "a")
    for x, y in ((0.96, 0.5), (1.92, 0.5), (1.2, 0.3), (1.2, 0.9), (3.0, 1.2)):
        require_on(Observations(crack=(CrackObservation(x=x, y=y, none=True),)), scene, "a")
    for x, y, words in (
        (1.2, 0.5, r"lies in opening 1 of the wall of a, 4.8 m long and 1.5 m high \(window, x 0.96 to 1.92 m, y 0.3"),
        (3.0, 0.1, r"lies in opening 2 of .* \(door, x 2.88 to 3.84 m, y 0 to 1.2 m\)"),
        (-0.01, 0.5, "x = -0.01 m lies off .*; x runs from 0 to 4.8 m, from its left end"),
        (1.0, 1.51, "y = 1.51 m lies off .*; y runs from 0 to 1.5 m, from its underside"),
    ):
        with pytest.raises(InputError, match=f"crack 1: .*{words}"):
            require_on(Observations(crack=(CrackObservation(x=x, y=y, none=True),)), scene, "a")
    level = observing.LevelObservation(x=0.5, y=0.0, to_x=4.0, to_y=-0.1, difference=1e-3)
    with pytest.raises(InputError, match=r"level 1: to_y = -0\.1 m lies off"):
        require_on(Observations(level=(level,)), scene, "a")
    window = WindowObservation(opening=3, sticks=False)
    with pytest.raises(InputError, match=r"window 1: opening = 3: the wall of a, .* has openings 1 to 2"):
        require_on(Observations(window=(window,)), scene, "a")
    below = Observations(crack=(CrackObservation(part="below_dpc", none=True),))
    require_on(below, scene, "a")
    with pytest.raises(InputError, match=r"crack 1: part = 'below_dpc': .* has no dpc\."):
        require_on(below, Scene(wall=scene.wall), "a")


LIMIT = 0.1


def test_the_chosen_alternative_is_that_of_brute_force_in_95_of_100_repetitions() -> None:
    random, right, samples, sure = np.random.default_rng(2), 0, [], 0
    rounds = interim_sizes(64, 4096)
    for _ in range(100):
        # twelve alternatives, none within a fifth of the limit; a common factor makes them alike
        factor = np.where(random.random(12) < 0.5, random.uniform(0.05, 0.7, 12), random.uniform(1.4, 5.0, 12))
        probability, cost = LIMIT * factor, random.random(12)
        common, own = random.random(4096), random.random((12, 4096))
        pick = random.random((12, 4096)) < 0.7
        uniform = np.where(pick, common, own)

        def hits(k: int, count: int, u: np.ndarray = uniform, p: np.ndarray = probability) -> np.ndarray:
            return (u[k, :count] < p[k]).astype(float)

        found = select_cheapest(cost, hits, LIMIT, rounds)
        feasible = probability <= LIMIT
        best = int(np.flatnonzero(feasible)[np.argmin(cost[feasible])]) if feasible.any() else None
        right += found.chosen == best
        sure += found.sure
        samples.append(found.samples.sum())
    assert right >= 95
    assert sure >= 90
    assert np.mean(samples) < 0.5 * 12 * 4096  # brute force takes all of them


def test_what_is_not_decided_is_said() -> None:
    even = np.tile([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], 10)
    found = select_cheapest(np.array([1.0]), lambda k, n: even[:n], LIMIT, interim_sizes(10, 100))
    assert (found.chosen, found.sure) == (None, False)
    with pytest.raises(InputError, match="between 0 and 1"):
        select_cheapest(np.array([1.0]), lambda k, n: even[:n], 1.5, [10])


def test_crps_of_two_members_by_hand() -> None:
    np.testing.assert_allclose(crps([0.0, 1.0], [0.0, 0.5, 2.0]), [0.0, 0.0, 1.0], atol=1e-15)


def test_pit_is_uniform_for_the_right_distribution_alone() -> None:
    rng = np.random.default_rng(2)
    ensemble, seen = rng.lognormal(size=5000), rng.lognormal(size=500)
    assert kstest(pit(ensemble, seen), "uniform").pvalue > 0.01
    assert kstest(pit(1.5 * ensemble, seen), "uniform").pvalue < 0.01


def test_coverage_is_the_share_for_the_right_distribution() -> None:
    rng = np.random.default_rng(4)
    ensemble, seen = rng.normal(size=20_000), rng.normal(size=20_000)
    for share in (0.5, 0.9):
        assert coverage(ensemble, seen, share) == pytest.approx(share, abs=0.015)


def test_walls_and_fields_of_a_crossed_design() -> None:
    crossed, plain = Sampler(crossed=True), Sampler()
    assert crossed.wall_of(np.arange(8)).tolist() == [0, 0, 1, 1, 2, 2, 3, 3]
    assert [crossed.field_of(i) for i in range(8)] == [0, 1, 0, 1, 2, 3, 2, 3]
    assert plain.wall_of(np.arange(3)).tolist() == [plain.field_of(i) for i in range(3)] == [0, 1, 2]


PLACES = JointPlaces(
    np.array([0, 0, 0, 1, 1]),
    np.zeros(5, dtype=int),
    np.array([0.1, 0.35, 0.9, 0.2, 0.5]),
    np.array([0, 0, 0, 0.3, 0.3]),
    0.25,
)


def test_correlation_of_joints_of_a_course_is_a_power_of_their_distance() -> None:
    found = stated_correlation(JointField(course_correlation=0.4), PLACES, np.arange(5))
    row = [1.0, 0.4, 0.16]
    np.testing.assert_allclose(found[0], [*row, 0, 0])
    np.testing.assert_allclose(found[2], [*row[::-1], 0, 0])
    np.testing.assert_allclose(found[3], [0, 0, 0, 1, 0.4])
    away = stated_correlation(JointField(correlation_length=0.5, nugget=0.2), PLACES, np.arange(5))
    assert away[0, 4] == pytest.approx(0.8 * math.exp(-0.5 / 0.5), rel=1e-12)  # 0.4 m along, 0.3 m up


def test_normals_behind_lognormal_fields_in_closed_form() -> None:
    """Two lognormals of the same cov: rho of the normals is ln(1 + r cov^2) / ln(1 + cov^2); mixed by their factor."""
    cov, strong = 0.8, 0.6
    fields = {name: JointField(correlation_length=length) for name, length in (("a", 0.5), ("b", 0.7))}
    marginal = Variable(distribution="lognormal", mean=1.0, cov=cov).frozen("a", "1")
    factor = np.linalg.cholesky(np.array([[1.0, strong], [strong, 1.0]]))
    made = WallFields(fields, dict.fromkeys(fields, marginal), factor)
    # columns of the linear map of independent normals give the covariance of what is drawn
    size = 2 * len(PLACES.x)
    columns = [made.draw(unit.reshape(2, -1).copy(), PLACES).ravel() for unit in np.eye(size)]
    covariance = np.transpose(columns) @ np.array(columns)
    for k, field in enumerate(fields.values()):
        stated = stated_correlation(field, PLACES, np.arange(5))
        expected = np.log1p(stated * cov**2) / np.log1p(cov**2)
        block = covariance[5 * k : 5 * k + 5, 5 * k : 5 * k + 5]
        np.testing.assert_allclose(block, expected, atol=2e-4)
    np.testing.assert_allclose(np.diag(covariance[:5, 5:]), strong, rtol=1e-9)


def test_measures_of_the_movement_by_hand() -> None:
    both = ("sample", "increment")
    ds = xr.Dataset(
        {
            "central_deflection": (both, [[0.0, 4e-3], [0.0, 6e-3]]),
            "deflection_ratio": (both, [[0.0, 1e-3], [0.0, 2e-3]]),
            "section_curvature": ((*both, "section"), [[[0, 0.0], [1e-3, -3e-3]], [[2e-3, 1e-3], [5e-3, 4e-3]]]),
            "surface_movement": (both, np.full((2, 2), np.nan), {"units": "m", "long_name": "of the ground"}),
        }
    )
    np.testing.assert_allclose(intensity_values(ds, "curvature"), [[0, 2e-3], [0, 8 * 4e-6 / 6e-3]], rtol=1e-12)
    np.testing.assert_allclose(intensity_values(ds, "footing_curvature"), [[0, 3e-3], [2e-3, 5e-3]])
    assert (movement_measure(ds), chosen_intensity(ds, None)) == ("central_deflection", "central_deflection")
    assert attributes(ds, "curvature")["units"] == "m-1"
    assert attributes(ds, "surface_movement") == {"units": "m", "long_name": "of the ground"}
    with pytest.raises(InputError, match=r"no variable 'surface_movement' with values; it has .*curvature"):
        chosen_intensity(ds, "surface_movement")
    ds["surface_movement"].values[0, 0] = 0.0
    assert movement_measure(ds) == "surface_movement"


def test_rules_to_stop_by_hand() -> None:
    assert (interim_sizes(8, 100), interim_sizes(8, 8), interim_sizes(64, 20)) == ([8, 16, 32, 64, 100], [8], [20])
    assert interim_confidence([8, 16, 32], 0.9, True) == pytest.approx(0.9 ** (1 / 3))
    assert interim_confidence([8], 0.9, False) == 0.9
    known = Estimate(0.4, 0.1, 0.3, 0.5, 0.9, 24, 24.0)  # value, error, lower, upper
    assert known.half_width == pytest.approx(0.1)
    rules = [
        ({"half_width": 0.1 + 1e-9}, True),
        ({"half_width": 0.099}, False),
        ({"relative_half_width": 0.251}, True),
        ({"relative_half_width": 0.249}, False),
    ]
    for width, met in rules:
        assert StopWhen(category=2, at="6 mm", **width).met(known) == met
    rule = StopWhen(category=2, at="6.5 mm", half_width=0.1)
    assert rule.name() == "P(category >= 2 at 6.5 mm)"
    assert not rule.met(known._replace(lower=-np.inf, upper=np.inf))
    for wrong in (
        {"at": 1.0},
        {"at": 1.0, "half_width": 0.1, "relative_half_width": 0.1},
    ):
        with pytest.raises(InputError, match="takes half_width or relative_half_width, one of them"):
            StopWhen(category=1, **wrong)
    with pytest.raises(InputError, match="at: is missing"):
        StopWhen(category=1, half_width=0.1)
    assert build(StopWhen, {"category": 1, "at": 1.0, "half_width": 0.1, "quantity": "probability"}, "").at == 1.0
    with pytest.raises(InputError, match="quantity = 'median': has been removed; give at"):
        build(StopWhen, {"category": 1, "half_width": 0.1, "quantity": "median"}, "study.toml")
