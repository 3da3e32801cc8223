"""Fragility curves as a damage model of pelicun, one component whose limit states are the categories.

pelicun (3.10) reads a CSV file with one row per component and columns as ``LS1-Theta_0``. The measure of the movement
is not among its demands, so an assessment needs the options of ``pelicun_config``. ``Demand-Directional`` is 1: with 0,
pelicun multiplies the demand by 1.2. Limit states of a component have fully correlated capacities in pelicun, so their
curves must not cross.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import xarray as xr

from damagepred.errors import InputError
from damagepred.exports.states import limit_states
from damagepred.inputs.arguments import checked
from damagepred.uq.intensity import movement_words

if TYPE_CHECKING:
    import pandas as pd

COMPONENT = "masonry.wall"
"""Default name of the component."""


class Demand(NamedTuple):
    """Measure of the movement as a demand of pelicun."""

    acronym: str
    kind: str
    unit: str


DEMANDS = {
    "deflection_ratio": Demand("DFR", "unitless", "unitless"),
    "central_deflection": Demand("CDF", "displacement", "m"),
    "surface_movement": Demand("SFM", "displacement", "m"),
    "settlement": Demand("STL", "displacement", "m"),
    "differential_settlement": Demand("DST", "displacement", "m"),
    "angular_distortion": Demand("ADT", "unitless", "unitless"),
}


@checked
def pelicun_frame(
    curves: xr.Dataset,
    component: str = COMPONENT,
    categories: Sequence[int | str] | None = None,
    extrapolated: bool = False,
) -> pd.DataFrame:
    """Damage model of pelicun as a table.

    Parameters
    ----------
    curves : xarray.Dataset
        Curves from ``damagepred.fit_fragility``.
    component : str
        Name of the component.
    categories : sequence of int or str, optional
        Categories to export, by default all; limit state i is the i-th category.
    extrapolated : bool
        Whether to export curves whose median lies beyond the largest movement of the walls.

    Raises
    ------
    InputError
        If a category has no curve, curves cross, or pelicun has no demand for the measure of the movement.

    Examples
    --------
    >>> from damagepred import exports, fit_fragility, open_study
    >>> curves = fit_fragility(open_study("house.dp"), bootstrap=20)
    >>> exports.pelicun_frame(curves, categories=[2]).loc["masonry.wall", "LS1-Family"]
    'lognormal'
    """
    import pandas as pd

    states, demand = limit_states(curves, "pelicun", categories, extrapolated), _demand(curves)
    row: dict[str, Any] = {"Incomplete": 0, "Demand-Type": movement_words(curves).title(), "Demand-Unit": demand.unit}
    row |= {"Demand-Offset": 0, "Demand-Directional": 1}
    for number, (median, dispersion) in enumerate(zip(states["median"].values, states["dispersion"].values), start=1):
        row[f"LS{number}-Family"] = "lognormal"
        row |= {f"LS{number}-Theta_0": float(median), f"LS{number}-Theta_1": float(dispersion)}
    return pd.DataFrame([row], index=pd.Index([component], name="ID"))


@checked
def pelicun_config(curves: xr.Dataset) -> dict[str, Any]:
    """Options that define the demand in a pelicun assessment: ``Assessment(pelicun_config(curves))``.

    Examples
    --------
    >>> from damagepred import exports, fit_fragility, open_study
    >>> exports.pelicun_config(fit_fragility(open_study("house.dp"), bootstrap=20))
    {'CustomDemandTypes': {'Central Deflection': {'Acronym': 'CDF', 'UnitType': 'displacement'}}}
    """
    demand, name = _demand(curves), movement_words(curves).title()
    return {"CustomDemandTypes": {name: {"Acronym": demand.acronym, "UnitType": demand.kind}}}


def _demand(curves: xr.Dataset) -> Demand:
    if (measure := str(curves.attrs.get("intensity_measure", ""))) not in DEMANDS:
        raise InputError(f"intensity_measure = {measure!r}: exports for pelicun take {', '.join(DEMANDS)}.")
    return DEMANDS[measure]
