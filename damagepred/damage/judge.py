"""From openings to a category: one verdict for one state of one wall."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from damagepred.arrays import BoolArray, FloatArray
from damagepred.damage.cracks import find_cracks, group_widths, psi
from damagepred.damage.joints import JointMap
from damagepred.damage.table import DamageTable, load_table

Widths = FloatArray | float

GROUP_COUNTS = (2, 3, 4, 5)
"""Numbers of cracks in a group whose width archives store, for other rules."""


class Verdict(NamedTuple):
    """Damage of a wall in one state. Openings are the widest along the whole of a joint, up to its ends.

    Attributes
    ----------
    damage_category : int
        By the cracks of the wall proper, above the dpc, with the measure of the rules.
    damage_category_band : int
        By the width of the widest crack band instead of the widest joint.
    crack_width_max : float
        Widest crack of the wall proper (m): the largest opening normal to its joint, the measure of damage tables here.
        Cracks as objects (``damagepred.cracks``) have more measures.
    crack_band_width_max : float
        Widest crack band of the wall proper (m): openings of neighbouring joints summed, see
        ``damagepred.damage.bands``; at least ``crack_width_max``.
    crack_count : int
        Separate cracks of the wall proper at least as wide as category 1 starts.
    psi : float
        Damage parameter of all cracks of the wall proper, see ``damagepred.damage.cracks.psi``.
    crack_group_width : tuple of float
        Width (m) of the narrowest crack in the widest group of 2, 3, 4, 5 cracks of the wall proper, 0 without such a
        group; see ``damagepred.damage.cracks.group_widths`` and ``GROUP_COUNTS``.
    base_crack_width_max : float
        Widest crack in the courses below the dpc (m).
    dpc_opening_max : float
        Widest opening of the dpc (m), 0 without a dpc.
    dpc_separation_length : float
        Length over which the dpc is open by more than the threshold (m).
    dpc_slip_max : float
        Largest absolute slip of the dpc (m), 0 without a dpc.
    footing_opening_max : float
        Widest gap along the bed between the first course and the footing or ground (m).
    footing_separation_length : float
        Length over which this bed is open by more than the threshold (m).
    """

    damage_category: int
    damage_category_band: int
    crack_width_max: float
    crack_band_width_max: float
    crack_count: int
    psi: float
    crack_group_width: tuple[float, ...]
    base_crack_width_max: float
    dpc_opening_max: float
    dpc_separation_length: float
    dpc_slip_max: float
    footing_opening_max: float
    footing_separation_length: float


class Rules(NamedTuple):
    """Rules from the openings of a wall to a category; see ``damagepred.scene.Damage``.

    Attributes
    ----------
    table : DamageTable
        Limits, with any plasterboard allowance.
    count_rule : bool
        Whether groups of cracks count.
    group_distance : float
        Largest distance of cracks in a group (m).
    group_count : int
        Number of cracks in a group.
    dpc_threshold, footing_threshold : float
        Opening above which the dpc, or the bed on the footing, counts as separated (m).
    measure : {"joint", "band"}
        Whether the widest joint or the widest crack band determines the category.
    band_gauge, band_threshold : float
        Length of the gauge across a crack band, and the smallest opening that it counts (m).
    count_footing_gap : bool
        Whether a gap along the bed on the footing counts as a crack of a wall without a dpc.
    """

    table: DamageTable
    count_rule: bool
    group_distance: float
    group_count: int
    dpc_threshold: float
    measure: str
    band_gauge: float
    band_threshold: float
    footing_threshold: float
    count_footing_gap: bool

    @classmethod
    def from_settings(cls, table: str, plasterboard: bool, **others: Any) -> Rules:
        """Rules with the plain values of ``damagepred.scene.Damage``.

        Parameters
        ----------
        table : str
            Name of a shipped damage table.
        plasterboard : bool
            Whether its limits are raised for plasterboard.
        **others
            All other rules.
        """
        return cls(load_table(table, plasterboard=plasterboard), **others)

    def attributes(self) -> dict[str, dict[str, float]]:
        """Archived attributes of the variables that depend on the rules."""
        return {
            "dpc_separation_length": {"opening_threshold": self.dpc_threshold},
            "footing_separation_length": {"opening_threshold": self.footing_threshold},
            "crack_group_width": {"group_distance": self.group_distance},
            "crack_band_width_max": {"gauge_length": self.band_gauge, "opening_threshold": self.band_threshold},
        }

    def widths(
        self, crack_width: Widths, band_width: Widths, footing_opening: Widths, has_dpc: bool
    ) -> tuple[Widths, Widths]:
        """Width that determines the category, by the widest joint and by the widest crack band (m).

        Parameters
        ----------
        crack_width, band_width, footing_opening : array or float
            Widest joint, widest crack band, and widest gap along the footing bed (m).
        has_dpc : bool
            Whether the wall has a dpc: then the footing bed is outside the wall proper, and its gap never counts.
        """
        if not self.count_footing_gap or has_dpc:
            return crack_width, band_width
        return np.maximum(crack_width, footing_opening), np.maximum(band_width, footing_opening)


def judge(
    joints: JointMap,
    opening: FloatArray,
    slip: FloatArray,
    cracked: BoolArray,
    rules: Rules,
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
    rules : Rules
        Table and rules.
    """
    cracks = find_cracks(joints, opening, slip, cracked)
    groups = group_widths(cracks, rules.group_distance, (*GROUP_COUNTS, rules.group_count))
    widest = cracks.width[0] if len(cracks.width) else 0.0
    broken = np.flatnonzero(cracked)
    widths = joints.widest(opening)
    gap, interface = widths.ravel()[broken], broken // opening.shape[1]
    joint = float(gap[joints.is_wall[interface]].max(initial=0.0))
    band = max(joint, joints.band_gauges(rules.band_gauge).width(opening, cracked, rules.band_threshold))
    footing = float(gap[joints.is_footing[interface]].max(initial=0.0))
    judged = rules.widths(widest, band, footing, bool(joints.dpc.size))
    group = groups[-1] if rules.count_rule else 0.0
    by_joint, by_band = rules.table.by_width_and_group(np.array(judged), group).tolist()
    return Verdict(
        damage_category=by_band if rules.measure == "band" else by_joint,
        damage_category_band=by_band,
        crack_width_max=joint,
        crack_band_width_max=band,
        crack_count=int((cracks.width >= rules.table.limits[0]).sum()),
        psi=psi(cracks),
        crack_group_width=groups[:-1],
        base_crack_width_max=float(gap[joints.is_base[interface]].max(initial=0.0)),
        dpc_opening_max=float(widths[joints.dpc].max(initial=0.0)),
        dpc_separation_length=joints.dpc_profile.open_length(opening, rules.dpc_threshold),
        dpc_slip_max=float(np.abs(slip[joints.dpc]).max(initial=0.0)),
        footing_opening_max=footing,
        footing_separation_length=joints.footing_profile.open_length(opening, rules.footing_threshold),
    )
