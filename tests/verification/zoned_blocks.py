"""Common parts of the checks of deformable blocks: solution, plane elasticity, and mesh convergence."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.assembly import Assembly, Model
from damagepred.scene import BlockMaterial, Solver
from damagepred.solvers import Increment, solve_path
from damagepred.solvers.state.increment import ZoneResults
from damagepred.solvers.system.deformable_blocks import cell_gridpoints, strain_rows

BRICKWORK = BlockMaterial(elastic_modulus=9e9, poisson_ratio=0.19)
CONCRETE = BlockMaterial(elastic_modulus=30e9, poisson_ratio=0.2, density=2400.0)
RUBBER = BlockMaterial(elastic_modulus=5e6, poisson_ratio=0.45, density=1100.0)
NAMES = {BRICKWORK: "brickwork", CONCRETE: "concrete", RUBBER: "rubber"}


def solved(
    assembly: Assembly, solver: Solver, plane: str = "stress", increments: int = 1, **settings: object
) -> tuple[Model, list[Increment]]:
    own = replace(solver, plane=plane, **settings)
    model = assembly.build(own)
    return model, list(solve_path(model, own, increments))


def zones_of(increment: Increment) -> ZoneResults:
    return increment.zones


def moduli(material: BlockMaterial, plane: str) -> tuple[float, float]:
    """Return E and nu that make the equations of plane stress those of the plane (Timoshenko and Goodier, art. 20)."""
    modulus, ratio = material.elastic_modulus, material.poisson_ratio
    return (modulus, ratio) if plane == "stress" else (modulus / (1 - ratio**2), ratio / (1 - ratio))


def stress_of(material: BlockMaterial, plane: str, gradient: FloatArray) -> FloatArray:
    """Return s_xx, s_yy, s_xy, s_zz (Pa) of a displacement gradient (2, 2)."""
    modulus, ratio = moduli(material, plane)
    e_x, e_y, g = gradient[0, 0], gradient[1, 1], gradient[0, 1] + gradient[1, 0]
    s_x, s_y = modulus / (1 - ratio**2) * np.array([e_x + ratio * e_y, e_y + ratio * e_x])
    return np.array([s_x, s_y, material.shear_modulus * g, out_of_plane(material, plane, s_x + s_y)])


def gradient_of(material: BlockMaterial, plane: str, stress: Sequence[float]) -> FloatArray:
    """Return the symmetric displacement gradient (2, 2) under s_xx, s_yy, s_xy (Pa)."""
    modulus, ratio = moduli(material, plane)
    s_x, s_y, s_xy = stress
    half = s_xy / material.shear_modulus / 2
    return np.array([[(s_x - ratio * s_y) / modulus, half], [half, (s_y - ratio * s_x) / modulus]])


def out_of_plane(material: BlockMaterial, plane: str, in_plane: float) -> float:
    """Return s_zz (Pa) of an elastic zone."""
    return material.poisson_ratio * in_plane if plane == "strain" else 0.0


def centres(model: Model) -> tuple[FloatArray, FloatArray]:
    """Return x, y of the zones' centroids (m)."""
    return model.mesh.x[model.mesh.zones].mean(axis=1), model.mesh.y[model.mesh.zones].mean(axis=1)


def point_forces(model: Model, stress: FloatArray) -> FloatArray:
    """Return the force x, y that holds each gridpoint (g, 2) (N) against its zones."""
    mesh = model.mesh
    volume = mesh.zone_area * model.block_law.thickness[mesh.zone_block]
    each = np.einsum("zki,zk->zi", strain_rows(model), stress[:, :3]) * volume[:, None]
    force = np.zeros((mesh.x.size, 2))
    np.add.at(force, cell_gridpoints(mesh.zones), each.reshape(-1, 4, 5, 2).sum(axis=1))
    return force


def order(sizes: Sequence[float], errors: Sequence[float]) -> float:
    """Return the slope of log(error) over log(size), by least squares."""
    return float(np.polyfit(np.log(sizes), np.log(errors), 1)[0])
