"""The joints of a wall for damage assessment: lines on a wall, some of them the dpc."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy import sparse

from damagepred.arrays import BoolArray, FloatArray, Int8Array, IntArray
from damagepred.enumerations import ContactKind

if TYPE_CHECKING:
    import xarray as xr

    from damagepred.damage.bands import BandGauges


class Ends(NamedTuple):
    """Linear extrapolation of the opening from the contacts to the ends of n interfaces.

    The line goes through the outermost contact and the one beside it. Of an interface with a single contact, it goes
    through that of the next interface between the same two blocks; without such an interface the opening is constant.

    Attributes
    ----------
    contact, beside : array of int (n, 2)
        Outermost contact at start and end, and the one that gives the line with it, as positions among all m q.
    share : array (n, 2)
        Distance of the end from the outermost contact, over the distance of that from the one beside it; negative where
        the end lies between the two, 0 where the contact lies at the end.
    """

    contact: IntArray
    beside: IntArray
    share: FloatArray

    def of(self, number: IntArray) -> Ends:
        """Return those of some of the interfaces."""
        return Ends(self.contact[number], self.beside[number], self.share[number])

    def __call__(self, values: FloatArray) -> FloatArray:
        """Return values at start and end of each interface, (n, 2), from those at all contacts, (m, q)."""
        flat = np.ravel(values)
        outermost = flat[self.contact]
        return np.asarray(outermost + self.share * (outermost - flat[self.beside]))


class Profile(NamedTuple):
    """Nodes of n interfaces: their contacts from start to end, with the ends themselves where contacts lie elsewhere.

    Between nodes the opening is linear, as between rigid blocks; it is extrapolated beyond the outermost contacts.

    Attributes
    ----------
    contacts : array of int (n, q)
        Contacts, as positions among all m q.
    way : array (n, q) or (n, q + 2)
        Way of each node from the start of its interface (m).
    ends : Ends or None
        How openings at the ends follow; None where the outermost contacts lie there.
    """

    contacts: IntArray
    way: FloatArray
    ends: Ends | None

    def of(self, values: FloatArray) -> FloatArray:
        """Return values at the nodes, of the shape of ``way``, from those at all contacts, (m, q)."""
        inside = np.ravel(values)[self.contacts]
        if self.ends is None:
            return inside
        first, last = self.ends(values).T
        return np.column_stack((first, inside, last))

    def open_length(self, opening: FloatArray, threshold: float) -> float:
        """Return the length (m) over which the interfaces are open by more than a threshold.

        Parameters
        ----------
        opening : array (m, q)
            Of all contacts (m).
        threshold : float
            In m.
        """
        beyond = self.of(opening) - threshold
        if beyond.max(initial=0.0) <= 0.0:
            return 0.0
        first, second = beyond[:, :-1], beyond[:, 1:]
        rise = np.abs(second - first)
        crossing = np.maximum(first, second) / np.where(rise > 0.0, rise, 1.0)
        share = np.where(np.minimum(first, second) > 0.0, 1.0, np.minimum(np.maximum(crossing, 0.0), 1.0))
        return float(((self.way[:, 1:] - self.way[:, :-1]) * share).sum())


@dataclass(frozen=True)
class JointMap:
    """Where the interfaces of a wall lie; m interfaces with q contacts each.

    Attributes
    ----------
    start, end : array (m, 2)
        Ends of each interface (m).
    kind : array of int8 (m,)
        See ``ContactKind.BED_JOINT`` and the names beside it.
    contact_x, contact_y, contact_length : array (m, q)
        Place of each contact and its tributary length (m).
    blocks : array of int (m, 2)
        Block that the normal of each interface points from, and block that it points to, -1 where there is none, or it
        is not known.
    """

    start: FloatArray
    end: FloatArray
    kind: Int8Array
    contact_x: FloatArray
    contact_y: FloatArray
    contact_length: FloatArray
    blocks: IntArray

    @classmethod
    def from_contacts(
        cls,
        x: FloatArray,
        y: FloatArray,
        length: FloatArray,
        normal: FloatArray,
        kind: Int8Array,
        blocks: IntArray | None = None,
    ) -> JointMap:
        """Build the map from contacts.

        Parameters
        ----------
        x, y, length : array (m, q)
            Place of each contact and its tributary length (m).
        normal : array (m, 2)
            Unit normal of each interface.
        kind : array (m,)
            Kind of each interface.
        blocks : array of int (m, 2), optional
            Blocks on the two sides of each interface.
        """
        whole = length.sum(axis=1)
        middle = np.column_stack(((x * length).sum(axis=1), (y * length).sum(axis=1))) / whole[:, None]
        half = np.column_stack((normal[:, 1], -normal[:, 0])) * (whole / 2)[:, None]
        blocks = np.full((len(kind), 2), -1) if blocks is None else blocks
        return cls(middle - half, middle + half, kind, x, y, length, blocks)

    @classmethod
    def from_dataset(cls, ds: xr.Dataset, *, with_blocks: bool = False) -> JointMap:
        """Build the map from an archived wall.

        Parameters
        ----------
        ds : xarray.Dataset
            Of one wall with its contacts.
        with_blocks : bool
            Whether to find out which blocks lie on either side of each interface, where ``ends`` does not need them.
        """
        shape = (int(ds["contact_interface"].values[-1]) + 1, -1)
        x, y, length, kind = (ds[f"contact_{name}"].values.reshape(shape) for name in ("x", "y", "length", "kind"))
        normal = np.column_stack([ds[f"contact_normal_{axis}"].values.reshape(shape)[:, 0] for axis in "xy"])
        found = cls.from_contacts(x, y, length, normal, kind[:, 0])
        wanted = with_blocks or x.shape[1] == 1
        return replace(found, blocks=_blocks_beside(ds, found)) if wanted else found

    @cached_property
    def is_dpc(self) -> BoolArray:
        """Which interfaces are the dpc, (m,)."""
        return self.kind == ContactKind.DPC

    @cached_property
    def is_wall(self) -> BoolArray:
        """Which interfaces are mortar joints of the wall proper, (m,): above the dpc, or all where there is none."""
        mortar = (self.kind == ContactKind.BED_JOINT) | (self.kind == ContactKind.HEAD_JOINT)
        return mortar & (self.middle_y > self.dpc_level)

    @cached_property
    def is_base(self) -> BoolArray:
        """Which interfaces are mortar joints below the dpc, (m,)."""
        mortar = (self.kind == ContactKind.BED_JOINT) | (self.kind == ContactKind.HEAD_JOINT)
        return mortar & (self.middle_y <= self.dpc_level)

    @cached_property
    def is_footing(self) -> BoolArray:
        """Which interfaces are the bed between the first course and the footing, or what the wall stands on, (m,)."""
        return self.kind == ContactKind.FOOTING_INTERFACE

    @cached_property
    def dpc(self) -> IntArray:
        """Numbers of the interfaces of the dpc."""
        return np.flatnonzero(self.is_dpc)

    @cached_property
    def footing(self) -> IntArray:
        """Numbers of the interfaces of the footing bed."""
        return np.flatnonzero(self.is_footing)

    @cached_property
    def contacts_along(self) -> tuple[IntArray, FloatArray]:
        """The contacts in order along each interface, (m, q), and their way from its start (m)."""
        along = (self.end - self.start) / self.length[:, None]
        x, y = self.contact_x - self.start[:, :1], self.contact_y - self.start[:, 1:]
        way = x * along[:, :1] + y * along[:, 1:]
        order = np.argsort(way, axis=1)
        return order, np.take_along_axis(way, order, axis=1)

    @cached_property
    def length(self) -> FloatArray:
        """Length of each interface (m), (m,)."""
        return np.asarray(np.linalg.norm(self.end - self.start, axis=1))

    @cached_property
    def ends(self) -> Ends:
        """How an opening at the ends of all interfaces follows from the contacts."""
        order, way = self.contacts_along
        contact = order[:, [0, -1]] + (order.shape[1] * np.arange(len(self.kind)))[:, None]
        distance = np.column_stack((way[:, 0], self.length - way[:, -1]))
        distance[distance <= 1e-9 * self.length[:, None]] = 0.0
        if way.shape[1] > 1:
            beside = order[:, [1, -2]] + contact - order[:, [0, -1]]
            return Ends(contact, beside, distance / np.diff(way, axis=1)[:, [0, -1]])
        beside = self._next_between_the_same_blocks
        other = beside[:, ::-1]
        gap = distance + distance[beside, [1, 0]]
        share = np.where(beside >= 0, -distance / gap, np.where(other >= 0, distance / gap[:, ::-1], 0.0))
        return Ends(contact, np.maximum(np.where(beside >= 0, beside, other), 0), share)

    @cached_property
    def extrapolates(self) -> bool:
        """Whether any interface has an end without a contact."""
        return self.contact_x.shape[1] == 1 or bool(self.ends.share.any())

    @cached_property
    def _next_between_the_same_blocks(self) -> IntArray:
        """The interface that each goes over into at its start and at its end, (m, 2), -1 where there is none."""
        _, pair = np.unique(self.blocks, axis=0, return_inverse=True)
        key = pair.reshape(-1, 1) * (self.corner_numbers.max() + 1) + self.corner_numbers
        found = np.empty(key.shape, dtype=np.int64)
        for here, there in ((0, 1), (1, 0)):
            order = np.argsort(key[:, there])
            at = order[np.minimum(np.searchsorted(key[order, there], key[:, here]), len(order) - 1)]
            found[:, here] = np.where(key[at, there] == key[:, here], at, -1)
        found[self.blocks.max(axis=1) < 0] = -1  # blocks that are not known
        return found

    def widest(self, opening: FloatArray) -> FloatArray:
        """Return the widest opening over the tributary length of each contact (m), (m, q), ends of joints included.

        Parameters
        ----------
        opening : array (m, q)
            Of all contacts (m).
        """
        if not self.extrapolates:
            return opening
        found = opening.ravel().copy()
        np.maximum.at(found, self.ends.contact, self.ends(opening))
        return found.reshape(opening.shape)

    def profile(self, number: IntArray) -> Profile:
        """Return the nodes of some interfaces, with which openings along them are measured.

        Parameters
        ----------
        number : array of int (n,)
            The interfaces.
        """
        order, way = self.contacts_along
        contacts, way = number[:, None] * order.shape[1] + order[number], way[number]
        if not self.extrapolates:
            return Profile(contacts, way, None)
        way = np.column_stack((np.zeros(len(number)), way, self.length[number]))
        return Profile(contacts, way, self.ends.of(number))

    @cached_property
    def dpc_profile(self) -> Profile:
        """Nodes of the dpc."""
        return self.profile(self.dpc)

    @cached_property
    def footing_profile(self) -> Profile:
        """Nodes of the footing bed."""
        return self.profile(self.footing)

    @cached_property
    def _gauges(self) -> dict[float, BandGauges]:
        return {}

    def band_gauges(self, length: float) -> BandGauges:
        """Return the gauges by which crack bands of this wall are measured; laid once for each length.

        Parameters
        ----------
        length : float
            Of a gauge (m).
        """
        from damagepred.damage.bands import BandGauges

        if length not in self._gauges:
            self._gauges[length] = BandGauges.of_joints(self, length)
        return self._gauges[length]

    @cached_property
    def middle_y(self) -> FloatArray:
        """Height of each interface's middle (m), (m,)."""
        return (self.start[:, 1] + self.end[:, 1]) / 2

    @cached_property
    def dpc_level(self) -> float:
        """Height of the dpc (m), minus infinity where there is none."""
        return float(self.middle_y[self.is_dpc].max()) if self.is_dpc.any() else -np.inf

    @cached_property
    def corner_numbers(self) -> IntArray:
        """Numbers of the corners at start and end of each interface: array (m, 2)."""
        points = np.concatenate((self.start, self.end))
        apart = 1e-7 * float(np.ptp(points, axis=0).max())
        # by the gaps between coordinates, not by rounding them: a corner may lie where rounding parts its copies
        level = np.empty(points.shape, dtype=np.int64)
        for axis, values in enumerate(points.T):
            order = np.argsort(values, kind="stable")
            level[order, axis] = np.concatenate(([0], np.cumsum(np.diff(values[order]) > apart)))
        _, number = np.unique(level, axis=0, return_inverse=True)
        return self._parted(number.reshape(2, -1).T)

    def _parted(self, number: IntArray) -> IntArray:
        """Give corners at a control joint, where the leaf is parted, another number on its right than on its left."""
        gap = self.kind == ContactKind.CONTROL_JOINT
        if not gap.any():
            return number
        ends = np.stack((self.start[:, 0], self.end[:, 0]), axis=1)
        on_right = ends.mean(axis=1, keepdims=True) > ends + 1e-9
        moved = np.isin(number, number[gap]) & on_right & ~gap[:, None]
        _, again = np.unique(np.where(moved, number + number.max() + 1, number), return_inverse=True)
        return again.reshape(-1, 2)

    @cached_property
    def corners(self) -> sparse.csr_array:
        """Which corner each interface touches: array of bool (m, corners)."""
        number = self.corner_numbers.T.ravel()
        rows = np.tile(np.arange(len(self.kind)), 2)
        return sparse.csr_array((np.ones(len(rows), dtype=np.int8), (rows, number)))

    @cached_property
    def wall_neighbours(self) -> tuple[IntArray, IntArray]:
        """Pairs of interfaces of the wall proper that share a corner: the first and the second of each."""
        own = np.flatnonzero(self.is_wall)
        touching = self.corners[own]
        pairs = sparse.triu(touching.astype(np.int32) @ touching.T, k=1).tocoo()
        return own[pairs.row], own[pairs.col]


def _blocks_beside(ds: xr.Dataset, joints: JointMap) -> IntArray:
    """Return the blocks that an archive's interfaces lie between, as ``JointMap.blocks``, from the blocks' corners."""
    from scipy.spatial import KDTree

    corner = np.column_stack((ds["vertex_x"].values, ds["vertex_y"].values))
    owner = ds["vertex_block"].values
    first = np.flatnonzero(np.diff(owner, prepend=-1))  # corners stand block by block, counter-clockwise
    count = np.diff(np.append(first, len(owner)))
    following = np.arange(len(owner)) + 1
    following[first + count - 1] = first
    edge = corner[following] - corner
    centre = np.add.reduceat(corner, first) / count[:, None]
    radius = np.maximum.reduceat(np.linalg.norm(corner - np.repeat(centre, count, axis=0), axis=1), first)
    along = joints.end - joints.start
    normal = np.column_stack((-along[:, 1], along[:, 0]))
    middle, near = (joints.start + joints.end) / 2, 1e-3
    probe = np.concatenate((middle - near * normal, middle + near * normal))
    inside = KDTree(probe).query_ball_point(centre, radius)
    block = np.repeat(np.arange(len(first)), [len(some) for some in inside])
    point = np.concatenate([np.asarray(some, dtype=np.int64) for some in inside])
    sides = count[block]
    pair = np.repeat(np.arange(len(block)), sides)
    number = first[block][pair] + np.arange(len(pair)) - np.repeat(np.cumsum(sides) - sides, sides)
    arm = probe[point][pair] - corner[number]
    left = edge[number, 0] * arm[:, 1] - edge[number, 1] * arm[:, 0] > 0.0
    holds = np.bincount(pair[left], minlength=len(block)) == sides
    found = np.full(len(probe), -1, dtype=np.int64)
    found[point[holds]] = owner[first][block[holds]]
    return found.reshape(2, -1).T
