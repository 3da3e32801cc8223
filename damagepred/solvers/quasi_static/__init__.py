"""Quasi-static solver: the path of equilibria without time, damping or loading rate.

``linear_system``: the linear wall, by ``level_layout``, ``block_tridiagonal``, ``static_condensation`` and
``woodbury_correction``, or a new factorisation by the rule of ``refactorisation``. ``residual``: forces and
linearisation. ``newton``, ``tresca_fixed_point``: its iterations. ``equilibrium``: both, and condensed courses.
``continuation``: events from equilibrium to equilibrium, with its ``step_control``. ``dynamic_relaxation``:
snap-through. ``energy_balance``: where the work goes. ``stepper``: the solver for the driver over increments.
``options``: tolerances, budgets and factors of all of these.
"""
