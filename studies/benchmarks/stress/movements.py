"""Movements from a picometre to a metre, in one increment or many; walls without weight."""

from __future__ import annotations

import itertools

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.assembly import Model
from damagepred.scene import BlockMaterial, Dpc, Joint, Loads, Movement, Scene
from damagepred.solvers.system.deformable_blocks import transformation_matrix
from damagepred.solvers.system.discrete_system import DiscreteSystem
from studies.benchmarks.stress.case import RIGID, WAYS, Case, Check, Found
from studies.benchmarks.stress.joints import FOOT, moved


def wall(deflection: float, kind: str, unbreakable: bool, **more: object) -> Scene:
    """Return a small wall on a moving ground."""
    joint = Joint(tensile_strength=1e15, cohesion=1e15) if unbreakable else Joint(tensile_strength=5e4, cohesion=5e4)
    dpc = None if unbreakable else Dpc(course=1)
    return Scene(wall=FOOT, joint=joint, dpc=dpc, movement=Movement(kind=kind, central_deflection=deflection), **more)  # type: ignore[arg-type]


def in_proportion(found: Found) -> Check | None:
    """Compare an elastic wall with its own elastic equations: it moves in proportion to the ground."""
    if found.run is not None:
        return None
    exact = for_full_movement(found.model)
    way = found.path[-1].displacement - found.path[0].displacement
    return Check("proportion", float(np.abs(way - exact).max() / np.abs(exact).max()))


def for_full_movement(model: Model) -> FloatArray:
    """Return the displacement (n, 3) (m, rad) of an elastic wall's blocks on moving ground, by a direct solution."""
    face, law, ground = model.interfaces, model.properties, model.ground.full
    here = slice(len(face.x) - len(ground.normal), None)
    # the prescribed displacement of the ground acts as an imposed opening of its joints
    pull = -law.normal_stiffness[here, None] * ground.normal * face.contact_area[here]
    drag = (-law.shear_stiffness[here, None] * ground.shear * face.contact_area[here]).sum(axis=1)
    turning, pull = (pull * face.contact_offset[here]).sum(axis=1), pull.sum(axis=1)
    force = np.zeros((model.n_bodies, 3))
    for body, arm, aside, sign in (
        (face.body_a, face.arm_normal_a, face.arm_shear_a, 1.0),
        (face.body_b, face.arm_normal_b, face.arm_shear_b, -1.0),
    ):
        x, y = face.normal_x[here], face.normal_y[here]
        moment = pull * arm[here] + drag * aside[here] + turning
        np.add.at(force, body[here], sign * np.column_stack((pull * x + drag * y, pull * y - drag * x, moment)))
    on_all = np.zeros(model.size)
    on_all[: force.size] = force.ravel()
    found = DiscreteSystem.of(model).elastic_solutions(
        on_all if model.mesh is None else transformation_matrix(model).T @ on_all
    )
    assert found is not None
    return DiscreteSystem.of(model).complete(found[0])[: 3 * model.n_blocks].reshape(-1, 3)


def sizes() -> list[Case]:
    """Return movements of every size, in one increment and in many."""
    made = []
    for kind, deflection, count in itertools.product(
        ("dishing", "doming"), (0.0, 1e-12, 1e-9, 1e-6, 1e-3, 1e-2, 0.1, 1.0), (1, 20)
    ):
        check = in_proportion if deflection >= 1e-6 else None
        ways = ("quasi-static, rigid", "explicit, rigid") if count > 1 else WAYS if kind == "dishing" else RIGID
        many = "one increment" if count == 1 else f"{count} increments"
        made += [
            Case(
                "movement",
                f"{kind} by {deflection:g} m in {many}, unbreakable",
                lambda d, k=kind, a=deflection: wall(a, k, True),
                "",
                check,
                count,
                dynamics=moved,
                ways=ways,
            ),
            Case(
                "movement",
                f"{kind} by {deflection:g} m in {many}",
                lambda d, k=kind, a=deflection: wall(a, k, False),
                increments=count,
                dynamics=moved,
                ways=ways,
            ),
        ]
    return [case for case in made if case.increments > 1 or "doming" not in case.name or "unbreakable" not in case.name]


def weightless() -> list[Case]:
    """Return walls without weight, with and without strength and a roof."""
    made = []
    for roof, joint, deflection in itertools.product(
        (0.0, 1e3),
        ({"tensile_strength": 1e15, "cohesion": 1e15}, {}, {"tensile_strength": 0.0, "cohesion": 0.0}),
        (0.0, 1e-3),
    ):
        strength = {1e15: "unbreakable", 0.0: "no bond"}.get(joint.get("tensile_strength", 1.0), "weak")
        made.append(
            Case(
                "no weight",
                f"roof {roof:g} N, {strength}, dishing by {deflection:g} m",
                lambda d, r=roof, j=joint, a=deflection: Scene(
                    wall=FOOT,
                    joint=Joint(**j),
                    block=BlockMaterial(density=0.0),
                    loads=Loads(roof=r),
                    movement=Movement(central_deflection=a),
                ),
                increments=2,
                dynamics=moved,
            )
        )
    return made


def cases() -> list[Case]:
    """Return all cases."""
    return sizes() + weightless()
