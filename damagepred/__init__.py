"""How likely is each damage category of a masonry wall when the ground under it moves?

The names below are the public face; each is imported when first used, so that ``import damagepred`` is cheap.

Examples
--------
>>> import damagepred
>>> scene = damagepred.Scene.from_dict({"wall": {"length": 1.2, "height": 0.3}, "movement": {"increments": 2}})
>>> wall = damagepred.solve(scene)
>>> wall.damage_category.values.tolist()
[0, 0, 0]
"""  # noqa: D400

from __future__ import annotations

import sys
from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from damagepred.runtime.version import __version__

if TYPE_CHECKING:
    from importlib.machinery import ModuleSpec
    from types import ModuleType

    from damagepred import assembly, damage, exports, plotting, report, scene, study, uq
    from damagepred.analyses.back_analysis import infer
    from damagepred.analyses.design_search import search_design
    from damagepred.analyses.portfolio import assess_portfolio
    from damagepred.analyses.variance_shares import study_sensitivity
    from damagepred.assembly import NO_LIMITS, Assembly, Limits
    from damagepred.damage import construction_limits
    from damagepred.errors import DamagepredError, InputError, SolverError, StudyError
    from damagepred.exports import frame, to_arviz
    from damagepred.one_wall.solve import solve
    from damagepred.results.rejudge import judge_again
    from damagepred.results.scales import compare_scales
    from damagepred.results.simple_assessment import simple_categories, simple_methods
    from damagepred.results.wall_cracks import crack_frame, crack_profile, cracks
    from damagepred.scene import (
        BaseMotion,
        BlockMaterial,
        ControlJoint,
        Creep,
        Damage,
        Dpc,
        Dynamics,
        Footing,
        HeadJoint,
        Joint,
        Load,
        Loading,
        Loads,
        Mound,
        Movement,
        Opening,
        ReinforcedConcrete,
        Rig,
        Scene,
        Soil,
        SoilLayer,
        Solver,
        Strain,
        Suction,
        Support,
        Wall,
    )
    from damagepred.study import Study, StudyFunction, open_study
    from damagepred.uq.comparison import compare
    from damagepred.uq.exceedance import exceedance
    from damagepred.uq.fragility import fit_fragility, fit_surface
    from damagepred.uq.subset import subset_simulation

_MODULES = ("assembly", "damage", "exports", "plotting", "report", "scene", "study", "uq")

_HOMES = {
    name: module
    for module, names in {
        "scene": "Scene Wall Opening ControlJoint BlockMaterial Joint HeadJoint Dpc Footing ReinforcedConcrete Soil "
        "SoilLayer Suction Movement Mound BaseMotion Loads Load Loading Support Strain Creep Solver Damage Dynamics "
        "Rig",
        "one_wall.solve": "solve",
        "results.wall_cracks": "cracks crack_frame crack_profile",
        "results.simple_assessment": "simple_categories simple_methods",
        "study": "Study open_study StudyFunction",
        "uq.fragility": "fit_fragility fit_surface",
        "uq.exceedance": "exceedance",
        "uq.comparison": "compare",
        "uq.subset": "subset_simulation",
        "results.rejudge": "judge_again",
        "results.scales": "compare_scales",
        "analyses.variance_shares": "study_sensitivity",
        "analyses.back_analysis": "infer",
        "analyses.design_search": "search_design",
        "analyses.portfolio": "assess_portfolio",
        "exports": "frame to_arviz",
        "assembly": "Assembly Limits NO_LIMITS",
        "damage": "construction_limits",
        "errors": "DamagepredError InputError SolverError StudyError",
    }.items()
    for name in names.split()
}

__all__ = [*_HOMES, *_MODULES, "__version__"]


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(import_module(f"damagepred.{_HOMES[name]}"), name)
    if name in _MODULES:
        return import_module(f"damagepred.{name}")
    raise AttributeError(f"module 'damagepred' has no attribute '{name}'")


class _WhenXarrayIsImported:
    """Registers ``ds.damagepred`` right after xarray is imported, which here would take half a second."""

    def find_spec(self, name: str, path: Any = None, target: Any = None) -> ModuleSpec | None:
        if name != "xarray":
            return None
        sys.meta_path.remove(self)
        spec = find_spec(name)
        if spec is None or spec.loader is None:
            return spec
        execute = spec.loader.exec_module

        def execute_and_register(module: ModuleType) -> None:
            execute(module)
            import_module("damagepred.results.accessor")

        spec.loader.exec_module = execute_and_register  # type: ignore[method-assign]
        return spec


if "xarray" in sys.modules:
    import_module("damagepred.results.accessor")
else:
    sys.meta_path.insert(0, _WhenXarrayIsImported())


def __dir__() -> list[str]:
    return sorted(__all__)
