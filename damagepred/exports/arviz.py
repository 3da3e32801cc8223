"""Studies for ArviZ: sampled inputs as draws of the prior, results as its predictions."""

from __future__ import annotations

from typing import Any

import xarray as xr

from damagepred.archive.schema import VARIABLES
from damagepred.errors import InputError
from damagepred.exports.frames import require_results
from damagepred.inputs.arguments import checked


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

    Raises
    ------
    InputError
        If ArviZ is not installed, or the dataset is of no study.

    Examples
    --------
    >>> import damagepred
    >>> data = damagepred.to_arviz(damagepred.open_study("house.dp"))  # doctest: +SKIP
    """
    try:
        import arviz
    except ImportError:
        raise InputError("to_arviz needs ArviZ; install it with `pip install damagepred[arviz]`.") from None
    require_results(ds, ("sample", "status"), "open_study")
    names: dict[str, list[str]] = {"prior": [], "prior_predictive": [], "sample_stats_prior": []}
    for name in map(str, ds.data_vars):
        of_sample = name in VARIABLES and VARIABLES[name].dims == ("sample",) and not name.startswith("end_")
        group = "sample_stats_prior" if of_sample else "prior_predictive"
        names[group if name in VARIABLES else "prior"].append(name)
    draws = ds.rename(sample="draw")
    groups = {group: draws[members].expand_dims(chain=[0]) for group, members in names.items() if members}
    # ArviZ 1 uses the tree of xarray
    return arviz.InferenceData(**groups) if hasattr(arviz, "InferenceData") else xr.DataTree.from_dict(groups)
