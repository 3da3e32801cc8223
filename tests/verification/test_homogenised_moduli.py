"""Moduli of a wall of rigid blocks on elastic joints, against the closed forms of the periodic cell.

In an infinite wall under homogeneous strain all blocks of running bond rotate alike. The energy of the cell is least in
that rotation. With brick modules b and h, and normal and shear stiffness of head (v) and bed (b) joints, the stiffness
along the wall is k_nv b + k_sb b^2 / (4 h) and upright k_nb h. In shear it is C1 C2 / (C1 + C2) with
C1 = k_sv b + k_nb b^2 / (4 h) and C2 = k_sb h. The term with b^2 / (4 h) is absent in stack bond.
"""

from __future__ import annotations

import numpy as np
import pytest

from damagepred import Scene
from damagepred.assembly.model import Model
from damagepred.kernels.interface.kinematics import interface_displacement
from damagepred.pipeline import model_of

FORMATS = [(0.24, 0.075), (0.24, 0.086), (0.3, 0.15), (0.4, 0.2), (0.6, 0.2), (0.22, 0.06)]
RATIOS = [(82e9, 36e9), (10e9, 10e9), (150e9, 30e9)]


def wall(length: float, height: float, bond: str, stiffness: tuple[float, float], thickness: float) -> Model:
    return model_of(
        Scene.from_dict(
            {
                "wall": {
                    "length": 8 * length,
                    "height": 7 * height,
                    "thickness": thickness,
                    "block_length": length,
                    "block_height": height,
                    "bond": bond,
                },
                "joint": {"normal_stiffness": stiffness[0], "shear_stiffness": stiffness[1]},
                "solver": {"blocks": "rigid", "lump_block_elasticity": False},
                "movement": {"shape": "parabola"},
            }
        )
    )


def cell_energy(model: Model, strain: tuple[float, float, float], rotation: float) -> float:
    """Energy (J) of the joints around the block in the middle, half of each, under a homogeneous strain."""
    blocks, joints = model.blocks, model.interfaces
    middle = int(np.argmin((blocks.x - blocks.x.mean()) ** 2 + (blocks.y - blocks.y.mean()) ** 2))
    xx, yy, xy = strain
    motion = np.zeros((int(max(joints.body_a.max(), joints.body_b.max())) + 1, 3))
    motion[: len(blocks.x)] = np.column_stack(
        [xx * blocks.x + xy * blocks.y, yy * blocks.y + xy * blocks.x, np.full_like(blocks.x, rotation)]
    )
    energy = 0.0
    for i in np.flatnonzero((joints.block_a == middle) | (joints.block_b == middle)):
        opening, shear, turn = interface_displacement(joints, motion.ravel(), i)
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
