"""Fragility curves as a fragility model of OpenQuake (NRML 0.5).

NRML has a fixed list of earthquake intensities. PGD, a displacement of the ground in cm, is the nearest to a movement
of the ground under a house, so lengths are written in cm under this name. A deflection ratio has no unit and is written
unchanged, under the same name. The description explains PGD.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal
from xml.etree import ElementTree as Tree

import numpy as np
import xarray as xr
from scipy import special

from damagepred.errors import InputError
from damagepred.exports.states import in_metres, limit_states
from damagepred.inputs.arguments import checked
from damagepred.inputs.text import without_controls
from damagepred.uq.fragility.describe import lognormal_of
from damagepred.uq.intensity import movement_words

NAMESPACE = "http://openquake.org/xmlns/nrml/0.5"
INTENSITY = "PGD"
MODEL = "masonry_wall"
"""Default name of the model and its function: the taxonomy of exposed assets."""

NOTHING = 1e-6
"""Probability of the least category below which OpenQuake assumes no damage."""

ALL = 1 - 1e-6
"""Probability of the worst category up to which curves are exported; OpenQuake keeps them constant above."""

LEVELS = 60
"""Levels of a discrete function, evenly spaced in the logarithm."""


@checked
def openquake_xml(
    curves: xr.Dataset,
    form: Literal["continuous", "discrete"] = "continuous",
    identifier: str = MODEL,
    categories: Sequence[int | str] | None = None,
    extrapolated: bool = False,
) -> str:
    """Fragility model as NRML 0.5.

    Parameters
    ----------
    curves : xarray.Dataset
        Curves from ``damagepred.fit_fragility``.
    form : {"continuous", "discrete"}
        Lognormal functions by mean and standard deviation of the capacity (in NRML not of its logarithm); or
        probabilities at levels, between which OpenQuake interpolates.
    identifier : str
        Name of model and function, the taxonomy of assets: letters, digits, and ``_ - .``.
    categories : sequence of int or str, optional
        Categories to export; by default all.
    extrapolated : bool
        Whether to export curves whose median lies beyond the largest movement of the walls.

    Raises
    ------
    InputError
        If a category has no curve, curves cross, or the identifier has other characters.

    Examples
    --------
    >>> from damagepred import exports, fit_fragility, open_study
    >>> curves = fit_fragility(open_study("house.dp"), bootstrap=20)
    >>> exports.openquake_xml(curves, categories=[2, 3]).count("<params ")
    2
    """
    if form not in ("continuous", "discrete"):
        raise InputError(f"form = {form!r}: must be 'continuous' or 'discrete'.")
    if not identifier or not all(c.isascii() and (c.isalnum() or c in "_-.") for c in identifier):
        raise InputError(f"identifier = {identifier!r}: may have letters, digits, '_', '-' and '.' alone.")
    states = limit_states(curves, "OpenQuake", categories, extrapolated)
    names, median, dispersion = states["state"].values.tolist(), states["median"].values, states["dispersion"].values
    factor, unit = (100.0, "cm") if in_metres(states) else (1.0, "no unit")
    # smallest and largest exported level
    low = factor * float((median * np.exp(dispersion * special.ndtri(NOTHING))).min())
    high = factor * float((median * np.exp(dispersion * special.ndtri(ALL))).max())
    root = Tree.Element("nrml", {"xmlns": NAMESPACE})
    attributes = {"id": identifier, "assetCategory": "buildings", "lossCategory": "structural"}
    model = Tree.SubElement(root, "fragilityModel", attributes)
    Tree.SubElement(model, "description").text = _description(states, factor, unit)
    Tree.SubElement(model, "limitStates").text = " ".join(names)
    function = Tree.SubElement(model, "fragilityFunction", {"id": identifier, "format": form})
    imls = Tree.SubElement(function, "imls", {"imt": INTENSITY, "noDamageLimit": _text(low)})
    if form == "continuous":
        function.set("shape", "logncdf")
        imls.attrib |= {"minIML": _text(low), "maxIML": _text(high)}
        mean = factor * median * np.exp(dispersion**2 / 2)
        for name, m, spread in zip(names, mean, mean * np.sqrt(np.expm1(dispersion**2))):
            Tree.SubElement(function, "params", {"ls": name, "mean": _text(m), "stddev": _text(spread)})
    else:
        levels = np.geomspace(low, high, LEVELS)
        imls.text = " ".join(map(_text, levels))
        for name, probability in zip(names, lognormal_of(states).probability(levels / factor)):
            Tree.SubElement(function, "poes", {"ls": name}).text = " ".join(f"{p:.9g}" for p in probability)
    Tree.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + Tree.tostring(root, encoding="unicode") + "\n"


def _description(states: xr.Dataset, factor: float, unit: str) -> str:
    title, words = without_controls(str(states.attrs.get("title", "fragility curves"))), movement_words(states)
    of = "; ".join(
        f"{name}: category {c} or worse" for name, c in zip(states["state"].values, states["category"].values)
    )
    largest = f"{factor * float(states['intensity'].max()):.4g}{' cm' if unit == 'cm' else ''}"
    return (
        f"{title}. {INTENSITY} stands for the {words} ({unit}). {of}. Walls were moved to {largest} at most: beyond "
        "that the curves are extrapolated."
    )


def _text(value: float) -> str:
    return f"{value:.12g}"
