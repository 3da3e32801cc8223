"""Line search along a step, on a spring of one degree of freedom."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from damagepred.arrays import FloatArray
from damagepred.kernels.equilibrium.line_search import line_search
from damagepred.solvers.options import DEFAULTS
from damagepred.solvers.quasi_static.residual import _parameters_of

STEPS = SimpleNamespace(residual=lambda wall, state, *values: wall.residual(*values))


class Spring:
    """A wall that is a spring under a load of 1 N that pulls it by ``rest``; longer than ``limit`` it has no force."""

    parameters = _parameters_of(DEFAULTS, 1e-9)

    def __init__(self, rest: float, limit: float = np.inf) -> None:
        self.rest, self.limit, self.evaluations = rest, limit, 0

    def residual(self, jack: float, displacement: FloatArray, coulomb: bool, force: FloatArray) -> float:
        """Compute the residual force."""
        self.evaluations += 1
        force[0] = 1.0 - displacement[0] / self.rest
        return abs(force[0]) if displacement[0] <= self.limit else np.inf

    def search(self) -> float:
        """Return the length of a step of 1 from 0."""
        start, step, end, force = np.zeros(1), np.ones(1), np.ones(1), np.zeros(1)
        ratio = self.residual(0.0, end, False, force)
        length, _ = line_search.py_func(
            STEPS, self, None, 0.0, 0.0, start, step, 1.0, ratio, 0.1, 64.0, False, end, force
        )
        assert end[0] == length
        return float(length)


@pytest.mark.parametrize("rest", [1e-3, 0.3, 1.0, 10.0])
def test_work_of_the_residual_vanishes_at_the_end(rest: float) -> None:
    """Steps are shortened or made longer to the root."""
    assert Spring(rest).search() == pytest.approx(rest, rel=0.1)


@pytest.mark.parametrize("limit", [0.3, 1e-2, 1e-4])
def test_step_that_leads_where_there_is_no_residual_is_halved(limit: float) -> None:
    """Beyond a finite residual of positive work nothing is searched: each trial would be in vain."""
    spring = Spring(rest=10.0, limit=limit)
    assert 0.5 * limit < spring.search() <= limit
    assert spring.evaluations <= 2 - np.log2(limit)
