"""Two courses bonded to a base that domes with a curvature of 1/1000 per metre: stresses in the middle of a long strip.

The base holds the strip's underside along its length, so the head joints are torn like the fibres of a beam. What a
model makes of the bed joints depends on whether bricks stretch and bend with the base. The reference are bricks of
zones of 30 mm with five contacts an interface.
"""

from __future__ import annotations

import numpy as np
import pytest

from damagepred import Scene, solve
from damagepred.enumerations import ContactKind

LENGTH, CURVATURE = 2.64, 1e-3


def peaks(**solver: object) -> dict[str, float]:
    """Largest tension (MPa) of head joints, bed joints and the bed on the base in the middle of the strip."""
    scene = Scene.from_dict(
        {
            "wall": {"length": LENGTH, "height": 0.15},
            "block": {"density": 0.0},
            "joint": {"tensile_strength": 100e6, "cohesion": 100e6},
            "movement": {
                "kind": "doming",
                "shape": "parabola",
                "central_deflection": CURVATURE * LENGTH**2 / 8,
                "increments": 1,
            },
            "solver": solver,
        }
    )
    ds = solve(scene)
    middle = np.abs(ds["contact_x"].values - LENGTH / 2) < 0.25
    stress, kind = ds["contact_normal_stress"].values[-1], ds["contact_kind"].values
    names = {"head": ContactKind.HEAD_JOINT, "bed": ContactKind.BED_JOINT, "base": ContactKind.FOOTING_INTERFACE}
    return {name: 1e-6 * float(stress[middle & (kind == of)].max()) for name, of in names.items()}


def test_elastic_bricks_follow_a_curved_base() -> None:
    exact = peaks(blocks="deformable", zone_size=0.03, contacts_per_interface=5)
    elastic, rigid = peaks(blocks="elastic"), peaks(blocks="rigid")
    print(exact, elastic, rigid)
    assert elastic["head"] == pytest.approx(exact["head"], rel=0.03)
    assert elastic["bed"] == pytest.approx(exact["bed"], abs=0.03)
    assert elastic["base"] == pytest.approx(exact["base"], abs=0.03)
    assert rigid["bed"] > 3.0 * exact["bed"]
    assert rigid["base"] > 5.0 * exact["base"]
