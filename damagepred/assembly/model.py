"""The model as the solvers take it: structure of arrays, all SI, tension and opening positive, y up."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np

from damagepred.arrays import BoolArray, FloatArray, Int8Array, IntArray
from damagepred.assembly.elastic_blocks import ElasticBlocks, ElasticSides
from damagepred.assembly.joint_creep import JointCreep
from damagepred.assembly.mesh import Mesh
from damagepred.assembly.section import Sections
from damagepred.kernels.interface.kinematics import EDGE
from damagepred.kernels.joint.parameters import joint_parameters
from damagepred.scene.movement import History


class Blocks(NamedTuple):
    """Blocks, n of them, with vertices of all polygons one after the other (counter-clockwise).

    Attributes
    ----------
    x, y : array (n,)
        Centroid (m).
    area, polar : array (n,)
        Area of the elevation (m2) and its polar second moment about the centroid (m4).
    course : array of int (n,)
        Course counted from 0 at the bottom, -1 where there are none.
    vertices : array (v, 2)
        Corners (m).
    first_vertex : array of int (n + 1,)
        Block i owns vertices first_vertex[i] to first_vertex[i + 1].
    """

    x: FloatArray
    y: FloatArray
    area: FloatArray
    polar: FloatArray
    course: IntArray
    vertices: FloatArray
    first_vertex: IntArray


class Interfaces(NamedTuple):
    """Common edges of two blocks; m of them, each with q contacts. Those with the ground come last.

    The normal points from block a to block b, the tangent is (normal_y, -normal_x). The ground is block n. The edge
    of a deformable block moves piece by piece: each piece that an interface joins is a body, number n + 1 and up.

    Attributes
    ----------
    block_a, block_b : array of int (m,)
        The two blocks.
    body_a, body_b : array of int (m,)
        The bodies that move the two sides: the block itself if it is rigid, or a piece of its facet.
    kind : array of int8 (m,)
        A ``ContactKind``.
    joint : array of int (m,)
        Number of the mortar joint the interface belongs to: strengths that vary from joint to joint are the same
        for all interfaces of one joint.
    x, y : array (m,)
        Middle of the edge (m).
    length : array (m,)
        Of the edge (m).
    normal_x, normal_y : array (m,)
        Unit normal from a to b.
    arm_normal_a, arm_shear_a, arm_normal_b, arm_shear_b : array (m,)
        Displacement of the edge's middle along normal and tangent for a unit rotation of a, of b (m).
    contact_offset : array (m, q)
        Position of the contacts along the tangent from the middle (m).
    contact_area : array (m, q)
        Area each stands for (m2).
    elastic : ElasticSides or None
        How elastic blocks move the sides besides; None if there are none.
    """

    block_a: IntArray
    block_b: IntArray
    body_a: IntArray
    body_b: IntArray
    kind: Int8Array
    joint: IntArray
    x: FloatArray
    y: FloatArray
    length: FloatArray
    normal_x: FloatArray
    normal_y: FloatArray
    arm_normal_a: FloatArray
    arm_shear_a: FloatArray
    arm_normal_b: FloatArray
    arm_shear_b: FloatArray
    contact_offset: FloatArray
    contact_area: FloatArray
    elastic: ElasticSides | None = None

    def taken(self, listed: IntArray) -> Interfaces:
        """Return those of a list, in its order; elastic blocks left out."""
        return Interfaces(*(values[listed] for values in self[:-1]))  # type: ignore[arg-type]


class InterfaceRecords(NamedTuple):
    """The interfaces as kernels take them: a call with few arrays takes less time than one with many.

    Attributes
    ----------
    edge : records of EDGE (m,)
        Of ``Interfaces``.
    contact_offset, contact_area, elastic
        As there.
    """

    edge: np.ndarray
    contact_offset: FloatArray
    contact_area: FloatArray
    elastic: ElasticSides | None


class Joints(NamedTuple):
    """The mortar joints: a bed under one unit, or a perpend; j of them, course by course, left to right.

    Attributes
    ----------
    kind : array of int8 (j,)
        A ``ContactKind``.
    course : array of int (j,)
        Course of the unit on a bed, or of the perpend; -1 where there are no courses.
    x, y : array (j,)
        Middle of the joint (m).
    """

    kind: Int8Array
    course: IntArray
    x: FloatArray
    y: FloatArray


class JointProperties(NamedTuple):
    """Law of each interface (m,): the fields of ``damagepred.scene.Joint``, with stiffness as the solver uses it.

    Instead of the fracture energies there are ``critical_opening`` (m), where tension has fallen to nothing,
    w_c = 2 G_f / f_t, elastic opening included, 0 where the bond breaks at once; and ``critical_slip`` (m), which wears
    off the bond, s_c = 2 G_f / (C - C_r), 0 where slip leaves it as it is. A joint without cap has an infinite
    ``compressive_strength``. ``softening_shape`` (1) is 0 where the bond softens linearly, as w_c and s_c assume; see
    ``damagepred.kernels.joint.softening``. ``gap`` (m) is how far an interface without bond closes before it is
    pressed, 0 but for control joints.
    """

    normal_stiffness: FloatArray
    shear_stiffness: FloatArray
    tensile_strength: FloatArray
    cohesion: FloatArray
    friction: FloatArray
    dilation: FloatArray
    residual_tensile_strength: FloatArray
    residual_cohesion: FloatArray
    residual_friction: FloatArray
    brittle_shear: BoolArray
    compressive_strength: FloatArray
    cap_shear: FloatArray
    softening_shape: FloatArray
    critical_opening: FloatArray
    critical_slip: FloatArray
    gap: FloatArray


class Ground(NamedTuple):
    """Displacement of the ground in one state, under the contacts with it, the last g interfaces.

    Where bricks have a strain of their own, g is the number of all interfaces; see ``assembly.interfaces.with_strain``.

    Attributes
    ----------
    normal, shear : array (g, q)
        Along normal and tangent of the interface, subtracted from the opening of the joint on block b's side (m).
    """

    normal: FloatArray
    shear: FloatArray

    def largest(self) -> float:
        """Return the largest displacement (m)."""
        return float(np.hypot(self.normal, self.shear).max(initial=0.0))


@dataclass(frozen=True, eq=False)
class GroundMovement:
    """Displacement of the ground as a function of the load factor; it begins at 0 at load factor 0.

    Attributes
    ----------
    full : Ground
        State at load factor 1.
    state : callable or None
        Load factor -> state, where the form of the ground changes as the movement grows; None where every state is
        ``full`` times the load factor.
    reverses : bool
        Whether the load factor also goes down to -1.
    sampled_states : int
        Number of states, at equal steps of the load factor, that stand for all of a growing movement.
    """

    full: Ground
    state: Callable[[float], Ground] | None = None
    reverses: bool = False
    sampled_states: int = 8
    _recent: list[tuple[tuple[float, Ground], ...]] = field(default_factory=lambda: [()], init=False, repr=False)

    @classmethod
    def growing(cls, state: Callable[[float], Ground], reverses: bool = False) -> GroundMovement:
        """Return the movement through states that are given at each load factor.

        Parameters
        ----------
        state : callable
            Load factor -> state.
        reverses : bool
            Whether the load factor also goes down to -1.
        """
        known = lru_cache(maxsize=32)(state)  # solvers ask for the same few again and again
        return cls(known(1.0), known, reverses)

    @property
    def proportional(self) -> bool:
        """Whether every state is the full one times the load factor."""
        return self.state is None

    @property
    def moves(self) -> bool:
        """Whether the ground moves at all."""
        return any(state.normal.any() or state.shear.any() for state in self.states())

    def at(self, load_factor: float) -> Ground:
        """Return the state at a load factor."""
        if self.state is not None:
            return self.state(load_factor)
        for known, ground in self._recent[0]:  # solvers ask for the same two again and again
            if known == load_factor:
                return ground
        found = Ground(load_factor * self.full.normal, load_factor * self.full.shear)
        self._recent[0] = ((load_factor, found), *self._recent[0][:2])  # in one step: threads may share a model
        return found

    def load_factor_at(self, coordinate: float) -> float:
        """Return the load factor of the movement at a path coordinate; the two differ in an ``ImposedHistory``."""
        return coordinate

    def load_factor_rate(self, coordinate: float) -> float:
        """Return the load factor per path coordinate in the step that begins at a coordinate (1)."""
        return 1.0

    def states(self) -> tuple[Ground, ...]:
        """Return the states that stand for all of the movement: the full one, and others where the form changes."""
        if self.proportional:
            return (self.full,)
        return tuple(self.at(factor) for factor in self._sampled_factors())

    def largest_rate(self) -> float:
        """Return the largest displacement over its load factor (m)."""
        if self.proportional:
            return self.full.largest()
        return max(self.at(factor).largest() / abs(factor) for factor in self._sampled_factors())

    def largest_standing(self) -> float:
        """Return the largest displacement that may stand all along the path (m); 0 where it begins with the path."""
        return 0.0

    def _sampled_factors(self) -> list[float]:
        factors: list[float] = np.linspace(1.0, 0.0, self.sampled_states, endpoint=False).tolist()
        return [*factors, *(-factor for factor in factors)] if self.reverses else factors

    def map(self, change: Callable[[Ground], Ground]) -> GroundMovement:
        """Return the movement with each state changed."""
        if self.state is None:
            return GroundMovement(change(self.full))
        return GroundMovement.growing(lambda factor: change(self.at(factor)), self.reverses)


class Supports(NamedTuple):
    """What is held, moved and loaded; degrees of freedom are 3 block + (0: x, 1: y, 2: rotation).

    Attributes
    ----------
    prescribed : array of int (p,)
        Degrees of freedom that are held or moved.
    prescribed_displacement : array (p,)
        How far they move from where they start, at full movement (m, rad).
    load : array (3 n,)
        Dead load on each degree of freedom, self weight included (N, N m).
    live_load : array (3 n,)
        Load at full movement that grows with it from nothing, added to the dead load (N, N m).
    start : array (p,)
        Initial values of prescribed degrees of freedom (m, rad): 0, except those free under the dead load.
    after_load : array of bool (p,)
        What is free while the dead load comes on and held from then on, where it stands; see ``solvers.stages``.
    """

    prescribed: IntArray
    prescribed_displacement: FloatArray
    load: FloatArray
    live_load: FloatArray
    start: FloatArray
    after_load: BoolArray

    @classmethod
    def none(cls, load: FloatArray) -> Supports:
        """Return dead loads (3 n,) alone: nothing held, moved or pushed."""
        empty = np.empty(0)
        return cls(np.empty(0, np.int64), empty, load, np.zeros_like(load), empty, np.empty(0, np.bool_))

    def displacement(self, load_factor: float) -> FloatArray:
        """Return the prescribed displacements (p,) at a load factor of the movement (m, rad)."""
        return self.start + load_factor * self.prescribed_displacement


class Jacks(NamedTuple):
    """Jacks that push with equal loads, of which either the load is given or the deflection that it makes.

    Attributes
    ----------
    push : array (size,)
        Force on all degrees of freedom of jacks that push upwards with 1 N each.
    at : array (j,)
        Where they stand along the wall (m).
    ends : array (e,)
        Where the outer supports are (m).
    deflection : float
        Of the footing's centre at full movement (m, upwards), under displacement control.
    load : float
        Of each jack at full movement (N), under load control; it grows from the load of the level state.
    by_load : bool
        Which of the two is controlled. The deflection is 0, and the load what that takes, while the dead load comes on.
    stop : str
        What ends the path early: ``"jacks"`` or ``"supports"`` carry nothing any more; ``""`` is nothing.
    weights : array (size,) or None
        Of all degrees of freedom in the deflection that is controlled. None: ``Model.deflection``.
    after_load : bool
        Whether they push only after the dead load, and the deflection counts from there; see ``solvers.stages``.
    origin : float
        Deflection from which it counts (m).
    """

    push: FloatArray
    at: FloatArray
    ends: FloatArray
    deflection: float
    load: float
    by_load: bool
    stop: str
    weights: FloatArray | None = None
    after_load: bool = False
    origin: float = 0.0


class LaboratoryTest(NamedTuple):
    """What is measured in a laboratory test, from the dead load on.

    Attributes
    ----------
    push : array (3 n,)
        Loads on all blocks that make 1 N together; also the weights of their displacement.
    gauge : array (3 n,) or None
        Weights of the blocks' degrees of freedom in the opening of the gauge, if there is one.
    force : float
        Load at full movement where it is controlled (N), else 0.
    """

    push: FloatArray
    gauge: FloatArray | None
    force: float


class Jambs(NamedTuple):
    """The ends of the two jambs of each opening, which tell how it is distorted; o openings.

    The ends stand counter-clockwise: lower left, lower right, upper right, upper left.

    Attributes
    ----------
    block : array of int (o, 4)
        Blocks that hold the ends, -1 where the opening has no such jamb.
    arm : array (o, 4, 2)
        Place of each end relative to its block's centroid (m).
    """

    block: IntArray
    arm: FloatArray

    @classmethod
    def none(cls) -> Jambs:
        """Return those of a wall without openings."""
        return cls(np.empty((0, 4), dtype=np.int64), np.empty((0, 4, 2)))


class BlockLaw(NamedTuple):
    """Material of each block (n,): the fields of ``damagepred.scene.BlockMaterial``; infinite where it does not yield.

    Thickness (m) out of plane is each block's own.
    """

    elastic_modulus: FloatArray
    poisson_ratio: FloatArray
    cohesion: FloatArray
    friction: FloatArray
    dilation: FloatArray
    tensile_strength: FloatArray
    thickness: FloatArray


@dataclass(frozen=True)
class Model:
    """Blocks, interfaces, laws and what acts on them; see the parts for units and signs.

    Attributes
    ----------
    blocks, interfaces, properties, ground, supports, jambs, joints
        The parts.
    density : array (n,)
        Mass density of the blocks (kg/m3).
    thickness : float
        Out of plane (m).
    span : float
        Distance between the points to which the central deflection refers (m), usually the wall's length.
    central_deflection : float
        Deflection of the centre at full movement (m), not negative.
    apex_limited : int
        Number of joints whose tensile strength was cut to cohesion / friction, the apex of the cone.
    snap_back_limited : int
        Number of joints whose fracture energy, of mode I or II, is too small to soften: their bond breaks at once.
    block_law : BlockLaw
        What the blocks are made of.
    mesh : Mesh or None
        Zones of the deformable blocks; None if all are rigid.
    elastic : ElasticBlocks or None
        Blocks that stretch and bend; None if there are none.
    plane : {"stress", "strain"}
        Whether zones are free or held out of plane.
    loose_joint : JointProperties or None
        One row: the law of what blocks meet that have no joint at all; None takes the first interface's.
    initial_velocity : array (n, 3) or None
        x, y (m/s) and rotation (rad/s) at the start of a dynamic run; None is rest.
    edge_load, live_edge_load : array (size,) or None
        Dead and live load on single gridpoints, in the order of ``Mesh``'s degrees of freedom (N).
    footing : array of int or None
        Blocks of the footing, left to right, where it is part of the model and finds its own shape.
    deflection : array (size,) or None
        Weights of all degrees of freedom in the footing's deflection: its centre relative to its ends (m, upwards).
        None: it is prescribed.
    jacks : Jacks or None
        What pushes the footing.
    sections : Sections or None
        Of a footing of reinforced concrete, which cracks; their law takes the place of that of their contacts.
    surface_movement : float or None
        Movement of the ground's surface at full movement that a site is classed by (m); None: it stays.
    history : History or None
        Increments of a movement history. None: equal increments to 1.
    creep : JointCreep or None
        Of the joints over the time of a history.
    test : LaboratoryTest or None
        Of a laboratory test under ``[[load]]``.

    Examples
    --------
    >>> from damagepred import Scene, assembly
    >>> model = assembly.wall_model(Scene.from_toml("wall.toml"))
    >>> model.span, model.central_deflection
    (2.4, 0.008)
    """

    blocks: Blocks
    interfaces: Interfaces
    properties: JointProperties
    ground: GroundMovement
    supports: Supports
    jambs: Jambs
    joints: Joints
    density: FloatArray
    thickness: float
    span: float
    central_deflection: float
    apex_limited: int
    snap_back_limited: int
    block_law: BlockLaw
    mesh: Mesh | None = None
    elastic: ElasticBlocks | None = None
    plane: str = "stress"
    edge_load: FloatArray | None = None
    loose_joint: JointProperties | None = None
    initial_velocity: FloatArray | None = None
    live_edge_load: FloatArray | None = None
    footing: IntArray | None = None
    deflection: FloatArray | None = None
    jacks: Jacks | None = None
    sections: Sections | None = None
    surface_movement: float | None = None
    history: History | None = None
    creep: JointCreep | None = None
    test: LaboratoryTest | None = None

    @property
    def n_blocks(self) -> int:
        """Number of blocks."""
        return int(self.blocks.x.size)

    @property
    def n_contacts(self) -> int:
        """Number of contacts."""
        return int(self.interfaces.contact_area.size)

    @property
    def n_bodies(self) -> int:
        """Number of bodies that joints act on: blocks, the ground, and pieces of deformable blocks' facets."""
        return self.n_blocks + 1 + (0 if self.mesh is None else len(self.mesh.piece_facet))

    @property
    def size(self) -> int:
        """Number of degrees of freedom: of blocks and ground, then of facets and gridpoints (``Mesh``) or strains."""
        if self.mesh is not None:
            return self.mesh.size
        return 3 * (self.n_blocks + 1) + (0 if self.elastic is None else 2 * len(self.elastic.block))

    @property
    def mass(self) -> FloatArray:
        """Mass of each block (kg)."""
        return self.density * self.blocks.area * self.block_law.thickness

    def describe_block(self, block: int) -> str:
        """Describe a block by number, place and course, for a message."""
        course = int(self.blocks.course[block])
        where = f"x = {self.blocks.x[block]:.3g} m, y = {self.blocks.y[block]:.3g} m"
        return f"block {block} ({where}" + (f", course {course + 1})" if course >= 0 else ")")

    def support_displacement(self, coordinate: float) -> FloatArray:
        """Return the prescribed displacements (p,) at a path coordinate (m, rad)."""
        return self.supports.displacement(self.ground.load_factor_at(coordinate))

    @cached_property
    def joint_parameters(self) -> np.ndarray:
        """Parameters of the joint law of the interfaces, records (m,) of ``JointParameters``."""
        return joint_parameters(self.properties)

    @cached_property
    def interface_records(self) -> InterfaceRecords:
        """The interfaces as kernels take them."""
        face = self.interfaces
        edge = np.empty(len(face.kind), EDGE)
        for name in EDGE.names or ():
            edge[name] = getattr(face, name)
        return InterfaceRecords(edge, face.contact_offset, face.contact_area, face.elastic)

    @cached_property
    def moves(self) -> BoolArray:
        """Whether each block (n,) can move by itself in any direction, being not held or moved altogether."""
        free = np.ones(3 * self.n_blocks, dtype=np.bool_)
        free[self.supports.prescribed[self.supports.prescribed < free.size]] = False
        return np.asarray(free.reshape(-1, 3).any(axis=1))

    @property
    def mean_block_weight(self) -> float:
        """Mean weight of a block (N), from the dead loads, else the live ones; the yardstick for unbalanced forces.

        A block that is held or moved altogether, a plate under a wall, has no say: however heavy, it carries nothing.
        """
        for which in (self.moves, ~self.moves):
            for load in (self.supports.load, self.supports.live_load):
                forces = load.reshape(-1, 3)[which, :2]
                total = float(np.hypot(forces[:, 0], forces[:, 1]).mean()) if which.any() else 0.0
                if total > 0:
                    return total
        return 1.0

    @property
    def on_ground(self) -> BoolArray:
        """Whether each interface (m,) is one with the ground."""
        return np.asarray(self.interfaces.block_a == self.n_blocks)

    @property
    def is_strained(self) -> bool:
        """Whether blocks have a strain of their own, and every interface its imposed displacement."""
        return len(self.ground.full.normal) > int(self.on_ground.sum())

    @property
    def block_share(self) -> FloatArray:
        """Share of each block (n,) that is modelled: half of a block on the axis of a half wall, else all of it."""
        return np.ones(self.n_blocks)

    @property
    def guides(self) -> BoolArray:
        """Whether each interface (m,) is a guide without shear on the axis of a half wall, which supports no block."""
        return np.zeros(len(self.interfaces.kind), dtype=np.bool_)

    @property
    def block_stress(self) -> float:
        """Mean block weight over the largest contact area (Pa); the yardstick for joint stresses."""
        return self.mean_block_weight / (float(self.interfaces.contact_area.max(initial=0.0)) or 1.0)
