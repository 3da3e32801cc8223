"""First page of a report: head for the file, measures compared; units of the file."""

import tomllib
from dataclasses import replace
from pathlib import Path

import pytest

from damagepred.archive.folder import StudyFolder
from damagepred.archive.provenance import given_values
from damagepred.campaign.settings import StudySettings
from damagepred.errors import InputError
from damagepred.report.inputs import input_section
from damagepred.report.parts import Text
from damagepred.report.study import study_page
from damagepred.results.tables import Table
from damagepred.scene import Report, Scene
from tests.conftest import SMALL_STUDY
from tests.report.test_contents import table
from tests.synthetic_studies import synthetic_study

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
