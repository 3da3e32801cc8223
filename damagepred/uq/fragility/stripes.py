"""Stripes (multiple stripe analysis: Baker 2015): counts of different walls in each category at a few fixed movements.

The same walls at several movements are paths, whose categories belong together: give them as increments of one wall.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from damagepred.enumerations import SampleStatus
from damagepred.errors import InputError
from damagepred.inputs.arguments import checked
from damagepred.uq.capacity import sample_weights
from damagepred.uq.intensity import movement_measure


@checked
def stripes_from_counts(
    movement: ArrayLike,
    counts: ArrayLike,
    *,
    intensity: str = "central_deflection",
    units: str = "m",
    title: str = "counted walls",
) -> xr.Dataset:
    """Return counted walls as a study, one wall each, for ``fit_fragility``.

    Parameters
    ----------
    movement : array (stripes,)
        Movement of each stripe.
    counts : array of int (stripes, categories)
        Walls of each stripe in category 0, 1, ...
    intensity, units : str
        What the movement is measured by.
    title : str
        Title of the study.

    Raises
    ------
    InputError
        If there is not one row of counts for each movement, or a count is negative or not whole.
    """
    movements, walls = np.asarray(movement, dtype=np.float64), np.asarray(counts)
    if movements.ndim != 1 or walls.ndim != 2 or len(movements) != len(walls):
        raise InputError(
            f"counts: has shape {walls.shape} for {movements.size} movements; there must be one row each, of the walls "
            "in category 0, 1, ..."
        )
    wrong = (walls < 0).any() or (walls != np.round(walls)).any() or (movements < 0).any()
    if wrong or not np.isfinite(movements).all():
        raise InputError("movement, counts: must be finite and not negative, and counts whole numbers.")
    walls = walls.astype(np.int64)
    categories = walls.shape[1]
    category = np.tile(np.arange(categories, dtype=np.int8), len(movements))
    words = {"units": units, "long_name": intensity.replace("_", " ")}
    return xr.Dataset(
        {
            "damage_category": ("sample", np.repeat(category, walls.ravel())),
            "status": ("sample", np.full(walls.sum(), SampleStatus.COMPLETE, dtype=np.int8)),
            intensity: ("sample", np.repeat(movements, walls.sum(axis=1)), words),
        },
        attrs={"title": title, "highest_category": categories - 1},
    )


@checked
def stripes(studies: Mapping[float, xr.Dataset], intensity: str | None = None) -> xr.Dataset:
    """Put studies of one movement each, of different walls, together for ``fit_fragility``.

    Parameters
    ----------
    studies : mapping of float to xarray.Dataset
        The study of each movement, as ``open_study`` returns it; what counts of a path is its end. Weights of samples
        go with them.
    intensity : str, optional
        What the movement is measured by; by default the studies' own.
    """
    if not studies:
        raise InputError("stripes: there must be a study for at least one movement.")
    first = next(iter(studies.values()))
    weighted = any("weight" in ds for ds in studies.values())
    name = intensity or movement_measure(first)
    parts = []
    for movement, ds in sorted(studies.items()):
        category = ds["damage_category"]
        ended = category.isel(increment=-1) if "increment" in category.dims else category
        attrs = dict(ds[name].attrs) if name in ds else {"units": "m"}
        stripe = {
            "damage_category": ("sample", ended.values, category.attrs),
            "status": ("sample", ds["status"].values, ds["status"].attrs),
            name: ("sample", np.full(ds.sizes["sample"], float(movement)), attrs),
        }
        if weighted:
            stripe["weight"] = ("sample", sample_weights(ds), {"units": "1"})
        parts.append(xr.Dataset(stripe))
    return xr.concat(parts, "sample").assign_attrs(first.attrs)
