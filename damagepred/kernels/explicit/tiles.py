"""Memory layout of interfaces in the cycle: tiles of ``LANES`` interfaces, each field with one value per lane.

A tile is one record in one stretch of memory, so the compiler vectorises the law over its lanes. Names, units and signs
follow the model.
"""

import numpy as np

from damagepred.kernels.joint.parameters import JointParameters

LANES = 8
"""Interfaces in a tile: as many numbers as the widest registers hold."""
CACHE_LINE = 64
"""Bytes of a line of the processor's cache."""


def tile_type(points, elastic):
    """Record type of tiles whose interfaces have a number of contacts."""
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
            *((name, "f8", lane) for name in ("normal_x", "normal_y")),
            *((name, "f8", lane) for name in ("arm_normal_a", "arm_shear_a", "arm_normal_b", "arm_shear_b")),
            ("contact_offset", "f8", contact),
            ("contact_area", "f8", contact),
            *((name, "f8", lane) for name in JointParameters._fields),
            *((name, "f8", contact) for name in ("slip", "dilatant_opening", "cracked", "kappa")),
            *((name, "f8", lane) for name in ("drift_x", "drift_y", "turn_a", "turn_b")),
            *(of_strains if elastic else ()),
            ("on_a", "f8", (5 if elastic else 3, LANES)),
            ("on_b", "f8", (5 if elastic else 3, LANES)),
        ]
    )


def ground_type(points):
    """Record type of the ground movement under a tile, linear in the load factor."""
    return np.dtype([(name, "f8", (points, LANES)) for name in ("normal", "shear", "normal_start", "shear_start")])


def aligned_zeros(count, record):
    """Zeroed records aligned with the processor's cache lines: saves a tenth of the cycle's time."""
    memory = np.zeros(count * record.itemsize + CACHE_LINE, dtype=np.uint8)
    start = -memory.__array_interface__["data"][0] % CACHE_LINE
    return memory[start : start + count * record.itemsize].view(record)
