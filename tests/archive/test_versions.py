"""A study made by the first version of the archive is read, resumed and extended; the registry of variables."""

import json
import re
import shutil
import tomllib
import warnings
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pint
import pytest
import xarray as xr

from damagepred.archive import schema
from damagepred.archive.folder import StudyFolder, open_study
from damagepred.archive.schema import CATEGORIES, FLAG_FILL, SCHEMA_VERSION, VARIABLES, Variable, dataset
from damagepred.archive.versions import MIGRATIONS, brought_up_to_date
from damagepred.campaign.campaign import Campaign
from damagepred.campaign.replay import replay
from damagepred.campaign.settings import StudySettings, read_frozen
from damagepred.campaign.status import study_status
from damagepred.damage import load_table
from damagepred.errors import InputError, StudyError
from damagepred.scene import Scene
from damagepred.study import Study

OLD = Path(__file__).parent / "version_1"
"""Written by version 1: two solved samples, and one that took too long."""
RIGID = Path(__file__).parent / "version_8"
"""Written by version 8 from ``version_8.toml``, which states no bricks: two walls of rigid bricks."""


@pytest.fixture
def old(tmp_path: Path) -> Path:
    return Path(shutil.copytree(OLD, tmp_path / "old.dp"))


def test_there_is_a_way_from_every_version() -> None:
    assert set(MIGRATIONS) == set(range(1, SCHEMA_VERSION))


@pytest.mark.parametrize(
    ("attrs", "violation", "newton", "cycles"),
    [
        ({"solver_method": "quasi_static"}, None, [[2, 9], [3, -1]], [[0, 0], [0, -1]]),
        ({"solver_method": "explicit"}, None, [[0, 0], [0, -1]], [[2, 9], [3, -1]]),
        ({"solver_method": "dynamic"}, None, [[0, 0], [0, -1]], [[2, 9], [3, -1]]),
        ({}, [[0.0, 0.0], [np.nan, np.nan]], [[2, 9], [0, -1]], [[0, 0], [3, -1]]),
    ],
)
def test_cycles_of_version_4_are_split_by_the_solver(attrs, violation, newton, cycles) -> None:
    both = ("sample", "increment")
    ds = xr.Dataset({"cycles": (both, np.array([[2, 9], [3, -1]]))}, attrs=attrs)
    if violation is not None:
        ds["joint_law_violation"] = both, violation
    now = brought_up_to_date(4, "old.nc", ds)
    assert now["newton_iterations"].values.tolist() == newton
    assert now["cycles"].values.tolist() == cycles
    assert "Newton" in now["newton_iterations"].attrs["long_name"]
    assert "Newton" not in now["cycles"].attrs["long_name"]


@pytest.mark.parametrize("dims", [("increment",), ("sample", "increment")])
def test_the_widest_crack_so_far_of_version_6_has_its_name_of_today(dims: tuple[str, ...]) -> None:
    values = np.ones((2,) * len(dims))
    now = brought_up_to_date(6, "old.nc", xr.Dataset({"worst_crack_width": (dims, values, {"units": "m"})}))
    assert list(now.data_vars) == ["crack_width_worst"]
    assert now["crack_width_worst"].values.tolist() == values.tolist()
    assert now["crack_width_worst"].attrs["units"] == "m"


def test_an_old_study_is_extended_and_its_parts_are_left(old: Path) -> None:
    before = {p.name: p.read_bytes() for p in (old / "parts").iterdir()}
    archived, mixed = open_study(old), study_status(old).cautions
    study = Study.from_folder(old)
    with ThreadPoolExecutor(1) as executor:
        with pytest.raises(StudyError, match=r"were solved by an older version .* with --mix-versions"):
            study.run(old, samples=4, executor=executor)
        assert study_status(old).cautions == mixed
        summary = study.run(old, samples=4, executor=executor, mix_versions=True)
    assert any("samples were solved by 2 programs" in line for line in study_status(old).cautions)
    assert (summary.done, summary.failed) == (4, 1)
    for name, content in before.items():
        assert (old / "parts" / name).read_bytes() == content
    assert StudyFolder(old).manifest()["schema_version"] == SCHEMA_VERSION  # an older program must not write any more
    ds = open_study(old)
    assert ds["status"].values.tolist() == [0, 0, 2, 0]
    np.testing.assert_array_equal(ds["crack_width_max"].values[:2], archived["crack_width_max"].values[:2])
    # solved by today's program it is the same but for the steps: the movement at which a bond breaks is found to 1 % of
    # its strength
    with ThreadPoolExecutor(1) as executor:
        study.run(old.with_name("new.dp"), samples=2, executor=executor)
    new = open_study(old.with_name("new.dp"))
    np.testing.assert_allclose(new["crack_width_max"].values, ds["crack_width_max"].values[:2], rtol=1e-4, atol=1e-12)


@pytest.mark.parametrize(
    ("version", "words"),
    [
        (
            SCHEMA_VERSION + 1,
            f"schema version {SCHEMA_VERSION + 1}, this damagepred reads up to {SCHEMA_VERSION}; update",
        ),
        ("2", "has no schema_version"),
        (None, "has no schema_version"),
    ],
)
def test_a_study_of_another_age_is_refused_before_anything_is_written(old: Path, version: object, words: str) -> None:
    manifest = {**StudyFolder(old).manifest(), "schema_version": version}
    (old / "manifest.json").write_text(json.dumps(manifest))
    before = {p: p.read_bytes() for p in old.rglob("*") if p.is_file()}
    study = Study.from_folder(OLD)
    for attempt in (lambda: open_study(old), lambda: study.run(old, samples=5)):
        with pytest.raises(InputError, match=words):
            attempt()
    assert {p: p.read_bytes() for p in before} == before


def _unfinished(folder: Path) -> Path:
    """Copy of the folder of version 8, without its second wall."""
    copy = Path(shutil.copytree(RIGID, folder / "rigid.dp"))
    (copy / "parts" / "sample-00000001.nc").unlink()
    return copy


def test_a_file_without_bricks_resumes_a_folder_of_rigid_bricks_with_rigid_bricks(tmp_path: Path) -> None:
    file, folder = RIGID.with_suffix(".toml"), _unfinished(tmp_path)
    study, width = Study.from_toml(file), open_study(RIGID)["crack_width_max"].values
    with ThreadPoolExecutor(1) as executor:
        with pytest.warns(UserWarning, match=r"bricks of this folder are rigid, the default of the version that made"):
            study.run(folder, executor=executor, mix_versions=True)
        study.run(tmp_path / "new.dp", samples=1, executor=executor)  # the same object: today's default
    ds, new = open_study(folder), open_study(tmp_path / "new.dp")
    np.testing.assert_allclose(ds["crack_width_max"].values, width, rtol=1e-4, atol=1e-12)
    assert new["crack_width_max"].values.max() > 1.1 * width[0].max()
    assert [tomllib.loads(d.attrs["scene"])["solver"]["blocks"] for d in (ds, new)] == ["rigid", "elastic"]
    assert (folder / "study.toml").read_bytes() == (RIGID / "study.toml").read_bytes()


@pytest.mark.parametrize(
    ("solver", "refused"),
    [
        ('blocks = "rigid"', False),
        ('accuracy = "standard"', False),
        ('blocks = "elastic"', True),
        ('accuracy = "fine"', True),
    ],
)
def test_a_file_that_states_its_bricks_resumes_a_folder_of_the_same_bricks(tmp_path: Path, solver: str, refused: bool):
    file = tmp_path / "stated.toml"
    file.write_text(RIGID.with_suffix(".toml").read_text() + f"[scene.solver]\n{solver}\n")
    folder = Path(shutil.copytree(RIGID, tmp_path / "rigid.dp"))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        if not refused:
            assert Study.from_toml(file).run(folder).done == 2
            return
        with pytest.raises(StudyError, match=r"scene.solver.blocks \(was 'rigid', is 'elastic'\)\n.* the keys back"):
            Study.from_toml(file).run(folder)


def test_alternatives_of_an_older_search_do_not_mix_bricks(tmp_path: Path) -> None:
    settings = StudySettings.from_toml(RIGID.with_suffix(".toml"))
    with pytest.raises(StudyError, match=r"scene.solver.blocks \(was 'rigid', is 'elastic'\)"):
        Campaign(settings).run(_unfinished(tmp_path))


def test_a_sample_of_rigid_bricks_is_replayed_with_rigid_bricks() -> None:
    wall, stored = replay(RIGID, 1)[0], open_study(RIGID)
    assert Scene.from_dict(tomllib.loads(wall.attrs["scene"])).solver.blocks == "rigid"
    width = stored["crack_width_max"].values[1]
    np.testing.assert_allclose(wall["crack_width_max"].values, width[: len(wall["increment"])], rtol=1e-4, atol=1e-12)


@pytest.mark.parametrize(("version", "blocks"), [(7, "rigid"), (8, "rigid"), (SCHEMA_VERSION, "elastic")])
def test_a_scene_without_bricks_has_those_of_its_version(version: int, blocks: str) -> None:
    text = (RIGID / "study.toml").read_text()
    for line in ('accuracy = "standard"\n', 'blocks = "rigid"\n'):
        assert line in text
        text = text.replace(line, "")
    settings = read_frozen(text.replace("schema_version = 8", f"schema_version = {version}"))
    assert settings.scene.solver.blocks == blocks
    ds = brought_up_to_date(version, "old.nc", xr.Dataset(attrs={"scene": "[wall]\nlength = 2.4\n"}))
    assert Scene.from_dict(tomllib.loads(ds.attrs["scene"])).solver.blocks == blocks


UNITS = pint.UnitRegistry()


@pytest.mark.parametrize("name", VARIABLES)
def test_every_variable_says_what_it_is(name: str):
    variable = VARIABLES[name]
    assert re.fullmatch(r"[a-z][a-z0-9_]*", name)
    assert len(variable.long_name) > 5
    assert variable.long_name == variable.long_name.strip()
    attributes = variable.attributes()
    if attributes.get("cf_role") == "mesh_topology":
        return  # has no values of its own
    assert bool(variable.flags) != (variable.units is not None), "either a unit or flags"
    assert attributes["long_name"] == variable.long_name
    if variable.flags:
        assert "units" not in attributes
        assert attributes["flag_values"].dtype == np.int8
        assert attributes["flag_values"].tolist() == list(range(len(variable.flags)))
        assert attributes["flag_meanings"].split() == list(variable.flags)
        assert len(set(variable.flags)) == len(variable.flags)
        assert all(re.fullmatch(r"[A-Za-z0-9_\-.+@]+", flag) for flag in variable.flags)  # CF: blank-separated words
        assert int(FLAG_FILL) not in range(len(variable.flags))
    else:
        # UDUNITS writes a power as a number behind the unit
        UNITS.parse_units(
            re.sub(r"(?<=[a-z])-(?=\d)", "**-", attributes["units"]) if attributes["units"] != "1" else ""
        )


def test_flags_mean_what_the_code_means():
    kinds = "bed_joint head_joint dpc footing_interface soil support footing_section control_joint brick_joint"
    for name, words in {
        "contact_kind": kinds,
        "contact_state": "intact cracked slipping",
        "zone_state": "elastic shear tension shear_and_tension yielded",
        "status": "complete collapsed failed missing",
    }.items():
        assert VARIABLES[name].attributes()["flag_meanings"] == words
    for table in ("as2870", "bre251"):
        names = tuple(n.replace(" ", "_") for n in load_table(table).category_names)
        assert names == CATEGORIES[: len(names)]


def test_unregistered_names_are_refused_unless_described():
    with pytest.raises(KeyError, match="joint_colour"):
        dataset({"joint_colour": [1.0]}, {})
    extra = {"joint.cohesion": Variable(("sample",), "Pa", "sampled cohesion")}
    ds = dataset({"sample": [0], "joint.cohesion": [1e5]}, {}, extra=extra)
    assert ds["joint.cohesion"].attrs == {"units": "Pa", "long_name": "sampled cohesion"}


@pytest.mark.parametrize("table", ["as2870", "bre251"])
def test_categories_bear_the_names_of_their_table(table: str):
    ds = dataset({"increment": [0], "damage_category": np.zeros(1, np.int8)}, {})
    content = load_table(table)
    schema.name_categories(ds, content.category_names, content.source)
    attrs = ds["damage_category"].attrs
    assert len(attrs["flag_meanings"].split()) == len(content.category_names) == len(attrs["flag_values"])
    assert attrs["comment"] == content.source
