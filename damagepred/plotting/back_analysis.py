"""Back-analysis: the posterior of the movement, and the posterior crack map with the observed cracks on it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from damagepred.analyses.posterior_tables import measures, odds_in_words
from damagepred.inputs.arguments import checked
from damagepred.plotting.colours import CURVE_STYLES, OPENING_STYLES
from damagepred.plotting.sheet import MM, legend_below, plain_number, require, set_title, several_or_new, verbatim

_LABEL = {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.0}
"""Ground of the labels of observed cracks."""


@checked
def draw_back_analysis(found: xr.Dataset, axes: Sequence[Axes] | None = None) -> list[Axes]:
    """Draw the posterior of the movement under each cause, and below it the crack map of the likeliest one.

    Parameters
    ----------
    found : xarray.Dataset
        As ``damagepred.infer`` returns it.
    axes : sequence of Axes, optional
        Where to draw: one, or two where cracks with a place were observed; by default on a new figure.

    Returns
    -------
    list of Axes
        Of the movement and, where local cracks were observed, of the crack map.

    Raises
    ------
    InputError
        If the dataset is not of a back-analysis.

    Examples
    --------
    >>> import damagepred
    >>> from damagepred.uq.observations import CrackObservation, Observations
    >>> seen = Observations(crack=(CrackObservation(width="2 mm"),))
    >>> len(damagepred.plotting.draw_back_analysis(damagepred.infer("house.dp", seen)))
    1
    """
    require(found, ("posterior", "movement", "movement_measure", "posterior_odds"), "a back-analysis")
    axes = several_or_new(axes, 2 if "crack_probability" in found else 1, 1, 8.0, 7.5)
    shown, largest = measures(found), found["movement_largest"].values
    alike = len(set(shown)) == 1
    for k, name in enumerate(str(study) for study in found["study"].values):
        own = (found["study_of_sample"] == k).values
        weight, movement = (found[n].values[own].ravel() for n in ("posterior", "movement"))
        used = weight > 0
        order = np.argsort(movement[used])
        total = np.cumsum(weight[used][order]) / max(weight.sum(), 1e-300)
        colour, style = OPENING_STYLES[k % len(OPENING_STYLES)][0], CURVE_STYLES[k % len(CURVE_STYLES)]
        odds = odds_in_words(float(found["posterior_odds"][k]))
        label, factor = f"{verbatim(name)}: odds {odds}", shown[k].factor if alike else 1.0 / largest[k]
        if not alike:
            label += f"; {shown[k].words} up to {shown[k].factor * largest[k]:.3g} {shown[k].unit}"
        axes[0].step(movement[used][order] * factor, total, where="post", color=colour, linestyle=style, label=label)
    axes[0].set_ylim(0.0, 1.0)
    axes[0].set_xlabel(f"{shown[0].words} ({shown[0].unit})" if alike else "movement over the largest of the study (1)")
    axes[0].set_ylabel("posterior probability\nof a smaller movement (1)")
    warning = "" if found["resembles"].values.any() else "NO STORED WALL RESEMBLES THE OBSERVATIONS"
    set_title(axes[0], "Movement, given the observations", warning)
    legend_below(axes[0], axes[0].get_legend_handles_labels()[0])
    if len(axes) > 1:
        _draw_map(found, axes[1])
    return axes


def _draw_map(found: xr.Dataset, ax: Axes) -> None:
    one = found.isel(study=int(found["cause_posterior"].values.argmax()))
    probability = one["crack_probability"]
    mesh = ax.pcolormesh(one["map_x"], one["map_y"], probability, vmin=0.0, vmax=1.0, cmap="Greys", shading="nearest")
    ax.figure.colorbar(mesh, ax=ax, label="probability (1)", shrink=0.7)
    names = ("observed_x", "observed_y", "observed_width", "observed_limit")
    places = sorted(zip(*(found[name].values.tolist() for name in names if name in found)))
    for k, (x, y, width, limit) in enumerate(places):
        ax.plot(x, y, marker="o" if width else "x", color=OPENING_STYLES[0][0], fillstyle="none", markersize=9)
        words = f"{limit} {plain_number(width * MM)} mm".strip() if width else "none"
        # neighbours stand at different heights
        ax.annotate(words, (x, y), (0, (14, 28)[k % 2]), textcoords="offset points", ha="center", bbox=_LABEL)
    ax.set_aspect("equal")
    ax.set_xlabel("along the wall (m)")
    ax.set_ylabel("height (m)")
    limit, marks = float(probability.attrs["wider_than"]) * MM, "; marks: observed" if places else ""
    set_title(ax, "Crack map", f"{verbatim(str(one['study'].values))}: cracks wider than {limit:g} mm{marks}")
