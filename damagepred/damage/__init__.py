"""From openings to cracks to categories of damage. Needs no solver, so archives can be judged again."""

from damagepred.damage.cracks import Cracks, find_cracks, largest_group
from damagepred.damage.joints import JointMap
from damagepred.damage.judge import Verdict, category_of, damage_table, judge
from damagepred.damage.table import DamageTable, load_table

__all__ = [
    "Cracks",
    "DamageTable",
    "JointMap",
    "Verdict",
    "category_of",
    "damage_table",
    "find_cracks",
    "judge",
    "largest_group",
    "load_table",
]
