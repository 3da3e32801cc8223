"""Values that vary from joint to joint: correlation of neighbours, and where it ends."""

from typing import NamedTuple

import numpy as np
import pytest

from damagepred.assembly import wall_geometry
from damagepred.enumerations import ContactKind
from damagepred.errors import InputError
from damagepred.scene import Dpc, Scene, Wall
from damagepred.uq.design import Design
from damagepred.uq.fields import course_sequences
from damagepred.uq.variable import JointField, Variable

TENSION, COHESION = "joint.tensile_strength", "joint.cohesion"


class Fields(NamedTuple):
    """Values of many samples (samples, joints), and the wall's joints."""

    values: dict[str, np.ndarray]
    course: np.ndarray
    kind: np.ndarray

    def beds(self, course: int) -> np.ndarray:
        return np.flatnonzero((self.course == course) & (self.kind == ContactKind.BED_JOINT))


def field(mean: float, cov: float, lag: float, family: str = "lognormal") -> Variable:
    return Variable(distribution=family, mean=mean, cov=cov, field=JointField(course_correlation=lag))


def sample(variables: dict[str, Variable], correlation: float | None, samples: int = 400) -> Fields:
    scene = Scene(wall=Wall(length=3.6, height=0.9), dpc=Dpc())
    joints = wall_geometry(scene).joints
    sequence = course_sequences(joints.course, joints.kind, joints.x)
    wanted = {} if correlation is None else {frozenset(variables): correlation}
    design = Design.make(variables, dict.fromkeys(variables, "Pa"), wanted, "sobol", 11)
    drawn = [design.joint_values(i, sequence) for i in range(samples)]
    return Fields({p: np.array([d[p] for d in drawn]) for p in variables}, joints.course, joints.kind)


@pytest.fixture(scope="module")
def masonry() -> Fields:
    """As in the shipped study: lognormal, 0.4 along a course, 0.7 between tension and cohesion."""
    return sample({TENSION: field(0.453e6, 0.3, 0.4), COHESION: field(0.375e6, 0.35, 0.4)}, 0.7)


def correlation(first: np.ndarray, second: np.ndarray) -> float:
    return float(np.corrcoef(first.ravel(), second.ravel())[0, 1])


def along(fields: Fields, place: str, lag: int) -> float:
    pairs = [fields.values[place][:, fields.beds(c)] for c in range(3, 12)]
    return correlation(np.hstack([p[:, lag:] for p in pairs]), np.hstack([p[:, :-lag] for p in pairs]))


def test_the_scatter_is_the_same_everywhere_and_at_the_first_joint_too(masonry: Fields):
    values = np.log(masonry.values[TENSION])
    sigma = np.sqrt(np.log(1 + 0.3**2))
    mean = np.log(0.453e6) - sigma**2 / 2
    standard = (values - mean) / sigma
    first = [masonry.beds(c)[0] for c in range(3, 12)]
    last = [masonry.beds(c)[-1] for c in range(3, 12)]
    for joints in (first, last, np.arange(values.shape[1])):
        assert standard[:, joints].mean() == pytest.approx(0.0, abs=0.06)
        assert standard[:, joints].var() == pytest.approx(1.0, abs=0.08)
    # and no single joint stands out: 400 samples know a variance to about 7 %
    assert np.abs(standard.var(axis=0) - 1).max() < 0.4


def test_a_smooth_field_cannot_follow_a_rough_one():
    """A strongly and an uncorrelated field cannot be equal in every joint."""
    variables = {TENSION: field(1e6, 0.1, 0.95), COHESION: field(1e6, 0.1, 0.0)}
    with pytest.raises(InputError, match=r"by 0\.9502 and 0 from joint to joint"):
        sample(variables, 0.9, 1)


# -- the pieces --------------------------------------------------------------------------------------------------------


def test_sequences_end_where_course_or_kind_changes():
    course = np.array([0, 0, 0, 0, 1, 1, 1, 2])
    kind = np.array([0, 0, 1, 1, 1, 0, 0, 0], dtype=np.int8)
    x = np.array([0.1, 0.3, 0.2, 0.4, 0.1, 0.2, 0.4, 0.3])
    assert course_sequences(course, kind, x).tolist() == [0, 0, 1, 1, 2, 3, 3, 4]
