"""Checks that the tables of a scene fit together; each refuses by ValueError."""

from __future__ import annotations

from itertools import combinations
from math import ceil, floor
from typing import TYPE_CHECKING

from damagepred.enumerations import LOCAL
from damagepred.errors import likely_unit
from damagepred.scene.keys import require_own_names
from damagepred.scene.loading import check_loads, check_test
from damagepred.scene.wall import EDGE_TOLERANCE, Opening, Wall

if TYPE_CHECKING:
    from damagepred.scene.scene import Scene

MOST_MOVEMENT = 0.1
"""Largest movement of the ground, over the wall's length: beyond, rotations are not small, as the model takes them."""


def check_tables(scene: Scene) -> None:
    """Refuse tables that contradict each other, before the size of the movement is known."""
    _check_openings(scene)
    _check_dpc(scene)
    _check_control_joints(scene)
    _check_run_in_time(scene)
    _check_footing(scene)
    _check_ground(scene)
    _check_test_and_loads(scene)


def check_movement(scene: Scene) -> None:
    """Refuse a movement that differs from its stages, is too large, or lacks the history that slow strains need."""
    movement, most = scene.movement, MOST_MOVEMENT * scene.wall.length
    if movement.stage and movement.shape == "mound":
        movement.require_largest(scene.mound.surface_movement)
    _check_slow_strains(scene)
    if (movement.settles or scene.deflection_is_given) and movement.size > most:
        raise ValueError(
            f"{scene.movement_key} = {movement.size:g} m: more than a tenth of the "
            f"wall's length ({scene.wall.length:g} m) is outside the small rotations of this model."
            + likely_unit(movement.size, most, "m")
        )


def _check_openings(scene: Scene) -> None:
    """Refuse openings that leave the wall or each other no masonry."""
    wall = scene.wall
    tolerance = 1e-9 * wall.length
    for number, hole in enumerate(scene.opening, start=1):
        name = f"opening {number} ({hole.kind})"
        for key, end, size in (("x + width", hole.right, "length"), ("y + height", hole.top, "height")):
            if end > (most := getattr(wall, size)) + tolerance:
                raise ValueError(
                    f"{name}: {key} = {end:g} m reaches outside the wall, whose {size} is {most:g} m."
                    + likely_unit(end, most, "m")
                )
        if hole.top > (lowest := wall.lowest_top(hole)) + tolerance:
            raise ValueError(
                f"{name}: y + height = {hole.top:g} m reaches above the top of the wall there, {lowest:g} m; make "
                "it lower, or raise wall.top"
            )
        if hole.width >= wall.length - tolerance:
            raise ValueError(f"{name}: width = {hole.width:g} m leaves no wall beside it; make it narrower")
        _outlives_the_gauge(name, hole, wall)
    for (i, first), (j, second) in combinations(enumerate(scene.opening, start=1), 2):
        if first.overlaps(second):
            raise ValueError(
                f"openings {i} and {j} overlap or touch: x {first.x:g}-{first.right:g} m and "
                f"{second.x:g}-{second.right:g} m; move one or make them one opening"
            )


def _outlives_the_gauge(name: str, hole: Opening, wall: Wall) -> None:
    """Refuse openings, and strips of wall beside them, that are too narrow for joints on both sides."""
    along, up = EDGE_TOLERANCE * wall.block_length / 2, EDGE_TOLERANCE * wall.block_height
    for what, size, least in (
        ("width", hole.width, along),
        ("strip of wall on its left", hole.x, along),
        ("strip of wall on its right", wall.length - hole.right, along),
        ("height", hole.height, up),
        ("strip of wall below it", hole.y, up),
        ("strip of wall above it", wall.lowest_top(hole) - hole.top, up),
    ):
        if 1e-9 * wall.length < size <= least:
            raise ValueError(
                f"{name}: the {what} is {size:g} m and would vanish as bricks are laid; take more than {least:g} m"
            )


def _check_dpc(scene: Scene) -> None:
    """Refuse a dpc above the wall or in a window."""
    if scene.dpc is None:
        return
    wall, course = scene.wall, scene.dpc.course
    courses = max(1, floor(wall.height / wall.block_height * (1 + 1e-9) + 0.5))
    if course >= courses:
        raise ValueError(
            f"dpc.course = {course}: the wall has {courses} courses, so the dpc can lie on top of "
            f"1 to {courses - 1} of them"
        )
    level = course * wall.block_height
    for number, hole in enumerate(scene.opening, start=1):
        if hole.kind == "window" and hole.y + 0.5 * wall.block_height < level < hole.top:
            below, above = floor(hole.y / wall.block_height + 1e-9), ceil(hole.top / wall.block_height - 1e-9)
            raise ValueError(
                f"dpc.course = {course}: the dpc would lie {level:g} m up, in opening {number} (window), "
                f"which reaches from {hole.y:g} to {hole.top:g} m; take {below}, below the window, or "
                f"{above}, above a basement window"
            )


def _check_control_joints(scene: Scene) -> None:
    """Refuse control joints nearer than half a brick to the ends of the wall or to each other."""
    half = 0.5 * scene.wall.block_length * (1 - 1e-9)
    positions = [0.0, *sorted(joint.x for joint in scene.control_joint), scene.wall.length]
    for number, joint in enumerate(scene.control_joint, start=1):
        before, after = positions[positions.index(joint.x) - 1], positions[positions.index(joint.x) + 1]
        if joint.x >= scene.wall.length or min(joint.x - before, after - joint.x) < half:
            raise ValueError(
                f"control joint {number}: x = {joint.x:g} m must lie half a brick ({half:g} m) or more from the "
                f"ends of the wall (0 and {scene.wall.length:g} m) and from other control joints"
            )


def _check_run_in_time(scene: Scene) -> None:
    """Refuse tables that a run in time does not read."""
    by_time = scene.creep is not None and scene.creep.relaxation_time is not None
    for given, none, other in (
        (scene.control_joint, "has no control joints", "[[control_joint]]"),
        (scene.movement.shape == "jacks", "has no jacks", "take another movement.shape than 'jacks'"),
        (scene.strain or by_time, "has no strain and no creep.relaxation_time", "these"),
        (scene.movement.stage, "reads no stages", "[[movement.stage]]"),
    ):
        if given and scene.dynamics is not None:
            raise ValueError(f"dynamics: a run in time {none}; leave out [dynamics], or {other}")


def _check_footing(scene: Scene) -> None:
    """Refuse a model of the footing that the movement does not take."""
    shape, footing = scene.movement.shape, scene.solver.footing
    if footing == "beam" and scene.movement.prescribed:
        raise ValueError(
            f"solver.footing = 'beam': goes with movement.shape = 'jacks' or 'mound', on which the footing finds "
            f"its own form; here movement.shape = '{shape}'. Take footing = 'none' or 'deformable', or leave it out"
        )
    if footing == "none" and not scene.movement.prescribed:
        raise ValueError(
            f"solver.footing = 'none': movement.shape = '{shape}' needs a footing that finds its own form; take "
            "footing = 'beam' or 'deformable', or leave it out"
        )
    if footing == "deformable" and scene.footing.concrete is not None:
        raise ValueError(
            "footing.concrete: zones of a footing stay elastic, so it cannot crack with solver.footing = "
            "'deformable'; take footing = 'beam', or leave out [footing.concrete]"
        )


def _check_ground(scene: Scene) -> None:
    """Refuse a movement of the ground that contradicts its shape, or is too large for small rotations."""
    movement, mound, length = scene.movement, scene.mound, scene.wall.length
    shape = movement.shape
    movement.check_settlement(length)
    if movement.local and not (movement.settles or (shape == "mound" and mound.shape in LOCAL)):
        raise ValueError(
            f"movement.kind = '{movement.kind}': goes with movement.shape = 'mound' and mound.shape = "
            f"{' or '.join(map(repr, LOCAL))}, where the ground moves in one place, or with movement.settlement; "
            f"here movement.shape = '{shape}'"
            + (f" and mound.shape = '{mound.shape}'" if shape == "mound" else "")
            + ". Take 'dishing' or 'doming'"
        )
    if shape == "mound" and mound.largest(movement.kind) > MOST_MOVEMENT * length:
        raise ValueError(
            f"mound.surface_movement = {mound.surface_movement:g} m: it moves the ground by more than a tenth "
            f"of the wall's length ({length:g} m), outside the small rotations of this model."
            + likely_unit(mound.surface_movement, MOST_MOVEMENT * length, "m")
        )
    if shape == "jacks":
        scene.rig.check_places(length)
    if movement.stage and shape == "jacks" and scene.rig.control == "load":
        raise ValueError("movement.stage: on jacks, stages need rig.control = 'deflection'")


def _check_test_and_loads(scene: Scene) -> None:
    """Refuse loads off the wall, and a laboratory test without loads or with a footing."""
    shape = scene.movement.shape
    require_own_names("soil_layer", scene.soil_layer, "layers")
    require_own_names("load", scene.load, "loads")
    for number, load in enumerate(scene.load, start=1):
        if not load.sized and shape != "loads":
            raise ValueError(
                f"load {load.name or number}: has no size; give force, line_load, or pressure and breadth "
                f"(only movement.shape = 'loads', a test, has loads without a size; here it is '{shape}')"
            )
    check_loads(scene.load, scene.opening, scene.wall)
    if shape != "loads":
        for name in ("support", "loading"):
            if getattr(scene, name):
                raise ValueError(f"{name}: only read with movement.shape = 'loads'; here it is '{shape}'")
        return
    if scene.loading is None:
        raise ValueError("loading: is missing; movement.shape = 'loads' needs a controlled quantity")
    if scene.footing_model != "none" or scene.dynamics is not None:
        raise ValueError("movement.shape = 'loads': a test has no footing and no [dynamics]; leave them out")
    if scene.loading.control != "force" and scene.solver.method == "explicit":
        raise ValueError(f"loading.control = '{scene.loading.control}': the explicit solver takes 'force' only")
    if scene.wall.top and scene.loading.beam != "none":
        raise ValueError(f"loading.beam = '{scene.loading.beam}': lies on a level top; leave it or wall.top out")
    check_test(scene.support, scene.load, scene.wall.length)


def _check_slow_strains(scene: Scene) -> None:
    """Refuse strains of the bricks and creep of the joints without the history that they need."""
    strain, history = scene.strain, scene.movement.increments_of_history()
    by_time = scene.creep is not None and scene.creep.relaxation_time is not None
    strained = by_time or scene.strain_of_increments is not None
    if scene.movement.shape == "loads" and strained:
        raise ValueError(
            "strain, creep.relaxation_time: a test in stages has none; leave them out, or [[movement.stage]]"
        )
    timed = history is not None and history.time is not None
    if history is not None and scene.movement.largest == 0.0 and not strained:
        raise ValueError("movement.stage: nothing moves; give a movement, a strain or creep.relaxation_time")
    if history is not None and strain is not None and not timed:
        raise ValueError("strain: in a history each stage needs a time (years); or give the stages a strain each")
    if strain is not None and strain.temperature_swing and history is None:
        raise ValueError("strain.temperature_swing: needs a history, [[movement.stage]] or [movement.seasons]")
    if by_time and not timed:
        raise ValueError("creep.relaxation_time: needs a history whose stages have times (years), or seasons")
