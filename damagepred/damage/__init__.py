"""From openings to cracks to categories of damage. Needs no solver, so archives can be judged again."""

from damagepred.damage.bands import BandGauges
from damagepred.damage.cracks import HAIRLINE, Cracks, find_cracks, group_widths, largest_group
from damagepred.damage.deep_beam import BeamStrain, beam_strain, deflection_over_strain
from damagepred.damage.deviation import Deviation, SightLines, deviation_limits
from damagepred.damage.distortion import Distortion, Frames, sticking_limits
from damagepred.damage.growth import Growth, Numbered
from damagepred.damage.joints import JointMap
from damagepred.damage.judge import GROUP_COUNTS, Verdict, category_of, damage_table, judge, kept_rules, widest_gap
from damagepred.damage.limits import (
    MovementLimit,
    StrainTable,
    construction_limits,
    load_movement_limits,
    load_strain_table,
)
from damagepred.damage.simple import (
    SimpleVerdict,
    angular_distortion,
    simple_categories,
    simple_category,
    simple_methods,
)
from damagepred.damage.table import DamageTable, load_table, read_table

__all__ = [
    "GROUP_COUNTS",
    "HAIRLINE",
    "BandGauges",
    "BeamStrain",
    "Cracks",
    "DamageTable",
    "Deviation",
    "Distortion",
    "Frames",
    "Growth",
    "JointMap",
    "MovementLimit",
    "Numbered",
    "SightLines",
    "SimpleVerdict",
    "StrainTable",
    "Verdict",
    "angular_distortion",
    "beam_strain",
    "category_of",
    "construction_limits",
    "damage_table",
    "deflection_over_strain",
    "deviation_limits",
    "find_cracks",
    "group_widths",
    "judge",
    "kept_rules",
    "largest_group",
    "load_movement_limits",
    "load_strain_table",
    "load_table",
    "read_table",
    "simple_categories",
    "simple_category",
    "simple_methods",
    "sticking_limits",
    "widest_gap",
]
