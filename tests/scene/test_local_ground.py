"""Ground that settles or heaves in one place: words, signs, stiffness of the soil, and what is not read."""

from pathlib import Path

import pytest

from damagepred import InputError, Scene, solve
from damagepred.campaign.cost_estimate import site_line
from damagepred.scene.assumed import ground_cautions
from damagepred.uq.intensity import movement_words
from tests.cli.conftest import Run, command

__all__ = ["command"]

WALL = {"wall": {"length": 2.4, "height": 0.6, "block_length": 0.4, "block_height": 0.15}}
TREE = {"shape": "tree", "surface_movement": "25 mm", "reach": 3.0}
SOIL = {"swelling_stiffness": 3.0e6, "shrinking_stiffness": 6.0e6}


def on_ground(kind: str, mound: dict = TREE, **more: object) -> Scene:
    tables = {**WALL, "movement": {"shape": "mound", "kind": kind, "increments": 1}, "mound": mound, "soil": SOIL}
    return Scene.from_dict({**tables, **more})


@pytest.mark.parametrize("kind", ["settle", "heave"])
@pytest.mark.parametrize("mound", [{"shape": "walsh"}, {"shape": "mitchell"}, None])
def test_only_ground_that_moves_in_one_place_settles_or_heaves(kind: str, mound: dict | None) -> None:
    with pytest.raises(InputError, match=rf"movement.kind = '{kind}': goes with .*'tree'.*Take 'dishing' or 'doming'"):
        Scene.from_dict(
            {"movement": {"kind": kind, "shape": "mound"}, "mound": mound} if mound else {"movement": {"kind": kind}}
        )


def test_stages_say_the_side_in_the_words_of_the_movement() -> None:
    stages = [{"kind": k, "surface_movement": 0.025} for k in ("settle", "doming", "dishing", "heave")]
    movement = on_ground("settle", movement={"shape": "mound", "kind": "settle", "stage": stages}).movement
    assert [s.kind for s in movement.stage] == ["settle", "heave", "settle", "heave"]
    assert movement.increments_of_history().load_factors[[10, 20, 30, 40]].tolist() == [1, -1, 1, -1]
    seasons = {"shape": "mound", "kind": "heave", "seasons": {"years": 1, "swing": "10 mm", "swing_cov": 0}}
    found = on_ground("heave", {"shape": "pipe"}, movement=seasons).movement.stage
    assert [s.kind for s in found] == ["heave", "settle"]
    with pytest.raises(InputError, match="settle and heave go with kind"):
        Scene.from_dict({"movement": {"stage": [{"kind": "settle", "central_deflection": 8e-3}]}})


@pytest.mark.parametrize(("position", "bending"), [(0.0, "doming"), (1.2, "dishing"), (2.4, "doming")])
def test_a_tree_bends_the_wall_as_its_place_says(position: float, bending: str) -> None:
    assert on_ground("settle", {**TREE, "position": position, "reach": 1.2}).bending == bending
    other = {"doming": "dishing", "dishing": "doming"}[bending]
    assert on_ground("heave", {**TREE, "position": position, "reach": 1.2}).bending == other


def test_older_words_and_values_that_nothing_reads_are_named(tmp_path: Path) -> None:
    file = tmp_path / "tree.toml"
    file.write_text(
        "[movement]\nshape = 'mound'\nkind = 'dishing'\ncentral_deflection = 0.01\n"
        "[mound]\nshape = 'tree'\nembedment = 0.5\nreach = 3\n[soil]\nshrinking_stiffness = 4e6\n"
    )
    older, unread = ground_cautions(Scene.from_toml(file))
    assert older.startswith("movement.kind = 'dishing' is read as in older files: the ground goes down (tree) on ")
    assert "on soil.swelling_stiffness = 4000 kPa/m; write 'settle', which reads soil.shrinking_stiffness" in older
    assert unread.startswith("mound.embedment, movement.central_deflection, soil.shrinking_stiffness: not read with")
    file.write_text(file.read_text().replace("dishing", "settle").replace("embedment = 0.5\n", ""))
    (unread,) = ground_cautions(Scene.from_toml(file))
    assert unread.startswith("movement.central_deflection: not read with")
    both = (
        "[movement]\nshape = 'mound'\n[mound]\nsuction_depth = 2\n[soil]\n"
        "swelling_stiffness = 5e6\nshrinking_stiffness = 5e6\n"
    )
    file.write_text(both)  # for either kind
    assert ground_cautions(Scene.from_toml(file)) == []
    file.write_text(both.replace("swelling_stiffness = 5e6\n", ""))
    (unread,) = ground_cautions(Scene.from_toml(file))
    assert unread.startswith("soil.shrinking_stiffness: not read with movement.shape = 'mound', kind = 'dishing'")


def test_a_log_gives_a_tree_no_class_and_a_tunnel_nothing() -> None:
    """By hand: 0.04 x 1.2 x (0.8625 + 0.4868) m = 64.8 mm."""
    log = [{"thickness": 5, "shrink_swell_index": 0.04}]
    line = site_line(on_ground("settle", {"shape": "tree", "suction_depth": 2.3}, soil_layer=log))
    assert line == "soil log: ground movement at the tree = 65 mm"
    with pytest.raises(InputError, match="clay gives no movement over a tunnel"):
        on_ground("settle", {"shape": "tunnel", "reach": 3.0}, soil_layer=log)


STUDY = """
[study]
samples = 3
[scene]
wall = { length = 2.4, height = 0.6, block_length = 0.4, block_height = 0.15 }
movement = { shape = "mound", kind = "settle", increments = 2 }
mound = { shape = "tree", surface_movement = "25 mm", reach = 3 }
[variables]
"joint.friction" = { distribution = "normal", mean = 0.75, cov = 0.1 }
"""


@pytest.mark.thorough
def test_a_tree_has_no_site_class(command: Run, tmp_path: Path) -> None:
    file, folder = tmp_path / "tree.toml", tmp_path / "tree.dp"
    file.write_text(STUDY)
    assert command("study", file).code == 0
    refused = command("estimate", folder, "--category", 1, "--at", "M")
    assert refused.code == 2
    assert "at = class M: classes are of the movement y_s of reactive clay, and the ground movement at the tree" in (
        refused.err
    )
    assert command("estimate", folder, "--category", 1, "--at", "25 mm").code == 0
    curves = command("fragility", folder, "-o", tmp_path / "curves.nc", "--plot", tmp_path / "curves.svg")
    assert "ground movement at the tree" in curves.out
    drawn = (tmp_path / "curves.svg").read_text()
    assert "ground movement at the tree (mm)" in drawn
    assert "surface movement" not in drawn
    report = command("report", folder, "--no-replay", "-o", tmp_path / "tree.html")
    page = (tmp_path / "tree.html").read_text()
    assert report.code == 0
    for absent in ("site class", "surface movement of", "swelling stiffness"):
        assert absent not in page, absent
    wall = solve(on_ground("settle"))
    assert movement_words(wall) == "ground movement at the tree"
    # a measure that is asked for goes before the one of the dataset
    assert movement_words(wall.assign_attrs(intensity_measure="curvature"), "deflection_ratio") == "deflection ratio"
    assert movement_words(solve(on_ground("doming", {"shape": "walsh"}))) == "surface movement"
