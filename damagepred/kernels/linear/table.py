"""The table of the tangent equations: factors of all levels, the assembly, corrections, costs and counts."""

from damagepred.kernels.table import table_at, table_type

SYSTEM = table_type(
    # levels: sizes, inverses, Schur complements, couplings
    "start inverse_start inverses complements first_pair far_index near_index near_far far_near "
    # assembly
    "dof strain_displacement interface_level level_interfaces first_interface index_in_level level_of_dof "
    "couplings first_coupling pair far_is_b stiffness matrices strain_stiffness regularisation "
    # deformable blocks
    "first_block level_blocks block_first_dof block_dofs first_entry tangents "
    # Woodbury corrections
    "index slot interface_of_slot response compliance change changed_rows relative correction_force capacitance "
    "unit unit_response "
    # costs of factorisations and corrections
    "factorisation_cost level_sizes level_squares "
    # the active system, and scratch
    "active active_dofs target changed new rows room scratch current particular wanted right solution "
    # arguments and workspace of LAPACK
    "lapack_integers lapack_reals lapack_letters pivots lapack_work",
    integers="here k columns set_stiffness assemble_level assemble_blocks assemble_couplings schur_complement invert "
    "eliminate "
    "forward back solve_columns add_compliance stiffness_changes relative_displacements fill_capacitance "
    "respond correct "
    "row_count farthest nearest elastic held "
    "first_new last_new changed_count accurate matrix_size inverse_first symmetric first_back last_back "
    "dgemm dpotrf dpotri dgetrf dgetri dgesv active_levels batch loop_rows keep_farther_levels keep_responses "
    "iterations factorisations corrections occupied farthest_changed has_blocks blocks_level",
    numbers="call_overhead solution_weight vector_weight product_weight woodbury_tolerance singular_pivot_ratio "
    "pivot_ratio spent",
)
"""Attributes, with s the size of a level, m interfaces of w degrees of freedom, n slots, a active degrees of freedom.

Levels
------
start : array of int (levels + 1,)
    Where each level starts in the order of the levels.
inverses, complements, inverse_start : array
    Inverse of each level's stiffness, and what the elimination of the next level subtracts from that stiffness; both
    transposed, one after the other, row by row; and where each begins.
first_pair : array of int (levels + 1,)
    Coupled pairs between levels k and k - 1 are ``first_pair[k]`` to ``first_pair[k + 1]``.
far_index, near_index : array of int (pairs, w / 2)
    Indices in their levels of the degrees of freedom of a pair's sides, -1 where prescribed.
near_far, far_near : array (pairs, w / 2, w / 2)
    See ``assemble_couplings``.

Assembly
--------
dof, strain_displacement : array of int (m, w), array (m, 3, w)
    See ``damagepred.solvers.system.interface_kinematics``.
level_interfaces, first_interface : array of int
    Interfaces with a side in each level, one level after the other, and where each level begins.
interface_level, index_in_level, level_of_dof, couplings, first_coupling, pair, far_is_b
    See ``LevelLayout``.
stiffness, matrices : array (m, 9), array (m, w, w)
    Factorised stiffness of the interfaces, and the same between the degrees of freedom of their sides.
strain_stiffness, regularisation : array (degrees of freedom,)
    In the order of the levels: stiffness of strains of elastic blocks, and what keeps detached blocks in place.

Deformable blocks
-----------------
first_block, level_blocks : array of int
    Blocks with degrees of freedom in each level, one level after the other, and where each level begins.
block_first_dof, block_dofs, first_entry, tangents
    See ``BlockPlaces`` and ``Superelements``; empty where ``has_blocks`` is 0.

Corrections
-----------
index : array of int (size,)
    Index of each degree of freedom among the active ones, -1 where prescribed or condensed.
slot, interface_of_slot : array of int (m,), (n,)
    Slot of an interface among those with unit-load responses, -1 if it has none; and the interface in each slot.
response : array (3 n, a)
    Displacements for unit opening, shear and rotation forces in the interfaces.
compliance : array (3 n, 3 n)
    Relative displacements of the interfaces for unit forces in them.
change, changed_rows : array (n, 9), array of int (3 n,)
    Change D of the stiffness of changed interfaces, and which of its rows are not 0: 3 s + j for opening (0), shear (1)
    or rotation (2) of changed interface s.
relative, correction_force, capacitance : array (2, 3 n), (6 n,), (9 n n,)
    Relative displacements x and correction forces p of each right-hand side, and 1 + D C, transposed.
unit, unit_response : array
    Unit loads of new interfaces, one a column, and the displacements for them.

Costs (weighted operations; weights: ``LinearSystemOptions``)
-----
factorisation_cost, level_sizes, level_squares : array (levels + 1,)
    Of the elimination of the first levels; sums of their sizes and of the squares of these.
spent : float
    Of all corrections since the last factorisation.

Active system
-------------
current, particular : array (r, degrees of freedom)
    Right-hand sides in the order of the levels, and particular solutions, of ``forward`` and ``back``.
active, active_dofs : array of int
    Interfaces and degrees of freedom of active levels.
target : array (m, 9)
    Stiffness of the interfaces in the next solution.
changed, new : array of int (m,)
    Scratch: interfaces whose stiffness differs from the factorised one, and those of them without responses.
rows, room, scratch : array (2, a), (2 r, a), (2 s s,)
    Scratch: right-hand sides, intermediate solutions of up to r of them, and matrices of a level.
iterations, factorisations, corrections : int
    Counts so far.
occupied : int
    Interfaces with unit-load responses.
farthest_changed, blocks_level : int
    Farthest level that the next factorisation must eliminate at least, and that of a yielding block; -1: none.
here : int
    Address of the table.
k, columns : int
    Level, and number of columns or rows, that a unit works on.
set_stiffness, assemble_level, ... correct : int
    Addresses of the units of these names.
wanted : array (m, 9)
    Stiffness of the interfaces for the next solution, of which that of active ones is copied to ``target``.
right, solution : array (2, size)
    Right-hand sides on all degrees of freedom, ``row_count`` of them, and solutions.
batch, loop_rows : int
    Interfaces whose unit-load responses are computed at a time; right-hand sides up to which loops are faster.
"""

system_at = table_at(SYSTEM, "SYSTEM")
"""What gives the table at an address."""
