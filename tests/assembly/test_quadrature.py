"""Points and weights of an interface's contacts."""

import numpy as np
import pytest

from damagepred import Assembly
from damagepred.assembly.interfaces import quadrature
from damagepred.scene import Joint, Solver

# Abramowitz and Stegun, table 25.6: abscissas on [-1, 1] and weights that sum to 2
LOBATTO = {
    2: ([-1, 1], [1, 1]),
    3: ([-1, 0, 1], [1 / 3, 4 / 3, 1 / 3]),
    4: ([-1, -(5**-0.5), 5**-0.5, 1], [1 / 6, 5 / 6, 5 / 6, 1 / 6]),
    5: ([-1, -((3 / 7) ** 0.5), 0, (3 / 7) ** 0.5, 1], [1 / 10, 49 / 90, 32 / 45, 49 / 90, 1 / 10]),
    6: (
        [-1, -0.765055323929, -0.285231516480, 0.285231516480, 0.765055323929, 1],
        [1 / 15, 0.378474956297, 0.554858377035, 0.554858377035, 0.378474956297, 1 / 15],
    ),
}


@pytest.mark.parametrize("count", LOBATTO)
def test_lobatto_as_tabulated(count: int):
    points, weights = quadrature("lobatto", count)
    np.testing.assert_allclose(2 * points, LOBATTO[count][0], atol=1e-11)
    np.testing.assert_allclose(2 * weights, LOBATTO[count][1], atol=1e-11)


def test_lobatto_of_one_is_refused():
    with pytest.raises(ValueError, match="at least 2"):
        quadrature("lobatto", 1)


def rotational_stiffness(contacts: int, rule: str, width: float, thickness: float) -> tuple[float, float]:
    """Of the joint between two stacked blocks, from the contacts the model really has; and its normal stiffness."""
    wall = Assembly(thickness=thickness, joint=Joint(normal_stiffness=5e9))
    wall.add_block([(0, 0), (width, 0), (width, 0.1), (0, 0.1)])
    wall.add_block([(0, 0.1), (width, 0.1), (width, 0.2), (0, 0.2)])
    solver = Solver(contacts_per_interface=contacts, quadrature=rule, lump_block_elasticity=False)
    model = wall.build(solver)
    face, k = model.interfaces, model.properties.normal_stiffness
    return (
        float((k[:, None] * face.contact_area * face.contact_offset**2).sum()),
        float((k[:, None] * face.contact_area).sum()),
    )


@pytest.mark.parametrize("contacts", [3, 4, 7])
def test_elastic_joint_is_exact_from_three_points_on(contacts: int):
    b, t = 0.24, 0.11
    rotational, normal = rotational_stiffness(contacts, "lobatto", b, t)
    assert rotational == pytest.approx(5e9 * t * b**3 / 12, rel=1e-13)
    assert normal == pytest.approx(5e9 * t * b, rel=1e-13)
