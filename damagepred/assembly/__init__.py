"""From descriptions to arrays: blocks, the interfaces between them, the law of each."""

from damagepred.assembly.assembly import GRAVITY, Assembly
from damagepred.assembly.cost_estimate import NO_LIMITS, Limits, WallCost, wall_cost
from damagepred.assembly.model import Model
from damagepred.assembly.wall import footing_alone, wall_geometry, wall_model

__all__ = [
    "GRAVITY",
    "NO_LIMITS",
    "Assembly",
    "Limits",
    "Model",
    "WallCost",
    "footing_alone",
    "wall_cost",
    "wall_geometry",
    "wall_model",
]
