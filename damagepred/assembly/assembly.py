"""Any set of convex blocks with supports, loads and a direction of gravity, made into a model."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.assembly import interfaces
from damagepred.assembly.brick_cracks import whole_centres
from damagepred.assembly.elastic_blocks import elastic_blocks
from damagepred.assembly.geometry import SharedEdges, convex_polygon, mass_properties, refuse_overlaps, shared_edges
from damagepred.assembly.interfaces import BEARING_WIDTH, Geometry, Grounded
from damagepred.assembly.mesh import Mesh, default_zone_size, mesh_of
from damagepred.assembly.model import Blocks, Jambs, Model, Supports
from damagepred.assembly.points import Amount, Hold, Traction, Where, edge_loads, held_too
from damagepred.assembly.properties import (
    Fields,
    block_law,
    brittle_where_soft,
    joint_properties,
    lump_block_elasticity,
    no_tension_joint,
)
from damagepred.enumerations import ContactKind
from damagepred.errors import InputError, require_number
from damagepred.inputs.arguments import checked
from damagepred.runtime.one_thread import one_blas_thread
from damagepred.scene import BlockMaterial, Joint, Solver

GRAVITY = 9.81
"""Acceleration of gravity (m/s2)."""

LARGEST_DISPLACEMENT = 1e4  # limit of input (m, rad): above it, a mistaken unit is likely
LARGEST_STRAIN = 0.01  # strain of a block, as in ``[strain]``
NO_JAMBS = Jambs.none()

NEVER_CUT = (ContactKind.SUPPORT, ContactKind.CONTROL_JOINT)
"""Interfaces that are never cut into parts: point bearings and gaps."""


XY = tuple[float, float]


class Assembly:
    """Blocks with their supports, loads and prescribed movements.

    Parameters
    ----------
    thickness : float
        Out of plane (m).
    gravity : tuple of float
        Acceleration of gravity as a vector (m/s2); turn it to tilt the wall.
    joint : Joint
        Material of all joints not set otherwise.
    block : BlockMaterial
        Material of all blocks not given their own.

    Examples
    --------
    A brick on a moving plate:

    >>> wall = Assembly(thickness=0.11)
    >>> plate = wall.add_block([(0, -0.1), (1, -0.1), (1, 0), (0, 0)])
    >>> brick = wall.add_block([(0.2, 0), (0.8, 0), (0.8, 0.3), (0.2, 0.3)])
    >>> wall.support(plate)
    >>> wall.move(plate, y=-0.002)
    >>> wall.build().n_contacts  # three in each of four parts of the joint
    12
    """

    @checked
    def __init__(
        self,
        thickness: float = 0.11,
        gravity: XY = (0.0, -GRAVITY),
        joint: Joint | None = None,
        block: BlockMaterial | None = None,
    ) -> None:
        if not (np.isfinite(thickness) and thickness > 0):
            raise InputError(f"thickness = {thickness!r}: must be a finite number greater than 0 m.")
        self.thickness = float(thickness)
        self.gravity = (float(gravity[0]), float(gravity[1]))
        self._polygons: list[FloatArray] = []
        self._course: list[int] = []
        self._block_materials = [block or BlockMaterial()]
        self._block_material: list[int] = []
        self._zone_size: list[float | None] = []
        self._elastic: list[bool | None] = []
        self._thickness: list[float] = []
        self._joint_materials = [joint or Joint()]
        self._pairs: dict[tuple[int, int], tuple[int, ContactKind | None]] = {}
        self._levels: dict[int, tuple[int, ContactKind]] = {}
        self._ground: list[Grounded] = []
        self._bearings: list[Grounded] = []
        self._ground_rise: interfaces.Rise | None = None
        self._ground_is_proportional = True
        self._load: dict[int, FloatArray] = {}
        self._push: dict[int, FloatArray] = {}
        self._push_body = np.zeros(2)
        self._prescribed: dict[int, float] = {}
        self._after_load: set[int] = set()
        self._holds: list[Hold] = []
        self._tractions: list[Traction] = []
        self._velocity: dict[int, tuple[float, float, float]] = {}
        self._strain: dict[int, float] = {}

    @property
    def n_blocks(self) -> int:
        """Number of blocks."""
        return len(self._polygons)

    @checked
    def add_block(
        self,
        vertices: Any,
        material: BlockMaterial | None = None,
        course: int = -1,
        *,
        zone_size: float | None = None,
        elastic: bool | None = None,
        thickness: float | None = None,
    ) -> int:
        """Add a convex polygon and return its number.

        Parameters
        ----------
        vertices : array_like (v, 2)
            Corners in order, either way round (m).
        material : BlockMaterial, optional
            Material of the block; by default the material of the assembly.
        course : int
            Course of the block, counted from 0; -1 without courses.
        zone_size : float, optional
            Largest edge of the cells, of four zones each (m): makes the block deformable, whatever the solver's
            settings. 0 keeps it rigid.
        elastic : bool, optional
            Whether the block, a rectangle, stretches and bends, whatever the solver's settings: by default it does,
            unless it is supported or moved, or other blocks have zones.
        thickness : float, optional
            Out-of-plane thickness (m); by default the thickness of the assembly.

        Raises
        ------
        InputError
            If the polygon is degenerate or not convex, or a size is not a length.
        """
        number = len(self._polygons)
        for name, value, least in (("zone_size", zone_size, 0.0), ("thickness", thickness, np.nextafter(0.0, 1.0))):
            if value is not None and not (np.isfinite(value) and value >= least):
                raise InputError(f"block {number}: {name} = {value!r}: must be a finite length in m, not negative.")
        self._polygons.append(convex_polygon(vertices, f"block {number}"))
        self._course.append(course)
        self._zone_size.append(zone_size)
        self._elastic.append(elastic)
        self._thickness.append(self.thickness if thickness is None else float(thickness))
        self._block_material.append(_numbered(self._block_materials, material))
        return number

    @checked
    def set_joint(self, a: int, b: int, joint: Joint, kind: ContactKind | None = None) -> None:
        """Set the material, and optionally the kind, of the joint between two blocks.

        Parameters
        ----------
        a, b : int
            The blocks, in either order.
        joint : Joint
            Material.
        kind : ContactKind, optional
            Kind of the joint; by default from its direction.
        """
        self._check(a)
        self._check(b)
        self._pairs[min(a, b), max(a, b)] = (_numbered(self._joint_materials, joint), kind)

    @checked
    def set_joint_above(self, course: int, joint: Joint, kind: ContactKind = ContactKind.DPC) -> None:
        """Set the material and kind of the whole bed joint on top of a course.

        Parameters
        ----------
        course : int
            Number of the course, from 0.
        joint : Joint
            Material of the bed joint.
        kind : ContactKind
            Kind of its contacts.
        """
        self._joint_materials.append(joint)
        self._levels[course] = (len(self._joint_materials) - 1, kind)

    @checked
    def rest_on_ground(
        self,
        blocks: Iterable[int],
        displacement: Callable[[FloatArray], FloatArray] | None = None,
        joint: Joint | None = None,
        kind: ContactKind = ContactKind.FOOTING_INTERFACE,
        growth: Callable[[FloatArray, float], FloatArray] | None = None,
    ) -> None:
        """Let the underside of blocks rest on a ground whose every point moves vertically as prescribed.

        Parameters
        ----------
        blocks : iterable of int
            Blocks; their lowest edge must be level.
        displacement : callable, optional
            x (m) -> vertical displacement at full movement (m, upwards); None: the ground stays.
        joint : Joint, optional
            Material of the joint between blocks and ground.
        kind : ContactKind
            Kind of the interfaces.
        growth : callable, optional
            Instead of ``displacement``, where the form of the ground changes as its movement grows, as a trough that
            widens: x (m), load factor from 0 to 1 -> vertical displacement (m, upwards), 0 at load factor 0.

        Raises
        ------
        InputError
            If both are given.
        """
        if displacement is not None and growth is not None:
            raise InputError("rest_on_ground: takes displacement or growth, not both.")
        material = _numbered(self._joint_materials, joint)
        listed = dict.fromkeys(self._check(b) for b in blocks)
        self._ground = [Grounded(block, None, material, kind) for block in listed]
        self._ground_rise = growth if displacement is None else lambda x, _: displacement(x)
        self._ground_is_proportional = growth is None

    @checked
    def bear(self, block: int, x: float, joint: Joint | None = None, *, width: float = BEARING_WIDTH) -> None:
        """Support a block on the ground in one point of its underside, on a knife edge.

        Parameters
        ----------
        block : int
            Block; its lowest edge must be level.
        x : float
            Middle of the bearing (m).
        joint : Joint, optional
            Material of the bearing, for its area: width times the block's thickness.
        width : float
            Width of the bearing (m).
        """
        corners = self._polygons[self._check(block)][:, 0]
        rounding = 1e-6 * float(np.ptp(corners))  # coordinates of blocks are rounded
        require_number("x", x, float(corners.min()) - rounding, float(corners.max()) + rounding, unit="m")
        require_number("width", width, 0.0, float(np.ptp(corners)), unit="m", open_low=True)
        material = _numbered(self._joint_materials, joint)
        self._bearings.append(Grounded(self._check(block), float(x), material, ContactKind.SUPPORT, width))

    @checked
    def support(self, block: int, *, x: bool = True, y: bool = True, rotation: bool = True) -> None:
        """Hold a block in the directions that are True.

        Parameters
        ----------
        block : int
            Number of the block.
        x, y, rotation : bool
            Whether that degree of freedom is prescribed as zero.
        """
        for axis, held in enumerate((x, y, rotation)):
            if held:
                dof = 3 * self._check(block) + axis
                self._prescribed[dof] = 0.0
                self._after_load.discard(dof)

    @checked
    def hold_after_load(self, block: int, *, x: bool = True, y: bool = True, rotation: bool = True) -> None:
        """Leave a block free under the dead load, then hold it in its position in the directions that are True.

        For a loading beam that follows the wall under its preload and then keeps its height. ``move`` then starts from
        this position.

        Parameters
        ----------
        block, x, y, rotation
            Same as for ``support``.
        """
        for axis, held in enumerate((x, y, rotation)):
            if held:
                dof = 3 * self._check(block) + axis
                self._prescribed.setdefault(dof, 0.0)
                self._after_load.add(dof)

    @checked
    def move(
        self, block: int, *, x: float | None = None, y: float | None = None, rotation: float | None = None
    ) -> None:
        """Move a block by the given displacement (m, m, rad; small) over the whole path.

        Directions left out stay as they are: free, or held if the block is supported.

        Parameters
        ----------
        block : int
            Number of the block.
        x, y : float, optional
            Displacement (m).
        rotation : float, optional
            Rotation, counter-clockwise (rad).
        """
        for axis, value in enumerate((x, y, rotation)):
            if value is None:
                continue
            amount = require_number(
                f"block {block}: displacement", value, -LARGEST_DISPLACEMENT, LARGEST_DISPLACEMENT, unit="m or rad"
            )
            self._prescribed[3 * self._check(block) + axis] = amount

    @checked
    def strain(self, block: int, strain: float) -> None:
        """Set the free strain of a block: growth, shrinkage or temperature.

        It is isotropic, 0 under the dead load, and grows in proportion to the movement.

        Parameters
        ----------
        block : int
            Number of the block.
        strain : float
            Strain at full movement (1), longer is positive.
        """
        self._strain[self._check(block)] = require_number(
            f"block {block}: strain", strain, -LARGEST_STRAIN, LARGEST_STRAIN, unit="1"
        )

    @checked
    def hold_points(self, block: int, where: Where, *, x: Amount | None = None, y: Amount | None = None) -> None:
        """Hold or move gridpoints of a deformable block.

        Parameters
        ----------
        block : int
            The block.
        where : callable
            Arrays x, y of gridpoints (m) -> mask of the gridpoints to hold.
        x, y : float or callable, optional
            Displacement at full movement (m), 0 to hold, or a function of x and y (m). Directions left out stay free.
        """
        for amount in (x, y):
            if amount is not None and not callable(amount):
                limits = -LARGEST_DISPLACEMENT, LARGEST_DISPLACEMENT
                require_number(f"block {block}: displacement", amount, *limits, unit="m")
        self._holds.append(Hold(self._check(block), where, x, y))

    @checked
    def traction(self, block: int, where: Where, *, x: Amount = 0.0, y: Amount = 0.0, live: bool = False) -> None:
        """Load edges of a deformable block.

        Parameters
        ----------
        block : int
            The block.
        where : callable
            Arrays x, y of the middles of facets (m) -> mask of the facets to load.
        x, y : float or callable
            Force per area (Pa), or a function of x and y (m).
        live : bool
            Whether it grows with the movement, or acts as dead load.
        """
        self._tractions.append(Traction(self._check(block), where, x, y, live))

    @checked
    def set_velocity(self, block: int, *, x: float = 0.0, y: float = 0.0, rotation: float = 0.0) -> None:
        """Set the initial velocity of a block in a dynamic run.

        Parameters
        ----------
        block : int
            Number of the block.
        x, y, rotation : float
            Velocity of its centroid (m/s), and rotation, counter-clockwise (rad/s).
        """
        self._velocity[self._check(block)] = (float(x), float(y), float(rotation))

    @checked
    def load(self, block: int, *, x: float = 0.0, y: float = 0.0, moment: float = 0.0, at: XY | None = None) -> None:
        """Add a dead load to a block.

        Parameters
        ----------
        block : int
            The block.
        x, y, moment : float
            Force (N) and moment (N m, counter-clockwise).
        at : tuple of float, optional
            Where the force acts (m); by default at the centroid.
        """
        self._load[block] = self._load.get(block, np.zeros(3)) + self._force(block, (x, y), moment, at)

    @checked
    def push(self, block: int, *, x: float = 0.0, y: float = 0.0, moment: float = 0.0, at: XY | None = None) -> None:
        """Add a live load to a block: 0 under the dead load, then in proportion to the movement.

        If the wall collapses, the attribute ``collapse_progress`` is the last load factor in equilibrium.

        Parameters
        ----------
        block, x, y, moment, at
            Same as for ``load``, at full movement.
        """
        self._push[block] = self._push.get(block, np.zeros(3)) + self._force(block, (x, y), moment, at)

    @checked
    def push_body(self, *, x: float = 0.0, y: float = 0.0) -> None:
        """Add a live load to all blocks: multiples of their weight along x and y at full movement.

        Parameters
        ----------
        x, y : float
            Load over weight (1).
        """
        self._push_body = self._push_body + np.array([x, y])

    def _force(self, block: int, force: XY, moment: float, at: XY | None) -> FloatArray:
        self._check(block)
        x, y = force
        if at is not None:
            _, cx, cy, _ = mass_properties(self._polygons[block])
            moment += (at[0] - cx) * y - (at[1] - cy) * x
        return np.array([x, y, moment])

    def _check(self, block: int) -> int:
        last = len(self._polygons) - 1
        if not 0 <= block <= last:
            raise InputError(f"block {block}: there is no such block; they are numbered 0 to {last}.")
        return int(block)

    # -- building -----------------------------------------------------------------------------------------------

    @checked
    def geometry(self, solver: Solver | None = None, no_tension: frozenset[ContactKind] = frozenset()) -> Geometry:
        """Find the interfaces and place their contacts.

        Parameters
        ----------
        solver : Solver, optional
            Quadrature and settings of zones.
        no_tension : frozenset of ContactKind
            More kinds of interface without a bond; a joint material without bond needs no mention.

        Raises
        ------
        InputError
            If there are no blocks, or two of them overlap.
        """
        if not self._polygons:
            raise InputError("the assembly has no blocks; add some with add_block.")
        settings = solver or Solver()
        blocks = self._blocks()
        tolerance = 1e-6 * float(np.sqrt(blocks.area.min()))
        refuse_overlaps(blocks.vertices, blocks.first_vertex, tolerance)
        mesh = mesh_of(self._polygons, self._zone_sizes(settings))
        ratios = [self._block_materials[number].poisson_ratio for number in self._block_material]
        left = [a for (a, b), (_, kind) in self._pairs.items() if kind == ContactKind.BRICK_JOINT and b == a + 1]
        elastic = elastic_blocks(self._polygons, self._are_elastic(settings, mesh), ratios, left)
        outline, first_vertex, facet = interfaces.outlines(blocks, mesh)
        shared = shared_edges(outline, first_vertex, tolerance)
        grounded, resting = interfaces.ground_edges(outline, first_vertex, self._ground + self._bearings)
        edges = interfaces.joined(shared, grounded)
        kind, material = interfaces.classified(edges, blocks, resting, self._levels, self._pairs)
        bare = np.array([no_tension_joint(joint) for joint in self._joint_materials])[material]
        bare = (bare | np.isin(kind, list(no_tension))) & ~np.isin(kind, NEVER_CUT)
        parts = np.where(bare, settings.no_tension_parts, 1)
        if elastic is not None:
            parts = np.maximum(parts, elastic.parts(edges, settings.elastic_subdivisions))
        edges, whole = interfaces.cut(edges, parts)
        kind, material = kind[whole], material[whole]
        on_ground = int((edges.a == len(blocks.x)).sum())
        order = interfaces.in_order(edges, kind, blocks, on_ground)
        edges = SharedEdges(*(column[order] for column in edges))  # type: ignore[arg-type]
        kind, material = kind[order], material[order]
        joint, joints = interfaces.number_joints(edges, kind, blocks)
        mesh, body_a, body_b = interfaces.bodies_of(edges, facet, len(blocks.x), mesh)
        bodies, thickness = (body_a, body_b), np.array(self._thickness)
        faces = interfaces.place_contacts(edges, kind, joint, bodies, blocks, mesh, elastic, settings, thickness)
        first = len(kind) - on_ground
        ground_x = faces.x[first:, None] + faces.normal_y[first:, None] * faces.contact_offset[first:]
        return Geometry(blocks, faces, joints, material, ground_x, mesh, elastic)

    def _zone_sizes(self, settings: Solver) -> dict[int, float]:
        """Deformable blocks and the size of their cells; supported, moved and loaded blocks are rigid."""
        held = {dof // 3 for dof in self._prescribed}
        sizes = {}
        for block, given in enumerate(self._zone_size):
            size = given
            if given is None and settings.blocks == "deformable" and block not in held:
                size = settings.zone_size or default_zone_size(self._polygons[block], settings.method)
            if not size:
                continue
            if block in held:
                raise InputError(f"block {block}: cannot be held as a whole and be deformable; leave out zone_size.")
            sizes[block] = size
        return sizes

    def _are_elastic(self, settings: Solver, mesh: Mesh | None) -> list[bool]:
        """Whether each block shall stretch and bend; supported and moved blocks are rigid."""
        held = {dof // 3 for dof in self._prescribed}
        stated = getattr(settings, "stated", {})  # by default no block is elastic where others have zones
        default = settings.blocks == "elastic" and (mesh is None or not {"blocks", "accuracy"}.isdisjoint(stated))
        wanted = (default if given is None else given for given in self._elastic)
        chosen = [elastic and block not in held for block, elastic in enumerate(wanted)]
        if mesh is not None and any(chosen):
            raise InputError(
                "elastic blocks and blocks of zones do not go together in one wall; take solver.blocks = 'rigid' with "
                "zones, or leave zones out."
            )
        return chosen

    @checked
    @one_blas_thread()
    def build(self, solver: Solver | None = None, fields: Fields | None = None, span: float | None = None) -> Model:
        """Model for the solvers.

        Parameters
        ----------
        solver : Solver, optional
            Quadrature, and whether block elasticity is lumped into the joints.
        fields : mapping, optional
            Joint values that vary from joint to joint; see ``damagepred.assembly.properties.Fields``.
        span : float, optional
            Length to which the central deflection refers (m); by default the extent of the blocks.
        """
        settings = solver or Solver()
        geometry = self.geometry(settings)
        blocks = geometry.blocks
        block_material = np.array(self._block_material)
        faces, materials = geometry.interfaces, self._joint_materials
        properties, limited = joint_properties(materials, geometry.joint_material, faces.joint, fields or {})
        if settings.lump_block_elasticity:
            centres = whole_centres(geometry.interfaces, blocks)
            bodies = self._block_materials, block_material
            properties = lump_block_elasticity(properties, faces, centres, *bodies, elastic=geometry.elastic)
        properties, snap_back = brittle_where_soft(properties, geometry.interfaces.joint)
        law = block_law(self._block_materials, block_material, np.array(self._thickness))
        density = np.array([m.density for m in self._block_materials])[block_material]
        load, live = np.zeros((len(density), 3)), np.zeros((len(density), 3))
        mass = density * blocks.area * law.thickness
        load[:, :2] = mass[:, None] * np.array(self.gravity)
        live[:, :2] = mass[:, None] * float(np.hypot(*self.gravity)) * self._push_body
        for total, loads in ((load, self._load), (live, self._push)):
            for block, extra in loads.items():
                total[block] += extra
        dofs = np.array(sorted(self._prescribed), dtype=np.int64)
        supports = Supports(
            prescribed=dofs,
            prescribed_displacement=np.array([self._prescribed[dof] for dof in dofs.tolist()], dtype=np.float64),
            load=load.ravel(),
            live_load=live.ravel(),
            start=np.zeros(len(dofs)),
            after_load=np.isin(dofs, list(self._after_load)),
        )
        dead_edges, live_edges = edge_loads(self._tractions, geometry.mesh, law.thickness)
        velocity = np.zeros((len(density), 3))
        for block, start in self._velocity.items():
            velocity[block] = start
        first_material = np.zeros(1, dtype=np.int64)
        extent = float(np.ptp(blocks.vertices[:, 0]))
        middle, rise = float(blocks.vertices[:, 0].min()) + extent / 2, self._ground_rise
        ground = interfaces.ground_movement(geometry, rise, proportional=self._ground_is_proportional)
        if self._strain:
            strains = np.array([self._strain.get(block, 0.0) for block in range(self.n_blocks)])
            ground = interfaces.with_strain(ground, interfaces.displacement_by_strain(geometry, strains))
        return Model(
            blocks=blocks,
            interfaces=geometry.interfaces,
            properties=properties,
            ground=ground,
            supports=held_too(supports, self._holds, geometry.mesh),
            jambs=NO_JAMBS,
            joints=geometry.joints,
            density=density,
            thickness=self.thickness,
            span=extent if span is None else span,
            central_deflection=abs(float(rise(np.array([middle]), 1.0)[0])) if rise else self._largest_movement(),
            apex_limited=limited,
            snap_back_limited=snap_back,
            block_law=law,
            mesh=geometry.mesh,
            elastic=geometry.elastic,
            plane=settings.plane,
            edge_load=dead_edges,
            live_edge_load=live_edges,
            loose_joint=joint_properties(self._joint_materials[:1], first_material, first_material, {})[0],
            initial_velocity=velocity if self._velocity else None,
        )

    def _largest_movement(self) -> float:
        return max((abs(v) for d, v in self._prescribed.items() if d % 3 < 2), default=0.0)

    def _blocks(self) -> Blocks:
        area, x, y, polar = np.array([mass_properties(p) for p in self._polygons]).T
        course, first_vertex = np.array(self._course, np.int64), np.cumsum([0, *map(len, self._polygons)])
        return Blocks(x, y, area, polar, course, np.concatenate(self._polygons), first_vertex)


def _numbered(materials: list[Any], material: object | None) -> int:
    if material is None:
        return 0
    if material not in materials:
        materials.append(material)
    return materials.index(material)


def rectangle(left: float, bottom: float, right: float, top: float) -> Sequence[tuple[float, float]]:
    """Corners of a rectangle, counter-clockwise (m)."""
    return [(left, bottom), (right, bottom), (right, top), (left, top)]
