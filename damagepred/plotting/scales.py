"""Scales of damage: the matrix of their agreement."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from damagepred.inputs.arguments import checked
from damagepred.plotting.sheet import axes_or_new, require, set_title, small, title_of, verbatim


@checked
def draw_scales(found: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw the share of states that each pair of scales judges alike: both beyond their first limits, or both below.

    Parameters
    ----------
    found : xarray.Dataset
        As ``damagepred.compare_scales`` returns it.
    ax : Axes, optional
        Where to draw; by default on a new figure.

    Returns
    -------
    Axes
        Of the matrix.

    Raises
    ------
    InputError
        If the dataset compares no scales.

    Examples
    --------
    >>> import damagepred
    >>> found = damagepred.compare_scales(damagepred.open_study("house.dp"))
    >>> damagepred.plotting.draw_scales(found).get_title(loc="left") != ""
    True
    """
    require(found, ("agreement", "share_reached"), "a comparison of scales")
    ax = axes_or_new(ax, 10.0, 8.0)
    shares = found["agreement"].values
    ax.imshow(shares, vmin=0.0, vmax=1.0, cmap="Greys", aspect="auto")
    for (row, column), share in np.ndenumerate(shares):
        text = "-" if np.isnan(share) else f"{share:.2f}"
        colour = "white" if share > 0.5 else "black"
        ax.text(column, row, text, ha="center", va="center", color=colour, fontsize=small(ax))
    names = [verbatim(str(name)) for name in found["scale"].values]
    ticks = range(len(names))
    ax.set_xticks(ticks, [str(number + 1) for number in ticks])
    ax.set_yticks(ticks, [f"{name}  {number + 1}" for number, name in enumerate(names)], fontsize=small(ax))
    set_title(ax, title_of(found, "") or "Agreement of scales", "share of states that two scales judge alike")
    return ax
