"""The study of what the solvers bear: a few cases of every family, right, fallen rightly, or refused with words."""

from pathlib import Path
from typing import Any

import pytest

FOLDER = Path(__file__).parents[2] / "studies" / "benchmarks" / "stress"
STATIC = ("quasi-static, rigid", "quasi-static, deformable", "explicit, rigid", "explicit, deformable")
GOOD = ("right", "fell, rightly")


def judged(family: str, name: str, way: str) -> dict[str, Any]:
    from studies.benchmarks.stress.checks import judge
    from studies.benchmarks.stress.run import all_cases

    return judge(all_cases()[family, name], way)


@pytest.mark.parametrize("way", STATIC)
@pytest.mark.parametrize(
    ("family", "name"),
    [
        ("proportion", "soft joints among stiff ones 1 : 1e6"),
        ("proportion", "light blocks on heavy ones 1 : 1e4"),
        ("proportion", "slivers 50 : 1"),
        ("proportion", "slender blocks 1 : 50"),
        ("proportion", "flat blocks 50 : 1"),
        ("proportion", "far coordinates 10 km"),
        ("drawings", "many corners on an edge"),
        ("friction and form", "mu = 0.2, b/h = 0.5, 1.01 of the limit"),
        ("friction and form", "mu = 2, b/h = 1, 0.99 of the limit"),
    ],
)
def test_what_is_out_of_proportion_is_solved(way: str, family: str, name: str) -> None:
    found = judged(family, name, way)
    assert found["verdict"] in GOOD, found


def test_zones_of_cut_bricks_carry_what_comes_on_them() -> None:
    found = judged("movement", "dishing by 0.001 m in one increment, unbreakable", "explicit, deformable")
    assert found["verdict"] == "right", found


def test_soft_bricks_beside_an_opening_are_solved() -> None:
    """Blocks of one pattern but two sizes alternate there: internal forces must be those of each shape."""
    from damagepred.scene import BlockMaterial, Joint, Movement, Opening, Scene, Wall
    from studies.benchmarks.stress.case import Case
    from studies.benchmarks.stress.checks import judge

    scene = Scene(
        wall=Wall(length=0.805, height=0.355, block_length=0.115, block_height=0.071, thickness=0.1228),
        block=BlockMaterial(elastic_modulus=2.628e9, density=4506.2),
        joint=Joint(
            normal_stiffness=418.7e6, shear_stiffness=379e6, tensile_strength=725e3, cohesion=66.3e3, friction=0.3
        ),
        movement=Movement(kind="dishing", central_deflection=2.679e-5, increments=2, shape="parabola"),
        opening=(Opening(x=0.359, width=0.229, y=0.079, height=0.17),),
    )
    found = judge(Case("random scenes", "scene 28", lambda deformable: scene, increments=2), "explicit, deformable")
    assert found["verdict"] == "right", found


@pytest.mark.parametrize(
    ("family", "name"),
    [
        ("near the limit load", "arch, gravity leans by 0.9 of the limit"),
        ("strengths", "dilation as much as friction"),
    ],
)
def test_zones_that_ring_do_not_hold_a_wall_up(family: str, name: str) -> None:
    """Local damping takes a share of the forces of that, and would keep a wall that goes slowly from arriving."""
    found = judged(family, name, "explicit, deformable")
    assert found["verdict"] == "right", found


@pytest.mark.parametrize("name", ["all corners twice", "no area", "dented", "overlaps the one below", "not a number"])
def test_what_is_no_wall_is_refused(name: str) -> None:
    found = judged("drawings", name, "quasi-static, rigid")
    assert found["verdict"] == "refused"
    assert "block" in found["message"]


def test_judging_sees_what_is_wrong() -> None:
    """Forces that do not balance, a law that is passed, a fall that need not be, energy from nothing, no number."""
    from dataclasses import replace

    import numpy as np

    from studies.benchmarks.stress.case import found
    from studies.benchmarks.stress.checks import verdict
    from studies.benchmarks.stress.run import all_cases

    case, way = all_cases()["near-mechanisms", "tower of 5, 0.9 of the overhang"], "quasi-static, rigid"
    result = found(case, way)
    last = result.path[-1]
    assert verdict(case, way, result)["verdict"] == "right"

    def judge_with(**changed: Any) -> dict[str, Any]:
        return verdict(case, way, result._replace(path=[*result.path[:-1], replace(last, **changed)]))

    assert judge_with(normal_stress=1.01 * last.normal_stress)["by"] == "forces"
    assert judge_with(shear_stress=last.shear_stress + last.normal_stress)["verdict"] == "WRONG"
    assert judge_with(collapsed=True)["verdict"] == "WRONG"
    assert "energy" in judge_with(energy=replace(last.energy, released_energy=-0.1))["message"]
    nothing = np.full_like(last.displacement, np.nan)
    assert judge_with(displacement=nothing) == {"message": "not finite: displacement in increment 1"}
    unknown = replace(case, expect="")
    assert verdict(unknown, way, result._replace(path=[replace(last, collapsed=True)]))["verdict"] == "fell"


@pytest.mark.parametrize(("share", "verdict"), [("0.1", "right"), ("1", "right"), ("2", "gave up")])
def test_a_time_step_holds_or_is_refused(share: str, verdict: str) -> None:
    from studies.benchmarks.stress.run import all_cases

    case = all_cases()["time steps", f"{share} of the limit"]
    found = [judged(case.family, case.name, way) for way in case.ways]
    found.append(judged(case.family, f"{case.name}, no new contacts", "in time, rigid"))
    assert {row["verdict"] for row in found} == {verdict}, found
    assert all("time_step_safety" in row["message"] for row in found if row["message"])


def _jobs(part: str) -> list[tuple[str, str, str]]:
    from studies.benchmarks.stress.run import all_cases

    keys = [key for key in all_cases() if key[0] == "near-mechanisms" and part in key[1]]
    return [(*key, "quasi-static, rigid") for key in keys]


def _run(jobs: list[tuple[str, str, str]], work: Any, file: Path, limit: float) -> None:
    from studies.benchmarks import cases
    from studies.benchmarks.stress.run import KEY, lost

    cases.run(jobs, KEY, work, lost, file, limit)


def test_a_case_that_hangs_or_dies_is_counted_and_what_is_done_is_kept(tmp_path: Path) -> None:
    from studies.benchmarks.stress import run, summary

    jobs, file = _jobs("tower of 2"), tmp_path / "rows.csv"
    _run(jobs[:2], _hangs_or_dies, file, limit=1.0)
    rows = summary.read(file)
    assert list(rows["verdict"]) == ["FAILED", "FAILED"]
    assert "longer than 1 s" in rows["message"][0]
    assert "died" in rows["message"][1]
    _run(jobs, run.one, file, limit=60.0)
    rows = summary.read(file)
    assert len(rows) == len(jobs)
    assert set(rows["verdict"][2:]) <= set(GOOD)


def test_who_interrupts_it_does_not_wait_for_what_is_left(tmp_path: Path) -> None:
    import os
    import signal
    import threading

    usual = signal.signal(signal.SIGUSR1, signal.default_int_handler)
    interrupt = threading.Timer(1.0, os.kill, (os.getpid(), signal.SIGUSR1))
    interrupt.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            _run(_jobs("0.9 of"), _hangs_or_dies, tmp_path / "rows.csv", limit=3600.0)
    finally:
        interrupt.cancel()
        signal.signal(signal.SIGUSR1, usual)


def _hangs_or_dies(family: str, name: str, way: str) -> None:
    import os
    import time

    if "0.9 of" in name:
        time.sleep(3600)  # longer than the test may take
    os._exit(3)
