"""Strains of the bricks and creep of the joints along histories, against closed forms and between the solvers."""

from dataclasses import asdict, replace

import numpy as np
import pytest

from damagepred import Footing, InputError, Joint, Movement, Scene, Solver, Wall, solve
from damagepred.scene import BlockMaterial, Creep, Dpc, Loads, Seasons, Stage, Strain
from tests.solvers.test_histories import energy_balance

LOOSE = Joint(shear_stiffness=1e6, tensile_strength=0.0, cohesion=0.0, friction=0.75)
STRONG = Joint(tensile_strength=1e10, cohesion=1e10)
HELD = replace(STRONG, shear_stiffness=1e15)
SOLVERS = ("quasi_static", "explicit")
PHI, TAU = 1.5, 2.0
GROWTH = 0.5e-3


def stage(deflection: float = 0, strain: float | None = None, time: float | None = None, increments: int = 2) -> Stage:
    return Stage(central_deflection=deflection, strain=strain, time=time, increments=increments)


def history(*stages: Stage) -> Movement:
    return Movement(stage=stages, central_deflection=max(s.central_deflection or 0.0 for s in stages))


def bar(bed: Joint, movement: Movement, length: float = 2.0, **changed: object) -> Scene:
    settings = {"blocks": "rigid", "lump_block_elasticity": False, **changed}
    return Scene(
        wall=Wall(length=length, height=0.1, block_length=0.2, block_height=0.1),
        block=BlockMaterial(poisson_ratio=0.0),
        joint=STRONG,
        footing=Footing(joint=bed),
        movement=movement,
        solver=Solver(**settings),
    )


@pytest.mark.quick_cases("method")
@pytest.mark.parametrize("method", SOLVERS)
@pytest.mark.parametrize("blocks", ["rigid", "elastic", "deformable"])
def test_a_free_bar_grows_shrinks_and_grows_again(blocks: str, method: str) -> None:
    """Its length follows the strain of each stage, and no stress remains."""
    stages = stage(strain=4e-4), stage(strain=-2e-4), stage(strain=5e-4)
    ds = solve(bar(LOOSE, history(*stages), blocks=blocks, method=method))
    x, moved = ds["block_x"].values, ds["block_displacement_x"].values
    stretch = [np.polyfit(x, u, 1)[0] for u in moved]
    assert stretch == pytest.approx([0.0, 2e-4, 4e-4, 1e-4, -2e-4, 1.5e-4, 5e-4], abs=2e-6)
    assert np.abs(ds["contact_normal_stress"].values[-1]).max() < 1e-3 * 5e-4 * 9e9


@pytest.mark.parametrize("method", SOLVERS)
def test_a_restrained_bar_is_pressed_by_the_strain_of_each_stage(method: str) -> None:
    stages = stage(strain=4e-4), stage(strain=1e-4), stage(strain=-3e-4)
    ds = solve(bar(HELD, history(*stages), length=4.0, method=method))
    head = (ds["contact_kind"].values == 1) & (np.abs(ds["contact_x"].values - 2.0) < 0.5)
    found = ds["contact_normal_stress"].values[[2, 4, 6]][:, head]
    modulus = Scene().joint.normal_stiffness * 0.2
    assert found == pytest.approx(-modulus * np.repeat([[4e-4], [1e-4], [-3e-4]], head.sum(), axis=1), rel=1e-4)


def test_a_bar_on_an_elastic_bed_follows_volkersen_after_several_stages() -> None:
    length, bed_shear, strain = 6.0, 5e8, 3e-4
    stages = stage(strain=5e-4), stage(strain=-1e-4), stage(strain=strain)
    ds = solve(bar(replace(STRONG, shear_stiffness=bed_shear), history(*stages), length=length))
    x, moved = ds["block_x"].values - length / 2.0, ds["block_displacement_x"].values[-1]
    rate = np.sqrt(bed_shear / (Scene().joint.normal_stiffness * 0.2 * 0.1))
    expected = strain * np.sinh(rate * x) / (rate * np.cosh(rate * length / 2.0))
    assert moved == pytest.approx(expected, abs=0.01 * np.abs(expected).max())


@pytest.mark.parametrize("joint", [{}, {"tensile_strength": 0.0, "cohesion": 0.0}], ids=["bonded", "dry"])
def test_a_strain_beside_one_growing_movement_is_the_one_run(joint: dict[str, float]) -> None:
    """Cut into stages, with the strain in proportion, it is the movement with its strain."""
    wall = Scene(wall=Wall(length=1.92, height=0.6), dpc=Dpc(course=2), joint=Joint(**joint))
    one = replace(wall, movement=Movement(central_deflection=4e-3, increments=8), strain=Strain(growth=4e-4))
    stages = stage(1e-3, 1e-4, increments=2), stage(3e-3, 3e-4, increments=4), stage(4e-3, 4e-4, increments=2)
    whole, cut = solve(one), solve(replace(wall, movement=history(*stages)))
    for name in ("block_displacement_x", "block_displacement_y", "contact_opening", "contact_slip", "progress"):
        np.testing.assert_allclose(cut[name], whole[name], rtol=0, atol=0.1e-6)


FOOTINGS = {
    "no footing": {"movement": {"central_deflection": 4e-3}},
    "jacks": {"movement": {"shape": "jacks", "central_deflection": 4e-4}, "rig": {"stop_at_zero": False}},
    "deformable": {"movement": {"central_deflection": 1e-3}, "solver": {"footing": "deformable"}},
}


def on_footing(footing: str, *stages: Stage, bricks: float = 0.24, **options: object) -> Scene:
    """Return a small wall on a footing; stages have multiples of the full movement."""
    tables = FOOTINGS[footing]
    full = tables["movement"]["central_deflection"]
    moved = [{**asdict(s), "central_deflection": s.central_deflection * full} for s in stages]
    return Scene.from_dict(
        {
            "wall": {"length": 8 * bricks, "height": 0.3, "block_length": bricks},
            "dpc": {"course": 2},
            **tables,
            "movement": {**tables["movement"], "stage": moved},
            "solver": {**tables.get("solver", {}), **options},
        }
    )


@pytest.mark.parametrize("footing", FOOTINGS)
def test_a_strain_of_nothing_leaves_a_history_as_it_is(footing: str) -> None:
    there_and_back = stage(1.0, increments=4), stage(0.0), stage(0.75)
    none = replace(there_and_back[0], strain=1e-15), *there_and_back[1:]
    one = solve(on_footing(footing, *there_and_back, symmetric_half=False, condense=False))
    other = solve(on_footing(footing, *none))
    for name in ("block_displacement_y", "dpc_opening_max", "progress", "central_deflection"):  # no drift
        np.testing.assert_allclose(other[name], one[name], rtol=0, atol=2e-6)


@pytest.mark.thorough
@pytest.mark.parametrize(("blocks", "course"), [("rigid", 2), ("elastic", 1)])
def test_both_solvers_agree_on_a_wall_that_grows_through_the_seasons(blocks, course) -> None:
    """A course of elastic bricks below the dpc breaks off the footing, and then lies loose."""
    wall = Scene(
        wall=Wall(length=1.92, height=0.6),
        dpc=Dpc(course=course),
        movement=history(stage(4e-3, time=0.5), stage(1e-3, time=1), stage(4e-3, time=1.5)),
        strain=Strain(growth=0.5e-3, temperature_swing=20.0),
        creep=Creep(relaxation_time=1.0),
    )
    one, other = (solve(replace(wall, solver=Solver(method=method, blocks=blocks))) for method in SOLVERS)
    np.testing.assert_allclose(other["dpc_opening_max"], one["dpc_opening_max"], rtol=0, atol=0.03e-3)
    error = one["energy_error"].values
    for name in ("friction_work", "fracture_work", "released_energy"):
        assert (np.diff(one[name]) >= -np.diff(error) - 1e-9).all()


@pytest.mark.parametrize("footing", ["jacks", "deformable"])
def test_both_solvers_agree_on_a_footing_under_bricks_with_strain_and_creep(footing: str) -> None:
    scene = on_footing(footing, *(stage(f, time=t, increments=1) for f, t in ((1.0, 0.5), (0.0, 1.0), (0.5, 1.5))))
    scene = replace(scene, strain=Strain(growth=5e-4, temperature_swing=20.0), creep=Creep(relaxation_time=1.0))
    one, other = (solve(replace(scene, solver=replace(scene.solver, method=method))) for method in SOLVERS)
    assert one["progress"].values[1:].tolist() == [1.0, 0.0, 0.5]
    largest = one["dpc_opening_max"].values.max()
    np.testing.assert_allclose(other["dpc_opening_max"], one["dpc_opening_max"], rtol=0, atol=0.015 * largest)
    np.testing.assert_allclose(other["central_deflection"], one["central_deflection"], rtol=0, atol=2e-6)
    energy_balance(one)


@pytest.mark.quick_cases
@pytest.mark.parametrize("shape", ["mitchell", "walsh"])
def test_both_solvers_agree_on_soil_with_strain_and_creep(shape: str) -> None:
    size = 20e-3
    stages = [
        {"kind": "dishing", "surface_movement": share * size, "increments": 2, "time": time}
        for share, time in ((1.0, 0.5), (0.0, 1.0), (0.5, 1.5))
    ]
    tables = (
        {"wall": {"length": 1.92, "height": 0.6}, "dpc": {"course": 2}, "footing": {"width": 0.3, "depth": 0.3}}
        | {"movement": {"shape": "mound", "stage": stages}, "mound": {"shape": shape, "surface_movement": size}}
        | {"strain": {"growth": 5e-4, "temperature_swing": 20}, "creep": {"relaxation_time": 1.0}}
    )
    one, other = (solve(Scene.from_dict({**tables, "solver": {"method": method}})) for method in SOLVERS)
    assert one["progress"].values[[2, 4, 6]].tolist() == [1.0, 0.0, 0.5]
    for name in ("dpc_opening_max", "central_deflection"):
        np.testing.assert_allclose(other[name], one[name], rtol=0, atol=2e-6)


def test_the_course_of_growth_and_temperature() -> None:
    time = np.array([0.0, 0.5, 1.0, 4.0, 30.0])
    clay = Strain(growth=7e-4, growth_years=15, growth_time=2).over(time)
    assert clay == pytest.approx(7e-4 * np.log(1 + time / 2) / np.log(1 + 15 / 2), rel=1e-12)
    shrinks = Strain(growth=-3e-4, growth_law="exponential", growth_years=10, growth_time=2).over(time)
    assert shrinks == pytest.approx(-3e-4 * (1 - np.exp(-time / 2)) / (1 - np.exp(-5)), rel=1e-12)
    warm = Strain(temperature_change=3, temperature_swing=20, warmest=0.5).over(time)
    assert warm == pytest.approx(8e-6 * (3 * time / 30 + np.array([0, 20, 0, 0, 0])), abs=1e-18)


def test_seasons_have_a_strain_at_each_increment() -> None:
    wall = Scene(movement=Movement(seasons=Seasons(years=2, increments=3)), strain=Strain(growth=7e-4))
    found = wall.strain_of_increments
    assert len(found) == 13
    assert found[6] == pytest.approx(7e-4 * np.log(2) / np.log(16))
    other = wall.with_values({"strain.growth": 3.5e-4, "strain.growth_time": 1.0})
    assert other.strain_of_increments == pytest.approx(0.5 * found)


@pytest.mark.parametrize("method", SOLVERS)
@pytest.mark.parametrize("lumped", [False, True], ids=["stiff bricks", "lumped bricks"])
def test_stress_in_a_restrained_bar_relaxes(lumped: bool, method: str) -> None:
    """Standard linear solid: 1 / (1 + phi) of the stress remains, and the rest decays with e^(-t/tau)."""
    stages = stage(strain=5e-4, time=1e-6, increments=1), stage(strain=5e-4, time=3.0, increments=6)
    wall = bar(HELD, history(*stages), length=4.0, method=method, lump_block_elasticity=lumped)
    ds = solve(replace(wall, creep=Creep(coefficient=PHI, relaxation_time=TAU)))
    head = (ds["contact_kind"].values == 1) & (np.abs(ds["contact_x"].values - 2.0) < 0.5)
    joint, brick = 1.0 / (Scene().joint.normal_stiffness * 0.2), 1.0 / 9e9 if lumped else 0.0
    phi = PHI * joint / (joint + brick)  # bricks do not creep
    rate = (1.0 + phi) / (TAU * (1.0 + PHI))
    left = (1.0 + phi * np.exp(-rate * ds["time"].values[1:])) / (1.0 + phi)
    found = ds["contact_normal_stress"].values[1:, head].mean(axis=1)
    assert found == pytest.approx(-5e-4 / (joint + brick) * left, rel=2e-6)


def column(creep: Creep | None, movement: Movement, **options: object) -> Scene:
    return Scene(
        wall=Wall(length=0.3, height=1.2, block_length=0.3, block_height=0.1, bond="stack"),
        footing=Footing(joint=LOOSE),
        movement=movement,
        creep=creep,
        solver=Solver(lump_block_elasticity=False, **options),
    )


def test_a_column_creeps_under_its_weight() -> None:
    """Its top sinks by 1 + phi (1 - e^(-t / (tau (1 + phi)))) of the elastic one, with an error of second order."""
    creep, error = Creep(coefficient=PHI, relaxation_time=TAU), []
    for longest in (0.25, 0.125):
        advanced = {"creep": {"longest_step": longest}}
        ds = solve(column(creep, history(stage(time=10.0, increments=5)), advanced=advanced))
        sunk = ds["block_displacement_y"].values[:, -1] / ds["block_displacement_y"].values[0, -1]
        expected = 1.0 + PHI * (1.0 - np.exp(-ds["time"].values / (TAU * (1.0 + PHI))))
        error.append(np.abs(sunk - expected).max())
    assert error[0] < 0.004 * (1.0 + PHI)
    assert np.log2(error[0] / error[1]) == pytest.approx(2.0, abs=0.05)


@pytest.mark.parametrize("method", SOLVERS)
def test_creep_without_time_is_a_softer_joint(method: str) -> None:
    still = Movement(central_deflection=0.0, increments=1)
    sunk = [
        solve(column(creep, still, method=method))["block_displacement_y"].values[0, -1]
        for creep in (None, Creep(coefficient=PHI))
    ]
    assert sunk[1] == pytest.approx((1.0 + PHI) * sunk[0], rel=1e-6)


def test_creep_of_nothing_leaves_a_history_as_it_is() -> None:
    wall = column(None, history(stage(1e-4, time=1.0), stage(0.0, time=2.0)))
    one, other = solve(wall), solve(replace(wall, creep=Creep(coefficient=0.0, relaxation_time=1.0)))
    np.testing.assert_allclose(other["block_displacement_y"], one["block_displacement_y"], rtol=0, atol=1e-9)


def test_a_column_rises_and_stays_free_of_stress() -> None:
    """A stack on level ground rises; the weight alone presses on its beds."""
    stands = column(None, Movement(central_deflection=0.0, increments=1))
    slippery = Footing(joint=replace(LOOSE, friction=0.0))
    found = solve(replace(stands, footing=slippery, strain=Strain(growth=GROWTH), solver=Solver()))
    rise = found["block_displacement_y"].values[-1] - found["block_displacement_y"].values[0]
    assert rise == pytest.approx(GROWTH * found["block_y"].values, rel=1e-6)
    stress = found["contact_normal_stress"].values
    assert stress[-1] == pytest.approx(stress[0], abs=1.0)


def test_shrinkage_cracks_a_wall_that_is_held() -> None:
    """Bricks that shrink between stiff ground and bond crack the wall; growth of the same size presses it."""
    wall = Wall(length=6.0, height=1.2, block_length=0.48, block_height=0.15)
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
    plain = replace(bar(LOOSE, Movement(central_deflection=0.0, increments=2)), strain=Strain(growth=GROWTH))
    warm = solve(replace(plain, strain=Strain(temperature_change=50.0, growth=0.1e-3)))
    grown = solve(plain)
    np.testing.assert_allclose(warm["block_displacement_x"].values, grown["block_displacement_x"].values, atol=1e-12)
    without, nothing = (
        solve(replace(plain, strain=strain, movement=Movement(central_deflection="2 mm", increments=2)))
        for strain in (None, Strain())
    )
    np.testing.assert_allclose(nothing["contact_opening"].values, without["contact_opening"].values, atol=1e-9)


TIMED = {"seasons": {"years": 1, "swing": 0.002}}


@pytest.mark.parametrize(
    ("tables", "said"),
    [
        (
            {"strain": {"growth": 1e-4}, "movement": {"stage": [{"central_deflection": 8e-3}]}},
            "each stage needs a time",
        ),
        ({"strain": {"temperature_swing": 20}}, "temperature_swing: needs a history"),
        ({"strain": {"growth": 1e-4}, "dynamics": {}}, "a run in time has no strain"),
        ({"creep": {"relaxation_time": 1}}, "creep.relaxation_time: needs a history"),
        ({"creep": {"coefficient": -1}}, r"\[creep\] coefficient = -1.0: must be at least 0"),
        ({"movement": {"central_deflection": 0, "stage": [{"central_deflection": 0}]}}, "nothing moves"),
        ({"strain": {"growth": 1e-4, "growth_law": "linear"}, "movement": TIMED}, "growth_law = 'linear': must be"),
    ],
)
def test_wrong_strains_and_creep_are_named(tables: dict, said: str) -> None:
    with pytest.raises(InputError, match=said):
        Scene.from_dict(tables)
