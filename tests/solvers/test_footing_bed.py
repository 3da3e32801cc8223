"""The gap between a wall without a dpc and its footing: measured, judged, and with separate properties."""

import numpy as np
import pytest

import damagepred
from damagepred.assembly import wall_model
from damagepred.damage import load_table
from damagepred.enumerations import ContactKind
from damagepred.results.rejudge import footing_gap_note
from damagepred.scene import Damage, Dpc, Footing, Joint, Movement, Scene, Solver, Wall

MM = 1e-3
BED = ContactKind.FOOTING_INTERFACE
LOOSE = Joint(tensile_strength=0.0, cohesion=0.0)
STRONG = Joint(tensile_strength=1e8, cohesion=1e8)


def stands_on(kind: str, deflection: float, joint: Joint | None = LOOSE, **more) -> Scene:
    """A wall of unbreakable mortar on ground that deforms to a parabola."""
    return Scene(
        wall=Wall(length=2.88, height=0.6),
        joint=STRONG,
        footing=Footing(joint=joint),
        movement=Movement(kind=kind, central_deflection=deflection, increments=2, shape="parabola"),
        solver=Solver(blocks="rigid"),
        **more,
    )


def test_a_wall_that_spans_a_dish_gapes_in_its_middle():
    """It rests on its two ends, where a parabola lies higher by d than in the middle; threshold of 2 mm."""
    scene = stands_on("dishing", 6 * MM, damage=Damage(footing_threshold=2 * MM))
    wall = damagepred.solve(scene)
    assert float(wall["footing_opening_max"][-1]) == pytest.approx(6 * MM, rel=0.02)
    assert float(wall["footing_separation_length"][-1]) == pytest.approx(2.88 * np.sqrt(4 / 6), rel=0.02)


@pytest.mark.parametrize(("rule", "dpc", "counts"), [(False, None, False), (True, None, True), (True, Dpc(), False)])
def test_the_gap_counts_if_set_and_without_a_dpc(rule: bool, dpc: Dpc | None, counts: bool):
    wall = damagepred.solve(stands_on("doming", 7 * MM, dpc=dpc, damage=Damage(count_footing_gap=rule)))
    gap = np.maximum(wall["footing_opening_max"].values, wall["dpc_opening_max"].values)
    assert gap[-1] > 5 * MM
    expected = load_table("as2870").by_width(gap if counts else np.zeros(3))
    assert wall["damage_category"].values.tolist() == expected.tolist()
    assert wall["damage_category_band"].values.tolist() == expected.tolist()
    assert bool(footing_gap_note(wall)) == (not rule)


def test_a_gap_that_does_not_count_is_reported():
    wall = damagepred.solve(stands_on("doming", 7 * MM))
    assert "would be category 3" in footing_gap_note(wall)
    assert "--footing-gap" in footing_gap_note(wall)


@pytest.mark.parametrize("shape", ["parabola", "jacks", "mound"])
@pytest.mark.parametrize("footing", [None, "deformable"])
def test_the_bed_has_separate_properties_on_any_support(shape: str, footing: str | None):
    if shape != "parabola" and footing is not None:
        return
    own = Joint(tensile_strength=0.1e6, cohesion=0.2e6, friction=0.6, normal_stiffness=50e9)
    movement = Movement(shape=shape)
    solver = Solver(footing=footing)
    scene = Scene(wall=Wall(length=2.88, height=0.6), footing=Footing(joint=own), movement=movement, solver=solver)
    model = wall_model(scene)
    bed = model.interfaces.kind == BED
    assert bed.any()
    for name in ("tensile_strength", "cohesion", "friction"):
        values = getattr(model.properties, name)
        assert (values[bed] == getattr(own, name)).all()
        assert (values[~bed & (model.interfaces.kind <= 1)] == getattr(Joint(), name)).all()
