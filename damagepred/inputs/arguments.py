"""Arguments of public functions: a value of another type than annotated is refused in one sentence."""

from __future__ import annotations

import collections.abc
import inspect
import sys
import types
from collections.abc import Callable, Iterable, Mapping, Set
from functools import cache, wraps
from numbers import Integral, Real
from typing import Any, Literal, NamedTuple, NewType, ParamSpec, TypeVar, Union, get_args, get_origin

import numpy as np

from damagepred.errors import InputError, shown
from damagepred.runtime.numpy_defaults import numpy_defaults

P = ParamSpec("P")
T = TypeVar("T")


def checked(function: Callable[P, T]) -> Callable[P, T]:
    """Compare the arguments of a function with their annotations at each call; a decorator.

    Numbers must be finite; arrays may hold NaN and infinity. Annotations of names that exist for type checkers alone
    are passed over. The function runs with ``numpy_defaults``.
    """
    parameters = inspect.signature(function).parameters
    title = function.__qualname__.removesuffix(".__init__").split(".")[-1]

    @cache
    def kinds() -> dict[str, _Kind]:
        found = {name: _kind(_evaluated(parameter.annotation, function)) for name, parameter in parameters.items()}
        return {name: kind for name, kind in found.items() if kind is not None}

    @wraps(function)
    def called(*args: P.args, **kwargs: P.kwargs) -> T:
        given = dict(zip(parameters, args)) | kwargs
        for name, kind in kinds().items():
            if name in given and not kind.accepts(given[name]):
                raise InputError(f"{title}: {name} = {shown(given[name])}: must be {kind.words}.")
        with numpy_defaults():
            return function(*args, **kwargs)

    return called


class _Kind(NamedTuple):
    """Test of a value, and the values that pass it in words."""

    accepts: Callable[[Any], bool]
    words: str


_Dataset = NewType("_Dataset", object)  # xarray.Dataset, which is not imported before it is needed
_Array = NewType("_Array", object)  # array of numbers, of one dimension or more
_ArrayLike = NewType("_ArrayLike", object)  # array of numbers, or a single number
STAND_INS = {"xr": types.SimpleNamespace(Dataset=_Dataset), "ArrayLike": _ArrayLike}
STAND_INS |= dict.fromkeys(("FloatArray", "IntArray", "Int8Array", "BoolArray"), _Array)


def _evaluated(annotation: Any, function: Callable[..., Any]) -> Any:
    if not isinstance(annotation, str):
        return annotation
    try:
        return eval(annotation, vars(sys.modules[function.__module__]), STAND_INS)  # of this package's own source
    except (NameError, TypeError, AttributeError):
        return Any


def _kind(annotation: Any) -> _Kind | None:
    """Kind required by an annotation, or None."""
    origin, parts = get_origin(annotation), get_args(annotation)
    if annotation in _PLAIN:
        return _PLAIN[annotation]
    if origin in (Union, types.UnionType):
        kinds = [kind for part in parts if (kind := _kind(part)) is not None]
        if len(kinds) < len(parts):
            return None
        return _Kind(lambda v: any(kind.accepts(v) for kind in kinds), " or ".join(kind.words for kind in kinds))
    if origin is Literal:
        # the function itself compares with the words, and its message tells more
        return _Kind(lambda v: isinstance(v, str), f"one of {', '.join(map(str, parts))}")
    if origin is collections.abc.Callable:
        return _Kind(callable, "callable")
    if origin is tuple and Ellipsis not in parts:
        item = _kind(parts[0])  # all are of one kind wherever a tuple is annotated
        words = f"{len(parts)} values" + (f", each {item.words}" if item else "")
        return _Kind(lambda v: isinstance(v, tuple | list) and len(v) == len(parts) and _is_sequence(v, item), words)
    for group, words in ((Mapping, "a mapping"), (Set, "a set")):
        if isinstance(origin, type) and issubclass(origin, group):
            return _Kind(lambda v: isinstance(v, group), words)  # noqa: B023 - returned at once
    if isinstance(origin, type) and issubclass(origin, Iterable):
        item = _kind(parts[0])
        return _Kind(lambda v: _is_sequence(v, item), "a sequence" + (f", each of it {item.words}" if item else ""))
    if isinstance(annotation, type) and annotation not in (Any, inspect.Parameter.empty):
        return _Kind(lambda v: isinstance(v, annotation), f"of type {annotation.__name__}")
    return None


def _is_sequence(values: Any, item: _Kind | None) -> bool:
    if isinstance(values, str | bytes) or not isinstance(values, Iterable):
        return False
    return item is None or not isinstance(values, list | tuple | np.ndarray) or all(map(item.accepts, values))


def _is_number(value: Any) -> bool:
    try:
        real = isinstance(value, Real) or (isinstance(value, np.ndarray) and value.ndim == 0)
        return real and not isinstance(value, bool) and bool(np.isfinite(float(value)))
    except (TypeError, ValueError, OverflowError):
        return False


def _is_numeric(value: Any, least_dimensions: int) -> bool:
    try:
        found = np.asarray(value)
        return found.dtype.kind in "biuf" and found.ndim >= least_dimensions
    except (TypeError, ValueError):
        return False


def _is_dataset(value: Any) -> bool:
    import xarray as xr

    return isinstance(value, xr.Dataset)


_PLAIN: dict[Any, _Kind] = {
    int: _Kind(lambda v: isinstance(v, Integral) and not isinstance(v, bool) and abs(int(v)) < 2**63, "a whole number"),
    float: _Kind(_is_number, "a finite number"),
    bool: _Kind(lambda v: isinstance(v, bool | np.bool_), "True or False"),
    str: _Kind(lambda v: isinstance(v, str), "text"),
    type(None): _Kind(lambda v: v is None, "None"),
    _Dataset: _Kind(_is_dataset, "an xarray.Dataset"),
    _Array: _Kind(lambda v: _is_numeric(v, 1), "an array of numbers"),
    _ArrayLike: _Kind(lambda v: _is_numeric(v, 0), "an array of numbers"),
}


def require_alike(**arrays: Any) -> None:
    """Check that arrays have the same shape; None has any."""
    shapes = {name: np.shape(values) for name, values in arrays.items() if values is not None}
    if len(set(shapes.values())) > 1:
        raise InputError(f"{', '.join(shapes)}: must have the same shape, have {', '.join(map(str, shapes.values()))}.")
