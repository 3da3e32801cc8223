"""Strains of the bricks against closed forms: free and restrained bars, a column, and a bar on elastic ground."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from damagepred import Footing, InputError, Joint, Movement, Scene, Solver, Wall, scene, solve
from damagepred.scene import BlockMaterial, Loads, Strain

GROWTH = 0.5e-3
LOOSE = Joint(shear_stiffness=1e6, tensile_strength=0.0, cohesion=0.0, friction=0.75)
STRONG = Joint(tensile_strength=1e10, cohesion=1e10)


def bar(bed: Joint, blocks: str, length: float = 6.0, **changed: object) -> Scene:
    """Return a wall of one course on a bed, whose bricks grow on a ground that stays."""
    return Scene(
        wall=Wall(length=length, height=0.1, block_length=0.2, block_height=0.1),
        block=BlockMaterial(poisson_ratio=0.0),
        joint=STRONG,
        footing=Footing(joint=bed),
        movement=Movement(central_deflection=0.0, increments=2),
        strain=Strain(growth=GROWTH),
        solver=Solver(blocks=blocks, **changed),
    )


@pytest.mark.parametrize("blocks", ["rigid", "elastic", "deformable"])
def test_a_free_bar_grows_by_its_strain(blocks: str) -> None:
    """Ends part by strain times length, and no stress comes of it."""
    found = solve(bar(LOOSE, blocks))
    x, moved = found["block_x"].values, found["block_displacement_x"].values[-1]
    stretch = np.polyfit(x, moved, 1)[0]
    assert stretch == pytest.approx(GROWTH, rel=0.01)
    assert np.abs(found["contact_normal_stress"].values[-1]).max() < 0.02 * GROWTH * 9e9


def test_a_column_rises_and_stays_free_of_stress() -> None:
    """A stack on level ground rises; the weight alone presses on its beds."""
    column = Scene(
        wall=Wall(length=0.3, height=1.2, block_length=0.3, block_height=0.1, bond="stack"),
        footing=Footing(joint=replace(LOOSE, friction=0.0)),
        movement=Movement(central_deflection=0.0, increments=1),
        strain=Strain(growth=GROWTH),
    )
    found = solve(column)
    rise = found["block_displacement_y"].values[-1] - found["block_displacement_y"].values[0]
    assert rise == pytest.approx(GROWTH * found["block_y"].values, rel=1e-6)
    stress = found["contact_normal_stress"].values
    assert stress[-1] == pytest.approx(stress[0], abs=1.0)


def test_shrinkage_cracks_a_wall_that_is_held() -> None:
    """Bricks that shrink between stiff ground and bond crack the wall; growth of the same size presses it."""
    wall = Wall(length=6.0, height=1.2)
    movement = Movement(central_deflection=0.0, increments=6)
    joint = Joint(fracture_energy=10.0)
    loads = Loads(roof="10 kN")
    held = Scene(wall=wall, joint=joint, movement=movement, loads=loads)
    widths = {}
    for growth in (-0.6e-3, 0.6e-3):
        found = solve(replace(held, strain=Strain(growth=growth)))
        widths[growth] = found["crack_width_max"].values[-1]
        error = np.abs(found["energy_error"].values[-1])
        assert error < 0.02 * max(found["external_work"].values[-1], 1.0)
    assert widths[-0.6e-3] > 3.0 * max(widths[0.6e-3], 1e-5)


def test_temperature_adds_to_growth() -> None:
    """Warmth is a strain, too; a strain of nothing changes nothing."""
    plain = bar(LOOSE, "rigid")
    warm = solve(replace(plain, strain=Strain(temperature_change=50.0, growth=0.1e-3)))
    grown = solve(plain)
    np.testing.assert_allclose(warm["block_displacement_x"].values, grown["block_displacement_x"].values, atol=1e-12)
    without, nothing = (
        solve(replace(plain, strain=strain, movement=Movement(central_deflection="2 mm", increments=2)))
        for strain in (None, Strain())
    )
    np.testing.assert_allclose(nothing["contact_opening"].values, without["contact_opening"].values, atol=1e-9)


def test_strains_in_time_are_refused() -> None:
    """A run in time has no slow strains."""
    with pytest.raises(InputError, match="a run in time has none"):
        Scene(strain=Strain(growth=GROWTH), dynamics=scene.Dynamics())
