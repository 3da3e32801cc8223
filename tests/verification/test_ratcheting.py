"""A dry block across two plates on a slope, the lower of which goes to and fro: ratcheting or shakedown (Croll 2008).

While the plates part, the block sticks to the lower one; while they close, to the upper one. So it creeps downhill.
"""

from dataclasses import replace

import numpy as np
import pytest

from damagepred import Assembly, BlockMaterial, Joint, Solver
from damagepred.scene.movement_stage import History
from damagepred.solvers import solve_path
from tests.verification.blocks import DRY, G

SLOPE, FRICTION, CYCLES = 0.2, 0.5, 6


@pytest.mark.parametrize("method", ["quasi_static", "explicit"])
@pytest.mark.parametrize("amplitude", [4.0, 1.5, 0.8], ids=["ratcheting", "slow ratcheting", "shakedown"])
def test_advance_downhill_in_each_cycle(amplitude: float, method: str) -> None:
    """Advance u - 2 W (mu cos b - sin b) / (k_s A) in each cycle, none if that is negative; W weight, A of one bed."""
    across, down = np.array([np.cos(np.arctan(SLOPE)), np.sin(np.arctan(SLOPE))])
    weight, bed, shear_stiffness = 1000.0 * 1.0 * 0.1 * 0.1 * G, 0.4 * 0.1, 1e8
    elastic = 2.0 * weight * (FRICTION * across - down) / (shear_stiffness * bed)
    joint = Joint(normal_stiffness=1e9, shear_stiffness=shear_stiffness, friction=FRICTION, **DRY)
    gravity = (G * down, -G * across)
    wall = Assembly(thickness=0.1, gravity=gravity, joint=joint, block=BlockMaterial(density=1000.0))
    upper = wall.add_block([(0.0, -0.1), (0.4, -0.1), (0.4, 0.0), (0.0, 0.0)])
    lower = wall.add_block([(0.6, -0.1), (1.0, -0.1), (1.0, 0.0), (0.6, 0.0)])
    block = wall.add_block([(0.0, 0.0), (1.0, 0.0), (1.0, 0.1), (0.0, 0.1)])
    for plate in (upper, lower):
        wall.support(plate)
    wall.move(lower, x=amplitude * elastic)
    wall.load(block, moment=weight * down * 0.05)  # so that both plates carry the same
    solver = Solver(method=method, lump_block_elasticity=False, symmetric_half=False)
    there_and_back = np.append(0.0, np.tile([0.5, 1.0, 0.5, 0.0], CYCLES))
    model = replace(wall.build(solver), history=History(there_and_back, np.zeros(0, np.int64), None))
    moved = np.array([i.displacement[block, 0] for i in solve_path(model, solver, 1)])[::4]
    assert np.diff(moved)[1:] == pytest.approx(max(amplitude - 1.0, 0.0) * elastic, abs=1e-3 * elastic)
