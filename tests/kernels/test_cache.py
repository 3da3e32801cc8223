"""Compiled kernels are kept on the disk, where processes that run at the same time share them."""

from collections import namedtuple
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
import numpy as np
import pytest
from numpy.typing import NDArray

from damagepred.assembly import wall_model
from damagepred.kernels import jit
from damagepred.kernels.interface.internal_force import contact_stresses
from damagepred.scene import Scene, Wall
from damagepred.solvers.options import DEFAULTS
from damagepred.solvers.state.wall_state import State


def doubled(x):
    return 2 * x


def test_two_that_compile_at_once_for_different_arguments_keep_apart(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(jit, "CACHE_FOLDER", tmp_path)
    for argument in (1, 1.0):
        one = jit.kernel(doubled)
        with monkeypatch.context() as patch:
            # neither has seen yet what the other keeps
            patch.setattr(one._cache._cache_file, "_load_index", dict)
            one(argument)
    assert len(list(tmp_path.rglob("*.nbc"))) == 2
    later = jit.kernel(doubled)
    for argument in (1, 1.0):
        assert type(later(argument)) is type(argument)
    assert sum(later.stats.cache_hits.values()) == 1  # the other's place in the index was lost: compiled anew


Values = namedtuple("Values", [f"array_{k}" for k in range(15)])


def counts(compile_law: Callable[..., Any], compile_kernel: Callable[..., Any]) -> int:
    """Return the number of reference counts in a kernel that passes a tuple of arrays to a law."""

    @compile_law
    def inner(values: Values, i: int) -> float:
        return values.array_0[i] + values.array_9[i] if values.array_3[i] > 0.5 else values.array_7[i]

    @compile_law
    def outer(values: Values, i: int) -> float:
        if values.array_1[i] > 0.5:
            return inner(values, i)
        return values.array_5[i] * inner(values, i) if values.array_2[i] > 0.5 else values.array_4[i]

    @compile_kernel
    def fill(values: Values, out: NDArray[np.float64]) -> None:
        for i in range(out.size):
            out[i] = outer(values, i)

    fill(Values(*np.random.default_rng(1).random((15, 8))), np.empty(8))
    (code,) = fill.inspect_llvm().values()
    return code.count("@NRT_incref(")


def test_arrays_passed_to_a_law_are_not_reference_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(jit, "CACHE_FOLDER", None)  # code from a cache cannot be inspected
    assert counts(jit.law, jit.kernel) == counts(jit.rule, jit.kernel) == 0 < counts(numba.njit, numba.njit)
    model = wall_model(Scene(wall=Wall(length=0.48, height=0.2)))
    at_rest, shape = State.rest(model), model.interfaces.contact_area.shape
    stresses = jit.kernel(contact_stresses)
    stresses(
        model.interface_records,
        model.joint_parameters,
        DEFAULTS.return_mapping.for_kernels(),
        model.ground.at(0.0),
        at_rest.history,
        at_rest.displacement,
        *(np.empty(shape) for _ in range(3)),
    )
    (code,) = stresses.inspect_llvm().values()
    assert "@NRT_incref(" not in code
