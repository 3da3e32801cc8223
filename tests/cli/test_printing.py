"""Results are kept whatever becomes of what is printed, and no text of a user is run by what reads it."""

import subprocess
import sys
import unicodedata
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from damagepred.archive.files import read_dataset, write_dataset
from damagepred.archive.schema import SCHEMA_VERSION, name_categories
from damagepred.cli import terminal
from damagepred.damage.table import read_table
from damagepred.errors import InputError
from damagepred.inputs.data_files import data_file

SCENE = """
title = "TITLE"
wall = { length = 0.72, height = 0.3 }
movement = { central_deflection = "0.2 mm", increments = 2 }
"""


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    file = tmp_path / "small.toml"
    file.write_text(SCENE, encoding="utf-8")
    return file


def shell(command: str, folder: Path) -> subprocess.CompletedProcess[str]:
    program = f"{sys.executable} -m damagepred"
    return subprocess.run(
        ["bash", "-c", command.replace("damagepred", program, 1)],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.thorough
@pytest.mark.parametrize("title", ["[/] [bold]x $x_{$ a & <b>", "=1+1 100 % \\\\frac"])
def test_titles_are_shown_as_they_are(title: str, scene: Path, tmp_path: Path) -> None:
    scene.write_text(SCENE.replace("TITLE", title), encoding="utf-8")
    done = shell("damagepred solve small.toml -o x.nc --plot pictures", tmp_path)
    assert done.returncode == 0, done.stderr
    assert title.replace("\\\\", "\\") in done.stdout


def test_control_characters_reach_no_terminal(capsys: pytest.CaptureFixture[str]) -> None:
    terminal.say("a\x1b[2Jb\nc")
    terminal.table("\x1b]0;t\x07", ["[red]\x9b"], [["[/]\x1b"]])
    said = capsys.readouterr().out
    assert r"a\x1b[2Jb" in said
    assert r"[/]\x1b" in said
    assert all(c.isprintable() or c == "\n" for c in said)


@pytest.mark.parametrize("name", ["=cmd()", "[/]", "$x$", "two\\nlines", ""])
def test_names_of_categories_are_plain(name: str, tmp_path: Path) -> None:
    text = data_file("damage", "as2870.toml").read_text(encoding="utf-8")
    (tmp_path / "own.toml").write_text(text.replace('"negligible"', f'"{name}"', 1), encoding="utf-8")
    with pytest.raises(InputError, match="category name"):
        read_table(tmp_path / "own.toml")


@pytest.mark.parametrize("name", ["mäßig", "très léger 2", "中等", "сильно", "हल्की", "schwer O\u0308"])
def test_names_of_categories_have_letters_of_any_script(name: str, tmp_path: Path) -> None:
    text = data_file("damage", "as2870.toml").read_text(encoding="utf-8")
    (tmp_path / "öwn tafel.toml").write_text(text.replace('"slight"', f'"{name}"', 1), encoding="utf-8")
    table = read_table(tmp_path / "öwn tafel.toml")
    assert table.category_names[2] == unicodedata.normalize("NFC", name)
    ds = xr.Dataset({"damage_category": ("sample", np.array([0, 2], np.int8))})
    name_categories(ds, table.category_names, "own")
    write_dataset(ds.assign_attrs(schema_version=SCHEMA_VERSION), tmp_path / "wänd 1.nc")
    again = read_dataset(tmp_path / "wänd 1.nc")
    assert again.damagepred.category(table.category_names[2]) == 2
    assert len(again["damage_category"].attrs["flag_meanings"].split()) == 5
