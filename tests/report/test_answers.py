"""Sentences that end a comparison, an estimate and a back-analysis."""

import numpy as np
import pytest
import xarray as xr

from damagepred.report.answers import comparison_answer, estimate_answer, posterior_answer
from damagepred.uq.estimate import Estimate


def comparison(*differences: tuple[float, float, float]) -> xr.Dataset:
    """Comparison of a category at one movement: reference 0.5, and a measure for each difference with its interval."""
    names = ["as it is", "joint", "deep"][: len(differences) + 1]
    value, lower, upper = (np.array([0.0, *column]).reshape(-1, 1, 1) for column in zip(*differences))
    dims = ("study", "category", "movement")
    variables = {"difference": value, "difference_lower": lower, "difference_upper": upper, "probability": 0.5 + value}
    return xr.Dataset(
        {name: (dims, array) for name, array in variables.items()},
        {"study": names, "category": [2], "movement": [0.01]},
        {"confidence": 0.9, "reference": "as it is"},
    )


@pytest.mark.parametrize(
    ("differences", "said"),
    [
        (
            [(-0.043, -0.07, -0.009), (-0.03, -0.058, -0.025)],
            "Lower than 0.50, the probability of category 2 or worse: joint to 0.46; deep to 0.47. Their intervals "
            "overlap: which of them helps most is not known.",
        ),
        (
            [(-0.4, -0.5, -0.3), (-0.1, -0.2, -0.05)],
            "Lower than 0.50, the probability of category 2 or worse: joint to 0.10; deep to 0.40. joint helps most.",
        ),
        (
            [(-0.4, -0.5, -0.3), (-0.1, -0.2, 0.05)],
            "Lower than 0.50, the probability of category 2 or worse: joint to 0.10. The other measures may change it "
            "by chance alone.",
        ),
        (
            [(0.1, 0.05, 0.2)],
            "No measure is sure to lower the probability of category 2 or worse from 0.50. joint raises it.",
        ),
    ],
)
def test_a_measure_helps_most_only_where_intervals_part(differences: list[tuple[float, ...]], said: str) -> None:
    assert comparison_answer(comparison(*differences), 2, 0.01) == said


def test_without_damage_an_answer_names_the_upper_limit() -> None:
    none = comparison((0.0, -0.1, 0.1))
    none = none.assign(probability=0.0 * none["probability"], probability_upper=none["probability"] * 0.0 + 0.078)
    assert comparison_answer(none, 2, 0.01) == (
        "No sample of the studies reached category 2; its probability is at most 0.078 in each."
    )


def test_an_estimate_is_a_number_of_walls() -> None:
    def said(value: float) -> str:
        estimate = Estimate(value, 0.05, 0.31, 0.51, 0.9, 64, 64.0)
        return estimate_answer(estimate, 2, "25 mm")

    assert said(0.41) == (
        "Category 2 or worse at 25 mm: probability 0.41 (90% interval 0.31 to 0.51), about 41 walls in 100."
    )
    assert said(0.0).endswith(", none of the walls.")
    assert said(1.0).endswith(", all of the walls.")
    assert said(0.004).endswith(", fewer than 1 wall in 100.")


def posterior(odds: float, another: float, cut: float = 0.0) -> xr.Dataset:
    study = ("study", "further", "category")
    lower = np.array([[[1.0, 0.7, 0.0]], [[0.5, 0.2, 0.1]]]).repeat(2, axis=1)
    return xr.Dataset(
        (
            {"posterior_odds": ("study", [odds, 0.1 if np.isfinite(odds) else np.nan])}
            | {"another_cause_odds": ((), another), "resembles": ("study", [1, 1])}
            | {"movement_quantile": (("study", "quantile"), 1e-3 * np.array([[40.0, 45, 50, 55, 60]] * 2))}
            | {"movement_words": ("study", ["ground movement at the tree"] * 2)}
            | {"movement_units": ("study", ["m", "m"]), "movement_largest": ("study", [0.06, 0.06])}
            | {"movement_cut": ("study", [cut, 0.0]), "future_probability_lower": (study, lower)}
            | {"future_probability_upper": (study, lower + np.array([0.0, 0.1, 0.2]))}
        ),
        {"study": ["tree", "pipe"], "further": [0.0, 0.5], "category": [1, 2, 3]},
    )


def test_a_back_analysis_names_cause_movement_and_what_follows() -> None:
    assert posterior_answer(posterior(20.0, 0.05)) == (
        "Most probably tree (odds 20): ground movement at the tree of 50 mm (40 to 60). After 30 mm more, category 2 "
        "or worse has a probability of 0.70 to 0.80."
    )
    assert "(40 to 60 or more)" in posterior_answer(posterior(20.0, 0.05, cut=0.5))
    assert posterior_answer(posterior(2.0, 8.0)).startswith("Most probably another cause")
    assert posterior_answer(posterior(np.nan, np.nan)).startswith("No cause can be named yet")
    alien = posterior(20.0, 0.05).assign(resembles=("study", [0, 0]))
    assert posterior_answer(alien).startswith("No cause can be named: no stored sample resembles")
