"""Sensitivity of damage to the inputs of a study: ranks and shares of variance."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import xarray as xr

from damagepred.archive.schema import FLAG_FILL
from damagepred.arrays import FloatArray, IntArray
from damagepred.enumerations import SampleStatus
from damagepred.errors import InputError, nearest
from damagepred.runtime.one_thread import one_blas_thread
from damagepred.uq.capacity import category_number, require_categories, sampled
from damagepred.uq.fragility import read_capacities
from damagepred.uq.intensity import chosen_intensity
from damagepred.uq.sensitivity import LEAST_WALLS, sensitivity_indices


class Output(NamedTuple):
    """Output of a sensitivity."""

    value: FloatArray  # (walls,): one number per wall, or (2, walls): interval of its capacity
    sample: IntArray  # (walls,): numbers of the walls
    name: str
    censored: float  # share of walls without an upper bound of the capacity


def _output_of(
    ds: xr.Dataset, category: int | None = None, output: str | None = None, own_ground: bool = False
) -> Output:
    """Output of the sensitivity; see ``study_sensitivity``."""
    if (category is None) == (output is None):
        raise InputError("sensitivity: is of a category or of an output; give one of them.")
    if category is not None:
        require_categories(ds, [category])
        walls = read_capacities(ds, [category], chosen_intensity(ds, None))
        lower, upper = walls.capacities.lower[0], walls.capacities.upper[0]
        if own_ground:
            ended = ~walls.capacities.failed[0]
            hit = np.isfinite(upper[ended]).astype(np.float64)
            return Output(hit, walls.sample[ended], f"damage of category {category} at each sample's own movement", 0.0)
        words = f"rank of the capacity for category {category}: the movement at which it is reached"
        censored = float(np.average(np.isinf(upper), weights=walls.weight))
        return Output(np.array([lower, upper]), walls.sample, words, censored)
    names = [str(n) for n in ds.data_vars if ds[n].dims[:1] == ("sample",) and ds[n].dims[1:] in ((), ("increment",))]
    if output not in names:
        raise InputError(
            f"output = '{output}': the study has no such result with one number per sample."
            + nearest(str(output), names)
        )
    ran = np.flatnonzero(ds["status"].values != SampleStatus.MISSING)
    column = ds[output].isel(sample=ran)
    column = column.isel(increment=-1) if "increment" in column.dims else column
    value = np.asarray(column.values, dtype=np.float64)
    if column.dtype == np.int8:
        value[column.values == FLAG_FILL] = np.nan
    if unknown := int(np.isnan(value).sum()):
        raise InputError(
            f"output = '{output}': {unknown} of {len(value)} samples have no value at the end of the movement, and "
            "without them the result would be biased; take a category, for which such samples count as censored, or "
            'follow all samples to the end with [study] stop_at_category = "none".'
        )
    return Output(value, ran, f"{output.replace('_', ' ')} at the end of the movement", 0.0)


@one_blas_thread()
def study_sensitivity(
    ds: xr.Dataset,
    *,
    category: int | str | None = None,
    output: str | None = None,
    own_ground: bool = False,
    confidence: float = 0.9,
    resamples: int = 500,
    seed: int = 0,
) -> xr.Dataset:
    """Sensitivity of an output of a study to each input.

    Parameters
    ----------
    ds : xarray.Dataset
        Study from ``open_study``.
    category : int or str, optional
        Output: rank of the capacity, the movement at which this category is reached. Walls without this category at
        their own end, and failed walls, count as censored there: an input that only limits the movement has no effect.
    own_ground : bool
        Output: whether the category is reached by the end of each wall's own movement, instead of the capacity, so that
        inputs of the ground movement also have an effect. Failed walls are left out.
    output : str, optional
        Output: a result of the study, at the end of the movement.
    confidence : float
        Confidence of the intervals.
    resamples, seed : int
        Bootstrap resamples and their seed.

    Returns
    -------
    xarray.Dataset
        ``spearman``, ``partial`` and ``first_order`` with their intervals on (variable,), of the inputs with one value
        per wall.

    Raises
    ------
    InputError
        If there is no such output, some walls lack it, no input has one value per wall, or fewer than 10 walls reached
        the category (with ``own_ground`` also if fewer than 10 did not).

    Examples
    --------
    >>> import damagepred
    >>> ds = damagepred.study_sensitivity(damagepred.open_study("house.dp"), category=2, resamples=50)
    >>> dict(zip(ds["variable"].values.tolist(), ds["spearman"].values.round(1).tolist()))
    {'joint.friction': -0.2, 'joint.cohesion': 0.1}
    """
    number = None if category is None else category_number(ds, category)
    walls = _output_of(ds, number, output, own_ground)
    if number is not None:
        hit = walls.value > 0 if own_ground else np.isfinite(walls.value[1])
        few, reached = int(hit.sum()), "reached"
        if own_ground and few > len(hit) - few:
            few, reached = len(hit) - few, "did not reach"
        if few < LEAST_WALLS:
            raise InputError(
                f"category = {number}: {few} of {len(hit)} samples {reached} it, and a ranking of inputs needs "
                f"{LEAST_WALLS} or more; run more samples, or take another category."
            )
    alone = np.ones(len(walls.sample), dtype=bool)
    if int(ds.attrs.get("crossed", 0)):  # of an archive of 0.1: of four walls two share neither inputs nor joints
        alone = np.isin(walls.sample % 4, (0, 3))
    inputs = {
        str(name): np.asarray(variable.values, dtype=np.float64)[walls.sample[alone]]
        for name, variable in ds.data_vars.items()
        if variable.dims == ("sample",) and variable.attrs.get("role") == "input"
    }
    if not inputs:
        raise InputError("the study has no input with one value per sample.")
    weight = np.asarray(ds["weight"].values, dtype=np.float64)[walls.sample[alone]] if "weight" in ds else None
    values = walls.value[..., alone]
    result = sensitivity_indices(inputs, values, weight=weight, confidence=confidence, resamples=resamples, seed=seed)
    return result.assign_attrs(
        title=f"sensitivity of {ds.attrs.get('title', 'a study')}",
        output=walls.name,
        share_censored=walls.censored,
        samples_failed=int((ds["status"].values == SampleStatus.FAILED).sum()),
        bootstrap_samples=resamples,
        **sampled(ds),
    )
