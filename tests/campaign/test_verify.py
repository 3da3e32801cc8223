"""Damage to a study folder is detected, reported and repaired; no bit changes a value silently."""

import os
import random
import shutil
import tomllib
import warnings
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from damagepred.archive.digest import signed_json
from damagepred.archive.files import read_dataset, write_dataset
from damagepred.archive.folder import StudyFolder, open_study
from damagepred.archive.parts import read_part, write_part
from damagepred.campaign import sample
from damagepred.campaign.settings import StudySettings
from damagepred.campaign.status import study_status
from damagepred.campaign.verify import repair, verify
from damagepred.errors import ArchiveWarning, InputError, StudyError
from damagepred.study import Study
from tests.campaign.test_run import same
from tests.cli.conftest import Run, command  # noqa: F401
from tests.conftest import SMALL_STUDY

TEXT = SMALL_STUDY.replace("length = 1.44", "length = 0.96").replace("increments = 6", "increments = 2")
SAMPLES = 4


def run(folder: Path, text: str = TEXT, samples: int = SAMPLES, **more: bool) -> None:
    with ThreadPoolExecutor(1) as executor:
        Study(StudySettings.from_dict(tomllib.loads(text))).run(folder, samples, executor=executor, **more)


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("done") / "study.dp"
    run(folder, samples=SAMPLES - 1)
    StudyFolder(folder).record_failure(SAMPLES - 1, "timeout", "took long", {})
    run(folder)
    return folder


@pytest.fixture(scope="module")
def other(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("other") / "study.dp"
    run(folder, TEXT.replace("seed = 7", "seed = 8"))
    return folder


@pytest.fixture
def folder(done: Path, tmp_path: Path) -> StudyFolder:
    return StudyFolder(shutil.copytree(done, tmp_path / "study.dp"))


def files(folder: Path) -> list[Path]:
    return sorted(f for f in folder.rglob("*") if f.is_file() and not f.name.startswith("."))


def read_or_refused(folder: Path) -> tuple[dict[str, np.ndarray], list[str]]:
    """Return the values of the samples that have one, and the messages."""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        try:
            ds = open_study(folder)
        except InputError as error:
            return {}, [str(error)]
    known = ds["status"].values < 3
    values = {str(n): v.values[known] for n, v in ds.variables.items() if v.dims[:1] == ("sample",)}
    return values | {"known": np.flatnonzero(known)}, [str(one.message) for one in said]


@pytest.mark.thorough
def test_no_bit_changes_a_value_silently(folder: StudyFolder, done: Path) -> None:
    honest = open_study(done)
    luck = random.Random(1)
    for number in range(120):
        file = luck.choice(files(folder.path))
        before = file.read_bytes()
        content = bytearray(before)
        content[luck.randrange(len(content))] ^= 1 << luck.randrange(8)
        file.write_bytes(content)
        if number % 2:
            (folder.path / "results.nc").rename(folder.path.parent / "results.nc")
        values, said = read_or_refused(folder.path)
        assert all(len(line) < 1000 and "\n" not in line for line in said)
        for name in values.keys() - {"known"}:
            wanted = honest[name].values[values["known"]]
            np.testing.assert_array_equal(values[name], wanted, err_msg=f"{file.name} {name}")
        if len(values.get("known", ())) < SAMPLES:
            assert any(file.name in line for line in said), f"{file.name}: {said}"
        assert verify(folder.path).damaged or number % 2, f"{file.name} is not noticed by verify"
        if number % 2:
            (folder.path.parent / "results.nc").rename(folder.path / "results.nc")
        file.write_bytes(before)


def part(folder: StudyFolder) -> Path:
    found = folder.part_of(1)
    return found


def design_of_fewer(folder: StudyFolder, other: Path) -> None:
    write_dataset(folder.design().isel(sample=slice(SAMPLES - 1)), folder.design_file, folder.study_hash)


def pipe(folder: StudyFolder, other: Path) -> None:
    file = part(folder)
    file.unlink()
    os.mkfifo(file)


def another(file: str) -> Callable[[StudyFolder, Path], None]:
    return lambda folder, other: shutil.copy(other / file, folder.path / file) and None


def edit(file: str, old: bytes, new: bytes) -> Callable[[StudyFolder, Path], None]:
    def change(folder: StudyFolder, other: Path) -> None:
        content = (folder.path / file).read_bytes()
        assert old in content
        (folder.path / file).write_bytes(content.replace(old, new))

    return change


DAMAGE: dict[str, Callable[[StudyFolder, Path], object]] = {
    "manifest.json lost": lambda f, o: f.manifest_file.unlink(),
    "manifest.json not UTF-8": lambda f, o: f.manifest_file.write_bytes(b"\xff\xfe{"),
    "manifest.json a list": lambda f, o: f.manifest_file.write_text("[1]"),
    "manifest.json of another study": another("manifest.json"),
    "study.toml edited": edit("study.toml", b"seed = 7", b"seed = 9"),
    "study.toml without digest": lambda f, o: f.study_file.write_text(f.study_text().replace("seed = 7", "seed = 9")),
    "study.toml not UTF-8": lambda f, o: f.study_file.write_bytes(b"\xff\xfe"),
    "study.toml of another study": another("study.toml"),
    "design.nc empty": lambda f, o: f.design_file.write_bytes(b""),
    "design.nc of another study": another("design.nc"),
    "design.nc shortened": design_of_fewer,
    "results.nc empty": lambda f, o: f.results_file.write_bytes(b""),
    "results.nc of another study": another("results.nc"),
    "part empty": lambda f, o: part(f).write_bytes(b""),
    "part cut": lambda f, o: part(f).write_bytes(part(f).read_bytes()[:300]),
    "part without digest": lambda f, o: part(f).write_bytes(part(f).read_bytes().partition(b"\n# crc32")[0]),
    "part of another study": lambda f, o: shutil.copy(part(StudyFolder(o)), part(f)),
    "part of another sample": lambda f, o: part(f).rename(f.part_file(99_999_990, 99_999_993)),
    "part a pipe": pipe,
    "failure a list": lambda f, o: f.failure_file(SAMPLES - 1).write_text("[]"),
    "failure of another sample": lambda f, o: f.failure_file(SAMPLES - 1).write_text(
        signed_json({"sample": 0, "reason": "error", "message": "?"}, f.study_hash)
    ),
}


@pytest.mark.quick_cases
@pytest.mark.filterwarnings("ignore::damagepred.errors.ArchiveWarning")
@pytest.mark.timeout(120)
@pytest.mark.parametrize("damage", DAMAGE)
def test_damage_is_reported_and_repaired(damage, folder, done, other, monkeypatch) -> None:
    DAMAGE[damage](folder, other)
    if "part" in damage:
        folder.results_file.unlink()
    found = verify(folder.path)
    assert found.damaged, "verify sees it"
    assert all("\n" not in line for line in (*found.damaged, *found.differing, *found.notes))
    values, said = read_or_refused(folder.path)
    assert said, "so does whatever reads it"
    honest = open_study(done)
    for name in values.keys() - {"known"}:
        np.testing.assert_array_equal(values[name], honest[name].values[values["known"]])
    aside = repair(folder.path)
    assert aside
    assert not verify(folder.path).damaged
    assert not repair(folder.path), "nothing is left to repair"
    with warnings.catch_warnings():
        warnings.simplefilter("error", ArchiveWarning)
        open_study(folder.path)
        study_status(folder.path)
    if "failure" in damage:
        assert open_study(folder.path)["status"].values[-1] == 3
        folder.record_failure(SAMPLES - 1, "timeout", "took long", {})
    run(folder.path)
    same(honest, open_study(folder.path))
    if "lost" not in damage and damage != "part of another sample":
        assert list((folder.path / "damaged").iterdir())


EVERY = (
    "status; fragility --bootstrap 0 --goodness 0; report --no-replay; judge --table bre251; verify; plot; "
    "estimate --category 1 --at 4mm; sensitivity --category 1; replay 0"
)


@pytest.mark.parametrize("what", EVERY.split("; "))
def test_an_edited_study_is_noticed_by_every_command(what: str, folder: StudyFolder, command: Run):  # noqa: F811
    edit("study.toml", b"seed = 7", b"seed = 9")(folder, folder.path)
    name, *options = what.split()
    result = command(name, folder.path, *options)
    assert result.code == 2
    assert "study.toml: is damaged or was edited" in result.out + result.err
    assert "Traceback" not in result.err


def test_exit_codes_of_verify(folder: StudyFolder, command: Run) -> None:  # noqa: F811
    result = command("verify", folder.path, "--samples", 2)
    assert result.code == 0
    assert "solving 2 samples again" in result.out
    file = part(folder)
    columns = read_part(file)
    columns["external_work"].values[0, 1] = np.nextafter(columns["external_work"].values[0, 1], np.inf)
    write_part(file, columns, folder.study_hash)
    folder.results_file.unlink()
    result = command("verify", folder.path, "--samples", 4)
    assert result.code == 3
    assert "solved again differs from the archive in external_work" in result.out
    columns["crack_width_max"].values[0, 0] = -1.0
    write_part(file, columns, folder.study_hash)
    result = command("verify", folder.path)
    assert (result.code, "crack_width_max is negative" in result.out) == (2, True)
    assert command("verify", folder.design_file).code == 0
    assert command("verify", folder.path / "nothing.nc").code == 2
    assert command("verify", folder.design_file, "--samples", 1).code == 2


VALUES: dict[str, tuple[str, Callable[[np.ndarray], object]]] = {
    "a category of 99": ("damage_category", lambda v: v.fill(99)),
    "a status of 9": ("status", lambda v: v.fill(9)),
    "no width": ("crack_width_max", lambda v: v.fill(np.nan)),
    "a width less": ("crack_width_max", lambda v: v[:, -1:].fill(np.nan)),
}


@pytest.mark.parametrize("digest", [True, False], ids=["", "older version"])
@pytest.mark.parametrize("wrong", VALUES)
def test_impossible_values_are_refused(wrong: str, digest: bool, folder: StudyFolder, monkeypatch: pytest.MonkeyPatch):
    file = part(folder)
    columns = read_part(file)
    name, spoil = VALUES[wrong]
    columns[name] = columns[name]._replace(values=columns[name].values.copy())
    spoil(columns[name].values)
    if not digest:
        monkeypatch.setattr("damagepred.archive.parts.SCHEMA_VERSION", 3)
        monkeypatch.setattr("damagepred.archive.parts.signed", lambda content, study: content)
    write_part(file, columns, folder.study_hash)
    with pytest.raises(InputError, match=rf"{file.name}: is damaged"):
        read_part(file, study=folder.study_hash)


def test_versions_mix_only_when_asked_to(done: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = Path(shutil.copytree(done, tmp_path / "study.dp"))
    here = sample.environment() | {"kernel_hash": "new"}
    for where in ("damagepred.campaign.campaign.environment", "damagepred.campaign.sample.environment"):
        monkeypatch.setattr(where, lambda: here)
    before = {file: file.read_bytes() for file in files(folder)}
    with pytest.raises(StudyError, match="kernel hash new; use that program, or mix versions with --mix-ver"):
        run(folder, samples=SAMPLES + 1)
    assert {file: file.read_bytes() for file in files(folder)} == before
    run(folder)  # nothing is left to run
    run(folder, samples=SAMPLES + 1, mix_versions=True)
    assert any("samples were solved by 2 programs" in line for line in study_status(folder).cautions)


@pytest.mark.filterwarnings("ignore::damagepred.errors.ArchiveWarning")
def test_a_file_changed_by_another_program_is_reported(folder: StudyFolder) -> None:
    ds = read_dataset(folder.results_file)
    ds.to_netcdf(folder.path.parent / "mine.nc")
    with pytest.warns(ArchiveWarning, match=r"mine\.nc: was written or changed by another program"):
        open_study(folder.path.parent / "mine.nc")
    for name, value in (("highest_category", "four"), ("scene", "a = ["), ("schema_version", 0), ("span", -1.0)):
        wrong = ds.assign_attrs(highest_category=4)
        wrong.attrs[name] = value
        wrong.to_netcdf(folder.path.parent / "wrong.nc")
        with pytest.raises(InputError, match=r"wrong\.nc"):
            open_study(folder.path.parent / "wrong.nc")
