"""Sobol's indices: closed forms, SALib and OpenTURNS on Ishigami's function, and values that are refused."""

import math

import numpy as np
import openturns as ot
import pytest
from SALib.analyze import sobol

from damagepred.errors import InputError
from damagepred.uq.sensitivity import saltelli_points, saltelli_rows, sobol_indices

NAMES = ["x1", "x2", "x3"]


def ishigami(unit: np.ndarray, a: float = 7.0, b: float = 0.1) -> np.ndarray:
    x = math.pi * (2 * unit - 1)
    return np.sin(x[:, 0]) + a * np.sin(x[:, 1]) ** 2 + b * x[:, 2] ** 4 * np.sin(x[:, 0])


def closed_form(a: float = 7.0, b: float = 0.1) -> tuple[np.ndarray, np.ndarray]:
    """Ishigami and Homma 1990."""
    alone = 0.5 * (1 + b * math.pi**4 / 5) ** 2, a**2 / 8, 0.0
    together = b**2 * math.pi**8 * (1 / 18 - 1 / 50)
    variance = sum(alone) + together
    return np.array(alone) / variance, np.array([alone[0] + together, alone[1], together]) / variance


def test_ishigami_in_closed_form() -> None:
    found = sobol_indices(ishigami(saltelli_points(3, 2**12, 1)), NAMES, resamples=50)
    first, total = closed_form()
    np.testing.assert_allclose(found["first_order"], first, atol=0.01)
    np.testing.assert_allclose(found["total"], total, atol=0.01)
    assert (found["first_order_error"] > 0).all()
    assert found["variable"].values.tolist() == NAMES


@pytest.mark.parametrize("size", [8, 100, 1024])
def test_salib_gets_the_same_to_the_last_digits(size: int) -> None:
    values = ishigami(saltelli_points(3, size, 2))
    problem = {"num_vars": 3, "names": NAMES, "bounds": [[0, 1]] * 3}
    theirs = sobol.analyze(problem, values, calc_second_order=False, num_resamples=2, seed=1)
    ours = sobol_indices(values, NAMES, resamples=0)
    np.testing.assert_allclose(ours["first_order"], theirs["S1"], rtol=0, atol=1e-13)
    np.testing.assert_allclose(ours["total"], theirs["ST"], rtol=0, atol=1e-13)


def test_openturns_computes_the_same_from_its_own_points() -> None:
    size = 2**12
    inputs = ot.JointDistribution([ot.Uniform(0, 1)] * 3)
    design = ot.SobolIndicesExperiment(ot.LowDiscrepancyExperiment(ot.SobolSequence(), inputs, size)).generate()
    values = ot.Sample(ishigami(np.array(design))[:, None])
    theirs = ot.SaltelliSensitivityAlgorithm(design, values, size)
    ours = sobol_indices(ishigami(saltelli_points(3, size, 3)), NAMES, resamples=0)
    np.testing.assert_allclose(ours["first_order"], theirs.getFirstOrderIndices(), atol=0.015)
    np.testing.assert_allclose(ours["total"], theirs.getTotalOrderIndices(), atol=0.015)


def test_intervals_of_random_points_have_the_stated_coverage() -> None:
    first, total = closed_form()
    held = []
    for seed in range(60):
        random = np.random.default_rng([11, seed])
        rows = saltelli_rows(random.random((300, 3)), random.random((300, 3)))
        found = sobol_indices(ishigami(rows), NAMES, resamples=200, seed=seed)
        for name, truth in (("first_order", first), ("total", total)):
            held.append((found[f"{name}_lower"].values <= truth) & (truth <= found[f"{name}_upper"].values))
    # 360 intervals of 90 %, some of them of one and the same points
    assert 0.84 < np.mean(held) < 0.95


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_an_unknown_value_is_refused(bad: float) -> None:
    values = ishigami(saltelli_points(3, 16, 1))
    values[[7, 30]] = bad
    with pytest.raises(InputError, match="2 of 80 values are not finite, the first in row 7"):
        sobol_indices(values, NAMES)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        (np.ones(80), "all 80 values are 1"),
        (np.arange(81.0), "there must be 5 for each"),
        (np.arange(5.0), "two or more base points"),
        (np.ones((16, 5)), "there must be 5"),
    ],
)
def test_values_that_give_no_indices(values: np.ndarray, words: str) -> None:
    with pytest.raises(InputError, match=words):
        sobol_indices(values, NAMES)


def test_confidence_is_a_share() -> None:
    with pytest.raises(InputError, match=r"confidence = 90"):
        sobol_indices(np.arange(80.0), NAMES, confidence=90)
