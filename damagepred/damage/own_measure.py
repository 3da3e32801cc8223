"""Measure of damage by a Python function of the user."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.errors import InputError


@lru_cache(maxsize=8)
def _function(name: str) -> Callable[[Mapping[str, FloatArray]], Any]:
    """Function by ``module:function``, of an installed module or of one in the working folder."""
    module, _, word = name.partition(":")
    try:
        if (folder := str(Path.cwd())) not in sys.path:
            sys.path.append(folder)
        function = getattr(import_module(module), word)
    except Exception as error:
        why = f"{type(error).__name__}: {error}"
        raise InputError(f"damage.function = '{name}': cannot be imported from the working folder ({why}).") from None
    if not callable(function):
        raise InputError(f"damage.function = '{name}': is no function.")
    return function


def own_measure(name: str, stored: Mapping[str, Any]) -> FloatArray:
    """Value of a function of archive variables, element by element; NaN where these are unknown."""
    given = {key: np.array(value, dtype=np.float64) for key, value in stored.items()}
    shape = np.broadcast_shapes(*(value.shape for value in given.values()))
    try:
        values = np.asarray(_function(name)({key: np.atleast_1d(value) for key, value in given.items()}), np.float64)
    except InputError:
        raise
    except Exception as error:
        why = f"raises {type(error).__name__}: {error}"
        raise InputError(f"damage.function = '{name}': {why}. It takes a dictionary of arrays.") from None
    if values.shape != (shape or (1,)):
        raise InputError(
            f"damage.function = '{name}': returns an array of shape {values.shape} for arrays of {shape or (1,)}; it "
            "must return one value per element."
        )
    return values.reshape(shape)
