"""Structures of named arrays that kernels pass on by reference (numba's structref).

A structure checks types, dimensions and layout of its arrays where Python makes it: kernels check nothing.
"""

from __future__ import annotations

import inspect
from typing import Any

import numpy as np
from numba import config, types
from numba.experimental import structref
from numba.experimental.structref import new
from numba.np.numpy_support import as_dtype

from damagepred.kernels.jit import kernel

FLOATS, FLOAT_ROWS, FLOAT_BLOCKS, FLOAT_PAIRS = (types.Array(types.float64, n, "C") for n in (1, 2, 3, 4))
INTEGERS, INTEGER_ROWS = (types.Array(types.int64, n, "C") for n in (1, 2))
INTEGERS_32, LETTERS = types.Array(types.int32, 1, "C"), types.Array(types.uint8, 1, "C")
FLAGS, FLAG_ROWS = (types.Array(types.boolean, n, "C") for n in (1, 2))


class Structure(structref.StructRefProxy):
    """Base of structures: a subclass lists its fields, as attributes that hold their types; made by keyword.

    ``kind`` is the type in signatures and in fields of other structures.
    """

    fields: dict[str, Any]
    kind: Any

    def __init_subclass__(cls) -> None:
        cls.fields = {name: kind for name, kind in vars(cls).items() if isinstance(kind, types.Type)}
        for name in cls.fields:
            delattr(cls, name)
        # numba pickles types: the class of the type must be found by its name
        names = {"__module__": cls.__module__, "__qualname__": f"{cls.__name__}.Kind"}
        cls.Kind = structref.register(type(f"{cls.__name__}Kind", (types.StructRef,), names))
        structref.define_boxing(cls.Kind, cls)
        cls.kind = cls.Kind(list(cls.fields.items()))
        cls.kind.name = cls.__name__  # else each signature would list all fields
        listed = ", ".join(cls.fields)
        setters = "\n".join(f"    made_.{name} = {name}" for name in cls.fields)
        source = f"def make_{cls.__name__}({listed}):\n    made_ = new_(kind_)\n{setters}\n    return made_\n"
        scope = {"new_": new, "kind_": cls.kind, "__name__": cls.__module__}
        exec(compile(source, inspect.getfile(cls), "exec"), scope)  # as of this file: numba caches by files
        cls.make = kernel(scope[f"make_{cls.__name__}"])

    def __new__(cls, **values: Any) -> Any:
        """Check the values, and make the structure."""
        if values.keys() != cls.fields.keys():
            wrong = ", ".join(sorted(values.keys() ^ cls.fields.keys()))
            raise TypeError(f"{cls.__name__} has other fields: {wrong}")
        for name, kind in cls.fields.items():
            if isinstance(kind, types.Array):
                _check(f"{cls.__name__}.{name}", values[name], kind)
        if config.DISABLE_JIT:
            made = cls._numba_box_(cls.kind, None)
            records = {name for name, value in values.items() if isinstance(value, np.ndarray) and value.dtype.names}
            readable = {n: v.view(np.recarray) if n in records else v for n, v in values.items()}
        else:
            made, readable = cls.make(*(values[name] for name in cls.fields)), {}
            for name, kind in cls.fields.items():
                if not isinstance(kind, types.Number | types.Boolean):  # kernels change numbers
                    readable[name] = values[name]
        vars(made).update(readable)
        return made

    @classmethod
    def empty(cls) -> Any:
        """Make a structure whose arrays have no entries."""
        return cls(**{name: np.empty((0,) * kind.ndim, as_dtype(kind.dtype)) for name, kind in cls.fields.items()})

    def __setattr__(self, name: str, value: Any) -> None:
        """Refuse changes from Python, which kernels would not see."""
        if name in self.fields and not config.DISABLE_JIT:
            raise AttributeError(f"{type(self).__name__}.{name} cannot be changed: make another structure")
        super().__setattr__(name, value)

    def __reduce__(self) -> Any:
        """Refuse copies: they would share arrays that kernels change."""
        raise TypeError(f"{type(self).__name__} cannot be copied or pickled: make another one from its arrays")


def _check(name: str, array: Any, kind: Any) -> None:
    """Refuse an array of another type, number of dimensions or layout."""
    dtype = as_dtype(kind.dtype)
    if isinstance(array, np.ndarray) and array.dtype == dtype and array.ndim == kind.ndim and array.flags.carray:
        return
    given = f"{array.dtype} {array.shape}" if isinstance(array, np.ndarray) else type(array).__name__
    raise TypeError(f"{name} must be a contiguous, writeable array of {dtype} with {kind.ndim} dimensions, not {given}")
