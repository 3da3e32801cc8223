"""Enumerations whose values or names archives hold: kinds and states of contacts and zones, status, failures."""

from __future__ import annotations

from enum import IntEnum, StrEnum

SYNONYMS = {
    **{"sagging": "dishing", "hogging": "doming", "edge heave": "dishing", "centre heave": "doming"},
    **{"settles": "settle", "heaves": "heave"},
}
"""Kinds of movement by other words of the field."""
LOCAL = {
    "tree": "ground movement at the tree",
    "pipe": "ground movement at the pipe",
    "tunnel": "ground movement over the tunnel",
    "corner": "settlement of the corner",
    **dict.fromkeys(("table", "tilt", "levels"), "largest ground movement"),
}
"""Shapes with a local movement of the ground, with the name of their ``surface_movement``."""


class ContactKind(IntEnum):
    """What an interface of two blocks is."""

    BED_JOINT = 0
    HEAD_JOINT = 1
    DPC = 2
    FOOTING_INTERFACE = 3
    SOIL = 4
    SUPPORT = 5
    FOOTING_SECTION = 6
    CONTROL_JOINT = 7
    BRICK_JOINT = 8
    """Potential crack in the middle of a brick."""


MASONRY = (ContactKind.BED_JOINT, ContactKind.HEAD_JOINT, ContactKind.BRICK_JOINT)
"""Kinds of interface whose openings are cracks of the wall."""


class ContactState(IntEnum):
    """State of a contact at an increment."""

    INTACT = 0
    CRACKED = 1
    SLIPPING = 2


class ZoneState(IntEnum):
    """State of a zone at an increment; the return mapping of the zone law returns the first four."""

    ELASTIC = 0
    SHEAR = 1
    TENSION = 2
    SHEAR_AND_TENSION = 3
    YIELDED = 4
    """Elastic now, but it has yielded before."""


class SampleStatus(IntEnum):
    """How a sample of a study ended."""

    COMPLETE = 0
    COLLAPSED = 1
    FAILED = 2
    MISSING = 3


SOLVED = (SampleStatus.COMPLETE, SampleStatus.COLLAPSED)  # status of samples that were solved as far as was asked
UNSOLVED = (SampleStatus.FAILED, SampleStatus.MISSING)  # status of the others


class PathStatus(StrEnum):
    """How the path of one wall ended."""

    COMPLETE = "complete"
    COLLAPSED = "collapsed"
    FAILED = "failed"
    INTERRUPTED = "interrupted"


class FailureKind(StrEnum):
    """Why a sample failed."""

    DIVERGED = "diverged"
    NOT_CONVERGED = "not_converged"
    BAD_INPUT = "bad_input"
    TIMEOUT = "timeout"
    WORKER_DIED = "worker_died"
    ERROR = "error"
    UNKNOWN = "unknown"
    """Its record is damaged."""


def flag_meanings(flags: type[IntEnum]) -> tuple[str, ...]:
    """Return the names of an enumeration's values 0, 1, ... as archives spell them."""
    return tuple(flag.name.lower() for flag in flags)
