"""Bonds that soften by slip: the shear box, and walls in both solvers."""

from dataclasses import replace

import pytest

from damagepred.assembly import wall_model
from damagepred.scene import Joint, Scene, Wall

SHEAR_ENERGY = 100.0
WEARS = Joint(fracture_energy=10.0, shear_fracture_energy=SHEAR_ENERGY, residual_cohesion=0.05e6, residual_friction=0.6)


@pytest.mark.parametrize("shear_energy", [None, SHEAR_ENERGY])
def test_joints_too_soft_to_soften_in_tension_are_counted(shear_energy: float | None) -> None:
    little = Joint(fracture_energy=0.1, shear_fracture_energy=shear_energy)
    model = wall_model(Scene(wall=Wall(length=1.2, height=0.3), joint=little))
    assert not model.properties.critical_opening.any()
    assert not model.properties.critical_slip.any()
    assert model.snap_back_limited == len(model.joints.kind)
    assert wall_model(Scene(wall=Wall(length=1.2, height=0.3))).snap_back_limited == 0


@pytest.mark.parametrize(
    "wrong", [{"fracture_energy": None}, {"dilation": 0.1}, {"brittle_shear": True}], ids=lambda w: next(iter(w))
)
def test_incompatible_settings_are_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(ValueError, match="shear_fracture_energy"):
        replace(WEARS, **wrong)
