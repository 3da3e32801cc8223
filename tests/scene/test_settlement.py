"""Settlement of the ground: forms and measures against hand calculation, files, and refusals."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from damagepred import InputError, Movement, Scene, Wall
from damagepred.results.simple_assessment import angular_distortion, simple_methods
from damagepred.scene.what_moves import what_moves

X = np.linspace(0.0, 6.0, 601)


def scene(**movement: Any) -> Scene:
    return Scene.from_dict({"wall": {"length": "6 m", "height": "2.4 m"}, "movement": movement})


def from_file(folder: Path, lines: str, **movement: Any) -> Scene:
    (folder / "survey.csv").write_text(lines, encoding="utf-8")
    tables = {"wall": {"length": "6 m"}, "movement": {"shape": "table", "table": "survey.csv", **movement}}
    return Scene.from_file_tables(tables, folder, "wall.toml")


@pytest.mark.parametrize(
    ("movement", "points"),
    [
        ({"shape": "settle"}, {0.0: -20, 1.5: -10, 3.0: 0, 6.0: 0}),
        ({"shape": "settle", "end": "right", "reach": "2 m"}, {6.0: -20, 5.0: -10, 4.0: 0, 0.0: 0}),
        ({"shape": "settle", "position": "2 m", "reach": "1 m"}, {2.0: -20, 1.5: -10, 2.5: -10, 3.0: 0}),
        ({"shape": "tilt", "kind": "heave"}, {0.0: 20, 3.0: 10, 6.0: 0}),
        ({"shape": "step", "position": "2 m"}, {0.0: -20, 1.99: -20, 2.01: 0, 6.0: 0}),
        ({"shape": "step", "end": "right"}, {0.0: 0, 2.99: 0, 3.01: -20}),
        ({"shape": "trough", "trough_width": "1 m"}, {3.0: -20, 4.0: -20 * math.exp(-0.5), 1.0: -20 * math.exp(-2)}),
        ({"shape": "trough", "tunnel_depth": "2 m", "position": 0.0}, {0.0: -20, 1.0: -20 * math.exp(-0.5)}),
        ({"shape": "table", "table": [[0, -1], [0.5, 0], [1, 1]]}, {0.0: -20, 3.0: 0, 6.0: 20}),
        ({"shape": "table", "table": [[0, 1], [1, -1]], "settlement_is": "range"}, {0.0: -10, 6.0: 10}),
        ({"shape": "settle", "settlement_is": "range"}, {0.0: -20, 6.0: 0}),
        ({"shape": "step", "position": "4 m", "settlement_is": "relative"}, {0.0: -30, 6.0: 0}),  # 2/3 off the chord
    ],
)
def test_profiles(movement: dict[str, Any], points: dict[float, float]):
    wall = scene(settlement="20 mm", **movement)
    rise = wall.ground_rise(np.array(list(points)))
    np.testing.assert_allclose(1e3 * rise, list(points.values()), atol=0.02)
    assert Scene.from_dict(wall.to_dict()) == wall


def test_measures_by_hand():
    tilt = scene(shape="tilt", settlement="12 mm").movement.measures(Wall())
    assert tilt["ground_tilt"] == pytest.approx(0.002)
    assert [tilt[n] for n in ("angular_distortion", "deflection_ratio", "central_deflection")] == [0.0, 0.0, 0.0]
    step = scene(shape="step", settlement="24 mm").movement.measures(Wall())
    assert step["angular_distortion"] == pytest.approx(0.1 - 0.004, rel=0.02)  # over one brick, less the tilt
    assert step["deflection_ratio"] == pytest.approx(0.012 / 6.0, rel=0.01)
    s_shape = scene(shape="table", settlement="10 mm", table=[[0, 0], [0.25, 1], [0.5, 0], [0.75, -1], [1, 0]])
    measured = s_shape.movement.measures(Wall())
    assert measured["differential_settlement"] == pytest.approx(0.02)
    assert measured["deflection_ratio"] == pytest.approx(0.01 / 6.0)
    assert measured["central_deflection"] == 0.0


def test_trough_by_volume_loss_and_its_horizontal_strain():
    """S = V_l pi D^2 / 4 / (sqrt(2 pi) i); the strain along the wall is S / z_0 over the axis, compression."""
    movement = scene(
        shape="trough", trough_width="3 m", tunnel_depth="8 m", volume_loss=0.02, tunnel_diameter="4 m"
    ).movement
    size = 0.02 * math.pi * 4.0 / (math.sqrt(2 * math.pi) * 3.0)
    assert movement.size == pytest.approx(size, rel=1e-12)
    shift = movement.horizontal_profile(X, 6.0)
    assert shift[0] > 0 > shift[-1]  # towards the axis
    assert np.gradient(shift, X)[300] == pytest.approx(-size / 8.0, rel=1e-3)
    assert movement.measures(Wall())["horizontal_strain"] == pytest.approx(size / 8.0, rel=1e-2)
    x = np.linspace(0.0, 60.0, 6001)  # steepest where it bends the other way, 3 m from the middle
    steepest = x[np.abs(np.gradient(movement.profile(x, 60.0), x)).argmax()]
    assert abs(steepest - 30.0) == pytest.approx(3.0, abs=0.011)


def test_a_sampled_volume_loss_moves_the_ground():
    wall = scene(shape="trough", trough_width="3 m", volume_loss=0.01, tunnel_diameter="4 m")
    more = wall.with_values({"movement.volume_loss": 0.02})
    assert more.movement.size == pytest.approx(2 * wall.movement.size)


def test_a_survey_with_displacements_along_the_wall(tmp_path: Path):
    movement = from_file(tmp_path, "x (m),level (mm),move (mm)\n0,-6,0\n3,0,2\n6,6,-1\n").movement
    along = movement.horizontal_profile(np.array([0.0, 3.0, 6.0]), 6.0)
    np.testing.assert_allclose(along, [0.0, 2e-3, -1e-3], atol=1e-12)
    with pytest.raises(InputError, match="column 4: 'more' is unknown; the columns may be"):
        from_file(tmp_path, "x (m),level (mm),move (mm),more\n0,-6,0,1\n6,6,1,1\n")


def test_survey_errors_are_drawn_for_each_sample():
    wall = scene(shape="table", settlement="10 mm", table=[[x, x] for x in np.linspace(0, 1, 101)], survey_error="2 mm")
    exact, at = wall.ground_rise(X[::6]), X[::6]
    np.testing.assert_allclose(exact, -0.01 * at / 6.0, atol=1e-12)
    drawn = [wall.with_seed(7, sample).ground_rise(at) for sample in range(20)]
    assert np.array_equal(drawn[3], wall.with_seed(7, 3).ground_rise(at))
    errors = np.array(drawn) - exact
    assert errors.std() == pytest.approx(2e-3, rel=0.1)
    assert abs(errors.mean()) < 3 * 2e-3 / math.sqrt(errors.size)


def test_a_function_with_displacements():
    movement = Movement.from_function(lambda x: -(x**2), horizontal=lambda x: 0.5 * x, settlement="8 mm")
    ends = np.array([0.0, 5.0])
    np.testing.assert_allclose(movement.profile(ends, 5.0), [0.0, -8e-3], atol=1e-15)
    np.testing.assert_allclose(movement.horizontal_profile(ends, 5.0), [0.0, 4e-3], atol=1e-15)


def test_histories_go_both_ways():
    stages = [{"settlement": "10 mm"}, {"kind": "heave", "settlement": "4 mm"}]
    movement = scene(shape="settle", stage=stages).movement
    history = movement.increments_of_history()
    assert movement.settlement == 0.01
    assert history.load_factors[[10, 20]].tolist() == [1.0, -0.4]
    wall = scene(shape="settle", stage=stages).with_values({"movement.settlement": 0.02})
    assert [s.settlement for s in wall.movement.stage] == [0.02, 0.008]
    swinging = scene(shape="tilt", seasons={"years": 2, "swing": "10 mm", "swing_cov": 0.0}).movement
    assert swinging.settlement == pytest.approx(5e-3)


@pytest.mark.parametrize(
    ("movement", "words"),
    [
        ({"shape": "settle"}, "left end of the ground goes down by 25 mm, to nothing in the middle"),
        ({"shape": "tilt", "end": "right"}, "right end of the ground goes down by 25 mm, to nothing at the left end"),
        ({"shape": "step", "kind": "heave"}, "ground left of 3 m goes up by 25 mm in one step, the other part stays"),
        ({"shape": "trough", "trough_width": "1 m"}, "down by 25 mm, .*also moves along the wall, by up to 7.58 mm"),
        ({"shape": "table", "table": [[0, -1], [0.5, 0], [1, 1]]}, "to nothing in the middle; it goes up by 25 mm"),
    ],
)
def test_sentences(movement: dict[str, Any], words: str):
    import re

    assert re.search(words, what_moves(scene(settlement="25 mm", **movement)))


@pytest.mark.parametrize(
    ("movement", "words"),
    [
        ({"shape": "tilt"}, "settlement: is missing; shape = 'tilt' needs its size, such as '25 mm'"),
        ({"shape": "tilt", "settlement": "5 mm", "reach": "1 m"}, "reach: only read with shape = 'settle'"),
        ({"shape": "tilt", "settlement": "5 mm", "central_deflection": "5 mm"}, "leave out one of both"),
        ({"shape": "parabola", "settlement": "5 mm"}, "takes central_deflection"),
        ({"shape": "mound", "settlement": "5 mm"}, "takes surface_movement in .mound."),
        ({"shape": "trough", "settlement": "5 mm"}, "trough_width: is missing"),
        ({"shape": "trough", "settlement": "5 mm", "trough_width": 1.0, "position": 40.0}, "does not reach the wall"),
        ({"shape": "trough", "trough_width": 1.0, "volume_loss": 0.01}, "goes with tunnel_diameter"),
        ({"shape": "settle", "settlement": "5 mm", "kind": "sagging"}, "take one of these, or leave kind out"),
        ({"shape": "settle", "settlement": "5"}, "settlement = 5 m: more than a tenth .* Did you mean '5 mm'"),
        ({"shape": "tilt", "settlement": "5 mm", "settlement_is": "relative"}, "a tilt is a straight line"),
        ({"shape": "table", "settlement": 0.01, "table": [[0, 0], [1, 0]]}, "nothing moves"),
        ({"shape": "settle", "settlement": 0.01, "end": "left", "position": 1.0}, "end: is not read with position"),
        ({"shape": "table", "table": [[0, 0], [0.5, 1], [1, 0]], "settlement_is": "range"}, "missing its settlement"),
    ],
)
def test_refusals(movement: dict[str, Any], words: str):
    with pytest.raises(InputError, match=words):
        scene(**movement)


def test_simple_methods_take_the_measures_of_the_profile():
    tilt, step = (scene(shape=shape, settlement="25 mm") for shape in ("tilt", "step"))
    assert angular_distortion(tilt) == 0.0
    assert not simple_methods(tilt)["exceeded"].any()
    assert angular_distortion(step) == pytest.approx(0.1, rel=0.02)
    assert simple_methods(step)["exceeded"].any()
