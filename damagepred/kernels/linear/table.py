"""The table of the tangent equations: factors of all fronts, the assembly, corrections, costs and counts."""

from damagepred.kernels.table import table_at, table_type

SYSTEM = table_type(
    # elimination tree, and the factors of its fronts
    "start parent first_boundary boundary_in_parent first_child children inverse_start coupling_start complement_start "
    "inverses coupling upper complements "
    # assembly
    "dof strain_displacement front_interfaces first_interface interface_front interface_index stiffness matrices "
    "strain_stiffness regularisation "
    # deformable blocks
    "front_blocks first_block block_first_dof block_index first_entry tangents yields "
    # Woodbury corrections
    "index slot interface_of_slot load_slot response compliance change changed_rows relative correction_force "
    "capacitance capacitance_pivots corrected unit unit_response "
    # costs of factorisations and corrections
    "factorisation_cost "
    # the active system, and scratch
    "fronts row_start boundary_row reached outdated stale unsymmetric active active_dofs target changed new rows room "
    "scratch gathered gathered_columns current particular wanted right solution "
    # arguments and workspace of LAPACK
    "lapack_integers lapack_reals lapack_letters pivots lapack_work block_room",
    integers="here k columns set_stiffness assemble_front assemble_blocks invert eliminate forward back solve_columns "
    "add_compliance stiffness_changes relative_displacements fill_capacitance respond correct row_count "
    "elastic held first_new last_new changed_count corrected_count factorised accurate matrix_size "
    "matrix_rows symmetric dgemm dgetrf dgetri dgetrs inversion_panel batch loop_rows keep_unchanged_fronts "
    "keep_responses iterations factorisations corrections occupied loads known_interfaces known_loads any_stale",
    numbers="call_overhead response_weight solution_weight vector_weight product_weight woodbury_tolerance "
    "refactorisation_ratio singular_pivot_ratio pivot_ratio spent solution_operations",
)
"""Attributes, with F fronts of s degrees of freedom and a boundary of b, m interfaces of w degrees of freedom, n slots,
a active degrees of freedom. Matrices of fronts lie one after the other, column by column.

Elimination tree
----------------
start, parent, first_boundary, boundary_in_parent
    See ``EliminationTree``.
first_child, children : array of int (F + 1,), array of int
    Where the children of each front begin, and these.
inverses, inverse_start : array
    Inverse of each front's stiffness (s, s), with all farther fronts eliminated, and where each begins.
coupling, upper, coupling_start : array
    Coupling of the boundary with the front (b, s), and the product of the inverse and the coupling of the front with
    its boundary (s, b); where each begins.
complements, complement_start : array
    Schur complement on the boundary (b, b) of the elements assembled in a front and its subtree; where each begins.

Assembly
--------
dof, strain_displacement : array of int (m, w), array (m, 3, w)
    See ``damagepred.solvers.system.interface_kinematics``.
front_interfaces, first_interface, interface_front, interface_index
    See ``EliminationTree``.
stiffness, matrices : array (m, 9), array (m, w, w)
    Factorised stiffness of the interfaces, and the same between the degrees of freedom of their sides.
strain_stiffness, regularisation : array (degrees of freedom,)
    In the order of the fronts: stiffness of strains of elastic blocks, and what keeps detached blocks in place.

Deformable blocks
-----------------
front_blocks, first_block, block_index
    See ``EliminationTree``; empty where ``assemble_blocks`` is 0.
block_first_dof, first_entry, tangents : array
    Where the boundary of each block begins; see ``Superelements``.
yields : array of bool (F,)
    Whether a block of the front yields.

Corrections
-----------
index : array of int (size,)
    Index of each degree of freedom among the active ones, -1 where prescribed or condensed.
slot, interface_of_slot : array of int (m,), (n,)
    Slot of an interface among those with unit-load responses, -1 if it has none; and the interface in each slot.
load_slot : array of int (m, 3)
    Slot of the response to unit opening, shear and rotation forces in an interface, -1 if there is none.
response : array (3 n, a)
    Displacements for unit loads.
compliance : array (3 n, 3 n)
    Opening, shear and rotation of the interfaces with a slot for unit loads, a row each.
change, changed_rows : array (n, 9), array of int (3 n,)
    Change D of the stiffness of changed interfaces, and which of its rows are not 0: 3 s + j for opening (0), shear (1)
    or rotation (2) of changed interface s.
relative, correction_force : array (2, 3 n), (6 n,)
    Relative displacements x and correction forces p of each right-hand side.
capacitance, capacitance_pivots : array (9 n n,), array of int (3 n,)
    Factors of 1 + D C, and their exchanges of rows.
corrected, corrected_count, factorised : array of int (n,), int, bool
    Changed interfaces of these factors, and their number, 0 if there are none; whether the present change is theirs.
unit, unit_response : array
    Unit loads of new interfaces, one a column, and the displacements for them.

Costs (weighted operations; weights: ``LinearSystemOptions``)
-----
factorisation_cost : array (F,)
    Of each front.
solution_operations : float
    Of one solution, forward and back.
spent : float
    Of all corrections since the last factorisation.

Active system
-------------
fronts : array of int
    Fronts that units work on, from the root on: the active or the condensed ones.
row_start, boundary_row : array of int
    Where the rows of each of these fronts begin in right-hand sides and solutions, and the rows of their boundaries.
reached, outdated, stale, unsymmetric : array of bool (F,)
    Fronts on which there are forces; those that the next elimination computes; those that the next factorisation must
    eliminate, and whether there are any in ``any_stale``; and those whose matrix is not symmetric.
current, particular : array (r, degrees of freedom)
    Right-hand sides in the order of the fronts, and particular solutions, of ``forward`` and ``back``.
active, active_dofs : array of int
    Interfaces and degrees of freedom of active fronts.
target : array (m, 9)
    Stiffness of the interfaces in the next solution.
changed, new : array of int (m,), (3 m,)
    Scratch: interfaces whose stiffness differs from the factorised one; unit loads of their changed rows that have no
    response yet, 3 i + j for opening (0), shear (1) or rotation (2) of interface i.
rows, room, scratch, gathered, gathered_columns : array (2, a), (2 r, a), array, array, array
    Scratch: right-hand sides, intermediate solutions of up to r of them, the matrix of a front, and displacements of or
    forces on a boundary.
iterations, factorisations, corrections : int
    Counts so far.
occupied, loads, known_interfaces, known_loads : int
    Interfaces with unit-load responses, and these; and those of which the compliance is known.
here : int
    Address of the table.
k, columns : int
    Front, and number of columns or rows, that a unit works on.
set_stiffness, assemble_front, ... correct : int
    Addresses of the units of these names.
wanted : array (m, 9)
    Stiffness of the interfaces for the next solution, of which that of active ones is copied to ``target``.
right, solution : array (2, size)
    Right-hand sides on all degrees of freedom, ``row_count`` of them, and solutions.
batch, loop_rows : int
    Unit loads whose responses are computed at a time; right-hand sides up to which loops are faster.
"""

system_at = table_at(SYSTEM, "SYSTEM")
"""What gives the table at an address."""
