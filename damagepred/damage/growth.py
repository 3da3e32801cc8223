"""Cracks through the increments of a path: each keeps its number as it grows, closes and opens again."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from damagepred.arrays import BoolArray, FloatArray
from damagepred.damage.cracks import HAIRLINE
from damagepred.damage.joints import JointMap
from damagepred.damage.tracing import Crack, Links, Pieces, trace

PARTS = ("wall", "below_dpc", "dpc_opening", "dpc_slip")
"""Parts that cracks are assigned to: the wall proper, the courses below the dpc, the dpc where it is open, and where it
is closed and has slipped."""
WALL, BELOW_DPC, DPC_OPENING, DPC_SLIP = range(4)


class Numbered(NamedTuple):
    """A crack with its number.

    Attributes
    ----------
    number : int
        From 1, older cracks first, of one age the widest first.
    part : int
        Index into ``PARTS``.
    crack : Crack
        As it is now.
    first_increment, first_piece : int
        When and where its first bond broke, or it first slid.
    """

    number: int
    part: int
    crack: Crack
    first_increment: int
    first_piece: int


class Growth:
    """Follows the cracks of one wall, increment by increment.

    Parameters
    ----------
    joints : JointMap
        The wall's joints.
    hairline : float
        Opening or slip (m) from which a piece of joint is part of a crack.

    Attributes
    ----------
    merged : dict of int to int
        Cracks that have become part of an older one, and its number.
    """

    def __init__(self, joints: JointMap, hairline: float = HAIRLINE) -> None:
        self.pieces, self.hairline = Pieces(joints), hairline
        q = joints.contact_x.shape[1]
        wall, below, dpc = (np.repeat(own, q) for own in (joints.is_wall, joints.is_base, joints.is_dpc))
        self._own = (wall, below, dpc, dpc)
        count = joints.contact_x.size
        self._number = [np.zeros(count, dtype=np.int64) for _ in PARTS]  # 0: never part of a crack
        self._first = np.full(count, -1, dtype=np.int64)
        self._first_gap = np.zeros(count)
        self._next = 1
        self.merged: dict[int, int] = {}

    def step(
        self, increment: int, opening: FloatArray, slip: FloatArray, cracked: BoolArray, links: Links | None = None
    ) -> list[Numbered]:
        """Return the cracks of the next increment, by number.

        Parameters
        ----------
        increment : int
            Its position on the path.
        opening, slip : array (m, q) or (p,)
            Opening normal to and slip along the joints (m).
        cracked : array of bool (m, q) or (p,)
            Whether the bond is broken.
        links : Links, optional
            What joins cracks through bricks.
        """
        joints = self.pieces.joints
        opening = joints.widest(np.reshape(opening, joints.contact_x.shape)).ravel()
        slip, cracked = np.ravel(slip), np.ravel(cracked)
        is_open = opening > self.hairline
        slid = np.abs(slip) > self.hairline
        self._begin(increment, opening, cracked | slid | (is_open & self._own[DPC_OPENING]))
        joint = (is_open & cracked) | slid
        members = (joint, joint, is_open, slid & ~is_open)
        found = []
        for part, (own, member) in enumerate(zip(self._own, members)):
            through = links if links is not None and part in (WALL, BELOW_DPC) else Links.none()
            cracks = trace(self.pieces, opening, slip, own & member, through)
            found += [Numbered(n, part, c, *self._origin(c)) for n, c in self._numbered(part, cracks)]
        return sorted(found, key=lambda one: one.number)

    def _begin(self, increment: int, opening: FloatArray, broken: BoolArray) -> None:
        new = broken & (self._first < 0)
        self._first[new] = increment
        self._first_gap[new] = opening[new]

    def _origin(self, crack: Crack) -> tuple[int, int]:
        """Return the increment and the piece in which a crack began; of several the one that was widest then."""
        first = self._first[crack.pieces]
        known = np.flatnonzero(first == first.min())
        piece = crack.pieces[known[np.argmax(self._first_gap[crack.pieces[known]])]]
        return int(first.min()), int(piece)

    def _numbered(self, part: int, cracks: list[Crack]) -> list[tuple[int, Crack]]:
        """Give each crack the oldest number that its pieces bear; the longest first, where two bear the same."""
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
