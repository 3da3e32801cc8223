"""Whole models of small scenes, number by number, against the lists in ``models/``."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from damagepred.assembly import Assembly, footing_alone, wall_cost, wall_model
from damagepred.assembly.assembly import rectangle
from damagepred.assembly.half_geometry import half_geometry
from damagepred.errors import InputError
from damagepred.scene import BlockMaterial, Joint, Scene, Solver
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
    "footing_zones": {"footing": FOOTING, "movement": {"shape": "mound"}, "solver": {"footing": "deformable"}},
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
    tables = SCENES[name]
    own = tables.get("movement", {})
    size = {"central_deflection": 3e-3} if own.get("shape", "arc") in ("arc", "jacks") else {}
    return Scene.from_dict({"wall": WALL, "solver": {"blocks": "rigid"}, **tables, "movement": size | own})


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
    parts |= parts_of(half_geometry(model.blocks, model.interfaces, model.elastic, model.mesh), "half")
    if "footing" in SCENES[name]:
        parts |= parts_of(footing_alone(scene, line_load=2e3), "footing alone")
    check_parts(LISTS / f"{name}.txt", parts)


def test_fields_give_each_joint_its_own_strength() -> None:
    scene = scene_of("openings")
    joints = len(wall_model(scene).joints.kind)
    fields = {key: np.linspace(low, 2.0 * low, joints) for key, low in (("joint.cohesion", 1e5), ("dpc.friction", 0.4))}
    check_parts(LISTS / "fields.txt", dict(parts_of(wall_model(scene, fields).properties)))


def piled() -> Assembly:
    """Four blocks on each other, the second of zones, with every kind of support and load."""
    wall = Assembly(thickness=0.2, joint=Joint(), block=BlockMaterial(density=1800.0), gravity=(0.5, -9.0))
    for i in range(4):
        wall.add_block(rectangle(0.1 * i, 0.3 * i, 0.6 + 0.1 * i, 0.3 * i + 0.3), course=i, zone_size=0.15 * (i == 1))
    wall.set_joint(3, 2, Joint(cohesion=9e4))
    wall.set_joint_above(1, Joint(friction=0.3))
    wall.bear(0, 0.1, width=0.05)
    wall.bear(0, 0.5, Joint(normal_stiffness=1e9), width=0.1)
    wall.support(0, rotation=False, y=False)
    wall.hold_after_load(3, x=False)
    wall.move(3, y=-2e-3, rotation=1e-3)
    wall.strain(2, 2e-4)
    wall.hold_points(1, lambda x, y: x < 0.11, x=lambda x, y: 1e-3 * y)
    wall.traction(1, lambda x, y: x > 0.69, x=500.0, y=lambda x, y: 100.0 * y)
    wall.traction(1, lambda x, y: x > 0.69, x=-50.0, live=True)
    wall.set_velocity(2, x=0.1, rotation=0.2)
    wall.load(2, x=30.0, moment=4.0)
    wall.load(2, y=-20.0, at=(0.5, 0.9))
    wall.push(3, x=7.0, at=(0.4, 1.2))
    wall.push_body(x=0.1)
    return wall


def test_an_assembly_is_its_list() -> None:
    model = piled().build(Solver(no_tension_subdivisions=2), span=0.5)
    check_parts(LISTS / "assembly.txt", dict(parts_of([model, model.ground.states()], "model")))


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (lambda wall: Assembly(gravity=(0.0, np.nan)), "gravity = .*2 values, each a finite number"),
        (lambda wall: Assembly(thickness=-1.0), "thickness = -1.0"),
        (lambda wall: Assembly().build(), "the assembly has no blocks"),
        (lambda wall: wall.rest_on_ground([0], lambda x: x, growth=lambda x, f: x), "displacement or growth, not both"),
        (lambda wall: wall.set_velocity(0, y=np.inf), "set_velocity: y = inf: must be a finite"),
        (lambda wall: wall.push_body(y=np.nan), "push_body: y = nan: must be a finite"),
        (lambda wall: wall.load(0, x=np.nan), "load: x = nan: must be a finite"),
        (lambda wall: wall.push(0, y=1.0, at=(0.0, np.nan)), "push: at = .*finite"),
        (lambda wall: wall.strain(0, np.nan), "strain = nan"),
        (lambda wall: wall.load(4), "block 4"),
        (lambda wall: wall.hold_points(2, lambda x, y: x < 9.0, x=0.0), "block 2: is rigid"),
        (lambda wall: wall.hold_points(1, lambda x, y: x > 9.0, x=0.0), "block 1: none of its .* gridpoints"),
        (lambda wall: wall.traction(1, lambda x, y: x > 9.0, x=1.0), "block 1: no edge of it"),
        (lambda wall: wall.add_block(rectangle(0, 2, 1, 3), elastic=True), "elastic blocks and blocks of zones"),
        (lambda wall: wall.support(1), "block 1: cannot be held as a whole and be deformable"),
        (lambda wall: wall.add_block(rectangle(0.0, 0.1, 0.6, 0.3)), "overlap"),
    ],
)
def test_a_wrong_assembly_is_refused(wrong: Callable[[Assembly], Any], words: str) -> None:
    wall = piled()

    def built() -> None:
        wrong(wall)
        wall.build()

    with pytest.raises(InputError, match=words):
        built()
