"""What a cracking section of the footing dissipates in a step, from secant stiffnesses given by hand."""

from types import SimpleNamespace

import numpy as np
import pytest

from damagepred.solvers.footing import section_energy

MODEL = SimpleNamespace(
    sections=SimpleNamespace(interface=np.array([0])),
    interfaces=SimpleNamespace(contact_area=np.full((1, 2), 0.045), contact_offset=np.array([[-0.15, 0.15]])),
    properties=SimpleNamespace(normal_stiffness=np.array([1e10]), shear_stiffness=np.array([4e9])),
)


def bent(turn: float, secant: float) -> np.ndarray:
    """Opening, shear, turn, axial force, shear force and moment of a section that is bent alone."""
    return np.array([[0.0, 0.0, turn, 0.0, 0.0, secant * turn]])


def dissipated(before: np.ndarray, now: np.ndarray) -> float:
    return section_energy(MODEL, now, before)[1]  # type: ignore[arg-type]


def test_cracking_dissipates_the_triangle_between_two_secants() -> None:
    assert dissipated(bent(1e-3, 5e6), bent(2e-3, 4e6)) == pytest.approx(0.5 * 1e-3 * 2e-3 * (5e6 - 4e6))


@pytest.mark.parametrize(("secant", "other_face"), [(5e6, 5e6), (3e6, 5e6), (5e6, 3e6)])
def test_bending_the_other_way_dissipates_nothing(secant: float, other_face: float) -> None:
    """Unloaded to where it began and loaded from there, whichever face is cracked more."""
    assert dissipated(bent(1e-3, secant), bent(-2e-3, other_face)) == pytest.approx(0.0, abs=1e-12)
