"""A case in damagepred, by both solvers with their default settings."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from damagepred import Assembly, SolverError
from damagepred.assembly import Model
from damagepred.scene import BlockMaterial, Joint, Solver
from damagepred.solvers import Increment, solve_path
from studies.benchmarks.beside_others.record import Wall

Case = dict[str, Any]

INCREMENTS = 20
"""Default number of increments of the ground's settlement."""


def assembly(case: Case) -> Assembly:
    """Return the wall of a case; its blocks come first, then the ground."""
    wall = Assembly(
        thickness=case["thickness"],
        gravity=(0.0, -case["gravity"]),
        joint=Joint(
            normal_stiffness=case["normal_stiffness"],
            shear_stiffness=case["shear_stiffness"],
            tensile_strength=0.0,
            cohesion=0.0,
            friction=case["friction"],
        ),
        block=BlockMaterial(
            elastic_modulus=case["elastic_modulus"], poisson_ratio=case["poisson_ratio"], density=case["density"]
        ),
    )
    for corners in case["blocks"]:
        wall.add_block(corners)
    for corners, drop in zip(case["ground"], case["drop"], strict=True):
        piece = wall.add_block(corners)
        wall.support(piece)
        if drop:
            wall.move(piece, y=-drop)
    return wall


def base_forces(model: Model, increment: Increment, blocks: int, lowest: np.ndarray) -> np.ndarray:
    """Return the vertical force of the ground on each of the lowest blocks (N)."""
    face = model.interfaces
    on_ground = (face.block_a >= blocks) ^ (face.block_b >= blocks)
    block = np.minimum(face.block_a, face.block_b)
    force = -(increment.normal_stress * face.contact_area).sum(axis=1) * np.abs(face.normal_y)
    return np.array([force[on_ground & (block == b)].sum() for b in lowest])


def solve(case: Case, settings: Solver, increments: int = INCREMENTS) -> dict[str, Any]:
    """Return the results of a solver for a case: seconds, residual, displacements, base forces."""
    wall = Wall(case)
    began = time.process_time()
    model = assembly(case).build(settings)
    built = time.process_time()
    moves = any(case["drop"])
    path = solve_path(model, settings, increments)
    last = next(path)  # the wall under its own weight
    if moves:
        for increment in path:
            last = increment
    seconds = time.process_time() - built
    return {
        "build": built - began,
        "seconds": seconds,
        "residual": last.unbalanced_force_ratio,
        "status": "collapsed" if last.collapsed else "standing",
        "steps": last.counters.newton_iterations + last.counters.cycles,
        "base": base_forces(model, last, len(wall.mass), wall.lowest),
        "displacement": last.displacement[: len(wall.mass)],
    }


def push(case: Case, settings: Solver, top: float = 1.5) -> dict[str, Any]:
    """Return the bracket of the collapse load as a share of the weight, searched up to ``top``, and its time (s)."""
    wall = assembly(case)
    wall.push_body(x=top)
    began = time.process_time()
    quasi_static = settings.method == "quasi_static"
    increments = 1 if quasi_static else 200  # the quasi-static solver brackets the collapse itself
    last, stood = None, 0
    try:
        for last in solve_path(wall.build(settings), settings, increments):
            if not last.collapsed:
                stood = last.number
    except SolverError:  # without convergence of the explicit solver the wall counts as collapsed
        pass
    assert last is not None
    share = last.last_stable_load_factor if last.collapsed and quasi_static else stood / increments
    width = 1e-3 if quasi_static else top / increments
    low = float(top * share)
    return {"low": low, "high": low + width * low, "seconds": time.process_time() - began}
