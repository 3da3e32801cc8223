"""Deformable blocks as superelements on their boundaries: forces, tangents and interior of elastic and yielding blocks.

A block has n degrees of freedom, the r of its boundary first. Elastic, it is condensed once (Guyan
1965). A block in which zones yield is active: its interior is in equilibrium at each displacement of the boundary.
"""

import math

import numpy as np

from damagepred.kernels.jit import kernel, law, phase, rule
from damagepred.kernels.linear.substitution import add_row
from damagepred.kernels.zone.forces import place_facets, scatter_facet_forces
from damagepred.kernels.zone.law import four, seven, within_yield_surface, zone_return, zone_tangent
from damagepred.kernels.zone.structures import (
    BLOCK_FORCES,
    CORRECT_ACTIVE,
    PLACE_FACETS,
    RECOVER_BLOCKS,
    RESULTANT,
    UPDATE_TANGENTS,
)

TOLERANCE = 1e-10
"""Residual of the interior of a yielding block, over the largest nodal force of its zones (1)."""
MAX_ITERATIONS = 40
"""Newton iterations for the equilibrium inside a block."""
MAX_LINE_SEARCH_STEPS = 20
"""Reductions of a Newton step."""
SLOPE_RATIO = 0.5
"""Slope of the energy at the end of a step, over that at its start, that ends the line search (1)."""
RESIDUAL_STIFFNESS = 1e-5
"""Share of the elastic moduli added to the tangent of yielding zones, so that it is not singular (1)."""


@law
def _trial_stress(rows, dof, moduli, plastic, u):
    """Return the elastic trial stress s_xx, s_yy, s_xy, s_zz (Pa) of a zone."""
    e_xx, e_yy, g_xy, e_zz = -plastic[0], -plastic[1], -plastic[2], -plastic[3]
    for i in range(10):
        e_xx += rows[0, i] * u[dof[i]]
        e_yy += rows[1, i] * u[dof[i]]
        g_xy += rows[2, i] * u[dof[i]]
    c11, c12, c33, c13, czz = moduli[0], moduli[1], moduli[2], moduli[3], moduli[4]
    return (
        c11 * e_xx + c12 * e_yy + c13 * e_zz,
        c12 * e_xx + c11 * e_yy + c13 * e_zz,
        c33 * g_xy,
        c13 * (e_xx + e_yy) + czz * e_zz,
    )


@law
def _matrix(shapes, s, matrices):
    """Matrix (n, n) of a shape."""
    n, first = shapes.size[s], shapes.first_entry[s]
    return matrices[first : first + n * n].reshape(n, n)


@law
def _cells(shapes, s):
    """Cells of a shape (c, 10)."""
    return shapes.cells[shapes.first_cell[s] : shapes.first_cell[s + 1]]


@rule
def _internal_force(blocks, d, plastic, u, trial, force):
    """Fill ``trial`` stresses of the zones of block d, and its internal force after return mapping (n,).

    ``u`` are its displacements (n,). Returns the largest nodal force of a zone (N), and whether a zone yields.
    """
    shapes, s = blocks.shapes, blocks.shape[d]
    moduli, limits, largest, yields = seven(shapes.elasticity[s]), seven(blocks.strength[d]), 0.0, False
    first, cells = blocks.first_zone[d], _cells(shapes, s)
    force[:] = 0.0
    for z in range(4 * cells.shape[0]):
        dof, rows, stress = cells[z // 4], blocks.rows[first + z], trial[first + z]
        t = _trial_stress(rows, dof, moduli, plastic[first + z], u)
        stress[0], stress[1], stress[2], stress[3] = t
        s_xx, s_yy, s_xy, _, _, _, _, _, how = zone_return(t, moduli, limits)
        yields |= how != 0
        volume = blocks.volume[first + z]
        for i in range(10):
            nodal = volume * (rows[0, i] * s_xx + rows[1, i] * s_yy + rows[2, i] * s_xy)
            force[dof[i]] += nodal
            largest = max(largest, abs(nodal))
    return largest, yields


@rule
def _fill_tangent(blocks, d, trial, tangent):
    """Fill the tangent of all degrees of freedom of a block (n, n) at trial stresses; return whether a zone yields."""
    shapes, s = blocks.shapes, blocks.shape[d]
    moduli, limits, yields = seven(shapes.elasticity[s]), seven(blocks.strength[d]), False
    first, cells, stiffness = blocks.first_zone[d], _cells(shapes, s), _matrix(shapes, s, shapes.stiffness)
    for i in range(tangent.shape[0]):
        for j in range(tangent.shape[0]):
            tangent[i, j] = stiffness[i, j]
    for z in range(4 * cells.shape[0]):
        t = four(trial[first + z])
        if within_yield_surface(t, limits):
            continue
        yields = True
        dof, rows, volume = cells[z // 4], blocks.rows[first + z], blocks.volume[first + z]
        xx, xy, xs, yx, yy, ys, sx, sy, ss = zone_tangent(t, moduli, limits)
        xx, xy, yx = xx + (RESIDUAL_STIFFNESS - 1.0) * moduli[0], xy - moduli[1], yx - moduli[1]
        yy, ss = yy + (RESIDUAL_STIFFNESS - 1.0) * moduli[0], ss + RESIDUAL_STIFFNESS * moduli[2] - moduli[2]
        for i in range(10):
            x, y, g = volume * rows[0, i], volume * rows[1, i], volume * rows[2, i]
            left_x, left_y, left_s = x * xx + y * yx + g * sx, x * xy + y * yy + g * sy, x * xs + y * ys + g * ss
            for j in range(10):
                tangent[dof[i], dof[j]] += left_x * rows[0, j] + left_y * rows[1, j] + left_s * rows[2, j]
    return yields


@rule
def _solve(matrix, columns):
    """Solve a small system for columns, in place, by Gaussian elimination with row exchange (Golub and Van Loan)."""
    size = matrix.shape[0]
    for k in range(size):
        pivot = k
        for i in range(k + 1, size):
            if abs(matrix[i, k]) > abs(matrix[pivot, k]):
                pivot = i
        if pivot != k:
            for j in range(k, size):
                matrix[k, j], matrix[pivot, j] = matrix[pivot, j], matrix[k, j]
            for j in range(columns.shape[1]):
                columns[k, j], columns[pivot, j] = columns[pivot, j], columns[k, j]
        for i in range(k + 1, size):
            factor = matrix[i, k] / matrix[k, k]
            if factor != 0.0:
                for j in range(k + 1, size):
                    matrix[i, j] -= factor * matrix[k, j]
                for j in range(columns.shape[1]):
                    columns[i, j] -= factor * columns[k, j]
    for k in range(size - 1, -1, -1):
        for i in range(k + 1, size):
            factor = matrix[k, i]
            for j in range(columns.shape[1]):
                columns[k, j] -= factor * columns[i, j]
        for j in range(columns.shape[1]):
            columns[k, j] /= matrix[k, k]


@law
def _interior_residual(load, force, residual):
    """Fill load less internal force on the interior (i, 1); return its largest entry (N), NaN if any is."""
    largest, total, boundary = 0.0, 0.0, force.size - load.size
    for i in range(load.size):
        residual[i, 0] = load[i] - force[boundary + i]
        largest, total = max(largest, abs(residual[i, 0])), total + residual[i, 0]
    return largest + 0.0 * total  # NaN stays


@law
def _dot(a, b):
    """Return the product of two columns (i, 1)."""
    total = 0.0
    for i in range(a.shape[0]):
        total += a[i, 0] * b[i, 0]
    return total


@rule
def _start_interior(blocks, d, load, live, displacement, u, applied, elastic):
    """Fill displacements u (r + i,) of block d, and the load and elastic displacement of its i interior freedoms.

    The interior starts from its elastic solution and the inelastic displacement of the last equilibrium.
    """
    s, dof = blocks.shape[d], blocks.dof[blocks.first_dof[d] : blocks.first_dof[d + 1]]
    r, condensed = blocks.shapes.boundary[s], _matrix(blocks.shapes, s, blocks.shapes.condensed)
    for i in range(r):
        u[i] = displacement[dof[i]]
    for i in range(applied.size):
        applied[i] = load * blocks.loads[0, dof[r + i]] + live * blocks.loads[1, dof[r + i]]
    for i in range(applied.size):
        total = 0.0
        for j in range(applied.size):
            total += condensed[r + i, r + j] * applied[j]
        for j in range(r):
            total -= condensed[r + i, j] * u[j]
        elastic[i] = total
        u[r + i] = total + blocks.inelastic[dof[r + i]]


@rule
def _interior_step(blocks, d, trial, yields, residual, tangent, matrix, step):
    """Fill the Newton step of the interior (i, 1), the elastic one where that does not descend; return its slope."""
    s, count, slope = blocks.shape[d], step.shape[0], 0.0
    r, condensed = blocks.shapes.boundary[s], _matrix(blocks.shapes, s, blocks.shapes.condensed)
    if yields:
        _fill_tangent(blocks, d, trial, tangent)
        for i in range(count):
            step[i, 0] = residual[i, 0]
            for j in range(count):
                matrix[i, j] = tangent[r + i, r + j]
        _solve(matrix, step)
        slope = _dot(residual, step)
    if not slope > 0.0:
        for i in range(count):
            step[i, 0] = 0.0
            for j in range(count):
                step[i, 0] += condensed[r + i, r + j] * residual[j, 0]
        slope = _dot(residual, step)
    return slope


@rule
def _correct_block(blocks, d, plastic, load, live, trial, displacement, force):
    """Bring the interior of a yielding block to equilibrium, and correct the elastic forces on its boundary.

    Newton's method with line search on the energy; forces are NaN where the interior has no equilibrium.
    """
    s, dof = blocks.shape[d], blocks.dof[blocks.first_dof[d] : blocks.first_dof[d + 1]]
    n, r, condensed = dof.size, blocks.shapes.boundary[s], _matrix(blocks.shapes, s, blocks.shapes.condensed)
    i_count = n - r
    u, internal, tangent, matrix = np.zeros(n), np.zeros(n), np.zeros((n, n)), np.zeros((i_count, i_count))
    applied, elastic, start = np.zeros(i_count), np.zeros(i_count), np.zeros(i_count)
    residual, step = np.zeros((i_count, 1)), np.zeros((i_count, 1))
    _start_interior(blocks, d, load, live, displacement, u, applied, elastic)
    largest, yields = _internal_force(blocks, d, plastic, u, trial, internal)
    out = _interior_residual(applied, internal, residual)
    for _ in range(MAX_ITERATIONS):
        if not out > TOLERANCE * largest:
            break
        slope = _interior_step(blocks, d, trial, yields, residual, tangent, matrix, step)
        # line search: to where the energy no longer decreases along the step
        share = 1.0
        for i in range(i_count):
            start[i] = u[r + i]
        for _ in range(MAX_LINE_SEARCH_STEPS):
            for i in range(i_count):
                u[r + i] = start[i] + share * step[i, 0]
            largest, yields = _internal_force(blocks, d, plastic, u, trial, internal)
            out = _interior_residual(applied, internal, residual)
            now = _dot(residual, step)
            if now >= -SLOPE_RATIO * slope:
                break
            share *= min(max(slope / (slope - now), 0.1), 0.9)
    balanced = out <= 1e3 * TOLERANCE * largest
    for i in range(i_count):
        displacement[dof[r + i]] = u[r + i]
        if balanced:
            blocks.inelastic[dof[r + i]] = u[r + i] - elastic[i]
    # force of the active block less the force of the elastic one, which ``add_block_forces`` has added
    for i in range(r):
        total = -internal[i]
        for j in range(r):
            total += condensed[i, j] * u[j]
        for j in range(i_count):
            total += condensed[r + j, i] * applied[j]
        force[dof[i]] += total if balanced else math.nan


@phase(PLACE_FACETS)
def place_block_facets(blocks, displacement, force):
    """Compute the motion of the facets from their gridpoints, and set the forces on facets to 0."""
    facets = blocks.facets
    place_facets(facets, displacement)
    force[facets.first_dof : facets.first_dof + 3 * facets.turn_x.size] = 0.0


@phase(BLOCK_FORCES)
def add_block_forces(blocks, condensed_too, displacement, force):
    """Add forces on facets, and boundary forces of elastic blocks; ``condensed_too``: also in condensed fronts."""
    shapes = blocks.shapes
    scatter_facet_forces(blocks.facets, force)
    product = np.empty(blocks.dof.size)
    for d in range(blocks.shape.size):
        if blocks.condensed[d] and not condensed_too:
            continue
        s, dof = blocks.shape[d], blocks.dof[blocks.first_dof[d] : blocks.first_dof[d + 1]]
        r, condensed = shapes.boundary[s], _matrix(shapes, s, shapes.condensed)
        resisting = product[:r]
        resisting[:] = 0.0
        for j in range(r):
            add_row(displacement[dof[j]], condensed[j, :r], resisting)  # symmetric: row by row
        for i in range(r):
            force[dof[i]] -= resisting[i]
    blocks.outdated[0] = True


@phase(CORRECT_ACTIVE)
def correct_active_blocks(blocks, plastic, load, live, trial, displacement, force):
    """Bring the interior of active blocks to equilibrium, and correct the elastic forces on their boundaries."""
    for d in range(blocks.shape.size):
        if blocks.active[d]:
            _correct_block(blocks, d, plastic, load, live, trial, displacement, force)


@law
def largest_sum(first, column, weight, values):
    """Largest absolute value of the sums in the rows of a sparse matrix."""
    largest = 0.0
    for row in range(first.size - 1):
        total = 0.0
        for k in range(first[row], first[row + 1]):
            total += weight[k] * values[column[k]]
        largest = max(largest, abs(total))
    return largest


@phase(RESULTANT)
def largest_block_resultant(blocks, force):
    """Largest resultant on a block over the mean block weight: small forces on many gridpoints may add up."""
    return largest_sum(blocks.sums.first, blocks.sums.column, blocks.sums.resultant, force)


@rule
def _condense_tangent(blocks, d, tangents):
    """Condense the tangent of an active block to its boundary (r r,), from trial stresses; return whether it yields."""
    shapes, s = blocks.shapes, blocks.shape[d]
    n, r, condensed = shapes.size[s], shapes.boundary[s], _matrix(shapes, s, shapes.condensed)
    tangent, matrix, across = np.zeros((n, n)), np.zeros((n - r, n - r)), np.zeros((n - r, r))
    if not _fill_tangent(blocks, d, blocks.trial, tangent):
        for i in range(r):
            for j in range(r):
                tangents[i * r + j] = condensed[i, j]
        return False
    for i in range(n - r):
        for j in range(n - r):
            matrix[i, j] = tangent[r + i, r + j]
        for j in range(r):
            across[i, j] = tangent[r + i, j]
    _solve(matrix, across)
    for i in range(r):
        row = tangents[i * r : (i + 1) * r]
        for j in range(r):
            row[j] = tangent[i, j]
        for k in range(n - r):
            for j in range(r):
                row[j] -= tangent[i, r + k] * across[k, j]
    return True


@phase(UPDATE_TANGENTS)
def update_block_tangents(blocks, solver):
    """Condense the tangents of active blocks at the last residual; the next solution eliminates their fronts again."""
    if not blocks.outdated[0]:
        return
    factors, yielding = solver.substitution.factors, blocks.yielding
    tangents, first, front = factors.blocks.tangents, factors.blocks.first_entry, factors.blocks.front
    for d in range(yielding.size):
        if blocks.active[d]:
            before = yielding[d]
            yielding[d] = _condense_tangent(blocks, d, tangents[first[d] : first[d + 1]])
            blocks.outdated[0] = False
            if before or yielding[d]:
                solver.stale[front[d]] = True
                solver.must_factorise[0] = True
    factors.yields[:] = False
    for d in range(yielding.size):
        factors.yields[front[d]] |= yielding[d]


@phase(RECOVER_BLOCKS)
def recover_blocks(blocks, load, live, displacement):
    """Recover the interior of elastic blocks from their boundaries, and the motion of facets and of whole blocks."""
    shapes, particular, sums = blocks.shapes, blocks.particular, blocks.sums
    for d in range(blocks.shape.size):
        s, dof = blocks.shape[d], blocks.dof[blocks.first_dof[d] : blocks.first_dof[d + 1]]
        r, condensed = shapes.boundary[s], _matrix(shapes, s, shapes.condensed)
        for i in range(dof.size if blocks.active[d] else r, dof.size):
            total = 0.0
            for j in range(r):
                total += condensed[i, j] * displacement[dof[j]]
            displacement[dof[i]] = load * particular[0, dof[i]] + live * particular[1, dof[i]] - total
    place_facets(blocks.facets, displacement)
    for i in range(sums.dof.size):
        total = 0.0
        for k in range(sums.first[i], sums.first[i + 1]):
            total += sums.motion[k] * displacement[sums.column[k]]
        displacement[sums.dof[i]] = total


@kernel
def update_from_python(law, solver):
    """Update the tangents of active blocks; see ``update_block_tangents``."""
    law.yielding.update_tangents(law.blocks, solver)


@kernel
def trial_stresses(blocks, plastic, displacement, stress):
    """Fill s_xx, s_yy, s_xy and s_zz of the zones (z, 4), if none yields any further (Pa)."""
    for d in range(blocks.shape.size):
        s, dof = blocks.shape[d], blocks.dof[blocks.first_dof[d] : blocks.first_dof[d + 1]]
        moduli, first, cells = seven(blocks.shapes.elasticity[s]), blocks.first_zone[d], _cells(blocks.shapes, s)
        u = displacement[dof]
        for k in range(4 * cells.shape[0]):
            z = first + k
            t = _trial_stress(blocks.rows[z], cells[k // 4], moduli, plastic[z], u)
            stress[z, 0], stress[z, 1], stress[z, 2], stress[z, 3] = t


@kernel
def commit_plastic_strain(blocks, displacement, plastic, state):
    """Commit plastic strain (z, 4) and state (z,) of the zones of active blocks; return the plastic work (J)."""
    work = 0.0
    for d in range(blocks.shape.size):
        if not blocks.active[d]:
            continue
        s, dof = blocks.shape[d], blocks.dof[blocks.first_dof[d] : blocks.first_dof[d + 1]]
        moduli, limits = seven(blocks.shapes.elasticity[s]), seven(blocks.strength[d])
        first, cells, u = blocks.first_zone[d], _cells(blocks.shapes, s), displacement[dof]
        for k in range(4 * cells.shape[0]):
            z = first + k
            t = _trial_stress(blocks.rows[z], cells[k // 4], moduli, plastic[z], u)
            s_xx, s_yy, s_xy, s_zz, p_xx, p_yy, p_xy, p_zz, how = zone_return(t, moduli, limits)
            state[z] = how
            if how != 0:
                plastic[z, 0] += p_xx
                plastic[z, 1] += p_yy
                plastic[z, 2] += p_xy
                plastic[z, 3] += p_zz
                work += blocks.volume[z] * (s_xx * p_xx + s_yy * p_yy + s_xy * p_xy + s_zz * p_zz)
    return work
