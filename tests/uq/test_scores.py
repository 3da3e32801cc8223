"""Scores against closed forms: CRPS of the normal and the uniform, uniform PIT, coverage, and the interval of a COV."""

import numpy as np
import pytest
from scipy.stats import kstest

from studies.validation.scores import coverage, crps, pit


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
