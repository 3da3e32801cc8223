"""Keys that do not go together, and derived settings of runs in time; units, defaults and bounds: the page of keys."""

import math
import re
from typing import Any

import pytest

from damagepred.errors import InputError
from damagepred.scene.dynamics import BaseMotion, Dynamics
from damagepred.scene.materials import BlockMaterial, Joint
from damagepred.scene.mound import Mound
from damagepred.scene.rig import Rig
from damagepred.scene.settings import Damage, Solver
from damagepred.scene.wall import Wall


@pytest.mark.parametrize("kind", [BaseMotion, BlockMaterial, Damage, Dynamics, Joint, Mound, Rig, Solver, Wall])
def test_help_has_the_meaning_of_each_field(kind: Any) -> None:
    """A field with the string below it, or the string below the next fields, that holds for all of them."""
    head, _, fields = (kind.__doc__ or "").partition("\nAttributes\n----------\n")
    assert head.endswith("\n")
    for name in kind.__dataclass_fields__:
        assert re.search(rf"^(\w+, )*{name}(, \w+)* : .+\n    \S", fields, re.MULTILINE), name


def test_damping_by_hand() -> None:
    """At 4 Hz and 6 Hz, 8 and 12 pi a second: 2 x 0.1 x 8 pi; 2 x 0.1 x 96 pi / 20 and 2 x 0.1 / (20 pi)."""
    expected = {
        "none": (0, 0),
        "local": (0, 0),
        "viscous": (1.6 * math.pi, 0),
        "rayleigh": (0.96 * math.pi, 0.01 / math.pi),
    }
    for damping, (mass, stiffness) in expected.items():
        run = Dynamics(damping=damping, damping_ratio=0.1, frequency=4.0, second_frequency=6.0)
        assert (run.mass_damping, run.stiffness_damping) == pytest.approx((mass, stiffness), rel=1e-12)


@pytest.mark.parametrize(
    ("kind", "keys", "words"),
    [
        (BaseMotion, {"kind": "half_sine"}, "duration: a pulse"),
        (BaseMotion, {"kind": "half_sine", "duration": 1.0, "file": "a.csv"}, "only read with kind = 'record'"),
        (BaseMotion, {"kind": "full_sine", "duration": 1.0, "time": (0.0, 1.0)}, "only read"),
        (BaseMotion, {"kind": "rectangular", "duration": 1.0, "values": (0.0, 1.0)}, "only read"),
        (BaseMotion, {"file": "a.csv", "time": (0.0, 1.0)}, "leave out one"),
        (BaseMotion, {"file": "a.csv", "values": (0.0, 1.0)}, "leave out one"),
        (BaseMotion, {}, "0 times and 0 values"),
        (BaseMotion, {"time": (0.0,), "values": (1.0,)}, "1 times and 1 values"),
        (BaseMotion, {"time": (0.0, 1.0, 2.0), "values": (1.0, 1.0)}, "3 times and 2 values"),
        (BaseMotion, {"time": (0.0, 2.0, 1.0), "values": (1.0, 2.0, 3.0)}, "must rise"),
        (BaseMotion, {"time": (0.0, 1.0, 1.0), "values": (1.0, 2.0, 3.0)}, "must rise"),
        (Dynamics, {"damping": "rayleigh", "frequency": 100.0}, "must be above frequency = 100 Hz"),
        (Joint, {"dilation": 0.76}, "dilation = 0.76: must not exceed friction = 0.75"),
        (BlockMaterial, {"dilation": 0.76}, "dilation = 0.76: must not exceed friction = 0.75"),
        (Joint, {"residual_tensile_strength": 0.454e6}, "must not exceed tensile_strength = 453000"),
        (Joint, {"residual_cohesion": 0.376e6}, "must not exceed cohesion = 375000"),
        (Joint, {"shear_fracture_energy": 50.0}, "fracture_energy, which is missing"),
        (Joint, {"shear_fracture_energy": 50.0, "fracture_energy": 9.0, "dilation": 0.1}, "dilation = 0, not 0.1"),
        (Joint, {"shear_fracture_energy": 50.0, "fracture_energy": 9.0, "brittle_shear": True}, "brittle_shear = fal"),
        (Joint, {"compressive_strength": 9e6, "dilation": 0.1}, "goes only with dilation = 0, not 0.1"),
        (
            Joint,
            {"fracture_energy": 9.0, "residual_tensile_strength": 0.5},
            "must be 0 with fracture_energy = 9.*; leave out one",
        ),
        (Wall, {"block_length": 6.1}, "must not exceed the wall's length = 6"),
        (Wall, {"bond_offset": 0.1}, "take fit = 'cut'"),
        (Wall, {"fit": "cut", "bond_offset": 0.24}, "must be less than a brick"),
        (Wall, {"block_height": 2.5}, "must not exceed the wall's height = 2.4"),
        (Solver, {"contacts_per_interface": 1}, "Lobatto needs 2 or more; or take quadrature = 'midpoint'"),
        (Damage, {"table": "bre251", "plasterboard": True}, "no such allowance"),
        (Mound, {"shape": "mitchell", "embedment": 4.0}, "less than suction_depth = 4 m, .*; or give the exponent"),
        (Mound, {"shape": "tunnel"}, "needs the distance of the trough.*, or tunnel_depth, from which it follows"),
        (Mound, {"table": ((0, 0), (1, 1))}, "only read with shape = 'table'; here shape = 'walsh'"),
        (Mound, {"shape": "table", "table": ((0, 0),)}, "at least 2 points"),
        (Rig, {"control": "load"}, "jack_load: is missing; control = 'load' needs .*, or take control = 'deflection'"),
        (
            Rig,
            {"jack_load": 0.0},
            "only read with control = 'load'; here control = 'deflection', .* Leave one of the two out",
        ),
        (Rig, {"jacks": (2.0, 1.0, 2.0)}, "jacks: 2 m is there twice; give each place once"),
        (Rig, {"supports": (2.0, 1.0, 2.0)}, "supports: 2 m is there twice"),
        (Rig, {"supports": (2.0,)}, "one support does not hold a footing level; give two or more, or none for both"),
    ],
)
def test_keys_that_do_not_go_together(kind: type, keys: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        kind(**keys)


@pytest.mark.parametrize(
    ("kind", "keys"),
    [
        (BaseMotion, {"kind": "half_sine", "duration": 1e-3}),
        (BaseMotion, {"file": "a.csv"}),
        (BaseMotion, {"time": (0.0, 1e-9), "values": (1.0, 1.0)}),
        (Dynamics, {"damping": "viscous", "frequency": 100.0}),
        (Dynamics, {"damping": "rayleigh", "frequency": 99.0}),
        (Joint, {"dilation": 0.75}),
        (BlockMaterial, {"dilation": 0.75}),
        (Joint, {"residual_tensile_strength": 0.453e6, "residual_cohesion": 0.375e6}),
        (Joint, {"shear_fracture_energy": 50.0, "fracture_energy": 9.0}),
        (Joint, {"compressive_strength": 9e6}),
        (Wall, {"block_length": 6.0, "block_height": 2.4}),
        (Solver, {"contacts_per_interface": 2}),
        (Solver, {"contacts_per_interface": 1, "quadrature": "midpoint"}),
        (Damage, {"plasterboard": True}),
        (Mound, {"shape": "mitchell", "embedment": 3.999}),
        (Mound, {"shape": "mitchell", "embedment": 4.0, "exponent": 2.0}),
        (Mound, {"embedment": 4.0}),
        (Mound, {"shape": "table", "table": ((0, 0), (1, 1))}),
        (Mound, {"shape": "tunnel", "reach": 1.0}),
        (Rig, {"control": "load", "jack_load": 0.0}),
        (Rig, {"supports": (2.0, 1.0), "jacks": (3.0,)}),
    ],
)
def test_keys_at_the_edge_of_what_goes(kind: type, keys: dict[str, Any]) -> None:
    kind(**keys)
