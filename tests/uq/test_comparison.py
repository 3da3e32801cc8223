"""Comparison of studies: paired differences of probabilities, with intervals of the stated coverage."""

import numpy as np
import pytest
import xarray as xr
from scipy import special

from damagepred.cli.sentences import comparison_lines
from damagepred.errors import InputError
from damagepred.uq.comparison import compare, most_helpful


def study(
    probability: float,
    shared: np.ndarray,
    *,
    movement: tuple[float, ...] = (0.01,),
    seed: int = 1,
    **attributes: object,
) -> xr.Dataset:
    """A study whose walls reach category 1 at the last movement with a probability, by what samples share."""
    count = len(shared)
    category = np.zeros((count, len(movement) + 1), dtype=np.int8)
    category[:, -1] = shared < special.ndtri(probability)
    return xr.Dataset(
        {
            "damage_category": (("sample", "increment"), category),
            "central_deflection": (("sample", "increment"), np.tile([0.0, *movement], (count, 1)), {"units": "m"}),
            "status": ("sample", np.zeros(count, dtype=np.int8)),
            "joint.tensile_strength": ("sample", shared),
        },
        {"sample": np.arange(count)},
        {"seed": seed, "sampler": "random", "highest_category": 2, "damage_table": "a table"} | attributes,
    )


def pair(random: np.random.Generator, count: int, before: float, after: float, correlation: float) -> list[xr.Dataset]:
    common, own = random.standard_normal((2, count))
    first, second = study(before, common), study(after, correlation * common + np.sqrt(1 - correlation**2) * own)
    second["joint.tensile_strength"] = first["joint.tensile_strength"]
    return [first, second]


def test_newcombes_example() -> None:
    """Newcombe's method 10 for pairs, by hand: 12 both, 9 the first alone, 2 the second alone, 21 neither."""
    first = np.repeat([1.0, 1.0, 0.0, 0.0], [12, 9, 2, 21])
    second = np.repeat([1.0, 0.0, 1.0, 0.0], [12, 9, 2, 21])
    one, two = study(0.5, np.where(first > 0, -1.0, 1.0)), study(0.5, np.where(second > 0, -1.0, 1.0))
    two["joint.tensile_strength"] = one["joint.tensile_strength"]
    found = compare({"one": one, "two": two}, categories=[1], confidence=0.95).isel(study=1, category=0, movement=0)
    n, both, left, right, none = 44, 12, 9, 2, 21
    phi = (both * none - left * right) / np.sqrt((both + left) * (right + none) * (both + right) * (left + none))
    limits = [wilson(21 / n, n), wilson(14 / n, n)]
    p, q = 21 / n, 14 / n

    def distance(a: float, b: float) -> float:
        return float(np.sqrt(a**2 - 2 * phi * a * b + b**2))

    lower = (q - p) - distance(q - limits[1][0], limits[0][1] - p)
    upper = (q - p) + distance(limits[1][1] - q, p - limits[0][0])
    assert float(found["difference"]) == pytest.approx(q - p)
    assert float(found["difference_lower"]) == pytest.approx(lower, abs=0.004)
    assert float(found["difference_upper"]) == pytest.approx(upper, abs=0.004)


def wilson(share: float, n: int) -> tuple[float, float]:
    z = special.ndtri(0.975)
    middle, half = share + z**2 / (2 * n), z * np.sqrt(share * (1 - share) / n + z**2 / (4 * n**2))
    return (middle - half) / (1 + z**2 / n), (middle + half) / (1 + z**2 / n)


def test_the_reference_differs_from_itself_by_nothing_and_the_most_helpful_comes_first() -> None:
    common = np.random.default_rng(3).standard_normal(80)
    studies = {name: study(p, common) for name, p in {"as it is": 0.5, "stiffer": 0.2, "drier": 0.4}.items()}
    found = compare(studies)
    assert (found["difference"][0] == 0).all()
    assert (found["difference_upper"][0] == 0).all()
    assert most_helpful(found, 1, 0.01) == ["stiffer", "drier"]
    assert found["probability"].dims == ("study", "category", "movement")
    said = comparison_lines(found, 1, 0.01)
    assert said[0].startswith("as it is: 0.")
    assert said[1].startswith("stiffer: 0.")
    assert "less damage; 80 pairs of samples" in said[1]
    assert said[3].startswith("Lower than 0.")
    assert said[3].endswith("stiffer helps most.")
    again = dict.fromkeys(("as it is", "the same"), studies["as it is"])
    assert comparison_lines(compare(again), 1, 0.01)[2].startswith("No measure is sure to lower")


def test_failed_samples_are_counted_and_take_the_share_of_the_others() -> None:
    first, second = pair(np.random.default_rng(4), 60, 0.5, 0.5, 0.5)
    second["status"][:6] = 2
    second["damage_category"][:6, 1:] = -1
    found = compare({"a": first, "b": second}, categories=[1]).isel(category=0, movement=0)
    assert found["unknown"].values.tolist() == [0, 6]
    each = [first["damage_category"].values[:, 1].mean(), second["damage_category"].values[6:, 1].mean()]
    np.testing.assert_allclose(found["probability"], each)
    assert float(found["difference"][1]) == pytest.approx(each[1] - each[0])


def test_incomparable_studies_are_refused_in_a_sentence() -> None:
    one = study(0.5, np.zeros(10))
    with pytest.raises(InputError, match="two studies or more"):
        compare({"a": one})
    with pytest.raises(InputError, match="b: judged by another table"):
        compare({"a": one, "b": one.assign_attrs(damage_table="another table")})
    with pytest.raises(InputError, match="must be greater than 0"):
        compare({"a": one, "b": one}, at=[0.0])
    with pytest.raises(InputError, match="surface_movement"):
        compare({"a": one, "b": one}, intensity="surface_movement")


def test_a_site_class_is_compared_by_its_mean() -> None:
    common = np.random.default_rng(6).standard_normal(60)
    studies = {
        name: study(p, common, movement=(0.03, 0.06)).rename(central_deflection="surface_movement")
        for name, p in {"as it is": 0.5, "stiffer": 0.2}.items()
    }
    found = compare(studies, categories=[1], at=["H1", 0.05])
    assert found["movement_name"].values.tolist() == ["class H1", "0.05"]
    for end in ("probability", "difference"):
        np.testing.assert_allclose(found[end][:, 0, 0], found[end][:, 0, 1], rtol=1e-9)
    with pytest.raises(InputError, match="is of the surface movement"):
        compare({name: ds.rename(surface_movement="central_deflection") for name, ds in studies.items()}, at=["H1"])


def test_unknown_probabilities_are_reported_as_unknown() -> None:
    first, second = pair(np.random.default_rng(4), 20, 0.0, 0.0, 0.5)
    said = comparison_lines(compare({"a": first, "b": second}, categories=[1], at=[0.02]), 1, 0.02)
    assert said == ["a: unknown, no sample was followed as far; there is nothing to compare with"]


def test_an_unfinished_study_is_compared_in_the_samples_of_both() -> None:
    """12 of 24 walls: 1 of them damaged, 2 in the reference; 3 of the 24 walls of the reference."""
    damaged = np.full((2, 24), 1.0)
    damaged[0, [3, 7, 20]] = damaged[1, 7] = -1.0
    first, second = study(0.5, damaged[0]), study(0.5, damaged[1])
    second["joint.tensile_strength"] = first["joint.tensile_strength"]
    found = compare({"first": first, "second": second.isel(sample=slice(12))}, categories=[1]).isel(
        category=0, movement=0
    )
    assert found["probability"].values == pytest.approx([3 / 24, 1 / 12])
    assert found["paired_samples"].values[1] == 12
    assert float(found["difference"][1]) == pytest.approx(1 / 12 - 2 / 12)
    alike = compare({"first": first.isel(sample=slice(12)), "second": second.isel(sample=slice(12))}, categories=[1])
    for name in ("difference", "difference_lower", "difference_upper"):
        assert float(found[name][1]) == float(alike[name].isel(study=1).squeeze())
