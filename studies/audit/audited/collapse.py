"""Proof of reported collapses by limit analysis of the archived state."""

from __future__ import annotations

import numpy as np

from audited.limit import Statics, out_of_reach
from audited.wall import CONTROL, CRACKED, SECTION, ArchivedWall

UNBROKEN = 1e4
"""Force in mean block weights that represents an unlimited strength."""


def pulls_on_a_support(held: ArchivedWall) -> bool:
    """Return whether a footing on jacks needs a downward reaction at one of its two supports.

    The footing lifts off a unilateral support then. The other support and jacks of equal loads carry the weight; this
    system is statically determinate, so no load of the jacks bends the footing farther.

    Parameters
    ----------
    held : ArchivedWall
        The same wall on bilateral supports, at the movement of the reported collapse.
    """
    if "support_load" not in held.ds or len(held["support_x"]) != 2 or not held.standing:
        return False
    return bool(held["support_load"][: held.standing].min() <= 0.0)


def must_collapse(wall: ArchivedWall) -> bool:
    """Return whether no forces keep the wall in equilibrium, with the broken bonds of the last increment.

    Joints have their full cohesion and tension at once, and dilate; so the analysis proves collapse. Soil and supports
    are taken as rigid: limit analysis does not depend on their stiffness.

    Parameters
    ----------
    wall : ArchivedWall
        The collapsed wall.
    """
    step = wall.steps - 1
    law, first = wall.law, np.unique(wall.interface, return_index=True)[1]
    kind, unit = wall["contact_kind"], wall.yardstick
    whole = (wall["contact_state"][step] != CRACKED) & (kind != CONTROL)

    def carried(intact: np.ndarray, left: np.ndarray) -> np.ndarray:
        each = np.minimum(np.where(whole, intact, left) * wall.contact_area, UNBROKEN * unit)
        return np.bincount(wall.interface, np.where(kind == SECTION, UNBROKEN * unit, each))

    some = np.bincount(wall.interface, whole) > 0
    jacks = []
    by_load = wall.scene["rig"]["control"] == "load"
    loads = wall.load(step)
    if "jack_load" in wall.ds and not by_load:
        jacks = [wall.jack_force(1.0)]
        loads = loads - wall.jack_force(float(wall["jack_load"][step]))
    return out_of_reach(
        Statics(
            wall.sides[0][first],
            wall.sides[1][first],
            wall.middle,
            wall.normal[first],
            np.bincount(wall.interface, wall["contact_length"]),
            carried(law.tensile_strength, law.residual_tensile_strength),
            np.minimum(
                np.bincount(wall.interface, np.minimum(law.compressive_strength, 1e12) * wall.contact_area),
                UNBROKEN * unit,
            ),
            carried(law.cohesion, law.residual_cohesion),
            np.where(some, np.maximum(law.friction, law.residual_friction)[first], law.residual_friction[first]),
            wall.centroid,
            wall.gyration,
            loads,
            np.ones((wall.n, 3), dtype=bool),
            np.moveaxis(np.array(jacks).reshape(-1, wall.n, 3), 0, -1),
            unit,
        )
    )
