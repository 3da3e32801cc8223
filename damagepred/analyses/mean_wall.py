"""Comparison of the mean wall of a study with its sampled walls."""

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
from damagepred.results.house import noun
from damagepred.uq.capacity import highest_category, sample_weights
from damagepred.uq.estimate import Estimate, probability
from damagepred.uq.exceedance import exceedance
from damagepred.uq.intensity import chosen_intensity, intensity_values, movement_words, shown_measure


def beyond_mean_wall(wall: xr.Dataset, settings: StudySettings, file: Path) -> str:
    """Sentence on the share of sampled walls with more damage than the mean wall, from the study beside the file."""
    of = noun(wall)
    unknown = f"one {of} without scatter; sampled {of}s may be worse: run `damagepred study {file.name}`"
    category = int(wall["damage_category"].max())
    folder = StudyFolder(file.with_suffix(".dp"))
    try:
        if not folder.exists or study_differences(read_frozen(folder.study_text()), settings):
            return unknown
        ds = folder.results()
        if category >= highest_category(ds):
            return f"the mean {of} has the highest category; no sampled {of} can exceed it"
        share, where = _share(ds, wall, category + 1)
    except DamagepredError:  # no wall yet, or no result at this movement
        return unknown
    if not np.isfinite(share.value):
        return unknown
    more = category_label(ds, category + 1)
    return (
        f"the mean {of} is no worse than category {category_label(ds, category)}; of {share.samples} sampled {of}s in "
        f"{folder.path.name}, a share of {chance(share.value)} ({share.confidence:.0%} interval {chance(share.lower)} "
        f"to {chance(share.upper)}) reaches category {more} or worse {where}"
    )


def _share(ds: xr.Dataset, wall: xr.Dataset, category: int) -> tuple[Estimate, str]:
    """Probability of a category at the end of the mean wall's movement, or of each wall's own if they differ."""
    measure = chosen_intensity(ds, None)
    good = np.isin(ds["status"].values, SOLVED)
    moved = intensity_values(ds, measure)[good].reshape(int(good.sum()), -1)
    if measure in wall and np.isfinite(moved).all() and np.ptp(moved[:, -1]) <= 1e-9 * moved.max(initial=0.0):
        end = float(np.nanmax(wall[measure].values))
        shown = shown_measure(movement_words(ds, measure), str(wall[measure].attrs["units"]))
        return exceedance(ds, category, end).estimate, f"by {shown.factor * end:.3g} {shown.unit} of {shown.words}"
    worst = ds["damage_category"].values[good].reshape(int(good.sum()), -1).max(axis=1, initial=-1)
    weight = sample_weights(ds)[good] if "weight" in ds else None
    return probability(worst >= category, weight=weight), "by the end of its own movement"
