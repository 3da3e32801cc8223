"""From openings to a category: one verdict for one state of one wall."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from damagepred.arrays import BoolArray, FloatArray
from damagepred.damage.crack_bands import BandGauges
from damagepred.damage.cracks import find_cracks, group_widths, psi
from damagepred.damage.joints import JointMap
from damagepred.damage.table import DamageTable, load_table, own_table

Widths = FloatArray | float

GROUP_COUNTS = (2, 3, 4, 5)
"""Numbers of cracks in a group whose width archives store, for other rules."""


class Verdict(NamedTuple):
    """Damage of a wall in one state. Openings are the widest along the whole joint, up to its ends."""

    damage_category: int  # by the cracks of the wall proper, above the dpc, with the measure of the rules
    damage_category_band: int  # by the width of the widest crack band instead of the widest crack
    # largest opening normal to a joint of the wall proper (m), the measure of damage tables here
    crack_width_max: float
    crack_band_width_max: float  # widest crack band (m), at least ``crack_width_max``; see ``crack_bands``
    crack_count: int  # separate cracks of the wall proper of ``table.counted_width`` or more
    crack_length_total: float  # of all cracks of the wall proper together (m)
    psi: float  # see ``damagepred.damage.cracks.psi``
    crack_group_width: tuple[float, ...]  # for ``GROUP_COUNTS`` (m), see ``damagepred.damage.cracks.group_widths``
    base_crack_width_max: float  # in the courses below the dpc (m)
    dpc_opening_max: float  # (m), 0 without a dpc
    dpc_separation_length: float  # length over which the dpc is open by more than the threshold (m)
    dpc_slip_max: float  # largest absolute slip (m)
    footing_opening_max: float  # gap along the bed between the first course and the footing or ground (m)
    footing_separation_length: float  # length over which this bed is open by more than the threshold (m)


class Rules(NamedTuple):
    """Rules from the openings of a wall to a category; see ``damagepred.scene.Damage``."""

    table: DamageTable  # limits, with any plasterboard allowance
    count_rule: bool  # whether groups of cracks count
    group_distance: float  # largest distance of cracks in a group (m)
    group_count: int
    dpc_threshold: float  # opening above which the dpc, or the bed on the footing, counts as separated (m)
    measure: str  # {"joint", "band"}
    band_gauge: float  # length of the gauge across a crack band, and smallest opening that it counts (m)
    band_threshold: float
    footing_threshold: float
    count_footing_gap: bool  # whether a gap along the bed on the footing is a crack of a wall without a dpc

    @classmethod
    def from_settings(
        cls, table: str, plasterboard: bool, state: Any = (), function: str | None = None, **others: Any
    ) -> Rules:
        """Rules with the plain values of ``damagepred.scene.Damage``."""
        own = own_table(state, function) if state else load_table(table, plasterboard=plasterboard)
        return cls(own, **others)

    def attributes(self) -> dict[str, dict[str, float]]:
        """Archived attributes of the variables that depend on the rules."""
        return {
            "dpc_separation_length": {"opening_threshold": self.dpc_threshold},
            "footing_separation_length": {"opening_threshold": self.footing_threshold},
            "crack_count": {"least_width": self.table.counted_width},
            "crack_group_width": {"group_distance": self.group_distance},
            "crack_band_width_max": {"gauge_length": self.band_gauge, "opening_threshold": self.band_threshold},
        }

    def widths(
        self, crack_width: Widths, band_width: Widths, footing_opening: Widths, has_dpc: bool
    ) -> tuple[Widths, Widths]:
        """Width that determines the category, by the widest crack and by the widest crack band (m)."""
        if not self.count_footing_gap or has_dpc:
            return crack_width, band_width
        return np.maximum(crack_width, footing_opening), np.maximum(band_width, footing_opening)


def judge(
    joints: JointMap, opening: FloatArray, slip: FloatArray, cracked: BoolArray, rules: Rules, distortion: float = 0.0
) -> Verdict:
    """Verdict on one state of a wall, from opening, slip (m) and broken bonds at the contacts (m, q)."""
    cracks = find_cracks(joints, opening, slip, cracked)
    groups = group_widths(cracks, rules.group_distance, (*GROUP_COUNTS, rules.group_count))
    widest = cracks.width[0] if len(cracks.width) else 0.0
    broken = np.flatnonzero(cracked)
    widths = joints.widest(opening)
    gap, interface = widths.ravel()[broken], broken // opening.shape[1]
    joint = float(gap[joints.is_wall[interface]].max(initial=0.0))
    band = max(joint, BandGauges.of_joints(joints, rules.band_gauge).width(opening, cracked, rules.band_threshold))
    footing = float(gap[joints.is_footing[interface]].max(initial=0.0))
    judged = rules.widths(widest, band, footing, bool(joints.is_dpc.any()))
    group = groups[-1] if rules.count_rule else 0.0
    by_joint, by_band = rules.table.by_width_and_group(np.array(judged), group).tolist()
    verdict = Verdict(
        damage_category=by_band if rules.measure == "band" else by_joint,
        damage_category_band=by_band,
        crack_width_max=joint,
        crack_band_width_max=band,
        crack_count=int((cracks.width >= rules.table.counted_width).sum()),
        crack_length_total=float(cracks.length.sum()),
        psi=psi(cracks),
        crack_group_width=groups[:-1],
        base_crack_width_max=float(gap[joints.is_base[interface]].max(initial=0.0)),
        dpc_opening_max=float(widths[joints.is_dpc].max(initial=0.0)),
        dpc_separation_length=joints.dpc_profile.open_length(opening, rules.dpc_threshold),
        dpc_slip_max=float(np.abs(slip[joints.is_dpc]).max(initial=0.0)),
        footing_opening_max=footing,
        footing_separation_length=joints.footing_profile.open_length(opening, rules.footing_threshold),
    )
    if not rules.table.measures:
        return verdict
    stored = {**verdict._asdict(), "opening_distortion": distortion}
    stored |= dict(zip(("crack_width_max", "crack_band_width_max"), judged))
    own = int(rules.table.by_measures(stored))
    return verdict._replace(damage_category=own, damage_category_band=own)
