"""Files that a user names: whatever they are, an answer comes at once, in one sentence."""

import os
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from damagepred.archive.digest import read_signed_json
from damagepred.archive.files import read_dataset
from damagepred.campaign.settings import StudySettings
from damagepred.damage.table import read_table as read_damage_table
from damagepred.errors import LONGEST_MESSAGE, InputError, StudyError
from damagepred.inputs.input_files import LARGEST_DESCRIPTION
from damagepred.scene import Scene
from damagepred.uq.samplers import read_table

READERS: list[Callable[[Path], object]] = [
    Scene.from_toml,
    StudySettings.from_toml,
    read_signed_json,
    read_damage_table,
    read_dataset,
    lambda path: read_table(path, lambda place: "1", ["joint.friction"]),
]


def pipe(folder: Path) -> Path:
    os.mkfifo(folder / "pipe")
    return folder / "pipe"


def circle(folder: Path) -> Path:
    (folder / "a").symlink_to(folder / "b")
    (folder / "b").symlink_to(folder / "a")
    return folder / "a"


def huge(folder: Path) -> Path:
    with (folder / "huge").open("wb") as file:
        file.truncate(2**40)  # sparse: nothing is on the disk
    return folder / "huge"


WRONG: dict[str, Callable[[Path], Path]] = (
    {"pipe": pipe, "circle of links": circle, "huge": huge, "device": lambda folder: Path("/dev/zero")}
    | {"name too long": lambda folder: folder / ("x" * 5000), "NUL in the name": lambda folder: folder / "a\0b"}
    | {"folder": lambda folder: folder, "missing": lambda folder: folder / "missing.toml"}
)


@pytest.mark.skipif(sys.platform == "win32", reason="pipes and links of POSIX")
@pytest.mark.timeout(30)
@pytest.mark.parametrize("reader", READERS, ids=lambda r: getattr(r, "__qualname__", "reader"))
@pytest.mark.parametrize("wrong", WRONG)
def test_what_is_no_file_of_this_kind(wrong: str, reader: Callable[[Path], object], tmp_path: Path) -> None:
    with pytest.raises((InputError, StudyError)) as refused:
        reader(WRONG[wrong](tmp_path))
    assert str(refused.value).count("\n") == 0
    assert len(str(refused.value)) <= LONGEST_MESSAGE


CONTENTS = {
    "not UTF-8": b"\xff\xfe\x00a",
    "binary": bytes(range(256)),
    "deep": b"a = " + b"[" * 100_000 + b"]" * 100_000,
    "forty deep": b"a = " + b"[" * 40 + b"]" * 40,
    "long number": b"a = " + b"9" * 10_000,
    "beyond 64 bits": b"[wall]\nlength = 99999999999999999999",
    "giant text": b'title = "' + b"x" * (LARGEST_DESCRIPTION // 2) + b'"',
    "giant key": b"x" * 100_000 + b" = 1",
    "many keys": b"\n".join(b"k%d = 1" % i for i in range(5000)),
    "a number for a table": b"wall = 5",
    "a number for the scene": b"scene = 5",
    "a list for the scene": b"scene = [1, 2]",
}


@pytest.mark.quick_cases
@pytest.mark.timeout(60)
@pytest.mark.parametrize("content", CONTENTS)
@pytest.mark.parametrize("reader", [Scene.from_toml, StudySettings.from_toml], ids=["scene", "study"])
def test_what_is_no_description(content: str, reader: Callable[[Path], object], tmp_path: Path) -> None:
    file = tmp_path / "f.toml"
    file.write_bytes(CONTENTS[content])
    with pytest.raises(InputError) as refused:
        reader(file)
    assert len(str(refused.value)) <= LONGEST_MESSAGE


def test_a_cell_beyond_what_a_table_may_hold(tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text("joint.friction\n" + '"' + "1" * 200_000 + '"\n', encoding="utf-8")
    with pytest.raises(InputError, match=r"t\.csv"):
        READERS[-1](tmp_path / "t.csv")
