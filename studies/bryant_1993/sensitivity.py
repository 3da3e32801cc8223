"""Sensitivity of the limits: one parameter changed at a time, on jacks."""

from __future__ import annotations

import csv
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from cases import HERE, MESH, NAMES, bent_before, on_jacks, read_case, virgin
from measures import Dpc
from solving import earlier_moment, solve
from table import MM, number

from damagepred.assembly import footing_alone
from damagepred.scene import Joint, Scene
from damagepred.scene.concrete import ReinforcedConcrete
from damagepred.solvers import solve_path
from studies.pages import put_in

GRAVITY = 9.81
FLEXURAL = 2.06
"""Flexural over direct tensile bond (Gooch 2023; data/statistics/masonry.toml)."""
UNIT_MODULUS = 16.7e9
"""Modulus of the bricks (Pa) that, with the paper's joints, makes brickwork of about 9000 MPa along the wall."""
SHEET = Joint(tensile_strength=0.0, cohesion=0.0, friction=0.5)
"""The paper's dpc as the bed between footing and first course."""


@dataclass(frozen=True)
class Variant:
    """A changed parameter of the scene on jacks with an elastic footing."""

    name: str
    change: Callable[[Scene], Scene]


def footing(**values: Any) -> Callable[[Scene], Scene]:
    """Return a change of the footing."""
    return lambda scene: replace(scene, footing=replace(scene.footing, **values))


def joint(**factors: float) -> Callable[[Scene], Scene]:
    """Return a change of the mortar by factors."""
    return lambda s: replace(s, joint=replace(s.joint, **{k: getattr(s.joint, k) * f for k, f in factors.items()}))


def bed(factor: float) -> Callable[[Scene], Scene]:
    """Return a change of the stiffness of the bed between footing and first course, by a factor."""
    return lambda s: footing(
        joint=replace(
            s.joint,
            normal_stiffness=factor * s.joint.normal_stiffness,
            shear_stiffness=factor * s.joint.shear_stiffness,
        )
    )(s)


def unbreakable(scene: Scene) -> Scene:
    """Return a wall whose mortar does not break."""
    return joint(tensile_strength=100.0, cohesion=100.0)(scene)


def stiff_bricks(scene: Scene) -> Scene:
    """Return a wall with bricks of a modulus that gives brickwork, with its joints, about 9000 MPa."""
    return replace(scene, block=replace(scene.block, elastic_modulus=UNIT_MODULUS))


def variants(bent: float) -> list[Variant]:
    """Return all variants; ``bent`` is the earlier moment in the footing (Nm)."""
    before = bent_before(bent)
    found = [
        Variant("as the paper: elastic, 7000 MPa", lambda s: s),
        Variant("elastic, 1900 MPa (fully cracked)", footing(elastic_modulus=1.9e9)),
        Variant("elastic, 25 000 MPa (gross section)", footing(elastic_modulus=25e9)),
        Variant("bed on the footing 100 times softer", bed(0.01)),
        Variant("bed on the footing 10 times softer", bed(0.1)),
        Variant("bed on the footing 10 times stiffer", bed(10.0)),
        Variant("sheet (a second dpc) on the footing: no composite action", footing(joint=SHEET)),
        Variant("sheet on the footing, 1900 MPa", footing(joint=SHEET, elastic_modulus=1.9e9)),
        Variant("friction of the dpc 0.3", lambda s: s.with_values({"dpc.friction": 0.3})),
        Variant("friction of the dpc 0.7", lambda s: s.with_values({"dpc.friction": 0.7})),
        Variant(
            f"mortar {FLEXURAL} times as strong (flexural bond)", joint(tensile_strength=FLEXURAL, cohesion=FLEXURAL)
        ),
        Variant("mortar that does not break", unbreakable),
        Variant("bricks of 16 700 MPa (joints' compliance counted once)", stiff_bricks),
        Variant(
            f"such bricks, mortar {FLEXURAL} times as strong",
            lambda s: joint(tensile_strength=FLEXURAL, cohesion=FLEXURAL)(stiff_bricks(s)),
        ),
    ]
    for law in ("cracked", "branson"):
        concrete = ReinforcedConcrete(law=law, bottom=MESH)  # type: ignore[arg-type]
        found.append(Variant(f"new, law {law}, {MESH}", footing(concrete=concrete)))
    found += [
        Variant(f"bent before by {bent / 1e3:.1f} kNm, {mesh}", footing(concrete=replace(before, bottom=mesh)))
        for mesh in ("3-L8TM", "3-L11TM", "3-L12TM")
    ]
    return [
        *found,
        Variant("bent before, tension stiffening 1", footing(concrete=replace(before, tension_stiffening=1.0))),
        Variant("bent before, sheet on the footing", footing(concrete=before, joint=SHEET)),
        Variant("bent before, mortar that does not break", lambda s: unbreakable(footing(concrete=before)(s))),
    ]


def row(variant: Variant, names: tuple[str, ...] = NAMES) -> list[str]:
    """Return the row of a variant: for each wall its limit (mm) and the measured quantity there (mm)."""
    cells = []
    for name in names:
        case = read_case(name)
        ds = solve(variant.change(on_jacks(case.scene)), f"{name}, {variant.name}")
        limit = ds.attrs.get("limit_deflection")
        dpc = Dpc.of(ds, -1)
        if case.has_window:
            seen = float(ds["opening_width_change"][-1, 0])
        else:
            seen = float(dpc.opening.max()) if name == "dishing" else max(dpc.end_gaps)
        cells += [number(MM * limit) if limit is not None else f"> {MM * case.deflection:g}", number(MM * seen)]
    return [variant.name, *cells]


def alone(line_load: Callable[[Scene], float], concrete: ReinforcedConcrete | None = None) -> list[str]:
    """Return the limits (mm) of the footing alone under a dead load (N/m)."""
    found = []
    for name in ("dishing", "doming"):
        scene = on_jacks(read_case(name).scene, concrete)
        scene = replace(scene, movement=replace(scene.movement, central_deflection=30e-3))
        last = list(solve_path(footing_alone(scene, line_load(scene)), scene.solver, 40))[-1]
        found.append(number(MM * abs(last.footing.deflection)) if last.end.unloaded else "> 30")
    return found


def courses_below(scene: Scene) -> float:
    """Return the weight of the courses below the dpc (N/m)."""
    assert scene.dpc is not None
    wall = scene.wall
    return scene.dpc.course * wall.block_height * wall.thickness * scene.block.density * GRAVITY


def whole_wall(scene: Scene) -> float:
    """Return the weight of wall and roof as a uniform load (N/m)."""
    wall = scene.wall
    return wall.height * wall.thickness * scene.block.density * GRAVITY + scene.loads.roof / wall.length


HEAD = [
    "changed",
    "dishing: limit",
    "dpc open there",
    "doming: limit",
    "ends open there",
    "window, dishing: limit",
    "width there",
    "window, doming: limit",
    "width there",
]


def write_sensitivity() -> None:
    """Solve all variants, write sensitivity.csv and the tables of the page."""
    bent = earlier_moment(read_case("dishing"))
    found = [row(v) for v in variants(bent)]
    lines = ["| " + " | ".join(HEAD) + " |", "|---" * len(HEAD) + "|"] + ["| " + " | ".join(r) + " |" for r in found]
    with (HERE / "sensitivity.csv").open("w", newline="", encoding="utf-8") as stream:
        csv.writer(stream, lineterminator="\n").writerows([HEAD, *found])
    rows: list[list[str]] = []
    for what, load in (("two courses below the dpc", courses_below), ("wall and roof, evenly", whole_wall)):
        for name, concrete in (
            ("elastic, 7000 MPa", None),
            (f"new, {MESH}", virgin()),
            ("bent before", bent_before(bent)),
        ):
            rows.append([f"{what}; {name}", *alone(load, concrete)])
    lines += ["", "| footing alone, carrying | dishing: limit | doming: limit |", "|---|---|---|"]
    lines += ["| " + " | ".join(r) + " |" for r in rows]
    print("\n".join(lines))
    put_in(HERE / "README.md", "\n".join(lines), "<!-- sensitivity -->", "<!-- end of sensitivity -->")
