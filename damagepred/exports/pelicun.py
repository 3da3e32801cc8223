"""Fragility curves as a damage model of pelicun, one component whose limit states are the categories.

pelicun (3.10) reads a CSV file with one row a component and columns as ``LS1-Theta_0``. The measure of the movement is
none of the demands it knows: it has to be told of it when an assessment is made, for which ``pelicun_config`` has the
words. ``Demand-Directional`` is 1: with 0, pelicun multiplies the demand by 1.2. Limit states of a component have fully
correlated capacities there, which is why their curves must not cross.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import xarray as xr

from damagepred.errors import InputError
from damagepred.exports.states import limit_states, require_order
from damagepred.inputs.arguments import checked

if TYPE_CHECKING:
    import pandas as pd

COMPONENT = "masonry.wall"
"""Name of the component, unless another is given."""


class Demand(NamedTuple):
    """A measure of the movement in pelicun's words."""

    name: str
    acronym: str
    kind: str
    unit: str


DEMANDS = {
    "deflection_ratio": Demand("Deflection Ratio", "DFR", "unitless", "unitless"),
    "central_deflection": Demand("Central Deflection", "CDF", "displacement", "m"),
    "surface_movement": Demand("Surface Movement", "SFM", "displacement", "m"),
}


@checked
def pelicun_frame(
    curves: xr.Dataset,
    component: str = COMPONENT,
    categories: Sequence[int] | None = None,
    extrapolated: bool = False,
) -> pd.DataFrame:
    """Return the table that pelicun loads as a damage model.

    Parameters
    ----------
    curves : xarray.Dataset
        As ``damagepred.fit_fragility`` returns it.
    component : str
        Name of the component.
    categories : sequence of int, optional
        By default all; limit state i is the i-th of them.
    extrapolated : bool
        See ``limit_states``.

    Returns
    -------
    pandas.DataFrame
        One row, indexed by the component.

    Raises
    ------
    InputError
        If a category has no curve, curves cross, or it does not know the measure of the movement.

    Examples
    --------
    >>> from damagepred import exports, fit_fragility, open_study
    >>> curves = fit_fragility(open_study("house.dp"), bootstrap=20)
    >>> exports.pelicun_frame(curves, categories=[2]).loc["masonry.wall", "LS1-Family"]
    'lognormal'
    """
    import pandas as pd

    states = limit_states(curves, categories, extrapolated)
    require_order(states, "pelicun")
    demand = _demand(states.measure)
    row: dict[str, Any] = {
        "Incomplete": 0,
        "Demand-Type": demand.name,
        "Demand-Unit": demand.unit,
        "Demand-Offset": 0,
        "Demand-Directional": 1,
    }
    for number, (median, dispersion) in enumerate(zip(states.median, states.dispersion), start=1):
        row |= {
            f"LS{number}-Family": "lognormal",
            f"LS{number}-Theta_0": float(median),
            f"LS{number}-Theta_1": float(dispersion),
        }
    return pd.DataFrame([row], index=pd.Index([component], name="ID"))


@checked
def pelicun_config(curves: xr.Dataset) -> dict[str, Any]:
    """Return the options with which a pelicun assessment knows the demand: ``Assessment(pelicun_config(curves))``.

    Examples
    --------
    >>> from damagepred import exports, fit_fragility, open_study
    >>> exports.pelicun_config(fit_fragility(open_study("house.dp"), bootstrap=20))
    {'CustomDemandTypes': {'Central Deflection': {'Acronym': 'CDF', 'UnitType': 'displacement'}}}
    """
    demand = _demand(str(curves.attrs.get("intensity_measure", "")))
    return {"CustomDemandTypes": {demand.name: {"Acronym": demand.acronym, "UnitType": demand.kind}}}


def _demand(measure: str) -> Demand:
    if measure not in DEMANDS:
        raise InputError(f"intensity_measure = {measure!r}: exports for pelicun know {', '.join(DEMANDS)}.")
    return DEMANDS[measure]
