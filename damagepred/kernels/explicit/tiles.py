"""How interfaces lie in memory while cycles run: in tiles of ``LANES`` interfaces, one value of each lane side by side.

All that belongs to a tile is one record, so one stretch of memory feeds the law, and the compiler, which knows where
in the record everything is, works on all lanes at once. Names, units and signs are those of the model.
"""

import numpy as np

from damagepred.kernels.joint.parameters import JointParameters

LANES = 8
"""Interfaces in a tile: as many numbers as the widest registers hold."""
CACHE_LINE = 64
"""Bytes of a line of the processor's cache."""


def tile_type(points, elastic):
    """Return the record type of tiles whose interfaces have that many contacts.

    Parameters
    ----------
    points : int
        Contacts of an interface, q.
    elastic : bool
        Whether blocks have a strain and a curvature.

    Returns
    -------
    dtype
        ``dof_a``, ``dof_b``: first degree of freedom of the two blocks. The fields of ``JointParameters``. ``slip``,
        ``dilatant_opening``, ``cracked``, ``kappa``: history variables of the contacts. ``drift_x`` to ``turn_b``: how
        the blocks moved, as gathered. ``on_a``, ``on_b``: force x, y (N) and moment (N m) on the blocks. With elastic
        blocks ``strain_dof_a`` and so on: where their strains stand, the curvature follows; ``strain_a``,
        ``curvature_a``: as gathered; ``rows_a``: opening for both, shear for both, rotation for the curvature; and the
        forces on both follow in ``on_a``.
    """
    lane, contact = (LANES,), (points, LANES)
    of_strains = [
        (f"{name}_{side}", kind, (5, LANES) if name == "rows" else lane)
        for side in "ab"
        for name, kind in (("strain_dof", "u8"), ("strain", "f8"), ("curvature", "f8"), ("rows", "f8"))
    ]
    return np.dtype(
        [
            ("dof_a", "u8", lane),
            ("dof_b", "u8", lane),
            ("normal_x", "f8", lane),
            ("normal_y", "f8", lane),
            ("arm_normal_a", "f8", lane),
            ("arm_shear_a", "f8", lane),
            ("arm_normal_b", "f8", lane),
            ("arm_shear_b", "f8", lane),
            ("contact_offset", "f8", contact),
            ("contact_area", "f8", contact),
            *((name, "f8", lane) for name in JointParameters._fields),
            ("slip", "f8", contact),
            ("dilatant_opening", "f8", contact),
            ("cracked", "f8", contact),
            ("kappa", "f8", contact),
            ("drift_x", "f8", lane),
            ("drift_y", "f8", lane),
            ("turn_a", "f8", lane),
            ("turn_b", "f8", lane),
            *(of_strains if elastic else ()),
            ("on_a", "f8", (5 if elastic else 3, LANES)),
            ("on_b", "f8", (5 if elastic else 3, LANES)),
        ]
    )


def ground_type(points):
    """Return the record type of the movement of the ground under a tile, a straight line in the load factor.

    Parameters
    ----------
    points : int
        Contacts of an interface, q.

    Returns
    -------
    dtype
        ``normal``, ``shear``: displacement per load factor (m); ``normal_start``, ``shear_start``: the line's
        displacement at load factor 0 (m), 0 where the ground moves in proportion to the load factor.
    """
    contact = (points, LANES)
    names = ("normal", "shear", "normal_start", "shear_start")
    return np.dtype([(name, "f8", contact) for name in names])


def aligned_zeros(count, record):
    """Zeroed records that begin at a line of the processor's cache: a tenth of the cycle's time.

    Parameters
    ----------
    count : int
        Number of records.
    record : dtype
        Their type.

    Returns
    -------
    array of record (count,)
        Zeros.
    """
    memory = np.zeros(count * record.itemsize + CACHE_LINE, dtype=np.uint8)
    start = -memory.ctypes.data % CACHE_LINE
    return memory[start : start + count * record.itemsize].view(record)
