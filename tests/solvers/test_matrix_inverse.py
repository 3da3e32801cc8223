"""Inverse of a front's stiffness, against NumPy."""

import numpy as np
import pytest

from damagepred.kernels.jit import kernel
from damagepred.kernels.linear import dense
from damagepred.solvers.quasi_static.linear_system import INVERSION_PANEL, SINGULAR_PIVOT_RATIO

INVERT = kernel(dense.invert.function)


def invert(matrix: np.ndarray, symmetric: bool, inverse: np.ndarray) -> float:
    """Invert as the solver does: column by column in flat arrays, a corner of the front."""
    size = len(matrix)
    front, flat = np.pad(matrix, (0, 3), constant_values=np.nan), np.empty(matrix.size)
    workspace = dense.dense_workspace(size, INVERSION_PANEL, SINGULAR_PIVOT_RATIO)
    ratio = INVERT(workspace, size, len(front), front.T.ravel(), symmetric, flat)
    inverse[:] = flat.reshape(size, size).T
    return float(ratio)


def made(size: int, kind: str) -> np.ndarray:
    random = np.random.default_rng(size)
    matrix = random.normal(size=(size, size))
    if kind == "skew":
        return matrix + size * np.eye(size)
    values = random.uniform(1.0, 100.0, size)
    if kind == "not positive":
        values[::3] *= -1.0
    turned, _ = np.linalg.qr(matrix)
    whole = (turned * values) @ turned.T
    return 0.5 * (whole + whole.T)


@pytest.mark.quick_cases
@pytest.mark.parametrize("kind", ["positive", "not positive", "skew"])
@pytest.mark.parametrize("size", [1, 3, 31, 33, 64, 97, 200])
def test_inverse(size: int, kind: str) -> None:
    matrix = made(size, kind)
    inverse = np.empty_like(matrix)
    smallest = invert(matrix.copy(), kind != "skew", inverse)
    np.testing.assert_allclose(matrix @ inverse, np.eye(size), atol=1e-9)
    assert 0.0 < smallest <= 1.0
    if kind == "positive":
        assert np.array_equal(inverse, inverse.T)


@pytest.mark.parametrize("corner", [0.0, 1e-14])
def test_blocks_without_inverse_of_a_matrix_that_has_one(corner: float) -> None:
    size = INVERSION_PANEL
    unit = np.eye(size)
    matrix = np.block([[corner * unit, unit], [2.0 * unit, made(size, "skew")]])
    inverse = np.empty_like(matrix)
    assert 0.01 < invert(matrix, False, inverse) < 1.0
    np.testing.assert_allclose(matrix @ inverse, np.eye(2 * size), atol=1e-13)


def test_rounding_in_the_other_half_does_not_count() -> None:
    matrix = made(50, "positive")
    inverse, rounded = np.empty_like(matrix), matrix.copy()
    rounded[np.triu_indices(50, 1)] *= 1.0 + 1e-14
    invert(rounded, True, inverse)
    np.testing.assert_allclose(matrix @ inverse, np.eye(50), atol=1e-11)


@pytest.mark.parametrize("symmetric", [True, False])
def test_a_singular_matrix_is_reported(symmetric: bool) -> None:
    inverse = np.empty((3, 3))
    assert invert(np.diag([1.0, 0.0, 2.0]), symmetric, inverse) == 0.0
    assert np.isnan(inverse).all()
