"""Tolerances, budgets and factors of the solvers: ``[solver.advanced]``, one table for each algorithm."""

from __future__ import annotations

import dataclasses
import json
import warnings
from collections.abc import Mapping
from dataclasses import asdict, replace
from functools import cache
from typing import Any

import numpy as np
from pydantic import Field

from damagepred.kernels.joint.return_mapping import ReturnMapping, all_plain
from damagepred.scene import Solver
from damagepred.scene.described import build, described, plain
from damagepred.scene.quantity import Count, Length, Pure


@described
class NewtonOptions:
    """Newton's method on the Coulomb law with backtracking: first where jacks work by deflection."""

    max_iterations: Count = Field(default=16, ge=1)
    """Iterations of one attempt."""
    interior_tolerance: Pure = Field(default=1e-10, gt=0, lt=1)
    """Residual of the interior of a yielding block, over the largest force of its zones (1)."""


@described
class NewtonLineSearchOptions:
    """Newton's method on the Coulomb law with line search: first where the wall has a potential."""

    max_iterations: Count = Field(default=40, ge=1)
    """Iterations of one attempt."""
    slope_tolerance: Pure = Field(default=0.5, gt=0, lt=1)
    """Work of the residual along a step over that at its start, at which the line search ends (1)."""
    stagnation_limit: Count = Field(default=25, ge=0)
    """Such iterations in a row that are allowed."""


@described
class LineSearchOptions:
    """Line search along a step: root of the work of the residual, by regula falsi."""

    max_iterations: Count = Field(default=30, ge=1)
    """Trial steps."""
    slope_tolerance: Pure = Field(default=0.3, gt=0, lt=1)
    """Work over that at the start of the step, at which the search ends in a Tresca problem (1)."""


@described
class CoulombOptions:
    """Coulomb friction by Tresca fixed-point iteration.

    A search in vain costs more than dynamic relaxation. After each, the next search gets half the Newton iterations;
    after the second, third, ... the following 1, 3, 7 equilibria are sought by Newton's method alone. The first takes
    none away: where joints without a bond slide, half a step mostly finds an equilibrium where the whole step does not.
    A search that succeeds takes one failure back.
    """

    max_iterations: Count = Field(default=60, ge=1)
    """Tresca problems solved for one equilibrium."""
    max_newton_iterations: Count = Field(default=400, ge=1)
    """Newton iterations of one search while none has been in vain."""
    stagnation_limit: Count = Field(default=8, ge=0)
    """Iterations in a row that do not halve the least residual, after which the search ends."""
    forcing_share: Pure = Field(default=0.01, gt=0, lt=1)
    """Residual tolerance of a Tresca problem over the residual of the Coulomb law with its bounds (1)."""
    relaxation_factors: tuple[Pure, ...] = Field(default=(0.5, 0.3, 0.15), min_length=1)
    """Successive factors of under-relaxation (1)."""


@described
class JackOptions:
    """Jacks whose deflection is given."""

    deflection_tolerance: Length = Field(default=1e-9, gt=0)
    """Difference between the deflection and its given value in equilibrium (m)."""
    max_iterations: Count = Field(default=40, ge=1)
    """Points of the path tried in that search."""


@described
class ContinuationOptions:
    """Continuation from event to event: step control, order of bond failures, collapse bracket."""

    simultaneous_failures: Pure = Field(default=1e-4, ge=0, lt=1)
    """Bonds whose load is within this share of the largest fail together (1)."""
    overload_tolerance: Pure = Field(default=1e-6, gt=0)
    """Stress beyond the strength at which a bond fails, over the strength (1)."""
    event_tolerance: Pure = Field(default=0.01, gt=0)
    """Overload up to which the load factor at which a bond fails is located, over the strength (1)."""
    weak_bond_overload: Pure = Field(default=1.0, gt=0)
    """The same for weak bonds, over the stress of a block's weight (1). A bond is weak if its tensile strength is less
    than that stress: its failure releases next to no energy."""
    weak_bond_group: Pure = Field(default=0.5, gt=0, le=1)
    """Share of the largest overload from which weak bonds fail with the most overloaded one (1)."""
    first_step: Pure = Field(default=0.005, gt=0, le=1)
    """First step of the movement of a wall without bonds, over the movement (1); the energy balance lengthens it."""
    max_halvings: Count = Field(default=5, ge=0, le=50)
    """Halvings of a step without equilibrium."""
    collapse_bracket: Pure = Field(default=1e-4, gt=0)
    """Load factor between the last equilibrium and collapse under live load (1)."""
    fallback_residual_tolerance: Pure = Field(default=1e-3, ge=0)
    """Residual that is accepted where Coulomb friction admits no equilibrium (mean block weights)."""
    stagnation_limit: Count = Field(default=8, ge=0)
    """States of dynamic relaxation in a row that do not halve the least residual, after which such a state is taken."""


@described
class EnergyOptions:
    """Step control by the energy balance; its tolerance is ``[solver] step_energy_tolerance``."""

    step_share: Pure = Field(default=0.2, gt=0)
    """Share of the tolerated energy error that one step may contribute (1)."""
    safety: Pure = Field(default=0.8, gt=0, le=1)
    """Factor on the step length that the error asks for (1)."""
    refinements: Count = Field(default=7, ge=0, le=50)
    """Halvings of an increment, or of a shorter first step, down to its shortest step."""


@described
class DynamicRelaxationOptions:
    """Dynamic relaxation: ramp, convergence checks, damping schedule.

    Stick-slip shakes the moving blocks. Local damping, a share of these forces, then brakes them like a friction that
    does not exist: a wall beyond its limit load would creep. So damping is reduced once the impact of the load has died
    away.
    """

    ramp_cycles: Count = Field(default=3000, ge=1)
    """Cycles in which the movement is applied."""
    max_cycles: Count = Field(default=400_000, ge=1)
    """Cycles in all, unless the wall is slowing down."""
    minimum_damping: Pure = Field(default=0.1, ge=0, lt=1)
    """Least local damping (1)."""


@described
class ReturnMappingOptions:
    """Return mapping of the joints: local Newton iterations and their guards (``damagepred.kernels.joint``)."""

    max_iterations: Count = Field(default=40, ge=1)
    """Newton iterations for the slip of a joint that softens by slip."""
    relative_tolerance: Pure = Field(default=1e-13, gt=0, lt=1)
    """Residual of that iteration over the shear stress (1)."""
    snap_back_ratio: Pure = Field(default=1e-6, gt=0, lt=1)
    """Tangent stiffness over k_s below which the bond snaps back: it breaks at once (1)."""
    dilatant_iterations: Count = Field(default=6, ge=0)
    """Newton iterations for the slip of a joint that dilates while it softens."""
    cap_slope_ratio: Pure = Field(default=1e-3, gt=0)
    """Shear limit over f_c below which the slope of the cap, infinite at its tip, is bounded (1)."""
    yield_tolerance: Pure = Field(default=1e-9, gt=0, lt=1)
    """Distance from a limit, over the limit, within which a contact counts as yielding (1)."""

    def for_kernels(self, joints: np.ndarray | None = None) -> ReturnMapping:
        """Parameters for kernels."""
        general = None if joints is not None and all_plain(joints) else True
        return ReturnMapping(**asdict(self), general=general)


@described
class LinearSystemOptions:
    """Multifrontal equations, their Woodbury corrections, and when to refactorise instead."""

    regularisation: Pure = Field(default=1e-7, gt=0)
    """Share of the elastic diagonal stiffness that is added to the diagonal, so that detached blocks stay finite
    (1)."""
    dissected_size: Count = Field(default=48, ge=1)
    """Degrees of freedom of a part of the wall above which it is divided by a separator."""
    max_memory: Pure = Field(default=6.0, gt=0)
    """Of the dense matrices of all fronts (GB)."""
    max_changed_interfaces: Count = Field(default=200, ge=0)
    """Interfaces that a Woodbury correction may have; the unit-load responses of as many take memory. With 0, every
    change is factorised."""
    woodbury_tolerance: Pure = Field(default=1e-6, gt=0)
    """Residual of the correction forces over their largest, beyond which the system is refactorised (1)."""
    refactorisation_ratio: Pure = Field(default=1.5, gt=0)
    """Cost of all corrections since the last factorisation over the cost of a new one, from which a new one is made
    (1)."""


@described
class CreepOptions:
    """Creep of joints along a history: steps in time."""

    longest_step: Pure = Field(default=0.1, gt=0)
    """Longest step over the relaxation time (1); exact at constant opening, otherwise of second order."""


@described
class ExplicitOptions:
    """Convergence, collapse and divergence on the explicit load path."""

    check_interval: Count = Field(default=50, ge=1)
    """Cycles between two checks of the unbalanced force."""
    passed_checks: Count = Field(default=3, ge=1)
    """Checks in a row below the tolerance; an oscillation passes through balance without rest."""


@described
class DynamicsOptions:
    """Contact search, contact geometry, time step and divergence of runs in physical time."""

    skin: Pure = Field(default=0.1, gt=0)
    """Distance within which blocks are neighbours of a point, over the size of the smallest block (1)."""
    search_distance: Pure = Field(default=0.4, gt=0, lt=0.5)
    """Movement of a point that triggers the next search, over that distance (1). Below one half, two points that
    approach each other have not met before."""
    wide_block_ratio: Pure = Field(default=4.0, ge=1)
    """Width over the median from which a block is a candidate for every point (1)."""
    point_steps_per_check: Count = Field(default=5_000_000, ge=1)
    """Points times steps between two checks for an interruption and for finite displacements."""


RETIRED = {
    "newton": "undamped_iterations minimum_step stagnation_tolerance early_divergence_ratio "
    "early_divergence_iterations divergence_ratio divergence_displacement finite_difference_step",
    "newton_with_line_search": "full_step_reduction flat_slope stagnation_ratio",
    "line_search": "maximum_step safeguard",
    "coulomb": "max_minimisation_iterations warm_start_residual max_failures first_forcing warm_start_iterations "
    "full_updates updates_per_factor",
    "jacks": "zero_load_ratio zero_load_bracket",
    "continuation": "event_step_growth distant_step_growth clipped_step max_event_cuts minimum_event_share "
    "maximum_event_share minimum_event_step least_halvings interpolation_aim minimum_predicted_share "
    "collapse_relaxation fallback_deflection_tolerance predictor_aim",
    "energy": "shortest_cut growth",
    "dynamic_relaxation": "first_check check_growth convergence_window slowing_ratio damping_cycles damping_decay "
    "uplift_checks volume_rate_growth volume_answer",
    "linear_system": "singular_pivot_ratio max_shared_memory inversion_panel response_batch max_loop_rows "
    "inversion_weight assembly_weight call_overhead response_weight solution_weight vector_weight product_weight "
    "keep_farther_levels keep_unchanged_fronts keep_responses order",
    "explicit": "gain_halving_cycles gain_halving_time damping_halving_cycles minimum_damping trusted_time_step "
    "collapse_bracket zero_load_ratio zero_load_bracket divergence_displacement",
    "dynamics": "edge_overrun release_opening facing_cosine continuation_cosine max_cells corner_sine "
    "middle_tolerance eigenvalue_tolerance dense_eigenvalues outputs_at_rest divergence_energy_ratio "
    "divergence_energy_error",
}
"""Keys of older versions, which are read and have no effect: constants now, beside their algorithms."""
RETIRED_TABLES = (
    *("damped_newton", "zone_selection", "time_stepping", "jack_servo", "mechanism"),
    *("elastic_solution", "symmetry"),
)


@described
class SolverOptions:
    """Tolerances, budgets and factors of the solvers, for experts: tables ``[solver.advanced.newton]`` and so on.

    Defaults suit all walls of the verification.
    """

    newton: NewtonOptions = Field(default_factory=NewtonOptions)
    newton_with_line_search: NewtonLineSearchOptions = Field(default_factory=NewtonLineSearchOptions)
    line_search: LineSearchOptions = Field(default_factory=LineSearchOptions)
    coulomb: CoulombOptions = Field(default_factory=CoulombOptions)
    jacks: JackOptions = Field(default_factory=JackOptions)
    continuation: ContinuationOptions = Field(default_factory=ContinuationOptions)
    energy: EnergyOptions = Field(default_factory=EnergyOptions)
    dynamic_relaxation: DynamicRelaxationOptions = Field(default_factory=DynamicRelaxationOptions)
    return_mapping: ReturnMappingOptions = Field(default_factory=ReturnMappingOptions)
    linear_system: LinearSystemOptions = Field(default_factory=LinearSystemOptions)
    creep: CreepOptions = Field(default_factory=CreepOptions)
    explicit: ExplicitOptions = Field(default_factory=ExplicitOptions)
    dynamics: DynamicsOptions = Field(default_factory=DynamicsOptions)

    @classmethod
    def of(cls, settings: Solver, source: str = "scene") -> SolverOptions:
        """Options that ``[solver.advanced]`` sets, defaults elsewhere."""
        if not settings.advanced:
            return DEFAULTS
        tables = {
            name: dict(table) if isinstance(table, Mapping) else table for name, table in settings.advanced.items()
        }
        for name in tables.keys() & set(RETIRED_TABLES):
            del tables[name]
            warnings.warn(f"[solver.advanced.{name}] has no effect any more; leave it out", stacklevel=2)
        for name, keys in RETIRED.items():
            for key in keys.split():
                if isinstance(table := tables.get(name), dict) and table.pop(key, None) is not None:
                    warnings.warn(f"[solver.advanced.{name}] {key} has no effect any more; leave it out", stacklevel=2)
        return build(_File, {"solver": {"advanced": tables}}, source).solver.advanced

    def to_json(self) -> str:
        """All values as JSON for archives."""
        return _json(self)


@cache
def _json(options: SolverOptions) -> str:
    """Options as JSON; all samples of a study share them."""
    return json.dumps(plain(options))


@described
class _Table:
    advanced: SolverOptions


@described
class _File:
    """Path of the options in a scene, for messages."""

    solver: _Table


DEFAULTS = SolverOptions()


def with_recorded_options(settings: Solver, recorded: str) -> Solver:
    """Settings that solve with recorded options instead of the present defaults."""
    today: dict[str, dict[str, Any]] = plain(SolverOptions.of(settings))
    changed: dict[str, dict[str, Any]] = {
        table: {key: value for key, value in values.items() if today[table].get(key, value) != value}
        for table, values in json.loads(recorded).items()
        if table in today
    }
    changed = {table: values for table, values in changed.items() if values}
    if not changed:
        return settings
    given = dict(settings.advanced or {})
    return replace(
        settings, advanced=given | {table: {**given.get(table, {}), **new} for table, new in changed.items()}
    )


def option_classes() -> dict[str, type]:
    """Options class of each table of ``[solver.advanced]``."""
    return {f.name: type(getattr(DEFAULTS, f.name)) for f in dataclasses.fields(DEFAULTS)}
