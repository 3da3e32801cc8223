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

from damagepred.errors import InputError, nearest, shown

P = ParamSpec("P")
T = TypeVar("T")
Test = Callable[[Any], bool]

NUMBERS = ("ArrayLike", "FloatArray", "IntArray", "BoolArray")
"""Names of annotations of arrays of numbers."""


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
                value = given[name]
                hint = nearest(value, what.split(", ")) if isinstance(value, str) else ""
                raise InputError(f"{title}: {name} = {shown(value)}: must be {what}.{hint}")
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
            none = "None" in annotation
            return (lambda v: (none and v is None) or _is_numeric(v)), "an array of numbers"
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
        allowed = get_args(annotation)
        return (lambda v: isinstance(v, str) and v in allowed), ", ".join(map(str, allowed))
    if annotation in _PLAIN:
        return _PLAIN[annotation]
    if isinstance(origin, type) and issubclass(origin, Mapping):
        return (lambda v: isinstance(v, Mapping)), "a mapping"
    if isinstance(origin, type) and issubclass(origin, Iterable) and origin is not type:
        inner = _test(get_args(annotation)[0])
        return (lambda v: _all_of(inner, v)), f"a sequence, each of it {inner[1]}" if inner else "a sequence"
    if origin is Callable or (isinstance(origin, type) and origin.__name__ == "Callable"):
        return callable, "callable"
    if isinstance(annotation, type):
        return (lambda v: isinstance(v, annotation)), f"of type {annotation.__name__}"
    return None


def _is_number(value: Any) -> bool:
    try:
        real = isinstance(value, Real) or (isinstance(value, np.ndarray) and value.ndim == 0)
        return real and not isinstance(value, bool) and bool(np.isfinite(float(value)))
    except (TypeError, ValueError, OverflowError):
        return False


def _is_numeric(value: Any) -> bool:
    try:
        return np.asarray(value).dtype.kind in "biuf"
    except (TypeError, ValueError):
        return False


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
