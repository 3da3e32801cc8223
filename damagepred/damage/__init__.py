"""From openings to cracks to categories of damage. Independent of the solvers, so archives can be judged again."""

from damagepred.damage.crack_bands import BandGauges as BandGauges
from damagepred.damage.cracks import HAIRLINE
from damagepred.damage.cracks import Cracks as Cracks
from damagepred.damage.cracks import find_cracks as find_cracks
from damagepred.damage.cracks import group_widths as group_widths
from damagepred.damage.deep_beam import BeamStrain, beam_strain, deflection_over_strain
from damagepred.damage.deviation import Deviation as Deviation
from damagepred.damage.deviation import Distortion as Distortion
from damagepred.damage.deviation import Frames as Frames
from damagepred.damage.deviation import SightLines as SightLines
from damagepred.damage.deviation import largest_distortion as largest_distortion
from damagepred.damage.joints import JointMap as JointMap
from damagepred.damage.judge import GROUP_COUNTS
from damagepred.damage.judge import Rules as Rules
from damagepred.damage.judge import Verdict as Verdict
from damagepred.damage.judge import judge as judge
from damagepred.damage.limits import (
    MovementLimit,
    StrainTable,
    construction_limits,
    deviation_limits,
    load_movement_limits,
    load_strain_table,
    sticking_limits,
)
from damagepred.damage.table import OWN_MEASURES as OWN_MEASURES
from damagepred.damage.table import STATE_TAKES as STATE_TAKES
from damagepred.damage.table import DamageTable, load_table, read_table
from damagepred.damage.table import own_table as own_table
from damagepred.damage.table import share_of_limit as share_of_limit
from damagepred.damage.tracing import Growth as Growth
from damagepred.damage.tracing import Numbered as Numbered

__all__ = [
    "GROUP_COUNTS",
    "HAIRLINE",
    "BeamStrain",
    "DamageTable",
    "MovementLimit",
    "StrainTable",
    "beam_strain",
    "construction_limits",
    "deflection_over_strain",
    "deviation_limits",
    "load_movement_limits",
    "load_strain_table",
    "load_table",
    "read_table",
    "sticking_limits",
]
