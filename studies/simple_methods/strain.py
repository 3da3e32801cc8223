"""Strain of a wall of bricks, from the displacements of the bricks around each of them."""

from __future__ import annotations

import numpy as np
import xarray as xr
from scipy import sparse
from scipy.spatial import cKDTree

from damagepred.arrays import FloatArray


def largest_tensile_strain(ds: xr.Dataset, gauge: float, above: float = -np.inf) -> FloatArray:
    """Return the largest principal strain in a solved wall at each increment (1), tension positive.

    A linear field is fitted to the displacement of the bricks whose centres lie within ``gauge`` of each brick's, which
    averages over joints and bricks, and over stress concentrations at corners.
    """
    inside = np.flatnonzero(ds["block_y"].values > above)
    place = np.column_stack((ds["block_x"].values[inside], ds["block_y"].values[inside]))
    along_x, along_y = gradients(place, gauge)
    u, v = (ds[f"block_displacement_{axis}"].values[:, inside].T for axis in "xy")
    e_x, e_y, half = along_x @ u, along_y @ v, (along_y @ u + along_x @ v) / 2
    principal = (e_x + e_y) / 2 + np.hypot((e_x - e_y) / 2, half)
    return np.asarray(principal.max(axis=0))


def gradients(place: FloatArray, gauge: float) -> tuple[sparse.csr_array, sparse.csr_array]:
    """Return the matrices (n, n) from values at the bricks to the gradient of the field around each."""
    rows, columns, slopes = [], [], []
    for number, near in enumerate(cKDTree(place).query_ball_point(place, gauge)):
        offset = place[near] - place[number]
        fit = np.column_stack((np.ones(len(near)), offset))
        if np.linalg.matrix_rank(fit, tol=1e-6 * gauge) < 3:
            continue  # bricks in a line determine no strain
        slopes.append(np.linalg.pinv(fit)[1:])
        rows.append(np.full(len(near), number))
        columns.append(near)
    where = (np.concatenate(rows), np.concatenate(columns))
    values = np.concatenate(slopes, axis=1)
    shape = (len(place), len(place))
    return sparse.csr_array((values[0], where), shape=shape), sparse.csr_array((values[1], where), shape=shape)
