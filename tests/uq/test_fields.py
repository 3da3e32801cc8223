"""Values that vary from joint to joint: correlation of neighbours, and where it ends."""

import numpy as np
import pytest

from damagepred.assembly import wall_geometry
from damagepred.enumerations import ContactKind
from damagepred.scene import Dpc, Scene, Wall
from damagepred.uq.design import Design
from damagepred.uq.fields import course_sequences
from damagepred.uq.variable import JointField, Variable

TENSION, COHESION = "joint.tensile_strength", "joint.cohesion"


def test_the_scatter_is_the_same_everywhere_and_at_the_first_joint_too():
    """Of the shipped study's fields: lognormal, 0.4 along a course, 0.7 between tension and cohesion."""
    joints = wall_geometry(Scene(wall=Wall(length=3.6, height=0.9), dpc=Dpc())).joints
    sequence, field = course_sequences(joints.course, joints.kind, joints.x), JointField(course_correlation=0.4)
    variables = {
        place: Variable(distribution="lognormal", mean=mean, cov=cov, field=field)
        for place, mean, cov in ((TENSION, 0.453e6, 0.3), (COHESION, 0.375e6, 0.35))
    }
    design = Design.make(variables, dict.fromkeys(variables, "Pa"), {frozenset(variables): 0.7}, "sobol", 11)
    values = np.log([design.joint_values(i, sequence)[TENSION] for i in range(400)])
    beds = [np.flatnonzero((joints.course == c) & (joints.kind == ContactKind.BED_JOINT)) for c in range(3, 12)]
    sigma = np.sqrt(np.log(1 + 0.3**2))
    mean = np.log(0.453e6) - sigma**2 / 2
    standard = (values - mean) / sigma
    for some in ([bed[0] for bed in beds], [bed[-1] for bed in beds], np.arange(values.shape[1])):
        assert standard[:, some].mean() == pytest.approx(0.0, abs=0.06)
        assert standard[:, some].var() == pytest.approx(1.0, abs=0.08)
    # and no single joint stands out: 400 samples know a variance to about 7 %
    assert np.abs(standard.var(axis=0) - 1).max() < 0.4


# -- the pieces --------------------------------------------------------------------------------------------------------


def test_sequences_end_where_course_or_kind_changes():
    course = np.array([0, 0, 0, 0, 1, 1, 1, 2])
    kind = np.array([0, 0, 1, 1, 1, 0, 0, 0], dtype=np.int8)
    x = np.array([0.1, 0.3, 0.2, 0.4, 0.1, 0.2, 0.4, 0.3])
    assert course_sequences(course, kind, x).tolist() == [0, 0, 1, 1, 2, 3, 3, 4]
