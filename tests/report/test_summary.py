"""The answer in short, on paper and on the first page, against counts and curves made beforehand."""

import re
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from damagepred import Load, Loading, Movement, Opening, Solver, Wall, plotting, solve
from damagepred.archive.folder import StudyFolder, open_study
from damagepred.archive.provenance import given_values
from damagepred.campaign.settings import StudySettings, read_frozen
from damagepred.errors import InputError
from damagepred.report import write_report
from damagepred.report.answers import comparison_answer, estimate_answer, posterior_answer
from damagepred.report.inputs import input_section
from damagepred.report.parts import Text
from damagepred.report.study import study_page
from damagepred.report.summary import answers, influences, wall_summary
from damagepred.results.tables import Table
from damagepred.scene import Report, Scene
from damagepred.uq.estimate import Estimate
from damagepred.uq.movement_distribution import MOUND, movement_distribution
from tests.conftest import SMALL_STUDY
from tests.report.test_contents import table
from tests.synthetic_studies import synthetic_study


@pytest.fixture
def study(tmp_path: Path) -> tuple[xr.Dataset, StudySettings]:
    folder = synthetic_study(tmp_path / "house.dp", 200)
    return open_study(folder), read_frozen(StudyFolder(folder).study_text())


def test_a_site_class_and_a_single_surface_movement_are_named(study: tuple[xr.Dataset, StudySettings]) -> None:
    ds, _ = study
    moved = ds.assign({MOUND: 20 * ds["central_deflection"]})
    moved[MOUND].attrs.update(ds["central_deflection"].attrs)
    moved.attrs["movement_measure"] = MOUND
    question, _ = answers(moved, movement_distribution("H1"))
    assert question == "For site class H1 (y_s is taken as evenly distributed from 40 to 60 mm):"
    question, _ = answers(moved, "55 mm")
    assert question == "At a surface movement y_s of 55 mm, site class H1:"


def test_the_input_that_decides_is_named_and_others_are_not(study: tuple[xr.Dataset, StudySettings]) -> None:
    ds, _ = study
    _, found = answers(ds, "3 mm")
    random = np.random.default_rng(3)
    reached = (ds["damage_category"].values >= 1).argmax(axis=1)
    capacity = np.where((ds["damage_category"].values >= 1).any(axis=1), reached, 99) + 0.1 * random.random(200)
    inputs = [name for name, v in ds.data_vars.items() if v.attrs.get("role") == "input" and v.dims == ("sample",)]
    others = [str(name) for name in inputs if not str(name).startswith("movement.")]
    ds[others[0]].values[:] = -capacity
    said, section = influences(ds, found)
    assert "more of it harms" in said
    assert said.count("more of it") == 1 + said.count("more of it protects")
    assert section.parts[0].rows[0][0] == others[0]
    assert not any(row[0].startswith("movement.") for row in section.parts[0].rows)


def test_an_input_that_moves_the_ground_harms_at_its_own_ground_and_protects_nowhere(tmp_path: Path) -> None:
    """Capacities are made independent of the end of each wall's movement, which a suction sets here."""
    ds = open_study(synthetic_study(tmp_path / "house.dp", 200, medians=(3e-3, 7e-3)))
    _, found = answers(ds)
    end = ds["movement.central_deflection"].values
    ds = ds.drop_vars("movement.central_deflection").assign({"suction.change": ("sample", end, {"role": "input"})})
    said, section = influences(ds, found, own_ground=True)
    assert re.match(r"What changes the answer most: suction: change \(0.\d+, more of it harms\)", said)
    assert "with damage of category" in said
    (shown,) = section.parts
    assert shown.caption.startswith("Inputs and damage of category")
    assert any(row[0] == "suction.change" for row in shown.rows)


def test_a_movement_for_one_wall_is_refused(tmp_path: Path, wall: xr.Dataset) -> None:
    from damagepred.archive.files import write_dataset

    write_dataset(wall, tmp_path / "wall.nc")
    with pytest.raises(InputError, match="class H1: goes with a study"):
        write_report(tmp_path / "wall.nc", at=movement_distribution("H1"))


PIER = Scene(
    wall=Wall(length=1.2, height=0.9, block_length=0.4, block_height=0.15),
    opening=(Opening(x=0.4, y=0.3, width=0.4, height=0.3),),
    movement=Movement(shape="loads", increments=3),
    load=(Load(direction="along"),),
    loading=Loading(control="displacement", displacement="3 mm", beam="free"),
    solver=Solver(blocks="rigid"),
)


@pytest.fixture(scope="module")
def pier() -> xr.Dataset:
    return solve(PIER)


def test_sentences_and_pictures_name_them(pier: xr.Dataset) -> None:
    assert "reached at a load displacement of 1 mm" in wall_summary(pier)[0]
    assert plotting.draw(pier, "opening_width_change").get_xlabel() == "load displacement (mm)"


HEAD = '[report]\nproject = "12 Acacia Avenue"\nclient = "A. Owner"\ndate = 2026-11-28\nrevision = "B"\n'


def test_the_head_of_the_report_is_no_part_of_the_study(tmp_path: Path) -> None:
    """It stands in the manifest, so that the same study may get another revision."""
    plain_study, headed = (tmp_path / f"{name}.toml" for name in ("plain", "headed"))
    plain_study.write_text(SMALL_STUDY, encoding="utf-8")
    headed.write_text(HEAD + SMALL_STUDY, encoding="utf-8")
    without, with_head = StudySettings.from_toml(plain_study), StudySettings.from_toml(headed)
    assert with_head.report == Report(project="12 Acacia Avenue", client="A. Owner", date="2026-11-28", revision="B")
    assert with_head.to_toml() == without.to_toml()
    of_scene = SMALL_STUDY.replace("[scene.wall]", '[scene.report]\nclient = "C"\nauthor = "D"\n[scene.wall]')
    headed.write_text(HEAD + of_scene, encoding="utf-8")
    both = StudySettings.from_toml(headed)
    assert (both.report.client, both.report.author) == ("A. Owner", "D")
    assert both.to_toml() == without.to_toml()
    folder = StudyFolder(synthetic_study(tmp_path / "house.dp", 6))
    folder.write_manifest({**folder.manifest(), "report": {"project": "12 Acacia Avenue"}})
    assert study_page(folder, "today", replay=False, bootstrap=10).head == {"project": "12 Acacia Avenue"}


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ('date = "11/28/2026"', "must be a date such as"),
        ("date = 2026-11-28T10:00:00", "must be a date such as"),
        ('client = "a\\u0007b"', "control characters"),
        ('custommer = "x"', "report takes project, client, author, date, revision"),
    ],
)
def test_a_head_that_cannot_be_is_refused(line: str, words: str, tmp_path: Path) -> None:
    (tmp_path / "wall.toml").write_text(f"[report]\n{line}\n", encoding="utf-8")
    with pytest.raises(InputError, match=words):
        Scene.from_toml(tmp_path / "wall.toml")


def test_inputs_have_the_units_of_the_file(tmp_path: Path) -> None:
    text = SMALL_STUDY.replace("[scene.wall]", '[scene.soil]\nshrinking_stiffness = "4000 kPa/m"\n[scene.wall]')
    (tmp_path / "wall.toml").write_text(
        '[wall]\nlength = "250 cm"\nheight = 0.9\n[joint]\nnormal_stiffness = "82 N/mm3"\n'
        'tensile_strength = "450 kPa"\n'
        '[dpc]\nfriction = "50 %"\n',
        encoding="utf-8",
    )
    scene = Scene.from_toml(tmp_path / "wall.toml")
    section = input_section(scene, attributes=given_values(scene.given))
    shown = table(section, "The wall")
    rows = {(group, row[0]): row[1:3] for group, row in zip(shown.groups, shown.rows)}
    assert rows["Wall", "length"] == ["250", "cm"]
    assert rows["Wall", "height"] == ["0.9", "m"]
    assert rows["Mortar joints", "normal stiffness"] == ["82", "N/mm³"]
    assert rows["Mortar joints", "tensile strength"] == ["450", "kPa"]
    assert rows["Damp-proof course", "friction"] == ["50", "%"]
    settings = StudySettings.from_dict(tomllib.loads(text))
    variable = replace(settings.variables["movement.central_deflection"], lower="0.6 cm", upper="0.9 cm")
    uncertain = input_section(scene, replace(settings, variables={"movement.central_deflection": variable}))
    assert table(uncertain, "What is uncertain").rows[0][1:4:2] == ["uniform: lower 0.6, upper 0.9", "cm"]


def test_measures_are_compared_on_the_first_page(tmp_path: Path) -> None:
    house, strong = (synthetic_study(tmp_path / f"{name}.dp", 40) for name in ("house", "strong"))
    page = study_page(StudyFolder(house), "today", replay=False, bootstrap=10, measures=[strong])
    (rows,) = (part.rows for part in page.first if isinstance(part, Table))
    assert [row[0] for row in rows] == ["house", "strong"]
    assert rows[0][1] == rows[1][1]
    assert rows[1][2].startswith("+0.00")
    (said,) = (part.paragraphs[0] for part in page.first if isinstance(part, Text))
    assert said.startswith("No measure is sure to lower the probability of category")
    with pytest.raises(InputError, match="each study needs a name of its own"):
        study_page(StudyFolder(house), "today", replay=False, bootstrap=10, measures=[house])


def comparison(*differences: tuple[float, float, float]) -> xr.Dataset:
    """Comparison of a category at one movement: reference 0.5, and a measure for each difference with its interval."""
    names = ["as it is", "joint", "deep"][: len(differences) + 1]
    value, lower, upper = (np.array([0.0, *column]).reshape(-1, 1, 1) for column in zip(*differences))
    dims = ("study", "category", "movement")
    variables = {"difference": value, "difference_lower": lower, "difference_upper": upper, "probability": 0.5 + value}
    return xr.Dataset(
        {name: (dims, array) for name, array in variables.items()},
        {"study": names, "category": [2], "movement": [0.01]},
        {"confidence": 0.9, "reference": "as it is"},
    )


@pytest.mark.parametrize(
    ("differences", "said"),
    [
        (
            [(-0.043, -0.07, -0.009), (-0.03, -0.058, -0.025)],
            "Lower than 0.50, the probability of category 2 or worse: joint to 0.46; deep to 0.47. Their intervals "
            "overlap: which of them helps most is not known.",
        ),
        (
            [(-0.4, -0.5, -0.3), (-0.1, -0.2, -0.05)],
            "Lower than 0.50, the probability of category 2 or worse: joint to 0.10; deep to 0.40. joint helps most.",
        ),
        (
            [(-0.4, -0.5, -0.3), (-0.1, -0.2, 0.05)],
            "Lower than 0.50, the probability of category 2 or worse: joint to 0.10. The other measures may change it "
            "by chance alone.",
        ),
        (
            [(0.1, 0.05, 0.2)],
            "No measure is sure to lower the probability of category 2 or worse from 0.50. joint raises it.",
        ),
    ],
)
def test_a_measure_helps_most_only_where_intervals_part(differences: list[tuple[float, ...]], said: str) -> None:
    assert comparison_answer(comparison(*differences), 2, 0.01) == said


def test_without_damage_an_answer_names_the_upper_limit() -> None:
    none = comparison((0.0, -0.1, 0.1))
    none = none.assign(probability=0.0 * none["probability"], probability_upper=none["probability"] * 0.0 + 0.078)
    assert comparison_answer(none, 2, 0.01) == (
        "No sample of the studies reached category 2; its probability is at most 0.078 in each."
    )


def test_an_estimate_is_a_number_of_walls() -> None:
    def said(value: float) -> str:
        estimate = Estimate(value, 0.05, 0.31, 0.51, 0.9, 64, 64.0)
        return estimate_answer(estimate, "2 or worse at 25 mm", "wall")

    assert said(0.41) == (
        "Category 2 or worse at 25 mm: probability 0.41 (90% interval 0.31 to 0.51), about 41 walls in 100."
    )
    assert said(0.0).endswith(", none of the walls.")
    assert said(1.0).endswith(", all of the walls.")
    assert said(0.004).endswith(", fewer than 1 wall in 100.")


def posterior(odds: float, another: float, cut: float = 0.0) -> xr.Dataset:
    study = ("study", "further", "category")
    lower = np.array([[[1.0, 0.7, 0.0]], [[0.5, 0.2, 0.1]]]).repeat(2, axis=1)
    return xr.Dataset(
        (
            {"posterior_odds": ("study", [odds, 0.1 if np.isfinite(odds) else np.nan])}
            | {"another_cause_odds": ((), another), "resembles": ("study", [1, 1])}
            | {"movement_quantile": (("study", "quantile"), 1e-3 * np.array([[40.0, 45, 50, 55, 60]] * 2))}
            | {"movement_words": ("study", ["ground movement at the tree"] * 2)}
            | {"movement_units": ("study", ["m", "m"]), "movement_largest": ("study", [0.06, 0.06])}
            | {"movement_cut": ("study", [cut, 0.0]), "future_probability_lower": (study, lower)}
            | {"future_probability_upper": (study, lower + np.array([0.0, 0.1, 0.2]))}
        ),
        {"study": ["tree", "pipe"], "further": [0.0, 0.5], "category": [1, 2, 3]},
    )


def test_a_back_analysis_names_cause_movement_and_what_follows() -> None:
    assert posterior_answer(posterior(20.0, 0.05)) == (
        "Most probably tree (odds 20): ground movement at the tree of 50 mm (40 to 60). After 30 mm more, category 2 "
        "or worse has a probability of 0.70 to 0.80."
    )
    assert "(40 to 60 or more)" in posterior_answer(posterior(20.0, 0.05, cut=0.5))
    assert posterior_answer(posterior(2.0, 8.0)).startswith("Most probably another cause")
    assert posterior_answer(posterior(np.nan, np.nan)).startswith("No cause can be named yet")
    alien = posterior(20.0, 0.05).assign(resembles=("study", [0, 0]))
    assert posterior_answer(alien).startswith("No cause can be named: no stored sample resembles")


def test_few_damaged_walls_rank_no_input(tmp_path: Path) -> None:
    """Two damaged walls of 32 gave shares of variance below 0 on the first page."""
    ds = open_study(synthetic_study(tmp_path / "house.dp", 32, medians=(12e-3, 30e-3), own_movements=False))
    damaged = int((ds["damage_category"].values.max(axis=1) >= 1).sum())
    assert 0 < damaged < 10
    said, section = influences(ds, answers(ds)[1])
    assert section is None
    assert said == (
        f"What changes the answer most for category 1 (very slight) is not known: {damaged} of 32 samples reached it, "
        "and a ranking of inputs needs 10 or more; run more samples, or take another category."
    )


def test_the_ground_of_a_soil_log_is_named_with_its_site_classes(study: tuple[xr.Dataset, StudySettings]) -> None:
    ds, _ = study
    moved = ds.assign({MOUND: 8 * ds["central_deflection"]})
    moved[MOUND].attrs.update(ds["central_deflection"].attrs)
    ends = moved[MOUND].values.max(axis=1)
    shares = [float(np.mean((ends > low) & (ends <= high))) for low, high in ((0.04, 0.06), (0.06, 0.075))]
    assert sum(shares) == pytest.approx(1.0)
    question, _ = answers(moved)
    assert question == (
        f"At the end of each wall's own movement, a surface movement y_s of {1e3 * ends.min():.3g} mm to "
        f"{1e3 * ends.max():.3g} mm, median {1e3 * np.median(ends):.3g} mm; walls by site class: "
        f"H1 {shares[0]:.0%}, H2 {shares[1]:.0%}:"
    )
