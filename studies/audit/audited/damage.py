"""Independent verdict from openings and states, by the tables of AS 2870 and BRE Digest 251 in ``data/damage``."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from audited.tolerances import Tolerances
from audited.wall import BED, CONTROL, CRACKED, DPC, FOOTING, HEAD, ArchivedWall
from damagepred.arrays import BoolArray, FloatArray, IntArray

if TYPE_CHECKING:
    from audited.checks import Violation


DATA = Path(__file__).resolve().parents[3] / "data" / "damage"
HAIRLINE = 0.05e-3
"""Opening or slip (m) from which a joint is part of a crack, as the guide states it."""


@cache
def table(name: str) -> dict[str, Any]:
    """Return a damage table."""
    return tomllib.loads((DATA / f"{name}.toml").read_text(encoding="utf-8"))


def category(width: float, group: float, rules: dict[str, Any]) -> int:
    """Return the category of a wall by its widest crack and its widest group of cracks (m)."""
    found = table(rules["table"])
    factor = found["plasterboard"]["factor"] if rules["plasterboard"] else 1.0
    hair = 1.0 - 1e-12
    by_width = max(c["number"] for c in found["category"] if width >= factor * c["from"] * hair)
    wide = rules["count_rule"] and group >= factor * found["group"]["crack_width"] * hair
    return max(int(by_width), int(found["group"]["category"]) if wide else 0)


def highest(rules: dict[str, Any]) -> int:
    """Return the highest category of a table: that of a wall which collapses."""
    return max(int(c["number"]) for c in table(rules["table"])["category"])


class Parts:
    """Interfaces of the wall proper, and their neighbours.

    Parameters
    ----------
    wall : ArchivedWall
        The wall.
    """

    def __init__(self, wall: ArchivedWall) -> None:
        first = np.unique(wall.interface, return_index=True)[1]
        kind, level = wall["contact_kind"][first], wall.middle[:, 1]
        self.dpc = kind == DPC
        mortar = (kind == BED) | (kind == HEAD)
        base = level <= level[self.dpc].max() if self.dpc.any() else np.zeros(len(kind), dtype=bool)
        self.proper, self.base = mortar & ~base, mortar & base
        self.ends = wall.ends
        self.gaps = self.ends[kind == CONTROL].reshape(-1, 2)
        self.near = 1e-6 * float(np.ptp(self.ends.reshape(-1, 2), axis=0).max())
        self.gauges = Gauges(wall, self.proper, float(wall.scene["damage"]["band_gauge"]))

    def touching(self, one: int, other: int) -> bool:
        """Return whether two interfaces share a corner that no control joint separates."""
        apart = np.abs(self.ends[one][:, None] - self.ends[other][None]).max(axis=-1)
        for i, _j in np.argwhere(apart < self.near):
            corner = self.ends[one][i]
            parted = len(self.gaps) and (np.abs(self.gaps - corner).max(axis=1) < self.near).any()
            if not parted:
                return True
            # on the same side of the leaf's end
            sides = [self.ends[k].mean(axis=0)[0] > corner[0] + 1e-9 for k in (one, other)]
            if sides[0] == sides[1]:
                return True
        return False

    def components(self, number: IntArray) -> list[IntArray]:
        """Return the connected components of some interfaces."""
        left, found = set(number.tolist()), []
        while left:
            piece, front = [], [min(left)]
            left.discard(front[0])
            while front:
                here = front.pop()
                piece.append(here)
                reached = [k for k in left if self.touching(here, k)]
                left.difference_update(reached)
                front += reached
            found.append(np.array(sorted(piece)))
        return found


def damage(wall: ArchivedWall, allowed: Tolerances) -> Iterator[Violation]:
    """Judge every increment again: widths, category, cracks and groups, and the damp-proof course."""
    from audited.checks import Violation

    parts, rules = Parts(wall), wall.scene["damage"]
    for step in range(wall.steps):
        found = judged(wall, parts, step)
        ended = wall.collapsed and step == wall.steps - 1
        for name, value in found.items():
            if ended and name.startswith("damage_category"):
                continue
            archived = wall[name][step]
            if np.abs(archived - value).max() > allowed.damage_rounding * (1e-6 + np.abs(value).max()):
                words = f"{name} = {archived}, from the contacts {value}"
                yield Violation(name.replace("_", " "), step, float(np.abs(archived - value).max()), words)
        for name in ("damage_category", "damage_category_band") if ended else ():
            if wall[name][step] != highest(rules):
                yield Violation(name.replace("_", " "), step, 1.0, f"collapsed, and category {wall[name][step]}")


def judged(wall: ArchivedWall, parts: Parts, step: int) -> dict[str, FloatArray]:
    """Return the verdict on an increment by the names of the archive."""
    rules = wall.scene["damage"]
    opening, slip = wall["contact_opening"][step], wall["contact_slip"][step]
    broken = wall["contact_state"][step] == CRACKED
    widest = up_to_ends(wall, opening)
    width = np.where(broken, np.maximum(widest, 0.0), 0.0)
    proper, base, dpc = (mask[wall.interface] for mask in (parts.proper, parts.base, parts.dpc))
    bed = wall["contact_kind"] == FOOTING
    part = ((broken & (widest > HAIRLINE)) | (np.abs(slip) > HAIRLINE)) & proper
    cracks = []
    for piece in parts.components(np.unique(wall.interface[part])):
        mine = np.flatnonzero(np.isin(wall.interface, piece))
        at = mine[np.argmax(width[mine])]
        if width[at] > 0:
            cracks.append((width[at], *wall.place[at]))
    widths = np.array([c[0] for c in cracks])
    places = np.array([c[1:] for c in cracks]).reshape(-1, 2)
    groups = [group_width(widths, places, rules["group_distance"], int(k)) for k in wall["group_count"]]
    ruling = group_width(widths, places, rules["group_distance"], rules["group_count"])
    found = table(rules["table"])
    from_first = min(c["from"] for c in found["category"] if c["number"] == 1)
    from_first *= found["plasterboard"]["factor"] if rules["plasterboard"] else 1.0
    footing = float(width[bed].max(initial=0.0))
    joint = float(width[proper].max(initial=0.0))
    band = max(joint, parts.gauges.width(opening, broken, rules["band_threshold"]))
    counts_bed = rules["count_footing_gap"] and not parts.dpc.any()
    by_joint, by_band = (
        category(max(value, footing) if counts_bed else value, ruling, rules)
        for value in (float(widths.max(initial=0.0)), band)
    )
    return {
        "crack_width_max": np.array(joint),
        "crack_band_width_max": np.array(band),
        "damage_category": np.array(by_band if rules["measure"] == "band" else by_joint),
        "damage_category_band": np.array(by_band),
        "crack_count": np.array((widths >= from_first).sum()),
        "crack_group_width": np.array(groups),
        "base_crack_width_max": np.array(width[base].max(initial=0.0)),
        "dpc_opening_max": np.array(np.maximum(widest[dpc], 0.0).max(initial=0.0)),
        "dpc_slip_max": np.array(np.abs(slip[dpc]).max(initial=0.0)),
        "dpc_separation_length": np.array(separation(wall, parts, DPC, opening, rules["dpc_threshold"])),
        "footing_opening_max": np.array(footing),
        "footing_separation_length": np.array(separation(wall, parts, FOOTING, opening, rules["footing_threshold"])),
    }


def up_to_ends(wall: ArchivedWall, opening: FloatArray) -> FloatArray:
    """Return the openings (m); at the outermost contacts that of the joint's end where it is larger.

    The opening is extrapolated linearly beyond the two outermost contacts. This is exact between rigid blocks; over
    curved ground it is too large, because of the curvature.
    """
    found = opening.copy()
    for number, (start, end) in enumerate(wall.ends):
        mine = np.flatnonzero(wall.interface == number)
        if len(mine) < 2:
            continue
        way = (wall.place[mine] - start) @ (end - start) / ((end - start) @ (end - start))
        order = mine[np.argsort(way)]
        way = np.sort(way)
        for outer, inner, a, b, at in (
            (order[0], order[1], way[0], way[1], 0.0),
            (order[-1], order[-2], way[-1], way[-2], 1.0),
        ):
            if abs(at - a) > 1e-9:
                on = opening[outer] + (at - a) / (b - a) * (opening[inner] - opening[outer])
                found[outer] = max(found[outer], on)
    return found


class Gauges:
    """Gauges laid across neighbouring joints of the wall proper, as its guide defines the width of a crack band.

    A gauge begins at a contact or at an end of a joint and runs straight across it, from brick to brick, over joints of
    the same direction within its length. Its reading is the sum of their openings.

    Parameters
    ----------
    wall : ArchivedWall
        The wall.
    proper : array of bool (m,)
        Interfaces that are joints of the wall proper.
    length : float
        Of a gauge (m).
    """

    def __init__(self, wall: ArchivedWall, proper: BoolArray, length: float) -> None:
        self.nodes: list[tuple[int, int, float]] = []  # contact, its neighbour, and the share of their difference
        rows: list[list[tuple[int, float]]] = []
        first = np.unique(wall.interface, return_index=True)[1]
        ends = wall.ends
        for axis in (0, 1):
            ahead_of: dict[int, list[_Crossing]] = {}
            for k in np.flatnonzero(proper & (np.abs(wall.normal[first, axis]) > 1 - 1e-9)):
                forward = wall.normal[first[k], axis] > 0
                behind, ahead = (int(side[first[k]]) for side in (wall.sides if forward else wall.sides[::-1]))
                here = self._crossing(wall, int(k), axis, ends[k], ahead)
                ahead_of.setdefault(behind, []).append(here)
            for own in (one for joints in ahead_of.values() for one in joints):
                rows.extend(self._reading(own, at, ahead_of, length) for at in own.at)
        self.rows = rows

    def _crossing(self, wall: ArchivedWall, k: int, axis: int, ends: FloatArray, ahead: int) -> _Crossing:
        """Return a joint with the nodes between which its opening is linear: contacts, and its ends."""
        mine = np.flatnonzero(wall.interface == k)
        mine = mine[np.argsort(wall.place[mine, 1 - axis])]
        at = wall.place[mine, 1 - axis].tolist()
        low, high = np.sort(ends[:, 1 - axis])
        nodes = [(int(i), int(i), 0.0) for i in mine]
        near = 1e-9 * (high - low)
        if at[0] - low > near or high - at[-1] > near:
            for place, outer, inner in ((low, 0, 1), (high, -1, -2)):
                if len(mine) > 1:
                    lean = (place - at[outer]) / (at[outer] - at[inner])
                    node = (int(mine[outer]), int(mine[inner]), float(lean))
                else:
                    node = (int(mine[0]), int(mine[0]), 0.0)
                nodes.insert(0 if outer == 0 else len(nodes), node)
            at = [float(low), *at, float(high)]
        number = list(range(len(self.nodes), len(self.nodes) + len(nodes)))
        self.nodes += nodes
        return _Crossing(wall.middle[k, axis], low, high, np.array(at), number, ahead)

    def _reading(
        self, own: _Crossing, at: float, ahead_of: dict[int, list[_Crossing]], length: float
    ) -> list[tuple[int, float]]:
        """Return the nodes, and the shares of them, that a gauge reads which begins at a place of a joint."""
        inside = at + 1e-5 * ((own.low + own.high) / 2 - at)
        shares, here = own.read(at), own
        while True:
            onward = [
                one
                for one in ahead_of.get(here.ahead, [])
                if one.low <= inside <= one.high and here.level < one.level <= own.level + length * (1 + 1e-9)
            ]
            if not onward:
                return shares
            here = min(onward, key=lambda one: abs((one.low + one.high) / 2 - inside) / (one.high - one.low))
            shares = shares + here.read(at)

    def width(self, opening: FloatArray, broken: BoolArray, threshold: float) -> float:
        """Return the largest reading in one state (m)."""
        values = []
        for outer, inner, lean in self.nodes:
            gap = opening[outer] + lean * (opening[outer] - opening[inner])
            values.append(gap if broken[outer] and gap > threshold else 0.0)
        return max((sum(share * values[node] for node, share in row) for row in self.rows), default=0.0)


@dataclass(frozen=True)
class _Crossing:
    """A joint that a gauge may cross: its level, extent, places and numbers of nodes, and the brick beyond it."""

    level: float
    low: float
    high: float
    at: FloatArray
    node: list[int]
    ahead: int

    def read(self, place: float) -> list[tuple[int, float]]:
        """Return the shares of the nodes in the opening at a place."""
        place = float(np.clip(place, self.at[0], self.at[-1]))
        i = int(np.clip(np.searchsorted(self.at, place + 1e-12, side="right") - 1, 0, max(len(self.at) - 2, 0)))
        if len(self.at) == 1:
            return [(self.node[0], 1.0)]
        share = (place - self.at[i]) / (self.at[i + 1] - self.at[i])
        return [(n, s) for n, s in ((self.node[i], 1.0 - share), (self.node[i + 1], share)) if s > 1e-9]


def group_width(width: FloatArray, place: FloatArray, distance: float, count: int) -> float:
    """Return the largest width (m) that a number of cracks within a distance reach."""
    found = 0.0
    for centre, own in zip(place, width, strict=True):
        near = np.hypot(*(place - centre).T) <= distance * (1 + 1e-12)
        around = np.sort(width[near])[::-1]
        if len(around) >= count:
            found = max(found, min(float(own), float(around[count - 1])))
    return found


def separation(wall: ArchivedWall, parts: Parts, kind: int, opening: FloatArray, threshold: float) -> float:
    """Return the length (m) over which a bed is open by more than a threshold, the opening linear in between."""
    total = 0.0
    for number in np.unique(wall.interface[wall["contact_kind"] == kind]):
        mine = np.flatnonzero(wall.interface == number)
        x, gap = wall.place[mine, 0], opening[mine]
        order = np.argsort(x)
        x, gap = x[order], gap[order]
        ends = np.sort(parts.ends[number][:, 0])
        inside = (ends[0] < x.min() - 1e-9, ends[1] > x.max() + 1e-9)
        if inside[0]:  # midpoint quadrature: linear extrapolation to the ends
            slope = (gap[1] - gap[0]) / (x[1] - x[0]) if len(x) > 1 else 0.0
            x, gap = np.r_[ends[0], x], np.r_[gap[0] + slope * (ends[0] - x[0]), gap]
        if inside[1]:
            slope = (gap[-1] - gap[-2]) / (x[-1] - x[-2]) if len(x) > 2 else 0.0
            x, gap = np.r_[x, ends[1]], np.r_[gap, gap[-1] + slope * (ends[1] - x[-1])]
        over = gap - threshold
        for left, right, a, b in zip(x[:-1], x[1:], over[:-1], over[1:], strict=True):
            if a > 0 and b > 0:
                total += right - left
            elif max(a, b) > 0:
                total += (right - left) * max(a, b) / abs(b - a)
    return float(total)
