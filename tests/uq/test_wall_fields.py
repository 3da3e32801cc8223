"""Fields: values that vary along courses, or with distance over the wall."""

import math

import numpy as np
import pytest

from damagepred.assembly import wall_geometry
from damagepred.campaign.sample import joint_places
from damagepred.campaign.settings import StudySettings
from damagepred.enumerations import ContactKind
from damagepred.errors import InputError
from damagepred.scene import Dpc, Scene, Wall
from damagepred.study import Study
from damagepred.uq.design import Design
from damagepred.uq.fields import course_sequences, stated_correlation
from damagepred.uq.variable import JointField, Variable

TENSION, COHESION = "joint.tensile_strength", "joint.cohesion"
SCENE = Scene(wall=Wall(length=3.6, height=1.2), dpc=Dpc())
PLACES = joint_places(SCENE)


def variable(field: JointField, family: str = "lognormal", cov: float = 0.4) -> Variable:
    return Variable(distribution=family, mean=1.0, cov=cov, field=field)


def design(fields: dict[str, Variable], correlation: float | None = None) -> Design:
    wanted = {} if correlation is None else {frozenset(fields): correlation}
    return Design.make(fields, dict.fromkeys(fields, "1"), wanted, "sobol", 5)


def drawn(fields: dict[str, Variable], correlation: float | None = None, samples: int = 600) -> dict[str, np.ndarray]:
    made = design(fields, correlation)
    values = [made.joint_values(i, PLACES) for i in range(samples)]
    return {place: np.array([v[place] for v in values]) for place in fields}


def pairs(kind: ContactKind, dx: float, dy: float) -> tuple[np.ndarray, np.ndarray]:
    """Joints of a kind that lie apart by so much."""
    x, y = PLACES.x, PLACES.y
    near = np.isclose(x[None, :] - x[:, None], dx, atol=1e-6) & np.isclose(y[None, :] - y[:, None], dy, atol=1e-6)
    mine = kind == PLACES.kind
    return np.nonzero(near & mine[:, None] & mine[None, :])


def found(values: np.ndarray, i: np.ndarray, j: np.ndarray) -> tuple[float, float]:
    """Correlation of pairs of joints over samples, and its standard error."""
    assert len(i) > 5
    mean, std = values.mean(), values.std()
    each = ((values[:, i] - mean) * (values[:, j] - mean)).mean(axis=1) / std**2
    return float(each.mean()), float(each.std() / math.sqrt(len(each)))


UNIT, COURSE = 0.24, 0.075


@pytest.mark.parametrize(
    ("field", "dx", "dy", "wanted"),
    [
        ({"correlation_length": 0.5}, UNIT, 0.0, math.exp(-UNIT / 0.5)),
        ({"correlation_length": 0.5}, 0.0, 2 * COURSE, math.exp(-2 * COURSE / 0.5)),
        ({"correlation_length": 0.5}, UNIT, 4 * COURSE, math.exp(-math.hypot(UNIT, 4 * COURSE) / 0.5)),
        ({"correlation_length": 0.5, "nugget": 0.3}, UNIT, 0.0, 0.7 * math.exp(-UNIT / 0.5)),
        (
            {"correlation_length": 0.5, "vertical_length": 0.1},
            UNIT / 2,
            COURSE,
            math.exp(-math.hypot(UNIT / 2 / 0.5, COURSE / 0.1)),
        ),
        ({"correlation_length": 0.5, "over": "course"}, 2 * UNIT, 0.0, math.exp(-2 * UNIT / 0.5)),
        ({"correlation_length": 0.5, "over": "course"}, 0.0, 2 * COURSE, 0.0),
        ({"course_correlation": 0.4, "over": "wall"}, UNIT, 0.0, 0.4),
        ({"course_correlation": 0.4, "over": "wall"}, 0.0, 2 * COURSE, 0.4 ** (2 * COURSE / UNIT)),
    ],
)
@pytest.mark.parametrize("kind", [ContactKind.BED_JOINT, ContactKind.HEAD_JOINT])
def test_the_correlation_is_as_stated_at_that_distance(field, dx, dy, wanted, kind) -> None:
    values = drawn({TENSION: variable(JointField(**field))}, samples=300)[TENSION]
    i, j = pairs(kind, dx, dy)
    got, error = found(values, i, j)
    assert got == pytest.approx(wanted, abs=3.5 * error)
    assert error < 0.035


LENGTHS = [
    (JointField(correlation_length=0.5), JointField(correlation_length=0.5), 0.7),
    (JointField(correlation_length=0.5), JointField(correlation_length=0.8), 0.6),
    (JointField(correlation_length=0.8, nugget=0.3), JointField(course_correlation=0.4), 0.3),
]


@pytest.mark.parametrize(("first", "second", "wanted"), LENGTHS)
def test_two_fields_are_correlated_in_one_joint_and_each_keeps_its_own(first, second, wanted) -> None:
    values = drawn({TENSION: variable(first), COHESION: variable(second, "normal", 0.2)}, wanted, 300)
    x, y = ((v - v.mean()) / v.std() for v in values.values())
    each = (x * y).mean(axis=1)
    assert each.mean() == pytest.approx(wanted, abs=3.5 * each.std() / math.sqrt(300))
    i, j = pairs(ContactKind.BED_JOINT, UNIT, 0.0)
    for place, field in ((TENSION, first), (COHESION, second)):
        got, error = found(values[place], i, j)
        stated = stated_correlation(field, PLACES, np.flatnonzero(PLACES.kind == ContactKind.BED_JOINT))
        of_pair = np.searchsorted(np.flatnonzero(PLACES.kind == ContactKind.BED_JOINT), [i[0], j[0]])
        assert got == pytest.approx(stated[tuple(of_pair)], abs=3.5 * error)


def test_fields_of_different_kinds_of_distributions_can_be_correlated():
    """The normals under measured values fall off more slowly than those under a lognormal: mended within 0.02."""
    field = JointField(correlation_length=0.5)
    fields = {
        TENSION: variable(field),
        COHESION: Variable(distribution="empirical", values=(0.31, 0.42, 0.35, 0.29, 0.51), field=field),
    }
    values = drawn(fields, 0.7, 300)
    x, y = ((v - v.mean()) / v.std() for v in values.values())
    each = (x * y).mean(axis=1)
    assert each.mean() == pytest.approx(0.7, abs=3.5 * each.std() / math.sqrt(300))
    i, j = pairs(ContactKind.BED_JOINT, UNIT, 0.0)
    for place in fields:
        got, error = found(values[place], i, j)
        assert got == pytest.approx(math.exp(-UNIT / 0.5), abs=3.5 * error + 0.02)


def test_a_study_with_impossible_fields_is_refused_before_any_wall():
    tables = {
        "scene": {"wall": {"length": 2.4, "height": 0.6}},
        "variables": {
            TENSION: {"distribution": "lognormal", "mean": 1e6, "cov": 0.3, "field": {"correlation_length": 5.0}},
            COHESION: {"distribution": "lognormal", "mean": 1e6, "cov": 0.3, "field": {"correlation_length": 0.1}},
        },
        "correlation": {TENSION: {COHESION: 0.9}},
    }
    with pytest.raises(InputError, match="cannot be so strongly correlated"):
        Study(StudySettings.from_dict(tables))


def test_weak_units_come_in_patches():
    """A mixture through a field: as often as stated, and weak joints near weak joints."""
    parts = [{"weight": w, "distribution": "lognormal", "mean": m, "cov": 0.05} for w, m in ((0.95, 1.0), (0.05, 0.5))]
    weak = Variable(distribution="mixture", components=parts, field=JointField(correlation_length=0.5))
    values = drawn({TENSION: weak}, samples=200)[TENSION] < 0.7
    share = values.mean(axis=1)
    assert share.mean() == pytest.approx(0.05, abs=3.5 * share.std() / math.sqrt(200))
    i, j = pairs(ContactKind.BED_JOINT, UNIT, 0.0)
    assert (values[:, i] & values[:, j]).mean() > 3 * 0.05**2


TENSION, COHESION = "joint.tensile_strength", "joint.cohesion"


def test_the_scatter_is_the_same_everywhere_and_at_the_first_joint_too():
    """Of the shipped study's fields: lognormal, 0.4 along a course, 0.7 between tension and cohesion."""
    scene, field = Scene(wall=Wall(length=3.6, height=0.9), dpc=Dpc()), JointField(course_correlation=0.4)
    joints, places = wall_geometry(scene).joints, joint_places(scene)
    variables = {
        place: Variable(distribution="lognormal", mean=mean, cov=cov, field=field)
        for place, mean, cov in ((TENSION, 0.453e6, 0.3), (COHESION, 0.375e6, 0.35))
    }
    design = Design.make(variables, dict.fromkeys(variables, "Pa"), {frozenset(variables): 0.7}, "sobol", 11)
    values = np.log([design.joint_values(i, places)[TENSION] for i in range(400)])
    beds = [np.flatnonzero((joints.course == c) & (joints.kind == ContactKind.BED_JOINT)) for c in range(3, 12)]
    sigma = np.sqrt(np.log(1 + 0.3**2))
    mean = np.log(0.453e6) - sigma**2 / 2
    standard = (values - mean) / sigma
    for some in ([bed[0] for bed in beds], [bed[-1] for bed in beds], np.arange(values.shape[1])):
        assert standard[:, some].mean() == pytest.approx(0.0, abs=0.06)
        assert standard[:, some].var() == pytest.approx(1.0, abs=0.08)
    # and no single joint stands out: 400 samples know a variance to about 7 %
    assert np.abs(standard.var(axis=0) - 1).max() < 0.4


def test_sequences_end_where_course_or_kind_changes():
    course = np.array([0, 0, 0, 0, 1, 1, 1, 2])
    kind = np.array([0, 0, 1, 1, 1, 0, 0, 0], dtype=np.int8)
    x = np.array([0.1, 0.3, 0.2, 0.4, 0.1, 0.2, 0.4, 0.3])
    assert course_sequences(course, kind, x).tolist() == [0, 0, 1, 1, 2, 3, 3, 4]
