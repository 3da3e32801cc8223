"""Tables of addresses: dozens of arrays handed to kernels as one record.

A kernel takes a record like a number, whatever it holds. As arguments, the arrays of a wall's equations would be handed
from function to function one by one, which takes far longer to compile. Who makes a table keeps the arrays alive.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import from_dtype
from numba.core import cgutils, types
from numba.extending import intrinsic, models, register_model
from numba.np import arrayobj

from damagepred.kernels.jit import kernel, law

PLACE = np.dtype([(name, np.int64) for name in ("address", "rows", "columns", "depth", "height")])
"""Address and shape of an array."""


def table_type(arrays: str, integers: str = "", numbers: str = "") -> np.dtype[Any]:
    """Return the type of a table.

    Parameters
    ----------
    arrays, integers, numbers : str
        Names of arrays, of integers or flags, and of other numbers, between spaces.
    """
    kinds: Iterable[tuple[str, Any]] = ((arrays, PLACE), (integers, np.int64), (numbers, np.float64))
    return np.dtype([(name, kind) for names, kind in kinds for name in names.split()])


def fill(table: np.void, values: dict[str, Any]) -> None:
    """Set entries of a table.

    Parameters
    ----------
    table : record
        Of a type made by ``table_type``.
    values : dict
        Arrays, contiguous, or numbers by the name of their entry.
    """
    for name, value in values.items():
        if isinstance(value, np.ndarray):
            if not value.flags.c_contiguous:
                raise ValueError(f"{name} is not contiguous")
            table[name] = (value.__array_interface__["data"][0], *value.shape, *_REST[value.ndim])
        else:
            table[name] = value


@kernel
def _put(words, place, values):
    """Put the address and rows of an array in a table of integers; NumPy takes far longer to tell the address."""
    words[place], words[place + 1] = values.ctypes.data, values.shape[0]


class Address:
    """Place in a table of an array that others replace, of any number of rows. The last one is kept alive.

    Parameters
    ----------
    table : array of records (1,)
        The table.
    name : str
        Of the array.

    Attributes
    ----------
    given : array or None
        The last one; None if it was copied.
    """

    def __init__(self, table: np.ndarray, name: str) -> None:
        self._words, self._place = table.view(np.int64), (table.dtype.fields or {})[name][1] // 8
        self.given: np.ndarray | None = None

    def set(self, array: np.ndarray) -> None:
        """Set the address and rows of an array; of a contiguous copy, anew each time, if it is not contiguous.

        Parameters
        ----------
        array : array
            The array.
        """
        if array is not self.given:
            self._kept = np.ascontiguousarray(array)
            self.given = array if self._kept is array else None
            _put(self._words, self._place, self._kept)

    def forget(self) -> None:
        """Set the next array even if it is the last one: a kernel has put another in its place."""
        self.given = None


class Addresses:
    """Places in a table of the arrays of a tuple that others replace, see ``Address``.

    Parameters
    ----------
    table : array of records (1,)
        The table.
    names : str
        Of the arrays, between spaces.
    """

    def __init__(self, table: np.ndarray, names: str) -> None:
        self._addresses = [Address(table, name) for name in names.split()]
        self._given: tuple[np.ndarray, ...] = ()

    def set(self, arrays: tuple[np.ndarray, ...]) -> None:
        """Set the addresses and rows of the arrays of a tuple.

        Parameters
        ----------
        arrays : tuple of array
            In the order of their names.
        """
        if arrays is not self._given:
            for address, array in zip(self._addresses, arrays):
                address.set(array)
            self._given = () if any(address.given is None for address in self._addresses) else arrays


_REST = {dimensions: (0,) * (4 - dimensions) for dimensions in range(5)}


def _array_at(kind, dimensions):
    """Return what gives the array at a place, of a kind and a number of dimensions."""

    @intrinsic
    def array(typing_context, place):
        """Return the array at a place (``PLACE``)."""

        def generate(context, builder, signature, values):
            found = arrayobj.make_array(signature.return_type)(context, builder)
            integer = context.get_value_type(types.intp)
            first = builder.bitcast(values[0], integer.as_pointer())
            address, *shape = (
                builder.load(builder.gep(first, [context.get_constant(types.intp, i)])) for i in range(1 + dimensions)
            )
            size = context.get_constant(types.intp, context.get_abi_sizeof(context.get_data_type(kind)))
            strides = [size]
            for extent in shape[:0:-1]:
                strides.insert(0, builder.mul(strides[0], extent))
            arrayobj.populate_array(
                found,
                data=builder.inttoptr(address, found.data.type),
                shape=cgutils.pack_array(builder, shape),
                strides=cgutils.pack_array(builder, strides),
                itemsize=size,
                meminfo=None,
            )
            return found._getvalue()

        return types.Array(kind, dimensions, "C")(place), generate

    return array


class _Record(types.Record):
    """Record that is written as its name: numba writes types again and again, and its own text lists all entries."""

    def __repr__(self):
        """Return the name."""
        return self.name


register_model(_Record)(models.RecordModel)


def table_at(dtype, name):
    """Return what gives the table of a type at an address.

    Parameters
    ----------
    dtype : numpy.dtype
        Made by ``table_type``.
    name : str
        Of the type.
    """
    kind = from_dtype(dtype)
    kind.__class__, kind.name = _Record, name

    @intrinsic
    def table(typing_context, address):
        """Return the table at an address."""

        def generate(context, builder, signature, values):
            return builder.inttoptr(values[0], context.get_value_type(signature.return_type))

        return kind(address), generate

    return table


@law
def replace(place, other):
    """Put an array in the place of another; return the address and rows of the latter.

    Parameters
    ----------
    place, other : PLACE
        Of arrays whose rows have the same shape.
    """
    before = place.address, place.rows
    place.address, place.rows = other.address, other.rows
    return before


@law
def put_back(place, before):
    """Put an array back in its place.

    Parameters
    ----------
    place : PLACE
        Where another has been put.
    before : (int, int)
        What ``replace`` returned.
    """
    place.address, place.rows = before


@intrinsic
def run(typing_context, unit, table):
    """Run the unit at an address with the table at another.

    Parameters
    ----------
    typing_context : object
        Of numba, which gives it.
    unit, table : int
        Addresses.
    """

    def generate(context, builder, signature, values):
        integer = context.get_value_type(types.intp)
        function = ir.FunctionType(ir.VoidType(), [integer])
        builder.call(builder.inttoptr(values[0], function.as_pointer()), [values[1]])
        return context.get_dummy_value()

    return types.void(types.intp, types.intp), generate


@intrinsic
def part(typing_context, values, first, count):
    """Return entries or rows of an array, without the checks of a slice, which take far longer to compile.

    Parameters
    ----------
    typing_context : object
        Of numba, which gives it.
    values : array
        Contiguous.
    first, count : int
        First entry or row, and number.
    """

    def generate(context, builder, signature, arguments):
        kind = signature.return_type
        whole = arrayobj.make_array(kind)(context, builder, arguments[0])
        found = arrayobj.make_array(kind)(context, builder)
        strides = cgutils.unpack_tuple(builder, whole.strides)
        arrayobj.populate_array(
            found,
            data=cgutils.pointer_add(builder, whole.data, builder.mul(arguments[1], strides[0]), whole.data.type),
            shape=cgutils.pack_array(builder, [arguments[2], *cgutils.unpack_tuple(builder, whole.shape)[1:]]),
            strides=whole.strides,
            itemsize=whole.itemsize,
            meminfo=None,
        )
        return found._getvalue()

    return values(values, types.intp, types.intp), generate


@intrinsic
def copy_entries(typing_context, source, target):
    """Copy a vector to another that is as long.

    Parameters
    ----------
    typing_context : object
        Of numba, which gives it.
    source, target : array
        Contiguous, of the same numbers.
    """

    def generate(context, builder, signature, arguments):
        first, second = (arrayobj.make_array(k)(context, builder, a) for k, a in zip(signature.args, arguments))
        cgutils.raw_memcpy(builder, second.data, first.data, builder.extract_value(first.shape, 0), first.itemsize)
        return context.get_dummy_value()

    return types.void(source, target), generate


@intrinsic
def address_of(typing_context, values, index):
    """Return the address of an entry of a vector.

    Parameters
    ----------
    typing_context : object
        Of numba, which gives it.
    values : array
        Contiguous, of one dimension.
    index : int
        Of the entry.
    """

    def generate(context, builder, signature, arguments):
        found = arrayobj.make_array(signature.args[0])(context, builder, arguments[0])
        return builder.ptrtoint(builder.gep(found.data, [arguments[1]]), context.get_value_type(types.intp))

    return types.intp(values, types.intp), generate


def records_of(dtype):
    """Return what gives the array of records of a type at a place.

    Parameters
    ----------
    dtype : numpy.dtype
        Of the records.
    """
    return _array_at(from_dtype(dtype), 1)


floats, float_rows, float_blocks, float_pairs = (_array_at(types.float64, dimensions) for dimensions in (1, 2, 3, 4))
"""Vector, matrix and arrays of three and four dimensions of numbers at a place."""
integers, integer_rows = (_array_at(types.int64, dimensions) for dimensions in (1, 2))
"""Vector and matrix of integers at a place."""
integers32, bytes_of = _array_at(types.int32, 1), _array_at(types.uint8, 1)
"""Vectors of short integers and of letters at a place."""
flags, flag_rows = (_array_at(types.boolean, dimensions) for dimensions in (1, 2))
"""Vector and matrix of flags at a place."""
