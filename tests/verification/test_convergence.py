"""Convergence of an opening joint with the number of its contacts, the only approximation of contacts."""

from dataclasses import replace

import numpy as np
import pytest

import damagepred
from damagepred.scene import Solver
from tests.verification.blocks import BRICK, Unit, on_plate
from tests.verification.manual import ClosedForm, Verify

pytestmark = pytest.mark.quick_cases()

RATE = ClosedForm(
    chapter="Convergence",
    title="Contacts of a joint that is partly open",
    formula="θ = 2 N / (k_n t a²),  a = 3 (b/2 - e):   error ~ (number of contacts)^-2",
    source="Derived: stress is linear in the pressed part and has a kink at its end; a composite rule with contacts at "
    "a distance s is wrong by O(s²) wherever the kink lies between two of them.",
    note="Root of the mean square relative error in θ over 12 eccentricities from 0.18 b to 0.4 b, the joint cut into "
    "pieces of 3 Lobatto contacts (Simpson) or of 4 midpoints. Order: slope of log(error) over log(contacts) from 2 "
    "to 32 pieces; exact is the error 0 and the order 2, allowed an error of 6 over the square of the number of "
    "contacts. The row of 3 contacts tells what an interface with a bond costs once much of it is open, that of 4 x 3 "
    "what one without a bond costs, which is cut into 4 by default.",
)
SHARES = np.linspace(0.18, 0.40, 12)


def error(solver: Solver, unit: Unit, rule: str, contacts: int, pieces: int) -> float:
    force = 1e5 * unit.area
    settings = replace(solver, quadrature=rule, contacts_per_interface=contacts, no_tension_subdivisions=1)
    errors = []
    for share in SHARES:
        assembly, block = on_plate(unit, unit.joint(), (0.0, 0.0), pieces)
        assembly.load(block, y=-force, at=(share * unit.b, unit.h))
        ds = damagepred.solve(assembly, solver=settings, increments=1)
        exact = 2 * force / (unit.k_n * unit.t * (3 * unit.b * (0.5 - share)) ** 2)
        errors.append(-ds["block_rotation"].values[-1, block] / exact - 1)
    return float(np.sqrt(np.mean(np.square(errors))))


@pytest.mark.parametrize(("rule", "contacts", "fewest"), [("lobatto", 3, 1), ("midpoint", 4, 2)])
def test_the_open_joint_converges(verify: Verify, solver: Solver, rule: str, contacts: int, fewest: int) -> None:
    """A single piece of four midpoints would topple: its outermost contact is at 0.375 b."""
    found = {}
    for pieces in (fewest, 2, 4, 8, 16, 32):
        if pieces in found:
            continue
        found[pieces] = error(solver, BRICK, rule, contacts, pieces)
        case = f"{pieces} x {contacts} contacts, {rule}: {BRICK}"
        verify(RATE, case, solver.method, "error of θ", found[pieces], 0.0, 6 / (pieces * contacts) ** 2, scale=1.0)
    case = f"{contacts} contacts a piece, {rule}: {BRICK}"
    verify(RATE, case, solver.method, "order", np.log(found[2] / found[32]) / np.log(16), 2.0, 0.1)
