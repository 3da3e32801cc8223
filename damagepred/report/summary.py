"""Summary: a sentence for each category, and the most influential input."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr

from damagepred.analyses.variance_shares import study_sensitivity
from damagepred.archive.schema import category_label
from damagepred.errors import InputError
from damagepred.formatting import length, number, ratio
from damagepred.report.answers import in_words
from damagepred.report.inputs import place_in_words
from damagepred.report.parts import Section
from damagepred.report.quality import categories
from damagepred.results.house import noun
from damagepred.results.tables import Table, sensitivity_columns
from damagepred.scene.site import site_class
from damagepred.uq.estimate import Estimate
from damagepred.uq.exceedance import exceedance, has_own_ground, own_movements, wanted_movement
from damagepred.uq.intensity import OF_SITE, movement_measure, movement_words
from damagepred.uq.movement_distribution import MOUND, SITE, MovementDistribution

MOVEMENTS = ("movement.central_deflection", "movement.settlement", "mound.surface_movement")
"""Inputs that set the end of a path: the movement at damage does not depend on them."""

NAMED_INPUTS = 3
"""Inputs that a summary names at most."""


def wall_summary(ds: xr.Dataset) -> list[str]:
    """One sentence per category: the movement at which one wall reaches it."""
    measure, words = movement_measure(ds), movement_words(ds)
    movement, category = ds[measure].values, ds["damage_category"].values
    said = []
    for one, name in categories(ds):
        reached = np.flatnonzero(category >= one)
        how, at = ("reached at", reached[0]) if reached.size else ("not reached up to", -1)
        said.append(f"Category {_with_name(name)}: {how} a {words} of {length(float(movement[at]))}.")
    return said


def asked_movement(ds: xr.Dataset, at: float | str | MovementDistribution | None) -> MovementDistribution:
    """Movement that a report answers for; by default each wall's own, or the largest where all have the same."""
    measure = movement_measure(ds)
    if at is None:
        at = SITE if has_own_ground(ds, measure) else float(own_movements(ds, measure).max(initial=0.0))
    return wanted_movement(ds, at, measure)


def answers(
    ds: xr.Dataset, at: float | str | MovementDistribution | None = None, confidence: float = 0.9
) -> tuple[str, dict[int, Estimate]]:
    """Return for which movement a study answers, in words, and the probability of each category or worse."""
    measure = movement_measure(ds)
    wanted = asked_movement(ds, at)
    estimates = {c: exceedance(ds, c, wanted, confidence=confidence).estimate for c, _ in categories(ds)}
    if wanted.own:
        ends = own_movements(ds, measure)
        of = f"a {movement_words(ds)} of {length(float(ends.min()))} to {length(float(ends.max()))}"
        return f"At the end of each {noun(ds)}'s own movement, {of}:", estimates
    if len(wanted.points) > 1:
        where = f"site {wanted.name}" if wanted.measure == MOUND else wanted.name
        return f"For {where} ({wanted.assumption}):", estimates
    words = movement_words(ds)
    site = f", site class {site_class(wanted.largest).name}" if words == OF_SITE else ""
    return f"At a {words} of {movement_number(wanted.largest, words)}{site}:", estimates


def study_summary(ds: xr.Dataset, estimates: Mapping[int, Estimate]) -> list[str]:
    """One sentence per category, from the estimates of ``answers``."""
    return [
        f"Category {_with_name(name)} or worse: {in_words(estimates[category], noun(ds))}."
        for category, name in categories(ds)
    ]


def movement_number(value: float, words: str) -> str:
    """Movement with its unit, a deflection ratio as 1/n."""
    return ratio(value) if words == "deflection ratio" else length(value)


def _with_name(label: str) -> str:
    """Return "2 (slight)" for "2 slight"."""
    category, _, name = label.partition(" ")
    return f"{category} ({name})" if name else category


def doubtful_category(estimates: Mapping[int, Estimate]) -> int | None:
    """Category whose probability is nearest to a half, or None."""
    doubt = {category: abs(one.value - 0.5) for category, one in estimates.items() if np.isfinite(one.value)}
    return min(doubt, key=lambda c: doubt[c], default=None)


def influences(
    ds: xr.Dataset, estimates: Mapping[int, Estimate], confidence: float = 0.9, own_ground: bool = False
) -> tuple[str, Section | None]:
    """Sentence on the inputs that change the answer most, and the section with all of them."""
    if (category := doubtful_category(estimates)) is None:
        return "", None
    label = _with_name(category_label(ds, category))
    try:
        sensitivity = study_sensitivity(ds, category=category, confidence=confidence, own_ground=own_ground)
    except InputError as error:  # of one's own movement the walls may all agree
        if own_ground:
            return influences(ds, {category: estimates[category]}, confidence)
        return f"What changes the answer most is not known: {str(error).rstrip('.')}.", None
    names = sensitivity["variable"].values
    sensitivity = sensitivity.isel(variable=[k for k, name in enumerate(names) if own_ground or name not in MOVEMENTS])
    if not sensitivity.sizes["variable"]:
        return "", None
    of = f"the movement at which category {label} is reached"
    if own_ground:
        of = f"damage of category {label} at each {noun(ds)}'s own movement"
    said = _strongest(sensitivity, -1.0 if own_ground else 1.0, of, ds.sizes["sample"])
    table = Table.of(f"Inputs and {of}", sensitivity_columns(sensitivity), _NOTE)
    return said, Section("influences", "What changes the answer most", [table])


_NOTE = (
    "Rank correlation: from −1 to 1. Partial: other inputs held fixed. Share of variance: by the "
    "input alone. A sample that is not damaged counts as censored at its own end. Inputs that vary "
    "from joint to joint are not in the table."
)


def _strongest(sensitivity: xr.Dataset, protects: float, of: str, samples: int) -> str:
    """Sentence on the inputs with the largest partial correlations whose sign is sure."""
    value = sensitivity["partial"].values
    sure = np.sign(sensitivity["partial_lower"].values) == np.sign(sensitivity["partial_upper"].values)
    order = [int(i) for i in np.argsort(-np.abs(value)) if sure[i]][:NAMED_INPUTS]
    if not order:
        return f"Of the inputs with one value per sample, no input stands out for {of}, among these {samples} samples."
    most = [
        f"{place_in_words(str(sensitivity['variable'].values[i]))} ({number(float(value[i]), 2)}, more of it "
        f"{'protects' if value[i] * protects > 0 else 'harms'})"
        for i in order
    ]
    return f"What changes the answer most: {'; '.join(most)}. In brackets the rank correlation with {of}."
