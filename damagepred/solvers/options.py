"""Limits of the solvers: ``[solver.advanced]``, one table for each algorithm."""

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
from damagepred.scene.described import build, described, plain
from damagepred.scene.quantity import Count, Pure


@described
class NewtonOptions:
    """Newton's method on the Coulomb law with backtracking: first where jacks work by deflection."""

    max_iterations: Count = Field(default=16, ge=1)
    """Iterations of one attempt."""


@described
class NewtonLineSearchOptions:
    """Newton's method on the Coulomb law with line search: first where the wall has a potential."""

    max_iterations: Count = Field(default=40, ge=1)
    """Iterations of one attempt."""


@described
class DynamicRelaxationOptions:
    """Dynamic relaxation of a wall to an equilibrium that is not near."""

    max_cycles: Count = Field(default=400_000, ge=1)
    """Cycles in all, unless the wall is slowing down."""


@described
class LinearSystemOptions:
    """Multifrontal equations."""

    max_memory: Pure = Field(default=6.0, gt=0)
    """Of the dense matrices of all fronts (GB)."""


@described
class CreepOptions:
    """Creep of joints along a history: steps in time."""

    longest_step: Pure = Field(default=0.1, gt=0)
    """Longest step over the relaxation time (1); exact at constant opening, otherwise of second order."""


RETIRED = {
    "newton": "undamped_iterations minimum_step stagnation_tolerance early_divergence_ratio interior_tolerance "
    "early_divergence_iterations divergence_ratio divergence_displacement finite_difference_step",
    "newton_with_line_search": "full_step_reduction flat_slope stagnation_ratio slope_tolerance stagnation_limit",
    "dynamic_relaxation": "first_check check_growth convergence_window slowing_ratio damping_cycles damping_decay "
    "uplift_checks volume_rate_growth volume_answer ramp_cycles minimum_damping",
    "linear_system": "singular_pivot_ratio max_shared_memory inversion_panel response_batch max_loop_rows "
    "inversion_weight assembly_weight call_overhead response_weight solution_weight vector_weight product_weight "
    "keep_farther_levels keep_unchanged_fronts keep_responses order regularisation dissected_size "
    "max_changed_interfaces woodbury_tolerance refactorisation_ratio",
}
"""Keys of older versions, which are read and have no effect: constants now, beside their algorithms."""
RETIRED_TABLES = (
    *("damped_newton", "zone_selection", "time_stepping", "jack_servo", "mechanism", "elastic_solution", "symmetry"),
    *("line_search", "coulomb", "jacks", "continuation", "energy", "return_mapping", "explicit", "dynamics"),
)


@described
class SolverOptions:
    """Limits of the solvers, for experts: tables ``[solver.advanced.newton]`` and so on.

    Defaults suit all walls of the verification.
    """

    newton: NewtonOptions = Field(default_factory=NewtonOptions)
    newton_with_line_search: NewtonLineSearchOptions = Field(default_factory=NewtonLineSearchOptions)
    dynamic_relaxation: DynamicRelaxationOptions = Field(default_factory=DynamicRelaxationOptions)
    linear_system: LinearSystemOptions = Field(default_factory=LinearSystemOptions)
    creep: CreepOptions = Field(default_factory=CreepOptions)

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
