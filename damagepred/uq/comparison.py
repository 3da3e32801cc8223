"""Comparison of studies: the change of the probability of damage by a measure, such as a stiffer footing.

Studies with the same seed and uncertain quantities run the same samples, and what two walls have in common cancels
(common random numbers: Glasserman and Yao 1992). The error of a difference follows from pairs of pseudo-values: between
replicates of Sobol points by Student's distribution, otherwise from Wilson's intervals of both probabilities and the
correlation of the pairs, 0 for different samples (Newcombe 1998, method 10; Donner and Zou 2012).
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr

from damagepred.arrays import FloatArray, IntArray
from damagepred.errors import InputError
from damagepred.runtime.one_thread import one_blas_thread
from damagepred.uq import exceedance
from damagepred.uq.capacity import category_number, censored_before, highest_category
from damagepred.uq.estimate import ENOUGH_REPLICATES, Estimate, student_factor
from damagepred.uq.intensity import attributes, chosen_intensity
from damagepred.uq.movement_distribution import SITE, MovementDistribution

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
    """Compare the probabilities of damage of several studies with the first study's.

    Parameters
    ----------
    studies : mapping of str to xarray.Dataset
        Two studies or more, by name, each as ``open_study`` returns it; the first is the reference.
    categories : sequence of int or str, optional
        Categories that count as reached from themselves upwards; all by default.
    at : sequence of float, str or MovementDistribution, optional
        Movements (m, or the unit of the measure), site classes, distributions of the movement, or "site", each wall's
        own ground; the movements of the reference's increments by default.
    confidence : float
        Confidence level of the intervals.
    intensity : str, optional
        Measure of the movement; by default the reference's.

    Returns
    -------
    xarray.Dataset
        On (study, category, movement): ``probability`` and ``difference`` to the reference, each with ``_lower`` and
        ``_upper``, and ``unknown``, the number of samples that failed or ended before the movement. On (study,):
        ``paired_samples``, 0 where a study does not run the reference's samples. NaN where no sample is known.

    Raises
    ------
    InputError
        If there are fewer than two studies, if they differ in the measure of the movement or in the damage table, or if
        a study has each wall at its own movement only and ``at`` asks for another one.

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
    single = any(ds["damage_category"].ndim == 1 for ds in studies.values())
    movements = (["site"] if single else _increments(reference, measure).tolist()) if at is None else at
    wanted = [exceedance.wanted_movement(reference, movement, measure) for movement in movements]
    units = str(attributes(reference, measure)["units"])
    if single and not all(movement.own for movement in wanted):
        raise InputError('compare: a study has each sample at its own movement alone; compare them at = "site".')
    shape = (len(names), len(chosen), len(wanted))
    values = {f"{kind}{end}": np.full(shape, np.nan) for kind in COUNTED for end in ("", "_lower", "_upper")}
    unknown, paired = np.zeros(shape, dtype=np.int64), np.zeros(len(names), dtype=np.int64)
    same = [_same_samples(reference, ds) for ds in studies.values()]
    for (k, category), by_site in itertools.product(enumerate(chosen), {movement.own for movement in wanted}):
        own = SITE if by_site else None
        walls = [exceedance.category_capacities(ds, category, measure, own) for ds in studies.values()]
        for m, movement in enumerate(wanted):
            if movement.own != by_site:
                continue
            followed = [exceedance.require_followed(each, movement, units) for each in walls]
            answers = [_Answer.of(each, at, confidence) for each, at in zip(walls, followed)]
            for s, (each, answer) in enumerate(zip(walls, answers)):
                unknown[s, k, m] = int(censored_before(each.lower, each.upper, movement.largest).sum())
                both = answers[0], answer
                if same[s] and not np.array_equal(walls[0].sample, each.sample):  # an unfinished study has fewer
                    common = np.intersect1d(walls[0].sample, each.sample)
                    parts = [part.part(np.isin(part.sample, common)) for part in (walls[0], each)]
                    both = _Answer.of(parts[0], followed[0], confidence), _Answer.of(parts[1], followed[s], confidence)
                for kind, estimate in zip(COUNTED, (answer.estimate, _difference(*both, confidence, same[s]))):
                    for end, number in zip(("", "_lower", "_upper"), (estimate.value, estimate.lower, estimate.upper)):
                        values[f"{kind}{end}"][s, k, m] = number
        paired[:] = [len(np.intersect1d(walls[0].sample, each.sample)) if s else 0 for each, s in zip(walls, same)]
    for end in ("", "_lower", "_upper"):
        values[f"difference{end}"][0] = 0.0
    dims, flags = ("study", "category", "movement"), reference["damage_category"].attrs
    points = [exceedance.own_movements(reference, measure) if each.own else each.points for each in wanted]
    middles = [float(np.mean(movements)) for movements in points]
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
            "category": (
                "category",
                chosen,
                {key: flags[key] for key in ("flag_values", "flag_meanings") if key in flags},
            ),
            "movement": ("movement", middles, attributes(reference, measure) | {"measure": measure}),
            "movement_name": ("movement", [movement.name for movement in wanted]),
        },
        {"confidence": confidence, "reference": names[0], "damage_table": _table(reference)},
    )


def most_helpful(comparison: xr.Dataset, category: int, movement: float) -> list[str]:
    """Studies other than the reference, the one with the lowest probability of damage first."""
    change = comparison["difference"].sel(category=category).sel(movement=movement, method="nearest")[1:]
    return [str(name) for name in change["study"].values[np.argsort(change.values, kind="stable")]]


def _table(ds: xr.Dataset) -> str:
    """Rules of judgement of a study: damage table, measure, and whether gaps under the footing count."""
    rules = {"damage_table": "{}", "damage_measure": "crack width of a {}", "count_footing_gap": "footing gaps: {}"}
    return ", ".join(text.format(ds.attrs[key]) for key, text in rules.items() if key in ds.attrs)


def _increments(ds: xr.Dataset, measure: str) -> FloatArray:
    """Movements of the increments, of the sample that moves farthest."""
    movement = np.atleast_2d(np.asarray(ds[measure].values, dtype=np.float64))
    farthest = movement[np.nanargmax(np.nanmax(movement, axis=-1, initial=0.0))]
    return np.unique(farthest[np.isfinite(farthest) & (farthest > 0)])


def _same_samples(reference: xr.Dataset, ds: xr.Dataset) -> bool:
    """Whether two studies run the same samples: same seed, and same values of the inputs of both."""
    if any(str(reference.attrs.get(key)) != str(ds.attrs.get(key)) for key in ("seed", "sampler", "replicates")):
        return False
    count = min(reference.sizes["sample"], ds.sizes["sample"])
    inputs = [
        name for name in reference.data_vars if name in ds and reference[name].dims == ("sample",) and "." in str(name)
    ]
    return bool(inputs) and all(
        np.array_equal(reference[name].values[:count], ds[name].values[:count], equal_nan=True) for name in inputs
    )


class _Answer(NamedTuple):
    """Probability of one study, and each sample's contribution to its error."""

    estimate: Estimate
    sample: IntArray
    contribution: FloatArray
    replicate: IntArray | None
    precision: float

    @classmethod
    def of(cls, walls: exceedance.CategoryCapacities, at: MovementDistribution, confidence: float) -> _Answer:
        """Estimate the probability; the contributions add up to 0, and their squares to the error's square."""
        estimate = exceedance.estimate_exceedance(walls, at, confidence).estimate
        values = exceedance.pseudo_values(walls, at)
        each = values.hit if walls.weight is None else values.hit * walls.weight
        contribution = (each - each.mean()) / len(each) if len(each) else each
        return cls(estimate, walls.sample, contribution, walls.replicate, values.precision)


def _difference(before: _Answer, after: _Answer, confidence: float, paired: bool) -> Estimate:
    """Difference of two probabilities with its interval."""
    first, second = before.estimate, after.estimate
    value = second.value - first.value
    samples = np.union1d(before.sample, after.sample)
    parts, labels = np.zeros((2, len(samples))), np.zeros(len(samples), dtype=np.int64)
    replicated = paired and np.isfinite(value)
    for pseudo, answer in zip(parts, (before, after)):
        index = np.searchsorted(samples, answer.sample)
        pseudo[index] = answer.contribution
        if answer.replicate is None:
            replicated = False
        else:
            labels[index] = answer.replicate
    if replicated and len(np.unique(labels)) >= ENOUGH_REPLICATES:
        sums = np.bincount(labels, parts[1] - parts[0])[np.unique(labels)]
        scatter = float((sums**2).sum()) * len(sums) / (len(sums) - 1)
        error = float(np.sqrt(scatter / min(before.precision, after.precision)))
        if error > 0:
            half = student_factor(confidence, len(sums) - 1) * error
            return first._replace(value=value, error=error, lower=max(value - half, -1.0), upper=min(value + half, 1.0))
    size = float(np.prod(np.sqrt((parts**2).sum(axis=1))))
    correlation = float(parts[0] @ parts[1]) / size if paired and size > 0 else 0.0
    # limits of the difference, each from the limits of the two probabilities towards it
    lower = _recovered(second.value - second.lower, first.upper - first.value, correlation)
    upper = _recovered(second.upper - second.value, first.value - first.lower, correlation)
    error = _recovered(first.error, second.error, correlation)
    return first._replace(value=value, error=error, lower=max(value - lower, -1.0), upper=min(value + upper, 1.0))


def _recovered(first: float, second: float, correlation: float) -> float:
    """Distance of a limit of a difference from the distances of the limits of both its terms."""
    return float(np.sqrt(max(first**2 + second**2 - 2 * correlation * first * second, 0.0)))
