"""Line search along a step, and Newton's method with it, on parts of one degree of freedom."""

from types import SimpleNamespace

import numpy as np
import pytest

from damagepred.arrays import FloatArray
from damagepred.kernels.equilibrium import newton
from damagepred.kernels.equilibrium.line_search import line_search

STEPS = SimpleNamespace(residual=lambda wall, state, *values: wall.residual(*values))


class Spring:
    """A wall that is a spring under a load of 1 N that pulls it by ``rest``; longer than ``limit`` it has no force."""

    def __init__(self, rest: float, limit: float = np.inf) -> None:
        self.rest, self.limit, self.evaluations = rest, limit, 0

    def residual(self, jack: float, displacement: FloatArray, coulomb: bool, force: FloatArray) -> float:
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


class SlidingPart:
    """One degree of freedom: a constant force of 1 N, and a stop of stiffness 1 N/m at a distance."""

    tolerance, line_search_iterations, regularisation, stiffness, deflection = 1e-9, 40, 0.1, None, np.nan

    def __init__(self, distance: float) -> None:
        self.distance, self.iterations, self.room = distance, 0, np.empty((4, 1))

    def residual(self, jack: float, displacement: FloatArray, coulomb: bool, force: FloatArray) -> float:
        force[0] = 1.0 - max(displacement[0] - self.distance, 0.0)
        return abs(force[0])

    def solve(self, _: None, bordered: bool, displacement: FloatArray, force: FloatArray, step: FloatArray) -> float:
        self.iterations += 1
        step[0] = force[0] / (self.regularisation + float(displacement[0] > self.distance))
        return 0.0


STEPS_OF_NEWTON = SimpleNamespace(
    residual=lambda wall, state, *values: wall.residual(*values), solve=lambda wall, state, *values: wall.solve(*values)
)


@pytest.mark.parametrize("distance", [0.0, 5.0, 100.0, 1e3, 1e4])
def test_part_that_slides_freely_reaches_its_stop(distance: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """A step of the regularisation's length is 10 m: without longer ones, 1000 would lead to the farthest stop."""
    part, found = SlidingPart(distance), np.empty(1)
    monkeypatch.setattr(newton, "line_search", line_search.py_func)
    ratio, _ = newton.newton_with_line_search.py_func(STEPS_OF_NEWTON, part, part, 0.0, np.zeros(1), found)
    assert ratio < 1e-9
    assert found[0] == pytest.approx(distance + 1.0)
    assert part.iterations <= 30
