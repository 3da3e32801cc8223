"""Summary: a sentence for each category, and the most influential input."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr

from damagepred.analyses.variance_shares import study_sensitivity
from damagepred.archive.schema import category_label
from damagepred.enumerations import SOLVED
from damagepred.errors import InputError
from damagepred.formatting import length, number, ratio
from damagepred.report.answers import estimate_answer
from damagepred.report.inputs import place_in_words
from damagepred.report.parts import Section
from damagepred.report.quality import categories
from damagepred.results.house import noun
from damagepred.results.tables import Table, sensitivity_columns, standing_out
from damagepred.scene.site import site_class, site_classes
from damagepred.uq.capacity import sample_weights
from damagepred.uq.exceedance import Exceedance, exceedance, has_own_ground, own_movements, wanted_movement
from damagepred.uq.intensity import OF_SITE, movement_measure, movement_words
from damagepred.uq.movement_distribution import SITE, MovementDistribution

MOVEMENTS = ("movement.central_deflection", "movement.settlement", "mound.surface_movement")
"""Inputs that set the end of a path: the movement at damage does not depend on them."""

NAMED_INPUTS = 3  # inputs that a summary names at most


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
) -> tuple[str, dict[int, Exceedance]]:
    """Movement for which a study answers, in words, and the probability of each category or worse."""
    wanted = asked_movement(ds, at)
    found = {c: exceedance(ds, c, wanted, confidence=confidence) for c, _ in categories(ds)}
    return f"{_movement_in_words(ds, wanted)}:", found


def _movement_in_words(ds: xr.Dataset, wanted: MovementDistribution) -> str:
    """Movement of an answer, with the site classes of movements y_s."""
    words = movement_words(ds)
    on_site, named = words == OF_SITE, f"a {words}{' y_s' * (words == OF_SITE)} of"
    if not wanted.own and len(wanted.points) > 1:
        return f"For {wanted.words} ({wanted.assumption})"
    if not wanted.own:
        site = f", site class {site_class(wanted.largest).name}" if on_site else ""
        return f"At {named} {movement_number(wanted.largest, words)}{site}"
    ends = own_movements(ds, movement_measure(ds))
    low, middle, high = (movement_number(float(v), words) for v in np.quantile(ends, (0.0, 0.5, 1.0)))
    said = f"At the end of each {noun(ds)}'s own movement, {named} {low} to {high}, median {middle}"
    if on_site:
        weight = sample_weights(ds)[np.isin(ds["status"].values, SOLVED)]
        classes = np.array([site_class(float(end)).name for end in ends])
        shares = {site.name: float(np.average(classes == site.name, weights=weight)) for site in site_classes()}
        said += f"; {noun(ds)}s by site class: {', '.join(f'{name} {v:.0%}' for name, v in shares.items() if v)}"
    return said


def study_summary(ds: xr.Dataset, found: Mapping[int, Exceedance]) -> list[str]:
    """One sentence per category, from the probabilities of ``answers``."""
    return [
        estimate_answer(found[category].estimate, f"{_with_name(name)} or worse", noun(ds))
        for category, name in categories(ds)
    ]


def movement_number(value: float, words: str) -> str:
    """Movement with its unit, a deflection ratio as 1/n."""
    return ratio(value) if words == "deflection ratio" else length(value)


def _with_name(label: str) -> str:
    """Return "2 (slight)" for "2 slight"."""
    category, _, name = label.partition(" ")
    return f"{category} ({name})" if name else category


def doubtful_category(found: Mapping[int, Exceedance]) -> int | None:
    """Category whose probability is nearest to a half, or None."""
    doubt = {c: abs(one.estimate.value - 0.5) for c, one in found.items() if np.isfinite(one.estimate.value)}
    return min(doubt, key=lambda c: doubt[c], default=None)


def influences(
    ds: xr.Dataset, found: Mapping[int, Exceedance], confidence: float = 0.9, own_ground: bool = False
) -> tuple[str, Section | None]:
    """Sentence on the inputs that change the answer most, and the section with all of them."""
    if (category := doubtful_category(found)) is None:
        return "", None
    label = _with_name(category_label(ds, category))
    try:
        sensitivity = study_sensitivity(ds, category=category, confidence=confidence, own_ground=own_ground)
    except InputError as error:  # of one's own movement the walls may all agree
        if own_ground:
            return influences(ds, {category: found[category]}, confidence)
        reason = str(error).removeprefix(f"category = {category}: ")
        return f"What changes the answer most for category {label} is not known: {reason}", None
    names = sensitivity["variable"].values
    sensitivity = sensitivity.isel(variable=[k for k, name in enumerate(names) if own_ground or name not in MOVEMENTS])
    if not sensitivity.sizes["variable"]:
        return "", None
    of = f"the movement at which category {label} is reached"
    if own_ground:
        of = f"damage of category {label} at each {noun(ds)}'s own movement"
    if not (strongest := standing_out(sensitivity)[:NAMED_INPUTS]):
        return f"No input stands out for {of}, among these {ds.sizes['sample']} {noun(ds)}s.", None
    said = _strongest(sensitivity.isel(variable=strongest), -1.0 if own_ground else 1.0, of)
    table = Table.of(f"Inputs and {of}", sensitivity_columns(sensitivity), _NOTE)
    return said, Section("influences", "What changes the answer most", [table])


_NOTE = (
    "Rank correlation: from −1 to 1. Partial: other inputs held fixed. Share of variance: by the "
    "input alone. A sample that is not damaged counts as censored at its own end. Inputs that vary "
    "from joint to joint are not in the table."
)


def _strongest(sensitivity: xr.Dataset, protects: float, of: str) -> str:
    """Sentence on the inputs with the largest partial correlations."""
    most = [
        f"{place_in_words(str(name))} ({number(float(value), 2)}, more of it "
        f"{'protects' if value * protects > 0 else 'harms'})"
        for name, value in zip(sensitivity["variable"].values, sensitivity["partial"].values)
    ]
    return f"What changes the answer most: {'; '.join(most)}. In brackets the rank correlation with {of}."
