"""Bricks that break: strength and energy of their middles, elastic answer of whole bricks, damage and drawings."""

from dataclasses import replace
from typing import Literal

import matplotlib.pyplot as plt
import numpy as np
import pytest

from damagepred import Assembly, Joint, Movement, Scene, Solver, Wall, assembly, crack_profile, solve
from damagepred.assembly.brick_cracks import BrickWatch, brick_cautions, brick_joint
from damagepred.enumerations import ContactKind, ContactState
from damagepred.scene import BlockMaterial, Load, Loading, Support
from damagepred.solvers import solve_path
from damagepred.solvers.quasi_static.continuation import Continuation, _Trial
from damagepred.solvers.quasi_static.elimination_tree import EliminationTree
from damagepred.solvers.quasi_static.step_control import StepControl
from damagepred.solvers.system.discrete_system import DiscreteSystem

STRONG = Joint(tensile_strength=1e9, cohesion=1e9)
BRICK = BlockMaterial(density=0.0, tensile_strength=2e6, fracture_energy=80.0)
PANEL = Scene(
    wall=Wall(length=1.2, height=0.45, thickness=0.1),
    joint=STRONG,
    block=BRICK,
    movement=Movement(shape="loads", increments=4),
    support=(Support(x=0.12, width=0.24), Support(x=1.08, width=0.24)),
    load=(Load(at=0.6, width=0.24),),
    loading=Loading(control="force", force="100 N"),
)
BEAM = replace(PANEL, load=(Load(at=0.6, width=0.24),), loading=Loading(control="displacement", displacement="0.4 mm"))


def pulled_brick(blocks: str, energy: float, method: str = "quasi_static") -> tuple[float, float]:
    """Work per area (J/m2) to pull a brick of two halves apart, and the largest stress in its middle (Pa)."""
    b, h, t, modulus = 0.24, 0.075, 0.1, 9e9
    block = BlockMaterial(elastic_modulus=modulus, density=1.0, tensile_strength=2e6, fracture_energy=energy)
    wall = Assembly(thickness=t, block=block, joint=STRONG, gravity=(0.0, 0.0))
    left, right = (wall.add_block([(x, 0), (x + b / 2, 0), (x + b / 2, h), (x, h)]) for x in (0.0, b / 2))
    stiff = 1e4 if blocks == "rigid" else 100.0
    middle = replace(brick_joint(block), normal_stiffness=stiff * modulus / b, shear_stiffness=stiff * modulus / b)
    wall.set_joint(left, right, middle, ContactKind.BRICK_JOINT)
    ends = [wall.add_block([(x, 0), (x + 0.1, 0), (x + 0.1, h), (x, h)]) for x in (-0.1, b)]
    very = replace(STRONG, normal_stiffness=1e14, shear_stiffness=1e14)
    wall.set_joint(ends[0], left, very)
    wall.set_joint(right, ends[1], very)
    wall.support(ends[0])
    wall.move(ends[1], x=2.2 * energy / 2e6, y=0.0, rotation=0.0)
    solver = Solver(blocks=blocks, method=method, lump_block_elasticity=False)
    model = wall.build(solver)
    at = int(np.flatnonzero(model.interfaces.kind == ContactKind.BRICK_JOINT)[0])
    work, largest, before = 0.0, 0.0, (0.0, 0.0)
    for step in solve_path(model, solver, 160):
        force = float((step.normal_stress[at] * model.interfaces.contact_area[at]).sum())
        moved = step.load_factor * 2.2 * energy / 2e6
        work += 0.5 * (force + before[0]) * (moved - before[1])
        before, largest = (force, moved), max(largest, float(step.normal_stress[at].max()))
    return work / (h * t), largest


@pytest.mark.parametrize("blocks", ["rigid", "elastic"])
@pytest.mark.parametrize("method", ["quasi_static", "explicit"])
def test_a_brick_in_tension_delivers_strength_and_fracture_energy(blocks: str, method: str) -> None:
    """Also where half of the energy is stored in the elastic brick before: f_t^2 b / (2 E) = 53 N/m."""
    energy = 106.0
    work, largest = pulled_brick(blocks, energy, method)
    assert work == pytest.approx(energy, rel=0.01)
    assert largest == pytest.approx(2e6, rel=0.02)
    assert largest <= 2e6 * (1 + 1e-9)


@pytest.mark.parametrize("blocks", ["rigid", "elastic"])
@pytest.mark.parametrize("case", ["bending", "column", "shear"])
def test_unbroken_halves_are_whole_bricks(blocks: str, case: str) -> None:
    """The crack's stiffness adds 1 % of a brick's flexibility: no more than 1.5 % to that of a wall."""
    loads = {
        "bending": {},
        "column": {"support": (), "load": (Load(),)},
        "shear": {
            "support": (),
            "load": (Load(direction="along"),),
            "loading": Loading(control="force", force="100 N", beam="clamped"),
        },
    }[case]
    moved = []
    for mode in ("none", "all"):
        found = solve(replace(PANEL, solver=Solver(blocks=blocks, brick_cracks=mode), **loads))
        moved.append(float(found["load_displacement"].values[-1]))
        strained = found["block_strain"].values[-1] if "block_strain" in found else np.zeros(1)
        assert blocks == "rigid" or np.abs(strained).max() > 0.0
    assert moved[0] <= moved[1] * (1 + 1e-9)
    assert moved[1] == pytest.approx(moved[0], rel=0.015)


@pytest.mark.parametrize("blocks", ["rigid", "elastic"])
def test_a_beam_on_strong_joints_breaks_through_its_bricks(blocks: str) -> None:
    """Cracks of bricks are cracks: of the category, of the list and of the drawing; friction is left in them."""
    found = solve(replace(BEAM, solver=Solver(blocks=blocks)), on_failure="return")
    kind, state = found["contact_kind"].values, found["contact_state"].values[-1]
    broken = (kind == ContactKind.BRICK_JOINT) & (state == ContactState.CRACKED)
    assert broken.any()
    assert not ((kind != ContactKind.BRICK_JOINT) & (state == ContactState.CRACKED) & np.isin(kind, (0, 1))).any()
    widest = float(found["contact_opening"].values[-1, broken].max())
    assert found["crack_width_max"].values[-1] == pytest.approx(widest, rel=1e-9)
    assert ContactKind.BRICK_JOINT in crack_profile(found)["piece_kind"].values
    from damagepred.plotting import draw_wall

    labels = [c.get_label() for c in draw_wall(found).collections]
    plt.close("all")
    assert "cracks" in labels


def test_whole_bricks_answer_where_no_brick_nears_its_strength() -> None:
    """Bit for bit, and with the same joints and fields; a path with a brick that breaks is that of halves."""
    free = replace(PANEL, block=replace(BRICK, tensile_strength=None, fracture_energy=None))
    plain, watched = solve(free), solve(PANEL)
    for name in ("load_displacement", "contact_opening", "contact_normal_stress"):
        np.testing.assert_array_equal(plain[name].values, watched[name].values)
    halves, again = (
        solve(replace(BEAM, solver=Solver(brick_cracks=m)), on_failure="return") for m in ("all", "reached")
    )
    np.testing.assert_array_equal(halves["load_force"].values, again["load_force"].values)


HOGGING = Scene(
    wall=Wall(length=4.0, height=2.0, thickness=0.1),
    joint=Joint(tensile_strength=0.15e6, cohesion=0.21e6, friction=0.42, fracture_energy=10.0),
    block=replace(BRICK, density=1850.0),
    movement=Movement(kind="doming", shape="parabola", central_deflection=4e-3, increments=20),
)


@pytest.mark.parametrize("blocks", ["rigid", "elastic"])
def test_halves_that_hold_cost_little_more_than_whole_bricks(blocks: str) -> None:
    """Iterations, and memory of the fronts: strains that two halves share do not chain the fronts together."""
    iterations, entries = [], []
    for mode in ("none", "all"):
        scene = replace(HOGGING, solver=Solver(blocks=blocks, brick_cracks=mode, symmetric_half=False))
        iterations.append(int(solve(scene)["newton_iterations"].sum()))
        system = DiscreteSystem.of(assembly.wall_model(scene))
        entries.append(EliminationTree.of(system, None).matrix_entries)
    assert iterations[1] <= 1.3 * iterations[0], iterations
    assert entries[1] <= 3 * entries[0], entries


@pytest.mark.parametrize(("mode", "share", "cuts"), [("all", 0.9, 0), ("all", 1.1, 1), ("none", 0.9, 1)])
def test_beyond_a_jump_an_overloaded_middle_fails_without_shorter_steps(mode, share, cuts, monkeypatch) -> None:
    """Each shorter step would seek the equilibrium before the jump in vain, and relax the wall once more."""
    scene = replace(HOGGING, wall=Wall(length=0.96, height=0.3, thickness=0.1), solver=Solver(brick_cracks=mode))
    path = Continuation(assembly.wall_model(scene), scene.solver)
    monkeypatch.setattr(path.equilibrium, "largest_bond_load", lambda state: 1.5)
    monkeypatch.setattr(path.equilibrium, "event_share", lambda state, aim: 0.5)
    monkeypatch.setattr(path, "_commit_within_energy_error", lambda *step: True)
    monkeypatch.setattr(path, "_redistribute_failures", lambda state, ratio: (state, 0.0))
    control = StepControl.start(path.state, (path.state.load, 1.0), False)
    target = path.state.load, share * control.shortest_halved_step
    distant = path.state.at(*target)
    state, _, _ = path._end_step(path.state, target, _Trial(distant, 0.0, path.state), control)
    assert (state is distant, control.event_cuts) == (cuts == 0, cuts)


@pytest.mark.parametrize("beam", ["none", "free"])
def test_joints_have_the_numbers_of_whole_bricks(beam: Literal["none", "free"]) -> None:
    """So the same sample has the same strengths, whether its bricks break or not; also below a loading beam."""
    panel = replace(PANEL, loading=replace(PANEL.loading, beam=beam))
    whole, halves = (assembly.wall_geometry(s) for s in (replace(panel, block=BlockMaterial()), panel))
    for first, second in zip(whole.mortar, halves.mortar):
        np.testing.assert_allclose(first, second, atol=1e-12)
    values = np.linspace(1e5, 3e5, len(whole.mortar.kind))
    laws = [assembly.wall_model(s, {"joint.tensile_strength": values}) for s in (panel,)]
    beds = laws[0].interfaces.kind == ContactKind.BED_JOINT
    assert set(laws[0].properties.tensile_strength[beds]) <= set(values)


def test_the_watch_finds_the_tension_of_the_middle() -> None:
    """Stress from the forces on half a brick against that in the crack of the same brick."""
    for blocks in ("rigid", "elastic"):
        whole, halves = (replace(PANEL, solver=Solver(blocks=blocks, brick_cracks=m)) for m in ("none", "all"))
        model = assembly.wall_model(halves)
        last = list(solve_path(model, halves.solver, 1))[-1]
        at = model.interfaces.kind == ContactKind.BRICK_JOINT
        largest = float(last.normal_stress[at].max())
        model = assembly.wall_model(whole)
        last = list(solve_path(model, whole.solver, 1))[-1]
        near = []
        for factor in (1.0 / 0.8 * 0.8, 1.0 / 0.8 * 1.2):
            watched = replace(whole, block=replace(BRICK, tensile_strength=factor * largest, cohesion=1e9))
            near.append(BrickWatch.of(watched, model).near(model, last.normal_stress, last.shear_stress))
        assert near == [True, False]


@pytest.mark.parametrize(
    ("block", "solver", "said"),
    [
        ({"tensile_strength": 2e6}, {}, "break only with block.fracture_energy"),
        ({"fracture_energy": 80.0}, {"blocks": "elastic"}, "break only with block.tensile_strength"),
        ({"tensile_strength": 2e6, "fracture_energy": 80.0}, {"brick_cracks": "none"}, "brick_cracks = 'none'"),
        ({"tensile_strength": 2e6, "fracture_energy": 80.0}, {"blocks": "deformable"}, "zones yield"),
        ({"tensile_strength": 2e6, "fracture_energy": 80.0}, {}, ""),
        ({"tensile_strength": 2e6}, {"blocks": "deformable"}, ""),
        ({"tensile_strength": 2e6}, {"below_dpc": "deformable"}, ""),  # zones below the dpc read it
        ({"cohesion": 2e6}, {}, "block.cohesion: not read"),
    ],
)
def test_a_strength_that_nothing_reads_is_named(block: dict[str, float], solver: dict[str, str], said: str) -> None:
    scene = Scene.from_file_tables({"block": block, "solver": solver, "dpc": {}}, None, "wall.toml")
    cautions = brick_cautions(scene)
    assert said in " ".join(cautions)
    assert bool(cautions) == bool(said)


@pytest.mark.parametrize(
    ("material", "block", "said"),
    [
        ("clay brick, Dutch, 1940s", {}, ""),
        ("calcium silicate brick, Dutch", {"tensile_strength": "none"}, ""),
        ("calcium silicate brick, Dutch", {"fracture_energy": 60.0}, ""),
        (
            "calcium silicate brick, Dutch",
            {},
            "of 'calcium silicate brick, Dutch': not read: rigid and elastic bricks break",
        ),
        ("clay brick, Dutch, shear panels", {"dilation": 0.1}, "break only with block.fracture_energy"),
    ],
)
def test_a_strength_of_the_library_that_nothing_reads_is_named(material, block, said) -> None:
    tables = {"material": material, "block": block}
    cautions = brick_cautions(Scene.from_file_tables(tables, None, "wall.toml"))  # type: ignore[arg-type]
    assert said in " ".join(cautions)
    assert bool(cautions) == bool(said)
