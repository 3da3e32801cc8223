"""The joints of a wall for damage assessment: lines on a wall, some of them the dpc."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import scipy

from damagepred.arrays import BoolArray, FloatArray, Int8Array, IntArray
from damagepred.enumerations import MASONRY, ContactKind
from damagepred.errors import InputError

if TYPE_CHECKING:
    import xarray as xr


class Ends(NamedTuple):
    """Linear extrapolation of the opening from the contacts to the ends of n interfaces."""

    contact: IntArray  # (n, 2): outermost contact at start and end, among all m q
    beside: IntArray  # (n, 2): neighbour that defines the line
    # (n, 2): distance of the end from the outermost contact over the distance between the two contacts;
    # negative if the end lies between them, 0 if the contact lies at the end
    share: FloatArray

    def of(self, number: IntArray) -> Ends:
        """Extrapolation for a selection of interfaces."""
        return Ends(self.contact[number], self.beside[number], self.share[number])

    def __call__(self, values: FloatArray) -> FloatArray:
        """Values at start and end of each interface (n, 2), from the values at all contacts (m, q)."""
        flat = np.ravel(values)
        outermost = flat[self.contact]
        return np.asarray(outermost + self.share * (outermost - flat[self.beside]))


class Profile(NamedTuple):
    """Nodes of n interfaces: contacts from start to end, and the ends themselves where no contact lies there."""

    contacts: IntArray  # (n, q): among all m q
    way: FloatArray  # (n, q) or (n, q + 2): distance of each node from the start of its interface (m)
    ends: Ends | None  # extrapolation; None if contacts lie at the ends

    def of(self, values: FloatArray) -> FloatArray:
        """Values at the nodes, from the values at all contacts (m, q)."""
        inside = np.ravel(values)[self.contacts]
        if self.ends is None:
            return inside
        first, last = self.ends(values).T
        return np.column_stack((first, inside, last))

    def open_length(self, opening: FloatArray, threshold: float) -> float:
        """Length (m) with an opening above a threshold (m)."""
        beyond = self.of(opening) - threshold
        if beyond.max(initial=0.0) <= 0.0:
            return 0.0
        first, second = beyond[:, :-1], beyond[:, 1:]
        rise = np.abs(second - first)
        crossing = np.maximum(first, second) / np.where(rise > 0.0, rise, 1.0)
        share = np.where(np.minimum(first, second) > 0.0, 1.0, np.minimum(np.maximum(crossing, 0.0), 1.0))
        return float(((self.way[:, 1:] - self.way[:, :-1]) * share).sum())


@dataclass(frozen=True, eq=False)  # maps are compared and cached by identity
class JointMap:
    """Geometry of the interfaces of a wall; m interfaces with q contacts each."""

    start: FloatArray  # (m, 2): ends (m)
    end: FloatArray
    kind: Int8Array  # (m,): a ``ContactKind``
    contact_x: FloatArray  # (m, q): position and tributary length of the contacts (m)
    contact_y: FloatArray
    contact_length: FloatArray
    blocks: IntArray  # (m, 2): blocks on the two sides, or -1; the normal points from the first to the second

    @classmethod
    def from_contacts(
        cls, x: FloatArray, y: FloatArray, length: FloatArray, normal: FloatArray, kind: Int8Array, blocks: Any = None
    ) -> JointMap:
        """Map from position and tributary length (m) of the contacts, unit normals, kinds and blocks."""
        whole = length.sum(axis=1)
        middle = np.column_stack(((x * length).sum(axis=1), (y * length).sum(axis=1))) / whole[:, None]
        half = np.column_stack((normal[:, 1], -normal[:, 0])) * (whole / 2)[:, None]
        blocks = np.full((len(kind), 2), -1) if blocks is None else blocks
        return cls(middle - half, middle + half, kind, x, y, length, blocks)

    @classmethod
    def from_dataset(cls, ds: xr.Dataset, *, with_blocks: bool = False) -> JointMap:
        """Map of an archived wall; the blocks are found if requested, or if ``ends`` needs them."""
        if "wall" in ds.dims:
            raise InputError("the file has a house; take one wall out of it: ds.damagepred.wall(name).")
        shape = (int(ds["contact_interface"].values[-1]) + 1, -1)
        x, y, length, kind = (ds[f"contact_{name}"].values.reshape(shape) for name in ("x", "y", "length", "kind"))
        normal = np.column_stack([ds[f"contact_normal_{axis}"].values.reshape(shape)[:, 0] for axis in "xy"])
        joints = cls.from_contacts(x, y, length, normal, kind[:, 0])
        wanted = with_blocks or x.shape[1] == 1
        return replace(joints, blocks=_blocks_beside(ds, joints)) if wanted else joints

    def part(self, number: IntArray | BoolArray) -> JointMap:
        """Map of a selection of interfaces."""
        return JointMap(*(getattr(self, field.name)[number] for field in fields(self)))

    @cached_property
    def is_dpc(self) -> BoolArray:
        """Whether each interface (m,) is the dpc."""
        return self.kind == ContactKind.DPC

    @cached_property
    def is_masonry(self) -> BoolArray:
        """Whether each interface (m,) is a mortar joint between bricks, or a potential crack of a brick."""
        return np.isin(self.kind, MASONRY)

    @cached_property
    def is_wall(self) -> BoolArray:
        """Whether each interface (m,) is a joint or brick of the wall proper: above the dpc, or all without a dpc."""
        return self.is_masonry & (self.middle_y > self.dpc_level)

    @cached_property
    def is_base(self) -> BoolArray:
        """Whether each interface (m,) is a joint or brick below the dpc."""
        return self.is_masonry & (self.middle_y <= self.dpc_level)

    @cached_property
    def is_footing(self) -> BoolArray:
        """Whether each interface (m,) is the bed between the first course and the footing or ground."""
        return self.kind == ContactKind.FOOTING_INTERFACE

    @cached_property
    def contacts_along(self) -> tuple[IntArray, FloatArray]:
        """Order of the contacts along each interface (m, q), and their distance from its start (m)."""
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
        """Extrapolation of the opening to the ends of all interfaces."""
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
        """Next interface between the same blocks at start and end of each (m, 2), or -1."""
        _, pair = np.unique(self.blocks, axis=0, return_inverse=True)
        key = pair.reshape(-1, 1) * (self.corner_numbers.max() + 1) + self.corner_numbers
        following = np.empty(key.shape, dtype=np.int64)
        for side, other in ((0, 1), (1, 0)):
            order = np.argsort(key[:, other])
            match = order[np.minimum(np.searchsorted(key[order, other], key[:, side]), len(order) - 1)]
            following[:, side] = np.where(key[match, other] == key[:, side], match, -1)
        following[self.blocks.max(axis=1) < 0] = -1  # unknown blocks
        return following

    def widest(self, opening: FloatArray) -> FloatArray:
        """Largest opening over the tributary length of each contact (m, q) (m), ends of joints included."""
        if not self.extrapolates:
            return opening
        widest = opening.ravel().copy()
        np.maximum.at(widest, self.ends.contact, self.ends(opening))
        return widest.reshape(opening.shape)

    def profile(self, number: IntArray) -> Profile:
        """Nodes of a selection of interfaces, for openings along them."""
        order, way = self.contacts_along
        contacts, way = number[:, None] * order.shape[1] + order[number], way[number]
        if not self.extrapolates:
            return Profile(contacts, way, None)
        way = np.column_stack((np.zeros(len(number)), way, self.length[number]))
        return Profile(contacts, way, self.ends.of(number))

    @cached_property
    def dpc_profile(self) -> Profile:
        """Nodes of the dpc."""
        return self.profile(np.flatnonzero(self.is_dpc))

    @cached_property
    def footing_profile(self) -> Profile:
        """Nodes of the footing bed."""
        return self.profile(np.flatnonzero(self.is_footing))

    @cached_property
    def middle_y(self) -> FloatArray:
        """Height of each interface's middle (m), (m,)."""
        return (self.start[:, 1] + self.end[:, 1]) / 2

    @cached_property
    def dpc_level(self) -> float:
        """Height of the dpc (m), minus infinity without a dpc."""
        return float(self.middle_y[self.is_dpc].max()) if self.is_dpc.any() else -np.inf

    @cached_property
    def corner_numbers(self) -> IntArray:
        """Numbers of the corners at start and end of each interface: array (m, 2)."""
        points = np.concatenate((self.start, self.end))
        apart = 1e-7 * float(np.ptp(points, axis=0).max())
        # group by gaps between coordinates: rounding could separate copies of one corner
        level = np.empty(points.shape, dtype=np.int64)
        for axis, values in enumerate(points.T):
            order = np.argsort(values, kind="stable")
            level[order, axis] = np.concatenate(([0], np.cumsum(np.diff(values[order]) > apart)))
        number = np.unique(level, axis=0, return_inverse=True)[1].reshape(2, -1).T
        gap = self.kind == ContactKind.CONTROL_JOINT
        if not gap.any():
            return number
        # the two sides of a control joint have numbers of their own
        ends = np.stack((self.start[:, 0], self.end[:, 0]), axis=1)
        on_right = ends.mean(axis=1, keepdims=True) > ends + 1e-9
        moved = np.isin(number, number[gap]) & on_right & ~gap[:, None]
        _, again = np.unique(np.where(moved, number + number.max() + 1, number), return_inverse=True)
        return again.reshape(-1, 2)

    @cached_property
    def corners(self) -> scipy.sparse.csr_array:
        """Incidence of interfaces and corners (m, corners)."""
        number = self.corner_numbers.T.ravel()
        rows = np.tile(np.arange(len(self.kind)), 2)
        return scipy.sparse.csr_array((np.ones(len(rows), dtype=np.int8), (rows, number)))

    @cached_property
    def wall_neighbours(self) -> tuple[IntArray, IntArray]:
        """Pairs of interfaces of the wall proper that share a corner: the first and the second of each."""
        wall = np.flatnonzero(self.is_wall)
        touching = self.corners[wall]
        pairs = scipy.sparse.triu(touching.astype(np.int32) @ touching.T, k=1).tocoo()
        return wall[pairs.row], wall[pairs.col]


def _blocks_beside(ds: xr.Dataset, joints: JointMap) -> IntArray:
    """Blocks on the two sides of an archive's interfaces, as ``JointMap.blocks``, from the corners of blocks."""
    from scipy.spatial import KDTree

    corner = np.column_stack((ds["vertex_x"].values, ds["vertex_y"].values))
    owner = ds["vertex_block"].values
    first = np.flatnonzero(np.diff(owner, prepend=-1))  # corners are listed block by block, counter-clockwise
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
    on_left = edge[number, 0] * arm[:, 1] - edge[number, 1] * arm[:, 0] > 0.0
    holds = np.bincount(pair[on_left], minlength=len(block)) == sides
    blocks = np.full(len(probe), -1, dtype=np.int64)
    blocks[point[holds]] = owner[first][block[holds]]
    return blocks.reshape(2, -1).T
