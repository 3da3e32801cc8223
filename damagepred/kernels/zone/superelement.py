"""Superelement of a yielding block in the quasi-static solver: equilibrium of its interior, static condensation."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from damagepred.kernels.jit import kernel, law, rule
from damagepred.kernels.zone.law import within_yield_surface, zone_return, zone_tangent


class ShapeArrays(NamedTuple):
    """Blocks of one shape, b of them: n degrees of freedom each, r of the boundary before i of the interior.

    Attributes
    ----------
    dof : array of int (b, n)
        Degrees of freedom of each block.
    first_zone : array of int (b,)
        First zone of each block.
    cells : array of int (c, 10)
        Places, among a block's n, of x and y of the five gridpoints of its cells of four zones.
    stiffness, flexibility, recovery : array (n, n), (i, i), (i, r)
        Elastic stiffness (N/m), inverse of the interior's (m/N), and recovery matrix.
    condensed : array (r, r)
        Schur complement on the boundary (N/m).
    elasticity, strength : array (7,), (b, 7)
        See ``damagepred.kernels.zone.law``.
    loads : array (2, b, i)
        Dead and live load on the interior (N).
    inelastic : array (b, i)
        Inelastic part of the interior displacement in the last solution (m).
    """

    dof: NDArray[np.int64]
    first_zone: NDArray[np.int64]
    cells: NDArray[np.int64]
    stiffness: NDArray[np.float64]
    flexibility: NDArray[np.float64]
    recovery: NDArray[np.float64]
    condensed: NDArray[np.float64]
    elasticity: NDArray[np.float64]
    strength: NDArray[np.float64]
    loads: NDArray[np.float64]
    inelastic: NDArray[np.float64]


class ZoneArrays(NamedTuple):
    """All z zones.

    Attributes
    ----------
    rows : array (z, 3, 10)
        Strain-displacement matrices; see ``damagepred.solvers.system.deformable_blocks.strain_rows``.
    volume : array (z,)
        Area times thickness (m3).
    trial : array (z, 4)
        Trial stresses of active blocks in the last residual (Pa).
    """

    rows: NDArray[np.float64]
    volume: NDArray[np.float64]
    trial: NDArray[np.float64]


class InteriorOptions(NamedTuple):
    """Options of Newton's method for the equilibrium inside a block.

    Attributes
    ----------
    max_iterations : int
        Newton iterations.
    max_line_search_steps : int
        Reductions of a Newton step.
    slope_ratio : float
        Slope of the energy at the end of a step, over that at its start, that ends the line search (1).
    residual_stiffness : float
        Share of the elastic moduli added to the tangent of yielding zones, so that it is not singular (1).
    """

    max_iterations: int = 40
    max_line_search_steps: int = 20
    slope_ratio: float = 0.5
    residual_stiffness: float = 1e-5


OPTIONS = InteriorOptions()


@law
def _as_tuple(values):
    """Return seven numbers as a tuple."""
    return values[0], values[1], values[2], values[3], values[4], values[5], values[6]


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


@rule
def _internal_force(shape, zones, b, plastic, u, trial, force):
    """Compute the internal force of a block; return the largest nodal force of a zone (N), and whether one yields.

    ``trial`` (all zones, 4) and ``force`` (n,) are filled.
    """
    moduli, limits, largest, yields = _as_tuple(shape.elasticity), _as_tuple(shape.strength[b]), 0.0, False
    first = shape.first_zone[b]
    for i in range(force.size):
        force[i] = 0.0
    for z in range(4 * shape.cells.shape[0]):
        dof, rows, t = shape.cells[z // 4], zones.rows[first + z], trial[first + z]
        t[0], t[1], t[2], t[3] = _trial_stress(rows, dof, moduli, plastic[first + z], u)
        s_xx, s_yy, s_xy, _, _, _, _, _, how = zone_return(t[0], t[1], t[2], t[3], moduli, limits)
        yields |= how != 0
        volume = zones.volume[first + z]
        for i in range(10):
            nodal = volume * (rows[0, i] * s_xx + rows[1, i] * s_yy + rows[2, i] * s_xy)
            force[dof[i]] += nodal
            largest = max(largest, abs(nodal))
    return largest, yields


@rule
def _add_yielding(shape, zones, b, trial, tangent):
    """Add to the elastic stiffness of a block (n, n) what its yielding zones change; return whether any yields."""
    moduli, limits, yields = _as_tuple(shape.elasticity), _as_tuple(shape.strength[b]), False
    first = shape.first_zone[b]
    for z in range(4 * shape.cells.shape[0]):
        t = trial[first + z]
        if within_yield_surface(t[0], t[1], t[2], t[3], limits):
            continue
        yields = True
        dof, rows, volume = shape.cells[z // 4], zones.rows[first + z], zones.volume[first + z]
        xx, xy, xs, yx, yy, ys, sx, sy, ss = zone_tangent(t[0], t[1], t[2], t[3], moduli, limits)
        rest = OPTIONS.residual_stiffness
        xx, xy, yx = xx + (rest - 1.0) * moduli[0], xy - moduli[1], yx - moduli[1]
        yy, ss = yy + (rest - 1.0) * moduli[0], ss + rest * moduli[2] - moduli[2]
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
    """Compute the residual on the interior (i, 1); return its largest entry (N)."""
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


@kernel
def condensed_forces(shape, zones, listed, plastic, shares, tolerance, trial, displacement, force):
    """Bring the interior of yielding blocks to equilibrium, and correct the elastic forces on their boundaries.

    Newton's method with line search on the energy, from the elastic interior shifted by the inelastic part of the last
    solution.

    Parameters
    ----------
    shape, zones : ShapeArrays, ZoneArrays
        The blocks, and all zones.
    listed : array of int
        Active blocks of the shape.
    plastic : array (z, 4)
        Plastic strain of the last equilibrium.
    shares : tuple of float
        Shares of the dead and of the live load (1).
    tolerance : float
        Largest residual force over the largest nodal force of a zone (1).
    trial : array (z, 4)
        Filled with the trial stresses of the blocks (Pa).
    displacement : array (size,)
        Of all degrees of freedom (m); the interior's are updated.
    force : array (size,)
        Residual force with elastic blocks (N), corrected on boundaries; NaN where an interior has no equilibrium.
    """
    n, r = shape.stiffness.shape[0], shape.recovery.shape[1]
    i_count = n - r
    u, internal, tangent, matrix = np.zeros(n), np.zeros(n), np.zeros((n, n)), np.zeros((i_count, i_count))
    load, elastic, start = np.zeros(i_count), np.zeros(i_count), np.zeros(i_count)
    residual, step = np.zeros((i_count, 1)), np.zeros((i_count, 1))
    for b in listed:
        dof = shape.dof[b]
        for i in range(r):
            u[i] = displacement[dof[i]]
        for i in range(i_count):
            load[i] = shares[0] * shape.loads[0, b, i] + shares[1] * shape.loads[1, b, i]
        for i in range(i_count):
            total = 0.0
            for j in range(i_count):
                total += shape.flexibility[i, j] * load[j]
            for j in range(r):
                total -= shape.recovery[i, j] * u[j]
            elastic[i] = total
            u[r + i] = total + shape.inelastic[b, i]
        largest, yields = _internal_force(shape, zones, b, plastic, u, trial, internal)
        out = _interior_residual(load, internal, residual)
        for _ in range(OPTIONS.max_iterations):
            if not out > tolerance * largest:
                break
            slope = 0.0
            if yields:
                for i in range(n):
                    for j in range(n):
                        tangent[i, j] = shape.stiffness[i, j]
                _add_yielding(shape, zones, b, trial, tangent)
                for i in range(i_count):
                    step[i, 0] = residual[i, 0]
                    for j in range(i_count):
                        matrix[i, j] = tangent[r + i, r + j]
                _solve(matrix, step)
                slope = _dot(residual, step)
            if not slope > 0.0:
                for i in range(i_count):
                    step[i, 0] = 0.0
                    for j in range(i_count):
                        step[i, 0] += shape.flexibility[i, j] * residual[j, 0]
                slope = _dot(residual, step)
            # line search: to where the energy no longer decreases along the step
            share = 1.0
            for i in range(i_count):
                start[i] = u[r + i]
            for _ in range(OPTIONS.max_line_search_steps):
                for i in range(i_count):
                    u[r + i] = start[i] + share * step[i, 0]
                largest, yields = _internal_force(shape, zones, b, plastic, u, trial, internal)
                out = _interior_residual(load, internal, residual)
                now = _dot(residual, step)
                if now >= -OPTIONS.slope_ratio * slope:
                    break
                share *= min(max(slope / (slope - now), 0.1), 0.9)
        found = out <= 1e3 * tolerance * largest
        for i in range(i_count):
            displacement[dof[r + i]] = u[r + i]
            if found:
                shape.inelastic[b, i] = u[r + i] - elastic[i]
        for i in range(r):
            total = -internal[i]
            for j in range(r):
                total += shape.condensed[i, j] * u[j]
            for j in range(i_count):
                total += shape.recovery[j, i] * load[j]
            force[dof[i]] += total if found else math.nan


@kernel
def condensed_tangents(shape, zones, listed, first_entry, tangents, yields):
    """Condense the tangents of yielding blocks to their boundaries, from the trial stresses of the last residual.

    Parameters
    ----------
    shape, zones, listed
        As ``condensed_forces``.
    first_entry : array of int (b,)
        Where the entries of each block begin.
    tangents : array
        Schur complements (r, r) of all blocks, row by row (N/m); those of the listed blocks are updated.
    yields : array of bool (b,)
        Whether a zone of the block yields; updated. Blocks that have not yielded, and do not, stay as they are.
    """
    n, r = shape.stiffness.shape[0], shape.recovery.shape[1]
    tangent, matrix, across = np.zeros((n, n)), np.zeros((n - r, n - r)), np.zeros((n - r, r))
    for b in listed:
        for i in range(n):
            for j in range(n):
                tangent[i, j] = shape.stiffness[i, j]
        before, at = yields[b], first_entry[b]
        yields[b] = _add_yielding(shape, zones, b, zones.trial, tangent)
        if not yields[b]:
            if before:
                for i in range(r):
                    for j in range(r):
                        tangents[at + i * r + j] = shape.condensed[i, j]
            continue
        for i in range(n - r):
            for j in range(n - r):
                matrix[i, j] = tangent[r + i, r + j]
            for j in range(r):
                across[i, j] = tangent[r + i, j]
        _solve(matrix, across)
        for i in range(r):
            row = tangents[at + i * r : at + (i + 1) * r]
            for j in range(r):
                row[j] = tangent[i, j]
            for k in range(n - r):
                for j in range(r):
                    row[j] -= tangent[i, r + k] * across[k, j]


@kernel
def commit_plastic_strain(shape, zones, listed, displacement, plastic, state):
    """Commit the plastic strain of yielding blocks at an equilibrium; return the plastic work (J).

    Parameters
    ----------
    shape, zones, listed
        As ``condensed_forces``.
    displacement : array (size,)
        Of all degrees of freedom (m).
    plastic : array (z, 4)
        Plastic strain, brought up to date.
    state : array of int8 (z,)
        Filled: what yields now.
    """
    moduli, work, n = _as_tuple(shape.elasticity), 0.0, shape.dof.shape[1]
    u = np.empty(n)
    for b in listed:
        first, limits = shape.first_zone[b], _as_tuple(shape.strength[b])
        for i in range(n):
            u[i] = displacement[shape.dof[b, i]]
        for k in range(4 * shape.cells.shape[0]):
            z = first + k
            t = _trial_stress(zones.rows[z], shape.cells[k // 4], moduli, plastic[z], u)
            s_xx, s_yy, s_xy, s_zz, p_xx, p_yy, p_xy, p_zz, how = zone_return(t[0], t[1], t[2], t[3], moduli, limits)
            state[z] = how
            if how != 0:
                plastic[z, 0] += p_xx
                plastic[z, 1] += p_yy
                plastic[z, 2] += p_xy
                plastic[z, 3] += p_zz
                work += zones.volume[z] * (s_xx * p_xx + s_yy * p_yy + s_xy * p_xy + s_zz * p_zz)
    return work
