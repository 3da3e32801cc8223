"""Cost estimate of a wall from its description alone, before anything is built."""

from __future__ import annotations

import math
from dataclasses import dataclass

from damagepred.assembly.bond import courses_and_halves
from damagepred.assembly.footing_beam import foundation
from damagepred.assembly.properties import no_tension_joint
from damagepred.errors import InputError
from damagepred.inputs.arguments import checked
from damagepred.scene import Scene


@dataclass(frozen=True)
class Limits:
    """Estimated cost above which a wall is refused, and time limit of a path.

    Attributes
    ----------
    memory : float
        Estimated memory (bytes).
    estimated_time : float
        Estimated time to solve one wall (s).
    time : float
        Time that one wall may take (s); then it fails with the reason ``timeout``.

    Examples
    --------
    >>> from damagepred import Limits
    >>> Limits(memory=8e9, estimated_time=600.0).estimated_time
    600.0
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
            Whether a wall is solved whatever its estimated cost.
        timeout : float, optional
            Time that one wall may take (s).
        """
        usual = NO_LIMITS if yes else cls()
        if timeout is None:
            return usual
        return cls(usual.memory, max(usual.estimated_time, timeout), timeout)


NO_LIMITS = Limits(math.inf, math.inf, math.inf)


@dataclass(frozen=True)
class CostOptions:
    """Unit costs of one core; ``studies/benchmarks/cost_estimate.py`` measures them. They tell an order of magnitude.

    Attributes
    ----------
    block_time : float
        To build a block and its results (s).
    contact_time : float
        Of the law of one contact or zone in one cycle or iteration (s).
    flop_time : float
        Of a floating-point operation of dense linear algebra (s).
    iterations : float
        Newton iterations of an increment.
    factorisation_share : float
        Share of the iterations that factorise the stiffness of all courses.
    line_search_evaluations : float
        Evaluations of all contacts in a Newton iteration.
    dynamic_contact_evaluations : float
        Evaluations of all contacts in a step of a run in time, contact detection included.
    settling_cycles : float
        Cycles of the explicit solver until an increment reaches equilibrium after its ramp.
    block_memory, contact_memory, zone_memory : float
        Of a block, contact and zone while a wall is solved (bytes).
    design_copies : int
        Copies of each input of each sample (8 bytes) while a design is drawn and written.

    Examples
    --------
    >>> from damagepred import assembly
    >>> assembly.CostOptions().iterations
    25.0
    """

    block_time: float = 2e-4
    contact_time: float = 1e-8
    flop_time: float = 2e-10
    iterations: float = 25.0
    factorisation_share: float = 0.05
    line_search_evaluations: float = 10.0
    dynamic_contact_evaluations: float = 4.0
    settling_cycles: float = 3000.0
    block_memory: float = 2e4
    contact_memory: float = 200.0
    zone_memory: float = 500.0
    design_copies: int = 8


@dataclass(frozen=True)
class WallCost:
    """Size and estimated cost of one wall, counted from wall, bricks, openings and zones.

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
    joints: float
    memory: float
    time: float

    def require(self, limits: Limits, fields: int = 0) -> None:
        """Check that the cost is within limits.

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
        beyond = f" and {_gigabytes(matrix)} for the correlation of its joints" if matrix > self.memory else ""
        raise InputError(
            f"the wall has about {self.blocks:.3g} blocks, {self.contacts:.3g} contacts and {self.unknowns:.3g} "
            f"unknowns: one wall would take about {_gigabytes(self.memory)} of memory{beyond}, and {_time(self.time)}, "
            f"which is more than {_gigabytes(limits.memory)} or {_time(limits.estimated_time)}. Check lengths and "
            "their units; --yes, or limits=NO_LIMITS in Python, solves it all the same."
        )


@checked
def wall_cost(scene: Scene, increments: int | None = None) -> WallCost:
    """Return the size of a scene's wall and the estimated cost of solving it, before anything is built.

    Parameters
    ----------
    scene : Scene
        The wall, its movement and its solver.
    increments : int, optional
        Of the movement; by default the scene's.

    Examples
    --------
    >>> from damagepred import Scene, assembly
    >>> assembly.wall_cost(Scene.from_toml("wall.toml")).blocks
    116.0
    """
    options, solver, wall = CostOptions(), scene.solver, scene.wall
    increments = increments or scene.movement.increment_count
    courses, halves, holes = courses_and_halves(scene)
    bricks = max(courses * (halves / 2 + 1) - holes / 2, 1.0)
    segments, footing_zones = _footing_blocks_and_zones(scene)
    cells, facets = _cells(scene)
    zoned = bricks if cells else 0.0
    blocks = bricks + segments
    beds = bricks * (2.0 if wall.bond == "running" else 1.0)
    parts = solver.no_tension_parts if no_tension_joint(scene.joint) else 1
    interfaces = (beds * parts + bricks) * max(facets, 1.0) + 2 * segments
    if scene.dpc is not None:
        interfaces += halves * solver.no_tension_parts * max(facets, 1.0)
    contacts = interfaces * solver.contacts_per_interface
    zones = 4 * cells * zoned + footing_zones
    gridpoints = 0.5 * zones + 2 * facets * zoned
    unknowns = 3 * blocks + 2 * gridpoints
    # as if ordered course by course; inner gridpoints are condensed
    width = (3 + 4 * facets) * bricks / courses
    levels = courses + (segments > 0)
    matrices = 16 * levels * width**2 + 16 * (2 * gridpoints / max(blocks, 1.0)) ** 2
    evaluation_time = options.contact_time * (contacts + zones)
    if scene.dynamics is not None:
        increments = scene.dynamics.outputs
        steps = scene.dynamics.run_duration / _stable_time_step(scene) + 1.0 + increments
        time = options.dynamic_contact_evaluations * evaluation_time * steps
    elif solver.method == "explicit":
        cycles = solver.ramp_cycles + min(options.settling_cycles, solver.maximum_cycles)
        time = (1.0 + increments) * cycles * evaluation_time
    else:
        flops = 4 * levels * (3 * bricks / courses + 2 * facets) ** 3
        iteration_time = options.line_search_evaluations * evaluation_time
        iteration_time += options.factorisation_share * flops * options.flop_time
        time = (1.0 + increments) * options.iterations * iteration_time
    memory = matrices + options.block_memory * blocks + options.contact_memory * contacts + options.zone_memory * zones
    memory += (1.0 + increments) * 8 * (9 * blocks + 6 * contacts + 5 * zones + 2 * gridpoints)
    return WallCost(blocks, contacts, zones, unknowns, beds, memory, time + options.block_time * blocks)


def _footing_blocks_and_zones(scene: Scene) -> tuple[float, float]:
    """Return the numbers of blocks and of zones of the footing."""
    found = foundation(scene)
    if found is None:
        return 0.0, 0.0
    length = scene.wall.length
    if found.model == "deformable":
        return 1.0, 4.0 * math.ceil(length / found.zone_size) * math.ceil(found.depth / found.zone_size)
    return length / min(found.segment_length or math.inf, scene.wall.block_length), 0.0


def _parts(scene: Scene) -> tuple[str, str]:
    """Return the kinds of blocks above and below the damp-proof course."""
    solver = scene.solver
    return solver.above_dpc or solver.blocks, solver.below_dpc or solver.blocks


def _cells(scene: Scene) -> tuple[float, float]:
    """Return the numbers of cells (four zones each) in a brick and along its length; 0 for rigid and elastic bricks."""
    solver, wall = scene.solver, scene.wall
    if all(part in ("rigid", "elastic") for part in _parts(scene)):
        return 0.0, 0.0
    longest, short = max(wall.block_length, wall.block_height), min(wall.block_length, wall.block_height)
    usual = min(short, 0.5 * longest) if solver.method == "quasi_static" else 0.5 * short
    given = (solver.zone_size, solver.zone_size_above_dpc, solver.zone_size_below_dpc)
    size = min((s for s in given if s), default=usual)
    along, up = (math.ceil(side / size) for side in (wall.block_length, wall.block_height))
    return float(along * up), float(along)


def _stable_time_step(scene: Scene) -> float:
    """Return the stable time step of one brick between its joints (s), about that of a run in time."""
    wall, joint = scene.wall, scene.joint
    mass = max(scene.block.density, 1e-9) * wall.block_length * wall.block_height * wall.thickness
    stiffness = 2 * max(joint.normal_stiffness, joint.shear_stiffness) * (wall.block_length + wall.block_height)
    if "elastic" in _parts(scene):  # the end of a brick moves with it and with a third of its mass, m / (1 + 3)
        mass /= 4.0
    return 0.25 * math.sqrt(mass / (stiffness * wall.thickness))


def _gigabytes(size: float) -> str:
    return f"{size / 1e9:.2g} GB"


def _time(seconds: float) -> str:
    return f"{seconds / 3600:.2g} h" if seconds >= 3600 else f"{seconds:.2g} s"
