"""Cost limits, and the size and cost of a wall counted from its description before anything is built."""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass

from damagepred.assembly.bond import courses_and_halves
from damagepred.assembly.footing_beam import foundation
from damagepred.assembly.properties import no_tension_joint
from damagepred.errors import InputError
from damagepred.formatting import duration
from damagepred.inputs.arguments import checked
from damagepred.inputs.documentation import documented
from damagepred.scene import House, Scene

BLOCK_MEMORY, CONTACT_MEMORY, ZONE_MEMORY = 2e4, 200.0, 500.0
"""Memory of a block, contact and zone while a wall is solved (bytes)."""
BLOCK_TIME, EVALUATION_TIME, OPERATION_TIME = 2e-4, 1e-8, 2e-10
"""Times (s) to build a block, for the law of a contact or zone, and for a floating-point operation of dense algebra.
An order of magnitude is enough to refuse mistaken units; ``damagepred check`` times a wall."""
QUASI_STATIC_EVALUATIONS, QUASI_STATIC_FACTORISATIONS, DYNAMIC_EVALUATIONS = 250, 1.25, 4
"""Evaluations of all contacts and factorisations in a quasi-static increment; evaluations in a step of a run in time,
with contact detection."""
SETTLING_CYCLES = 3000  # cycles of the explicit solver from the end of a ramp to equilibrium


@documented
@dataclass(frozen=True)
class Limits:
    """Estimated cost above which a wall is refused, and time limit of a path.

    Examples
    --------
    >>> from damagepred import Limits
    >>> Limits(memory=8e9, estimated_time=600.0).estimated_time
    600.0
    """

    memory: float = 4e9
    """Estimated memory (bytes)."""
    estimated_time: float = 3600.0
    """Estimated time to solve one wall (s)."""
    time: float = 3600.0
    """Time limit of one wall (s); beyond it the wall fails with the reason ``timeout``."""

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if isinstance(value, bool) or not isinstance(value, int | float) or not value > 0:
                raise InputError(f"limits: {name} = {value!r}: must be a number greater than 0; inf lifts the limit.")

    @classmethod
    def asked(cls, yes: bool = False, timeout: float | None = None) -> Limits:
        """Limits of a command.

        Parameters
        ----------
        yes, timeout
            Whether to solve a wall whatever its estimated cost; time limit of one wall (s), if any.
        """
        default = NO_LIMITS if yes else cls()
        if timeout is None:
            return default
        return cls(default.memory, max(default.estimated_time, timeout), timeout)


NO_LIMITS = Limits(math.inf, math.inf, math.inf)


@documented
@dataclass(frozen=True)
class WallCost:
    """Size and cost of one wall, counted from wall, bricks, openings and zones.

    Examples
    --------
    >>> from damagepred import Scene, assembly
    >>> cost = assembly.wall_cost(Scene.from_toml("wall.toml"))
    >>> cost.contacts, cost.unknowns, f"{cost.memory / 1e6:.1f} MB"
    (1044.0, 348.0, '3.7 MB')
    """

    blocks: float
    contacts: float
    zones: float
    unknowns: float
    """Size of the model. Lintels and the ends of courses change the true numbers by some per cent."""
    joints: float
    """Bed joints, the most frequent kind."""
    memory: float
    """Memory while it is solved (bytes)."""
    time: float
    """Time to solve it (s), an order of magnitude."""

    def require(self, limits: Limits, fields: int = 0) -> None:
        """Check that the cost is within limits.

        Parameters
        ----------
        limits, fields
            Accepted cost; number of fields by distance, each with a dense correlation matrix of all joints.
        """
        matrix = 8.0 * self.joints**2 * (3 * fields)
        if self.memory + matrix <= limits.memory and self.time <= limits.estimated_time:
            return
        correlation = f" and {matrix / 1e9:.2g} GB for the correlation of its joints" if matrix > self.memory else ""
        raise InputError(
            f"the wall has about {self.blocks:.3g} blocks, {self.contacts:.3g} contacts and {self.unknowns:.3g} "
            f"unknowns: one wall would take about {self.memory / 1e9:.2g} GB of memory{correlation}, and "
            f"{duration(self.time)}, which is more than {limits.memory / 1e9:.2g} GB or "
            f"{duration(limits.estimated_time)}. Check lengths and their units; --yes, or limits=NO_LIMITS in Python, "
            "solves it all the same."
        )


BRICKS_PER_HALF = {"header": 1.0, "english": 0.75, "flemish": 2.0 / 3.0}
"""Bricks per half brick of the length of a course, where headers make it more than a half."""


@checked
def wall_cost(scene: Scene, increments: int | None = None) -> WallCost:
    """Size of a scene's wall and estimated cost of solving it, before anything is built.

    Parameters
    ----------
    scene : Scene
        The wall, its movement and its solver.
    increments : int, optional
        Increments of the movement; by default the scene's.

    Examples
    --------
    >>> from damagepred import Scene, assembly
    >>> assembly.wall_cost(Scene.from_toml("wall.toml")).blocks
    116.0
    """
    if isinstance(scene, House):
        costs = [astuple(wall_cost(part, increments)) for part in scene.scenes]
        return WallCost(*(sum(values) for values in zip(*costs)))
    solver, wall = scene.solver, scene.wall
    steps = 1.0 + (increments or scene.movement.increment_count)
    courses, halves, holes = courses_and_halves(scene)
    per_half = BRICKS_PER_HALF.get(wall.bond, 0.5)
    bricks = max(courses * (halves * per_half + 1) - holes * per_half, 1.0)
    segments, footing_zones = _footing_blocks_and_zones(scene)
    cells, facets = _cells(scene)
    degrees = 5.0 if "elastic" in _block_kinds(scene) else 3.0
    zoned = bricks if cells else 0.0
    blocks = bricks + segments
    beds = bricks * (1.0 if wall.bond == "stack" else 2.0)
    parts = solver.no_tension_parts if no_tension_joint(scene.joint) else 1
    interfaces = (beds * parts + bricks) * max(facets, 1.0) + 2 * segments
    if scene.dpc is not None:
        interfaces += halves * solver.no_tension_parts * max(facets, 1.0)
    contacts = interfaces * solver.contacts_per_interface
    zones = 4 * cells * zoned + footing_zones
    gridpoints = 0.5 * zones + 2 * facets * zoned
    evaluation = EVALUATION_TIME * (contacts + zones)
    levels = courses + (segments > 0)
    if scene.dynamics is not None:
        steps = 1.0 + scene.dynamics.outputs
        time = DYNAMIC_EVALUATIONS * evaluation * (scene.dynamics.run_duration / _stable_time_step(scene) + steps)
    elif solver.method == "explicit":
        time = steps * (solver.ramp_cycles + min(SETTLING_CYCLES, solver.maximum_cycles)) * evaluation
    else:  # courses eliminated one by one, without inner gridpoints
        operations = 4 * levels * (3 * bricks / courses + 2 * facets) ** 3
        factorisations = QUASI_STATIC_FACTORISATIONS * operations * OPERATION_TIME
        time = steps * (QUASI_STATIC_EVALUATIONS * evaluation + factorisations)
    memory = 16 * levels * ((degrees + 4 * facets) * bricks / courses) ** 2
    memory += 16 * (2 * gridpoints / max(blocks, 1.0)) ** 2
    memory += BLOCK_MEMORY * blocks + CONTACT_MEMORY * contacts + ZONE_MEMORY * zones
    memory += steps * 8 * (9 * blocks + 6 * contacts + 5 * zones + 2 * gridpoints)
    unknowns = degrees * bricks + 3 * segments + 2 * gridpoints
    return WallCost(blocks, contacts, zones, unknowns, beds, memory, time + BLOCK_TIME * blocks)


def _footing_blocks_and_zones(scene: Scene) -> tuple[float, float]:
    """Numbers of blocks and of zones of the footing."""
    footing = foundation(scene)
    if footing is None:
        return 0.0, 0.0
    length = scene.wall.length
    if footing.model == "deformable":
        return 1.0, 4.0 * math.ceil(length / footing.zone_size) * math.ceil(footing.depth / footing.zone_size)
    return length / min(footing.segment_length or math.inf, scene.wall.block_length), 0.0


def _block_kinds(scene: Scene) -> tuple[str, str]:
    """Kinds of blocks above and below the damp-proof course."""
    solver = scene.solver
    return solver.above_dpc or solver.blocks, solver.below_dpc or solver.blocks


def _cells(scene: Scene) -> tuple[float, float]:
    """Numbers of cells (four zones each) in a brick and along its length; 0 for rigid and elastic bricks."""
    solver, sides = scene.solver, (scene.wall.block_length, scene.wall.block_height)
    if all(kind in ("rigid", "elastic") for kind in _block_kinds(scene)):
        return 0.0, 0.0
    default = min(min(sides), 0.5 * max(sides)) if solver.method == "quasi_static" else 0.5 * min(sides)
    given = (solver.zone_size, solver.zone_size_above_dpc, solver.zone_size_below_dpc)
    size = min((s for s in given if s), default=default)
    along, up = (math.ceil(side / size) for side in sides)
    return float(along * up), float(along)


def _stable_time_step(scene: Scene) -> float:
    """Stable time step of one brick between its joints (s), approximately the step of a run in time."""
    wall, joint = scene.wall, scene.joint
    mass = max(scene.block.density, 1e-9) * wall.block_length * wall.block_height * wall.thickness
    stiffness = 2 * max(joint.normal_stiffness, joint.shear_stiffness) * (wall.block_length + wall.block_height)
    if "elastic" in _block_kinds(scene):  # the end of a brick moves with it and with a third of its mass, m / (1 + 3)
        mass /= 4.0
    return 0.25 * math.sqrt(mass / (stiffness * wall.thickness))
