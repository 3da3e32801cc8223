"""Energy dissipated by a cracking section of the footing in a step, from given secant stiffnesses."""

from types import SimpleNamespace

import numpy as np
import pytest

from damagepred.solvers.quasi_static.energy_balance import EnergyBalance
from damagepred.solvers.system.footing_forces import section_energy

MODEL = SimpleNamespace(
    sections=SimpleNamespace(interface=np.array([0])),
    interfaces=SimpleNamespace(contact_area=np.full((1, 2), 0.045), contact_offset=np.array([[-0.15, 0.15]])),
    properties=SimpleNamespace(normal_stiffness=np.array([1e10]), shear_stiffness=np.array([4e9])),
)


def bent(turn: float, secant: float) -> np.ndarray:
    """Opening, shear, rotation, axial force, shear force and moment of a section in pure bending."""
    return np.array([[0.0, 0.0, turn, 0.0, 0.0, secant * turn]])


def dissipated(before: np.ndarray, now: np.ndarray) -> float:
    return float(section_energy(MODEL, now, before)[1][0])  # type: ignore[arg-type]


def test_cracking_dissipates_the_triangle_between_two_secants() -> None:
    assert dissipated(bent(1e-3, 5e6), bent(2e-3, 4e6)) == pytest.approx(0.5 * 1e-3 * 2e-3 * (5e6 - 4e6))


def test_an_uncracked_section_stores_the_energy_of_its_contacts() -> None:
    """k_n 1e10, k_s 4e9 Pa/m on 0.09 m2: tension, shear and bending, each force times displacement over two."""
    way = np.array([1e-5, 2e-5, 1e-4])
    force = way * 0.09 * np.array([1e10, 4e9, 1e10 * 0.15**2])
    beyond, taken = section_energy(MODEL, np.append(way, force)[None], None)  # type: ignore[arg-type]
    assert beyond == pytest.approx(0.0, abs=1e-9 * 0.5 * float(way @ force))
    assert taken[0] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(("secant", "other_face"), [(5e6, 5e6), (3e6, 5e6), (5e6, 3e6)])
def test_bending_the_other_way_dissipates_nothing(secant: float, other_face: float) -> None:
    """Unloaded to the origin and loaded from there, whichever face is cracked more."""
    assert dissipated(bent(1e-3, secant), bent(-2e-3, other_face)) == pytest.approx(0.0, abs=1e-12)


def test_cracks_do_not_heal_and_recovered_energy_is_an_error() -> None:
    """Under axial force the cracks of a face close as the moment changes sign: the secant stiffness grows under
    load."""
    taken = [dissipated(bent(1e-3, 5e6), bent(2e-3, 4e6)), dissipated(bent(2e-3, 4e6), bent(3e-3, 4.5e6))]
    assert taken[1] < 0.0
    balance = EnergyBalance(np.zeros(0))
    balance._section_work = balance._largest_section_work = np.zeros(1)
    for step in taken:
        balance.add_section_work(np.array([step]))
    assert balance._largest_section_work.sum() == pytest.approx(taken[0])
    assert balance.section_error == pytest.approx(-taken[1])
