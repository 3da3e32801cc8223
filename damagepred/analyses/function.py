"""A study as a plain function of its variables, for programs with other sampling methods."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal, get_args

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from scipy import special

from damagepred.archive.schema import VARIABLES, Column
from damagepred.arrays import FloatArray
from damagepred.assembly import Limits
from damagepred.campaign.cost_estimate import require_affordable
from damagepred.campaign.sample import Solved, solve_sample
from damagepred.campaign.settings import StudySettings
from damagepred.errors import InputError, nearest, require_one_of
from damagepred.inputs.arguments import checked
from damagepred.runtime.one_thread import one_blas_thread
from damagepred.scene import Scene

Kept = Literal["path", "sampled", "both"]

USUAL = ("damage_category", "crack_width_max", "dpc_opening_max")


class StudyFunction:
    """Function from a vector of a study's variables to the results of the wall.

    Parameters
    ----------
    settings : StudySettings
        Study; its sampling is not used.
    outputs : sequence of str
        Results to return, by their names in the archive.
    movement : {"path", "sampled", "both"}, optional
        Increments to return (see ``Sampling``); by default as in the study.
    limits : Limits
        Estimated cost above which the study is refused.

    Attributes
    ----------
    inputs : tuple of str
        Keys of the variables with one value per wall, in the order of the vector.
    units : tuple of str
        SI units of the inputs.

    Examples
    --------
    >>> wall = Study.from_toml("house.toml").function()           # doctest: +SKIP
    >>> wall([0.7, 0.008]).crack_width_max.values                 # doctest: +SKIP
    """

    @checked
    def __init__(
        self,
        settings: StudySettings,
        outputs: Sequence[str] = USUAL,
        movement: Kept | None = None,
        limits: Limits = Limits(),  # noqa: B008 - frozen
    ) -> None:
        require_affordable(settings, limits)
        for name in outputs:
            if name not in VARIABLES:
                raise InputError(f"outputs: '{name}': studies have no such result." + nearest(name, VARIABLES))
        if movement is not None:
            require_one_of("movement", movement, get_args(Kept))
            settings = replace(settings, study=replace(settings.study, movement=movement))
        self.settings = settings
        self.outputs = tuple(outputs)
        self._design = settings.design()
        self.inputs = self._design.wall
        self.units = tuple(Scene.unit_of(key) for key in self.inputs)

    @one_blas_thread()
    def __call__(self, x: ArrayLike, numbers: int | ArrayLike = 0) -> xr.Dataset:
        """Solve one wall, or several.

        Parameters
        ----------
        x : array (inputs,) or (samples, inputs)
            Values of the variables in SI.
        numbers : int or array of int (samples,)
            Sample whose values the joints have, where values vary from joint to joint. The same number gives the same
            joints; by default all walls have the joints of sample 0, for a function of the vector only.

        Returns
        -------
        xarray.Dataset
            The outputs and ``status``, without a dimension ``sample`` for a single vector. Failed walls have NaN, -1
            for a category, after the last solved increment.

        Raises
        ------
        InputError
            If the vector has another length than the inputs, a value is not finite, or the scene has no such output.
        """
        rows = np.asarray(x, dtype=np.float64)
        single = rows.ndim == 1
        rows = np.atleast_2d(rows)
        if rows.ndim != 2 or rows.shape[1] != len(self.inputs):
            raise InputError(
                f"x has shape {np.shape(x)}: the study has {len(self.inputs)} inputs: {', '.join(self.inputs)}."
            )
        if not np.isfinite(rows).all():
            raise InputError("x: has values that are not finite.")
        which = np.broadcast_to(np.asarray(numbers, dtype=np.int64), (len(rows),))
        if (which < 0).any():
            raise InputError("numbers: must be 0 or more.")
        values = [dict(zip(self.inputs, row)) for row in rows.tolist()]
        ds = self._dataset([solve_sample(self.settings, self._design, *wall) for wall in zip(which.tolist(), values)])
        return ds.isel(sample=0, drop=True) if single else ds

    def _dataset(self, solved: Sequence[Solved]) -> xr.Dataset:
        pattern = next((s.columns for s in solved if s.columns is not None), None)
        if pattern is None:
            raise InputError(f"no sample could be solved; the first: {solved[0].outcome.message}")
        for name in self.outputs:
            if name not in pattern:
                available = ", ".join(n for n in pattern if n not in ("sample", "increment"))
                raise InputError(f"outputs: '{name}': this scene has no such result; it has {available}.")
        ds = xr.Dataset({name: _stacked(pattern[name], name, solved) for name in dict.fromkeys(self.outputs)})
        status = np.array([s.outcome.status for s in solved], dtype=np.int8)
        return ds.assign(status=("sample", status, dict(VARIABLES["status"].attributes())))

    @one_blas_thread()
    def from_unit(self, points: ArrayLike) -> FloatArray:
        """Vectors (samples, inputs) in SI for points of the open unit cube, by the study's distributions."""
        if missing := [key for key in self.inputs if key not in self._design.marginals]:
            raise InputError(f"'{missing[0]}': comes from a table and has no distribution.")
        independent = special.ndtri(np.asarray(points, dtype=np.float64))
        values = self._design.wall_values_from(independent)
        return np.column_stack([np.empty((len(independent), 0)), *values.values()])


def _stacked(pattern: Column, name: str, solved: Sequence[Solved]) -> xr.Variable:
    """One output of all walls; unknown values are NaN or -1."""
    blank = np.full(pattern.values.shape, np.nan if pattern.values.dtype.kind == "f" else -1, pattern.values.dtype)
    values = [blank if s.columns is None else s.columns[name].values for s in solved]
    return xr.Variable(pattern.dims, np.concatenate(values), dict(pattern.attributes))
