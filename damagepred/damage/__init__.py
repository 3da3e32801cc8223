"""From openings to cracks to categories of damage. Independent of the solvers, so archives can be judged again."""

from damagepred.damage.bands import BandGauges
from damagepred.damage.cracks import HAIRLINE, Cracks, find_cracks, group_widths
from damagepred.damage.deep_beam import BeamStrain, beam_strain, deflection_over_strain
from damagepred.damage.deviation import Deviation, SightLines, deviation_limits
from damagepred.damage.distortion import Distortion, Frames, sticking_limits
from damagepred.damage.growth import Growth, Numbered
from damagepred.damage.joints import JointMap
from damagepred.damage.judge import GROUP_COUNTS, Rules, Verdict, judge
from damagepred.damage.limits import (
    MovementLimit,
    StrainTable,
    construction_limits,
    load_movement_limits,
    load_strain_table,
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
    "Rules",
    "SightLines",
    "StrainTable",
    "Verdict",
    "beam_strain",
    "construction_limits",
    "deflection_over_strain",
    "deviation_limits",
    "find_cracks",
    "group_widths",
    "judge",
    "load_movement_limits",
    "load_strain_table",
    "load_table",
    "read_table",
    "sticking_limits",
]
