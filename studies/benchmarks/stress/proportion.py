"""Stacks with one extreme property, and the settlements of their blocks.

A stack of four bricks (three blocks where there is a sliver) stands on the ground under its own weight, with joints
strong enough to stay elastic, so the solution is unique: a direct solution with residuals in extended precision.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.sparse.linalg import splu

from damagepred.arrays import FloatArray
from damagepred.assembly import Assembly, Model
from damagepred.assembly.assembly import rectangle
from damagepred.scene import BlockMaterial, Joint
from damagepred.solvers.system.discrete_system import DiscreteSystem
from studies.benchmarks.stress.case import Case, Check, Found

Pair = tuple[float, float]
LENGTH, HEIGHT, COUNT = 0.24, 0.075, 4
MODULUS = 9e9
BOND = {"tensile_strength": 1e12, "cohesion": 1e12}
"""Joints that stay elastic, so the solution is unique."""


def joint(stiffness: float = 82e9) -> Joint:
    """Return a joint that stays elastic."""
    return Joint(normal_stiffness=stiffness, shear_stiffness=0.44 * stiffness, **BOND)  # type: ignore[arg-type]


def block(modulus: float = MODULUS, density: float = 2000.0) -> BlockMaterial:
    """Return an elastic material."""
    return BlockMaterial(elastic_modulus=modulus, poisson_ratio=0.19, density=density)


def stack(
    deformable: bool,
    *,
    stiffness: Pair = (82e9, 82e9),
    modulus: Pair = (MODULUS, MODULUS),
    density: Pair = (2000.0, 2000.0),
    length: float = LENGTH,
    height: float = HEIGHT,
    at: Pair = (0.0, 0.0),
) -> Assembly:
    """Return a stack on the ground; values of odd joints and blocks, and of even ones."""
    assembly = Assembly(joint=joint(stiffness[0]))
    x, y = at
    for i in range(COUNT):
        corners = rectangle(x, y + i * height, x + length, y + (i + 1) * height)
        made_of = block(modulus[i % 2], density[i % 2])
        size = min(length, max(height, length / 8)) if deformable else 0.0
        assembly.add_block(corners, made_of, course=i, zone_size=size)
    for i in range(1, COUNT):
        assembly.set_joint(i - 1, i, joint(stiffness[i % 2]))
    assembly.rest_on_ground([0], joint=joint(stiffness[0]))
    return assembly


def slivers(deformable: bool, ratio: float) -> Assembly:
    """Return a stack in whose middle lies a triangle as long as a brick and a ``ratio`` thinner at its thick end."""
    thin = LENGTH / ratio
    assembly = Assembly(joint=joint(), block=block())
    polygons = [
        rectangle(0.0, 0.0, LENGTH, HEIGHT),
        [(0.0, HEIGHT), (LENGTH, HEIGHT), (LENGTH, HEIGHT + thin)],
        [(0.0, HEIGHT), (LENGTH, HEIGHT + thin), (LENGTH, 2.5 * HEIGHT), (0.0, 2.5 * HEIGHT)],
    ]
    for course, polygon in enumerate(polygons):
        size = LENGTH / 4 if deformable else 0.0
        assembly.add_block(polygon, course=course, zone_size=size)
    assembly.rest_on_ground([0])
    return assembly


def cracking_wall(deformable: bool, at: float) -> Assembly:
    """Return a wall of 5 courses on a joint without tension, in dishing, its coordinates shifted by ``at`` (m)."""
    weak = Joint(normal_stiffness=8.2e9, shear_stiffness=3.6e9, tensile_strength=0.0, cohesion=0.0, friction=0.5)
    assembly = Assembly(joint=Joint(tensile_strength=0.05e6, cohesion=0.1e6))
    for course in range(5):
        edges = [0.0, *(LENGTH * (i + 0.5 * (course % 2)) for i in range(course % 2 == 0, 8)), 8 * LENGTH]
        for left, right in itertools.pairwise(edges):
            if right - left > 1e-9:
                low = HEIGHT * course
                assembly.add_block(
                    rectangle(at + left, at + low, at + right, at + low + HEIGHT),
                    course=course,
                    zone_size=HEIGHT if deformable else 0.0,
                )
    middle, half = at + 4 * LENGTH, 4 * LENGTH
    assembly.rest_on_ground(range(8), lambda x: -1e-3 * (1 - ((x - middle) / half) ** 2), joint=weak)
    return assembly


def cases() -> list[Case]:
    """Return all stresses, from zero to the largest."""
    found: list[tuple[str, str, Callable[[bool], Assembly]]] = [("in proportion", "", stack)]
    for power in (2, 4, 6):
        ratio = 10.0**power
        found += [
            (
                "soft joints among stiff ones",
                f"1 : 1e{power}",
                lambda d, r=ratio: stack(d, stiffness=(8.2e12 / r, 8.2e12)),
            ),
            (
                "stiff joints between soft blocks",
                f"k_n h/E = 1e{power}",
                lambda d, r=ratio: stack(d, stiffness=(r * 1e8 / HEIGHT,) * 2, modulus=(1e8, 1e8)),
            ),
            ("soft blocks among stiff ones", f"1 : 1e{power}", lambda d, r=ratio: stack(d, modulus=(9e12 / r, 9e12))),
        ]
    for power in (2, 4):
        ratio = 10.0**power
        found += [
            ("heavy blocks on light ones", f"1e{power} : 1", lambda d, r=ratio: stack(d, density=(2.0, 2.0 * r))),
            ("light blocks on heavy ones", f"1 : 1e{power}", lambda d, r=ratio: stack(d, density=(2.0 * r, 2.0))),
        ]
    for ratio in (10.0, 50.0, 1e3, 1e5):
        found.append(("slivers", f"{ratio:g} : 1", lambda d, r=ratio: slivers(d, r)))
    for ratio in (10.0, 50.0):
        found.append(("flat blocks", f"{ratio:g} : 1", lambda d, r=ratio: stack(d, height=LENGTH / r)))
        found.append(("slender blocks", f"1 : {ratio:g}", lambda d, r=ratio: stack(d, height=LENGTH * r)))
    for far in (1e3, 1e4, 1e6):
        found.append(("far coordinates", f"{far / 1e3:g} km", lambda d, r=far: stack(d, at=(r, r))))
    own = {"lump_block_elasticity": False}
    made = [
        Case(
            "proportion",
            f"{stress} {size}".strip(),
            make,
            "stands",
            against_reference,
            settings=own,
            elastic_start=False,
        )
        for stress, size, make in found
    ]
    slow = ("stiff joints between soft blocks k_n h/E = 1e6", "slivers 100000 : 1")
    made += [
        replace(case, name=f"{case.name}, from the elastic start", elastic_start=True, ways=("explicit, deformable",))
        for case in made
        if case.name in slow
    ]
    return sorted(made, key=lambda case: case.name)


def against_reference(found: Found) -> Check:
    """Compare settlements with the direct solution."""
    exact = reference(found.model)
    error = np.abs(found.path[0].displacement - exact)[:, :2].max() / np.abs(exact[:, :2]).max()
    if found.run is not None:
        error = np.abs(found.path[-1].displacement - exact)[:, :2].max() / np.abs(exact[:, :2]).max()
    return Check("direct solution", float(error))


def reference(model: Model) -> FloatArray:
    """Return the displacement (n, 3) of the blocks under dead load, with residuals in extended precision."""
    free = DiscreteSystem.of(model).free_dofs
    stiffness = DiscreteSystem.of(model).elastic_stiffness[free][:, free].tocsc()
    scale = 1.0 / np.sqrt(stiffness.diagonal())
    stiffness.data *= scale[stiffness.indices] * np.repeat(scale, np.diff(stiffness.indptr))
    load = scale * DiscreteSystem.of(model).dead_load[free]
    factors = splu(stiffness)
    rows = stiffness.tocsr()
    entries = rows.data.astype(np.longdouble)
    row = np.repeat(np.arange(len(free)), np.diff(rows.indptr))
    found = np.zeros(len(free), dtype=np.longdouble)
    for _ in range(5):
        residual = load.astype(np.longdouble)
        np.subtract.at(residual, row, entries * found[rows.indices])
        found += factors.solve(residual.astype(np.float64))
    displacement = np.zeros(model.size)
    displacement[free] = scale * found.astype(np.float64)
    return DiscreteSystem.of(model).complete(displacement)[: 3 * model.n_blocks].reshape(-1, 3)
