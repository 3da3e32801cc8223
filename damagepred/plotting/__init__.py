"""Pictures: datasets in, axes and files out. The only part of the package that imports matplotlib."""

from damagepred.plotting.dpc import draw_dpc_opening
from damagepred.plotting.fragility import draw_fragility
from damagepred.plotting.history import draw_history
from damagepred.plotting.openings import draw_opening_width_change
from damagepred.plotting.pictures import save_fragility_picture, save_study_pictures, save_wall_pictures
from damagepred.plotting.study import draw_category_shares, draw_crack_widths
from damagepred.plotting.wall import draw_wall

__all__ = [
    "draw_category_shares",
    "draw_crack_widths",
    "draw_dpc_opening",
    "draw_fragility",
    "draw_history",
    "draw_opening_width_change",
    "draw_wall",
    "save_fragility_picture",
    "save_study_pictures",
    "save_wall_pictures",
]
