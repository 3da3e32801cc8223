"""All options of the solvers: ``[solver.advanced]``, one table for each options class beside an algorithm."""

from __future__ import annotations

import dataclasses
import json
import warnings
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from typing import Any

from pydantic import Field

from damagepred.scene import Solver
from damagepred.scene.described import described
from damagepred.scene.quantity import Count, Pure
from damagepred.scene.reading import build, plain
from damagepred.solvers.dynamics.options import DynamicsOptions
from damagepred.solvers.explicit.options import ExplicitOptions
from damagepred.solvers.quasi_static.options import (
    ContinuationOptions,
    CoulombOptions,
    DynamicRelaxationOptions,
    EnergyOptions,
    JackOptions,
    LinearSystemOptions,
    LineSearchOptions,
    NewtonLineSearchOptions,
    NewtonOptions,
    ReturnMappingOptions,
)
from damagepred.solvers.system.options import CreepOptions, ElasticSolutionOptions


@described
class SymmetryOptions:
    """Symmetry reduction of walls that are their own mirror image: detection, and guides on the axis.

    Attributes
    ----------
    small_wall : int
        Blocks up to which the quasi-static solver applies dead load to the whole wall, faster than the detection.
    rounding : float
        Tolerated difference between mirror images: of positions over the size of the wall, of stiffness, load and
        movement over the largest value (1).
    """

    small_wall: Count = Field(default=200, ge=0)
    rounding: Pure = Field(default=1e-9, gt=0, lt=1)


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
    "symmetry": "guide_shear_ratio guide_cohesion",
    "explicit": "gain_halving_cycles gain_halving_time damping_halving_cycles minimum_damping trusted_time_step "
    "collapse_bracket zero_load_ratio zero_load_bracket divergence_displacement",
    "dynamics": "edge_overrun release_opening facing_cosine continuation_cosine max_cells corner_sine "
    "middle_tolerance eigenvalue_tolerance dense_eigenvalues outputs_at_rest divergence_energy_ratio "
    "divergence_energy_error",
}
"""Keys of older versions, which are read and have no effect: constants now, beside their algorithms."""
RETIRED_TABLES = "damped_newton", "zone_selection", "time_stepping", "jack_servo", "mechanism"


@described
class SolverOptions:
    """Tolerances, budgets and factors of the solvers, for experts; defaults suit all walls of the verification.

    Attributes
    ----------
    newton, newton_with_line_search, line_search, coulomb, jacks, continuation, energy, dynamic_relaxation, \
    return_mapping, linear_system, elastic_solution, creep, symmetry, explicit, dynamics
        The tables ``[solver.advanced.newton]`` and so on; see their classes.
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
    elastic_solution: ElasticSolutionOptions = Field(default_factory=ElasticSolutionOptions)
    creep: CreepOptions = Field(default_factory=CreepOptions)
    symmetry: SymmetryOptions = Field(default_factory=SymmetryOptions)
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
