"""The model as the solvers take it: structure of arrays, all SI, tension and opening positive, y up."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np

from damagepred.arrays import BoolArray, FloatArray, Int8Array, IntArray
from damagepred.assembly.elastic_blocks import ElasticBlocks
from damagepred.assembly.joint_creep import JointCreep
from damagepred.assembly.mesh import Mesh
from damagepred.inputs.documentation import documented
from damagepred.kernels.concrete_section.structures import Sections
from damagepred.kernels.interface.kinematics import EDGE, ElasticSides
from damagepred.kernels.joint.parameters import joint_parameters
from damagepred.scene.movement_stage import History


class Blocks(NamedTuple):
    """Blocks, n of them; the vertices of all polygons are one array (counter-clockwise)."""

    x: FloatArray  # (n,): centroid (m)
    y: FloatArray
    area: FloatArray  # (n,): area of the elevation (m2)
    polar: FloatArray  # (n,): polar second moment of area about the centroid (m4)
    course: IntArray  # (n,): from 0 at the bottom, -1 without courses
    vertices: FloatArray  # (v, 2): corners (m)
    first_vertex: IntArray  # (n + 1,): block i has vertices first_vertex[i] to first_vertex[i + 1]


class Interfaces(NamedTuple):
    """Common edges of two blocks; m of them, each with q contacts; interfaces with the ground come last.

    The normal points from block a to block b, the tangent is (normal_y, -normal_x). The ground is block n. The edge
    of a deformable block moves piece by piece: each piece that an interface joins is a body, number n + 1 and up.
    """

    block_a: IntArray  # (m,)
    block_b: IntArray
    body_a: IntArray  # (m,): bodies that move the two sides: the rigid block itself, or a piece of its facet
    body_b: IntArray
    kind: Int8Array  # (m,): a ``ContactKind``
    joint: IntArray  # (m,): number of the mortar joint; strengths vary from joint to joint
    x: FloatArray  # (m,): middle of the edge (m)
    y: FloatArray
    length: FloatArray  # (m,): length of the edge (m)
    normal_x: FloatArray  # (m,): unit normal from a to b
    normal_y: FloatArray
    # (m,): displacement of the middle along normal and tangent per unit rotation of a, of b (m)
    arm_normal_a: FloatArray
    arm_shear_a: FloatArray
    arm_normal_b: FloatArray
    arm_shear_b: FloatArray
    contact_offset: FloatArray  # (m, q): position of the contacts along the tangent from the middle (m)
    contact_area: FloatArray  # (m, q): tributary area (m2)
    elastic: ElasticSides | None = None  # displacement of the sides by elastic blocks

    def taken(self, listed: IntArray) -> Interfaces:
        """Interfaces of a list, in its order, without elastic blocks."""
        return Interfaces(*(values[listed] for values in self[:-1]))  # type: ignore[arg-type]


class InterfaceRecords(NamedTuple):
    """Interfaces for kernels: a call with few arrays takes less time than one with many."""

    edge: np.ndarray  # (m,): records of EDGE
    contact_offset: FloatArray
    contact_area: FloatArray
    elastic: ElasticSides | None
    properties: np.ndarray  # (m,): records of JOINT_PARAMETERS


class Joints(NamedTuple):
    """Mortar joints: a bed under one unit, or a perpend; j of them, course by course, left to right."""

    kind: Int8Array  # (j,): a ``ContactKind``
    course: IntArray  # (j,): course of the unit on the bed, or of the perpend; -1 without courses
    x: FloatArray  # (j,): middle of the joint (m)
    y: FloatArray


class JointProperties(NamedTuple):
    """Law of each interface (m,): the fields of ``damagepred.scene.Joint``, with stiffness as the solver uses it.

    Fracture energies become ``critical_opening`` (m), w_c = 2 G_f / f_t, at which tension reaches 0, elastic
    opening included, or 0 where the bond breaks at once; and ``critical_slip`` (m), s_c = 2 G_f / (C - C_r), at
    which the bond is worn off, or 0 where slip does not soften it. A joint without cap has an infinite
    ``compressive_strength``. ``softening_shape`` (1) is 0 for linear softening, as w_c and s_c assume; see
    ``damagepred.kernels.joint.softening``. ``gap`` (m) is the closing of an interface without bond before it is in
    contact, 0 except in control joints.
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
    """Displacement of the ground under its contacts, the last g interfaces (with strained bricks: under all)."""

    # (g, q): along normal and tangent, subtracted from the opening of the joint on block b's side (m)
    normal: FloatArray
    shear: FloatArray

    def largest(self) -> float:
        """Largest displacement (m)."""
        return float(np.hypot(self.normal, self.shear).max(initial=0.0))


@dataclass(frozen=True, eq=False)
class GroundMovement:
    """Displacement of the ground as a function of the load factor; 0 at load factor 0."""

    full: Ground  # state at load factor 1
    at: Callable[[float], Ground]  # load factor -> state
    proportional: bool  # whether every state is the full one times the load factor
    reverses: bool = False  # whether the load factor also goes down to -1
    sampled_states: int = 8  # states of a growing movement, at equal steps of the load factor, in ``states``

    @classmethod
    def through(cls, state: Callable[[float], Ground], proportional: bool, reverses: bool = False) -> GroundMovement:
        """Movement through given states: load factor -> state; multiples of the full one if they are proportional."""
        full = state(1.0)

        def multiple(factor: float) -> Ground:
            return Ground(factor * full.normal, factor * full.shear)

        recent = lru_cache(maxsize=32)(multiple if proportional else state)  # solvers repeat the same few
        return cls(full, recent, proportional, reverses)

    @property
    def moves(self) -> bool:
        """Whether the ground moves at all."""
        return any(state.normal.any() or state.shear.any() for state in self.states())

    def load_factor_at(self, coordinate: float) -> float:
        """Load factor of the movement at a path coordinate; the two differ in an ``ImposedHistory``."""
        return coordinate

    def load_factor_rate(self, coordinate: float) -> float:
        """Load factor per path coordinate in the step that begins at a coordinate (1)."""
        return 1.0

    def states(self) -> tuple[Ground, ...]:
        """Representative states: the full one, and samples in between where the form changes."""
        if self.proportional:
            return (self.full,)
        return tuple(self.at(factor) for factor in self._sampled_factors())

    def largest_rate(self) -> float:
        """Largest displacement over its load factor (m)."""
        if self.proportional:
            return self.full.largest()
        return max(self.at(factor).largest() / abs(factor) for factor in self._sampled_factors())

    def largest_standing(self) -> float:
        """Largest displacement all along the path (m); 0 where it begins with the path."""
        return 0.0

    def _sampled_factors(self) -> list[float]:
        factors: list[float] = np.linspace(1.0, 0.0, self.sampled_states, endpoint=False).tolist()
        return [*factors, *(-factor for factor in factors)] if self.reverses else factors

    def map(self, change: Callable[[Ground], Ground]) -> GroundMovement:
        """Movement with each state changed."""
        return GroundMovement.through(lambda factor: change(self.at(factor)), self.proportional, self.reverses)


class Supports(NamedTuple):
    """Supports, prescribed displacements and loads; degrees of freedom are 3 block + (0: x, 1: y, 2: rotation)."""

    prescribed: IntArray  # (p,): held or moved degrees of freedom
    prescribed_displacement: FloatArray  # (p,): from the start to full movement (m, rad)
    load: FloatArray  # (3 n,): dead load, self weight included (N, N m)
    # (3 n,): load at full movement, in proportion to the load factor, added to the dead load (N, N m)
    live_load: FloatArray
    start: FloatArray  # (p,): initial values (m, rad): 0, except where free under the dead load
    after_load: BoolArray  # (p,): free under the dead load, then held in position; see ``solvers.stages``

    @classmethod
    def none(cls, load: FloatArray) -> Supports:
        """Dead loads (3 n,) alone: no supports, no live load."""
        empty = np.empty(0)
        return cls(np.empty(0, np.int64), empty, load, np.zeros_like(load), empty, np.empty(0, np.bool_))

    def displacement(self, load_factor: float) -> FloatArray:
        """Prescribed displacements (p,) at a load factor of the movement (m, rad)."""
        return self.start + load_factor * self.prescribed_displacement


class Jacks(NamedTuple):
    """Jacks with equal loads, under load control or under control of the deflection."""

    push: FloatArray  # (size,): forces of jacks that push upwards with 1 N each
    at: FloatArray  # (j,): x of the jacks (m)
    ends: FloatArray  # (e,): x of the outer supports (m)
    deflection: float  # upward deflection of the footing's centre at full movement (m), under displacement control
    load: float  # of each jack at full movement (N), under load control, from the load of the level state
    by_load: bool  # load control; under the dead load the deflection is 0 in either case
    stop: str  # unloaded part that ends the path: "jacks" or "supports"; "" for none
    weights: FloatArray  # (size,): weights of the controlled deflection
    # jacks push only after the dead load, and the deflection counts from there; see ``solvers.stages``
    after_load: bool = False
    origin: float = 0.0  # zero of the deflection (m)

    @property
    def goal(self) -> float:
        """Deflection at full movement (m, upwards); 0 where the load is given."""
        return 0.0 if self.by_load else self.deflection


class LaboratoryTest(NamedTuple):
    """Measured load and displacement of a laboratory test, from the dead load on."""

    push: FloatArray  # (3 n,): loads that sum to 1 N; also the weights of their displacement
    gauge: FloatArray | None  # (3 n,): weights of the opening of the gauge
    force: float  # load at full movement under force control (N), otherwise 0


class Jambs(NamedTuple):
    """Ends of the jambs of o openings, which measure distortion: lower left and right, upper right and left."""

    block: IntArray  # (o, 4): blocks that hold the ends, -1 where the opening has no such jamb
    arm: FloatArray  # (o, 4, 2): position relative to the centroid of the block (m)

    @classmethod
    def none(cls) -> Jambs:
        """Jambs of a wall without openings."""
        return cls(np.empty((0, 4), dtype=np.int64), np.empty((0, 4, 2)))


class BlockLaw(NamedTuple):
    """Material of each block (n,), infinite where it does not yield; thickness (m) out of plane."""

    elastic_modulus: FloatArray
    poisson_ratio: FloatArray
    cohesion: FloatArray
    friction: FloatArray
    dilation: FloatArray
    tensile_strength: FloatArray
    thickness: FloatArray


@documented
@dataclass(frozen=True)
class Model:
    """Blocks, interfaces, laws, supports and loads; see the parts for units and signs.

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
    """The parts."""
    density: FloatArray
    """Mass density of the blocks (n,) (kg/m3)."""
    thickness: float
    """Out-of-plane thickness (m)."""
    span: float
    """Distance between the points to which the central deflection refers (m), usually the wall's length."""
    central_deflection: float
    """Deflection of the centre at full movement (m), not negative."""
    apex_limited: int
    """Number of joints whose tensile strength was cut to cohesion / friction, the apex of the cone."""
    snap_back_limited: int
    """Number of joints whose fracture energy, of mode I or II, is too small to soften: their bond breaks at once."""
    block_law: BlockLaw
    """Material of the blocks."""
    mesh: Mesh | None = None
    """Zones of the deformable blocks."""
    elastic: ElasticBlocks | None = None
    """Blocks that stretch and bend."""
    plane: str = "stress"
    """Whether zones are free or held out of plane."""
    edge_load: FloatArray | None = None
    live_edge_load: FloatArray | None = None
    """Dead and live load (size,) on single gridpoints, in the order of ``Mesh``'s degrees of freedom (N)."""
    loose_joint: JointProperties | None = None
    """One row: the law of contacts that are found during motion; by default the law of the first interface."""
    initial_velocity: FloatArray | None = None
    """x, y (m/s) and rotation (rad/s) (n, 3) at the start of a dynamic run; by default 0."""
    footing: IntArray | None = None
    """Blocks of the footing, left to right, where it is part of the model and finds its own shape."""
    deflection: FloatArray | None = None
    """Weights (size,) of all degrees of freedom in the footing's deflection: its centre relative to its ends (m,
    upwards). None: it is prescribed."""
    jacks: Jacks | None = None
    """Jacks under the footing."""
    sections: Sections | None = None
    """Sections of a reinforced-concrete footing, which crack; their law replaces the law of their contacts."""
    surface_movement: float | None = None
    """Characteristic surface movement at full movement (m), by which a site is classed."""
    settlement: Mapping[str, float] | None = None
    """Settlement of the ground and its other measures at full movement, by the names of their variables."""
    history: History | None = None
    """Increments of a movement history; by default equal increments to 1."""
    creep: JointCreep | None = None
    """Creep of the joints over the time of a history."""
    test: LaboratoryTest | None = None
    """Laboratory test under ``[[load]]``."""

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
        """Number, position and course of a block, for a message."""
        course = int(self.blocks.course[block])
        where = f"x = {self.blocks.x[block]:.3g} m, y = {self.blocks.y[block]:.3g} m"
        return f"block {block} ({where}" + (f", course {course + 1})" if course >= 0 else ")")

    def support_displacement(self, coordinate: float) -> FloatArray:
        """Prescribed displacements (p,) at a path coordinate (m, rad)."""
        return self.supports.displacement(self.ground.load_factor_at(coordinate))

    @cached_property
    def joint_parameters(self) -> np.ndarray:
        """Parameters of the joint law of the interfaces, records (m,) of ``JointParameters``."""
        return joint_parameters(self.properties)

    @cached_property
    def interface_records(self) -> InterfaceRecords:
        """Interfaces for kernels."""
        face = self.interfaces
        edge = np.empty(len(face.kind), EDGE)
        for name in EDGE.names or ():
            edge[name] = getattr(face, name)
        return InterfaceRecords(edge, face.contact_offset, face.contact_area, face.elastic, self.joint_parameters)

    @cached_property
    def moves(self) -> BoolArray:
        """Whether each block (n,) has a free degree of freedom."""
        free = np.ones(3 * self.n_blocks, dtype=np.bool_)
        free[self.supports.prescribed[self.supports.prescribed < free.size]] = False
        return np.asarray(free.reshape(-1, 3).any(axis=1))

    @property
    def mean_block_weight(self) -> float:
        """Mean weight of a free block (N), from the dead loads, otherwise the live ones; scale of unbalanced forces."""
        for which in (self.moves, ~self.moves):
            for load in (self.supports.load, self.supports.live_load):
                forces = load.reshape(-1, 3)[which, :2]
                total = float(np.hypot(forces[:, 0], forces[:, 1]).mean()) if which.any() else 0.0
                if total > 0:
                    return total
        return 1.0

    @property
    def on_ground(self) -> BoolArray:
        """Whether each interface (m,) is with the ground."""
        return np.asarray(self.interfaces.block_a == self.n_blocks)

    @property
    def is_strained(self) -> bool:
        """Whether blocks have a free strain, so that every interface has an imposed displacement."""
        return len(self.ground.full.normal) > int(self.on_ground.sum())

    @property
    def block_share(self) -> FloatArray:
        """Modelled share of each block (n,): 1/2 on the axis of a half wall, otherwise 1."""
        return np.ones(self.n_blocks)

    @property
    def guides(self) -> BoolArray:
        """Whether each interface (m,) is a guide without shear on the axis of a half wall, which supports no block."""
        return np.zeros(len(self.interfaces.kind), dtype=np.bool_)

    @property
    def block_stress(self) -> float:
        """Mean block weight over the largest contact area (Pa): scale of joint stresses."""
        return self.mean_block_weight / (float(self.interfaces.contact_area.max(initial=0.0)) or 1.0)
