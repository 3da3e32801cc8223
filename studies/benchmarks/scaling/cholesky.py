"""Reference time: one banded Cholesky factorisation of the elastic stiffness of the same wall."""

from __future__ import annotations

import statistics
import time
from typing import Any

import numpy as np
from scipy import sparse
from scipy.linalg import lapack
from scipy.sparse.csgraph import reverse_cuthill_mckee

from damagepred.assembly import Model
from damagepred.one_thread import one_blas_thread
from damagepred.solvers.system.discrete_system import DiscreteSystem

ENOUGH, REPEATS = 3.0, 25
"""It is timed 25 times or for 3 s in all, whichever is shorter; the median counts."""
BAND_LIMIT = 4e9
"""Largest size of the band in bytes."""
PRECISE = 1e-6
"""Largest relative residual: a check of the factorisation."""


@one_blas_thread()
def factorise(model: Model) -> dict[str, Any]:
    """Return the time (s) of one factorisation, the unknowns in the narrower of two orders: courses, Cuthill-McKee."""
    free = DiscreteSystem.of(model).free_dofs
    stiffness = DiscreteSystem.of(model).elastic_stiffness[free][:, free].tocsr()
    by_course = np.repeat(np.lexsort((model.blocks.x, model.blocks.course)), 3) * 3 + np.tile(
        np.arange(3), model.n_blocks
    )
    orders = (by_course, reverse_cuthill_mckee(stiffness, symmetric_mode=True))
    width, order = min(((bandwidth(stiffness, order), order) for order in orders), key=lambda pair: pair[0])
    size = 8 * (width + 1) * len(free)
    known: dict[str, Any] = {"bandwidth": width, "band": size / 2**20}
    if size > BAND_LIMIT:
        return known
    ordered = stiffness[order][:, order].tocoo()
    lower = ordered.row >= ordered.col
    rows, columns = ordered.row[lower], ordered.col[lower]
    band = np.zeros((width + 1, len(free)), order="F")
    band[rows - columns, columns] = ordered.data[lower]
    times: list[float] = []
    while len(times) < REPEATS and sum(times) < ENOUGH:
        factor = band.copy(order="F")
        began = time.process_time()
        factor, info = lapack.dpbtrf(factor, lower=1, overwrite_ab=1)
        times.append(time.process_time() - began)
    load = model.supports.load[free][order]
    moved, _ = lapack.dpbtrs(factor, load, lower=1)
    off = float(np.abs(ordered.tocsr() @ moved - load).max() / np.abs(load).max())
    if info != 0 or not off < PRECISE:
        return known
    return known | {"cholesky": statistics.median(times)}


def bandwidth(matrix: sparse.csr_array, order: np.ndarray) -> int:
    """Return the bandwidth of a symmetric matrix under a permutation."""
    place = np.empty(len(order), dtype=np.int64)
    place[order] = np.arange(len(order))
    entries = matrix.tocoo()
    return int(np.abs(place[entries.row] - place[entries.col]).max())
