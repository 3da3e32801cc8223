"""Pictures: datasets in, axes and files out. The only part of the package that imports matplotlib.

A drawing returns its axes, and refuses a dataset of another kind with ``InputError``; a file that cannot be written
raises ``StudyError``.
"""

from damagepred.plotting import _matplotlib  # noqa: F401 - before all others
from damagepred.plotting.analyses import (
    draw_back_analysis,
    draw_comparison,
    draw_design_search,
    draw_portfolio,
    draw_sensitivity,
)
from damagepred.plotting.cracks import draw_cracks
from damagepred.plotting.field import draw
from damagepred.plotting.fragility import draw_fragility
from damagepred.plotting.history import draw_history
from damagepred.plotting.pictures import save_animation, save_fragility_picture, save_study_pictures, save_wall_pictures
from damagepred.plotting.scene import draw_scene
from damagepred.plotting.study import draw_category_shares
from damagepred.plotting.wall import draw_wall

__all__ = [
    "draw",
    "draw_back_analysis",
    "draw_category_shares",
    "draw_comparison",
    "draw_cracks",
    "draw_design_search",
    "draw_fragility",
    "draw_history",
    "draw_portfolio",
    "draw_scene",
    "draw_sensitivity",
    "draw_wall",
    "save_animation",
    "save_fragility_picture",
    "save_study_pictures",
    "save_wall_pictures",
]
