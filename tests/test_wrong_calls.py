"""Wrong calls of public functions: each is answered by the package's own error, in words."""

import inspect
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr

import damagepred
from damagepred import Joint, Scene, damage, exports, plotting, report, scene, study
from damagepred.assembly import Assembly, footing_alone, wall_cost, wall_geometry, wall_model
from damagepred.campaign.settings import StudySettings
from damagepred.errors import LONGEST_MESSAGE, DamagepredError, InputError
from damagepred.results import simple_assessment
from damagepred.uq import fragility
from tests.synthetic_studies import synthetic_study

WRONG: tuple[Any, ...] = (None, "x", "", b"x", -1, 0, 2.5, math.nan, math.inf, -math.inf, 1e300, -1e300, 10**400, 2**62)
WRONG += (True, [], {}, (1, 2), ["a"], [math.nan], object(), 1j, np.array([[1.0]]))
WRONG += (xr.Dataset(), Path("no/where"), print)
"""What each argument is replaced by."""


@pytest.fixture(scope="module")
def known(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    folder = synthetic_study(tmp_path_factory.mktemp("wrong") / "s.dp")
    small = Scene.from_dict(
        {"wall": {"length": 1.2, "height": 0.45}, "dpc": {"course": 1}, "movement": {"increments": 2}}
    )
    ds = damagepred.open_study(folder)
    return {"folder": folder, "scene": small, "wall": damagepred.solve(small, increments=1), "ds": ds} | {
        "curves": damagepred.fit_fragility(ds, bootstrap=10),
        "study": damagepred.Study.from_folder(folder),
    }


def assembly() -> Assembly:
    made = Assembly()
    made.add_block([(0, -0.1), (1, -0.1), (1, 0), (0, 0)])
    made.add_block([(0.2, 0), (0.8, 0), (0.8, 0.3), (0.2, 0.3)])
    return made


Function = Callable[[dict[str, Any]], Callable[..., Any]]


def of(function: Function, **arguments: object) -> tuple[Function, dict[str, Any]]:
    return function, arguments


CALLS: dict[str, tuple[Function, dict[str, Any]]] = {
    "solve": (
        lambda k: damagepred.solve,
        {"scene": "scene", "increments": 1, "solver": None, "damage": None, "dynamics": None, "fields": {}}
        | {"on_failure": "return", "on_step": None, "store_zones": True, "limits": damagepred.Limits()},
    ),
    "Limits": of(lambda k: damagepred.Limits, memory=1e9, estimated_time=1.0, time=1.0),
    "cracks": of(lambda k: damagepred.cracks, ds="wall", hairline=1e-4),
    "crack_profile": of(lambda k: damagepred.crack_profile, ds="wall", increment=1, hairline=1e-4),
    "judge_again": (
        lambda k: damagepred.judge_again,
        {"ds": "wall", "table": "bre251", "plasterboard": False, "count_rule": True, "group_count": 2}
        | {"group_distance": 1.0, "dpc_threshold": 1e-3, "measure": "band", "band_gauge": 0.5}
        | {"band_threshold": 0.0},
    ),
    "open_study": of(lambda k: damagepred.open_study, path="folder"),
    "simple_methods": of(lambda k: damagepred.simple_methods, scene="scene", deflection_ratio=1e-3),
    "simple_category": of(lambda k: simple_assessment.simple_category, scene="scene", deflection_ratio=1e-3),
    "angular_distortion": of(lambda k: simple_assessment.angular_distortion, scene="scene", deflection_ratio=1e-3),
    "beam_strain": (
        lambda k: damage.beam_strain,
        {"deflection_ratio": 1e-3, "length": 6.0, "height": 2.4, "kind": "dishing", "modulus_ratio": 2.6}
        | {"ground_strain": 0.0, "poisson_ratio": 0.3},
    ),
    "load_table": of(lambda k: damage.load_table, name="as2870"),
    "read_table": of(lambda k: damage.read_table, path="folder"),
    "subset_simulation": (
        lambda k: damagepred.subset_simulation,
        {"limit_state": lambda z, *rest: z[:, 0], "dimensions": 2, "samples": 50, "level_share": 0.1, "seed": 0}
        | {"max_levels": 2, "confidence": 0.9},
    ),
    "fit_fragility": (
        lambda k: damagepred.fit_fragility,
        {"ds": "ds", "model": "separate", "intensity": None, "categories": [1], "confidence": 0.9}
        | {"bootstrap": 10, "goodness": 2, "seed": 0, "points": 11},
    ),
    "fit_lognormal": of(lambda k: fragility.fit_lognormal, lower=[0.0, 1.0], upper=[1.0, 2.0], count=[1, 1]),
    "turnbull": of(lambda k: fragility.turnbull, lower=[0.0, 1.0], upper=[1.0, 2.0], weight=[1.0, 1.0]),
    "normalised_weights": of(lambda k: fragility.normalised_weights, weight=[1.0, 2.0], upper=[1.0, math.inf]),
    "site_class": of(lambda k: scene.site_class, surface_movement=0.03),
    "standard_footing": of(lambda k: scene.standard_footing, site="M", construction="clad frame"),
    "suction_depth": of(lambda k: scene.suction_depth, zone=3),
    "frame": of(lambda k: exports.frame, ds="ds"),
    "draw_wall": of(lambda k: plotting.draw_wall, ds="wall", increment=1, exaggeration=10.0, slips=True),
    "draw_scene": of(lambda k: plotting.draw_scene, scene="scene"),
    "draw_history": of(lambda k: plotting.draw_history, ds="wall"),
    "draw_fragility": of(lambda k: plotting.draw_fragility, curves="curves"),
    "draw": of(lambda k: plotting.draw, ds="ds", variable="crack_width_max"),
    "draw_category_shares": of(lambda k: plotting.draw_category_shares, ds="ds"),
    "footing_alone": of(lambda k: footing_alone, scene="scene", line_load=0.0),
    "wall_model": of(lambda k: wall_model, scene="scene", fields={}),
    "wall_geometry": of(lambda k: wall_geometry, scene="scene"),
    "wall_cost": of(lambda k: wall_cost, scene="scene", increments=3),
    "Study.sample": of(lambda k: k["study"].sample, number=0),
    "Study.function": of(lambda k: k["study"].function, outputs=["damage_category"], movement="path"),
    "Study.design_dataset": of(lambda k: k["study"].design_dataset, samples=4),
    "StudyFunction": of(lambda k: study.StudyFunction, settings=None, outputs=[], movement="path"),
    "Assembly": of(lambda k: Assembly, thickness=0.1, gravity=(0.0, -9.81), joint=None, block=None),
    "add_block": (
        lambda k: assembly().add_block,
        {"vertices": [(2, 0), (3, 0), (3, 1)], "material": None, "course": 1, "zone_size": None, "thickness": 0.1},
    ),
    "bear": of(lambda k: assembly().bear, block=0, x=0.5, joint=None, width=0.1),
    "move": of(lambda k: assembly().move, block=0, x=0.0, y=0.0, rotation=0.0),
    "load": of(lambda k: assembly().load, block=0, x=0.0, y=0.0, moment=0.0, at=(0.0, 0.0)),
    "push": of(lambda k: assembly().push, block=0, x=0.0, y=0.0, moment=0.0, at=(0.0, 0.0)),
    "push_body": of(lambda k: assembly().push_body, x=0.1, y=0.0),
    "set_velocity": of(lambda k: assembly().set_velocity, block=0, x=0.0, y=0.0, rotation=0.0),
    "support": of(lambda k: assembly().support, block=0, x=True, y=True, rotation=True),
    "set_joint": of(lambda k: assembly().set_joint, a=0, b=1, joint=Joint(), kind=None),
    "set_joint_above": of(lambda k: assembly().set_joint_above, course=0, joint=Joint()),
    "rest_on_ground": of(lambda k: assembly().rest_on_ground, blocks=[0], displacement=None),
    "hold_points": of(lambda k: assembly().hold_points, block=0, where=lambda x, y: x > 0, x=0.0, y=0.0),
    "traction": of(lambda k: assembly().traction, block=0, where=lambda x, y: x > 0, x=0.0, y=0.0),
    "build": of(lambda k: assembly().build, solver=None, fields=None, span=1.0),
}


@pytest.mark.parametrize("name", CALLS)
@pytest.mark.timeout(300)
def test_wrong_arguments(name: str, known: dict[str, Any]) -> None:
    """An error of another kind, or a message without an end, is a defect; some values are right for some arguments."""
    function, arguments = CALLS[name]
    right = {key: known[v] if isinstance(v, str) and v in known else v for key, v in arguments.items()}
    said: list[str] = []
    for key in right:
        for value in WRONG:
            try:
                function(known)(**right | {key: value})
            except DamagepredError as error:
                said.append(str(error))
            plt.close("all")
    assert len(said) >= len(WRONG) // 2
    assert all(0 < len(text) <= LONGEST_MESSAGE for text in said)


REFUSED: dict[str, Callable[[dict[str, Any]], object]] = {
    "increments = 0": lambda k: damagepred.solve(k["scene"], increments=0),
    "increments = -1": lambda k: damagepred.solve(k["scene"], increments=-1),
    "on_failure": lambda k: damagepred.solve(k["scene"], on_failure="ignore"),
    "number = -1": lambda k: k["study"].sample(-1),
    "zero stiffness": lambda k: wall_model(k["scene"], {"joint.normal_stiffness": np.zeros(joints(k))}),
    "negative strength": lambda k: wall_model(k["scene"], {"joint.tensile_strength": np.full(joints(k), -1.0)}),
    "NaN": lambda k: wall_model(k["scene"], {"joint.cohesion": np.full(joints(k), np.nan)}),
    "text in a field": lambda k: wall_model(k["scene"], {"joint.cohesion": np.full(joints(k), "a")}),
    "bear(width = -1)": lambda k: assembly().bear(0, 0.5, width=-1.0),
    "bear beside": lambda k: assembly().bear(0, 50.0),
    "move(1e300)": lambda k: assembly().move(0, x=1e300),
    "points(1e300)": lambda k: assembly().hold_points(0, lambda x, y: x > 0, x=1e300),
    "a spread beyond numbers": lambda k: StudySettings.from_dict(
        {"scene": {}, "variables": {"joint.cohesion": {"distribution": "gamma", "mean": 1.0, "std": 1e300}}}
    ),
    "weights of 0": lambda k: fragility.normalised_weights(np.zeros(3), np.ones(3)),
    "an executor without futures": lambda k: k["study"].run(k["folder"].with_name("e.dp"), executor=object()),
    "an executor that answers otherwise": lambda k: k["study"].run(k["folder"].with_name("f.dp"), executor=Silly()),
    "seed = -1": lambda k: damagepred.fit_fragility(k["ds"], seed=-1),
    "bootstrap = -3": lambda k: damagepred.fit_fragility(k["ds"], bootstrap=-3),
    "points = 0": lambda k: damagepred.fit_fragility(k["ds"], points=0),
    "categories = [7]": lambda k: damagepred.fit_fragility(k["ds"], categories=[7]),
    "a limit state of a wrong shape": lambda k: damagepred.subset_simulation(lambda z, n: z, 2, samples=20),
}


class Silly:
    """Takes work and answers at once, with no future."""

    def submit(self, *work: object) -> int:
        return 3


def joints(known: dict[str, Any]) -> int:
    return len(wall_geometry(known["scene"]).joints.kind)


@pytest.mark.parametrize("name", REFUSED)
@pytest.mark.timeout(60)
def test_refused(name: str, known: dict[str, Any]) -> None:
    with pytest.raises(InputError) as refused:
        REFUSED[name](known)
    assert "\n" not in str(refused.value)


def test_every_public_function_is_checked() -> None:
    """Those that are not here, have no arguments, or take what only this package makes."""
    called = {name.split(".")[-1] for name in CALLS}
    for module in (damage, exports, plotting, report, simple_assessment, study):
        for name in module.__all__:
            function = getattr(module, name)
            if inspect.isfunction(function) and name not in called and inspect.signature(function).parameters:
                assert name in OF_THE_PACKAGE or hasattr(function, "__wrapped__"), name


OF_THE_PACKAGE = {"deflection_over_strain"}
