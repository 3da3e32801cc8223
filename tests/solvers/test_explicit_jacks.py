"""Footings on jacks and on the ground in the explicit solver: its path is the quasi-static one."""

from dataclasses import replace

import numpy as np
import pytest

import damagepred
from damagepred import Dpc, Dynamics, Footing, Joint, Loads, Mound
from damagepred.assembly import Model, wall_model
from damagepred.assembly.section import SectionMemory
from damagepred.enumerations import ContactKind
from damagepred.errors import InputError
from damagepred.one_wall.judged_path import dynamic_run
from damagepred.scene import Movement, Opening, Rig, Scene, Soil, Solver, Wall
from damagepred.scene.concrete import ReinforcedConcrete
from damagepred.solvers import Increment, solve_path
from damagepred.solvers.explicit.scheme import DampedTimeStepping
from damagepred.solvers.explicit.stepper import DEFLECTION_TOLERANCE, ExplicitStepper
from damagepred.solvers.system.footing_forces import section_forces, section_response_of

WHOLE = Solver(blocks="rigid", method="explicit", symmetric_half=False)


def on_jacks(kind: str = "dishing", deflection: float = 4e-4, increments: int = 4, rig: Rig | None = None) -> Scene:
    """Return a low wall whose dpc opens before the jacks carry no load."""
    return Scene(
        wall=Wall(length=2.4, height=0.6),
        dpc=Dpc(course=2),
        footing=Footing(width=0.25, depth=0.15),
        movement=Movement(kind=kind, shape="jacks", central_deflection=deflection, increments=increments),
        loads=Loads(roof=2000.0),
        rig=rig or Rig(),
        solver=WHOLE,
    )


def path(scene: Scene, **solver: object) -> tuple[Model, list[Increment]]:
    model = wall_model(scene)
    settings = replace(scene.solver, **solver)
    return model, list(solve_path(model, settings, scene.movement.increments))


def both(scene: Scene) -> tuple[Model, list[Increment], list[Increment]]:
    """Return the model of a scene, its explicit and its quasi-static path."""
    model, explicit = path(scene)
    return model, explicit, path(scene, method="quasi_static")[1]


def dpc_opening(model: Model, increment: Increment) -> float:
    """Return the largest opening of the dpc (m)."""
    return float(increment.opening[model.interfaces.kind == ContactKind.DPC].max())


def support_loads(model: Model, increment: Increment) -> float:
    """Return the total support reaction (N, upwards)."""
    here = model.interfaces.kind == ContactKind.SUPPORT
    return -float((increment.normal_stress[here] * model.interfaces.contact_area[here]).sum())


def weight(model: Model) -> float:
    """Return the total dead load (N)."""
    return -float(model.supports.load.reshape(-1, 3)[:, 1].sum())


def agree(model: Model, explicit: list[Increment], quasi_static: list[Increment], share: float = 0.01) -> None:
    """Compare deflection, load of the jacks and opening of the dpc, increment by increment."""
    assert [i.end.unloaded for i in explicit] == [i.end.unloaded for i in quasi_static]
    most = max(abs(i.footing.deflection) for i in quasi_static)
    loads = [abs(i.footing.jack_load) for i in quasi_static]
    widest = max(dpc_opening(model, i) for i in quasi_static)
    for one, other in zip(explicit, quasi_static, strict=True):
        assert one.footing.deflection == pytest.approx(other.footing.deflection, abs=share * most)
        assert dpc_opening(model, one) == pytest.approx(
            dpc_opening(model, other), abs=share * widest + DEFLECTION_TOLERANCE
        )
        if np.isfinite(other.footing.jack_load):
            assert one.footing.jack_load == pytest.approx(other.footing.jack_load, abs=share * max(loads))


def test_level_state_of_an_intact_wall_is_found_at_once() -> None:
    scene = replace(on_jacks(increments=1), dpc=None, joint=Joint(tensile_strength=1e6, cohesion=1e6))
    model, explicit, quasi_static = both(scene)
    level = explicit[0]
    assert level.counters.cycles == 150  # three convergence checks
    assert level.footing.deflection == pytest.approx(0.0, abs=1e-12)
    assert level.footing.jack_load == pytest.approx(quasi_static[0].footing.jack_load, rel=1e-6)
    assert 3.0 * level.footing.jack_load + support_loads(model, level) == pytest.approx(weight(model), rel=1e-6)


def test_the_load_of_the_jacks_may_be_prescribed() -> None:
    scene = on_jacks("doming", rig=Rig(control="load", jack_load=2200.0), increments=2)
    model, explicit, quasi_static = both(scene)
    agree(model, explicit, quasi_static)
    level = explicit[0].footing.jack_load
    assert [i.footing.jack_load for i in explicit] == pytest.approx([level, 0.5 * (level + 2200.0), 2200.0])
    assert explicit[-1].footing.deflection > 0.0


@pytest.mark.parametrize("damping", [0.05, 0.8])
def test_line_and_control_are_stable(damping: float) -> None:
    """Blocks return to the level state after an impulse, even with little damping."""
    scene = replace(on_jacks(), dpc=None, joint=Joint(tensile_strength=1e9, cohesion=1e9))
    run = DampedTimeStepping(wall_model(scene), replace(WHOLE, damping=damping))
    assert run.start_from_elastic_solution()
    level, load = run.motion.displacement.copy(), run.pump.load
    # the control gain is five times the actual one: a margin for cracked walls
    run.pump.line = run.pump.line._replace(gain=5.0 * run.pump.line.gain)
    run.motion.velocity[1:-3:3] = 1e-6 * np.random.default_rng(1).standard_normal(run.model.n_blocks)
    energy = run.kinetic_energy()
    run.cycle(10000)
    assert run.kinetic_energy() < 1e-6 * energy
    assert run.pump.load == pytest.approx(load, rel=1e-3)
    # upwards: only a soft guide restrains the footing along the wall
    assert np.abs(run.motion.displacement - level)[1::3].max() < 1e-3 * np.abs(level).max()


@pytest.mark.parametrize("method", ["explicit", "quasi_static"])
def test_path_ends_at_once_where_supports_pull_in_the_level_state(method: str) -> None:
    _, steps = path(on_jacks("doming", rig=Rig(jacks=(0.3, 2.1))), method=method)
    assert len(steps) == 1
    assert steps[0].end.unloaded == "supports"
    assert steps[0].load_factor == 0.0


def cracking(law: str = "cracked") -> Scene:
    """Return a wall whose footing of weak concrete cracks as jacks pull it down."""
    concrete = ReinforcedConcrete(law=law, bottom="3-L8TM", cover=0.03, tensile_strength=5e5)
    scene = on_jacks(deflection=6e-4, increments=3, rig=Rig(stop_at_zero=False))
    return replace(scene, footing=replace(scene.footing, concrete=concrete))


@pytest.mark.quick_cases
@pytest.mark.parametrize("law", ["cracked", "branson"])
def test_footing_that_cracks_is_the_quasi_static_one(law: str) -> None:
    model, explicit, quasi_static = both(cracking(law))
    agree(model, explicit, quasi_static)
    for one, other in zip(explicit, quasi_static, strict=True):
        moments = [section_forces(model, i.opening, i.normal_stress, i.shear_stress).moment for i in (one, other)]
        assert moments[0] == pytest.approx(moments[1], abs=0.01 * np.abs(moments[1]).max())
    # uncracked, it would be stiffer
    whole = list(solve_path(replace(model, sections=None), WHOLE, 3))[-1]
    assert whole.footing.jack_load < 1.3 * explicit[-1].footing.jack_load < 0.0


def test_footing_with_earlier_bending() -> None:
    scene = cracking()
    bent = replace(scene.footing.concrete, earlier_moment=1000.0)
    model, explicit, quasi_static = both(replace(scene, footing=replace(scene.footing, concrete=bent)))
    agree(model, explicit, quasi_static)
    # cracked before, it needs less load in the first step
    assert explicit[1].footing.jack_load > path(scene)[1][1].footing.jack_load + 100.0


def test_opening_shear_and_rotation_of_a_section_are_those_of_its_segments() -> None:
    """A segment displaced from its left neighbour by 1 um along the footing and 2 um across, then rotated in place."""
    model = wall_model(cracking())
    face, section = model.interfaces, model.sections.interface[1]
    moved, centre = int(face.block_b[section]), face.x[section]
    assert face.normal_y[section] == pytest.approx(0.0, abs=1e-12)
    memory, still = SectionMemory.at_first(model.sections), np.zeros(model.size)
    displacement = still.copy()
    displacement[3 * moved : 3 * moved + 2] = 1e-6, 2e-6
    opening, shear, turn, axial, force, _ = section_response_of(model, memory, displacement)[1]
    assert opening == pytest.approx(face.normal_x[section] * 1e-6)
    assert abs(shear) == pytest.approx(2e-6)
    assert turn == 0.0
    assert (axial * opening > 0.0, force * shear > 0.0) == (True, True)
    displacement = still.copy()
    displacement[3 * moved + 2] = 1e-6
    opening, shear, turn, *_ = section_response_of(model, memory, displacement)[1]
    assert opening == pytest.approx(0.0, abs=1e-12)
    assert abs(shear) == pytest.approx(1e-6 * abs(centre - model.blocks.x[moved]))
    assert abs(turn) == pytest.approx(1e-6)


def test_sections_have_a_history_and_can_be_restored() -> None:
    model = wall_model(cracking())
    path = ExplicitStepper(model, WHOLE)
    run = path.scheme
    path.apply(0.0)
    path.equilibrate()
    before = run.checkpoint()
    path.apply(1.0)
    path.equilibrate()
    cracked = run.sections.memory.cracked.copy()
    assert cracked.max() > 0.3
    path.apply(0.0)  # level again: the cracks remain
    path.equilibrate()
    assert (run.sections.memory.cracked >= cracked).all()
    run.restore(*before)
    assert np.array_equal(run.sections.memory.cracked, before.state.sections.cracked)
    assert run.sections.memory.cracked.max() < cracked.max()


def on_mound() -> Scene:
    """Return a wall whose ends lift off the mound."""
    movement = Movement(kind="doming", shape="mound", increments=2)
    mound = Mound(surface_movement=0.01, suction_depth=3.0, edge_distance=0.8)
    soil = Soil(shrinking_stiffness=2e7)
    return replace(on_jacks("doming"), movement=movement, mound=mound, soil=soil, rig=Rig())


def test_mound_that_lifts_off_is_the_quasi_static_one() -> None:
    model, explicit, quasi_static = both(on_mound())
    agree(model, explicit, quasi_static, 0.005)
    lifted = explicit[-1].opening[model.interfaces.kind == ContactKind.SOIL]
    assert (lifted > 0.0).any()
    assert (lifted < 0.0).any()


def test_run_in_time_refuses_a_footing_that_cracks() -> None:
    scene = replace(on_mound(), footing=cracking().footing)
    with pytest.raises(InputError, match=r"footing\.concrete"):
        dynamic_run(wall_model(scene), scene.solver, Dynamics())


def test_level_state_is_that_on_bilateral_supports_while_none_pulls() -> None:
    """Under a part of its weight, with unbroken bonds, a wall spans the footing and would lift it off."""
    scene = Scene(
        wall=Wall(length=0.69, height=0.6, thickness=0.24, block_length=0.23, block_height=0.2, bond="stack"),
        joint=Joint(normal_stiffness=5e9, shear_stiffness=2.5e9, tensile_strength=880.0, cohesion=514.0, friction=0.62),
        footing=Footing(width=0.26, depth=0.57, elastic_modulus=3.2e9, density=2419.0),
        movement=Movement(kind="doming", shape="jacks", central_deflection=1e-8, increments=1),
        loads=Loads(roof=8745.0),
    )
    # a copy may have thin piers, as a sampled wall
    scene = replace(scene, opening=(Opening(x=0.466, y=0.268, width=0.168, height=0.221, lintel_bearing=0.06),))
    held, lifts = (
        damagepred.solve(replace(scene, rig=Rig(support=s, stop_at_zero=False))) for s in ("held", "lift_off")
    )
    assert lifts.attrs["status"] == "complete"
    assert (held["support_load"] > 0.0).all()
    for name in ("support_load", "jack_load", "contact_opening", "contact_broken_at"):
        np.testing.assert_allclose(lifts[name], held[name], rtol=1e-6, atol=1e-15)
