"""Importance sampling with correlated variables, and the shift that a pilot proposes."""

import numpy as np
import pytest
from scipy import special

from damagepred.uq.design import Design, Sampler
from damagepred.uq.estimate import probability
from damagepred.uq.importance import Proposal, cross_entropy_shift
from damagepred.uq.variable import Variable
from tests.cli.conftest import Run, command  # noqa: F401

NORMALS = {place: Variable(distribution="normal", mean=0.0, std=1.0) for place in ("a", "b")}


def scatter_of(correlation: float) -> float:
    """Coefficient of variation of one wall's part in P(a > 3), a shifted and b correlated with it."""
    design = Design.make(
        NORMALS,
        dict.fromkeys(NORMALS, "1"),
        {frozenset("ab"): correlation},
        Sampler("random", 1, {"a": Proposal(shift=3.0)}),
        1,
    )
    part = (design.wall_values(4000)["a"] > 3.0) * design.weights(4000)
    assert probability(part > 0, weight=design.weights(4000)).value == pytest.approx(special.ndtr(-3.0), rel=0.15)
    return float(part.std() / part.mean())


@pytest.mark.quick_cases
@pytest.mark.parametrize("correlation", [0.6, -0.6, 0.9])
def test_a_shift_includes_the_correlation(correlation: float) -> None:
    """A shift against it increases the standard error five times."""
    assert scatter_of(correlation) == pytest.approx(scatter_of(0.0), rel=0.1)


def test_the_proposed_shift_is_the_mean_beyond_the_limit() -> None:
    """Of a > 2: phi(2) / Phi(-2) in a, its correlation times that in b; weighted walls say the same."""
    exact = np.exp(-2.0) / np.sqrt(2 * np.pi) / special.ndtr(-2.0)
    for shift in (0.0, 1.5):
        proposals = {"a": Proposal(shift=shift)} if shift else {}
        design = Design.make(
            NORMALS, dict.fromkeys(NORMALS, "1"), {frozenset("ab"): 0.6}, Sampler("random", 1, proposals), 3
        )
        drawn = design.draw(8000)
        hit = drawn.normal[:, 0] > 2
        found = cross_entropy_shift(drawn.normal[hit], drawn.weight[hit])
        assert (abs(found.mean - exact * np.array([1.0, 0.6])) < 4 * found.error).all()
        assert found.error.max() < 0.15
