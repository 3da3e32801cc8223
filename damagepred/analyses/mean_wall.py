"""Mean wall of a study beside its sampled walls."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import xarray as xr

from damagepred.archive.folder import StudyFolder
from damagepred.archive.schema import category_label
from damagepred.campaign.campaign import study_differences
from damagepred.campaign.settings import StudySettings, read_frozen
from damagepred.enumerations import SOLVED
from damagepred.errors import DamagepredError
from damagepred.formatting import chance
from damagepred.uq.capacity import highest_category, sample_weights
from damagepred.uq.estimate import Estimate, probability
from damagepred.uq.exceedance import exceedance
from damagepred.uq.intensity import chosen_intensity, intensity_values, movement_words, shown_measure


def beyond_mean_wall(wall: xr.Dataset, settings: StudySettings, file: Path) -> str:
    """Sentence on the share of sampled walls with more damage than the mean wall, from the study beside the file."""
    unknown = f"one wall without scatter; sampled walls may be worse: run `damagepred study {file.name}`"
    category = int(wall["damage_category"].max())
    place = StudyFolder(file.with_suffix(".dp"))
    try:
        if not place.exists or study_differences(read_frozen(place.study_text()), settings):
            return unknown
        ds = place.results()
        if category >= highest_category(ds):
            return "the mean wall has the highest category; no sampled wall goes beyond it"
        found, where = _share(ds, wall, category + 1)
    except DamagepredError:  # no wall yet, or no answer at this movement
        return unknown
    if not np.isfinite(found.value):
        return unknown
    more = category_label(ds, category + 1)
    return (
        f"the mean wall is no worse than category {category_label(ds, category)}; of {found.samples} sampled walls in "
        f"{place.path.name}, a share of {chance(found.value)} ({found.confidence:.0%} interval {chance(found.lower)} "
        f"to {chance(found.upper)}) reaches category {more} or worse {where}"
    )


def _share(ds: xr.Dataset, wall: xr.Dataset, category: int) -> tuple[Estimate, str]:
    """Probability of a category at the end of the mean wall's movement, or of each wall's own where these differ."""
    measure = chosen_intensity(ds, None)
    good = np.isin(ds["status"].values, SOLVED)
    moved = intensity_values(ds, measure)[good].reshape(int(good.sum()), -1)
    if measure in wall and np.isfinite(moved).all() and np.ptp(moved[:, -1]) <= 1e-9 * moved.max(initial=0.0):
        at, shown = float(np.nanmax(wall[measure].values)), shown_measure(measure, str(wall[measure].attrs["units"]))
        return exceedance(
            ds, category, at
        ).estimate, f"by {shown.factor * at:.3g} {shown.unit} of {movement_words(ds, measure)}"
    worst = ds["damage_category"].values[good].reshape(int(good.sum()), -1).max(axis=1, initial=-1)
    weight = sample_weights(ds)[good] if "weight" in ds else None
    return probability(worst >= category, weight=weight), "by the end of its own movement"
