"""Elastic joints between rigid blocks, in both solvers."""

import numpy as np
import pytest

import damagepred
from damagepred import Assembly
from damagepred.assembly.assembly import rectangle
from damagepred.scene import BlockMaterial, Joint, Solver
from tests.verification.manual import ClosedForm, Verify, size, stiffness

CHAPTER = "Elastic joints"
STACK = ClosedForm(
    chapter=CHAPTER,
    title="Stack of blocks under its own weight",
    formula="u_i = W i (2n - i + 1) / (2 k_n b t)        block i = 1 ... n from the bottom",
    source="Derived: the joint under block j carries n - j + 1 blocks; sum of the closings of joints 1 to i.",
)


@pytest.mark.parametrize(
    ("n", "k_n", "width", "height", "thickness", "density"),
    [(3, 82e9, 0.24, 0.075, 0.11, 2000.0), (10, 5e9, 0.5, 0.1, 0.2, 1600.0), (25, 1e8, 1.0, 0.4, 0.3, 2600.0)],
)
def test_a_stack_settles_under_its_own_weight(
    verify: Verify, solver: Solver, n: int, k_n: float, width: float, height: float, thickness: float, density: float
) -> None:
    joint = Joint(normal_stiffness=k_n, shear_stiffness=0.4 * k_n)
    assembly = Assembly(thickness=thickness, joint=joint, block=BlockMaterial(density=density))
    for i in range(n):
        assembly.add_block(rectangle(0.0, i * height, width, (i + 1) * height), course=i)
    assembly.rest_on_ground([0])
    ds = damagepred.solve(assembly, solver=solver, increments=1)
    w, i = density * width * height * thickness * 9.81, np.arange(1, n + 1)
    verify(
        STACK,
        case=f"n = {n}, {size(width, height, thickness)}, {density:g} kg/m³, {stiffness(k_n)}",
        solver=solver.method,
        quantity="settlement",
        unit="m",
        computed=-ds["block_displacement_y"].values[-1],
        exact=w * i * (2 * n - i + 1) / (2 * k_n * width * thickness),
        tolerance=1e-6,
    )
