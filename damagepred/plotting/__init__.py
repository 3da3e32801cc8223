"""Pictures: datasets in, axes and files out. The only part of the package that imports matplotlib."""

from damagepred.plotting import _matplotlib  # noqa: F401 - before all others
from damagepred.plotting.back_analysis import draw_back_analysis
from damagepred.plotting.comparison import draw_comparison
from damagepred.plotting.convergence import draw_convergence
from damagepred.plotting.cracks import draw_cracks
from damagepred.plotting.design_search import draw_design_search
from damagepred.plotting.dpc import draw_dpc_opening, draw_footing_opening
from damagepred.plotting.footing import (
    draw_footing,
    draw_footing_curvature,
    draw_footing_form,
    draw_footing_moment,
    draw_jack_load,
)
from damagepred.plotting.fragility import draw_fragility
from damagepred.plotting.fragility_surface import draw_fragility_surface
from damagepred.plotting.history import draw_history, draw_hysteresis, draw_load
from damagepred.plotting.openings import draw_opening_width_change
from damagepred.plotting.pictures import save_fragility_picture, save_study_pictures, save_wall_pictures
from damagepred.plotting.scales import draw_scales
from damagepred.plotting.sensitivity import draw_sensitivity
from damagepred.plotting.stress import draw_stress
from damagepred.plotting.study import draw_category_shares, draw_crack_widths
from damagepred.plotting.wall import draw_wall
from damagepred.plotting.zones import draw_zone_states

__all__ = [
    "draw_back_analysis",
    "draw_category_shares",
    "draw_comparison",
    "draw_convergence",
    "draw_crack_widths",
    "draw_cracks",
    "draw_design_search",
    "draw_dpc_opening",
    "draw_footing",
    "draw_footing_curvature",
    "draw_footing_form",
    "draw_footing_moment",
    "draw_footing_opening",
    "draw_fragility",
    "draw_fragility_surface",
    "draw_history",
    "draw_hysteresis",
    "draw_jack_load",
    "draw_load",
    "draw_opening_width_change",
    "draw_scales",
    "draw_sensitivity",
    "draw_stress",
    "draw_wall",
    "draw_zone_states",
    "save_fragility_picture",
    "save_study_pictures",
    "save_wall_pictures",
]
