"""From openings to cracks to categories of damage. Independent of the solvers, so archives can be judged again."""

from damagepred.damage.cracks import HAIRLINE
from damagepred.damage.deep_beam import BeamStrain, beam_strain, deflection_over_strain
from damagepred.damage.judge import GROUP_COUNTS
from damagepred.damage.limits import (
    MovementLimit,
    StrainTable,
    construction_limits,
    deviation_limits,
    load_movement_limits,
    load_strain_table,
    sticking_limits,
)
from damagepred.damage.table import DamageTable, load_table, read_table

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
