"""Studies of walls with control joints, also of joints whose place and width are uncertain."""

from pathlib import Path

import numpy as np
import pytest

from damagepred import open_study
from damagepred.campaign.settings import StudySettings
from damagepred.study import Study


@pytest.mark.thorough
def test_a_study_stores_openings_of_control_joints(tmp_path: Path):
    tables = {
        "scene": {
            "wall": {"length": 2.4, "height": 0.6},
            "dpc": {"course": 1},
            "control_joint": [{"x": 1.2}],
            "movement": {"kind": "doming", "central_deflection": 4e-3, "increments": 2},
        },
        "study": {"samples": 4, "seed": 1},
        "variables": {
            "joint.tensile_strength": {
                "distribution": "lognormal",
                "mean": 0.4e6,
                "cov": 0.3,
                "field": {"course_correlation": 0.4},
            },
            "control_joint.1.x": {"distribution": "uniform", "lower": 0.6, "upper": 1.8},
            "control_joint.1.width": {"distribution": "uniform", "lower": 5e-3, "upper": 15e-3},
        },
    }
    settings = StudySettings.from_dict(tables)
    assert settings.shape_varies
    summary = Study(settings).run(tmp_path / "joints.dp", workers=1)
    assert (summary.done, summary.failed) == (4, 0)
    ds = open_study(tmp_path / "joints.dp")
    opened = ds.control_joint_opening_max.values
    assert opened.shape == (4, 3)
    assert (opened[:, -1] > 1e-4).all()
    assert len(np.unique(opened[:, -1])) == 4
    assert (ds.control_joint_closing_max.values >= 0).all()
