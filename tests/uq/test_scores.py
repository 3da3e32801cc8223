"""Scores against closed forms: CRPS of the normal and the uniform, uniform PIT, coverage, and the interval of a COV."""

import numpy as np
import pytest
from scipy.stats import kstest, norm

from damagepred.errors import InputError
from studies.validation.scores import cov_interval, coverage, crps, pit


@pytest.mark.parametrize("y", [-2.0, 0.0, 0.7, 3.0])
def test_crps_of_the_normal(y: float) -> None:
    """y (2 Phi(y) - 1) + 2 phi(y) - 1 / sqrt(pi) (Gneiting and Raftery 2007, eq. 21)."""
    ensemble = norm.ppf((np.arange(4000) + 0.5) / 4000)
    expected = y * (2 * norm.cdf(y) - 1) + 2 * norm.pdf(y) - 1 / np.sqrt(np.pi)
    assert crps(ensemble, y)[0] == pytest.approx(expected, abs=1e-3)


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


def test_the_interval_of_a_cov_covers_the_truth() -> None:
    rng = np.random.default_rng(5)
    sigma = np.sqrt(np.log1p(0.25**2))
    inside = 0
    for _ in range(2000):
        sample = rng.lognormal(0.0, sigma, 20)
        low, high = cov_interval(float(np.sqrt(np.expm1(np.log(sample).var(ddof=1)))), 20, 0.9)
        inside += low <= 0.25 <= high
    assert inside / 2000 == pytest.approx(0.9, abs=0.02)


def test_wrong_input_is_named() -> None:
    with pytest.raises(InputError, match="at least 2 finite"):
        crps([1.0], 1.0)
    with pytest.raises(InputError, match="share = 2"):
        coverage([1.0, 2.0], 1.0, 2.0)
    with pytest.raises(InputError, match="cov_interval"):
        cov_interval(0.2, 1)
