"""Tables of addresses, and units that call each other by address."""

import numpy as np
import pytest

from damagepred.kernels.jit import Unit
from damagepred.kernels.table import (
    Addresses,
    fill,
    flags,
    float_blocks,
    float_rows,
    floats,
    integers,
    run,
    table_at,
    table_type,
)

EXAMPLE = table_type("vector matrix solid places chosen", integers="here inner count", numbers="factor total")
example_at = table_at(EXAMPLE, "EXAMPLE")


@Unit
def inner(address: int) -> None:
    """Multiply the chosen numbers of a vector."""
    table = example_at(address)
    vector, chosen = floats(table.vector), flags(table.chosen)
    for i in range(vector.size):
        if chosen[i]:
            vector[i] *= table.factor


@Unit
def outer(address: int) -> None:
    """Run the inner unit, and sum what all arrays hold at the places."""
    table = example_at(address)
    run(table.inner, address)
    matrix, solid, total = float_rows(table.matrix), float_blocks(table.solid), 0.0
    for i in integers(table.places):
        total += floats(table.vector)[i] + matrix[i, 1] + solid[i, 0, 1]
    table.total, table.count = total, matrix.shape[0] * solid.shape[2]


def test_units_see_the_arrays_of_a_table_and_leave_results_in_it() -> None:
    vector, table = np.arange(1.0, 5.0), np.zeros(1, EXAMPLE)
    arrays = {
        "vector": vector,
        "matrix": np.arange(8.0).reshape(4, 2),
        "solid": np.arange(24.0).reshape(4, 2, 3),
        "places": np.array([0, 2]),
        "chosen": np.array([True, False, True, False]),
    }
    fill(table[0], {**arrays, "inner": inner.address, "factor": 10.0})
    outer(table.ctypes.data)
    np.testing.assert_array_equal(vector, [10.0, 2.0, 30.0, 4.0])
    assert table[0]["total"] == 10.0 + 30.0 + 1.0 + 5.0 + 1.0 + 13.0
    assert table[0]["count"] == 12


def test_arrays_that_are_not_contiguous_are_refused() -> None:
    with pytest.raises(ValueError, match="vector is not contiguous"):
        fill(np.zeros(1, EXAMPLE)[0], {"vector": np.arange(8.0)[::2]})


def test_addresses_are_those_of_the_arrays_or_of_contiguous_copies() -> None:
    first, second = np.arange(4.0), np.arange(8.0)[::2]
    strided = (second,)
    table = np.zeros(1, EXAMPLE)
    known = Addresses(table, "vector")
    known.set((first,))
    assert table[0]["vector"]["address"] == first.ctypes.data
    fill(table[0], {"vector": first, "chosen": np.ones(4, dtype=np.bool_), "factor": 1.0})
    second[:] = 7.0  # changed after the first look: no stale copy may be used
    known.set(strided)
    table[0]["factor"] = 2.0
    inner(table.ctypes.data)
    copy = known._addresses[0]._kept
    np.testing.assert_array_equal(copy, [14.0, 14.0, 14.0, 14.0])
    second[:] = 3.0
    known.set(strided)
    np.testing.assert_array_equal(known._addresses[0]._kept, [3.0, 3.0, 3.0, 3.0])
