"""Random fields of joint values: correlated along a course, or with a correlation that decreases with distance.

By distance, the correlation matrix of all joints of one kind is factorised once per geometry.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import scipy
from numpy.typing import ArrayLike
from scipy import linalg

from damagepred.arrays import FloatArray, Int8Array, IntArray
from damagepred.errors import InputError
from damagepred.runtime.one_thread import one_blas_thread
from damagepred.uq.correlation import NatafCurve, gaussian_correlation, lower_factor, varying
from damagepred.uq.marginals import Marginal
from damagepred.uq.variable import JointField


def course_autoregression(innovation: FloatArray, sequence: IntArray, correlation: ArrayLike) -> FloatArray:
    """Return standard normals with a given correlation between neighbours in a sequence."""
    correlation = np.asarray(correlation)[..., None]
    normals = np.sqrt(1.0 - correlation**2) * innovation
    starts = np.flatnonzero(np.diff(sequence, prepend=sequence[0] - 1))
    lengths = np.diff(np.append(starts, len(sequence)))
    # the first joint has the full variance
    normals[..., starts] = innovation[..., starts]
    for step in range(1, lengths.max()):  # all sequences at once, one joint after the other
        chain = starts[lengths > step] + step
        normals[..., chain] += correlation * normals[..., chain - 1]
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


class JointPlaces(NamedTuple):
    """Where the joints of a wall are; j of them."""

    sequence: IntArray  # (j,): joints with the same number, next to each other in the array, are neighbours in a course
    kind: Int8Array | IntArray  # (j,): bed, perpend or dpc; of a house 100 more from wall to wall
    # (j,): middle of the joint (m)
    x: FloatArray
    y: FloatArray
    unit: float  # distance from one unit to the next (m)

    def digest(self) -> str:
        """Short name for these places."""
        digest_ = hashlib.sha256(repr(self.unit).encode())
        for values in (self.sequence, self.kind, self.x, self.y):
            digest_.update(np.ascontiguousarray(values).tobytes())
        return digest_.hexdigest()


_TOLERANCE = 0.02  # change of the correlations of a field (1) by which it may be made positive definite


class CourseFields:
    """Fields of one study in which each joint depends only on the one before it in its course."""

    def __init__(self, fields: Mapping[str, JointField], marginals: Mapping[str, Marginal], factor: FloatArray) -> None:
        self._lags: dict[str, float] = {}  # correlation of the underlying normals of neighbours
        for name, field in fields.items():
            try:
                self._lags[name] = gaussian_correlation(marginals[name], marginals[name], field.course_correlation)
            except ValueError as error:
                raise InputError(f'[variables."{name}"] field: {error}.') from None
        self._factor, self._innovation_factor = factor, innovation_factor(factor, self._lags)

    def draw(self, independent: FloatArray, places: JointPlaces) -> FloatArray:
        """Correlated standard normals."""
        first = np.diff(places.sequence, prepend=places.sequence[0] - 1) != 0
        innovation = np.where(first, self._factor @ independent, self._innovation_factor @ independent)
        return course_autoregression(innovation, places.sequence, list(self._lags.values()))


class _OneKind(NamedTuple):
    """Joints of one kind, the factors of the independent fields on them, and how these make up the fields (k, k)."""

    joints: IntArray
    triangles: list[FloatArray]
    mixing: FloatArray


class WallFields:
    """Fields of one study, ready to be drawn on any wall.

    From the roughest to the smoothest, field k is the sum over j <= k of L[k, j] times independent fields w_j, with L
    the Cholesky factor of their correlation in one joint. The correlation of w_k along the wall is such that each field
    keeps its own (linear model of coregionalisation).
    """

    def __init__(self, fields: Mapping[str, JointField], marginals: Mapping[str, Marginal], factor: FloatArray) -> None:
        self._names, self._fields = tuple(fields), list(fields.values())
        self._normal = [_to_normals(name, marginals[name]) for name in fields]
        self._correlation: FloatArray = factor @ factor.T
        self._made: tuple[str, list[_OneKind]] = ("", [])

    @one_blas_thread()
    def draw(self, independent: FloatArray, places: JointPlaces) -> FloatArray:
        """Correlated standard normals."""
        values = np.empty_like(independent)
        for kind in self._kinds(places):
            for k, triangle in enumerate(kind.triangles):
                values[k, kind.joints] = linalg.blas.dtrmv(triangle, independent[k, kind.joints], lower=1)
            values[:, kind.joints] = kind.mixing @ values[:, kind.joints]
        return values

    def _kinds(self, places: JointPlaces) -> list[_OneKind]:
        """Factors for these places, kind by kind; the last ones are cached."""
        name = places.digest()
        if self._made[0] != name:
            kinds = [np.flatnonzero(places.kind == kind) for kind in np.unique(places.kind)]
            self._made = name, [self._one_kind(places, of_kind) for of_kind in kinds]
        return self._made[1]

    def _one_kind(self, places: JointPlaces, of_kind: IntArray) -> _OneKind:
        whole = [normal(stated_correlation(f, places, of_kind)) for f, normal in zip(self._fields, self._normal)]
        order = np.argsort([matrix.sum() for matrix in whole], kind="stable")
        factor = lower_factor(self._correlation[np.ix_(order, order)])
        nugget_ = varying(factor)
        independent: list[FloatArray] = []
        triangles = []
        for k, field in enumerate(order):
            matrix = whole[field]
            np.fill_diagonal(matrix, 1.0)
            for block, earlier in zip(factor[k, :k] ** 2, independent):
                matrix -= block * earlier
            try:
                if nugget_[k]:
                    matrix /= factor[k, k] ** 2
                    triangles.append(_cholesky(matrix, _TOLERANCE / factor[k, k] ** 2))
                elif np.abs(matrix).max() <= _TOLERANCE:  # this field follows from the earlier ones
                    triangles.append(np.zeros_like(matrix, order="F"))
                else:
                    raise linalg.LinAlgError
            except linalg.LinAlgError:
                raise InputError(_impossible(self._names[field], bool(factor[k, :k].any()))) from None
            independent.append(matrix)
        mixing = np.empty_like(factor)
        mixing[order] = factor
        return _OneKind(of_kind, triangles, mixing)


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
    """Correlation that a field states between joints of one kind: array (n, n), 1 on the diagonal."""
    sequence = places.sequence[here]
    if field.by_course:
        same = sequence[:, None] == sequence
        return np.where(same, field.course_correlation ** np.abs(here[:, None] - here), 0.0)
    length = field.correlation_length
    if length is None:
        length = -places.unit / np.log(field.course_correlation) if field.course_correlation > 0 else 1e-9 * places.unit
    x, y = places.x[here] / length, places.y[here] / (field.vertical_length or length)
    correlation = (1.0 - field.nugget) * np.exp(-np.hypot(x[:, None] - x, y[:, None] - y))
    if field.over == "course":
        correlation[sequence[:, None] != sequence] = 0.0
    np.fill_diagonal(correlation, 1.0)
    return correlation


def _to_normals(name: str, marginal: Marginal) -> Any:
    """Correlation of the normals behind a variable by its correlation with itself elsewhere (Nataf), interpolated."""
    rho = np.sin(0.5 * np.pi * np.linspace(0.0, 1.0, 513))  # dense near 1, where steps make the curve steep
    try:
        reached = NatafCurve(marginal, marginal)(rho)
    except ValueError as error:
        raise InputError(f'[variables."{name}"] field: {error}.') from None
    reached[0], reached[-1] = 0.0, 1.0
    keep = np.append(True, np.diff(np.maximum.accumulate(reached)) > 0)
    return scipy.interpolate.PchipInterpolator(reached[keep], rho[keep])


def _cholesky(matrix: FloatArray, tolerance: float) -> FloatArray:
    """Lower factor of a correlation matrix; negative eigenvalues are raised if that changes it little."""
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
