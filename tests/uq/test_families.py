"""All families of a study file against formulas by hand, and distributions of the movement."""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from scipy import special, stats

from damagepred.errors import InputError
from damagepred.scene.described import build
from damagepred.uq.design import Design
from damagepred.uq.exceedance import exceedance
from damagepred.uq.fields import JointPlaces
from damagepred.uq.marginals import JointQuantile, Mixture, Table, from_normal
from damagepred.uq.movement_distribution import movement_distribution
from damagepred.uq.variable import JointField, Variable

PLACE = "joint.cohesion"
TABLE = f'[variables."{PLACE}"]'


def lognormal_cdf(mean: float, cov: float) -> Callable:
    """From the moments, by hand: ln X is normal with variance ln(1 + cov^2) and mean ln(mean) - variance/2."""
    variance = math.log(1 + cov**2)
    return lambda x: special.ndtr((np.log(x) - math.log(mean) + variance / 2) / math.sqrt(variance))


def truncated_cdf(mean: float, std: float, lower: float, upper: float) -> Callable:
    low, high = special.ndtr((lower - mean) / std), special.ndtr((upper - mean) / std)
    return lambda x: (special.ndtr((x - mean) / std) - low) / (high - low)


def of(distribution: str, **keys: object) -> dict[str, object]:
    return {"distribution": distribution, **keys}


GAMMA, GUMBEL = math.gamma(1.5), math.pi / math.sqrt(6)  # mean of Weibull at shape 2, deviation of Gumbel
FLAWED = of("normal", weight=1, mean="0.5 MPa", cov=0.1)
# variable as written, and its unit
FAMILIES = {
    "weibull, own": (of("weibull", shape=2.0, scale="0.5 MPa"), "Pa"),
    "weibull, mean": (of("weibull", mean=1.0, cov=math.sqrt(4 / math.pi - 1)), "1"),  # cov of shape 2
    "weibull, from a lower end": (of("weibull", mean=3.0, std=1.0, lower=2.0), "1"),  # shape 1 is exponential
    "gamma, own": (of("gamma", shape=3.0, scale=2.0), "1"),
    "gamma, cov": (of("gamma", mean="8 mm", cov=0.5), "m"),
    "gamma, from a lower end": (of("gamma", mean=10.0, std=4.0, lower=2.0), "1"),
    "beta, own": (of("beta", alpha=2.0, beta=3.0, lower="0.3", upper=0.8), "1"),
    "beta, std": (of("beta", mean=0.5, std=0.1, lower=0.3, upper=0.8), "1"),
    "uniform, mean": (of("uniform", mean="50 mm", std=f"{10 / math.sqrt(3)} mm"), "m"),
    "scipy, own": (of("scipy", name="gumbel_r", parameters={"loc": "0.4 MPa", "scale": "0.1 MPa"}), "Pa"),
    "scipy, mean": (of("scipy", name="gumbel_r", mean=2.0, cov=math.pi / math.sqrt(6) / 2), "1"),
    "scipy, with a shape": (of("scipy", name="triang", parameters={"c": 0.5}, mean=3.0, std=1 / math.sqrt(6)), "1"),
    "mixture": (of("mixture", components=[of("normal", weight=19, mean="1 MPa", cov=0.1), FLAWED]), "Pa"),
    "lognormal, cov": (of("lognormal", mean=3e5, cov=0.4), "Pa"),
    "lognormal, cov, unit": (of("lognormal", mean="0.3 MPa", cov="40 %"), "Pa"),
    "lognormal, std, unit": (of("lognormal", mean="0.3 MPa", std="120 kPa"), "Pa"),
    "lognormal, median": (of("lognormal", median="8 mm", dispersion=0.45), "m"),
    "normal, cov": (of("normal", mean=2000.0, cov=0.05), "kg/m**3"),
    "normal, std, unit": (of("normal", mean="2 t/m3", std="100 kg/m3"), "kg/m**3"),
    "normal, negative mean": (of("normal", mean=-2.0, cov=0.5), "1"),
    "truncated, cov": (of("truncated_normal", mean=0.5, cov=0.2, lower=0.3, upper=0.7), "1"),
    "truncated, off centre": (of("truncated_normal", mean="8 mm", std="4 mm", lower=0.0, upper="10 mm"), "m"),
    "uniform": (of("uniform", lower="40 mm", upper="6 cm"), "m"),
}
# cumulative distribution in SI; of some mean and standard deviation: by hand, not by scipy.stats
EXACT: dict[str, tuple] = {
    "weibull, own": (lambda x: 1 - np.exp(-((x / 5e5) ** 2)), 5e5 * GAMMA, 5e5 * math.sqrt(1 - GAMMA**2)),
    "weibull, mean": (lambda x: 1 - np.exp(-((x * GAMMA) ** 2)), 1.0, math.sqrt(4 / math.pi - 1)),
    "weibull, from a lower end": (lambda x: 1 - np.exp(-(x - 2.0)), 3.0, 1.0),
    "gamma, own": (lambda x: special.gammainc(3.0, x / 2.0), 6.0, 2 * math.sqrt(3)),
    "gamma, cov": (lambda x: special.gammainc(4.0, x / 2e-3), 8e-3, 4e-3),
    "gamma, from a lower end": (lambda x: special.gammainc(4.0, (x - 2) / 2), 10.0, 4.0),
    "beta, own": (lambda x: special.betainc(2.0, 3.0, (x - 0.3) / 0.5), 0.5, 0.1),
    "beta, std": (lambda x: special.betainc(2.0, 3.0, (x - 0.3) / 0.5), 0.5, 0.1),
    "uniform, mean": (lambda x: np.clip((x - 0.04) / 0.02, 0, 1), 0.05, 0.01 / math.sqrt(3)),
    "scipy, own": (lambda x: np.exp(-np.exp(-(x - 4e5) / 1e5)), 4e5 + 1e5 * np.euler_gamma, 1e5 * GUMBEL),
    "scipy, mean": (lambda x: np.exp(-np.exp(-(x - 2.0 + np.euler_gamma))), 2.0, GUMBEL),
    "scipy, with a shape": (lambda x: np.where(x < 3, (x - 2) ** 2 / 2, 1 - (4 - x) ** 2 / 2), 3.0, 1 / math.sqrt(6)),
    "mixture": (
        lambda x: 0.95 * special.ndtr((x - 1e6) / 1e5) + 0.05 * special.ndtr((x - 5e5) / 5e4),
        0.975e6,
        math.sqrt(0.95 * (1e10 + 0.025e6**2) + 0.05 * (2.5e9 + 0.475e6**2)),
    ),
    "lognormal, cov": (lognormal_cdf(3e5, 0.4),),
    "lognormal, cov, unit": (lognormal_cdf(3e5, 0.4),),
    "lognormal, std, unit": (lognormal_cdf(3e5, 0.4),),
    "lognormal, median": (lambda x: special.ndtr(np.log(x / 8e-3) / 0.45),),
    "normal, cov": (lambda x: special.ndtr((x - 2000) / 100),),
    "normal, std, unit": (lambda x: special.ndtr((x - 2000) / 100),),
    "normal, negative mean": (lambda x: special.ndtr((x + 2) / 1.0),),
    "truncated, cov": (truncated_cdf(0.5, 0.1, 0.3, 0.7),),
    "truncated, off centre": (truncated_cdf(8e-3, 4e-3, 0.0, 1e-2),),
    "uniform": (lambda x: (x - 0.04) / 0.02,),
}


def sampled(written: dict, unit: str, count: int = 4000, seed: int = 3) -> np.ndarray:
    variable = build(Variable, written, "study.toml")
    return Design.make({PLACE: variable}, {PLACE: unit}, {}, "random", seed).wall_values(count)[PLACE]


@pytest.mark.parametrize("name", FAMILIES)
def test_samples_follow_the_stated_distribution(name: str):
    (written, unit), (cdf, *moments) = FAMILIES[name], EXACT[name]
    assert stats.kstest(sampled(written, unit), cdf).pvalue > 1e-3
    frozen = build(Variable, written, "study.toml").frozen(TABLE, unit)
    if moments:
        assert (frozen.mean(), frozen.std()) == pytest.approx(tuple(moments), rel=1e-9)


def test_a_discrete_distribution_of_scipy():
    written = of("scipy", name="poisson", parameters={"mu": 2.5, "loc": 1})
    values = sampled(written, "1", 8000) - 1
    expected = np.array([math.exp(-2.5) * 2.5**k / math.factorial(k) for k in range(6)])
    count = np.bincount(np.minimum(values.astype(int), 6), minlength=7)
    assert stats.chisquare(count, 8000 * np.append(expected, 1 - expected.sum())).pvalue > 1e-3


def test_joints_without_bond():
    """A share of joints that have none at all, the others lognormal: an atom and a density, joint by joint."""
    sound = {"weight": 0.9, "distribution": "lognormal", "mean": 1.0, "cov": 0.3}
    none = {"weight": 0.1, "distribution": "discrete", "values": [0.0]}
    variable = build(Variable, of("mixture", components=[sound, none]), "study.toml")
    field = Variable(distribution="mixture", components=variable.components, field=JointField(course_correlation=0.4))
    design = Design.make({PLACE: field}, {PLACE: "1"}, {}, "sobol", 1)
    places = JointPlaces(np.arange(300) // 20, np.zeros(300, int), np.arange(300.0), np.zeros(300), 1.0)
    values = np.array([design.joint_values(i, places)[PLACE] for i in range(40)])
    assert (values == 0).mean() == pytest.approx(0.1, abs=4 * math.sqrt(0.09 / 12000 * 1.8))
    s = math.sqrt(math.log(1.09))
    independent = values[:, ::20].ravel()  # the first joints of each course
    bonded = independent[independent > 0]
    assert stats.kstest(np.log(bonded), stats.norm(-(s**2) / 2, s).cdf).pvalue > 1e-3
    # the stated correlation is that of the variable, atom and all
    pairs = values.reshape(40, 15, 20)
    found = np.corrcoef(pairs[:, :, 1:].ravel(), pairs[:, :, :-1].ravel())[0, 1]
    assert found == pytest.approx(0.4, abs=0.03)


MEASURED = "\n".join(["# bond wrench, site B", "unit, strength, age", "1, 0.41, 28", "", "2, 0.52, 28", "3, , 7"])


def test_a_study_beside_its_file_keeps_the_values_themselves(tmp_path: Path):
    from damagepred.campaign.settings import StudySettings, read_frozen

    (tmp_path / "bond.csv").write_text(MEASURED)
    (tmp_path / "house.toml").write_text(
        "[scene.wall]\nlength = 2.4\n[variables.'joint.cohesion']\ndistribution = 'empirical'\n"
        "file = 'bond.csv'\ncolumn = 'strength'\nunit = 'MPa'\n"
    )
    settings = StudySettings.from_toml(tmp_path / "house.toml")
    (tmp_path / "bond.csv").unlink()
    assert read_frozen(settings.to_toml()).variables[PLACE].values == pytest.approx((0.41e6, 0.52e6))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"file": "band.csv"}, ["file = ", "band.csv", "no such file", "Did you mean 'bond.csv'"]),
        ({"column": "strenght"}, ["column = 'strenght'", "unit, strength, age", "Did you mean 'strength'"]),
        ({"unit": "mm"}, ["unit = 'mm'", "wrong kind of unit"]),
        ({"column": None}, ["the name of a column"]),
        ({"values": (1.0,)}, ["no values"]),
        (of("discrete"), ["distribution = 'empirical'"]),
    ],
)
def test_files_that_cannot_be_read(tmp_path: Path, change: dict, words: list[str]):
    (tmp_path / "bond.csv").write_text(MEASURED)
    written = of("empirical", file="bond.csv", column="strength", unit="MPa") | change
    with pytest.raises(InputError) as caught:
        Variable(**written).with_values(TABLE, "Pa", tmp_path)
    for word in [f'[variables."{PLACE}"]', *words]:
        assert word in str(caught.value)


def test_a_word_in_a_column_of_numbers(tmp_path: Path):
    (tmp_path / "bond.csv").write_text(MEASURED.replace("0.52", "0.52 MPa"))
    with pytest.raises(InputError, match=r"line 5, strength = '0\.52 MPa': is no plain number"):
        Variable(distribution="empirical", file="bond.csv", column="strength").with_values(TABLE, "Pa", tmp_path)


TWO = [of("normal", weight=1, mean=1, cov=0.1)] * 2

WRONG: dict[str, tuple[dict, list[str]]] = {
    "weibull half": (of("weibull", shape=2), ["weibull", "shape and scale", "given: shape"]),
    "weibull below": (of("weibull", mean=1, cov=0.1, lower=2), ["mean = 1", "greater than 2"]),
    "weibull narrow": (of("weibull", mean=1, cov=1e-4), ["0.0001", "0.005 to 10"]),
    "gamma negative": (of("gamma", mean=-1, cov=0.1), ["mean = -1", "greater than 0"]),
    "beta open": (of("beta", alpha=2, beta=2), ["alpha and beta and lower and upper"]),
    "beta outside": (of("beta", mean=2, std=0.1, lower=0, upper=1), ["mean = 2", "between lower and"]),
    "beta wide": (of("beta", mean=0.5, std=0.6, lower=0, upper=1), ["below 0.5", "given: 0.6"]),
    "discrete nothing": (of("discrete"), ["values: has none"]),
    "discrete mean": (of("discrete", values=[1], mean=1), ["takes values and weights", "mean"]),
    "discrete weights": (of("discrete", values=[1, 2], weights=[1]), ["weights: 1 of them for 2"]),
    "discrete unit": (of("discrete", values=["1 m"]), ["values, item 1 = '1 m'", "wrong kind"]),
    "empirical weights": (of("empirical", values=[1], weights=[1]), ["weights: is not read"]),
    "normal values": (of("normal", mean=1, cov=0.1, values=[1]), ["values: is not read"]),
    "scipy nameless": (of("scipy"), ["name: is missing"]),
    "scipy name": (of("scipy", name="gumble_r"), ["no such distribution", "Did you mean 'gumbel_r'"]),
    "scipy key": (
        of("scipy", name="gumbel_r", parameters={"scal": 1}),
        ["parameters.scal", "takes here loc, scale", "Did you mean 'scale'"],
    ),
    "scipy shape missing": (of("scipy", name="triang"), ["also needs c"]),
    "scipy impossible": (of("scipy", name="triang", parameters={"c": 2}), ["no distribution with c = 2"]),
    "scipy both": (
        of("scipy", name="norm", mean=1, cov=0.1, parameters={"loc": 1}),
        ["parameters.loc", "follow from mean and scatter"],
    ),
    "scipy half": (of("scipy", name="norm", mean=1), ["or mean and cov, or mean and std"]),
    "scipy no moments": (of("scipy", name="cauchy", mean=1, cov=1), ["no mean and scatter"]),
    "scipy discrete mean": (
        of("scipy", name="poisson", mean=1, cov=1, parameters={"mu": 1}),
        ["is discrete and takes its own"],
    ),
    "mixture of one": (of("mixture", components=TWO[:1]), ["has 1; a mixture takes two or more"]),
    "mixture with a mean": (of("mixture", mean=0, components=TWO), ["takes components", "mean"]),
    "mixture's part": (
        of("mixture", components=[TWO[0], of("normal", weight=1, mean=1)]),
        ["component 2: a normal distribution takes"],
    ),
    "no mixture": (of("normal", mean=1, cov=1, components=TWO), ["with distribution = 'mixture' only"]),
    "nothing": (of("lognormal"), ["mean and cov or mean and std or median and dispersion", "nothing"]),
    "half": (of("normal", mean=1.0), ["a normal distribution takes mean and cov", "given: mean"]),
    "too much": (
        of("lognormal", mean=1.0, cov=0.1, std=0.1),
        ["a lognormal distribution takes", "given: mean, std, cov"],
    ),
    "another family's": (of("uniform", median=1.0, dispersion=0.1), ["uniform", "takes lower and upper"]),
    "no bounds": (of("truncated_normal", mean=1.0, cov=0.1), ["mean and cov and lower and upper"]),
    "negative mean": (of("lognormal", mean=-1.0, cov=0.1), ["mean = -1", "greater than 0"]),
    "zero mean": (of("lognormal", mean=0.0, std=0.1), ["mean = 0", "greater than 0"]),
    "zero median": (of("lognormal", median=0.0, dispersion=0.1), ["median = 0", "greater than 0"]),
    "no scatter": (of("normal", mean=0.0, cov=0.1), ["standard deviation is 0", "std instead"]),
    "negative std": (of("normal", mean=1.0, std=-0.1), ["standard deviation is -0.1"]),
    "bounds swapped": (of("uniform", lower=2.0, upper=1.0), ["lower = 2", "below upper = 1"]),
    "bounds equal": (of("uniform", lower=2.0, upper=2.0), ["lower = 2", "below upper = 2"]),
    "bounds far off": (
        of("truncated_normal", mean=0.0, std=1.0, lower=9.0, upper=10.0),
        ["no part of the distribution lies between"],
    ),
    "wrong unit": (of("normal", mean="8 mm", cov=0.1), ["mean = '8 mm'", "'0.453 MPa'"]),
    "wrong unit of cov": (of("normal", mean=1.0, std="8 mm"), ["std = '8 mm'", "'0.453 MPa'"]),
    "nan": (of("normal", mean="nan", cov=0.1), ["mean = 'nan'", "finite"]),
    "garbage": (of("normal", mean="much", cov=0.1), ["mean = 'much'", "number with a unit"]),
}


@pytest.mark.parametrize("name", WRONG)
def test_parameters_that_make_no_distribution(name: str):
    written, words = WRONG[name]
    with pytest.raises(InputError) as caught:
        build(Variable, written, "study.toml").frozen(TABLE, "Pa")
    for word in [f'[variables."{PLACE}"]', *words]:
        assert word in str(caught.value), str(caught.value)


@pytest.mark.parametrize(
    ("field", "words"),
    [
        ({"correlation_length": "0.5 m", "course_correlation": 0.4}, "say the same in two ways"),
        ({"correlation_length": 0.0}, "greater than 0"),
        ({"vertical_length": 1.0}, "goes with a correlation_length over the wall"),
        ({"correlation_length": 1.0, "vertical_length": 1.0, "over": "course"}, "over the wall"),
        ({"course_correlation": 0.4, "nugget": 0.1}, "nugget: goes with a correlation_length"),
        ({"correlation_length": 1.0, "nugget": 1.0}, "less than 1"),
        ({"correlation_length": "1 Pa"}, "wrong kind of unit"),
        ({"over": "walls"}, "Did you mean 'wall'"),
    ],
)
def test_fields_that_are_none(field: dict, words: str):
    with pytest.raises(InputError, match="field") as caught:
        build(Variable, of("normal", mean=1, cov=0.1, field=field), "study.toml")
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("written", "words"),
    [
        (of("lognormla", mean=1, cov=0.1), "Did you mean 'lognormal'"),
        (of("normal", mean=1, cov=0.0), "cov = 0.0: must be greater than 0"),
        (of("normal", mean=1, cov=-0.1), "cov = -0.1: must be greater than 0"),
        (of("normal", mean=1, cv=0.1), "Did you mean 'cov'"),
        (of("normal", mean=True, cov=0.1), "mean = True"),
        (of("normal", mean=float("nan"), cov=0.1), "mean"),
        ({"mean": 1, "cov": 0.1}, "distribution: is missing"),
        (of("normal", mean=1, cov=0.1, field={"course_correlation": 1.0}), "less than 1"),
        (of("normal", mean=1, cov=0.1, field={"course_correlation": -0.1}), "at least 0"),
        (of("normal", mean=1, cov=0.1, field={"correlation": 0.1}), "unknown key"),
    ],
)
def test_keys_and_values_that_are_none(written: dict, words: str):
    with pytest.raises(InputError) as caught:
        build(Variable, written, "study.toml")
    assert words in str(caught.value)


MARGINALS = {
    "truncated normal": stats.truncnorm(-2, 2, loc=0.5, scale=0.1),
    "gamma": stats.gamma(11.0, scale=4e4),
    "beta": stats.beta(3.0, 2.0, loc=0.3, scale=0.4),
    "beta with a peak at an end": stats.beta(0.4, 5.0),
    "skewed normal": stats.skewnorm(2.0, loc=0.4, scale=0.05),
    "about zero": stats.t(5),
    "sound and weak": Mixture([stats.lognorm(s=0.3, scale=0.45e6), stats.lognorm(s=0.3, scale=0.2e6)], [95, 5]),
    "far apart": Mixture([stats.norm(1, 0.01), stats.norm(2, 0.01)], [3, 1]),
    "with a gap": Mixture([stats.uniform(0, 1), stats.uniform(2, 1)], [3, 1]),
    "some without any": Mixture([Table([0.0]), stats.lognorm(s=0.3, scale=0.45e6)], [5, 95]),
    "many kinks": Mixture([stats.uniform(a, 1.0) for a in (0.0, 0.3, 0.7)], [1, 2, 3]),
}


@pytest.mark.parametrize("name", MARGINALS)
def test_the_values_are_those_found_one_by_one(name: str) -> None:
    marginal = MARGINALS[name]
    z = np.concatenate((np.random.default_rng(1).standard_normal(3000), np.linspace(-7, 7, 701)))
    exact = from_normal(marginal, z)
    quick = JointQuantile(marginal)
    found = quick(z)
    np.testing.assert_allclose(found, exact, rtol=1e-9, atol=1e-10 * float(marginal.std()))
    low, high = marginal.support()
    assert (found >= low - 1e-9).all()
    assert (found <= high + 1e-9).all()
    np.testing.assert_array_equal(found, JointQuantile(marginal)(z))  # another process makes the same table
    np.testing.assert_array_equal(found[:7], quick(z[:7]))  # and a value does not depend on its company


def test_atoms_are_exact() -> None:
    marginal = MARGINALS["some without any"]
    found = JointQuantile(marginal)(np.random.default_rng(1).standard_normal(20_000))
    assert (found == 0.0).mean() == pytest.approx(0.05, abs=0.006)
    assert found[found > 0].min() > 1e4


def lognormal_study(walls: int = 2000, end: float = 0.1, increments: int = 50, failed: int = 0) -> xr.Dataset:
    """Walls on a mound whose capacities are quantiles of a lognormal of median 50 mm and dispersion 0.4."""
    capacity = stats.lognorm(0.4, scale=0.05).ppf((np.arange(walls) + 0.5) / walls)
    movement = np.linspace(0.0, end, increments + 1)
    category = (movement >= capacity[:, None]).astype(np.int8)
    status = np.zeros(walls, dtype=np.int8)
    status[:failed], category[:failed, 5:] = 2, -1
    return xr.Dataset(
        {
            "damage_category": (("sample", "increment"), category),
            "surface_movement": (("sample", "increment"), np.tile(movement, (walls, 1)), {"units": "m"}),
            "status": ("sample", status),
        },
        {"sample": np.arange(walls)},
        {"highest_category": 2},
    )


@pytest.mark.parametrize(("median", "dispersion"), [(0.03, 0.2), (0.045, 0.3)])
def test_a_distribution_of_the_movement_is_the_reliability_integral(median: float, dispersion: float) -> None:
    """Lognormal movement against lognormal capacity: the closed form of stress and strength."""
    text = f'distribution = "lognormal", median = "{1e3 * median} mm", dispersion = {dispersion}'
    expected = stats.norm.cdf(np.log(median / 0.05) / np.hypot(0.4, dispersion))
    assert exceedance(lognormal_study(end=0.2, increments=200), 1, text).estimate.value == pytest.approx(
        expected, abs=4e-3
    )


def test_movements_beyond_the_walls_are_refused() -> None:
    with pytest.raises(InputError, match=r"50% of it lies beyond 50 mm, the largest movement of the study"):
        exceedance(lognormal_study(20, end=0.05), 1, "H1")
    moved = lognormal_study(20).rename(surface_movement="central_deflection")
    with pytest.raises(InputError, match="is of the surface movement"):
        exceedance(moved, 1, "H1")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("E", "class E has no two limits"),
        ("60", "give the unit with the number"),
        ("60 kPa", "must be a movement such as"),
        ("H3", "a site class \\(A, S, M, H1, H2, E\\)"),
        ("-3 mm", "must be greater than 0"),
        ('distribution = "lognorma", mean = 3', "Did you mean 'lognormal'"),
        ('distribution = "lognormal", mean =', "is no table of a distribution"),
        ('distribution = "normal", mean = "10 mm", cov = 5', "must be greater than 0"),
    ],
)
def test_a_wrong_text_is_answered_by_a_sentence(text: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        movement_distribution(text)


def test_a_wrong_distribution_of_the_movement_is_named_by_its_option() -> None:
    with pytest.raises(InputError, match=r"^at lower = 0\.03: must be below upper"):
        movement_distribution('distribution = "uniform", lower = "30 mm", upper = "1 mm"')
