"""Structures check their arrays where Python makes them, and refuse to be copied or changed."""

import os
import subprocess
import sys
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from damagepred.assembly import wall_model
from damagepred.kernels.linear.substitution import Rows
from damagepred.scene import Scene, Wall
from damagepred.solvers.options import DEFAULTS
from damagepred.solvers.quasi_static.residual import Residual
from damagepred.solvers.state.wall_state import State


@pytest.fixture
def rows() -> dict[str, Any]:
    three = np.arange(3)
    reached, gathered = np.zeros(3, dtype=np.bool_), np.zeros((2, 3))
    return {"fronts": three, "row_start": three, "boundary_row": three, "reached": reached, "gathered": gathered}


@pytest.mark.parametrize(
    ("field", "array"),
    [
        ("gathered", np.zeros((2, 3), dtype=np.float32)),
        ("gathered", np.zeros(3)),
        ("gathered", np.zeros((3, 2)).T),
        ("fronts", np.arange(6)[::2]),
        ("reached", [False]),
    ],
)
def test_other_arrays_are_refused(rows: dict[str, Any], field: str, array: Any) -> None:
    with pytest.raises(TypeError, match=rf"Rows\.{field} must be a contiguous"):
        Rows(**rows | {field: array})
    with pytest.raises(TypeError, match="has other fields: reached"):
        Rows(**{name: value for name, value in rows.items() if name != "reached"})


@pytest.fixture(scope="module")
def wall() -> tuple[Residual, State]:
    model = wall_model(Scene(wall=Wall(length=0.96, height=0.3)))
    return Residual(model, 1e-6, DEFAULTS), State.rest(model)


def test_arrays_of_another_wall_are_refused(wall: tuple[Residual, State]) -> None:
    problem, state = wall
    with pytest.raises(ValueError, match="displacements must be a contiguous array of float64"):
        problem.residual(state, np.zeros(6))
    with pytest.raises(ValueError, match="displacements must be"):
        problem.newton(state, state.displacement.astype(np.float32))
    slip = state.history.slip
    for other in (slip.astype(np.float32), slip[1:].copy(), np.asfortranarray(slip)):
        with pytest.raises(ValueError, match="slip must be a contiguous array of float64"):
            problem.residual(replace(state, history=state.history._replace(slip=other)), state.displacement)
    with pytest.raises(ValueError, match="takes one or two forces of that length"):
        problem.equations.solve(np.zeros(6))


PLAIN = """
import numpy as np
from damagepred.assembly import wall_model
from damagepred.scene import Scene, Wall, Dpc
from damagepred.solvers.options import DEFAULTS
from damagepred.solvers.quasi_static.residual import Residual
from damagepred.solvers.state.wall_state import State
model = wall_model(Scene(wall=Wall(length=0.96, height=0.3, block_length=0.24), dpc=Dpc(course=1)))
problem, state = Residual(model, 1e-8, DEFAULTS), State.rest(model)
state.load = 1.0
found, ratio = problem.newton(state, state.displacement)
print(type(problem.newton_iterations).__name__, ratio, *found.tolist())
"""


@pytest.mark.thorough
def test_without_compiling_the_same_functions_run_in_python() -> None:
    """Laws, assembly, factorisation and Newton's method of a wall of 20 blocks: a reader can step through them."""
    printed = [
        subprocess.run(
            [sys.executable, "-c", PLAIN], env=os.environ | environment, check=True, capture_output=True, text=True
        ).stdout.split()
        for environment in ({}, {"NUMBA_DISABLE_JIT": "1"})
    ]
    compiled, plain = (np.array(words[1:], dtype=float) for words in printed)
    assert max(compiled[0], plain[0]) < 1e-8
    np.testing.assert_allclose(plain[1:], compiled[1:], rtol=1e-9, atol=1e-16)
