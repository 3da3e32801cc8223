"""Points in the unit cube, one row per sample, which depends on the seed and its number (not in a Latin hypercube)."""

from __future__ import annotations

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.errors import InputError
from damagepred.uq.random_streams import Stream, generator


def unit_points(sampler: str, dimensions: int, samples: int, seed: int, replicates: int = 1) -> FloatArray:
    """Points in the open unit cube."""
    if sampler not in ("sobol", "lhs", "random"):
        raise InputError(f"study.sampler = {sampler!r}: must be 'sobol', 'lhs' or 'random'.")
    if dimensions == 0:
        return np.empty((samples, 0))
    if sampler == "random":
        return np.array([generator(seed, Stream.WALL, i).random(dimensions) for i in range(samples)])
    if sampler == "lhs":
        from scipy.stats import qmc

        cube = qmc.LatinHypercube(dimensions, rng=generator(seed, Stream.SCRAMBLE, 0))
        return np.asarray(cube.random(samples))
    points = np.empty((samples, dimensions))
    for scramble in range(min(replicates, samples)):
        turn = points[scramble::replicates]
        turn[:] = _sobol(dimensions, len(turn), generator(seed, Stream.SCRAMBLE, scramble))
    return np.clip(points, 2.0**-53, 1.0 - 2.0**-53)


def _sobol(dimensions: int, samples: int, scramble: np.random.Generator) -> FloatArray:
    from scipy.stats import qmc

    # the sequence is made for powers of two; the first points stay the same
    whole = 1 << max(samples - 1, 1).bit_length()
    return np.asarray(qmc.Sobol(dimensions, scramble=True, rng=scramble).random(whole)[:samples])
