"""Values that vary from joint to joint: correlated along a course, independent between courses."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from damagepred.arrays import FloatArray, Int8Array, IntArray
from damagepred.errors import InputError


def course_autoregression(innovation: FloatArray, sequence: IntArray, correlation: ArrayLike) -> FloatArray:
    """Return standard normals with a given correlation between neighbours in a sequence.

    Parameters
    ----------
    innovation : array (joints,) or (fields, joints)
        Standard normals, those of a field independent of each other.
    sequence : array of int (joints,)
        Joints with the same number, next to each other in the array, are neighbours in a course.
    correlation : float or array (fields,)
        Of the normals, from one joint to the next (first-order autoregression: k joints apart, its k-th power).

    Returns
    -------
    array of the shape of ``innovation``
    """
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


def innovation_factor(factor: FloatArray, lags: Sequence[float]) -> FloatArray:
    """Return the Cholesky factor of the correlation that the innovations of several fields need.

    With it the values of one joint are correlated as wanted everywhere along a course, and each field keeps its own
    correlation along it: fields with lags a, b and correlation r need innovations correlated by
    r (1 - a b) / sqrt((1 - a^2) (1 - b^2)), which is r where the lags are the same.

    Parameters
    ----------
    factor : array (k, k)
        Cholesky factor of the correlation of the fields' normals in one joint.
    lags : sequence of float
        Correlation of each field's normals from one joint to the next.

    Raises
    ------
    InputError
        If fields so differently smooth cannot be so strongly correlated.
    """
    a = np.asarray(lags, dtype=np.float64)
    scale = np.sqrt(1.0 - a**2)
    wanted = (factor @ factor.T) * (1.0 - np.outer(a, a)) / np.outer(scale, scale)
    try:
        return np.asarray(np.linalg.cholesky(wanted), dtype=np.float64)
    except np.linalg.LinAlgError:
        raise InputError(
            "[correlation]: fields with such different course_correlation cannot be so strongly correlated; make the "
            "former more alike or the correlation weaker."
        ) from None


def course_sequences(course: IntArray, kind: Int8Array, x: FloatArray, apart: float = np.inf) -> IntArray:
    """Give numbers to the runs of joints of one kind in one course.

    Parameters
    ----------
    course, kind, x : array (joints,)
        Of each joint, in the order in which they stand in the wall; x along it (m).
    apart : float
        Joints further apart than this (m) are no neighbours: an opening lies between them.
    """
    change = (np.diff(course, prepend=course[:1]) != 0) | (np.diff(kind, prepend=kind[:1]) != 0)
    change |= np.abs(np.diff(x, prepend=x[:1])) > apart
    return np.cumsum(change).astype(np.int64)


def lag_correlation(marginal: Any, correlation: float) -> float:
    """Return the correlation of normals that gives neighbours of this marginal the stated correlation.

    Parameters
    ----------
    marginal : frozen distribution
        Of the values.
    correlation : float
        Of the values of neighbours, as stated.
    """
    from damagepred.uq.correlation import gaussian_correlation

    return gaussian_correlation(marginal, marginal, correlation)
