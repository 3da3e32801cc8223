"""Moduli of a wall of rigid blocks on elastic joints, against the closed forms of the periodic cell.

In an infinite wall under homogeneous strain all blocks of running bond rotate alike. The energy of the cell is least in
that rotation. With brick modules b and h, and normal and shear stiffness of head (v) and bed (b) joints, the stiffness
along the wall is k_nv b + k_sb b^2 / (4 h) and upright k_nb h. In shear it is C1 C2 / (C1 + C2) with
C1 = k_sv b + k_nb b^2 / (4 h) and C2 = k_sb h. The term with b^2 / (4 h) is absent in stack bond.

With bricks of finite stiffness, the exact moduli are those of a periodic cell in which a brick, in plane stress, moves
by polynomials. All bricks of either bond are one brick and its translations, so the cell is one brick.
"""

from collections.abc import Mapping

import numba
import numpy as np
import pytest
from numpy.polynomial.legendre import legder, leggauss, legval

from damagepred import Scene, solve
from damagepred.assembly.model import InterfaceRecords, Model
from damagepred.enumerations import ContactKind
from damagepred.kernels.interface.kinematics import interface_displacement
from damagepred.one_wall.judged_path import model_of
from damagepred.solvers.system.discrete_system import DiscreteSystem

pytestmark = pytest.mark.quick_cases()

RIGID_BRICKS = {"blocks": "rigid", "lump_block_elasticity": False}
FORMATS = [(0.24, 0.075), (0.24, 0.086), (0.3, 0.15), (0.4, 0.2), (0.6, 0.2), (0.22, 0.06)]
RATIOS = [(82e9, 36e9), (10e9, 10e9), (150e9, 30e9)]


BRICK, POISSON, DEGREE = 9e9, 0.19, 7


def wall(
    length: float,
    height: float,
    bond: str,
    stiffness: tuple[float, float],
    thickness: float,
    solver: Mapping[str, object] = RIGID_BRICKS,
    head: float = 1.0,
    brick: float = BRICK,
) -> Model:
    return model_of(
        Scene.from_dict(
            {
                "wall": (
                    {"length": 8 * length, "height": 7 * height, "thickness": thickness, "block_length": length}
                    | {"block_height": height, "bond": bond}
                ),
                "block": {"elastic_modulus": brick, "poisson_ratio": POISSON},
                "joint": {"normal_stiffness": stiffness[0], "shear_stiffness": stiffness[1]},
                "head_joint": {"factor": {"normal_stiffness": head, "shear_stiffness": head}},
                "solver": dict(solver),
                "movement": {"shape": "parabola"},
            }
        )
    )


@numba.njit
def relative_displacement(records: InterfaceRecords, motion: np.ndarray, i: int) -> tuple[float, float, float]:
    """Return opening and shear in the middle of an interface, and its relative rotation."""
    return interface_displacement(records.edge[i], records.elastic, motion, i)


def cell_energy(model: Model, strain: tuple[float, float, float], rotation: float) -> float:
    """Energy (J) of the joints around the block in the middle, half of each, under a homogeneous strain."""
    blocks, joints, records = model.blocks, model.interfaces, model.interface_records
    middle = int(np.argmin((blocks.x - blocks.x.mean()) ** 2 + (blocks.y - blocks.y.mean()) ** 2))
    xx, yy, xy = strain
    motion = np.zeros((int(max(joints.body_a.max(), joints.body_b.max())) + 1, 3))
    motion[: len(blocks.x)] = np.column_stack(
        [xx * blocks.x + xy * blocks.y, yy * blocks.y + xy * blocks.x, np.full_like(blocks.x, rotation)]
    )
    energy = 0.0
    for i in np.flatnonzero((joints.block_a == middle) | (joints.block_b == middle)):
        opening, shear, turn = relative_displacement(records, motion.ravel(), i)
        normal, tangential = model.properties.normal_stiffness[i], model.properties.shear_stiffness[i]
        openings = opening + turn * joints.contact_offset[i]
        energy += 0.25 * (joints.contact_area[i] @ (normal * openings**2 + tangential * shear**2))
    return float(energy)


def modulus(model: Model, strain: tuple[float, float, float], volume: float) -> float:
    """Second derivative of the cell's energy density, least in the rotation of the blocks."""
    left, middle, right = (cell_energy(model, strain, rotation) for rotation in (-1.0, 0.0, 1.0))
    curvature, slope = left - 2 * middle + right, 0.5 * (right - left)
    return 2 * (middle - 0.5 * slope**2 / curvature) / volume


@pytest.mark.parametrize("module", FORMATS)
@pytest.mark.parametrize("stiffness", RATIOS)
@pytest.mark.parametrize("bond", ["running", "stack"])
def test_moduli_of_the_periodic_cell(module: tuple[float, float], stiffness: tuple[float, float], bond: str) -> None:
    (b, h), (k_n, k_s), thickness = module, stiffness, 0.11
    model = wall(b, h, bond, stiffness, thickness)
    volume, staggered = b * h * thickness, b**2 / (4 * h) if bond == "running" else 0.0
    first, second = k_s * b + k_n * staggered, k_s * h
    # a shear strain xy of 1/2 is a shear angle of 1
    found = [modulus(model, strain, volume) for strain in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 0.5))]
    assert found[0] == pytest.approx(k_n * b + k_s * staggered, rel=1e-9)
    assert found[1] == pytest.approx(k_n * h, rel=1e-9)
    assert found[2] == pytest.approx(first * second / (first + second), rel=1e-9)


def engineering_moduli(stiffness: np.ndarray) -> np.ndarray:
    """Moduli along the wall, upright and in shear (Pa), of a stiffness (3, 3) for xx, yy and shear angle."""
    return 1.0 / np.diag(np.linalg.inv(stiffness))


def moduli_of(model: Model, volume: float) -> np.ndarray:
    """Moduli of a wall in which all blocks rotate, stretch and bend alike."""
    blocks, joints, system = model.blocks, model.interfaces, DiscreteSystem.of(model)
    records = model.interface_records
    middle = int(np.argmin((blocks.x - blocks.x.mean()) ** 2 + (blocks.y - blocks.y.mean()) ** 2))
    motion = np.zeros((6, model.size))
    x, y = (slice(axis, 3 * model.n_blocks, 3) for axis in (0, 1))
    motion[0, x], motion[1, y] = blocks.x, blocks.y
    motion[2, x], motion[2, y] = blocks.y / 2, blocks.x / 2
    motion[3, 2 : 3 * model.n_blocks : 3] = 1.0
    energy = np.zeros((6, 6))
    if model.elastic is not None:
        own = int(np.flatnonzero(model.elastic.block == middle)[0])
        first = system.strain_dofs.start
        motion[4, first::2] = motion[5, first + 1 :: 2] = 1.0
        energy[[4, 5], [4, 5]] = system.strain_stiffness[2 * own : 2 * own + 2]
    for i in np.flatnonzero((joints.block_a == middle) | (joints.block_b == middle)):
        opening, shear, turn = np.array([relative_displacement(records, row, i) for row in motion]).T
        for at, area in zip(joints.contact_offset[i], joints.contact_area[i]):
            normal = opening + turn * at
            energy += 0.5 * area * model.properties.normal_stiffness[i] * np.outer(normal, normal)
            energy += 0.5 * area * model.properties.shear_stiffness[i] * np.outer(shear, shear)
    within = np.linalg.pinv(energy[3:, 3:])
    return engineering_moduli((energy[:3, :3] - energy[:3, 3:] @ within @ energy[3:, :3]) / volume)


def exact_moduli(
    b: float, h: float, stiffness: tuple[float, float], bond: str, head: float = 1.0, brick: float = BRICK
) -> np.ndarray:
    """Moduli of the periodic cell with a brick of Legendre polynomials in x and y; ``head``: stiffness over beds."""
    points, weights = leggauss(DEGREE + 2)
    s, t = (grid.ravel() for grid in np.meshgrid(points, points))
    weight = np.outer(weights, weights).ravel() * b * h / 4
    one = np.eye(DEGREE + 1)

    def shapes(x: np.ndarray, y: np.ndarray, along: int = 0, up: int = 0) -> np.ndarray:
        of_x, of_y = (legval(at, legder(one, order)) for at, order in ((x, along), (y, up)))
        return np.einsum("i...,j...->ij...", of_x, of_y).reshape(-1, *np.shape(x))

    slope_x, slope_y = shapes(s, t, along=1) * 2 / b, shapes(s, t, up=1) * 2 / h
    none = np.zeros_like(slope_x)
    strain = np.stack([np.vstack(pair) for pair in ((slope_x, none), (none, slope_y), (slope_y, slope_x))])
    law = np.array([[1.0, POISSON, 0.0], [POISSON, 1.0, 0.0], [0.0, 0.0, (1 - POISSON) / 2]]) * brick / (1 - POISSON**2)
    count = strain.shape[1]
    energy = np.zeros((count + 3, count + 3))
    energy[:count, :count] = np.einsum("kip,kl,ljp,p->ij", strain, law, strain, weight, optimize=True)

    def add_joint(here, there, lattice, w) -> None:
        difference = shapes(*map(np.array, there)) - shapes(*map(np.array, here))
        still = np.zeros_like(difference)
        x, y = lattice
        jump = np.array([[*difference, *still, x, 0.0, y / 2], [*still, *difference, 0.0, y, x / 2]])
        springs = [head * k for k in stiffness] if y == 0.0 else stiffness[::-1]
        energy[:] += w * np.einsum("ki,k,kj->ij", jump, springs, jump)

    for at, w in zip(points, weights):
        add_joint((1.0, at), (-1.0, at), (b, 0.0), w * h / 2)
        if bond == "stack":
            add_joint((at, 1.0), (at, -1.0), (0.0, h), w * b / 2)
        else:
            right = (at + 1) / 2
            add_joint((right, 1.0), (right - 1, -1.0), (b / 2, h), w * b / 4)
            add_joint((right - 1, 1.0), (right, -1.0), (-b / 2, h), w * b / 4)
    within = np.linalg.pinv(energy[:count, :count], rcond=1e-12)
    condensed = energy[count:, count:] - energy[count:, :count] @ within @ energy[:count, count:]
    return engineering_moduli(condensed / (b * h))


@pytest.mark.parametrize("module", FORMATS)
@pytest.mark.parametrize("stiffness", RATIOS)
@pytest.mark.parametrize("bond", ["running", "stack"])
def test_moduli_of_elastic_bricks(module: tuple[float, float], stiffness: tuple[float, float], bond: str) -> None:
    """Elastic bricks come within 3.5 % of the exact cell; rigid ones are 15 to 70 % too stiff along running bond."""
    (b, h), thickness = module, 0.11
    exact = exact_moduli(b, h, stiffness, bond)
    elastic, rigid = (
        moduli_of(wall(b, h, bond, stiffness, thickness, {"blocks": blocks}), b * h * thickness) / exact - 1.0
        for blocks in ("elastic", "rigid")
    )
    assert abs(elastic[0]) < (0.032 if bond == "running" else 1e-6)
    assert elastic[1] == pytest.approx(0.0, abs=1e-3)
    assert abs(elastic[2]) < (0.035 if bond == "running" else 1e-6)
    if bond == "running":
        assert 0.15 < rigid[0] < 0.70
    else:
        assert -0.38 < rigid[2] < -0.09


@pytest.mark.parametrize(
    ("head", "brick", "along", "shear", "rigid_along"),
    [
        (0.3, BRICK, 0.075, 0.077, (0.09, 0.75)),
        (0.1, BRICK, 0.113, 0.111, (0.03, 0.70)),
        (1.0, 3e9, 0.031, 0.023, (0.28, 1.0)),
    ],
)
@pytest.mark.parametrize("module", FORMATS)
@pytest.mark.parametrize("stiffness", RATIOS)
def test_moduli_with_weak_head_joints_and_soft_bricks(module, stiffness, head, brick, along, shear, rigid_along):
    """Weak head joints increase the errors of elastic bricks, soft bricks those of rigid ones."""
    (b, h), thickness = module, 0.11
    exact = exact_moduli(b, h, stiffness, "running", head, brick)
    elastic, rigid = (
        moduli_of(wall(b, h, "running", stiffness, thickness, {"blocks": blocks}, head, brick), b * h * thickness)
        / exact
        - 1.0
        for blocks in ("elastic", "rigid")
    )
    assert -along < elastic[0] < 0.0
    assert elastic[1] == pytest.approx(0.0, abs=1e-3)
    assert abs(elastic[2]) < shear
    assert rigid_along[0] < rigid[0] < rigid_along[1]


def test_the_exact_cell_of_the_test_wall() -> None:
    """Brick 240 x 75 mm, 82 and 36 N/mm3, in GPa: exact 6.58, 3.65, 1.41."""
    assert exact_moduli(0.24, 0.075, (82e9, 36e9), "running") / 1e9 == pytest.approx([6.58, 3.653, 1.413], rel=2e-3)


LENGTH, CURVATURE = 2.64, 1e-3


def peaks(**solver: object) -> dict[str, float]:
    """Largest tension (MPa) of head joints, bed joints and the bed on the base in the middle of the strip."""
    scene = Scene.from_dict(
        {
            "wall": {"length": LENGTH, "height": 0.15},
            "block": {"density": 0.0},
            "joint": {"tensile_strength": 100e6, "cohesion": 100e6},
            "movement": {
                "kind": "doming",
                "shape": "parabola",
                "central_deflection": CURVATURE * LENGTH**2 / 8,
                "increments": 1,
            },
            "solver": solver,
        }
    )
    ds = solve(scene)
    middle = np.abs(ds["contact_x"].values - LENGTH / 2) < 0.25
    stress, kind = ds["contact_normal_stress"].values[-1], ds["contact_kind"].values
    names = {"head": ContactKind.HEAD_JOINT, "bed": ContactKind.BED_JOINT, "base": ContactKind.FOOTING_INTERFACE}
    return {name: 1e-6 * float(stress[middle & (kind == of)].max()) for name, of in names.items()}


def test_elastic_bricks_follow_a_curved_base() -> None:
    exact = peaks(blocks="deformable", zone_size=0.03, contacts_per_interface=5)
    elastic, rigid = peaks(blocks="elastic"), peaks(blocks="rigid")
    assert elastic["head"] == pytest.approx(exact["head"], rel=0.03)
    assert elastic["bed"] == pytest.approx(exact["bed"], abs=0.03)
    assert elastic["base"] == pytest.approx(exact["base"], abs=0.03)
    assert rigid["bed"] > 3.0 * exact["bed"]
    assert rigid["base"] > 5.0 * exact["base"]
