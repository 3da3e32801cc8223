"""Compiled kernels are kept on the disk, where processes that run at the same time share them."""

from pathlib import Path

import numpy as np
import pytest

from damagepred.assembly import wall_model
from damagepred.kernels import jit
from damagepred.kernels.interface.internal_force import contact_stresses
from damagepred.scene import Scene, Wall
from damagepred.solvers.options import DEFAULTS
from damagepred.solvers.quasi_static.equilibrium import State


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


def test_arrays_that_a_law_is_handed_are_not_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(jit, "CACHE_FOLDER", None)  # code from a cache cannot be looked at
    model = wall_model(Scene(wall=Wall(length=0.48, height=0.2)))
    at_rest, shape = State.rest(model), model.interfaces.contact_area.shape
    counts = {}
    for compiler in (jit.kernel, jit.kernel_making_arrays):
        stresses = compiler(contact_stresses.py_func)
        stresses(
            model.interfaces,
            model.properties,
            DEFAULTS.return_mapping.for_kernels(),
            model.ground.at(0.0),
            at_rest.history,
            at_rest.displacement,
            *(np.empty(shape) for _ in range(3)),
        )
        (code,) = stresses.inspect_llvm().values()
        counts[compiler.__name__] = code.count("@NRT_incref(")
    assert counts["kernel"] == 0 < counts["kernel_making_arrays"]
