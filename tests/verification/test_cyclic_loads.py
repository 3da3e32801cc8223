"""Cycles of a load: a thin brick in shear between level plates is an elastic and perfectly plastic spring (Coulomb)."""

from dataclasses import replace

import numpy as np
import pytest

from damagepred import InputError, Joint, Loads, Movement, Scene, Solver, Wall, solve
from damagepred.scene import BlockMaterial, Creep, Load, Loading, Stage, Strain
from damagepred.uq.intensity import intensity_values

LENGTH, HEIGHT, THICKNESS, FRICTION, ROOF = 0.3, 0.002, 0.11, 0.5, 10e3
LAW = Joint(tensile_strength=0.0, cohesion=0.0, friction=FRICTION)
LIMIT = FRICTION * ROOF
TARGET = 3.7 * 2.0 * LIMIT / (LAW.shear_stiffness * LENGTH * THICKNESS)


def stages(*factors: float, increments: int = 20) -> Movement:
    return Movement(shape="loads", stage=[Stage(load_factor=f, increments=increments) for f in factors])


def brick(movement: Movement, method: str = "quasi_static", **loading: object) -> Scene:
    """Return a brick between two beds, the upper of which carries the roof and slides first."""
    return Scene(
        wall=Wall(length=LENGTH, height=HEIGHT, thickness=THICKNESS, block_length=LENGTH, block_height=HEIGHT),
        block=BlockMaterial(density=2000.0),
        joint=LAW,
        loads=Loads(roof=ROOF),
        movement=movement,
        load=(Load(direction="along"),),
        loading=Loading(beam="level", **loading),
        solver=Solver(method=method, lump_block_elasticity=False),
    )


def stiffness() -> float:
    """Return that of both beds in shear, and of the brick that turns between them (N/m)."""
    shear, turning = LAW.shear_stiffness * LENGTH * THICKNESS, LAW.normal_stiffness * THICKNESS * LENGTH**3 / 12.0
    return 1.0 / (2.0 / shear + HEIGHT**2 / (2.0 * turning))


def test_load_and_dissipation_in_cycles_are_those_of_an_elastic_plastic_spring() -> None:
    ds = solve(brick(stages(0.5, -0.5, 1.0, -1.0, 0.0), control="displacement", displacement=TARGET))
    moved, force, slid = ds["load_displacement"].values, [0.0], [0.0]
    for step in np.diff(moved):
        trial = force[-1] + stiffness() * step
        force.append(float(np.clip(trial, -LIMIT, LIMIT)))
        slid.append(slid[-1] + abs(trial - force[-1]) / stiffness() * LIMIT)
    assert moved[[20, 40, 60, 80, 100]] == pytest.approx(TARGET * np.array([0.5, -0.5, 1.0, -1.0, 0.0]), abs=1e-9)
    np.testing.assert_allclose(ds["load_force"], force, rtol=0, atol=1e-4 * LIMIT)
    np.testing.assert_allclose(ds["friction_work"], slid, rtol=0, atol=1e-3 * slid[-1])
    assert ds.attrs["status"] == "complete"


@pytest.mark.parametrize("method", ["quasi_static", "explicit"])
def test_a_load_that_turns_round_ends_at_the_limit_of_the_other_side(method: str) -> None:
    force = 1.25 * LIMIT
    ds = solve(brick(stages(0.7, -1.0, increments=6), method, control="force", force=force))
    assert ds.attrs["status"] == "collapsed"
    assert ds.attrs["collapse_progress"] == pytest.approx(-LIMIT / force, abs=2e-3)
    assert ds["load_force"].values[6] == pytest.approx(0.7 * force)
    elastic = ds["load_displacement"].values[:10] * stiffness()
    np.testing.assert_allclose(elastic, ds["load_force"].values[:10], rtol=0, atol=2e-3 * LIMIT)


def test_a_growing_load_cut_into_stages_is_the_one_run() -> None:
    loading = {"control": "displacement", "displacement": TARGET}
    one = solve(brick(Movement(shape="loads", increments=8), **loading))
    cut = solve(brick(stages(0.5, 1.0, increments=4), **loading))
    for name in ("load_force", "load_displacement", "contact_slip"):
        np.testing.assert_allclose(cut[name], one[name], rtol=1e-6, atol=1e-9)


def test_a_study_counts_displacements_of_both_sides() -> None:
    ds = solve(brick(stages(0.5, -1.0, increments=2), control="displacement", displacement=TARGET))
    found = intensity_values(ds.expand_dims("sample"), "load_displacement")
    assert found[0, -1] == pytest.approx(TARGET, rel=1e-6)


@pytest.mark.parametrize(
    ("movement", "said"),
    [
        ({"stage": [{"central_deflection": 1e-3}]}, "each stage has a load_factor, and no central_deflection"),
        ({"stage": [{"load_factor": 0.5}]}, "largest load_factor of all stages must be 1 or -1; it is 0.5"),
        ({"stage": [{"load_factor": 2}]}, r"load_factor = 2: must be at most 1"),
        ({"seasons": {"years": 1, "swing": 1e-3}}, "seasons: a test under loads has none"),
    ],
)
def test_wrong_stages_of_a_test_are_named(movement: dict, said: str) -> None:
    tables = brick(stages(1.0), control="force", force=1e3).to_dict()
    with pytest.raises(InputError, match=said):
        Scene.from_dict({**tables, "movement": {"shape": "loads", **movement}})


def test_a_test_in_stages_has_no_strain_and_creep() -> None:
    timed = Movement(shape="loads", stage=[Stage(load_factor=1.0, time=1.0)])
    scene = brick(timed, control="force", force=1e3)
    for more in ({"strain": Strain(growth=1e-4)}, {"creep": Creep(relaxation_time=1.0)}):
        with pytest.raises(InputError, match="a test in stages has none"):
            replace(scene, **more)
    with pytest.raises(
        InputError, match="each stage has a central_deflection, and no surface_movement or settlement or load_factor"
    ):
        Movement(stage=[Stage(load_factor=1.0)])
