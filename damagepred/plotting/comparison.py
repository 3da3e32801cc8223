"""Comparison of studies: probability of a category against the movement, and its difference to the first study."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from damagepred.archive.schema import flag_name
from damagepred.inputs.arguments import checked
from damagepred.plotting.colours import CURVE_STYLES, OPENING_STYLES
from damagepred.plotting.sheet import MM, label_movement, legend_below, require, set_title, several_or_new, verbatim
from damagepred.uq.capacity import category_number
from damagepred.uq.intensity import movement_words


@checked
def draw_comparison(
    comparison: xr.Dataset, category: int | str | None = None, axes: Sequence[Axes] | None = None
) -> list[Axes]:
    """Draw the probability of a category in each study, and below the difference to the first, with intervals.

    Parameters
    ----------
    comparison : xarray.Dataset
        As ``damagepred.compare`` returns it.
    category : int or str, optional
        Category, or worse; by default the first compared.
    axes : sequence of 2 Axes, optional
        Where to draw; by default on a new figure.

    Returns
    -------
    list of Axes
        Of the probabilities and of the differences.

    Raises
    ------
    InputError
        If the dataset holds no comparison.

    Examples
    --------
    >>> import damagepred
    >>> studies = {"as it is": damagepred.open_study("house.dp"), "strong": damagepred.open_study("strong.dp")}
    >>> axes = damagepred.plotting.draw_comparison(damagepred.compare(studies, categories=[2]))
    >>> len(axes)
    2
    """
    require(comparison, ("probability", "difference", "difference_lower"), "a comparison of studies")
    upper, lower = several_or_new(axes, 2, 1, 8.0, 7.5)
    category = int(comparison["category"][0]) if category is None else category_number(comparison, category)
    found = comparison.sel(category=category)
    in_metres = comparison["movement"].attrs.get("units") == "m"
    movement = comparison["movement"].values * (MM if in_metres else 1.0)
    for k, name in enumerate(str(study) for study in comparison["study"].values):
        one, (colour, _) = found.isel(study=k), OPENING_STYLES[k % len(OPENING_STYLES)]
        style: dict[str, Any] = {"color": colour, "linestyle": CURVE_STYLES[k % len(CURVE_STYLES)], "linewidth": 1.8}
        upper.plot(movement, one["probability"], label=verbatim(name), **style)
        upper.fill_between(
            movement, one["probability_lower"], one["probability_upper"], color=colour, alpha=0.12, linewidth=0
        )
        if k:
            lower.plot(movement, one["difference"], **style)
            lower.fill_between(
                movement, one["difference_lower"], one["difference_upper"], color=colour, alpha=0.15, linewidth=0
            )
    lower.axhline(0.0, color=OPENING_STYLES[0][0], linewidth=1.0)
    upper.set_ylim(0.0, 1.0)
    upper.set_ylabel("probability (1)")
    lower.set_ylabel(f"difference to {verbatim(str(comparison.attrs['reference']))} (1)")
    reach = float(np.nanmax(np.abs([lower.get_ylim()]), initial=0.05))
    lower.set_ylim(-reach, reach)
    words = movement_words(comparison, str(comparison["movement"].attrs.get("measure", "movement")))
    for ax in (upper, lower):
        ax.set_xlim(0.0, movement.max())
        if in_metres:
            label_movement(ax, words)
        else:
            ax.set_xlabel(f"{words} (1)")
    level = f"{float(comparison.attrs['confidence']):.0%} intervals"
    paired = comparison["paired_samples"].values[1:]
    pairs = f"{int(paired.min())} pairs of samples" if paired.size and paired.min() else "different samples"
    set_title(
        upper,
        "Probability of damage",
        f"category {category} ({verbatim(flag_name(comparison, category, 'category'))}) or worse; {level}",
    )
    set_title(lower, "Difference to the first study", f"{pairs}; below zero: less damage")
    legend_below(lower, upper.get_lines(), columns=3)
    return [upper, lower]
