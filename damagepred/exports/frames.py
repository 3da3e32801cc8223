"""Tables of curves and walls, for spreadsheets and pandas."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from damagepred.archive.schema import CATEGORY_VARIABLES, VARIABLES, require
from damagepred.enumerations import SampleStatus, flag_meanings
from damagepred.errors import InputError
from damagepred.inputs.arguments import checked
from damagepred.results.house import is_house, wall_dataset, wall_names

if TYPE_CHECKING:
    import pandas as pd


def curves_frame(curves: xr.Dataset) -> pd.DataFrame:
    """Points of all curves, one row per category and intensity."""
    require(curves, ("category", "intensity", "probability"), "the result of fit_fragility")
    points = [n for n in curves.data_vars if set(curves[n].dims) == {"category", "intensity"}]
    frame = curves[points].to_dataframe()
    if "fit_status" in curves:
        status = curves["fit_status"].to_series()
        frame.insert(0, "fit_status", status.reindex(frame.index.get_level_values("category")).to_list())
    if "category_name" in frame:
        frame.insert(0, "category_name", frame.pop("category_name"))
    return frame


def walls_frame(ds: xr.Dataset) -> pd.DataFrame:
    """Walls of a study, one row each: inputs, status, and largest values along the path."""
    require(ds, ("sample", "status"), "the result of open_study")
    # values per joint are no column of a table of walls
    alone = [n for n in ds.data_vars if ds[n].dims == ("sample",)]
    frame = ds[alone].reset_coords(drop=True).to_dataframe()
    names = flag_meanings(SampleStatus)
    frame["status"] = [names[s] for s in ds["status"].values]
    walls = wall_names(ds) if "wall" in ds.dims else []
    of_walls = [f"wall_{name}" for name in ("damage_category", "crack_width_max")]
    of_walls = [name for name in of_walls if name in ds and ds[name].dims == ("sample", "increment", "wall")]
    parts = {name.replace("wall", wall, 1): ds[name][..., k] for name in of_walls for k, wall in enumerate(walls)}
    widest = ("crack_width_max", "crack_band_width_max", "dpc_opening_max", "footing_opening_max")
    for name in (*parts, *CATEGORY_VARIABLES, *widest, "central_deflection", "deflection_ratio"):
        if name in parts or (name in ds.variables and ds[name].dims == ("sample", "increment")):
            values = parts[name].values if name in parts else ds[name].values
            if values.dtype.kind in "iu":
                frame[name] = values.max(axis=1, initial=-1)
            else:
                worst = np.where(np.isfinite(values), values, -np.inf).max(axis=1, initial=-np.inf)
                frame[f"{name.removesuffix('_max')}_max"] = np.where(np.isneginf(worst), np.nan, worst)
    return frame


@checked
def frame(ds: xr.Dataset) -> pd.DataFrame:
    """Dataset as a table: one row per increment of each wall, per sample of a study, or per point of curves.

    Returns
    -------
    pandas.DataFrame
        Of a study by sample: inputs, ``status`` in words, and of results with increments the largest along the path,
        NaN (-1 for a category) where unknown; of houses the worst wall, and of each wall category and widest crack. Of
        curves by category and intensity (m, or 1 for a ratio): ``category_name``, ``fit_status``, ``probability`` with
        ``_lower`` and ``_upper``, and ``empirical``. Of a wall the variables with one value per increment; of a house
        the same of each wall.

    Examples
    --------
    >>> import damagepred
    >>> walls = damagepred.frame(damagepred.open_study("house.dp"))
    >>> len(walls), walls["status"].unique().tolist()
    (24, ['complete'])
    >>> curves = damagepred.fit_fragility(damagepred.open_study("house.dp"), bootstrap=20)
    >>> list(damagepred.frame(curves).index.names)
    ['category', 'intensity']
    >>> scene = damagepred.Scene.from_dict({"wall": {"length": 1.2, "height": 0.3}, "movement": {"increments": 2}})
    >>> damagepred.frame(damagepred.solve(scene))["damage_category"].tolist()
    [0, 0, 0]
    """
    import pandas as pd

    if "sample" in ds.sizes:
        return walls_frame(ds)
    if "increment" not in ds.sizes:
        return curves_frame(ds)
    if is_house(ds):
        walls = {name: frame(wall_dataset(ds, name)) for name in wall_names(ds)}
        return pd.concat(walls, names=["wall"])
    of_increments = [name for name in ds.data_vars if ds[name].dims == ("increment",)]
    return ds[of_increments].to_dataframe()


@checked
def to_arviz(ds: xr.Dataset) -> Any:
    """Study in the groups of ArviZ; all samples, also failed and missing ones, are draws of one chain.

    Parameters
    ----------
    ds : xarray.Dataset
        Study from ``damagepred.open_study``. ArviZ supports neither weights nor missing samples: select the samples
        first, such as ``ds.isel(sample=ds["status"] < 2)``.

    Returns
    -------
    arviz.InferenceData or xarray.DataTree
        ``prior`` has the inputs, ``prior_predictive`` the results, ``sample_stats_prior`` status and run time.

    Examples
    --------
    >>> import damagepred
    >>> data = damagepred.to_arviz(damagepred.open_study("house.dp"))  # doctest: +SKIP
    """
    try:
        import arviz
    except ImportError:
        raise InputError("to_arviz needs ArviZ; install it with `pip install damagepred[arviz]`.") from None
    require(ds, ("sample", "status"), "the result of open_study")
    names: dict[str, list[str]] = {"prior": [], "prior_predictive": [], "sample_stats_prior": []}
    for name in map(str, ds.data_vars):
        of_sample = name in VARIABLES and VARIABLES[name].dims == ("sample",) and not name.startswith("end_")
        group = "sample_stats_prior" if of_sample else "prior_predictive"
        names[group if name in VARIABLES else "prior"].append(name)
    draws = ds.rename(sample="draw")
    groups = {group: draws[members].expand_dims(chain=[0]) for group, members in names.items() if members}
    # ArviZ 1 uses the tree of xarray
    return arviz.InferenceData(**groups) if hasattr(arviz, "InferenceData") else xr.DataTree.from_dict(groups)
