"""Whole models of small scenes, number by number, against the lists in ``models/``."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from damagepred.assembly import wall_model
from damagepred.assembly.cost_estimate import wall_cost
from damagepred.assembly.half_geometry import half_geometry
from damagepred.assembly.wall import footing_alone
from damagepred.scene import Scene
from tests.recorded import check_parts, parts_of

LISTS = Path(__file__).parent / "models"

WALL = {"length": 0.96, "height": 0.45}
FOOTING = {"width": 0.3, "depth": 0.3}
HISTORY = [
    {"kind": kind, "central_deflection": size, "increments": n, "time": time}
    for kind, size, n, time in (("dishing", 3e-3, 2, 0.5), ("doming", 2e-3, 3, 2.0))
]
SCENES: dict[str, dict[str, Any]] = {
    "plain": {"loads": {"roof": 900.0}},
    "openings": {
        "wall": {"length": 2.0, "height": 0.9, "bond": "stack"},
        "opening": [
            {"kind": "window", "x": 0.5, "y": 0.3, "width": 0.3, "height": 0.3},
            {"kind": "door", "x": 1.2, "width": 0.3, "height": 0.6},
        ],
        "control_joint": [{"x": 1.0, "width": 0.012}],
        "dpc": {"course": 2},
        "head_joint": {"tensile_strength": 0.3e6, "cohesion": 0.2e6},
    },
    "zones": {
        "dpc": {"course": 2},
        "solver": {"method": "explicit", "below_dpc": "deformable", "zone_size": 0.06},
        "block": {"cohesion": 1e6, "friction": 0.6, "tensile_strength": 1e6},
    },
    "elastic": {
        "solver": {"blocks": "elastic", "quadrature": "midpoint"},
        "movement": {"kind": "doming", "shape": "arc"},
    },
    "halves": {"block": {"tensile_strength": 2e6, "fracture_energy": 80.0}, "joint": {"fracture_energy": 10.0}},
    "step": {"movement": {"shape": "step", "kind": "settle", "settlement": 0.004, "position": 0.4}},
    "jacks": {"footing": FOOTING, "movement": {"shape": "jacks"}, "rig": {"jacks": [0.3, 0.6]}},
    "mound": {"footing": FOOTING, "movement": {"shape": "mound", "kind": "doming"}, "loads": {"roof": 500.0}},
    "concrete": {
        "footing": FOOTING | {"concrete": {"bottom": "3-L11TM", "top": "3-L8TM"}},
        "movement": {"shape": "mound"},
    },
    "test": {
        "movement": {"shape": "loads"},
        "load": [{"at": 0.3, "width": 0.2}, {"side": "left", "at": 0.2, "width": 0.1, "direction": "along"}],
        "support": [{"x": 0.1, "width": 0.1}, {"x": 0.8, "width": 0.2}],
        "loading": {"control": "force", "force": "100 N"},
    },
    "beam": {
        "movement": {"shape": "loads"},
        "load": [{"direction": "along"}],
        "loading": {"control": "displacement", "displacement": "3 mm", "beam": "free"},
    },
    "history": {"movement": {"stage": HISTORY}, "strain": {"growth": 4e-4}, "creep": {}},
}


def scene_of(name: str) -> Scene:
    """Scene of a small wall."""
    tables = SCENES[name]
    own = tables.get("movement", {})
    size = {"central_deflection": 3e-3} if own.get("shape", "arc") in ("arc", "jacks") else {}
    return Scene.from_dict({"wall": WALL, **tables, "movement": size | own})


@pytest.mark.parametrize("name", SCENES)
def test_a_model_is_its_list(name: str) -> None:
    scene = scene_of(name)
    model = wall_model(scene)
    parts = dict(parts_of(model)) | dict(parts_of(wall_cost(scene), "cost"))
    for key in ("size", "mass", "mean_block_weight", "block_stress", "is_strained", "on_ground", "interface_records"):
        parts |= parts_of(getattr(model, key), key)
    parts |= parts_of(model.joint_parameters, "joint_parameters")
    parts |= parts_of([model.describe_block(b) for b in (0, model.n_blocks - 1)], "described")
    ground = model.ground
    for key in ("states", "largest_rate", "largest_standing"):
        parts |= parts_of(getattr(ground, key)(), f"ground.{key}")
    for at in (0.3, 0.7):
        parts |= parts_of([ground.at(at), ground.load_factor_at(at), ground.load_factor_rate(at)], f"ground.at {at}")
    parts |= parts_of(half_geometry(model.blocks, model.interfaces, model.elastic, model.mesh, 1e-9), "half")
    if "footing" in SCENES[name]:
        parts |= parts_of(footing_alone(scene, line_load=2e3), "footing alone")
    check_parts(LISTS / f"{name}.txt", parts)


def test_fields_give_each_joint_its_own_strength() -> None:
    scene = scene_of("openings")
    joints = len(wall_model(scene).joints.kind)
    fields = {key: np.linspace(low, 2.0 * low, joints) for key, low in (("joint.cohesion", 1e5), ("dpc.friction", 0.4))}
    check_parts(LISTS / "fields.txt", dict(parts_of(wall_model(scene, fields).properties)))
