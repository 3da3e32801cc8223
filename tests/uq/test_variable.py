"""Distributions: the right shape and moments, in SI, and clear words where the parameters make none."""

import math
import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy import special, stats

from damagepred.errors import InputError
from damagepred.scene import Scene
from damagepred.scene.reading import build
from damagepred.uq.design import Design
from damagepred.uq.variable import Variable

PLACE = "joint.cohesion"


def lognormal_cdf(mean: float, cov: float) -> Callable:
    """From the moments, by hand: ln X is normal with variance ln(1 + cov^2) and mean ln(mean) - variance/2."""
    variance = math.log(1 + cov**2)
    return lambda x: special.ndtr((np.log(x) - math.log(mean) + variance / 2) / math.sqrt(variance))


def truncated_cdf(mean: float, std: float, lower: float, upper: float) -> Callable:
    low, high = special.ndtr((lower - mean) / std), special.ndtr((upper - mean) / std)
    return lambda x: (special.ndtr((x - mean) / std) - low) / (high - low)


# variable as written, its unit, cumulative distribution in SI
FAMILIES: dict[str, tuple[dict, str, Callable]] = {
    "lognormal, cov": ({"distribution": "lognormal", "mean": 3e5, "cov": 0.4}, "Pa", lognormal_cdf(3e5, 0.4)),
    "lognormal, cov, unit": (
        {"distribution": "lognormal", "mean": "0.3 MPa", "cov": "40 %"},
        "Pa",
        lognormal_cdf(3e5, 0.4),
    ),
    "lognormal, std, unit": (
        {"distribution": "lognormal", "mean": "0.3 MPa", "std": "120 kPa"},
        "Pa",
        lognormal_cdf(3e5, 0.4),
    ),
    "lognormal, median": (
        {"distribution": "lognormal", "median": "8 mm", "dispersion": 0.45},
        "m",
        lambda x: special.ndtr(np.log(x / 8e-3) / 0.45),
    ),
    "normal, cov": (
        {"distribution": "normal", "mean": 2000.0, "cov": 0.05},
        "kg/m**3",
        lambda x: special.ndtr((x - 2000) / 100),
    ),
    "normal, std, unit": (
        {"distribution": "normal", "mean": "2 t/m3", "std": "100 kg/m3"},
        "kg/m**3",
        lambda x: special.ndtr((x - 2000) / 100),
    ),
    "normal, negative mean": (
        {"distribution": "normal", "mean": -2.0, "cov": 0.5},
        "1",
        lambda x: special.ndtr((x + 2) / 1.0),
    ),
    "truncated, cov": (
        {"distribution": "truncated_normal", "mean": 0.5, "cov": 0.2, "lower": 0.3, "upper": 0.7},
        "1",
        truncated_cdf(0.5, 0.1, 0.3, 0.7),
    ),
    "truncated, off centre": (
        {"distribution": "truncated_normal", "mean": "8 mm", "std": "4 mm", "lower": 0.0, "upper": "10 mm"},
        "m",
        truncated_cdf(8e-3, 4e-3, 0.0, 1e-2),
    ),
    "uniform": ({"distribution": "uniform", "lower": "40 mm", "upper": "6 cm"}, "m", lambda x: (x - 0.04) / 0.02),
}


def sampled(variable: Variable, unit: str, count: int = 4000, seed: int = 3) -> np.ndarray:
    return Design.make({PLACE: variable}, {PLACE: unit}, {}, "random", seed).wall_values(count)[PLACE]


@pytest.mark.parametrize("name", FAMILIES)
def test_samples_follow_the_stated_distribution(name: str):
    written, unit, cdf = FAMILIES[name]
    values = sampled(Variable(**written), unit)
    assert stats.kstest(values, cdf).pvalue > 1e-3


def test_every_family_of_the_shipped_study_samples_in_si(data_folder: Path):
    study = tomllib.loads((data_folder / "bryant_study.toml").read_text())
    wanted = {"joint.tensile_strength": 453e3, "joint.normal_stiffness": 82e9, "movement.central_deflection": 0.05}
    for place, mean in wanted.items():
        variable = build(Variable, study["variables"][place], place)
        assert variable.frozen(place, Scene.unit_of(place)).mean() == pytest.approx(mean, rel=1e-9)


WRONG: dict[str, tuple[dict, list[str]]] = {
    "nothing": ({"distribution": "lognormal"}, ["mean and cov or mean and std or median and dispersion", "nothing"]),
    "half": ({"distribution": "normal", "mean": 1.0}, ["a normal distribution takes mean and cov", "given: mean"]),
    "too much": (
        {"distribution": "lognormal", "mean": 1.0, "cov": 0.1, "std": 0.1},
        ["a lognormal distribution takes", "given: mean, std, cov"],
    ),
    "another family's": (
        {"distribution": "uniform", "median": 1.0, "dispersion": 0.1},
        ["uniform", "takes lower and upper"],
    ),
    "no bounds": ({"distribution": "truncated_normal", "mean": 1.0, "cov": 0.1}, ["mean and cov and lower and upper"]),
    "negative mean": ({"distribution": "lognormal", "mean": -1.0, "cov": 0.1}, ["mean = -1", "greater than 0"]),
    "zero mean": ({"distribution": "lognormal", "mean": 0.0, "std": 0.1}, ["mean = 0", "greater than 0"]),
    "zero median": ({"distribution": "lognormal", "median": 0.0, "dispersion": 0.1}, ["median = 0", "greater than 0"]),
    "no scatter": ({"distribution": "normal", "mean": 0.0, "cov": 0.1}, ["standard deviation is 0", "std instead"]),
    "negative std": ({"distribution": "normal", "mean": 1.0, "std": -0.1}, ["standard deviation is -0.1"]),
    "bounds swapped": ({"distribution": "uniform", "lower": 2.0, "upper": 1.0}, ["lower = 2", "below upper = 1"]),
    "bounds equal": ({"distribution": "uniform", "lower": 2.0, "upper": 2.0}, ["lower = 2", "below upper = 2"]),
    "bounds far off": (
        {"distribution": "truncated_normal", "mean": 0.0, "std": 1.0, "lower": 9.0, "upper": 10.0},
        ["no part of the distribution lies between"],
    ),
    "wrong unit": ({"distribution": "normal", "mean": "8 mm", "cov": 0.1}, ["mean = '8 mm'", "'0.453 MPa'"]),
    "wrong unit of cov": ({"distribution": "normal", "mean": 1.0, "std": "8 mm"}, ["std = '8 mm'", "'0.453 MPa'"]),
    "nan": ({"distribution": "normal", "mean": "nan", "cov": 0.1}, ["mean = 'nan'", "finite"]),
    "garbage": ({"distribution": "normal", "mean": "much", "cov": 0.1}, ["mean = 'much'", "number with a unit"]),
}


@pytest.mark.parametrize("name", WRONG)
def test_parameters_that_make_no_distribution(name: str):
    written, words = WRONG[name]
    with pytest.raises(InputError) as caught:
        build(Variable, written, "study.toml").frozen(PLACE, "Pa")
    message = str(caught.value)
    assert f'[variables."{PLACE}"]' in message
    for word in words:
        assert word in message, message


@pytest.mark.parametrize(
    ("written", "words"),
    [
        ({"distribution": "lognormla", "mean": 1, "cov": 0.1}, "Did you mean 'lognormal'"),
        ({"distribution": "normal", "mean": 1, "cov": 0.0}, "cov = 0.0: must be greater than 0"),
        ({"distribution": "normal", "mean": 1, "cov": -0.1}, "cov = -0.1: must be greater than 0"),
        ({"distribution": "normal", "mean": 1, "cv": 0.1}, "Did you mean 'cov'"),
        ({"distribution": "normal", "mean": True, "cov": 0.1}, "mean = True"),
        ({"distribution": "normal", "mean": float("nan"), "cov": 0.1}, "mean"),
        ({"mean": 1, "cov": 0.1}, "distribution: is missing"),
        ({"distribution": "normal", "mean": 1, "cov": 0.1, "field": {"course_correlation": 1.0}}, "less than 1"),
        ({"distribution": "normal", "mean": 1, "cov": 0.1, "field": {"course_correlation": -0.1}}, "at least 0"),
        ({"distribution": "normal", "mean": 1, "cov": 0.1, "field": {"correlation": 0.1}}, "unknown key"),
    ],
)
def test_keys_and_values_that_are_none(written: dict, words: str):
    with pytest.raises(InputError) as caught:
        build(Variable, written, "study.toml")
    assert words in str(caught.value)
