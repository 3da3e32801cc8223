"""How likely is which damage to a masonry wall when the ground under it moves.

The names below are the public face; each is imported when first used, so that ``import damagepred`` is cheap.

Examples
--------
>>> import damagepred
>>> scene = damagepred.Scene.from_dict({"wall": {"length": 1.2, "height": 0.3}, "movement": {"increments": 2}})
>>> wall = damagepred.solve(scene)
>>> wall.damage_category.values.tolist()
[0, 0, 0]
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from damagepred.version import __version__

if TYPE_CHECKING:
    from damagepred.assembly import NO_LIMITS, Assembly, Limits
    from damagepred.damage.simple import simple_methods
    from damagepred.errors import DamagepredError, InputError, SolverError, StudyError
    from damagepred.pipeline import solve
    from damagepred.rejudge import judge_again
    from damagepred.scene import Scene
    from damagepred.study import Study, open_study
    from damagepred.uq.fragility import fit_fragility
    from damagepred.uq.subset import subset_simulation
    from damagepred.wall_cracks import crack_profile, cracks

_HOMES = {
    "Assembly": "assembly",
    "DamagepredError": "errors",
    "InputError": "errors",
    "Limits": "assembly",
    "NO_LIMITS": "assembly",
    "Scene": "scene",
    "SolverError": "errors",
    "Study": "study",
    "StudyError": "errors",
    "crack_profile": "wall_cracks",
    "cracks": "wall_cracks",
    "fit_fragility": "uq.fragility",
    "judge_again": "rejudge",
    "open_study": "study",
    "simple_methods": "damage.simple",
    "solve": "pipeline",
    "subset_simulation": "uq.subset",
}

__all__ = [
    "NO_LIMITS",
    "Assembly",
    "DamagepredError",
    "InputError",
    "Limits",
    "Scene",
    "SolverError",
    "Study",
    "StudyError",
    "__version__",
    "crack_profile",
    "cracks",
    "fit_fragility",
    "judge_again",
    "open_study",
    "simple_methods",
    "solve",
    "subset_simulation",
]


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(import_module(f"damagepred.{_HOMES[name]}"), name)
    raise AttributeError(f"module 'damagepred' has no attribute '{name}'")


def __dir__() -> list[str]:
    return sorted(__all__)
