"""Blocks that grow, warm or shrink between two fixed supports: stress E alpha dT, less what the joints take up."""

import numpy as np
import pytest
import xarray as xr

from damagepred import Assembly, BlockMaterial, Dynamics, InputError, Joint, Solver, solve
from damagepred.assembly.assembly import rectangle

LENGTH, DEPTH, MODULUS, WARMTH = 0.4, 0.2, 9e9, 8e-6 * 40.0
STRONG = {"tensile_strength": 1e10, "cohesion": 1e10}
HARD = 1e6 * MODULUS / LENGTH
KINDS = {"rigid": {}, "elastic": {"elastic": True}, "deformable": {"zone_size": 0.1}}


def row(count: int, strain: float, kind: str, stiffness: float, **law: float) -> Assembly:
    """Return a weightless row of blocks between two supports that stay; joints are as good as free of shear."""
    joint = Joint(normal_stiffness=stiffness, shear_stiffness=1e4, **{**STRONG, **law})
    block = BlockMaterial(elastic_modulus=MODULUS, poisson_ratio=0.0)
    wall = Assembly(thickness=0.1, gravity=(0.0, 0.0), joint=joint, block=block)
    for left in LENGTH * np.arange(count):
        wall.strain(wall.add_block(rectangle(left, 0.0, left + LENGTH, DEPTH), **KINDS[kind]), strain)
    for left in (-LENGTH, count * LENGTH):
        wall.support(wall.add_block(rectangle(left, 0.0, left + LENGTH, DEPTH), zone_size=0.0, elastic=False))
    return wall


def solved(wall: Assembly, method: str = "quasi_static") -> xr.Dataset:
    solver = Solver(method=method, lump_block_elasticity=False, tolerance=1e-2, maximum_cycles=2_000_000)
    return solve(wall, solver=solver, increments=2)


@pytest.mark.parametrize("method", ["quasi_static", "explicit"])
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("count", [1, 4])
def test_stress_of_warm_blocks_between_supports(count: int, kind: str, method: str) -> None:
    """-E alpha dT / (1 + (n + 1) E / (n L k)); rigid blocks leave all of it to the joints."""
    stiffness, modulus = 82e9, np.inf if kind == "rigid" else MODULUS
    ds = solved(row(count, WARMTH, kind, stiffness), method)
    give = (count + 1) / stiffness + count * LENGTH / modulus
    found = ds["contact_normal_stress"].values
    assert found[2] == pytest.approx(-count * LENGTH * WARMTH / give, rel=1e-4)
    assert found[1] == pytest.approx(0.5 * found[2], rel=1e-4)


@pytest.mark.parametrize("kind", ["elastic", "deformable"])
def test_hard_joints_leave_all_of_the_stress_to_the_block(kind: str) -> None:
    found = solved(row(1, WARMTH, kind, HARD))["contact_normal_stress"].values[-1]
    assert found == pytest.approx(-MODULUS * WARMTH, rel=1e-5)


@pytest.mark.parametrize("kind", KINDS)
def test_the_weakest_joint_takes_all_of_the_shrinkage(kind: str) -> None:
    """Between cold blocks the weakest joint breaks, and opens by n L alpha dT; the row is free of stress."""
    wall = row(4, -WARMTH, kind, 82e9, tensile_strength=2e6)
    wall.set_joint(1, 2, Joint(normal_stiffness=82e9, shear_stiffness=1e4, tensile_strength=0.5e6, cohesion=1e10))
    ds = solved(wall)
    opening = ds["contact_opening"].values[-1]
    weakest = np.isclose(ds["contact_x"].values, 2.0 * LENGTH)
    assert opening[weakest] == pytest.approx(4.0 * LENGTH * WARMTH, rel=1e-6)
    assert opening[~weakest] == pytest.approx(0.0, abs=1e-9)
    assert ds["contact_normal_stress"].values[-1] == pytest.approx(0.0, abs=1.0)


def test_only_blocks_with_a_strain_grow() -> None:
    """A warm block beside a cold one moves the joint between them by half of its growth."""
    wall = row(2, 0.0, "elastic", HARD)
    wall.strain(0, WARMTH)
    moved = solved(wall)["block_displacement_x"].values[-1]
    assert moved[:2] == pytest.approx([0.25 * LENGTH * WARMTH] * 2, rel=1e-4)


def test_wrong_strains_of_blocks_are_named() -> None:
    wall = row(1, WARMTH, "rigid", HARD)
    with pytest.raises(InputError, match="block 7: there is no such block"):
        wall.strain(7, 1e-4)
    with pytest.raises(InputError, match=r"block 0: strain = 8.0: must be .* -0.01 .*0.01"):
        wall.strain(0, 8.0)
    with pytest.raises(InputError, match="a run in time has none"):
        solve(wall, dynamics=Dynamics())
