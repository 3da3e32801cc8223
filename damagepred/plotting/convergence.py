"""How the estimates of a study settle as walls are added."""

from __future__ import annotations

import xarray as xr
from matplotlib.axes import Axes

from damagepred.errors import InputError
from damagepred.inputs.arguments import checked
from damagepred.plotting.categories import highest_of, name_of
from damagepred.plotting.colours import CATEGORY_COLOURS, CURVE_STYLES
from damagepred.plotting.sheet import MM, axes_or_new, grid, legend_below, plain_number, require, set_title, title_of
from damagepred.uq.intensity import movement_words
from damagepred.uq.running import running_probability


@checked
def draw_convergence(ds: xr.Dataset, at: float, ax: Axes | None = None, confidence: float = 0.9) -> Axes:
    """Draw the probability of each category at a movement as found from the first walls, more and more of them.

    Parameters
    ----------
    ds : xarray.Dataset
        A study, with paths.
    at : float
        Movement (m): of the study's own measure.
    ax : Axes, optional
        Where to draw; by default on a new figure.
    confidence : float
        Of the bands.

    Raises
    ------
    InputError
        If the dataset is not a study, or no wall of it has been solved.

    Examples
    --------
    >>> import damagepred
    >>> ax = damagepred.plotting.draw_convergence(damagepred.open_study("house.dp"), at=2e-3)
    >>> ax.get_ylabel()
    'probability (1)'
    """
    require(ds, ("damage_category", "status"), "a study as `damagepred.open_study` returns it")
    ax = axes_or_new(ax, 9.0, 5.0)
    most = 0
    for category in range(1, highest_of(ds) + 1):
        found = running_probability(ds, category, at, confidence=confidence)
        if not len(found.counted):
            raise InputError("the study has no finished sample yet; run `damagepred study` first.")
        most = int(found.counted[-1])
        colour = CATEGORY_COLOURS[category % len(CATEGORY_COLOURS)]
        ax.fill_between(found.counted, found.lower, found.upper, color=colour, alpha=0.15, linewidth=0)
        style = CURVE_STYLES[(category - 1) % len(CURVE_STYLES)]
        label = f"{category} {name_of(ds, category)} or worse{'' if found.value[-1] > 0 else ': never reached'}"
        ax.plot(found.counted, found.value, color=colour, linestyle=style, linewidth=1.8, label=label)
    ax.set_xlim(min(2, most), max(most, 3))
    ax.set_xscale("log")
    marks = [n for n in (2, 3, 5, 10, 20, 50, 100, 200, 500, *(10**k for k in range(3, 8))) if n < 0.75 * most]
    ax.set_xticks([*marks, most], labels=[str(n) for n in (*marks, most)])
    ax.minorticks_off()
    ax.set_ylim(-0.02, 1.02)
    grid(ax)
    ax.set_xlabel("walls counted (1), logarithmic")
    ax.set_ylabel("probability (1)")
    legend_below(ax, ax.get_legend_handles_labels()[0], 2)
    set_title(
        ax,
        title_of(ds, "study"),
        f"estimates at a {movement_words(ds)} of {plain_number(at * MM)} mm; bands: {confidence:.0%} confidence each",
    )
    return ax
