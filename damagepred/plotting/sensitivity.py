"""What damage depends on: rank correlations and shares of variance, with their intervals."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from damagepred.inputs.arguments import checked
from damagepred.plotting.colours import RANK_COLOURS, SHARE_COLOURS
from damagepred.plotting.sheet import (
    grid,
    legend_below,
    require,
    set_title,
    several_or_new,
    title_of,
)


@checked
def draw_sensitivity(found: xr.Dataset, axes: Sequence[Axes] | None = None) -> list[Axes]:
    """Draw how capacity goes with each input, and the shares of variance.

    Parameters
    ----------
    found : xarray.Dataset
        As ``damagepred.analyses.variance_shares.study_sensitivity`` returns it.
    axes : sequence of 2 Axes, optional
        Where to draw; by default one above the other on a new figure.

    Returns
    -------
    list of Axes
        Of rank correlations and of shares of variance: points with their intervals, one line an input, the strongest
        on top.

    Raises
    ------
    InputError
        If the dataset holds something else.

    Examples
    --------
    >>> import damagepred
    >>> found = damagepred.study_sensitivity(damagepred.open_study("house.dp"), category=2, resamples=50)
    >>> axes = damagepred.plotting.draw_sensitivity(found)
    >>> len(axes)
    2
    """
    require(found, ("spearman", "partial", "first_order"), "what study_sensitivity returns")
    order = np.argsort(np.abs(found["spearman"].values))
    some = found.isel(variable=order)
    names = [str(n).replace(".", ", ").replace("_", " ") for n in some["variable"].values]
    upper, lower = several_or_new(axes, 2, 1, 9.0, 3.6 + 0.9 * len(names))
    at = np.arange(len(names), dtype=np.float64)
    _points(upper, some, "spearman", at + 0.12, RANK_COLOURS[0], "rank correlation")
    _points(upper, some, "partial", at - 0.12, RANK_COLOURS[1], "partial, without what others explain")
    upper.set_xlim(-1.0, 1.0)
    upper.set_xticks(np.linspace(-1.0, 1.0, 5))
    upper.axvline(0.0, color="0.4", linewidth=0.8)
    upper.set_xlabel("rank correlation (1)")
    upper.set_yticks(at, names)
    _points(lower, some, "first_order", at, SHARE_COLOURS[0], "by itself")
    lower.axvline(0.0, color="0.4", linewidth=0.8)
    lower.axvline(1.0, color="0.4", linewidth=0.8)
    lower.set_xlim(min(-0.05, lower.get_xlim()[0]), max(1.05, lower.get_xlim()[1]))
    lower.set_xlabel("share of the variance (1)")
    lower.set_yticks(at, names)
    for ax in (upper, lower):
        ax.set_ylim(-0.6, len(names) - 0.4)
        grid(ax, "x")
        legend_below(ax, ax.get_legend_handles_labels()[0], 2, 0.6, left=True)
    title = title_of(found, "sensitivity")
    censored = float(found.attrs.get("share_censored", 0.0))
    lines = (
        title[:1].upper() + title[1:],
        f"{found.attrs.get('output', '')}; {int(found.attrs['walls'])} walls"
        + (f", {censored:.0%} of all had not reached it" if censored >= 0.005 else "")
        + f"; bars: {float(found.attrs['confidence']):.0%} intervals",
    )
    set_title(upper, *lines)
    return [upper, lower]


def _points(ax: Axes, found: xr.Dataset, name: str, at: np.ndarray, colour: str, label: str) -> None:
    value, low, high = (found[f"{name}{end}"].values for end in ("", "_lower", "_upper"))
    ax.errorbar(
        value,
        at,
        xerr=np.nan_to_num([value - low, high - value]).clip(0.0),
        fmt="o",
        color=colour,
        capsize=3,
        markersize=5,
        label=label or "_",
        zorder=3,
    )
