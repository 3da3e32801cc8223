"""Newton's method with line search, on a part that slides under constant friction until it meets a stop."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from damagepred.arrays import FloatArray
from damagepred.kernels.equilibrium import newton
from damagepred.kernels.equilibrium.line_search import line_search
from damagepred.solvers.options import DEFAULTS
from damagepred.solvers.quasi_static.residual import _parameters_of


class SlidingPart:
    """One degree of freedom: a constant force of 1 N, and a stop of stiffness 1 N/m at a distance.

    Without the stop the tangent is the regularisation alone.
    """

    parameters, regularisation, stiffness, deflection = _parameters_of(DEFAULTS, 1e-9), 0.1, None, np.nan

    def __init__(self, distance: float) -> None:
        self.distance, self.iterations, self.room = distance, 0, np.empty((4, 1))

    def residual(self, jack: float, displacement: FloatArray, coulomb: bool, force: FloatArray) -> float:
        """Compute the residual force."""
        force[0] = 1.0 - max(displacement[0] - self.distance, 0.0)
        return abs(force[0])

    def solve(self, _: None, bordered: bool, displacement: FloatArray, force: FloatArray, step: FloatArray) -> float:
        """Solve the tangent equations."""
        self.iterations += 1
        step[0] = force[0] / (self.regularisation + float(displacement[0] > self.distance))
        return 0.0


STEPS = SimpleNamespace(
    residual=lambda wall, state, *values: wall.residual(*values), solve=lambda wall, state, *values: wall.solve(*values)
)


@pytest.mark.parametrize("distance", [0.0, 5.0, 100.0, 1e3, 1e4])
def test_part_that_slides_freely_reaches_its_stop(distance: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """A step of the regularisation's length is 10 m: without longer ones, 1000 would lead to the farthest stop."""
    part, found = SlidingPart(distance), np.empty(1)
    monkeypatch.setattr(newton, "line_search", line_search.py_func)
    ratio, _ = newton.newton_with_line_search.py_func(STEPS, part, part, 0.0, np.zeros(1), found)
    assert ratio < 1e-9
    assert found[0] == pytest.approx(distance + 1.0)
    assert part.iterations <= 30
