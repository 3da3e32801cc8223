"""Extreme proportions, sizes and movements: walls of which an elastic solution, or a sum, tells the answer.

A stack of four bricks (three blocks where there is a sliver) stands on the ground under its own weight, with joints
strong enough to stay elastic, so the solution is unique: a direct solution with residuals in extended precision.
"""

from __future__ import annotations

import itertools
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from scipy.sparse.linalg import splu

from damagepred.arrays import FloatArray
from damagepred.assembly import Assembly, Model
from damagepred.assembly.assembly import rectangle
from damagepred.scene import BlockMaterial, Dpc, Joint, Loads, Movement, Scene
from damagepred.solvers.system.deformable_blocks import transformation_matrix
from damagepred.solvers.system.discrete_system import DiscreteSystem
from studies.benchmarks import walls
from studies.benchmarks.stress.case import RIGID, WAYS, Case, Check, Found
from studies.benchmarks.stress.joints import FOOT, moved

Pair = tuple[float, float]
LENGTH, HEIGHT, COUNT = 0.24, 0.075, 4
MODULUS = 9e9
UNLUMPED = {"lump_block_elasticity": False}


def joint(stiffness: float = 82e9) -> Joint:
    """Return a joint that stays elastic."""
    return Joint(normal_stiffness=stiffness, shear_stiffness=0.44 * stiffness, tensile_strength=1e12, cohesion=1e12)


def block(modulus: float = MODULUS, density: float = 2000.0) -> BlockMaterial:
    """Return an elastic material."""
    return BlockMaterial(elastic_modulus=modulus, poisson_ratio=0.19, density=density)


def stack(
    deformable: bool,
    *,
    stiffness: Pair = (82e9, 82e9),
    modulus: Pair = (MODULUS, MODULUS),
    density: Pair = (2000.0, 2000.0),
    height: float = HEIGHT,
    at: float = 0.0,
) -> Assembly:
    """Return a stack on the ground; values of odd joints and blocks, and of even ones."""
    assembly = Assembly(joint=joint(stiffness[0]))
    for i in range(COUNT):
        corners = rectangle(at, at + i * height, at + LENGTH, at + (i + 1) * height)
        size = min(LENGTH, max(height, LENGTH / 8)) if deformable else 0.0
        assembly.add_block(corners, block(modulus[i % 2], density[i % 2]), course=i, zone_size=size)
    for i in range(1, COUNT):
        assembly.set_joint(i - 1, i, joint(stiffness[i % 2]))
    assembly.rest_on_ground([0], joint=joint(stiffness[0]))
    return assembly


def slivers(deformable: bool, ratio: float) -> Assembly:
    """Return a stack in whose middle lies a triangle as long as a brick and a ``ratio`` thinner at its thick end."""
    assembly, thin = Assembly(joint=joint(), block=block()), LENGTH / ratio
    polygons = [
        rectangle(0.0, 0.0, LENGTH, HEIGHT),
        [(0.0, HEIGHT), (LENGTH, HEIGHT), (LENGTH, HEIGHT + thin)],
        [(0.0, HEIGHT), (LENGTH, HEIGHT + thin), (LENGTH, 2.5 * HEIGHT), (0.0, 2.5 * HEIGHT)],
    ]
    for course, polygon in enumerate(polygons):
        assembly.add_block(polygon, course=course, zone_size=LENGTH / 4 * deformable)
    assembly.rest_on_ground([0])
    return assembly


def proportion() -> list[Case]:
    """Return stacks with one extreme property; two also from the elastic start."""
    made, starts = [], ("stiff joints between soft blocks k_n h/E = 1e6", "slivers 100000 : 1")
    for name, values in walls.read(Path(__file__).with_name("stacks.toml")).items():
        make = partial(slivers, ratio=values["sliver"]) if "sliver" in values else partial(stack, **values)
        case = Case("proportion", name, make, "stands", against_reference, settings=UNLUMPED, elastic_start=False)
        made.append(case)
        if name in starts:
            name, ways = f"{name}, from the elastic start", ("explicit, deformable",)
            made.append(replace(case, name=name, elastic_start=True, ways=ways))
    return made


def against_reference(found: Found) -> Check:
    """Compare settlements with the direct solution."""
    exact = reference(found.model)[:, :2]
    last = found.path[-1 if found.run is not None else 0].displacement[:, :2]
    return Check("direct solution", float(np.abs(last - exact).max() / np.abs(exact).max()))


def reference(model: Model) -> FloatArray:
    """Return the displacement (n, 3) of the blocks under dead load, with residuals in extended precision."""
    system = DiscreteSystem.of(model)
    free = system.free_dofs
    stiffness = system.elastic_stiffness[free][:, free].tocsc()
    scale = 1.0 / np.sqrt(stiffness.diagonal())
    stiffness.data *= scale[stiffness.indices] * np.repeat(scale, np.diff(stiffness.indptr))
    load, factors, rows = scale * system.dead_load[free], splu(stiffness), stiffness.tocsr()
    entries = rows.data.astype(np.longdouble)
    row = np.repeat(np.arange(len(free)), np.diff(rows.indptr))
    found = np.zeros(len(free), dtype=np.longdouble)
    for _ in range(5):
        residual = load.astype(np.longdouble)
        np.subtract.at(residual, row, entries * found[rows.indices])
        found += factors.solve(residual.astype(np.float64))
    displacement = np.zeros(model.size)
    displacement[free] = scale * found.astype(np.float64)
    return system.complete(displacement)[: 3 * model.n_blocks].reshape(-1, 3)


# -- tall stacks ------------------------------------------------------------------------------------------------------


def stack_of(_: bool, count: int) -> Assembly:
    """Return a stack of rigid blocks on the ground."""
    made = Assembly(joint=Joint(tensile_strength=1e12, cohesion=1e12))
    for i in range(count):
        made.add_block(rectangle(0.0, HEIGHT * i, LENGTH, HEIGHT * (i + 1)), course=i, zone_size=0.0)
    made.rest_on_ground([0])
    return made


def closed_form(found: Found) -> Check:
    """Compare the top of the stack with n (n + 1) W / (2 k_n A): FACTS, for rigid blocks with elastic joints alone."""
    model, n = found.model, found.model.n_blocks
    weight = 2000.0 * 9.81 * LENGTH * HEIGHT * model.thickness
    exact = -weight * n * (n + 1) / (2 * model.properties.normal_stiffness[0] * LENGTH * model.thickness)
    return Check("closed form", abs(float(found.path[-1].displacement[:, 1].min()) / exact - 1.0))


def tall_stacks() -> list[Case]:
    """Return stacks of up to 5000 blocks under their own weight."""
    case = Case("tall stacks", "", stack, "stands", closed_form, settings=UNLUMPED, ways=RIGID[:2])
    counts = (1, 10, 100, 1000, 5000)
    return [replace(case, name=f"stack of {count}", make=partial(stack_of, count=count)) for count in counts]


# -- movements of every size, and walls without weight ----------------------------------------------------------------


def moved_wall(_: bool, deflection: float, kind: str, unbreakable: bool) -> Scene:
    """Return a small wall on a moving ground."""
    strength = 1e15 if unbreakable else 5e4
    return Scene(
        wall=FOOT,
        joint=Joint(tensile_strength=strength, cohesion=strength),
        dpc=None if unbreakable else Dpc(course=1),
        movement=Movement(kind=kind, central_deflection=deflection),  # type: ignore[arg-type]
    )


def in_proportion(found: Found) -> Check | None:
    """Compare an elastic wall with its own elastic equations: it moves in proportion to the ground."""
    if found.run is not None:
        return None
    exact = for_full_movement(found.model)
    way = found.path[-1].displacement - found.path[0].displacement
    return Check("proportion", float(np.abs(way - exact).max() / np.abs(exact).max()))


def for_full_movement(model: Model) -> FloatArray:
    """Return the displacement (n, 3) (m, rad) of an elastic wall's blocks on moving ground, by a direct solution."""
    face, law, ground, system = model.interfaces, model.properties, model.ground.full, DiscreteSystem.of(model)
    here = slice(len(face.x) - len(ground.normal), None)
    # the prescribed displacement of the ground acts as an imposed opening of its joints
    pull = -law.normal_stiffness[here, None] * ground.normal * face.contact_area[here]
    drag = (-law.shear_stiffness[here, None] * ground.shear * face.contact_area[here]).sum(axis=1)
    turning, pull = (pull * face.contact_offset[here]).sum(axis=1), pull.sum(axis=1)
    x, y, force = face.normal_x[here], face.normal_y[here], np.zeros((model.n_bodies, 3))
    for body, arm, aside, sign in (
        (face.body_a, face.arm_normal_a, face.arm_shear_a, 1.0),
        (face.body_b, face.arm_normal_b, face.arm_shear_b, -1.0),
    ):
        moment = pull * arm[here] + drag * aside[here] + turning
        np.add.at(force, body[here], sign * np.column_stack((pull * x + drag * y, pull * y - drag * x, moment)))
    on_all = np.zeros(model.size)
    on_all[: force.size] = force.ravel()
    found = system.elastic_solutions(on_all if model.mesh is None else transformation_matrix(model).T @ on_all)
    assert found is not None
    return system.complete(found[0])[: 3 * model.n_blocks].reshape(-1, 3)


def movements() -> list[Case]:
    """Return movements from a picometre to a metre, in one increment and in many."""
    made, sizes = [], (0.0, 1e-12, 1e-9, 1e-6, 1e-3, 1e-2, 0.1, 1.0)
    for kind, size, count, unbreakable in itertools.product(("dishing", "doming"), sizes, (1, 20), (True, False)):
        if kind == "doming" and unbreakable and count == 1:
            continue
        ways = ("quasi-static, rigid", "explicit, rigid") if count > 1 else WAYS if kind == "dishing" else RIGID
        name = f"{kind} by {size:g} m in {'one increment' if count == 1 else f'{count} increments'}"
        make = partial(moved_wall, deflection=size, kind=kind, unbreakable=unbreakable)
        check = in_proportion if unbreakable and size >= 1e-6 else None
        name += ", unbreakable" * unbreakable
        made.append(Case("movement", name, make, "", check, count, dynamics=moved, ways=ways))
    return made


def weightless_wall(_: bool, roof: float, strength: dict[str, float], deflection: float) -> Scene:
    """Return a small wall of bricks without weight."""
    return Scene(
        wall=FOOT,
        joint=Joint(**strength),  # type: ignore[arg-type]
        block=BlockMaterial(density=0.0),
        loads=Loads(roof=roof),
        movement=Movement(central_deflection=deflection),
    )


def weightless() -> list[Case]:
    """Return walls without weight, with and without strength and a roof."""
    bonds = {"unbreakable": 1e15, "weak": None, "no bond": 0.0}
    made = []
    for roof, (bond, strength), size in itertools.product((0.0, 1e3), bonds.items(), (0.0, 1e-3)):
        law = {} if strength is None else {"tensile_strength": strength, "cohesion": strength}
        make = partial(weightless_wall, roof=roof, strength=law, deflection=size)
        name = f"roof {roof:g} N, {bond}, dishing by {size:g} m"
        made.append(Case("no weight", name, make, increments=2, dynamics=moved))
    return made


def cases() -> list[Case]:
    """Return all cases."""
    return proportion() + tall_stacks() + movements() + weightless()
