"""Comparison of studies: how far a measure, such as a stiffer footing, changes the probability of damage.

Studies with the same seed and the same uncertain quantities run the same samples. Their differences are then paired:
what two walls have in common, such as weak mortar, cancels (common random numbers: Glasserman and Yao 1992).

- Between replicates of Sobol points, the interval of a difference is that of the mean of paired differences, by
  Student's distribution.
- Otherwise it is made from Wilson's intervals of the two probabilities and the correlation of the pairs: the method of
  variance estimates recovery (Newcombe 1998, method 10; Donner and Zou 2012).
- Studies of different samples are compared by the same formula with correlation 0, and the result says so.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr

from damagepred.arrays import FloatArray
from damagepred.errors import InputError
from damagepred.one_thread import one_blas_thread
from damagepred.uq.capacity import (
    category_number,
    censored_before,
    highest_category,
    probability_reached,
)
from damagepred.uq.estimate import Estimate, mean, probability
from damagepred.uq.exceedance import CategoryCapacities, category_capacities
from damagepred.uq.intensity import attributes, chosen_intensity
from damagepred.uq.movement_distribution import MovementDistribution, as_distribution

COUNTED = ("probability", "difference")


@one_blas_thread()
def compare(
    studies: Mapping[str, xr.Dataset],
    *,
    categories: Sequence[int | str] | None = None,
    at: Sequence[float | str | MovementDistribution] | None = None,
    confidence: float = 0.9,
    intensity: str | None = None,
) -> xr.Dataset:
    """Compare the probabilities of damage of several studies with those of the first.

    Parameters
    ----------
    studies : mapping of str to xarray.Dataset
        Two studies or more, by name, each as ``open_study`` returns it; the first is the reference.
    categories : sequence of int or str, optional
        Categories that count as reached from themselves upwards; all by default.
    at : sequence of float, str or MovementDistribution, optional
        Movements (m, or the unit of the measure), site classes or distributions of the movement; the movements of the
        reference's increments by default.
    confidence : float
        Of the intervals.
    intensity : str, optional
        Measure of the movement; by default that of the reference.

    Returns
    -------
    xarray.Dataset
        On (study, category, movement): ``probability`` and ``difference`` to the reference, each with ``_lower`` and
        ``_upper``, and ``unknown``, the number of samples that failed or ended before the movement. On (study,):
        ``paired_samples``, 0 where a study does not run the reference's samples. NaN where no sample is known.

    Raises
    ------
    InputError
        If there are fewer than two studies, or they differ in the measure of the movement or in the damage table.

    Examples
    --------
    >>> import damagepred
    >>> studies = {"as it is": damagepred.open_study("house.dp"), "strong": damagepred.open_study("strong.dp")}
    >>> found = damagepred.compare(studies, categories=[2], at=["2 mm"])
    >>> found["probability"].squeeze().round(2).values.tolist()
    [0.83, 0.54]
    >>> damagepred.uq.comparison.most_helpful(found, 2, 0.002)
    ['strong']
    """
    names = list(studies)
    if len(names) < 2:
        raise InputError("compare: needs two studies or more; the first is the reference.")
    reference = studies[names[0]]
    measure = chosen_intensity(reference, intensity)
    highest = {name: highest_category(ds) for name, ds in studies.items()}
    for name, ds in studies.items():
        chosen_intensity(ds, measure)
        if highest[name] != highest[names[0]] or _table(ds) != _table(reference):
            raise InputError(
                f"{name}: judged by {_table(ds)}, the reference by {_table(reference)}; judge one of them again."
            )
    given = range(1, highest[names[0]] + 1) if categories is None else categories
    chosen = [category_number(reference, c) for c in given]
    unit = attributes(reference, measure)["units"]
    asked = [as_distribution(a, unit) for a in (_increments(reference, measure).tolist() if at is None else at)]
    for one in asked:
        one.require_measure(measure)
    shape = (len(names), len(chosen), len(asked))
    values = {f"{kind}{end}": np.full(shape, np.nan) for kind in COUNTED for end in ("", "_lower", "_upper")}
    unknown, paired = np.zeros(shape, dtype=np.int64), np.zeros(len(names), dtype=np.int64)
    same = [_same_samples(reference, ds) for ds in studies.values()]
    for k, category in enumerate(chosen):
        known = [category_capacities(ds, category, measure, keep_failed=True) for ds in studies.values()]
        for s, own in enumerate(known):
            left, right, paired[s] = _pairs(known[0], own) if same[s] else (known[0], own, 0)
            for m, movement in enumerate(asked):
                found, difference, unknown[s, k, m] = _compared(left, right, movement, confidence, same[s])
                for kind, estimate in zip(COUNTED, (found, difference)):
                    values[kind][s, k, m] = estimate.value
                    values[f"{kind}_lower"][s, k, m] = estimate.lower
                    values[f"{kind}_upper"][s, k, m] = estimate.upper
    for end in ("", "_lower", "_upper"):
        values[f"difference{end}"][0] = 0.0
    dims = ("study", "category", "movement")
    words = {
        "probability": "probability of the category or worse",
        "difference": "change of that probability against the first study",
    }
    return xr.Dataset(
        {name: (dims, value, {"units": "1", "long_name": words[name.split("_")[0]]}) for name, value in values.items()}
        | {
            "unknown": (dims, unknown, {"units": "1", "long_name": "samples that failed or ended before the movement"}),
            "paired_samples": (("study",), paired, {"units": "1", "long_name": "samples in common with the first"}),
        },
        {
            "study": names,
            "category": ("category", chosen, _category_names(reference)),
            "movement": (
                "movement",
                [float(np.mean(one.points)) for one in asked],
                attributes(reference, measure) | {"measure": measure},
            ),
            "movement_name": ("movement", [one.name for one in asked]),
        },
        {"confidence": confidence, "reference": names[0], "damage_table": _table(reference)},
    )


def most_helpful(comparison: xr.Dataset, category: int, movement: float) -> list[str]:
    """Return the studies other than the reference, the one with the lowest probability of damage first.

    Parameters
    ----------
    comparison : xarray.Dataset
        As ``compare`` returns it.
    category : int
        Category, or worse.
    movement : float
        One of the movements compared.
    """
    found = comparison["difference"].sel(category=category).sel(movement=movement, method="nearest")[1:]
    return [str(name) for name in found["study"].values[np.argsort(found.values, kind="stable")]]


def sentences(comparison: xr.Dataset, category: int, movement: float) -> list[str]:
    """Return what a comparison says of a category at a movement, the most helpful study first.

    Parameters
    ----------
    comparison : xarray.Dataset
        As ``compare`` returns it.
    category : int
        Category, or worse.
    movement : float
        One of the movements compared.
    """
    found = comparison.sel(category=category).sel(movement=movement, method="nearest")
    level = f"{float(comparison.attrs['confidence']):.0%}"
    first, reference = found.isel(study=0), comparison.attrs["reference"]
    if np.isnan(first["probability"]):
        return [f"{reference}: unknown, no sample was followed as far; there is nothing to compare with"]
    said = [
        f"{reference}: {float(first['probability']):.3g}, "
        f"{float(first['probability_lower']):.3g} to {float(first['probability_upper']):.3g} ({level})"
    ]
    for name in most_helpful(comparison, category, movement):
        one = found.sel(study=name)
        value, lower, upper = (float(one[f"difference{end}"]) for end in ("", "_lower", "_upper"))
        if np.isnan(value):
            said.append(f"{name}: unknown, no sample was followed as far")
            continue
        clear = "less damage" if upper < 0 else "more damage" if lower > 0 else "may be chance"
        pairs = int(one["paired_samples"])
        of = f"{pairs} pairs of samples" if pairs else "other samples, so the interval is wide"
        said.append(
            f"{name}: {float(one['probability']):.3g}; difference {value:+.3g}, {lower:+.3g} to {upper:+.3g} "
            f"({level}): {clear}; {of}"
        )
    order = most_helpful(comparison, category, movement)
    sure = [name for name in order if float(found["difference_upper"].sel(study=name)) < 0]
    if not sure:
        said.append("no measure is sure to lower it")
    elif sure[0] == order[0]:
        said.append(f"{sure[0]} lowers it most")
    else:
        said.append(f"of the measures that are sure to lower it, {sure[0]} lowers it most")
    return said


def _table(ds: xr.Dataset) -> str:
    """Return how a study was judged: damage table, measure, and whether gaps under the footing count."""
    rules = {"damage_table": "{}", "damage_measure": "crack width of a {}", "count_footing_gap": "footing gaps: {}"}
    return ", ".join(text.format(ds.attrs[key]) for key, text in rules.items() if key in ds.attrs)


def _category_names(ds: xr.Dataset) -> dict[str, str]:
    kept = ("flag_values", "flag_meanings")
    return {key: ds["damage_category"].attrs[key] for key in kept if key in ds["damage_category"].attrs}


def _increments(ds: xr.Dataset, measure: str) -> FloatArray:
    """Return the movements of the increments, of the sample that moves farthest."""
    movement = np.atleast_2d(np.asarray(ds[measure].values, dtype=np.float64))
    farthest = movement[np.nanargmax(np.nanmax(movement, axis=-1, initial=0.0))]
    return np.unique(farthest[np.isfinite(farthest) & (farthest > 0)])


def _same_samples(reference: xr.Dataset, ds: xr.Dataset) -> bool:
    """Return whether two studies run the same samples: same seed, and same values of what both sample."""
    if any(str(reference.attrs.get(key)) != str(ds.attrs.get(key)) for key in ("seed", "sampler", "replicates")):
        return False
    count = min(reference.sizes["sample"], ds.sizes["sample"])
    inputs = [
        name for name in reference.data_vars if name in ds and reference[name].dims == ("sample",) and "." in str(name)
    ]
    return bool(inputs) and all(
        np.array_equal(reference[name].values[:count], ds[name].values[:count], equal_nan=True) for name in inputs
    )


def _pairs(left: CategoryCapacities, right: CategoryCapacities) -> tuple[CategoryCapacities, CategoryCapacities, int]:
    """Return what both studies know of the samples that both have run, in one order."""
    common, first, second = np.intersect1d(left.sample, right.sample, return_indices=True)
    return left.part(first), right.part(second), len(common)


def _compared(
    left: CategoryCapacities, right: CategoryCapacities, at: MovementDistribution, confidence: float, paired: bool
) -> tuple[Estimate, Estimate, int]:
    """Return the second study's probability, its difference to the first, and how many samples are unknown."""
    gone = [censored_before(one.lower, one.upper, at.largest) for one in (left, right)]
    missing = int(gone[1].sum())
    if paired:
        gone = [gone[0] | gone[1]] * 2
    parts = [one.part(~away) for one, away in zip((left, right), gone)]
    hits = [np.mean([probability_reached(one.lower, one.upper, a) for a in at.points], axis=0) for one in parts]
    estimates = [
        probability(hit, weight=one.weight, replicate=one.replicate, confidence=confidence)
        for hit, one in zip(hits, parts)
    ]
    return estimates[1], _difference(hits, parts, estimates, confidence, paired), missing


def _difference(
    hits: list[FloatArray],
    parts: list[CategoryCapacities],
    estimates: list[Estimate],
    confidence: float,
    paired: bool,
) -> Estimate:
    """Return the difference of two probabilities with its interval."""
    before, after = estimates
    weights = [np.ones(len(hit)) if one.weight is None else one.weight for hit, one in zip(hits, parts)]
    paired = paired and np.array_equal(weights[0], weights[1])
    if paired and parts[0].replicate is not None and len(hits[0]):
        found = mean(hits[1] - hits[0], weight=parts[0].weight, replicate=parts[0].replicate, confidence=confidence)
        if found.error > 0:
            return found._replace(lower=max(found.lower, -1.0), upper=min(found.upper, 1.0))
    correlation = _correlation(hits[0] * weights[0], hits[1] * weights[1]) if paired else 0.0
    value = after.value - before.value
    # limits of the difference, each from the limits of the two probabilities towards it
    lower = _recovered(after.value - after.lower, before.upper - before.value, correlation)
    upper = _recovered(after.upper - after.value, before.value - before.lower, correlation)
    return before._replace(
        value=value,
        error=float(np.sqrt(max(before.error**2 + after.error**2 - 2 * correlation * before.error * after.error, 0.0))),
        lower=max(value - lower, -1.0),
        upper=min(value + upper, 1.0),
    )


def _recovered(first: float, second: float, correlation: float) -> float:
    """Return the distance of a limit of a difference from the distances of the limits of both its terms."""
    return float(np.sqrt(max(first**2 + second**2 - 2 * correlation * first * second, 0.0)))


def _correlation(first: FloatArray, second: FloatArray) -> float:
    """Return the correlation of pairs; 0 where one of them does not vary."""
    if len(first) < 2 or np.ptp(first) == 0 or np.ptp(second) == 0:
        return 0.0
    return float(np.corrcoef(first, second)[0, 1])
