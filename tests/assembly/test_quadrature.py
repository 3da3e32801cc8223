"""Points and weights of an interface's contacts."""

import numpy as np
import pytest

from damagepred.assembly import Assembly, wall_model
from damagepred.assembly.quadrature import quadrature
from damagepred.enumerations import ContactKind
from damagepred.scene import ControlJoint, Dpc, Joint, Movement, Scene, Solver, Wall

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


def test_nine_midpoints_are_an_eightieth_off():
    b, t = 0.24, 0.11
    rotational, _ = rotational_stiffness(9, "midpoint", b, t)
    assert 1 - rotational / (5e9 * t * b**3 / 12) == pytest.approx(1 / 81, rel=1e-9)


DRY = Joint(tensile_strength=0.0, cohesion=0.0)
SMALL = Wall(length=1.2, height=0.45)


def kinds_cut(scene: Scene) -> set[ContactKind]:
    """Return the kinds of interface that no longer are the whole common edge of two blocks."""
    face = wall_model(scene).interfaces
    edge = np.stack((face.block_a, face.block_b, face.kind), axis=1)
    _, number, count = np.unique(edge, axis=0, return_inverse=True, return_counts=True)
    return {ContactKind(k) for k in face.kind[(count > 1)[number.ravel()]]}


@pytest.mark.parametrize(
    ("parts", "expected"),
    {
        "bonded": ({}, set()),
        "dpc": ({"dpc": Dpc()}, {ContactKind.DPC}),
        "dry": ({"joint": DRY}, {ContactKind.BED_JOINT, ContactKind.HEAD_JOINT, ContactKind.FOOTING_INTERFACE}),
        "no strength at the apex": (
            {"joint": Joint(cohesion=0.0)},
            {ContactKind.BED_JOINT, ContactKind.HEAD_JOINT, ContactKind.FOOTING_INTERFACE},
        ),
        "dpc with a bond in shear that breaks": ({"dpc": Dpc(cohesion=1e5)}, set()),
        "soil": ({"movement": Movement(shape="mound")}, {ContactKind.SOIL}),
        "control joint": ({"control_joint": (ControlJoint(x=0.6, width=0.01),)}, set()),
        "other quadrature": ({"dpc": Dpc(), "solver": Solver(contacts_per_interface=5)}, set()),
        "asked for": (
            {"dpc": Dpc(), "solver": Solver(quadrature="midpoint", no_tension_subdivisions=2)},
            {ContactKind.DPC},
        ),
        "refused": ({"dpc": Dpc(), "solver": Solver(no_tension_subdivisions=1)}, set()),
    }.values(),
)
def test_interfaces_without_a_bond_are_cut_and_no_others(parts: dict, expected: set[ContactKind]):
    given = {"wall": SMALL, "movement": Movement(central_deflection=1e-4), **parts}
    assert kinds_cut(Scene(**given)) == expected


def test_a_cut_interface_is_the_same_elastic_joint():
    b, t, k = 0.24, 0.11, 5e9
    wall = Assembly(thickness=t, joint=Joint(normal_stiffness=k, tensile_strength=0.0, cohesion=0.0))
    wall.add_block([(0, 0), (b, 0), (b, 0.1), (0, 0.1)])
    wall.add_block([(0, 0.1), (b, 0.1), (b, 0.2), (0, 0.2)])
    model = wall.build(Solver(lump_block_elasticity=False))
    face = model.interfaces
    assert len(face.x) == Solver().no_tension_parts > 1
    assert len(np.unique(face.joint)) == 1  # one joint of mortar
    at = face.x[:, None] + face.normal_y[:, None] * face.contact_offset
    stiffness = model.properties.normal_stiffness[:, None] * face.contact_area
    for degree, exact in ((0, k * t * b), (1, 0.0), (2, k * t * b**3 / 12)):
        assert (stiffness * (at - b / 2) ** degree).sum() == pytest.approx(exact, rel=1e-13, abs=1e-6 * k * t * b**3)
    np.testing.assert_array_equal([at.min(), at.max()], [0.0, b])  # the ends are seen to open first
    places, count = np.unique(np.round(at, 12), return_counts=True)
    assert len(places) == 2 * len(face.x) + 1
    np.testing.assert_array_equal(count[1:-1], [1, 2] * (len(face.x) - 1) + [1])
