"""Cracks along the increments of a path: each keeps its number as it grows, closes and opens again."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from damagepred.arrays import BoolArray, FloatArray
from damagepred.damage.cracks import HAIRLINE
from damagepred.damage.joints import JointMap
from damagepred.damage.tracing import Crack, Links, Pieces, trace

PARTS = ("wall", "below_dpc", "dpc_opening", "dpc_slip")
"""Parts of the wall with their own cracks: the wall proper, the courses below the dpc, the open dpc, the closed dpc
that has slipped."""
WALL, BELOW_DPC, DPC_OPENING, DPC_SLIP = range(4)


class Numbered(NamedTuple):
    """Crack with its number."""

    number: int  # from 1, older cracks first, then wider cracks
    part: int  # index into ``PARTS``
    crack: Crack  # present state
    first_increment: int  # increment and piece of its first broken bond or first slip
    first_piece: int


class Growth:
    """Cracks of one wall along its increments; ``merged``: cracks that have joined an older one -> its number."""

    def __init__(self, joints: JointMap, hairline: float = HAIRLINE) -> None:
        self.pieces, self.hairline = Pieces(joints), hairline
        q = joints.contact_x.shape[1]
        wall, below, dpc = (np.repeat(members, q) for members in (joints.is_wall, joints.is_base, joints.is_dpc))
        self._in_part = (wall, below, dpc, dpc)
        count = joints.contact_x.size
        self._number = [np.zeros(count, dtype=np.int64) for _ in PARTS]  # 0: never part of a crack
        self._first = np.full(count, -1, dtype=np.int64)
        self._first_gap = np.zeros(count)
        self._next = 1
        self.merged: dict[int, int] = {}

    def step(
        self, increment: int, opening: FloatArray, slip: FloatArray, cracked: BoolArray, links: Links | None = None
    ) -> list[Numbered]:
        """Cracks of the next increment, by number, from opening, slip (m) and broken bonds at the contacts."""
        joints = self.pieces.joints
        opening = joints.widest(np.reshape(opening, joints.contact_x.shape)).ravel()
        slip, cracked = np.ravel(slip), np.ravel(cracked)
        is_open = opening > self.hairline
        slid = np.abs(slip) > self.hairline
        self._begin(increment, opening, cracked | slid | (is_open & self._in_part[DPC_OPENING]))
        joint = (is_open & cracked) | slid
        members = (joint, joint, is_open, slid & ~is_open)
        numbered = []
        for part, (in_part, member) in enumerate(zip(self._in_part, members)):
            through = links if links is not None and part in (WALL, BELOW_DPC) else Links.none()
            cracks = trace(self.pieces, opening, slip, in_part & member, through)
            numbered += [Numbered(n, part, c, *self._origin(c)) for n, c in self._numbered(part, cracks)]
        return sorted(numbered, key=lambda crack: crack.number)

    def _begin(self, increment: int, opening: FloatArray, broken: BoolArray) -> None:
        new = broken & (self._first < 0)
        self._first[new] = increment
        self._first_gap[new] = opening[new]

    def _origin(self, crack: Crack) -> tuple[int, int]:
        """Increment and piece in which a crack began; of several pieces the widest one then."""
        first = self._first[crack.pieces]
        oldest = np.flatnonzero(first == first.min())
        piece = crack.pieces[oldest[np.argmax(self._first_gap[crack.pieces[oldest]])]]
        return int(first.min()), int(piece)

    def _numbered(self, part: int, cracks: list[Crack]) -> list[tuple[int, Crack]]:
        """Give each crack the oldest number of its pieces; of two with the same number, the longest keeps it."""
        bears = self._number[part]
        taken: dict[int, int] = {}
        claims = [np.unique(bears[crack.pieces]) for crack in cracks]
        for which in sorted(range(len(cracks)), key=lambda i: -cracks[i].length):
            free = [int(n) for n in claims[which] if n > 0 and n not in taken]
            if free:
                taken[free[0]] = which
        given = {which: number for number, which in taken.items()}
        for which, crack in enumerate(cracks):
            if which not in given:
                given[which], self._next = self._next, self._next + 1
            for other in claims[which]:
                if 0 < other != given[which] and int(other) not in taken:
                    self.merged[int(other)] = given[which]
            bears[crack.pieces] = given[which]
        for number in taken:
            self.merged.pop(number, None)
        return [(given[which], crack) for which, crack in enumerate(cracks)]
