"""Model of a scene. All samples that share a geometry compute it once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.assembly import footing_beam, loading
from damagepred.assembly.assembly import GRAVITY, NO_JAMBS, Assembly, rectangle
from damagepred.assembly.bond import Brick, gauge, halved, lay_bricks, parted
from damagepred.assembly.brick_cracks import brick_joint, bricks_break, whole_centres, with_brick_stiffness
from damagepred.assembly.footing_beam import Foundation, add_footing, deflection_of, foundation, upward
from damagepred.assembly.imposed_history import ImposedHistory
from damagepred.assembly.interfaces import Geometry, displacement_by_strain, ground_movement, with_strain
from damagepred.assembly.joint_creep import JointCreep
from damagepred.assembly.mesh import default_zone_size
from damagepred.assembly.model import GroundMovement, Jambs, Model, Supports
from damagepred.assembly.points import Hold, held_too
from damagepred.assembly.properties import (
    block_law,
    brittle_where_soft,
    joint_properties,
    lump_block_elasticity,
    no_tension_joint,
    softened,
)
from damagepred.enumerations import ContactKind
from damagepred.errors import InputError
from damagepred.inputs.arguments import checked
from damagepred.runtime.one_thread import one_blas_thread
from damagepred.scene import (
    BlockMaterial,
    ControlJoint,
    Dpc,
    Joint,
    Movement,
    Opening,
    Scene,
    Solver,
    Support,
    Wall,
)
from damagepred.scene.house import require_one_wall

ZONING = (
    *("method", "blocks", "above_dpc", "below_dpc", "footing", "elastic_subdivisions"),
    *("zone_size", "zone_size_above_dpc", "zone_size_below_dpc", "zone_size_footing"),
)
"""Settings that decide on zones and elastic blocks."""
MORTAR, DPC, BED, SOIL, SUPPORT, SECTION, CONTROL, HEAD, BRICK = range(9)
"""Numbers of the joint materials of a wall; BED lies between footing and first course."""
CREEPING = (MORTAR, DPC, BED, HEAD)  # joint materials that creep
STEP_MARGIN = 1e-9
"""Distance of a contact from the end of its brick, over the brick's half length, at a step of the ground."""
IN_KIND = np.array([MORTAR, HEAD, DPC, BED, SOIL, SUPPORT, SECTION, CONTROL, BRICK])
"""Joint material of the interfaces of each kind."""


class WallGeometry(NamedTuple):
    """Geometry shared by all samples of a wall."""

    geometry: Geometry  # bricks first, then the footing
    bricks: tuple[Brick, ...]
    jambs: Jambs
    footing: IntArray  # blocks of the footing, left to right; empty if the wall's underside itself is moved
    control: IntArray  # (m,): number of the control joint of each interface, or -1
    sides: loading.Sides


@lru_cache(maxsize=16)  # a house has one per wall
def _geometry(
    wall: Wall,
    opening: tuple[Opening, ...],
    control_joint: tuple[ControlJoint, ...],
    dpc_course: int | None,
    solver: Solver,
    footing_shape: Foundation | None,
    no_tension: frozenset[ContactKind],
    poisson_ratio: float,
    supports: tuple[Support, ...],
    beam: bool,
    breaks: bool,
) -> WallGeometry:
    dpc = None if dpc_course is None else Dpc(course=dpc_course)
    # the movement does not shape the bricks; its default is too much for a short wall
    still = Movement(central_deflection=0.0)
    scene = Scene(wall=wall, opening=opening, control_joint=control_joint, dpc=dpc, movement=still)
    laid = lay_bricks(scene)
    splits = [breaks and _blocks_at(brick, solver, dpc_course) != "deformable" for brick in laid]
    bricks, left = halved(laid, wall.block_length, splits)
    assembly = Assembly(thickness=wall.thickness, block=BlockMaterial(poisson_ratio=poisson_ratio))
    for brick in bricks:
        corners = rectangle(brick.left, brick.bottom, brick.right, brick.top)
        blocks = _blocks_at(brick, solver, dpc_course)
        size = _zone_size(brick, solver, dpc_course)
        assembly.add_block(corners, course=brick.course, zone_size=size, elastic=blocks == "elastic")
    for i in left:
        assembly.set_joint(i, i + 1, Joint(), ContactKind.BRICK_JOINT)
    if dpc_course is not None:
        assembly.set_joint_above(dpc_course - 1, Joint(), ContactKind.DPC)
    meet = parted(scene, bricks)
    for first, second, _ in meet:
        assembly.set_joint(first, second, Joint(), ContactKind.CONTROL_JOINT)
    footing = np.empty(0, dtype=np.int64)
    if beam:
        assembly.add_block(rectangle(0.0, wall.height, wall.length, wall.height + wall.block_height), elastic=False)
    if supports:
        loading.add_supports(assembly, supports, bricks)
    elif footing_shape is None:
        assembly.rest_on_ground([i for i, brick in enumerate(bricks) if brick.course == 0])
    else:
        footing = add_footing(assembly, footing_shape, laid, wall.length, wall.block_length, bricks)
    geometry = assembly.geometry(solver, no_tension=no_tension)
    numbers = {(first, second): scene.control_joint.index(joint) for first, second, joint in meet}
    sides = zip(geometry.interfaces.block_a.tolist(), geometry.interfaces.block_b.tolist())
    control = np.array([numbers.get((min(pair), max(pair)), -1) for pair in sides], dtype=np.int64)
    jambs = _jambs(scene, bricks, geometry)
    return WallGeometry(geometry, tuple(bricks), jambs, footing, control, loading.sides_of(bricks, scene, beam))


@lru_cache(maxsize=8)
def _footing_alone(scene: Scene, solver: Solver, shape: Foundation) -> WallGeometry:
    wall = scene.wall
    assembly = Assembly(thickness=wall.thickness)
    bricks = lay_bricks(scene)
    footing = add_footing(assembly, shape, bricks, wall.length, wall.block_length, ())
    geometry = assembly.geometry(solver, no_tension=_no_tension(scene))
    return WallGeometry(geometry, (), NO_JAMBS, footing, np.full(len(geometry.interfaces.kind), -1), loading.NO_SIDES)


def _blocks_at(brick: Brick, solver: Solver, dpc_course: int | None) -> str:
    """Kind of block that the settings choose for a brick."""
    below = dpc_course is not None and brick.course < dpc_course
    return (solver.below_dpc if below else solver.above_dpc) or solver.blocks


def _zone_size(brick: Brick, solver: Solver, dpc_course: int | None) -> float:
    """Size of a brick's cells (m), 0 if it is rigid."""
    below = dpc_course is not None and brick.course < dpc_course
    if _blocks_at(brick, solver, dpc_course) != "deformable":
        return 0.0
    size = (solver.zone_size_below_dpc if below else solver.zone_size_above_dpc) or solver.zone_size
    corners = np.array(rectangle(brick.left, brick.bottom, brick.right, brick.top))
    return size or default_zone_size(corners, solver.method)


@checked
@one_blas_thread()
def wall_geometry(scene: Scene) -> Geometry:
    """Blocks, interfaces and joints of a scene's wall.

    Raises
    ------
    InputError
        If the bricks cannot be laid or the dpc would lie on the top course.

    Examples
    --------
    >>> from damagepred import Scene, assembly
    >>> geometry = assembly.wall_geometry(Scene.from_toml("wall.toml"))
    >>> len(geometry.joint_material)  # joints
    278
    """
    return _cached(scene).geometry


def _cached(scene: Scene) -> WallGeometry:
    require_one_wall(scene, "wall_model")
    course = None if scene.dpc is None else scene.dpc.course
    courses = len(gauge(scene).y) - 1
    if course is not None and course >= courses:
        raise InputError(f"dpc.course = {course}: the wall has {courses} courses; take 1 to {courses - 1}")
    meshing = _meshing(scene.solver)
    # the width of a gap does not change the geometry
    joints = tuple(replace(joint, width=0.0) for joint in scene.control_joint)
    # the contraction of elastic bricks changes the motion of their sides
    ratio = scene.block.poisson_ratio if "elastic" in (meshing.blocks, meshing.above_dpc, meshing.below_dpc) else 0.0
    leaf = scene.wall, scene.opening, joints, course, meshing, foundation(scene), _no_tension(scene), ratio
    return _geometry(*leaf, scene.support, loading.has_beam(scene), bricks_break(scene))


def _no_tension(scene: Scene) -> frozenset[ContactKind]:
    """Kinds of interface whose material has no bond."""
    material, materials = _material_of_kind(scene), _joint_materials(scene)
    return frozenset(kind for kind in ContactKind if no_tension_joint(materials[material[kind]]))


def _material_of_kind(scene: Scene) -> IntArray:
    """Joint material of the interfaces of each kind; without its own, the bed on footing or ground is of mortar."""
    return IN_KIND if scene.footing.joint is not None else np.where(IN_KIND == BED, MORTAR, IN_KIND)


def _meshing(solver: Solver) -> Solver:
    """Settings that shape the geometry, all others at their defaults: samples that differ in others share it."""
    defaults = Solver(blocks="rigid")
    given = (solver.blocks, solver.above_dpc, solver.below_dpc, solver.footing)
    zoned = not {"deformable", "elastic"}.isdisjoint(given)
    names = ("quadrature", "contacts_per_interface", "no_tension_subdivisions") + (ZONING if zoned else ())
    return replace(defaults, **{name: getattr(solver, name) for name in names})


@checked
@one_blas_thread()
def wall_model(scene: Scene, fields: Mapping[str, FloatArray] | None = None) -> Model:
    """Model of a scene.

    Parameters
    ----------
    scene : Scene
        The wall and its movement.
    fields : mapping of str to array (joints,), optional
        Values that vary from joint to joint: ``"joint.<name>"``, ``"head_joint.<name>"`` or ``"dpc.<name>"``, one value
        per joint of the wall in its order (joints of other materials are ignored).

    Raises
    ------
    InputError
        If the bricks cannot be laid, or a field has the wrong size.

    Examples
    --------
    >>> from damagepred import Scene, assembly
    >>> model = assembly.wall_model(Scene.from_toml("wall.toml"))
    >>> len(model.density)  # blocks
    109
    """
    geometry = _cached(scene)
    return _with_slow_strains(scene, _model(scene, geometry, fields or {}, 0.0), geometry)


@checked
def footing_alone(scene: Scene, line_load: float = 0.0) -> Model:
    """Model of a scene's footing without the wall, on the same supports and jacks, or the same ground.

    Parameters
    ----------
    scene : Scene
        With ``movement.shape`` jacks or mound.
    line_load : float
        Dead load along the footing, without its weight (N/m, downwards): its share of the wall.

    Raises
    ------
    InputError
        If the footing of the scene does not find its own shape.

    Examples
    --------
    >>> from damagepred import Scene, assembly
    >>> scene = Scene.from_dict({"footing": {}, "movement": {"shape": "jacks"}})
    >>> assembly.footing_alone(scene, line_load=10e3).jacks.at.tolist()
    [1.5, 3.0, 4.5]
    """
    require_one_wall(scene, "footing_alone")
    shape = foundation(scene)
    if shape is None or scene.movement.shape not in ("jacks", "mound"):
        raise InputError(
            f"movement.shape = '{scene.movement.shape}': prescribes the form of the footing; alone it takes 'jacks' or "
            "'mound'."
        )
    solver = _meshing(scene.solver)
    description = Scene(wall=scene.wall, opening=scene.opening, control_joint=scene.control_joint, dpc=scene.dpc)
    return _model(scene, _footing_alone(description, solver, shape), {}, line_load)


def _model(scene: Scene, shared: WallGeometry, fields: Mapping[str, FloatArray], line_load: float) -> Model:
    geometry, bricks, jambs, footing, control, sides = shared
    blocks, interfaces = geometry.blocks, geometry.interfaces
    material = _material_of_kind(scene)[interfaces.kind]
    fields_of = _by_material(fields, scene, len(geometry.mortar.kind))
    properties, limited = joint_properties(_joint_materials(scene), material, interfaces.joint, fields_of)
    concrete = {name: getattr(scene.footing, name) for name in ("elastic_modulus", "poisson_ratio", "density")}
    substances = [scene.block, BlockMaterial(**concrete)]
    substance = (np.arange(len(blocks.x)) >= len(bricks)).astype(np.int64)
    mortar = np.isin(material, CREEPING)
    if scene.creep is not None and scene.creep.relaxation_time is None:
        properties = softened(properties, mortar, scene.creep.coefficient)
    joints_alone = properties.normal_stiffness, properties.shear_stiffness
    places = whole_centres(interfaces, blocks)
    properties = with_brick_stiffness(properties, interfaces, bricks, scene.block)
    if scene.solver.lump_block_elasticity:
        # a beam's cross-section keeps its shape: its elasticity is in the interfaces between its segments
        bodies = substances, substance, len(bricks)
        properties = lump_block_elasticity(properties, interfaces, places, *bodies, geometry.elastic)
    properties, sections = footing_beam.section_law(properties, geometry, scene.footing)
    properties, snap_back = brittle_where_soft(properties, interfaces.joint)
    lumped = properties.normal_stiffness, properties.shear_stiffness
    widths = np.array([joint.width for joint in scene.control_joint] + [0.0])
    properties = properties._replace(gap=widths[control])
    density = np.array([s.density for s in substances])[substance]
    if loading.has_beam(scene):
        density[len(bricks)] = 0.0
    thickness = np.array([scene.wall.thickness, scene.footing.width])[substance]
    load = np.zeros((len(density), 3))
    load[:, 1] = -GRAVITY * density * blocks.area * thickness
    load += loading.dead_loads(scene, blocks, sides)
    length = scene.wall.length
    if line_load:
        load[footing, 1] -= line_load * length * blocks.area[footing] / blocks.area[footing].sum()
    measures = scene.movement.measures(scene.wall) if scene.movement.settles else None
    model = Model(
        blocks=blocks,
        interfaces=interfaces,
        properties=properties,
        ground=ground_movement(geometry, None),
        supports=Supports.none(load.ravel()),
        jambs=jambs,
        joints=geometry.joints,
        density=density,
        thickness=scene.wall.thickness,
        span=length,
        central_deflection=(measures or {}).get("central_deflection", scene.movement.central_deflection),
        settlement=measures,
        apex_limited=limited,
        snap_back_limited=snap_back,
        block_law=block_law(substances, substance, thickness),
        mesh=geometry.mesh,
        elastic=geometry.elastic,
        plane=scene.solver.plane,
        footing=footing if len(footing) else None,
        sections=sections,
        history=scene.movement.increments_of_history(),
        creep=JointCreep.of(scene.creep, mortar, joints_alone, lumped),
    )
    if scene.movement.shape == "jacks":
        return _on_jacks(scene, model, geometry, footing)
    if scene.movement.shape == "loads":
        return loading.under_loads(scene, model, bricks, sides)
    if scene.movement.shape == "mound":
        return _on_ground(scene, model, geometry, footing)
    holds = _moved_from_below(scene, len(bricks)) if len(footing) else []
    ground = _prescribed(geometry, scene.movement, length)
    return replace(model, ground=ground, supports=held_too(model.supports, holds, geometry.mesh))


def _prescribed(geometry: Geometry, movement: Movement, length: float) -> GroundMovement:
    """Movement of the ground by a prescribed profile, upwards and along the wall."""

    def rise(x: FloatArray, factor: float) -> FloatArray:
        if movement.shape == "step":  # contacts at the ends of two bricks lie on both sides of it
            x = x + STEP_MARGIN * (x.mean(axis=-1, keepdims=True) - x)
        return movement.profile(x, length, factor)

    moves_along = movement.moves_along and movement.proportional
    along = (lambda x, _: movement.horizontal_profile(x, length)) if moves_along else None
    return ground_movement(geometry, rise, along, movement.proportional)


def _with_slow_strains(scene: Scene, model: Model, shared: WallGeometry) -> Model:
    """Model with strain of the bricks and creep of the joints, which act on all interfaces."""
    strains, history = scene.strain_of_increments, model.history
    along = history is not None and not (strains is None and model.creep is None)
    if scene.strain is None and not along:
        return model
    of_bricks = np.where(np.arange(model.n_blocks) < len(shared.bricks), 1.0, 0.0)
    if along and history is not None:
        unit = displacement_by_strain(shared.geometry, of_bricks)
        ground = ImposedHistory.of(model.ground, unit, history, strains, model.creep)
        return replace(model, ground=ground, history=history._replace(strain=strains))
    total = 0.0 if scene.strain is None else scene.strain.total
    return replace(model, ground=with_strain(model.ground, displacement_by_strain(shared.geometry, total * of_bricks)))


def _on_jacks(scene: Scene, model: Model, geometry: Geometry, footing: IntArray) -> Model:
    """Model with its footing on supports and jacks; deflection is measured between the outer supports."""
    supports = scene.rig.support_places(scene.wall.length)
    up = upward(geometry, footing, model.size)
    over = upward(geometry, footing, model.size, top=True)
    deflection = deflection_of(over, supports[0], supports[-1])
    if not (np.abs(deflection) > 1e-9).any():
        raise InputError(
            f"rig.supports: between {supports[0]:g} and {supports[-1]:g} m the footing is one rigid segment, which no "
            "jack bends; put the supports farther apart, or give a footing.segment_length of less than half of that"
        )
    jacks, span = footing_beam.jacks_model(scene, up, deflection), supports[-1] - supports[0]
    return replace(model, span=span, deflection=deflection, jacks=jacks)


def _on_ground(scene: Scene, model: Model, geometry: Geometry, footing: IntArray) -> Model:
    """Model with its footing on soil whose surface moves."""
    length, movement, mound = scene.wall.length, scene.movement, scene.mound

    def along(x: FloatArray, factor: float) -> FloatArray:
        kind = movement.kind if factor >= 0.0 else movement.other
        return mound.at(abs(factor)).horizontal(x, length, kind)

    proportional = mound.proportional(length, movement.kind) and not movement.reverses
    ground = ground_movement(geometry, scene.ground_rise, along, proportional, movement.reverses)
    deflection = deflection_of(upward(geometry, footing, model.size, top=True), 0.0, length)
    return replace(model, ground=ground, deflection=deflection, surface_movement=mound.surface_movement)


def _joint_materials(scene: Scene) -> list[Joint]:
    """Joint materials of a wall, in the order of their numbers."""
    # lift-off ends the path: no difference before
    held = scene.rig.support == "held" or footing_beam.stops_at(scene) == "supports"
    return [
        scene.joint,
        _dpc_joint(scene.dpc, scene.joint),
        scene.footing.joint or scene.joint,
        footing_beam.soil_joint(scene),
        loading.bearing_joint(scene) if scene.support else footing_beam.support_joint(scene, pulls=held),
        footing_beam.UNBREAKABLE,
        control_joint(scene.joint),
        scene.heads,
        scene.joint if scene.block.fracture_energy is None else brick_joint(scene.block),
    ]


def _moved_from_below(scene: Scene, beam: int) -> list[Hold]:
    """Movement of a footing: its underside follows the movement, its left end is held along x."""
    length, bottom, movement = scene.wall.length, -scene.footing.depth, scene.movement
    near = 1e-9 * length
    along = (lambda x, y: movement.horizontal_profile(x, length)) if movement.moves_along else None
    moved = Hold(beam, lambda x, y: y < bottom + near, along, lambda x, y: movement.profile(x, length))
    return [moved] if along else [moved, Hold(beam, lambda x, y: (y < bottom + near) & (x < near), 0.0, None)]


def _dpc_joint(dpc: Dpc | None, joint: Joint) -> Joint:
    """Material of a dpc: no tension, its own friction, the mortar's stiffness unless given."""
    if dpc is None:
        return joint
    return Joint(
        normal_stiffness=dpc.normal_stiffness or joint.normal_stiffness,
        shear_stiffness=dpc.shear_stiffness or joint.shear_stiffness,
        tensile_strength=0.0,
        cohesion=dpc.cohesion,
        friction=dpc.friction,
        compressive_strength=joint.compressive_strength,
        cap_shear=joint.cap_shear,
    )


def control_joint(joint: Joint) -> Joint:
    """Law of a closed control joint: the stiffness of mortar, without bond and friction."""
    loose = Joint(tensile_strength=0.0, cohesion=0.0, friction=0.0)
    return replace(loose, normal_stiffness=joint.normal_stiffness, shear_stiffness=joint.shear_stiffness)


def _by_material(fields: Mapping[str, FloatArray], scene: Scene, joints: int) -> dict[int, dict[str, FloatArray]]:
    """Joint fields by material; head joints vary as the mortar unless they have their own values."""
    tables, heads = {"joint": MORTAR, "dpc": DPC, "head_joint": HEAD}, scene.head_joint
    sorted_out: dict[int, dict[str, FloatArray]] = {number: {} for number in tables.values()}
    for key, values in fields.items():
        table, _, name = key.partition(".")
        if table not in tables or name not in Joint.__dataclass_fields__:
            raise InputError(f"'{key}': only properties of joint, head_joint and dpc can vary from joint to joint.")
        if np.shape(values) != (joints,):
            raise InputError(f"'{key}': needs one value for each of the {joints} joints, got {np.shape(values)}.")
        sorted_out[tables[table]][name] = _of_joints(key, name, values)
    for name, values in sorted_out[MORTAR].items():
        if heads is None or getattr(heads, name) is None:
            of_heads = values if heads is None else heads.of_bed(name, values)
            sorted_out[HEAD].setdefault(name, of_heads)
    return sorted_out


def _of_joints(key: str, name: str, values: FloatArray) -> FloatArray:
    """Checked field values, as numbers that a joint can have."""
    try:
        numbers = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(f"'{key}': needs numbers, one for each joint.") from None
    if not np.isfinite(numbers).all():
        raise InputError(f"'{key}': has values that are not finite.")
    for extreme in {numbers.min(), numbers.max()} if numbers.size else ():
        changed: dict[str, Any] = {"fracture_energy": 1.0} if name == "shear_fracture_energy" else {}
        replace(_ANY_JOINT, **(changed | {name: float(extreme)}))
    return numbers


_ANY_JOINT = Joint(normal_stiffness=1.0, shear_stiffness=1.0, tensile_strength=1e16, cohesion=1e16, friction=1e15)
"""Joint in which any single property may have any value that a joint can have; mode II goes beside mode I."""


def _jambs(scene: Scene, bricks: list[Brick], geometry: Geometry) -> Jambs:
    """Blocks at the ends of each opening's jambs; the test measured the change in width at the upper ends."""
    west_edge, bottom, east_edge, top = np.array([b[:4] for b in bricks]).reshape(-1, 4).T
    block = np.full((len(scene.opening), 4), -1, dtype=np.int64)
    arm = np.zeros((len(scene.opening), 4, 2))
    for number, hole in enumerate(scene.opening):
        left, right = (east_edge, hole.x), (west_edge, hole.right)
        sill, head = (bottom, hole.y), (top, hole.top)
        for end, ((edges, x), (levels, y)) in enumerate(((left, sill), (right, sill), (right, head), (left, head))):
            bricks_there = np.flatnonzero(_are_nearest(edges, x) & _are_nearest(levels, y))
            if bricks_there.size:  # an opening at the end of the wall has only one jamb
                block[number, end] = first = bricks_there[0]
                arm[number, end] = x - geometry.blocks.x[first], y - geometry.blocks.y[first]
    return Jambs(block, arm)


def _are_nearest(values: FloatArray, target: float) -> BoolArray:
    return np.isclose(values, values[np.argmin(np.abs(values - target))])
