"""Values that vary from joint to joint: correlated along a course, independent between courses."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from damagepred.arrays import FloatArray, Int8Array, IntArray
from damagepred.errors import InputError
from damagepred.uq.correlation import lower_factor


def course_autoregression(innovation: FloatArray, sequence: IntArray, correlation: ArrayLike) -> FloatArray:
    """Return standard normals with a given correlation between neighbours in a sequence."""
    correlation = np.asarray(correlation)[..., None]
    normals = np.sqrt(1.0 - correlation**2) * innovation
    starts = np.flatnonzero(np.diff(sequence, prepend=sequence[0] - 1))
    lengths = np.diff(np.append(starts, len(sequence)))
    # the first joint has the full variance, not that of an innovation
    normals[..., starts] = innovation[..., starts]
    for step in range(1, lengths.max()):  # all sequences at once, one joint after the other
        here = starts[lengths > step] + step
        normals[..., here] += correlation * normals[..., here - 1]
    return normals


def innovation_factor(factor: FloatArray, lags: Mapping[str, float]) -> FloatArray:
    """Cholesky factor (k, k) of the correlation of the innovations of fields, from the factor in one joint and lags.

    Fields with correlations a, b from joint to joint and r in one joint need innovations correlated by
    r (1 - a b) / sqrt((1 - a^2) (1 - b^2)), which is r where a = b.
    """
    a = np.asarray(list(lags.values()), dtype=np.float64)
    scale = np.sqrt(1.0 - a**2)
    wanted = (factor @ factor.T) * (1.0 - np.outer(a, a)) / np.outer(scale, scale)
    try:
        return lower_factor(wanted)
    except np.linalg.LinAlgError:
        within = np.abs(wanted - np.eye(len(a)))
        i, j = sorted(np.unravel_index(within.argmax(), wanted.shape))
        raise InputError(
            f'[correlation] "{list(lags)[i]}" with "{list(lags)[j]}": the normals behind these fields are correlated '
            f"by {a[i]:.4g} and {a[j]:.4g} from joint to joint (from course_correlation and the distribution), which "
            "is too different for a correlation this strong in one joint; make the fields more alike or it weaker."
        ) from None


def course_sequences(course: IntArray, kind: Int8Array, x: FloatArray, apart: float = np.inf) -> IntArray:
    """Give numbers to the runs of joints of one kind in one course."""
    change = (np.diff(course, prepend=course[:1]) != 0) | (np.diff(kind, prepend=kind[:1]) != 0)
    change |= np.abs(np.diff(x, prepend=x[:1])) > apart
    return np.cumsum(change).astype(np.int64)
