"""Small studies of studies/: settings, scores of known answers, tables on pages, quick forms."""

import importlib
import math
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from scipy import special

import damagepred
from damagepred.analyses.design_search import Choices, price_of_search, search_design
from damagepred.analyses.inference_options import InferenceOptions
from damagepred.assembly import wall_geometry
from damagepred.damage import beam_strain
from damagepred.enumerations import SampleStatus
from damagepred.inputs.input_files import read_toml
from damagepred.scene import Scene
from damagepred.scene.described import build
from damagepred.uq.samplers import unit_points
from studies.benchmarks.probabilities import errors, summary, walls
from studies.guidance import run as guidance
from tests.conftest import ROOT

STUDIES = ROOT / "studies"
COMPLETE, _, FAILED, _ = SampleStatus


def modules(folder: str, *names: str) -> dict[str, ModuleType]:
    """Modules that find each other by the folder they lie in; others of their names are put aside."""
    path, aside = sys.path[:], {name: sys.modules.pop(name) for name in names if name in sys.modules}
    sys.path.insert(0, str(STUDIES / folder))
    try:
        return {name: importlib.import_module(name) for name in names}
    finally:
        sys.path[:] = path
        for name in names:
            sys.modules.pop(name, None)
        sys.modules.update(aside)


@pytest.mark.quick_cases
@pytest.mark.parametrize("name", guidance.NAMES)
def test_every_variant_is_a_wall_and_differs_from_the_others(name: str) -> None:
    _, variants = guidance.read_variants(guidance.HERE / name)
    assert len(variants) >= 4
    archives = {guidance.archive_of(Path(), guidance.study_of(v, "doming", None, 1.0)) for v in variants.values()}
    assert len(archives) == len(variants)
    for settings in variants.values():
        scene = settings.scene
        assert len(wall_geometry(scene).joints.kind) > 100
        # as far as the most that AS 2870 allows under masonry
        assert scene.movement.central_deflection == pytest.approx(scene.wall.length / 400, rel=1e-9)
        if scene.opening:
            assert scene.loads.roof in (0.0, pytest.approx(3000 * scene.wall.length))


@pytest.mark.slow
def test_a_whole_study_in_its_quick_form(tmp_path: Path) -> None:
    """The command that writes a page's table and picture; `size` has the smallest walls."""
    asked = f"size --samples 1 --workers 1 --increments 1 --reach 0.2 --output {tmp_path}"
    assert guidance.main(asked.split()) == 0
    assert (tmp_path / "size" / "damage.png").stat().st_size > 10_000
    assert set(pd.read_csv(tmp_path / "size" / "table.csv")["movement"]) == {"dishing", "doming"}


@pytest.mark.quick_cases
@pytest.mark.parametrize("name", guidance.NAMES)
def test_readmes_show_the_committed_tables(name: str) -> None:
    rows = pd.read_csv(guidance.HERE / name / "table.csv")
    assert guidance.markdown(rows) in (guidance.HERE / name / "README.md").read_text(encoding="utf-8")
    assert list(dict.fromkeys(rows["variant"])) == list(guidance.read_variants(guidance.HERE / name)[1])


@pytest.fixture(scope="module")
def back_analysis() -> dict[str, ModuleType]:
    return modules("back_analysis", "run", "synthetic", "judging")


def test_the_promised_area_is_that_of_right_probabilities(back_analysis: dict[str, ModuleType]) -> None:
    synthetic = back_analysis["synthetic"]
    assert synthetic.promised_area(np.full(5, 0.3)) == pytest.approx(0.5)
    assert synthetic.promised_area(np.array([0.0, 0.0, 1.0])) == pytest.approx(1.0)
    # two values: (p of the lower, higher) = (0.2, 0.6); true above other 0.6 * 0.8 + ties, over 0.8 * 1.2
    assert synthetic.promised_area(np.array([0.2, 0.6])) == pytest.approx((0.6 * 0.8 + 0.5 * (0.16 + 0.24)) / 0.96)
    random = np.random.default_rng(2)
    probability = random.beta(0.5, 0.7, 40_000)
    true = random.uniform(size=40_000) < probability
    promised = synthetic.promised_area(probability)
    assert synthetic.area(probability, true) == pytest.approx(promised, abs=0.01)
    blurred = np.clip(probability + 0.3 * random.standard_normal(40_000), 0.0, 1.0)
    assert synthetic.area(blurred, true) < promised - 0.02  # no other score does better


@pytest.mark.thorough
def test_a_small_run_infers_the_causes(back_analysis: dict[str, ModuleType], tmp_path: Path) -> None:
    run, synthetic, _ = back_analysis.values()
    study = tmp_path / "study.toml"
    text = (STUDIES / "back_analysis" / "study.toml").read_text(encoding="utf-8")
    study.write_text(text.replace("1.92 m", "0.96 m").replace("0.6 m", "0.3 m").replace("s = 12", "s = 4"))
    stored = synthetic.archives(study, run.KINDS, tmp_path / "stored", 6, 1, 1)
    unseen = synthetic.archives(study, run.KINDS, tmp_path / "unseen", 2, 2, 1)
    survey = synthetic.Survey(((0.24, 0.1), (0.48, 0.1)), ((0.48, 0.0375), (0.12, 0.0375)))
    cases = list(synthetic.infer_cases(stored, unseen, survey, InferenceOptions(replays=6), [1, 2]))
    assert [case.cause for case in cases] == [0, 0, 1, 1] * 2
    assert all(case.probability.sum() == pytest.approx(1.0) for case in cases)
    found = run.scores(cases, 2)
    assert len(found["coverage_90_of_each_survey"]) == 2
    assert found["cases"] == 8
    page = run.page_text({"cracks": {**found, "stored_walls": 6}})
    assert page.startswith("| 8 cases: 4 walls, 2 surveys each | measured | expected |")
    assert "| cracks | 6 | 8 |" in page


DESIGN = STUDIES / "design"


@pytest.fixture(scope="module")
def design() -> ModuleType:
    return modules("design", "run", "judging")["run"]


def test_files_are_valid_and_the_page_has_their_alternatives(design: ModuleType, tmp_path: Path) -> None:
    """Three footings and four layouts of joints, each with its cost on the page, for two classes and two targets."""
    assert price_of_search(DESIGN / "choices.toml", 2).startswith("12 alternatives")
    asked, file = set(), tmp_path / "choices.toml"
    for site in design.CLASSES:
        for target in design.TARGETS.values():
            file.write_text(design.choices(site, target), encoding="utf-8")
            choices = build(Choices, read_toml(file), str(file))
            asked.add(str(choices.target))
            assert math.prod(len(choice.option) for choice in choices.choice) == 12
    assert asked == {
        *(f"P(category >= 2 at {site}) <= 0.05" for site in ("M", "H1")),
        *(f"expected cost with repairs at {site}" for site in ("M", "H1")),
    }
    page = (DESIGN / "README.md").read_text(encoding="utf-8")
    for footing, cost in (("300 x 300", 0), ("300 x 500", 900), ("300 x 700", 1900)):
        for joint, more in (("no joint", 0), ("one between the windows", 500), ("two between the windows", 1000)):
            shown = 4 if cost + more <= 1400 else 0  # the six cheapest
            assert page.count(f"| {footing} + {joint} | {cost + more} |") == shown


@pytest.mark.thorough
def test_a_few_walls_of_two_alternatives(design: ModuleType, tmp_path: Path) -> None:
    """With two walls each nothing is decided, and costs are those said; the same walls answer for both targets."""
    text = (DESIGN / "choices.toml").read_text(encoding="utf-8")
    options = text.split("[[choice.option]]")
    head, joints = options[0].replace('name = "footing"', 'name = "joints"'), options[4:6]
    text = "[[choice.option]]".join([head, *(joint.partition("[[choice]]")[0] for joint in joints)])
    (tmp_path / "choices.toml").write_text(text.replace("64", "2").replace("128", "2"), encoding="utf-8")
    house = (DESIGN / "house.toml").read_text(encoding="utf-8").replace("increments = 12", "increments = 3")
    (tmp_path / "house.toml").write_text(house, encoding="utf-8")
    found = search_design(tmp_path / "choices.toml", tmp_path / "out")
    assert found["cost"].values.tolist() == [0.0, 500.0]
    assert found["samples"].values.tolist() == [2, 2]
    assert (found["probability_lower"] <= found["probability"]).all()
    assert "| no joint | 0 | " in design.table(found)
    text = (tmp_path / "choices.toml").read_text(encoding="utf-8").replace(design.ASKED, design.REPAIRS)
    (tmp_path / "choices.toml").write_text(text, encoding="utf-8")
    by_cost = search_design(tmp_path / "choices.toml", tmp_path / "out")
    assert by_cost["cost"].values.tolist() == [0.0, 500.0]
    assert (by_cost["expected_cost"] >= by_cost["cost"]).all()
    assert "| joints: one between the windows | " in design.table(by_cost)


SIMPLE = STUDIES / "simple_methods"


@pytest.fixture(scope="module")
def simple() -> dict[str, ModuleType]:
    return modules("simple_methods", "walls", "compare", "picture", "run")


def test_the_readme_of_simple_methods_has_the_table_of_the_csv(simple: dict[str, ModuleType]) -> None:
    levels = pd.read_csv(SIMPLE / "agreement.csv")
    lines = (SIMPLE / "README.md").read_text(encoding="utf-8").splitlines()
    reached = pd.read_csv(SIMPLE / "capacities.csv")
    for line in [*simple["compare"].summary(levels), *simple["compare"].cracked(reached)]:
        assert line in lines


def test_what_the_wall_of_a_dpc_does_the_simple_methods_do_not_see(simple: dict[str, ModuleType]) -> None:
    """The finding of the study on one small wall: the wall rides on its dpc, and the beam is said to break."""
    walls, settings = simple["walls"], simple["walls"].read_settings() | {"increments": 4}
    path = simple["run"].path_of(walls.Case(4.0, 2.4, True, "doming", "none", 1.0), settings)
    last = path.iloc[-1]
    assert last["category"] == 0
    assert last["dpc_opening"] > 5e-3
    assert last["beam_category"] >= 3
    expected = beam_strain(1 / 300, 4.0, 2.4, "doming", 2 * (1 + Scene().block.poisson_ratio)).largest
    assert last["beam_strain"] == pytest.approx(float(expected))


@pytest.mark.slow
def test_quick_form_of_simple_methods(simple, tmp_path, monkeypatch) -> None:
    run = simple["run"]
    monkeypatch.setattr(sys, "argv", ["run.py", "--quick", "--output", str(tmp_path), "--at-most", "3"])
    assert run.main() == 0
    first = pd.read_csv(tmp_path / "results" / "paths.csv")
    assert not (tmp_path / "agreement.csv").exists()
    monkeypatch.setattr(sys, "argv", ["run.py", "--quick", "--output", str(tmp_path)])
    assert run.main() == 0
    paths = pd.read_csv(tmp_path / "results" / "paths.csv")
    pd.testing.assert_frame_equal(paths.iloc[: len(first)], first, check_dtype=False)  # 0 or 0.0 in a file
    assert len(paths) == 8 * 41
    levels = pd.read_csv(tmp_path / "agreement.csv")
    assert len(levels) == 8 * 5
    riding = levels[levels["dpc"]]
    assert (riding["difference"] > 0).mean() > 0.8
    assert (tmp_path / "diagram.png").stat().st_size > 20_000


def known_bank(normal: np.ndarray, factor: float = 1.0) -> walls.Bank:
    """Return walls whose capacities are lognormal, median 1 mm times a factor, dispersion 0.4; known within steps."""
    capacity = factor * 1e-3 * np.exp(0.4 * normal)
    upper = 0.05e-3 * np.ceil(capacity / 0.05e-3)
    return walls.Bank(upper - 0.05e-3, upper, np.ones_like(upper))


@pytest.mark.thorough
def test_errors_of_walls_with_a_known_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(errors, "DRAWS", 120)
    monkeypatch.setattr(errors, "powers", lambda a, b: [n for n in (64, 256, 1024) if n <= b])
    random = np.random.default_rng(1).standard_normal((1, 8192))
    points = np.array([unit_points("sobol", 1, 256, seed)[:, 0] for seed in range(16)])
    banks = {
        "random": known_bank(random),
        "sobol": known_bank(special.ndtri(points)),
        "two contacts": known_bank(random, 1.08),
    }
    cost = pd.Series({"random": 0.02})
    rows = pd.DataFrame(errors.curve_rows(banks, cost))
    median = rows[rows["question"] == "median"].set_index(["method", "walls"])
    assert median.loc[("random", 64), "truth"] == pytest.approx(1e-3, rel=0.01)
    # of a lognormal's median: dispersion over the root of the number of walls
    for n in (64, 256, 1024):
        assert median.loc[("random", n), "error"] == pytest.approx(0.4 / math.sqrt(n), rel=0.2)
    assert median.loc[("Sobol", 256), "error"] < 0.2 * median.loc[("random", 256), "error"]
    gains = summary.with_gain(rows.assign(wall="joints")).set_index(["method", "walls"])["gain"]
    assert gains["random", 1024] == pytest.approx(1.0, rel=0.3)
    assert gains["Sobol", 256] > 10.0
    floors = pd.DataFrame(errors.floors_of("joints", banks)).set_index("what")
    assert floors.loc["two contacts", "difference"] == pytest.approx(0.08, abs=0.005)
    assert abs(floors.loc["lognormal form", "difference"]) < 4 * floors.loc["lognormal form", "error"] + 1e-3


@pytest.mark.slow
def test_the_small_form_of_the_benchmark_of_probabilities_runs(tmp_path: Path) -> None:
    call = [sys.executable, str(STUDIES / "benchmarks/probabilities/run.py"), "--quick", "--output", str(tmp_path)]
    done = subprocess.run(call, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    rows = pd.read_csv(tmp_path / "data.csv")
    assert {"random", "Sobol", "Latin hypercube"} <= set(rows["method"])
    sets = pd.read_csv(tmp_path / "results" / "sets.csv").set_index("set")["walls"]
    assert sets.to_dict() == {"random": 24, "sobol": 16, "lhs 8": 16, "rare random": 24, "importance": 16}
    # of the order of the small probability that many random walls find
    assert 1e-4 < pd.read_csv(tmp_path / "results" / "subset.csv")["probability"][0] < 0.1
    again = subprocess.run(call, capture_output=True, text=True)  # nothing is solved twice
    assert again.returncode == 0
    assert " of " not in again.stderr
    assert list(pd.read_csv(tmp_path / "data.csv")["error"]) == list(rows["error"])


def study(paths: list[list[int]], status: list[int]) -> xr.Dataset:
    category = np.array(paths, dtype=np.int8)
    both = ("sample", "increment")
    return xr.Dataset(
        {"damage_category": (both, category), "status": ("sample", np.array(status, dtype=np.int8))},
        coords={"surface_movement": (both, np.zeros(category.shape), {"units": "m"}), "sample": np.arange(len(paths))},
    )


def test_shares_leave_out_what_is_not_known_and_bound_what_never_happened() -> None:
    stripes = modules("soil_movement", "stripes")["stripes"]
    rows = stripes.shares(study([[0, 2, 2], [0, 0, 0], [0, 1, -1], [0, 0, 0]], [COMPLETE, COMPLETE, FAILED, COMPLETE]))
    assert [(r["reached"], r["walls"]) for r in rows] == [(2, 4), (1, 3), (0, 3), (0, 3)]
    assert all(r["lower"] <= r["share"] <= r["upper"] for r in rows)
    # Wilson's bound for none of three at 90 %: z^2 / (n + z^2), z = 1.645
    assert rows[2]["upper"] == pytest.approx(1.6449**2 / (3 + 1.6449**2), rel=1e-4)
    assert {r["failed"] for r in rows} == {1}


def test_a_heavier_footing_bends_less() -> None:
    run = modules("soil_movement", "stripes", "run")["run"]
    bent = {}
    for footing in ("light", "full_masonry"):
        wall = damagepred.solve(run.settings(footing, "doming", 40.0).scene)
        assert wall.attrs["status"] == "complete"
        bent[footing] = float(np.ptp(wall["central_deflection"].values))
    assert 0 < 1.3 * bent["full_masonry"] < bent["light"]


@pytest.mark.parametrize("kind", ["dishing", "doming"])
def test_softer_soil_bends_the_footing_less(kind: str) -> None:
    """So a stiffness that is too small is unsafe."""
    scene = modules("soil_movement", "stripes", "run")["run"].settings("veneer", kind, 20.0).scene
    scene = replace(scene, solver=scene.solver.with_accuracy("draft"), movement=replace(scene.movement, increments=1))
    bent = []
    for stiffness in (1e6, 4e6):
        soil = replace(scene.soil, swelling_stiffness=stiffness, shrinking_stiffness=stiffness)
        ends = damagepred.solve(replace(scene, soil=soil))["block_displacement_y"].values
        bent.append(float(np.ptp(ends[-1] - ends[0])))
    assert 0 < 1.2 * bent[0] < bent[1]
