"""From openings to a category: one verdict for one state of one wall."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from damagepred.damage.cracks import Cracks, find_cracks, largest_group
from damagepred.damage.joints import JointMap
from damagepred.damage.table import DamageTable, load_table
from damagepred.scene import Damage

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


class Verdict(NamedTuple):
    """What is wrong with a wall.

    Attributes
    ----------
    damage_category : int
        From the cracks of the wall proper, above the dpc.
    crack_width_max : float
        Widest crack of the wall proper (m).
    crack_count : int
        Separate cracks of the wall proper at least as wide as category 1 starts.
    base_crack_width_max : float
        Widest crack in the courses below the dpc (m).
    dpc_opening_max : float
        Widest opening of the dpc (m), 0 without a dpc.
    dpc_separation_length : float
        Length over which the dpc is open by more than the threshold (m).
    """

    damage_category: int
    crack_width_max: float
    crack_count: int
    base_crack_width_max: float
    dpc_opening_max: float
    dpc_separation_length: float


def damage_table(settings: Damage) -> DamageTable:
    """Return the table that the settings ask for, with the plasterboard allowance if they do."""
    table = load_table(settings.table)
    return table.with_plasterboard() if settings.plasterboard else table


def category_of(cracks: Cracks, table: DamageTable, settings: Damage) -> int:
    """Return the category of a wall with these cracks: by the widest, and by groups of wide ones.

    Parameters
    ----------
    cracks : Cracks
        Of the wall proper.
    table : DamageTable
        Limits.
    settings : Damage
        Whether and how groups count.
    """
    category = int(table.by_width(cracks.width.max(initial=0.0)))
    if settings.count_rule and category < table.group_category:
        group = largest_group(cracks, table.group_width, settings.group_distance)
        if group >= settings.group_count:
            return table.group_category
    return category


def judge(joints: JointMap, opening: FloatArray, slip: FloatArray, cracked: BoolArray, settings: Damage) -> Verdict:
    """Judge one state of a wall.

    Parameters
    ----------
    joints : JointMap
        m interfaces with q contacts each.
    opening, slip : array (m, q)
        Opening normal to (positive) and slip along each joint (m).
    cracked : array of bool (m, q)
        Whether the bond is broken.
    settings : Damage
        Table and rules.
    """
    table = damage_table(settings)
    cracks = find_cracks(joints, opening, slip, cracked)
    gap = np.where(cracked, np.maximum(opening, 0.0), 0.0)
    dpc_gap = np.maximum(opening[joints.is_dpc], 0.0)
    return Verdict(
        damage_category=category_of(cracks, table, settings),
        crack_width_max=float(gap[joints.is_wall].max(initial=0.0)),
        crack_count=int((cracks.width >= table.limits[0]).sum()),
        base_crack_width_max=float(gap[joints.is_base].max(initial=0.0)),
        dpc_opening_max=float(dpc_gap.max(initial=0.0)),
        dpc_separation_length=float(joints.contact_length[joints.is_dpc][dpc_gap > settings.dpc_threshold].sum()),
    )
