"""Arguments of public functions: what is not of the annotated type is refused in one sentence."""

from __future__ import annotations

import inspect
import os
import sys
import types
from collections.abc import Callable, Iterable, Mapping
from functools import cache, wraps
from numbers import Integral, Real
from typing import Any, Literal, ParamSpec, TypeVar, Union, get_args, get_origin

import numpy as np

from damagepred.errors import InputError, shown

P = ParamSpec("P")
T = TypeVar("T")
Test = Callable[[Any], bool]

NUMBERS = ("ArrayLike", "FloatArray", "IntArray", "Int8Array", "BoolArray")
"""Names of annotations of arrays of numbers; all but the first have a dimension."""


def checked(function: Callable[P, T]) -> Callable[P, T]:
    """Compare the arguments of a function with their annotations at each call; a decorator.

    Numbers must be finite; arrays may hold NaN and infinity. Annotations that name nothing at run time are passed over.
    """
    parameters = inspect.signature(function).parameters
    title = function.__qualname__.removesuffix(".__init__").split(".")[-1]

    @cache
    def tests() -> dict[str, tuple[Test, str]]:
        return {p.name: found for p in parameters.values() if (found := _annotated(function, p)) is not None}

    @wraps(function)
    def called(*args: P.args, **kwargs: P.kwargs) -> T:
        given = dict(zip(parameters, args)) | kwargs
        for name, (test, what) in tests().items():
            if name in given and not test(given[name]):
                raise InputError(f"{title}: {name} = {shown(given[name])}: must be {what}.")
        return function(*args, **kwargs)

    return called


def _annotated(function: Callable[..., Any], parameter: inspect.Parameter) -> tuple[Test, str] | None:
    """Return the test of a parameter and what passes it in words; None if there is none."""
    annotation = parameter.annotation
    if annotation is inspect.Parameter.empty:
        return None
    if isinstance(annotation, str):
        if annotation.startswith("xr.Dataset"):
            return _is_dataset, "an xarray.Dataset"
        if any(name in annotation for name in NUMBERS) and "[" not in annotation:
            none, least = "None" in annotation, 0 if "ArrayLike" in annotation else 1
            return (lambda v: (none and v is None) or _is_numeric(v, least)), "an array of numbers"
        try:
            annotation = eval(annotation, vars(sys.modules[function.__module__]))  # of this package's own source
        except (NameError, TypeError, AttributeError):
            return None
    return _test(annotation)


def _test(annotation: Any) -> tuple[Test, str] | None:
    origin = get_origin(annotation)
    if origin in (Union, types.UnionType):
        parts = [_test(part) for part in get_args(annotation)]
        known = [part for part in parts if part is not None]
        if len(known) < len(parts):
            return None
        return (lambda v: any(test(v) for test, _ in known)), " or ".join(what for _, what in known)
    if origin is Literal:
        # which of them it is the function asks itself, as its words tell more
        return (lambda v: isinstance(v, str)), f"one of {', '.join(map(str, get_args(annotation)))}"
    if annotation in _PLAIN:
        return _PLAIN[annotation]
    if isinstance(origin, type) and issubclass(origin, Mapping):
        return (lambda v: isinstance(v, Mapping)), "a mapping"
    if origin is tuple and Ellipsis not in get_args(annotation):
        return _tuple_test([_test(part) for part in get_args(annotation)])
    if isinstance(origin, type) and issubclass(origin, set | frozenset):
        return (lambda v: isinstance(v, set | frozenset)), "a set"
    if isinstance(origin, type) and issubclass(origin, Iterable) and origin is not type:
        inner = _test(get_args(annotation)[0])
        return (lambda v: _all_of(inner, v)), f"a sequence, each of it {inner[1]}" if inner else "a sequence"
    if origin is Callable or (isinstance(origin, type) and origin.__name__ == "Callable"):
        return callable, "callable"
    if isinstance(annotation, type) and annotation is not Any:
        return (lambda v: isinstance(v, annotation)), f"of type {annotation.__name__}"
    return None


def _tuple_test(each: list[tuple[Test, str] | None]) -> tuple[Test, str]:
    def fits(value: Any) -> bool:
        right = isinstance(value, tuple | list) and len(value) == len(each)
        return right and all(one is None or one[0](item) for one, item in zip(each, value))

    return fits, f"{len(each)} values" + (f", each {each[0][1]}" if each and each[0] else "")


def _is_number(value: Any) -> bool:
    try:
        real = isinstance(value, Real) or (isinstance(value, np.ndarray) and value.ndim == 0)
        return real and not isinstance(value, bool) and bool(np.isfinite(float(value)))
    except (TypeError, ValueError, OverflowError):
        return False


def _is_numeric(value: Any, least: int) -> bool:
    try:
        found = np.asarray(value)
        return found.dtype.kind in "biuf" and found.ndim >= least
    except (TypeError, ValueError):
        return False


def require_alike(**arrays: Any) -> None:
    """Check that arrays have the same shape; None has any.

    Parameters
    ----------
    arrays
        By name.

    Raises
    ------
    InputError
        If they have not.
    """
    shapes = {name: np.shape(values) for name, values in arrays.items() if values is not None}
    if len(set(shapes.values())) > 1:
        raise InputError(f"{', '.join(shapes)}: must have the same shape, have {', '.join(map(str, shapes.values()))}.")


def require_weights(name: str, values: Any) -> None:
    """Check that weights are finite, not negative, and not all 0.

    Parameters
    ----------
    name : str
        What they are called.
    values : array_like
        The weights.

    Raises
    ------
    InputError
        If they are not.
    """
    found = np.asarray(values, dtype=np.float64)
    if not (np.isfinite(found).all() and (found >= 0).all() and (found > 0).any()):
        raise InputError(f"{name}: must be finite, not negative, and not all 0.")


def require_results(ds: Any, names: Iterable[str], source: str) -> None:
    """Check that a dataset has results.

    Parameters
    ----------
    ds : xarray.Dataset
        The dataset.
    names : iterable of str
        Its variables or coordinates.
    source : str
        What makes such a dataset.

    Raises
    ------
    InputError
        If one is missing.
    """
    if missing := [name for name in names if name not in ds.variables and name not in ds.dims]:
        raise InputError(f"the dataset has no {missing[0]}; take one that {source} returns.")


def _is_dataset(value: Any) -> bool:
    import xarray as xr

    return isinstance(value, xr.Dataset)


def _all_of(inner: tuple[Test, str] | None, values: Any) -> bool:
    if isinstance(values, str | bytes) or not isinstance(values, Iterable):
        return False
    return inner is None or not isinstance(values, list | tuple | np.ndarray) or all(inner[0](v) for v in values)


_PLAIN: dict[Any, tuple[Test, str]] = {
    int: (lambda v: isinstance(v, Integral) and not isinstance(v, bool) and abs(int(v)) < 2**63, "a whole number"),
    float: (_is_number, "a finite number"),
    bool: (lambda v: isinstance(v, bool | np.bool_), "True or False"),
    str: (lambda v: isinstance(v, str), "text"),
    os.PathLike: (lambda v: isinstance(v, os.PathLike), "a path"),
    type(None): (lambda v: v is None, "None"),
}
