"""Estimates from samples: unbiased, with the stated coverage, counted over repetitions."""

from pathlib import Path

import numpy as np
import pytest
from scipy import special, stats

from damagepred.errors import InputError
from damagepred.scene import Scene
from damagepred.uq.design import Design, Sampler
from damagepred.uq.estimate import Estimate, probability
from damagepred.uq.importance import Proposal
from damagepred.uq.samplers import read_table
from damagepred.uq.variable import Variable

NORMALS = {place: Variable(distribution="normal", mean=0.0, std=1.0) for place in ("a", "b", "c")}
UNITS = dict.fromkeys(NORMALS, "1")
CORRELATION = {frozenset(("a", "b")): 0.6}
DEVIATION = np.sqrt(2 + 2 * 0.6 + 0.25)


def rare(beta: float, samples: int, seed: int, scale: float = 1.0, share: float = 0.0, shift: float = 0.8) -> Estimate:
    """P(a + b + 0.5 c >= beta sd), a and b correlated by 0.6, drawn with a and b shifted."""
    proposal = Proposal(shift=shift * beta, scale=scale)
    design = Design.make(NORMALS, UNITS, CORRELATION, Sampler("random", 1, {"a": proposal, "b": proposal}, share), seed)
    values = design.wall_values(samples)
    hit = values["a"] + values["b"] + 0.5 * values["c"] >= beta * DEVIATION
    return probability(hit, weight=design.weights(samples))


def coverage(found: list[Estimate], exact: float) -> float:
    return float(np.mean([f.lower <= exact <= f.upper for f in found]))


@pytest.mark.quick_cases
@pytest.mark.parametrize(("beta", "scale", "share"), [(3.0, 1.0, 0.0), (4.0, 1.3, 0.0), (3.0, 1.0, 0.2)])
def test_importance_sampling_is_unbiased_and_estimates_its_error(beta: float, scale: float, share: float) -> None:
    exact = special.ndtr(-beta)
    found = [rare(beta, 300, seed, scale, share) for seed in range(60)]
    values = np.array([f.value for f in found])
    error = values.std(ddof=1) / np.sqrt(len(values))
    assert abs(values.mean() - exact) < 4 * error
    assert error < 0.06 * exact  # of all 18 000; random ones would need 200 000 for beta 3, 9 million for beta 4
    assert np.sqrt(np.mean([f.error**2 for f in found])) == pytest.approx(values.std(ddof=1), rel=0.4)
    hits = round(coverage(found, exact) * len(found))
    assert stats.binom.cdf(hits, len(found), found[0].confidence) > 1e-3
    assert np.mean([f.half_width for f in found]) < 2.2 * values.std(ddof=1)


def test_the_error_of_replicates_is_that_of_the_mean_of_their_means() -> None:
    """Four scrambles of five hits with means of 0.2, 0.4, 0.4 and 0.6: their deviation is sqrt(0.08 / 3)."""
    label = np.arange(20) % 4
    hit = np.arange(20) // 4 < np.array([1, 2, 2, 3])[label]
    error = np.sqrt(0.08 / 3) / 2
    found = probability(hit, replicate=label)
    assert (found.value, found.error) == (pytest.approx(0.4), pytest.approx(error))


PLACES = list(Scene.from_dict({}).numbers)


def table(tmp_path: Path, text: str) -> dict[str, np.ndarray]:
    (tmp_path / "s.csv").write_text(text)
    return read_table(tmp_path / "s.csv", Scene.unit_of, PLACES)


def test_a_table_may_carry_units_in_its_header_or_its_cells(tmp_path: Path) -> None:
    found = table(
        tmp_path, "# drawn\njoint.tensile_strength [MPa], joint.friction,weight\n0.4,0.7,1\n0.5 N/mm2,70 %,0.5\n\n"
    )
    np.testing.assert_allclose(found["joint.tensile_strength"], [0.4e6, 0.5e6])
    np.testing.assert_allclose(found["joint.friction"], [0.7, 0.7])
    np.testing.assert_array_equal(found["weight"], [1, 0.5])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("joint.fricton\n0.7\n", r"column 'joint.fricton': .*Did you mean 'joint.friction'"),
        ("joint.friction\n", "no rows of numbers"),
        ("joint.friction,joint.cohesion\n0.7\n", "line 2: has 1 cells, the header 2"),
        ("joint.friction\n0.7\nhigh\n", "line 3, joint.friction = 'high'"),
        ("joint.friction\nnan\n", "line 2, joint.friction = 'nan'"),
        ("joint.friction,joint.friction\n0.7,0.8\n", "named twice"),
        ("joint.cohesion [mm]\n0.7\n", r"column 'joint.cohesion \[mm\]': has the wrong kind of unit"),
        ("joint.friction,weight\n0.7,0\n0.6,-1\n", "line 3, weight = -1: must not be negative"),
    ],
)
def test_an_invalid_table_is_refused_with_its_place(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        table(tmp_path, text)
