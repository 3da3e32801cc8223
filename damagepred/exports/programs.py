"""Fragility curves for other programs, as limit states in order: pelicun and OpenQuake.

pelicun (3.10) reads a CSV file with one row per component and columns as ``LS1-Theta_0``. The measure of the movement
is not among its demands, so an assessment needs the options of ``pelicun_config``. ``Demand-Directional`` is 1: with 0,
pelicun multiplies the demand by 1.2. Limit states of a component have fully correlated capacities in pelicun, so their
curves must not cross.

NRML, the format of OpenQuake, has a fixed list of earthquake intensities. PGD, a displacement of the ground in cm, is
the nearest to a movement of the ground under a house, so lengths are written in cm under this name. A deflection ratio
has no unit and is written unchanged, under the same name. The description explains PGD.
"""

from __future__ import annotations

import itertools
import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree as Tree

import numpy as np
import xarray as xr
from scipy import special

from damagepred.archive.files import check_output, write_text, write_whole
from damagepred.archive.schema import require
from damagepred.errors import InputError, nearest
from damagepred.inputs.arguments import checked
from damagepred.inputs.text import csv_safe, without_controls
from damagepred.uq.capacity import category_number
from damagepred.uq.fragility.describe import lognormal_of
from damagepred.uq.intensity import movement_words

if TYPE_CHECKING:
    import pandas as pd

FORMATS = {"pelicun": "_pelicun.csv", "openquake": "_openquake.xml", "openquake-discrete": "_openquake_discrete.xml"}
"""Export formats, and the endings of their file names."""


def write_csv(frame: pd.DataFrame, path: Path, *, index: bool = True) -> None:
    """Write a table as CSV."""
    check_output(path, ".csv")
    write_whole(path, lambda p: csv_safe(frame).to_csv(p, index=index))


def export_place(kind: str, beside: str | Path) -> Path:
    """Path of an export: a file of its kind, or beside another file or a study folder, under its name."""
    if kind not in FORMATS:
        raise InputError(f"format = {kind!r}: exports are {', '.join(FORMATS)}." + nearest(kind, FORMATS))
    path = Path(beside)
    return path if path.suffix == Path(FORMATS[kind]).suffix else path.with_name(path.stem + FORMATS[kind])


@checked
def export_curves(
    curves: xr.Dataset,
    kind: str,
    beside: str | Path,
    categories: Sequence[int | str] | None = None,
    extrapolated: bool = False,
) -> list[Path]:
    """Write fragility curves for another program.

    Parameters
    ----------
    curves : xarray.Dataset
        Curves from ``damagepred.fit_fragility``.
    kind : {"pelicun", "openquake", "openquake-discrete"}
        For pelicun a damage model as CSV, with the options that define the demand as JSON; for OpenQuake a fragility
        model as NRML 0.5.
    beside : str or Path
        File to write, or file or study folder beside which the export gets its name: ``house.dp`` makes
        ``house_pelicun.csv``.
    categories : sequence of int or str, optional
        Categories to export; by default all.
    extrapolated : bool
        Whether to export curves whose median lies beyond the largest movement of the walls.

    Examples
    --------
    >>> from damagepred import exports, fit_fragility, open_study
    >>> curves = fit_fragility(open_study("house.dp"), bootstrap=20)
    >>> [path.name for path in exports.export_curves(curves, "pelicun", "house.dp", categories=[2])]
    ['house_pelicun.csv', 'house_pelicun.json']
    """
    path = export_place(kind, beside)
    check_output(path, path.suffix)
    if kind == "pelicun":
        write_csv(pelicun_frame(curves, categories, extrapolated), path)
        options = path.with_suffix(".json")
        write_text(options, json.dumps(pelicun_config(curves), indent=2) + "\n")
        return [path, options]
    write_text(path, openquake_xml(curves, kind.endswith("discrete"), categories, extrapolated))
    return [path]


RARE = 1e-3  # crossings of two curves below this probability, or closer to 1 than this, are tolerated


def limit_states(
    curves: xr.Dataset, program: str, categories: Sequence[int | str] | None = None, extrapolated: bool = False
) -> xr.Dataset:
    """Curves of some categories, lowest first, none without a curve and no two that cross; ``state``: their names."""
    require(curves, ("median", "dispersion", "fit_status", "intensity", "category"), "the result of fit_fragility")
    if curves.attrs.get("model") == "empirical":
        raise InputError("model = 'empirical': has no medians and dispersions to export; fit 'separate' or 'common'.")
    available = [int(c) for c in curves["category"].values]
    wanted = available if categories is None else sorted({category_number(curves, c) for c in categories})
    if unknown := [c for c in wanted if c not in available] or (not wanted and [0]):
        raise InputError(f"categories = {unknown}: the curves are of the categories {_listed(available)}.")
    states = curves.sel(category=wanted)
    form = lognormal_of(states)
    why = [str(status) for status in states["fit_status"].values]
    fitted = np.isfinite(form.median) & np.isfinite(form.dispersion)
    for k in np.flatnonzero(fitted):
        if form.start[k] > 0:
            why[k] = f"{form.start[k]:.2g} of the walls are in it before any movement, which the format cannot express"
        elif form.extrapolated[k] and not extrapolated:
            why[k] = "its median lies beyond the largest movement of a wall (--extrapolated takes it all the same)"
        else:
            continue
        fitted[k] = False
    if not fitted.all():
        reasons = "; ".join(f"category {c}: {s}" for c, s, f in zip(wanted, why, fitted) if not f)
        others, advice = [c for c, f in zip(wanted, fitted) if f], "Take more samples, or a larger movement."
        if others:
            advice = f"Export the others alone (--categories {_listed(others)})."
        raise InputError(f"these categories have no curve to export: {reasons}. {advice}")
    names = states["category_name"].values if "category_name" in states.variables else [f"category_{c}" for c in wanted]
    words = [str(name).replace(" ", "_") for name in names]
    columns = {"state": words, "median": form.median, "dispersion": form.dispersion}
    states = states.assign({name: ("category", values) for name, values in columns.items()})
    for lesser, worse in itertools.pairwise(range(len(wanted))):
        _require_order(states.isel(category=[lesser, worse]), program)
    return states


def _require_order(states: xr.Dataset, program: str) -> None:
    """Check that the worse of two categories is nowhere more probable than the lesser one."""
    (a, b), (s, t) = np.log(states["median"].values), states["dispersion"].values
    where, probability = np.nan, 0.0
    if abs(s - t) > 1e-9 * s:  # where the curves cross
        crossing = (a * t - b * s) / (t - s)
        where, probability = float(np.exp(np.clip(crossing, -700, 700))), float(special.ndtr((crossing - a) / s))
    if b < a or RARE < probability < 1 - RARE:
        place = f"{1e3 * where:.3g} mm" if in_metres(states) else f"{where:.3g}"
        lesser, worse = states["category"].values
        raise InputError(
            f"the curves of categories {lesser} and {worse} cross at {place}, where both are {probability:.2g}; "
            f"{program} takes limit states in order. Fit all curves with one dispersion (--model common): then they "
            "cannot cross."
        )


def in_metres(states: xr.Dataset) -> bool:
    """Whether the movement is a length."""
    return str(states["intensity"].attrs.get("units", "1")) == "m"


def _listed(categories: Sequence[int]) -> str:
    return ",".join(str(c) for c in categories)


COMPONENT = "masonry.wall"  # name of the component


DEMANDS = {
    "deflection_ratio": ("DFR", "unitless"),
    "central_deflection": ("CDF", "displacement"),
    "surface_movement": ("SFM", "displacement"),
    "settlement": ("STL", "displacement"),
    "differential_settlement": ("DST", "displacement"),
    "angular_distortion": ("ADT", "unitless"),
}
"""Measures of the movement as demands of pelicun: acronym and type of unit."""


def pelicun_frame(
    curves: xr.Dataset, categories: Sequence[int | str] | None = None, extrapolated: bool = False
) -> pd.DataFrame:
    """Damage model of pelicun as a table with a row for the component; limit state i is the i-th category."""
    import pandas as pd

    states, (_, kind) = limit_states(curves, "pelicun", categories, extrapolated), _demand(curves)
    unit = "m" if kind == "displacement" else kind
    row: dict[str, Any] = {"Incomplete": 0, "Demand-Type": movement_words(curves).title(), "Demand-Unit": unit}
    row |= {"Demand-Offset": 0, "Demand-Directional": 1}
    for number, (median, dispersion) in enumerate(zip(states["median"].values, states["dispersion"].values), start=1):
        row[f"LS{number}-Family"] = "lognormal"
        row |= {f"LS{number}-Theta_0": float(median), f"LS{number}-Theta_1": float(dispersion)}
    return pd.DataFrame([row], index=pd.Index([COMPONENT], name="ID"))


def pelicun_config(curves: xr.Dataset) -> dict[str, Any]:
    """Options that define the demand in a pelicun assessment: ``Assessment(pelicun_config(curves))``."""
    (acronym, kind), name = _demand(curves), movement_words(curves).title()
    return {"CustomDemandTypes": {name: {"Acronym": acronym, "UnitType": kind}}}


def _demand(curves: xr.Dataset) -> tuple[str, str]:
    if (measure := str(curves.attrs.get("intensity_measure", ""))) not in DEMANDS:
        raise InputError(f"intensity_measure = {measure!r}: exports for pelicun take {', '.join(DEMANDS)}.")
    return DEMANDS[measure]


NAMESPACE = "http://openquake.org/xmlns/nrml/0.5"
INTENSITY = "PGD"
MODEL = "masonry_wall"  # name of the model and its function: the taxonomy of exposed assets

NOTHING = 1e-6  # probability of the least category below which OpenQuake assumes no damage
ALL = 1 - 1e-6  # probability of the worst category up to which curves are exported; OpenQuake keeps them constant above
LEVELS = 60  # levels of a discrete function, evenly spaced in the logarithm


def openquake_xml(
    curves: xr.Dataset,
    discrete: bool = False,
    categories: Sequence[int | str] | None = None,
    extrapolated: bool = False,
) -> str:
    """Fragility model as NRML 0.5: mean and standard deviation of the capacity, or probabilities at discrete levels."""
    states = limit_states(curves, "OpenQuake", categories, extrapolated)
    names, median, dispersion = states["state"].values.tolist(), states["median"].values, states["dispersion"].values
    factor, unit = (100.0, "cm") if in_metres(states) else (1.0, "no unit")
    # smallest and largest exported level
    low = factor * float((median * np.exp(dispersion * special.ndtri(NOTHING))).min())
    high = factor * float((median * np.exp(dispersion * special.ndtri(ALL))).max())
    root = Tree.Element("nrml", {"xmlns": NAMESPACE})
    attributes = {"id": MODEL, "assetCategory": "buildings", "lossCategory": "structural"}
    model = Tree.SubElement(root, "fragilityModel", attributes)
    Tree.SubElement(model, "description").text = _description(states, factor, unit)
    Tree.SubElement(model, "limitStates").text = " ".join(names)
    form = "discrete" if discrete else "continuous"
    function = Tree.SubElement(model, "fragilityFunction", {"id": MODEL, "format": form})
    imls = Tree.SubElement(function, "imls", {"imt": INTENSITY, "noDamageLimit": _text(low)})
    if not discrete:
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
