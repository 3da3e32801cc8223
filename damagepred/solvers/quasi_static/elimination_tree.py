"""Elimination tree of a wall: the fronts in which multifrontal elimination takes its degrees of freedom.

Courses that touch the ground, and those up to a plane of weakness, are one front each, the root and a chain: joints
slide and crack there. The blocks beyond are ordered by nested dissection (George 1973): a separator divides them in two
parts that do not touch each other, and each part is divided again. A house is first divided in plan, by upright
separators, and each of its parts has a chain. A front is eliminated after all that it separates; its boundary are the
degrees of freedom of later fronts that it then couples (Duff and Reid 1983).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise, product
from operator import is_
from typing import Any, NamedTuple

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.assembly import Model
from damagepred.assembly.house import HouseModel
from damagepred.enumerations import ContactKind
from damagepred.solvers.quasi_static.superelements import Superelements
from damagepred.solvers.system.discrete_system import DiscreteSystem, interface_kinematics


@dataclass(frozen=True)
class Dissection:
    """Order of elimination of the nodes of a wall or house: separators, and the parts that they leave."""

    place: FloatArray  # (d, n) Coordinates of the blocks of the nodes, equal to the last digit where they are in line
    weight: IntArray  # (n,) Number of degrees of freedom of each node, and its block
    block: IntArray
    sides: IntArray  # (m, 2, w / 2) Nodes of the two sides of each interface, -1 where there are fewer
    blocks: IntArray  # (2, m) Blocks of the two sides
    shares: tuple[float, ...] = (0.5,)  # of the weight of a part, before a cut

    def divide(self, nodes: IntArray, largest: Callable[[IntArray], float]) -> Iterator[tuple[IntArray, bool]]:
        """Separators of nodes (True), lighter than ``largest`` of their part, and the parts that they leave (False)."""
        within = np.zeros(int(self.block.max(initial=0)) + 1, dtype=np.bool_)
        left, separates = within.copy(), np.zeros(len(self.block) + 1, dtype=np.bool_)  # the last for -1
        parts = [(nodes, np.arange(self.blocks.shape[1]))]
        while parts:
            nodes, listed = parts.pop()
            cut, limit = None, largest(nodes)
            if limit > 0.0:
                within[self.block[nodes]] = True
                first_in, second_in = within[self.blocks[:, listed]]
                within[self.block[nodes]] = False
                listed = listed[first_in & second_in]
                cut = self._cut(nodes, listed, left, separates, limit)
            if cut is None:
                if len(nodes):
                    yield nodes, False
                continue
            separates[cut] = True
            parted, on_left = separates[nodes], left[self.block[nodes]]
            separates[cut] = False
            if parted.any():
                yield nodes[parted], True
            parts += [(nodes[~parted & ~on_left], listed), (nodes[~parted & on_left], listed)]

    def _cut(
        self, nodes: IntArray, listed: IntArray, left: BoolArray, separates: BoolArray, least: float
    ) -> IntArray | None:
        """Lightest separator of a part below ``least``, or None; ``left`` becomes the half of each block."""
        own, weight, best = self.block[nodes], self.weight[nodes], None
        ends = self.blocks[:, listed]
        for values, share in product(self.place[:, nodes], self.shares):
            cut_at = _quantile(values, weight, share)
            if cut_at == np.inf:
                continue
            left[own] = half = values < cut_at
            first_left, second_left = left[ends]
            cut = np.flatnonzero(first_left != second_left)
            first, second = self.sides[listed[cut]].swapaxes(0, 1)
            begins_left = first_left[cut, None]
            for separator in (np.where(begins_left, first, second), np.where(begins_left, second, first)):
                separates[separator] = True
                total = int(separates[nodes] @ weight)
                separates[separator] = False
                if total < least:
                    least, best, best_half = total, separator, half
        if best is not None:
            left[own] = best_half
        return best


def _quantile(values: FloatArray, weight: IntArray, share: float) -> float:
    """Weighted quantile, or the next larger value if that is the least; infinite if all are equal."""
    order = np.argsort(values)
    ordered, total = values[order], np.cumsum(weight[order])
    quantile = ordered[np.searchsorted(total, share * total[-1])]
    if quantile > ordered[0]:
        return float(quantile)
    return float(np.append(ordered[ordered > quantile], np.inf)[0])


COURSE_SHARE = 0.7
"""Weight of a separator in the plan of a house over its heaviest course, up to which it divides the house there (1)."""
PLAN_SHARES = (0.35, 0.4, 0.45, 0.5, 0.55, 0.6, 0.65)
"""Shares of the weight of a part of a house at which it may be divided: cuts through openings are lighter (1)."""
DISSECTED_SIZE = 48
"""Degrees of freedom of a part of the wall above which it is divided by a separator."""
_recent: deque[tuple[tuple[Any, ...], tuple[Any, ...], EliminationTree]] = deque(maxlen=2)
"""Trees made before: all samples of a wall share one; supports that act later make another."""


class ElasticFactors(NamedTuple):
    """Factors of condensed fronts, elastic: joint strengths do not enter them."""

    # stiffness of the interfaces and of strains, and mask of the condensed fronts
    of: tuple[FloatArray | BoolArray, ...]
    # by their names in the table of the tangent equations; empty until a second wall has been made of the same
    arrays: dict[str, FloatArray]
    elastic_complements: FloatArray  # of ``MultifrontalSystem``
    held: bool  # whether the other fronts hold the condensed ones


class Elements(NamedTuple):
    """Interfaces or deformable blocks, each assembled in one front; its degrees of freedom there are -1 where fixed."""

    front: IntArray  # (e,), -1: all degrees of freedom are fixed
    index_in_front: IntArray  # of their degrees of freedom in that front
    listed: IntArray  # front by front
    first: IntArray  # (F + 1,) first one of each front in that list


class EliminationTree:
    """Fronts, ``count`` of them (F), numbered from the root: every front has a larger number than its parent.

    A node is the smallest unit of the order: a rigid or elastic block, a gridpoint on the boundary of a deformable one,
    or the strains of two halves of a brick. Interfaces and deformable blocks are assembled in the last of their fronts.

    ``parent`` is -1 for the root. ``dofs`` are the free degrees of freedom in the order of the fronts; ``start`` is the
    first place of each front in that order, ``boundary`` the places of the boundaries, one front after the other,
    ``boundary_in_parent`` their index in the parent's front, behind its own degrees of freedom.
    """

    elastic_factors: ElasticFactors | None = None

    def __init__(self, system: DiscreteSystem, superelements: Superelements | None) -> None:
        self.kinematics = interface_kinematics(system.model)
        boundaries = [] if superelements is None else superelements.boundary
        dofs = system.free_dofs if superelements is None else np.setdiff1d(system.free_dofs, superelements.interior)
        # node and front of each free degree of freedom, sorted by front: the order of elimination, from the root
        node = self._set_nodes(system, dofs)
        front = self._order(system)[node]
        in_order = np.lexsort((dofs, node, front))
        self.dofs, node, front = dofs[in_order], node[in_order], front[in_order]
        self.count = int(front.max(initial=-1)) + 1
        self.size = np.bincount(front, minlength=self.count)
        self.start = np.concatenate(([0], np.cumsum(self.size)))
        # interfaces and deformable blocks by the places of their degrees of freedom in that order, -1 where prescribed
        place = np.full(system.model.size, -1, dtype=np.int64)
        place[self.dofs] = np.arange(len(self.dofs))
        elements = np.where(self.kinematics.dof >= 0, place[self.kinematics.dof], -1)
        width = max(map(len, boundaries), default=0)
        blocks = np.full((len(boundaries), width), -1, dtype=np.int64)
        for row, listed in zip(blocks, boundaries):
            row[: len(listed)] = place[listed]
        self._set_boundaries(front, node, elements, blocks)
        front = np.append(front, -1)  # of place -1
        self.interfaces, of_blocks = self._elements(front, elements), self._elements(front, blocks)
        rows = [row[: len(listed)] for row, listed in zip(of_blocks.index_in_front, boundaries)]
        self.superelements = of_blocks._replace(index_in_front=np.concatenate([np.empty(0, dtype=np.int64), *rows]))

    @classmethod
    def of(cls, system: DiscreteSystem, superelements: Superelements | None) -> EliminationTree:
        """Return the tree of a wall; the last wall's tree if it has the same geometry and supports."""
        if superelements is not None:
            return cls(system, superelements)
        model = system.model
        same = model.blocks, model.interfaces
        equal = model.supports.prescribed, model.guides, np.array([] if model.footing is None else model.footing)
        for known, its_equal, tree in tuple(_recent):  # threads may add to it
            if all(map(is_, known, same)) and all(map(np.array_equal, its_equal, equal)):
                return tree
        tree = cls(system, None)
        _recent.append((same, equal, tree))
        return tree

    @property
    def matrix_entries(self) -> int:
        """Entries of the dense matrices of all fronts: an inverse, two couplings and two Schur complements of each."""
        return int(((self.size + self.boundary_size) ** 2 + self.boundary_size**2).sum())

    def ancestors(self, fronts: BoolArray) -> BoolArray:
        """Return some fronts and all their ancestors."""
        found = fronts.copy()
        for k in np.flatnonzero(fronts):
            while (k := self.parent[k]) >= 0 and not found[k]:
                found[k] = True
        return found

    def fronts_of(self, interfaces: BoolArray | IntArray) -> BoolArray:
        """Return the fronts of some interfaces (F,)."""
        return self._marked(self.interfaces.front[interfaces])

    def fronts_of_superelements(self, superelements: BoolArray | IntArray) -> BoolArray:
        """Return the fronts of some deformable blocks (F,)."""
        return self._marked(self.superelements.front[superelements])

    def _marked(self, fronts: IntArray) -> BoolArray:
        """Mask (F,) of the listed fronts; -1 is no front."""
        found = np.zeros(self.count + 1, dtype=np.bool_)
        found[fronts] = True
        return found[:-1]

    # -- order ----------------------------------------------------------------------------------------------------

    def _set_nodes(self, system: DiscreteSystem, dofs: IntArray) -> IntArray:
        """Set block and weight of each node, and the nodes beside interfaces; the nodes of the free ``dofs``."""
        model = system.model
        mesh, n = model.mesh, model.n_blocks
        node = system.block_of_dof.copy()
        self._block = np.arange(n + 1)
        if mesh is not None:
            node[mesh.dof_x] = node[mesh.dof_y] = n + 1 + np.arange(len(mesh.x))
            self._block = np.concatenate((self._block, mesh.gridpoint_block))
        dof = self.kinematics.dof
        if (elastic := model.elastic) is not None and (halves := np.flatnonzero(elastic.halves > 1)).size:
            # strains of two halves are a node of their own, which their crack has on both sides
            strains = system.strain_dofs.start + 2 * halves
            node[strains] = node[strains + 1] = n + 1 + np.arange(len(halves))
            self._block = np.concatenate((self._block, elastic.block[halves]))
            dof, crack = dof.copy(), model.interfaces.kind == ContactKind.BRICK_JOINT
            dof[crack, 8:] = dof[crack, 3:5]
        sides = np.where((dof >= 0) & (dof // 3 != n), node[dof], -1)
        self._sides = sides.reshape(len(dof), 2, dof.shape[1] // 2)  # (m, 2, w / 2)
        self._weight = np.bincount(node[dofs], minlength=len(self._block))
        return node[dofs]

    def _order(self, system: DiscreteSystem) -> IntArray:
        """Front of each node: separators in plan, then chains up to the last plane of weakness, dissection beyond."""
        model, n = system.model, system.model.n_blocks
        face, level_of_block = model.interfaces, block_levels(system)
        block = np.stack((face.block_a, face.block_b), axis=1)
        level = np.where(block == n, -1, level_of_block[block])
        nearer = (level > level[:, ::-1]) & ~model.guides[:, None]
        # a node is in the nearer half of its level if it touches the level before
        within = np.ones(len(self._block), dtype=np.int64)
        touching = self._sides[nearer]
        within[touching[touching >= 0]] = 0
        level_of_node = 2 * level_of_block[self._block] + within
        last = _last_course(model, level)
        size, centres = np.sqrt(model.blocks.area.mean()), [np.stack((model.blocks.x, model.blocks.y))]
        if isinstance(model, HouseModel) and len(model.walls) > 1:
            centres.append(model.unfolded.plan)
        places = [np.pad(np.round(centre / size * 1e6), ((0, 0), (0, 1)))[:, self._block] for centre in centres]
        of_nodes = self._weight, self._block, self._sides, block.T
        front, first, parts = np.full(len(self._block), -1, dtype=np.int64), 0, [np.flatnonzero(self._weight > 0)]
        if len(places) > 1:
            cuts = Dissection(places[1], *of_nodes, shares=PLAN_SHARES)
            divided = cuts.divide(parts.pop(), lambda nodes: COURSE_SHARE * self._heaviest(nodes, level_of_node, last))
            for nodes, separates in divided:
                if separates:
                    front[nodes], first = first, first + 1
                else:
                    parts.append(nodes)
        # a part that is condensed is a better start for Newton's method than none
        smallest = min(DISSECTED_SIZE, int(self._weight.sum()) // 8)
        dissection = Dissection(np.concatenate(places), *of_nodes)
        for part in parts:
            in_chain = level_of_node[part] <= last
            courses, number = np.unique(level_of_node[part[in_chain]], return_inverse=True)
            front[part[in_chain]] = first + number
            first += len(courses)
            beyond = dissection.divide(
                part[~in_chain], lambda nodes: np.inf if self._weight[nodes].sum() > smallest else 0.0
            )
            for nodes, _ in beyond:
                front[nodes], first = first, first + 1
        return front

    def _heaviest(self, nodes: IntArray, level: IntArray, last: int) -> float:
        """Weight of the heaviest of the half levels up to the last one, of some nodes."""
        chain = nodes[level[nodes] <= last]
        return float(np.bincount(level[chain], self._weight[chain]).max(initial=0.0))

    # -- symbolic factorisation -----------------------------------------------------------------------------------

    def _set_boundaries(self, front: IntArray, node: IntArray, *elements: IntArray) -> None:
        """Set parents and boundaries of all fronts (symbolic factorisation) from front, node and elements in places."""
        # nodes are numbered in the same order: where each begins, and its number of degrees of freedom
        first = np.flatnonzero(np.diff(node, prepend=-1, append=-1))
        first, width = first[:-1], np.diff(first)
        number = np.append(np.repeat(np.arange(len(first)), width), -1)  # of place -1
        boundary = self._node_boundaries(front[first], self._coupled_nodes(np.append(front, -1), number, elements))
        # from nodes to their degrees of freedom
        nodes = np.concatenate([np.empty(0, dtype=np.int64), *boundary])
        ends = np.cumsum(width[nodes])
        starts = first[nodes] - (ends - width[nodes])
        self.boundary = np.repeat(starts, width[nodes]) + np.arange(ends[-1] if len(ends) else 0)
        self.first_boundary = np.concatenate(([0], ends))[np.cumsum([0, *map(len, boundary)])]
        self.boundary_size = np.diff(self.first_boundary)
        of_front = np.repeat(np.arange(self.count), self.boundary_size)
        self._keys = of_front * len(front) + self.boundary
        self.boundary_in_parent = self._index_in(self.parent[of_front], self.boundary[:, None]).ravel()

    def _coupled_nodes(self, front: IntArray, number: IntArray, elements: tuple[IntArray, ...]) -> list[IntArray]:
        """Numbers of the nodes that the elements of each front couple, in order; an element is of its last front."""
        pairs, count = [np.empty(0, dtype=np.int64)], int(number.max(initial=0)) + 1
        for places in elements:
            numbers = number[places]
            last = front[places].max(axis=1, initial=-1) if places.size else np.empty(0, dtype=np.int64)
            pairs.append(np.repeat(last, numbers.shape[1])[numbers.ravel() >= 0] * count + numbers[numbers >= 0])
        fronts, nodes = np.divmod(np.unique(np.concatenate(pairs)), count)
        return [nodes[i:j] for i, j in pairwise(np.searchsorted(fronts, np.arange(self.count + 1)))]

    def _node_boundaries(self, front_of_node: IntArray, coupled: list[IntArray]) -> list[IntArray]:
        """Set ``parent`` (F,); nodes of each boundary, rising: of ancestors coupled by elements or by children."""
        gathered = [[nodes] for nodes in coupled]
        first_node = np.searchsorted(front_of_node, np.arange(self.count))
        self.parent = np.full(self.count, -1, dtype=np.int64)
        boundary = [np.empty(0, dtype=np.int64)] * self.count
        for k in range(self.count - 1, -1, -1):  # children first
            nodes = np.unique(np.concatenate(gathered[k])) if len(gathered[k]) > 1 else gathered[k][0]
            boundary[k] = nodes[: np.searchsorted(nodes, first_node[k])]
            if len(boundary[k]):
                self.parent[k] = front_of_node[boundary[k][-1]]  # the nearest ancestor
                gathered[self.parent[k]].append(boundary[k])
            gathered[k] = []
        return boundary

    def _index_in(self, front: IntArray, places: IntArray) -> IntArray:
        """Index in a front of the degrees of freedom in the row for it: the front's own first, then its boundary."""
        fronts = np.broadcast_to(front[:, None], places.shape)
        beyond = np.searchsorted(self._keys, fronts * len(self.dofs) + places) - self.first_boundary[fronts]
        own = places - self.start[fronts]
        size = np.append(self.size, 0)[fronts]
        return np.ascontiguousarray(np.where(places < 0, -1, np.where(own >= 0, own, size + beyond)))

    def _elements(self, front: IntArray, places: IntArray) -> Elements:
        """Elements in their fronts, from the places (e, w) of their degrees of freedom and the front of each place."""
        own = front[places].max(axis=1, initial=-1) if places.size else np.full(len(places), -1)
        order = np.argsort(own, kind="stable")
        edges = np.searchsorted(own[order], np.arange(self.count + 1))
        return Elements(own, self._index_in(own, places), order[edges[0] :], edges - edges[0])


def _last_course(model: Model, level: IntArray) -> int:
    """Last half level of the chain of courses, which ends at a plane of weakness (dpc, footing); -1 without any."""
    kind = model.interfaces.kind
    weak = (kind == ContactKind.DPC) | ((kind == ContactKind.FOOTING_INTERFACE) & (level.max(axis=1) > 0))
    return 2 * int(level[weak].max()) if weak.any() else -1


def block_levels(system: DiscreteSystem) -> IntArray:
    """Levels of blocks and ground (n + 1,): joints up to ground or supports; loose blocks have the largest."""
    model, n = system.model, system.model.n_blocks
    a, b = model.interfaces.block_a, model.interfaces.block_b
    holds = ~model.guides  # distance from fully supported blocks
    # a footing is one level, wherever it is supported
    footing = np.empty(0, dtype=np.int64) if model.footing is None else model.footing
    start, end = np.append(a[holds], np.full(len(footing), n)), np.append(b[holds], footing)
    # dependent degrees of freedom are not prescribed
    constrained = np.setdiff1d(system.constrained_dofs, system.dependent_dofs)
    blocks, ways = np.unique(system.block_of_dof[constrained], return_counts=True)
    roots = blocks[ways >= 3]
    if len(roots) == 1 and not len(footing) and not ((a == n) | (b == n)).any():
        roots = blocks
    joined = csr_array((np.ones(len(start)), (start, end)), shape=(n + 1, n + 1))
    away = dijkstra(joined, directed=False, unweighted=True, indices=roots, min_only=True)
    # ground and supports are no level of their own: blocks that touch them are level 0
    connected = np.isfinite(away)
    levels = np.maximum(away - 1.0, 0.0)
    return np.where(connected, levels, levels[connected].max(initial=0.0)).astype(np.int64)
