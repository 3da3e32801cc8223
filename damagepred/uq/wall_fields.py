"""Random fields of joint values with a correlation that decreases with distance, along courses or over the wall.

The correlation matrix of all joints of one kind is factorised once a geometry; a sample then costs one product with a
triangular matrix for each field and kind.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import scipy
from scipy import linalg

from damagepred.arrays import FloatArray, Int8Array, IntArray
from damagepred.errors import InputError
from damagepred.runtime.one_thread import one_blas_thread
from damagepred.uq.correlation import NatafCurve, lower_factor, varying
from damagepred.uq.marginals import Marginal
from damagepred.uq.variable import JointField


class JointPlaces(NamedTuple):
    """Where the joints of a wall are; j of them.

    Attributes
    ----------
    sequence : array of int (j,)
        Joints with the same number, next to each other in the array, are neighbours in a course.
    kind : array of int (j,)
        Bed, perpend or dpc.
    x, y : array (j,)
        Middle of the joint (m).
    unit : float
        Distance from one unit to the next (m).
    """

    sequence: IntArray
    kind: Int8Array
    x: FloatArray
    y: FloatArray
    unit: float

    def digest(self) -> str:
        """Return a short name for these places."""
        found = hashlib.sha256(repr(self.unit).encode())
        for values in (self.sequence, self.kind, self.x, self.y):
            found.update(np.ascontiguousarray(values).tobytes())
        return found.hexdigest()


class _OneKind(NamedTuple):
    """Joints of one kind, the factors of the independent fields on them, and how these make up the fields (k, k)."""

    joints: IntArray
    triangles: list[FloatArray]
    mixing: FloatArray


class WallFields:
    """Fields of one study, ready to be drawn on any wall.

    Parameters
    ----------
    names : sequence of str
        Places of the fields, k of them.
    fields : mapping of str to JointField
        How they are correlated from joint to joint.
    marginals : mapping of str to Marginal
        Their distributions.
    factor : array (k, k)
        Cholesky factor of the correlation of the fields' normals in one joint.
    correlation_tolerance : float
        Largest change of a correlation along the wall, of the normals, that is accepted to make a matrix positive
        definite. Two fields with the same correlation length need it where their distributions are of different kinds:
        the correlation of a table's normals decreases more slowly at short distances.

    Notes
    -----
    From the roughest to the smoothest, field k is the sum over j <= k of L[k, j] times independent fields w_j, with L
    the Cholesky factor of their correlation in one joint. The correlation of w_k along the wall is such that each field
    keeps its own (linear model of coregionalisation).
    """

    def __init__(
        self,
        names: Sequence[str],
        fields: Mapping[str, JointField],
        marginals: Mapping[str, Marginal],
        factor: FloatArray,
        correlation_tolerance: float = 0.02,
    ) -> None:
        self._tolerance = correlation_tolerance
        self._names = tuple(names)
        self._fields = [fields[name] for name in names]
        self._normal = [_to_normals(name, marginals[name]) for name in names]
        self._correlation: FloatArray = factor @ factor.T
        self._made: tuple[str, list[_OneKind]] = ("", [])

    @one_blas_thread()
    def draw(self, independent: FloatArray, places: JointPlaces) -> FloatArray:
        """Return correlated standard normals."""
        found = np.empty_like(independent)
        for kind in self._kinds(places):
            for k, triangle in enumerate(kind.triangles):
                found[k, kind.joints] = linalg.blas.dtrmv(triangle, independent[k, kind.joints], lower=1)
            found[:, kind.joints] = kind.mixing @ found[:, kind.joints]
        return found

    def _kinds(self, places: JointPlaces) -> list[_OneKind]:
        """Return the factors for these places, kind by kind; those of the last places are cached."""
        name = places.digest()
        if self._made[0] != name:
            kinds = [np.flatnonzero(places.kind == kind) for kind in np.unique(places.kind)]
            self._made = name, [self._one_kind(places, here) for here in kinds]
        return self._made[1]

    def _one_kind(self, places: JointPlaces, here: IntArray) -> _OneKind:
        whole = [normal(stated_correlation(f, places, here)) for f, normal in zip(self._fields, self._normal)]
        order = np.argsort([matrix.sum() for matrix in whole], kind="stable")
        factor = lower_factor(self._correlation[np.ix_(order, order)])
        own = varying(factor)
        independent: list[FloatArray] = []
        triangles = []
        for k, field in enumerate(order):
            matrix = whole[field]
            np.fill_diagonal(matrix, 1.0)
            for part, earlier in zip(factor[k, :k] ** 2, independent):
                matrix -= part * earlier
            try:
                if own[k]:
                    matrix /= factor[k, k] ** 2
                    triangles.append(_cholesky(matrix, self._tolerance / factor[k, k] ** 2))
                elif np.abs(matrix).max() <= self._tolerance:  # this field follows from the earlier ones
                    triangles.append(np.zeros_like(matrix, order="F"))
                else:
                    raise linalg.LinAlgError
            except linalg.LinAlgError:
                raise InputError(_impossible(self._names[field], bool(factor[k, :k].any()))) from None
            independent.append(matrix)
        mixing = np.empty_like(factor)
        mixing[order] = factor
        return _OneKind(here, triangles, mixing)


def _impossible(name: str, correlated: bool) -> str:
    if correlated:
        return (
            f'[correlation] "{name}": its field and another change so differently along the wall, by their correlation '
            "lengths or their distributions, that they cannot be so strongly correlated; make the former more alike, "
            "or the correlation weaker."
        )
    return (
        f'[variables."{name}"] field: no values with this distribution can be correlated like that; give the field '
        "a nugget, or a shorter correlation_length."
    )


def stated_correlation(field: JointField, places: JointPlaces, here: IntArray) -> FloatArray:
    """Return the correlation that a field states between joints of one kind: array (n, n), 1 on the diagonal."""
    sequence = places.sequence[here]
    if field.by_course:
        same = sequence[:, None] == sequence
        return np.where(same, field.course_correlation ** np.abs(here[:, None] - here), 0.0)
    length = field.correlation_length
    if length is None:
        length = -places.unit / np.log(field.course_correlation) if field.course_correlation > 0 else 1e-9 * places.unit
    x, y = places.x[here] / length, places.y[here] / (field.vertical_length or length)
    found = (1.0 - field.nugget) * np.exp(-np.hypot(x[:, None] - x, y[:, None] - y))
    if field.over == "course":
        found[sequence[:, None] != sequence] = 0.0
    np.fill_diagonal(found, 1.0)
    return found


def _to_normals(name: str, marginal: Marginal) -> _ToNormals:
    try:
        return _ToNormals(marginal)
    except ValueError as error:
        raise InputError(f'[variables."{name}"] field: {error}.') from None


class _ToNormals:
    """Turns correlations of a variable with itself elsewhere into those of the normals behind it (Nataf)."""

    def __init__(self, marginal: Marginal) -> None:
        rho = np.sin(0.5 * np.pi * np.linspace(0.0, 1.0, 513))  # dense near 1, where steps make the curve steep
        reached = NatafCurve(marginal, marginal)(rho)
        reached[0], reached[-1] = 0.0, 1.0
        keep = np.append(True, np.diff(np.maximum.accumulate(reached)) > 0)
        self._curve = scipy.interpolate.PchipInterpolator(reached[keep], rho[keep])

    def __call__(self, correlation: FloatArray) -> FloatArray:
        return np.asarray(self._curve(correlation))


def _cholesky(matrix: FloatArray, tolerance: float) -> FloatArray:
    """Return the lower factor of a correlation matrix; negative eigenvalues are raised if that changes it little."""
    try:
        return np.asfortranarray(linalg.cholesky(matrix, lower=True))
    except linalg.LinAlgError:
        value, vector = linalg.eigh(matrix)
        definite = (vector * np.maximum(value, 1e-9)) @ vector.T
        scale = 1.0 / np.sqrt(np.diag(definite))
        definite *= np.outer(scale, scale)
        if np.abs(definite - matrix).max() > tolerance:
            raise
        return np.asfortranarray(linalg.cholesky(definite, lower=True))
