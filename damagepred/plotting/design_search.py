"""Design search: what alternatives cost, and how likely damage is with each, or what it costs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from damagepred.inputs.arguments import checked
from damagepred.plotting.colours import OPENING_STYLES
from damagepred.plotting.sheet import require, set_title, several_or_new, verbatim

_WORDS = {
    "probability": ("dearer or undecided", "meets the target", "does not meet it"),
    "expected_cost": ("undecided", "least expected cost", "dearer"),
}


@checked
def draw_design_search(found: xr.Dataset, axes: Sequence[Axes] | None = None) -> list[Axes]:
    """Draw probability of damage or expected cost of each alternative against its cost, and the value of each measure.

    Parameters
    ----------
    found : xarray.Dataset
        As ``damagepred.search_design`` returns it.
    axes : sequence of 2 Axes, optional
        Where to draw; by default on a new figure.

    Returns
    -------
    list of Axes
        Of the alternatives and of the measures.

    Raises
    ------
    InputError
        If the dataset is not of a design search.

    Examples
    --------
    >>> import damagepred
    >>> axes = damagepred.plotting.draw_design_search(damagepred.search_design("choices.toml", "choices.design"))
    >>> len(axes)
    2
    """
    quantity = str(found.attrs.get("quantity", "probability"))
    require(found, ("cost", quantity, "decision", "value"), "a design search")
    by_cost = quantity == "expected_cost"
    upper, lower = several_or_new(axes, 2, 1, 8.0, 7.5)
    for code, word in enumerate(_WORDS[quantity]):
        own = found.isel(alternative=np.flatnonzero(found["decision"].values == code))
        if not own.sizes["alternative"]:
            continue
        middle = own[quantity].values
        bars = np.abs(np.array([own[f"{quantity}_{end}"].values - middle for end in ("lower", "upper")]))
        colour, marker = OPENING_STYLES[code]
        upper.errorbar(own["cost"], middle, yerr=bars, fmt=marker, color=colour, capsize=3, label=word)
    if by_cost:
        upper.set_ylim(bottom=0.0)
        upper.set_ylabel("expected cost, repairs included")
    else:
        upper.axhline(float(found.attrs["limit"]), color=OPENING_STYLES[4][0], linewidth=1.0)
        most = max(float(found["probability_upper"].max()), float(found.attrs["limit"]))
        upper.set_ylim(0.0, min(1.3 * most, 1.0))
        upper.set_ylabel("probability (1)")
    upper.set_xlabel("cost")
    upper.legend()
    chosen = verbatim(str(found.attrs["chosen"])) or "no alternative is known to meet it"
    set_title(upper, "Cost with repairs" if by_cost else "Cost and probability of damage", f"chosen: {chosen}")
    places = np.arange(found.sizes["measure"])
    lower.barh(
        places, found["value"].values, 0.5, xerr=found["value_error"].values, color=OPENING_STYLES[0][0], capsize=3
    )
    lower.set_yticks(places, [verbatim(str(name)) for name in found["measure"].values])
    lower.locator_params(axis="x", nbins=5)
    what = "cost of repair" if by_cost else "probability (1)"
    lower.set_xlabel(f"change of the {what}, with standard error")
    return [upper, lower]
