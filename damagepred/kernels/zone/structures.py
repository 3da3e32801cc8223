"""Deformable blocks as structures for kernels, and the functions that only walls with them compile."""

from numba import types

from damagepred.kernels.linear.solver import Solver
from damagepred.kernels.structures import (
    FLAGS,
    FLOAT_BLOCKS,
    FLOAT_ROWS,
    FLOATS,
    INTEGER_ROWS,
    INTEGERS,
    Structure,
)
from damagepred.kernels.zone.forces import FACETS


class BlockShapes(Structure):
    """Matrices that blocks of one geometry, material and support share."""

    size = INTEGERS
    boundary = INTEGERS
    """n and r of each shape."""
    first_entry = INTEGERS
    """Where the matrices (n, n) of each shape begin, row by row."""
    stiffness = FLOATS
    """Stiffness of all degrees of freedom (N/m)."""
    condensed = FLOATS
    """[[S, 0], [R, F]]: Schur complement on the boundary (N/m), recovery matrix, interior flexibility (m/N)."""
    first_cell = INTEGERS
    cells = INTEGER_ROWS
    """Places, among the n, of x and y of the five gridpoints of each cell (c, 10); first cell of each shape."""
    elasticity = FLOAT_ROWS
    """Parameters of ``damagepred.kernels.zone.law`` (s, 7)."""


class BlockSums(Structure):
    """Weighted sums over the gridpoints of each block: three rows of a sparse matrix, for x, y and turning."""

    dof = INTEGERS
    """Degrees of freedom of the blocks as a whole."""
    first = INTEGERS
    column = INTEGERS
    """Degree of freedom of each entry, and first entry of each row."""
    motion = FLOATS
    """Weights in the mean motion."""
    resultant = FLOATS
    """Weights in the resultant over the mean block weight (1/N)."""


class DeformableBlocks(Structure):
    """Deformable blocks, d of them, of z zones; loads and interior displacements stand at their degrees of freedom.

    ``Superelements`` (solvers/quasi_static) makes them, and sets ``active`` and ``condensed``; kernels change fields
    marked with their names, and trial stresses.
    """

    shapes = BlockShapes.kind
    facets = FACETS
    sums = BlockSums.kind
    shape = INTEGERS
    first_zone = INTEGERS
    """Shape and first zone of each block."""
    first_dof = INTEGERS
    dof = INTEGERS
    """Degrees of freedom block by block, boundaries first, and first one of each block (d + 1,)."""
    strength = FLOAT_ROWS
    """Parameters of ``damagepred.kernels.zone.law`` (d, 7)."""
    loads = FLOAT_ROWS
    """Dead and live load (2, size) (N)."""
    particular = FLOAT_ROWS
    """Interior displacement under them, boundaries held (2, size) (m)."""
    inelastic = FLOATS
    """Inelastic part of the interior displacement in the last solution (size,) (m) (``_correct_block``)."""
    rows = FLOAT_BLOCKS
    volume = FLOATS
    """Strain-displacement matrices (z, 3, 10), and volumes (z,) (m3)."""
    trial = FLOAT_ROWS
    spare_trial = FLOAT_ROWS
    """Trial stresses of the zones of active blocks at the last residual (z, 4) (Pa), and room for those elsewhere."""
    active = FLAGS
    """Blocks of which a zone yields, or has yielded."""
    condensed = FLAGS
    """Blocks of condensed fronts."""
    yielding = FLAGS
    """Blocks of which a zone yields in the last tangents (``update_block_tangents``)."""
    outdated = FLAGS
    """Whether there was a residual (``add_block_forces``) since the last tangents: one entry."""


PLACE_FACETS = types.void(DeformableBlocks.kind, FLOATS, FLOATS)
BLOCK_FORCES = types.void(DeformableBlocks.kind, types.boolean, FLOATS, FLOATS)
CORRECT_ACTIVE = types.void(DeformableBlocks.kind, FLOAT_ROWS, types.float64, types.float64, FLOAT_ROWS, FLOATS, FLOATS)
RESULTANT = types.float64(DeformableBlocks.kind, FLOATS)
UPDATE_TANGENTS = types.void(DeformableBlocks.kind, Solver.kind)
RECOVER_BLOCKS = types.void(DeformableBlocks.kind, types.float64, types.float64, FLOATS)


class YieldLaw(Structure):
    """Functions that only walls compile of which a zone can yield; ``empty`` in other walls."""

    present = types.boolean
    correct_active = types.FunctionType(CORRECT_ACTIVE)  # correct_active_blocks
    update_tangents = types.FunctionType(UPDATE_TANGENTS)


class BlockLaw(Structure):
    """Deformable blocks, and the functions that only walls with them compile; ``empty`` in other walls."""

    present = types.boolean
    blocks = DeformableBlocks.kind
    place_facets = types.FunctionType(PLACE_FACETS)
    add_forces = types.FunctionType(BLOCK_FORCES)
    largest_resultant = types.FunctionType(RESULTANT)
    yielding = YieldLaw.kind
    recover = types.FunctionType(RECOVER_BLOCKS)
