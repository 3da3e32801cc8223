"""Stripes (multiple stripe analysis: Baker 2015): counts of different walls in each category at a few fixed movements.

The same walls at several movements are paths, whose categories belong together: give them as increments of one wall.
"""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from damagepred.enumerations import SampleStatus
from damagepred.errors import InputError
from damagepred.inputs.arguments import checked


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
