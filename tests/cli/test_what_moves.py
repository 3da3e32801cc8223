"""What moves: check and new say it first."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.conftest import Run

SCENE = """
title = "small"
wall = { length = 2.0, height = 0.6, block_length = 0.5, block_height = 0.2 }
movement = { kind = "doming", central_deflection = "1 mm", increments = 1 }
"""
SAID = [
    "small: valid; wall 2 m long, 0.6 m high, openings: 0, no dpc",
    "  The middle of the ground goes up by 1 mm, to nothing at both ends",
    "  one wall, all numbers as given",
]


def test_check_says_wall_movement_variables_and_cost_in_four_lines(command: Run, tmp_path: Path) -> None:
    (tmp_path / "wall.toml").write_text(SCENE)
    lines = command("check", tmp_path / "wall.toml").out.splitlines()
    assert lines[:3] == SAID
    assert len(lines) == 4
    assert lines[3].startswith("  one wall: ")
    full = command("check", tmp_path / "wall.toml", "--full").out
    assert "  solver: quasi_static" in full
    assert "accuracy = " in full


def test_new_ends_with_the_movement_of_its_file(command: Run, tmp_path: Path) -> None:
    result = command("new", tmp_path / "house.toml", "--template", "mound")
    words = "Both ends of the ground go up by 30 mm, to nothing at 1.8 and 7.2 m; swelling clay, 4000 kPa/m"
    assert words in " ".join(f"{result.out} {result.err}".split())


@pytest.mark.parametrize(("given", "file"), [("pictures", "pictures/scene.png"), ("house.svg", "house.svg")])
def test_check_draws_into_a_folder_or_a_file(command: Run, tmp_path: Path, given: str, file: str) -> None:
    (tmp_path / "wall.toml").write_text(SCENE)
    result = command("check", tmp_path / "wall.toml", "--plot", tmp_path / given)
    assert result.code == 0, result.err
    assert (tmp_path / file).stat().st_size > 1000
    assert f"drew {tmp_path / file}" in result.out


def test_check_refuses_another_ending_of_the_picture_before_it_solves(command: Run, tmp_path: Path) -> None:
    (tmp_path / "wall.toml").write_text(SCENE)
    refused = command("check", tmp_path / "wall.toml", "--plot", tmp_path / "wall.csv")
    assert refused.code == 2
    assert ".png" in refused.err
