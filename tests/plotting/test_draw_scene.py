"""A scene is drawn before any run: bricks, openings, and the ground before and after its movement."""

from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes

from damagepred.plotting import draw_scene
from damagepred.plotting.pictures import save_scene_picture
from damagepred.scene import Scene

WALL = {"length": "4 m", "height": "1.2 m", "block_length": "0.5 m", "block_height": "0.2 m"}
WINDOW = {"kind": "window", "x": 1.5, "y": 0.4, "width": 1.0, "height": 0.4}
TREE = {
    "movement": {"shape": "mound", "kind": "settle"},
    "mound": {"shape": "tree", "surface_movement": 0.02, "reach": 2},
}


def drawn(**tables: Any) -> Axes:
    return draw_scene(Scene.from_dict({"wall": WALL, **tables}))


def line(ax: Axes, label: str) -> np.ndarray:
    (found,) = (one for one in ax.lines if one.get_label() == label)
    return np.column_stack((found.get_xdata(), found.get_ydata()))


def test_the_ground_is_drawn_under_the_footing_before_and_after() -> None:
    ax = drawn(**TREE)
    assert line(ax, "ground before").tolist() == [[0.0, -0.3], [4.0, -0.3]]
    after = line(ax, "ground after")
    # 4.5 % of 4 m over 20 mm is 9; of 8 and 10 the latter is nearer by its ratio
    assert "movement of the ground exaggerated 10 times" in ax.get_title(loc="left")
    x = after[:, 0]
    assert after[:, 1] == pytest.approx(-0.3 - 10.0 * 0.02 * np.maximum(1.0 - x / 2.0, 0.0) ** 2)
    assert [text.get_text() for text in ax.texts if "mm" in text.get_text()] == ["\u221220 mm"]
    assert "left end of the ground goes down by 20 mm, to nothing in the middle" in " ".join(
        ax.get_title(loc="left").split()
    )


def test_still_ground_has_one_line(tmp_path: Any) -> None:
    described = Scene.from_dict({"wall": WALL, "movement": {"central_deflection": 0.0}})
    ax = draw_scene(described)
    assert [one.get_label() for one in ax.lines] == ["ground before"]
    assert save_scene_picture(described, tmp_path / "new").name == "scene.png"
    assert save_scene_picture(described, tmp_path / "house.svg").read_text(encoding="utf-8").startswith("<?xml")


def test_loads_are_drawn_where_they_act_with_their_size() -> None:
    loads = [
        {"name": "floor", "line_load": 2e3, "y": 0.8},
        {"name": "people", "kind": "live", "line_load": 1e3, "combination": 0.5, "end": 2.0},
        {"force": 3e3, "at": 3.0},
    ]
    ax = drawn(load=loads, **TREE)
    places = {text.get_text(): text.get_position() for text in ax.texts if "kN" in text.get_text()}
    assert set(places) == {"floor 8 kN", "people 1 kN, live", "load 3 3 kN"}
    assert places["floor 8 kN"][0] == pytest.approx(2.0)
    assert 0.8 < places["floor 8 kN"][1] < 1.2 < places["people 1 kN, live"][1]
    assert places["people 1 kN, live"][0] == pytest.approx(1.0)
    assert places["load 3 3 kN"][0] == pytest.approx(3.0)
