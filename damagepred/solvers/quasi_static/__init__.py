"""Quasi-static solver: the path of equilibria without time, damping or loading rate.

``linear_system``: the linear wall, by ``elimination_tree`` and ``static_condensation``. ``residual``: forces and
linearisation, and the iterations of ``damagepred.kernels.equilibrium``, which take structures of arrays.
``tresca_fixed_point``: Coulomb friction. ``equilibrium``: all of these, and condensed fronts.
``continuation``: events from equilibrium to equilibrium, with its ``step_control``. ``dynamic_relaxation``:
snap-through. ``energy_balance``: where the work goes. ``stepper``: the solver for the driver over increments.
``options``: tolerances, budgets and factors of all of these.
"""
