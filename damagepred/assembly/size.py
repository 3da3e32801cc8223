"""Size and price of a wall from its description alone, before anything is built."""

from __future__ import annotations

import math
from dataclasses import dataclass

from damagepred.arguments import checked
from damagepred.assembly.bond import courses_and_halves
from damagepred.assembly.footing import foundation
from damagepred.assembly.properties import no_tension_joint
from damagepred.errors import InputError
from damagepred.scene import Scene


@dataclass(frozen=True)
class Limits:
    """Price of a wall above which it is refused, and the time after which a wall ends.

    Attributes
    ----------
    memory : float
        Estimated memory (bytes).
    estimated_time : float
        Estimated time to solve one wall (s).
    time : float
        Time that one wall may take (s); then it fails with the reason ``timeout``.
    """

    memory: float = 4e9
    estimated_time: float = 3600.0
    time: float = 3600.0

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if isinstance(value, bool) or not isinstance(value, int | float) or not value > 0:
                raise InputError(f"limits: {name} = {value!r}: must be a number greater than 0; inf lifts the limit.")

    @classmethod
    def asked(cls, yes: bool = False, timeout: float | None = None) -> Limits:
        """Return the limits as a command takes them.

        Parameters
        ----------
        yes : bool
            Whether a wall is solved whatever its price.
        timeout : float, optional
            Time that one wall may take (s).
        """
        usual = NO_LIMITS if yes else cls()
        if timeout is None:
            return usual
        return cls(usual.memory, max(usual.estimated_time, timeout), timeout)


NO_LIMITS = Limits(math.inf, math.inf, math.inf)


@dataclass(frozen=True)
class Costs:
    """Costs that prices are estimated with, measured on one core; they tell an order of magnitude.

    Attributes
    ----------
    block_time, contact_time : float
        To build a block and its results, and to look once at a contact (s).
    flop_time : float
        Of linear algebra with dense matrices (s).
    iterations : float
        Newton iterations of an increment, of which one in twenty factorises all courses.
    settling_cycles : float
        Cycles of the explicit solver until an increment reaches equilibrium after its ramp.
    block_memory : float
        Of a block with its contacts while a wall is solved (bytes).
    """

    block_time: float = 2e-4
    contact_time: float = 1e-8
    flop_time: float = 2e-10
    iterations: float = 25.0
    settling_cycles: float = 3000.0
    block_memory: float = 2e4


@dataclass(frozen=True)
class WallSize:
    """Size and price of one wall, counted from wall, bricks, openings and zones.

    Attributes
    ----------
    blocks, contacts, zones, unknowns : float
        Of the model. Lintels and the ends of courses make the true numbers differ by some per cent.
    joints : float
        Bed joints, of which there are more than of any other kind.
    memory : float
        Needed while it is solved (bytes).
    time : float
        To solve it (s).
    """

    blocks: float
    contacts: float
    zones: float
    unknowns: float
    joints: float
    memory: float
    time: float

    def require(self, limits: Limits, fields: int = 0) -> None:
        """Check that the price is within limits.

        Parameters
        ----------
        limits : Limits
            What is accepted.
        fields : int
            Number of fields by distance, each with the correlation of all its joints as a dense matrix.

        Raises
        ------
        InputError
            If it is not.
        """
        matrix = 8.0 * self.joints**2 * (3 * fields)
        if self.memory + matrix <= limits.memory and self.time <= limits.estimated_time:
            return
        beyond = f" and {_memory(matrix)} for the correlation of its joints" if fields and matrix > self.memory else ""
        raise InputError(
            f"the wall has about {self.blocks:.3g} blocks, {self.contacts:.3g} contacts and {self.unknowns:.3g} "
            f"unknowns: one wall would take about {_memory(self.memory)} of memory{beyond}, and {_time(self.time)}, "
            f"which is more than {_memory(limits.memory)} or {_time(limits.estimated_time)}. Check lengths and their "
            "units; --yes, or limits=NO_LIMITS in Python, solves it all the same."
        )


@checked
def wall_size(scene: Scene, increments: int | None = None) -> WallSize:
    """Return the size of a scene's wall and the estimated cost of solving it.

    Parameters
    ----------
    scene : Scene
        The wall, its movement and its solver.
    increments : int, optional
        Of the movement; by default the scene's.
    """
    cost, settings, wall = Costs(), scene.solver, scene.wall
    steps = 1.0 + (increments or scene.movement.increments)
    courses, halves, holes = courses_and_halves(scene)
    bricks = max(courses * (halves / 2 + 1) - holes / 2, 1.0)
    segments, footing_zones = _footing(scene)
    cells, facets = _cells(scene)
    zoned = 0.0 if not cells else bricks
    blocks = bricks + segments
    beds = bricks * (2.0 if wall.bond == "running" else 1.0)
    parts = settings.no_tension_parts if no_tension_joint(scene.joint) else 1
    interfaces = (beds * parts + bricks) * max(facets, 1.0) + 2 * segments
    if scene.dpc is not None:
        interfaces += halves * settings.no_tension_parts * max(facets, 1.0)
    contacts = interfaces * settings.contacts_per_interface
    zones = 4 * cells * zoned + footing_zones
    gridpoints = 0.5 * zones + 2 * facets * zoned
    unknowns = 3 * blocks + 2 * gridpoints
    # the stiffness is block tridiagonal, course by course; inner gridpoints are condensed
    width = (3 + 4 * facets) * bricks / courses
    levels = courses + (segments > 0)
    matrices = 16 * levels * width**2 + 16 * (2 * gridpoints / max(blocks, 1.0)) ** 2
    memory = matrices + cost.block_memory * blocks + 200 * contacts + 500 * zones
    increment_memory = 8 * (9 * blocks + 6 * contacts + (5 * zones + 2 * gridpoints))
    look = cost.contact_time * (contacts + zones)
    if scene.dynamics is not None:
        steps = 1.0 + scene.dynamics.outputs
        time = look * 4 * (scene.dynamics.duration / _time_step(scene) + steps)
    elif settings.method == "explicit":
        cycles = settings.ramp_cycles + min(cost.settling_cycles, settings.maximum_cycles)
        time = look * steps * cycles
    else:
        flops = 4 * levels * (3 * bricks / courses + 2 * facets) ** 3
        time = steps * cost.iterations * (10 * look + 0.05 * flops * cost.flop_time)
    time += cost.block_time * blocks
    return WallSize(blocks, contacts, zones, unknowns, beds, memory + steps * increment_memory, time)


def _footing(scene: Scene) -> tuple[float, float]:
    """Return the number of blocks of the footing, and of its zones."""
    found = foundation(scene)
    if found is None:
        return 0.0, 0.0
    length = scene.wall.length
    if found.model == "deformable":
        return 1.0, 4.0 * math.ceil(length / found.zone_size) * math.ceil(found.depth / found.zone_size)
    return length / min(found.segment_length or math.inf, scene.wall.block_length), 0.0


def _cells(scene: Scene) -> tuple[float, float]:
    """Return the cells of four zones that a brick is cut into, and those along its length; none of rigid bricks."""
    settings, wall = scene.solver, scene.wall
    parts = (settings.above_dpc or settings.blocks, settings.below_dpc or settings.blocks)
    if all(part == "rigid" for part in parts):
        return 0.0, 0.0
    longest, short = max(wall.block_length, wall.block_height), min(wall.block_length, wall.block_height)
    usual = min(short, 0.5 * longest) if settings.method == "quasi_static" else 0.5 * short
    given = (settings.zone_size, settings.zone_size_above_dpc, settings.zone_size_below_dpc)
    size = min((s for s in given if s), default=usual)
    along, up = (math.ceil(side / size) for side in (wall.block_length, wall.block_height))
    return float(along * up), float(along)


def _time_step(scene: Scene) -> float:
    """Return about the stable time step of a run in time (s): of a brick between its joints."""
    wall, joint = scene.wall, scene.joint
    mass = max(scene.block.density, 1e-9) * wall.block_length * wall.block_height * wall.thickness
    stiffness = 2 * max(joint.normal_stiffness, joint.shear_stiffness) * (wall.block_length + wall.block_height)
    return 0.25 * math.sqrt(mass / (stiffness * wall.thickness))


def _memory(size: float) -> str:
    return f"{size / 1e9:.2g} GB"


def _time(seconds: float) -> str:
    return f"{seconds / 3600:.2g} h" if seconds >= 3600 else f"{seconds:.2g} s"
