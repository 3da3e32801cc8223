"""Rank correlation, first-order shares: scipy, closed forms, coverage, censored walls."""

import math

import numpy as np
import pytest
from scipy import stats

from damagepred.errors import InputError
from damagepred.uq.sensitivity import _slices, interval_ranks, ranks, sensitivity_indices

INF = np.inf


def ishigami(unit: np.ndarray, a: float = 7.0, b: float = 0.1) -> np.ndarray:
    x = math.pi * (2 * unit - 1)
    return np.sin(x[:, 0]) + a * np.sin(x[:, 1]) ** 2 + b * x[:, 2] ** 4 * np.sin(x[:, 0])


def closed_form(a: float = 7.0, b: float = 0.1) -> tuple[np.ndarray, np.ndarray]:
    """Ishigami and Homma 1990."""
    alone = 0.5 * (1 + b * math.pi**4 / 5) ** 2, a**2 / 8, 0.0
    together = b**2 * math.pi**8 * (1 / 18 - 1 / 50)
    variance = sum(alone) + together
    return np.array(alone) / variance, np.array([alone[0] + together, alone[1], together]) / variance


def test_ranks_are_scipy_s() -> None:
    values = np.array([3.0, 1, 3, 2, 9, 3])
    np.testing.assert_allclose(ranks(values), (stats.rankdata(values) - 0.5) / 6)
    # weight 2 is to be there twice
    np.testing.assert_allclose(
        ranks(np.array([1.0, 2, 3]), np.array([1.0, 2, 1])), ranks(np.array([1.0, 2, 2, 3]))[[0, 1, 3]]
    )


def test_scores_by_hand() -> None:
    """Capacities 1 and 3, and a wall sound up to 2: (0 + 1/3) / 2, (1/3 + 1) / 2 twice, by the product limit."""
    found = interval_ranks(np.array([1.0, 2.0, 3.0]), np.array([1.0, INF, 3.0]))
    np.testing.assert_allclose(found, [1 / 6, 2 / 3, 2 / 3])
    double = interval_ranks(np.array([1.0, 2.0, 3.0]), np.array([1.0, INF, 3.0]), np.array([2.0, 1.0, 1.0]))
    np.testing.assert_allclose(double, [0.25, 0.75, 0.75])


def test_rank_correlation_is_scipy_s_and_partial_that_of_residuals() -> None:
    """Weights count as repetitions, and a constant input is left out."""
    random = np.random.default_rng(2)
    x = random.standard_normal((3, 150))
    x[1] = 0.6 * x[0] + 0.8 * x[1]
    y = np.round(x[0] + 0.5 * x[1] ** 3 + 0.4 * random.standard_normal(150), 1)
    count = random.integers(1, 4, 150)
    found = sensitivity_indices(dict(zip("abcd", (*x, np.ones(150)))), y, weight=count * 0.5, resamples=0)
    assert found["variable"].values.tolist() == ["a", "b", "c"]
    assert (found.attrs["walls"], found.attrs["confidence"]) == (150, 0.9)
    assert np.isnan(found["spearman_lower"]).all()
    table = np.array([stats.rankdata(np.repeat(v, count)) for v in (*x, y)])
    np.testing.assert_allclose(found["spearman"], np.corrcoef(table)[:3, 3])
    for k in range(3):
        others = np.column_stack((np.ones(count.sum()), np.delete(table[:3], k, axis=0).T))
        rest = [row - others @ np.linalg.lstsq(others, row)[0] for row in (table[k], table[3])]
        assert float(found["partial"][k]) == pytest.approx(np.corrcoef(*rest)[0, 1], abs=1e-10)


def test_first_order_shares_of_ishigami() -> None:
    unit = np.random.default_rng(5).random((8000, 3))
    found = sensitivity_indices(dict(zip("abc", unit.T)), ishigami(unit), resamples=30)
    np.testing.assert_allclose(found["first_order"], closed_form()[0], atol=0.03)
    # rank correlation cannot detect it: the effect of the second input is not monotone
    assert abs(float(sensitivity_indices({"b": unit[:, 1]}, ishigami(unit), resamples=0)["spearman"][0])) < 0.05


def test_first_order_share_of_weighted_walls_by_hand() -> None:
    """Three slices of means -3, 0, 3, one off them either way: 24 of 168 within, by 24^2 / 60 = 9.6 equal walls."""
    y = np.repeat([-3.0, 0.0, 3.0], 4) + np.tile([1.0, -1.0, 1.0, -1.0], 3)
    weight = np.tile([3.0, 3.0, 1.0, 1.0], 3)
    found = sensitivity_indices({"x": np.arange(12.0)}, y, weight=weight, resamples=0)
    assert _slices(12) == 3
    assert float(found["first_order"][0]) == pytest.approx(1.0 - (24.0 / (9.6 - 3.0)) / (168.0 / (9.6 - 1.0)))


@pytest.mark.parametrize(("confidence", "factor"), [(0.9, 1.6448536), (0.6, 0.8416212)])
def test_intervals_are_the_error_times_the_normal_s_quantile(confidence: float, factor: float) -> None:
    """The error is the scatter of the walls drawn again; that of a mean would be its square root of n times less."""
    random = np.random.default_rng(8)
    x, e = random.standard_normal((2, 90))
    found = sensitivity_indices({"x": x}, x + 0.7 * e, resamples=40, confidence=confidence)
    value, error, lower, upper = (float(found[f"first_order{end}"][0]) for end in ("", "_error", "_lower", "_upper"))
    assert (upper - value, value - lower) == pytest.approx((factor * error, factor * error), rel=1e-6)
    again = [
        float(sensitivity_indices({"x": x[some]}, x[some] + 0.7 * e[some], resamples=0)["first_order"][0])
        for some in (np.random.default_rng(s).integers(90, size=90) for s in range(300))
    ]
    assert error == pytest.approx(np.std(again), rel=0.35)


@pytest.mark.parametrize(
    ("inputs", "output", "words"),
    [
        ({"x": np.append(np.arange(19.0), np.nan)}, np.arange(20.0), "x: 1 of 20 values are not finite"),
        ({"x": np.arange(20.0)}, np.append(np.arange(19.0), np.nan), "the output: 1 of 20 values"),
        ({"x": np.arange(20.0)}, np.ones(20), "from 1 to 1"),
        ({"x": np.ones(20)}, np.arange(20.0), "all are constant"),
        ({"x": np.arange(5.0)}, np.arange(5.0), "at least 10 samples"),
    ],
)
def test_invalid_input_is_refused(inputs: dict, output: np.ndarray, words: str) -> None:
    with pytest.raises(InputError, match=words):
        sensitivity_indices(inputs, output)
