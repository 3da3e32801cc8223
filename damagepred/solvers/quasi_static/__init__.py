"""Quasi-static solver: the path of equilibria without time, damping or loading rate.

``stepper`` is the solver for the driver over increments. One step of the path, in the order of the calls:

1. ``Continuation._next_target`` sets the next load factor: from ``StepControl.target``, or at the next event, where
   ``predict`` (kernels/equilibrium) expects a bond to fail.
2. ``Continuation._solve_step`` seeks the equilibrium there. ``Equilibrium.find`` tries Newton's method and the Tresca
   fixed point; where they fail, ``snap_through`` follows the motion (``dynamic_relaxation``). Rigid, elastic and
   deformable blocks, cracking footings and jacks go through the same ``run_newton`` and ``wall_residual``.
3. Once Newton's method has converged, ``run_newton`` calls ``store_tangent`` for the next prediction, and ``complete``:
   condensed parts, condensed joints that slide, bond loads. ``Equilibrium.find`` makes fronts active whose joints slide
   or whose blocks yield, and seeks the equilibrium again.
4. ``Continuation._end_step`` takes ``largest_bond_load``. An overload beyond the event tolerance shortens the step.
   Otherwise ``commit`` updates history, ``bond_failures`` and ``energy_balance``, unless the energy error is too large.
5. ``_redistribute_failures`` fails overloaded bonds at constant load, and repeats 2 to 4 until all others hold.

``residual``: the wall as structures for kernels (``components``, ``external_load``), and its forces.
``linear_system``: tangent equations, by ``elimination_tree``, and static condensation. ``superelements``: deformable
blocks.
"""
