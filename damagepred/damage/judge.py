"""From openings to a category: one verdict for one state of one wall."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from damagepred.arrays import BoolArray, FloatArray
from damagepred.damage.cracks import Cracks, find_cracks, group_widths
from damagepred.damage.joints import JointMap
from damagepred.damage.table import DamageTable, load_table
from damagepred.scene import Damage

Widths = FloatArray | float

GROUP_COUNTS = (2, 3, 4, 5)
"""Numbers of cracks of which archives keep how wide a group they make, so that they can be judged by other rules."""


class Verdict(NamedTuple):
    """What is wrong with a wall. Openings are the widest along the whole of a joint, up to its ends.

    Attributes
    ----------
    damage_category : int
        From the cracks of the wall proper, above the dpc, by the measure and the rules of the settings.
    damage_category_band : int
        The same with the width of the widest crack band in place of the widest joint.
    crack_width_max : float
        Widest crack of the wall proper (m): the largest opening normal to its joint, which is how damage tables are
        read here; cracks as objects (``damagepred.cracks``) have other measures besides.
    crack_band_width_max : float
        Widest crack band of the wall proper (m): openings of neighbouring joints summed, see
        ``damagepred.damage.bands``; at least ``crack_width_max``.
    crack_count : int
        Separate cracks of the wall proper at least as wide as category 1 starts.
    crack_group_width : tuple of float
        Largest width (m) of which at least 2, 3, 4, 5 cracks of the wall proper lie in one group, 0 if there are not so
        many; see ``damagepred.damage.cracks.group_widths`` and ``GROUP_COUNTS``.
    base_crack_width_max : float
        Widest crack in the courses below the dpc (m).
    dpc_opening_max : float
        Widest opening of the dpc (m), 0 without a dpc.
    dpc_separation_length : float
        Length over which the dpc is open by more than the threshold (m).
    dpc_slip_max : float
        Largest slip of the dpc, either way (m), 0 without a dpc.
    footing_opening_max : float
        Widest gap along the bed between the first course and the footing, or what the wall stands on (m).
    footing_separation_length : float
        Length over which that bed is open by more than the threshold (m).
    """

    damage_category: int
    damage_category_band: int
    crack_width_max: float
    crack_band_width_max: float
    crack_count: int
    crack_group_width: tuple[float, ...]
    base_crack_width_max: float
    dpc_opening_max: float
    dpc_separation_length: float
    dpc_slip_max: float
    footing_opening_max: float
    footing_separation_length: float


def kept_rules(settings: Damage) -> dict[str, dict[str, float]]:
    """Return what of the rules is an attribute of a variable that was found by them."""
    return {
        "dpc_separation_length": {"opening_threshold": settings.dpc_threshold},
        "footing_separation_length": {"opening_threshold": settings.footing_threshold},
        "crack_group_width": {"group_distance": settings.group_distance},
        "crack_band_width_max": {
            "gauge_length": settings.band_gauge,
            "opening_threshold": settings.band_threshold,
        },
    }


def damage_table(settings: Damage) -> DamageTable:
    """Return the table that the settings ask for, with the plasterboard allowance if they do."""
    table = load_table(settings.table)
    return table.with_plasterboard() if settings.plasterboard else table


def widest_gap(
    crack_width: Widths, band_width: Widths, footing_opening: Widths, settings: Damage, has_dpc: bool
) -> tuple[Widths, Widths]:
    """Return the width that makes the category, by the widest joint and by the widest crack band (m).

    Parameters
    ----------
    crack_width, band_width, footing_opening : array or float
        Widest joint, widest crack band, and widest gap along the footing bed (m).
    settings : Damage
        Whether the gap counts.
    has_dpc : bool
        Whether the wall has a dpc: then the footing bed is no part of the wall proper, and its gap never counts.
    """
    if not settings.count_footing_gap or has_dpc:
        return crack_width, band_width
    return np.maximum(crack_width, footing_opening), np.maximum(band_width, footing_opening)


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
    widest, group = cracks.width.max(initial=0.0), 0.0
    if settings.count_rule:
        group = group_widths(cracks, settings.group_distance, (settings.group_count,))[0]
    return int(table.by_width_and_group(widest, group))


def judge(
    joints: JointMap,
    opening: FloatArray,
    slip: FloatArray,
    cracked: BoolArray,
    settings: Damage,
    table: DamageTable | None = None,
) -> Verdict:
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
    table : DamageTable, optional
        In place of that of the settings.
    """
    table = damage_table(settings) if table is None else table
    cracks = find_cracks(joints, opening, slip, cracked)
    groups = group_widths(cracks, settings.group_distance, (*GROUP_COUNTS, settings.group_count))
    widest = cracks.width[0] if len(cracks.width) else 0.0
    broken = np.flatnonzero(cracked)
    widths = joints.widest(opening)
    gap, interface = widths.ravel()[broken], broken // opening.shape[1]
    joint = float(gap[joints.is_wall[interface]].max(initial=0.0))
    band = max(joint, joints.band_gauges(settings.band_gauge).width(opening, cracked, settings.band_threshold))
    footing = float(gap[joints.is_footing[interface]].max(initial=0.0))
    by_joint, by_band = (
        int(table.by_width_and_group(width, groups[-1] if settings.count_rule else 0.0))
        for width in widest_gap(widest, band, footing, settings, bool(joints.dpc.size))
    )
    return Verdict(
        damage_category=by_band if settings.measure == "band" else by_joint,
        damage_category_band=by_band,
        crack_width_max=joint,
        crack_band_width_max=band,
        crack_count=int((cracks.width >= table.limits[0]).sum()),
        crack_group_width=groups[:-1],
        base_crack_width_max=float(gap[joints.is_base[interface]].max(initial=0.0)),
        dpc_opening_max=float(widths[joints.dpc].max(initial=0.0)),
        dpc_separation_length=joints.dpc_open_length(opening, settings.dpc_threshold),
        dpc_slip_max=float(np.abs(slip[joints.dpc]).max(initial=0.0)),
        footing_opening_max=footing,
        footing_separation_length=joints.footing_open_length(opening, settings.footing_threshold),
    )
