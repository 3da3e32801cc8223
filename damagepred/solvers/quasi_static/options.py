"""Tolerances, budgets and factors of the quasi-static solver; each class belongs to the file of its name."""

from __future__ import annotations

from dataclasses import asdict

import numpy as np
from pydantic import Field

from damagepred.kernels.joint.return_mapping import ReturnMapping, all_plain
from damagepred.scene.described import described
from damagepred.scene.quantity import Count, Length, Pure


@described
class NewtonOptions:
    """Newton's method on the Coulomb law with backtracking: first where jacks work by deflection.

    Attributes
    ----------
    max_iterations : int
        Iterations of one attempt.
    interior_tolerance : float
        Residual of the interior of a yielding block, over the largest force of its zones (1).
    """

    max_iterations: Count = Field(default=16, ge=1)
    interior_tolerance: Pure = Field(default=1e-10, gt=0, lt=1)


@described
class NewtonLineSearchOptions:
    """Newton's method on the Coulomb law with line search: first where the wall has a potential.

    Attributes
    ----------
    max_iterations : int
        Iterations of one attempt.
    slope_tolerance : float
        Work of the residual along a step over that at its start, at which the line search ends (1).
    stagnation_limit : int
        Such iterations in a row that are allowed.
    """

    max_iterations: Count = Field(default=40, ge=1)
    slope_tolerance: Pure = Field(default=0.5, gt=0, lt=1)
    stagnation_limit: Count = Field(default=25, ge=0)


@described
class LineSearchOptions:
    """Line search along a step: root of the work of the residual, by regula falsi.

    Attributes
    ----------
    max_iterations : int
        Trial steps.
    slope_tolerance : float
        Work over that at the start of the step, at which the search ends in a Tresca problem (1).
    """

    max_iterations: Count = Field(default=30, ge=1)
    slope_tolerance: Pure = Field(default=0.3, gt=0, lt=1)


@described
class CoulombOptions:
    """Coulomb friction by Tresca fixed-point iteration.

    A search in vain costs more than dynamic relaxation. After each, the next search gets half the Newton iterations;
    after the second, third, ... the following 1, 3, 7 equilibria are sought by Newton's method alone. The first takes
    none away: where joints without a bond slide, half a step mostly finds an equilibrium where the whole step does not.
    A search that succeeds takes one failure back.

    Attributes
    ----------
    max_iterations : int
        Tresca problems solved for one equilibrium.
    max_newton_iterations : int
        Newton iterations of one search while none has been in vain.
    stagnation_limit : int
        Iterations in a row that do not halve the least residual, after which the search ends.
    forcing_share : float
        Residual tolerance of a Tresca problem over the residual of the Coulomb law with its bounds (1).
    relaxation_factors : tuple of float
        Successive factors of under-relaxation (1).
    """

    max_iterations: Count = Field(default=60, ge=1)
    max_newton_iterations: Count = Field(default=400, ge=1)
    stagnation_limit: Count = Field(default=8, ge=0)
    forcing_share: Pure = Field(default=0.01, gt=0, lt=1)
    relaxation_factors: tuple[Pure, ...] = Field(default=(0.5, 0.3, 0.15), min_length=1)


@described
class JackOptions:
    """Jacks whose deflection is given.

    Attributes
    ----------
    deflection_tolerance : float
        Difference between the deflection and its given value in equilibrium (m).
    max_iterations : int
        Points of the path tried in that search.
    """

    deflection_tolerance: Length = Field(default=1e-9, gt=0)
    max_iterations: Count = Field(default=40, ge=1)


@described
class ContinuationOptions:
    """Continuation from event to event: step control, order of bond failures, collapse bracket.

    Attributes
    ----------
    simultaneous_failures : float
        Bonds whose load is within this share of the largest fail together (1).
    overload_tolerance : float
        Stress beyond the strength at which a bond fails, over the strength (1).
    event_tolerance : float
        Overload up to which the load factor at which a bond fails is located, over the strength (1).
    weak_bond_overload : float
        The same for weak bonds, over the stress of a block's weight (1). A bond is weak if its tensile strength is less
        than that stress: its failure releases next to no energy.
    weak_bond_group : float
        Share of the largest overload from which weak bonds fail with the most overloaded one (1).
    first_step : float
        First step of the movement of a wall without bonds, over the movement (1); the energy balance lengthens it.
    max_halvings : int
        Halvings of a step without equilibrium.
    collapse_bracket : float
        Load factor between the last equilibrium and collapse under live load (1).
    fallback_residual_tolerance : float
        Residual that is accepted where Coulomb friction admits no equilibrium (mean block weights).
    stagnation_limit : int
        States of dynamic relaxation in a row that do not halve the least residual, after which such a state is taken.
    """

    simultaneous_failures: Pure = Field(default=1e-4, ge=0, lt=1)
    overload_tolerance: Pure = Field(default=1e-6, gt=0)
    event_tolerance: Pure = Field(default=0.01, gt=0)
    weak_bond_overload: Pure = Field(default=1.0, gt=0)
    weak_bond_group: Pure = Field(default=0.5, gt=0, le=1)
    first_step: Pure = Field(default=0.005, gt=0, le=1)
    max_halvings: Count = Field(default=5, ge=0, le=50)
    collapse_bracket: Pure = Field(default=1e-4, gt=0)
    fallback_residual_tolerance: Pure = Field(default=1e-3, ge=0)
    stagnation_limit: Count = Field(default=8, ge=0)


@described
class EnergyOptions:
    """Step control by the energy balance; its tolerance is ``[solver] step_energy_tolerance``.

    Attributes
    ----------
    step_share : float
        Share of the tolerated energy error that one step may contribute (1).
    safety : float
        Factor on the step length that the error asks for (1).
    refinements : int
        Halvings of an increment, or of a shorter first step, down to its shortest step.
    """

    step_share: Pure = Field(default=0.2, gt=0)
    safety: Pure = Field(default=0.8, gt=0, le=1)
    refinements: Count = Field(default=7, ge=0, le=50)


@described
class DynamicRelaxationOptions:
    """Dynamic relaxation: ramp, convergence checks, damping schedule.

    Stick-slip shakes the moving blocks. Local damping, a share of these forces, then brakes them like a friction that
    does not exist: a wall beyond its limit load would creep. So damping is reduced once the impact of the load has died
    away.

    Attributes
    ----------
    ramp_cycles : int
        Cycles in which the movement is applied.
    max_cycles : int
        Cycles in all, unless the wall is slowing down.
    minimum_damping : float
        Least local damping (1).
    """

    ramp_cycles: Count = Field(default=3000, ge=1)
    max_cycles: Count = Field(default=400_000, ge=1)
    minimum_damping: Pure = Field(default=0.1, ge=0, lt=1)


@described
class ReturnMappingOptions:
    """Return mapping of the joints: local Newton iterations and their guards (``damagepred.kernels.joint``).

    Attributes
    ----------
    max_iterations : int
        Newton iterations for the slip of a joint that softens by slip.
    relative_tolerance : float
        Residual of that iteration over the shear stress (1).
    snap_back_ratio : float
        Tangent stiffness over k_s below which the bond snaps back: it breaks at once (1).
    dilatant_iterations : int
        Newton iterations for the slip of a joint that dilates while it softens.
    cap_slope_ratio : float
        Shear limit over f_c below which the slope of the cap, infinite at its tip, is bounded (1).
    yield_tolerance : float
        Distance from a limit, over the limit, within which a contact counts as yielding (1).
    """

    max_iterations: Count = Field(default=40, ge=1)
    relative_tolerance: Pure = Field(default=1e-13, gt=0, lt=1)
    snap_back_ratio: Pure = Field(default=1e-6, gt=0, lt=1)
    dilatant_iterations: Count = Field(default=6, ge=0)
    cap_slope_ratio: Pure = Field(default=1e-3, gt=0)
    yield_tolerance: Pure = Field(default=1e-9, gt=0, lt=1)

    def for_kernels(self, joints: np.ndarray | None = None) -> ReturnMapping:
        """Parameters for kernels."""
        general = None if joints is not None and all_plain(joints) else True
        return ReturnMapping(**asdict(self), general=general)


@described
class LinearSystemOptions:
    """Multifrontal equations, their Woodbury corrections, and when to refactorise instead.

    Attributes
    ----------
    regularisation : float
        Share of the elastic diagonal stiffness that is added to the diagonal, so that detached blocks stay finite (1).
    dissected_size : int
        Degrees of freedom of a part of the wall above which it is divided by a separator.
    max_memory : float
        Of the dense matrices of all fronts (GB).
    max_changed_interfaces : int
        Interfaces that a Woodbury correction may have; the unit-load responses of as many take memory. With 0, every
        change is factorised.
    woodbury_tolerance : float
        Residual of the correction forces over their largest, beyond which the system is refactorised (1).
    refactorisation_ratio : float
        Cost of all corrections since the last factorisation over the cost of a new one, from which a new one is made
        (1).
    """

    regularisation: Pure = Field(default=1e-7, gt=0)
    dissected_size: Count = Field(default=48, ge=1)
    max_memory: Pure = Field(default=6.0, gt=0)
    max_changed_interfaces: Count = Field(default=200, ge=0)
    woodbury_tolerance: Pure = Field(default=1e-6, gt=0)
    refactorisation_ratio: Pure = Field(default=1.5, gt=0)
