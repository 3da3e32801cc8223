"""Structures of named arrays that kernels pass on by reference (numba's structref).

A structure checks types, dimensions and layout of its arrays where Python makes it: kernels check nothing.
"""

from __future__ import annotations

import inspect
from typing import Any, ClassVar, Self

import numpy as np
from numba import config, types
from numba.experimental import structref
from numba.experimental.structref import new

from damagepred.kernels.jit import kernel

FLOATS, FLOAT_ROWS, FLOAT_BLOCKS, FLOAT_PAIRS = (types.Array(types.float64, n, "C") for n in (1, 2, 3, 4))
INTEGERS, INTEGER_ROWS = (types.Array(types.int64, n, "C") for n in (1, 2))
INTEGERS_32, LETTERS = types.Array(types.int32, 1, "C"), types.Array(types.uint8, 1, "C")
FLAGS, FLAG_ROWS = (types.Array(types.boolean, n, "C") for n in (1, 2))


class Structure(structref.StructRefProxy):
    """Base of structures: a subclass lists its fields, as attributes that hold their types; made by keyword.

    ``kind`` is the type in signatures and in fields of other structures. From Python, fields can be read, but numbers,
    which kernels change.
    """

    fields: ClassVar[dict[str, Any]]
    kind: ClassVar[Any]

    def __init_subclass__(cls) -> None:
        cls.fields = {name: kind for name, kind in vars(cls).items() if isinstance(kind, types.Type)}
        arrays = {name: kind for name, kind in cls.fields.items() if isinstance(kind, types.Array)}
        cls._arrays = tuple((name, _numpy_type(kind.dtype), kind.ndim) for name, kind in arrays.items())
        for name, kind in cls.fields.items():
            if config.DISABLE_JIT:
                delattr(cls, name)
            else:
                setattr(cls, name, _reader(name, isinstance(kind, types.Number | types.Boolean)))
        # numba pickles types: the class of the type must be found by its name
        names = {"__module__": cls.__module__, "__qualname__": f"{cls.__name__}.Kind"}
        cls.Kind = structref.register(type(f"{cls.__name__}Kind", (types.StructRef,), names))
        structref.define_boxing(cls.Kind, cls)
        cls.kind = cls.Kind(list(cls.fields.items()))
        cls.kind.name = cls.__name__  # otherwise each signature would list all fields
        listed = ", ".join(cls.fields)
        setters = "\n".join(f"    made_.{name} = {name}" for name in cls.fields)
        source = f"def make_{cls.__name__}({listed}):\n    made_ = new_(kind_)\n{setters}\n    return made_\n"
        source += f"def make_empty_{cls.__name__}():\n    return new_(kind_)\n"
        scope = {"new_": new, "kind_": cls.kind, "__name__": cls.__module__}
        # Compiled code sets a field by a name in its source, never by a variable: plain code would be a function of two
        # lines per field for each structure. numba's structref.define_constructor makes such source, too, but a type of
        # its own for each set of arguments. The name of the file is the file of the structure: numba caches by files.
        exec(compile(source, inspect.getfile(cls), "exec"), scope)
        cls.make, cls._make_empty = kernel(scope[f"make_{cls.__name__}"]), scope[f"make_empty_{cls.__name__}"]
        cls._make_empty.__module__ = __name__

    def __new__(cls, **values: Any) -> Self:
        """Check the values, and make the structure."""
        if values.keys() != cls.fields.keys():
            wrong = ", ".join(sorted(values.keys() ^ cls.fields.keys()))
            raise TypeError(f"{cls.__name__} has other fields: {wrong}")
        for name, dtype, dimensions in cls._arrays:
            array = values[name]
            wrong = not isinstance(array, np.ndarray) or array.dtype != dtype or array.ndim != dimensions
            if wrong or not array.flags.carray:
                raise TypeError(
                    f"{cls.__name__}.{name} must be a contiguous, writeable array of {dtype} with {dimensions} "
                    f"dimensions, not {getattr(array, 'dtype', type(array).__name__)} {np.shape(array)}"
                )
        if config.DISABLE_JIT:
            return cls._plain(values)
        made = cls.make(*map(values.__getitem__, cls.fields))
        made._values = values
        return made

    @classmethod
    def _plain(cls, values: dict[str, Any]) -> Any:
        """Make the structure for functions that run in Python."""
        made = cls._numba_box_(cls.kind, None)
        for name, value in values.items():
            records = isinstance(value, np.ndarray) and value.dtype.names
            setattr(made, name, value.view(np.recarray) if records else value)
        return made

    @classmethod
    def empty(cls) -> Any:
        """Make a structure of arrays without entries and of zeros; it has no inner structures and no functions."""
        arrays = {name: np.empty((0,) * dimensions, dtype) for name, dtype, dimensions in cls._arrays}
        if config.DISABLE_JIT:
            return cls._plain(dict.fromkeys(cls.fields, 0) | arrays)
        if not hasattr(cls, "make_empty"):
            cls.make_empty = kernel(cls._make_empty)
        made = cls.make_empty()
        made._values = arrays
        return made

    def __reduce__(self) -> Any:
        """Refuse copies: they would share arrays that kernels change."""
        raise TypeError(f"{type(self).__name__} cannot be copied or pickled: make another one from its arrays")


def _numpy_type(kind: Any) -> np.dtype:
    """NumPy's type of the numbers or records of an array."""
    return kind.dtype if isinstance(kind, types.Record) else np.dtype(kind.name)


def _reader(name: str, number: bool) -> property:
    """Make the property of a field, which cannot be set: kernels would not see it."""

    def read(self: Structure) -> Any:
        if number:
            raise AttributeError(f"{type(self).__name__}.{name} is a number of kernels")
        return self._values[name]

    return property(read)
