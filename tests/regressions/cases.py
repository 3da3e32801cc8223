"""The timed cases: kernels, and commands of a user."""

import subprocess
import sys
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from damagepred import Dpc, Dynamics, Scene, Solver, Study, Wall, fit_fragility, open_study
from damagepred.archive.folder import StudyFolder
from damagepred.assembly import wall_model
from damagepred.campaign.sample import run_batch
from damagepred.campaign.settings import StudySettings
from damagepred.enumerations import SampleStatus
from damagepred.kernels import jit
from damagepred.kernels.equilibrium.joints import add_internal_forces, joint_steps
from damagepred.one_wall.judged_path import dynamic_run, follow
from damagepred.solvers.quasi_static.continuation import Continuation
from damagepred.solvers.quasi_static.linear_system import MultifrontalSystem
from damagepred.solvers.system.discrete_system import DiscreteSystem
from tests.conftest import ROOT, SMALL_STUDY
from tests.regressions import walls
from tests.synthetic_studies import synthetic_study

RIGID = Solver(blocks="rigid")


class Ready(NamedTuple):
    """Work to be timed, and by how much its time is divided for people to read."""

    work: Callable[[], object]
    count: float = 1.0


@dataclass(frozen=True)
class Case:
    name: str
    unit: str
    prepare: Callable[[Path], Ready]
    beside: Mapping[str, int]
    bound: float = 1.7
    rounds: int = 15


def explicit_cycle(wall: str) -> Callable[[Path], Ready]:
    """Cycles of the explicit solver, the paper's wall of rigid blocks."""

    def prepare(folder: Path) -> Ready:
        run, cycles = getattr(walls, wall)(), 150
        return Ready(
            lambda: run._cycle(cycles, run.load_share, run.load_factor, 0.0), cycles * run.model.n_contacts * 1e-9
        )

    return prepare


def zone_cycle(material: str, cycles: int, alone: bool) -> Callable[[Path], Ready]:
    """Cycles of the explicit solver with deformable blocks, or of their zones alone."""

    def prepare(folder: Path) -> Ready:
        run = walls.bent(getattr(walls, material), PIECE)
        work = walls.alone(run) if alone else walls.whole(run)
        return Ready(lambda: work(cycles), cycles * len(run.model.mesh.zones) * 1e-9)

    return prepare


def dynamic_step(folder: Path) -> Ready:
    """Steps of a run in time: the wall at rest with its mortar, as every stretch is then the same."""
    scene = Scene(wall=PIECE, dynamics=Dynamics(duration=0.2, outputs=100), solver=RIGID)
    model = wall_model(scene)
    run = dynamic_run(model, scene.solver, Dynamics(duration=10.0, outputs=10_000))
    return Ready(run.advance, run.timing.steps * len(run.bodies.points) * 1e-9)


def factorisation(folder: Path) -> Ready:
    """All fronts of the paper's wall eliminated, and one load solved for."""
    model = wall_model(Scene(dpc=Dpc(), solver=RIGID))
    face, joint = model.interfaces, model.properties
    area, at = face.contact_area, face.contact_offset
    normal, shear, none = joint.normal_stiffness[:, None] * area, joint.shear_stiffness[:, None] * area, 0.0 * area
    terms = (normal, none, normal * at, none, shear, none, normal * at, none, normal * at**2)
    equations = MultifrontalSystem(DiscreteSystem.of(model), np.stack([term.sum(axis=1) for term in terms], axis=-1))
    force = np.ones(3 * (model.n_blocks + 1))

    def work() -> None:
        equations.solver.stale[:] = True
        equations.solver.must_factorise[0] = True
        equations.solve(force)

    return Ready(work, 1e-3)


def joint_law(coulomb: bool) -> Callable[[Path], Ready]:
    """Forces and stiffness of all joints of the wall with a window, as the quasi-static solver asks for them."""

    def prepare(folder: Path) -> Ready:
        scene = replace(Scene.from_toml(ROOT / "data" / "bryant_window_dishing.toml"), solver=RIGID)
        follower = Continuation(wall_model(scene), scene.solver)
        follower.advance(1.0, 0.1)
        equilibrium, state = follower.equilibrium, follower.state
        everything, times, u = equilibrium._all_interfaces, 40, state.displacement
        inside, force, stiffness = equilibrium._in_state(state), np.zeros_like(u), np.zeros((len(everything), 9))

        def work() -> None:
            for _ in range(times):
                add_internal_forces(equilibrium.components, inside, everything, coulomb, u, force, stiffness)

        return Ready(work, times * len(everything) * 1e-9)

    return prepare


def path(solver: Solver) -> Callable[[Path], Ready]:
    """The path of the paper's wall in five increments, judged, from the model on."""

    def prepare(folder: Path) -> Ready:
        scene = replace(Scene.from_toml(ROOT / "data" / "bryant_dishing.toml"), solver=solver)
        model = wall_model(scene)
        return Ready(lambda: list(follow(model, scene.solver, scene.damage, 5)), 1e-3)

    return prepare


def sample(folder: Path) -> Ready:
    """One sample of the small study of many tests, as a worker does it: drawn, solved, judged, archived."""
    study = Study(StudySettings.from_dict(tomllib.loads(SMALL_STUDY + '[scene.solver]\nblocks = "rigid"\n')))
    study._prepare(place := StudyFolder(folder / "study.dp"), 4)
    values = {name: float(column[1]) for name, column in study.design.wall_values(4).items()}
    part = place.part_file(1, 1)

    def work() -> None:
        part.unlink(missing_ok=True)
        outcomes = run_batch(str(place.path), [(1, values)])
        assert outcomes[0].status < SampleStatus.FAILED, outcomes
        assert part.is_file()

    return Ready(work, 1e-3)


def read_archive(folder: Path) -> Ready:
    """A study of 400 walls, opened and read."""
    place = synthetic_study(folder / "study.dp", walls=400)
    return Ready(lambda: open_study(place).load(), 1e-3)


def fit_curves(folder: Path) -> Ready:
    """Curves with bands fitted to a study of 400 walls."""
    ds = open_study(synthetic_study(folder / "study.dp", walls=400)).load()
    return Ready(lambda: fit_fragility(ds, bootstrap=200), 1e-3)


def command(*words: str, says: str = "") -> Callable[[Path], Ready]:
    def prepare(folder: Path) -> Ready:
        def work() -> None:
            run = subprocess.run([sys.executable, *words], check=True, capture_output=True, text=True, cwd=folder)
            assert says in run.stdout

        return Ready(work)

    return prepare


HELP = command("-m", "damagepred", "--help", says="fragility")


def compile_kernel(folder: Path) -> Ready:
    """One kernel of the quasi-static solver, compiled as all are."""
    bond_loads = joint_steps(None).bond_loads
    assert bond_loads.__wrapper_address__()  # all that a first compilation loads

    def work() -> None:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(jit, "CACHE_FOLDER", None)
            assert jit.Phase(bond_loads.function, bond_loads.signature()).__wrapper_address__()

    return Ready(work)


PIECE = Wall(length=2.4, height=0.9)
"""Size of the wall for kernels whose time does not depend on it."""

GATE = (
    Case("explicit cycle, intact", "ns a contact", explicit_cycle("intact"), {"compiled": 4}),
    Case("explicit cycle, cracked", "ns a contact", explicit_cycle("cracked"), {"compiled": 4}),
    Case("zones alone", "ns a zone", zone_cycle("STRONG", 100, True), {"compiled": 4}),
    Case("zone cycle", "ns a zone", zone_cycle("STRONG", 40, False), {"compiled": 4}),
    Case("zone cycle, yielding", "ns a zone", zone_cycle("WEAK", 40, False), {"compiled": 6}),
    Case("dynamic step", "ns a point", dynamic_step, {"compiled": 2}),
    Case("joints, quasi-static", "ns a joint", joint_law(True), {"compiled": 2}),
    Case("joints, limits frozen", "ns a joint", joint_law(False), {"compiled": 2}),
    Case("factorisation", "ms", factorisation, {"lapack": 5}),
    Case("path", "ms", path(RIGID), {"compiled": 20, "interpreter": 10, "lapack": 20}, rounds=5),
    Case("sample", "ms", sample, {"compiled": 5, "interpreter": 5, "files": 5}, rounds=8),
    Case("archive read", "ms", read_archive, {"files": 2}),
    Case("curves fitted", "ms", fit_curves, {"interpreter": 40}, rounds=6),
    Case("damagepred --help", "s", HELP, {"process": 1}, rounds=8),
    Case("import damagepred", "s", command("-c", "import damagepred"), {"process": 1}, rounds=8),
    Case("import what solves", "s", command("-c", "from damagepred import solve"), {"process": 4}, rounds=3),
    Case("compile a kernel", "s", compile_kernel, {"compiler": 5}, rounds=2),
)
