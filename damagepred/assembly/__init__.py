"""From descriptions to arrays: blocks, the interfaces between them, the law of each."""

from damagepred.assembly.assembly import GRAVITY, Assembly
from damagepred.assembly.model import Model
from damagepred.assembly.size import NO_LIMITS, Limits, WallSize, wall_size
from damagepred.assembly.wall import footing_alone, wall_geometry, wall_model

__all__ = [
    "GRAVITY",
    "NO_LIMITS",
    "Assembly",
    "Limits",
    "Model",
    "WallSize",
    "footing_alone",
    "wall_geometry",
    "wall_model",
    "wall_size",
]
