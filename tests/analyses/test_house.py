"""Analyses of houses: back-analysis by wall, design choices and streets with named walls, limit state."""

from pathlib import Path

import numpy as np
import pytest

from damagepred import InputError, Study, infer, open_study
from damagepred.analyses.design_search import _read
from damagepred.analyses.inference_options import InferenceOptions
from damagepred.analyses.limit_state import Question, margin, study_for_limit_state
from damagepred.analyses.portfolio import read_houses
from damagepred.analyses.stored_walls import StoredWalls, require_on
from damagepred.assembly.bond import lay_bricks
from damagepred.campaign.replay import replay
from damagepred.campaign.sample import sample_of
from damagepred.campaign.settings import StudySettings, read_frozen
from damagepred.plotting import draw_back_analysis
from damagepred.results.house import unfolded_places, wall_dataset
from damagepred.scene.keys import merged
from damagepred.scene.scene import archived_scene
from damagepred.uq import observations
from damagepred.uq.observations import CrackObservation, LevelObservation, Observations, SlopeObservation
from tests.campaign.test_house import HOUSE


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    file = tmp_path_factory.mktemp("houses") / "house.toml"
    file.write_text(HOUSE)
    Study.from_toml(file).run(out := file.with_suffix(".dp"), samples=2)
    return out


def predicted(folder: Path, table: str, seen) -> np.ndarray:
    walls = StoredWalls(folder)
    walls.require(Observations(**{table: (seen,)}))
    return walls._predicted(table, [seen], np.arange(2))[0]


def test_a_crack_of_a_wall_is_the_crack_of_that_wall(folder):
    stored = open_study(folder)["wall_crack_width_max"].values
    for number, name in enumerate(("front", "side")):
        assert np.array_equal(predicted(folder, "crack", CrackObservation(wall=name, width=1e-3)), stored[..., number])
    whole = predicted(folder, "crack", CrackObservation(width="1 mm"))
    assert np.array_equal(whole, open_study(folder)["crack_width_max"].values)
    slope = predicted(folder, "slope", SlopeObservation(wall="side", value=0.01))
    assert np.array_equal(slope, open_study(folder)["wall_slope_max"].values[..., 1])
    window = predicted(folder, "window", observations.WindowObservation(wall="front", opening=1, width_change="1 mm"))
    assert np.array_equal(window, open_study(folder)["opening_width_change"].values[..., 0])


def test_local_cracks_and_levels_are_read_on_their_wall(folder):
    everywhere = {n: CrackObservation(wall=n, x=0.3, y=0.15, within=0.4, width="1 mm") for n in ("front", "side")}
    local = {name: predicted(folder, "crack", crack) for name, crack in everywhere.items()}
    widest = open_study(folder)["wall_crack_width_max"].values
    assert local["front"][:, -1].min() > 5e-5
    assert (local["front"] <= widest[..., 0] * 1.001).all()
    assert (local["side"] <= widest[..., 1] * 1.001).all()
    walls = StoredWalls(folder)
    replayed = walls.replayed(0)
    level = LevelObservation(wall="front", x=0.1, y=0.2, to_wall="side", to_x=0.8, to_y=0.2, difference="20 mm")
    rise = predicted(folder, "level", level)[0]
    front = replayed.block_x < 1.44 + 0.5
    first = np.hypot(replayed.block_x - 0.1, replayed.block_y - 0.2).argmin()
    second = np.hypot(replayed.block_x - (1.44 + 1.0 + 0.8), replayed.block_y - 0.2).argmin()
    assert front[first]
    assert not front[second]
    assert rise == pytest.approx(replayed.rise[:, second] - replayed.rise[:, first])
    assert rise[-1] > 0.005  # the tree is at the front's start


def test_the_posterior_of_a_house_has_a_crack_map_of_its_unfolded_walls(folder):
    seen = [CrackObservation(wall="front", width="4 mm"), CrackObservation(wall="side", none=True, x=0.4, y=0.15)]
    level = LevelObservation(wall="front", x=0.1, y=0.2, to_wall="side", to_x=0.8, to_y=0.2, difference="20 mm")
    narrow = InferenceOptions(map_width=5e-5)
    found = infer(folder, Observations(crack=tuple(seen), level=(level,)), options=narrow)
    assert float(found["posterior"].sum()) == pytest.approx(1.0)
    house = archived_scene({"scene": found["study_scene"].item()})
    places, wider = unfolded_places(house), found["crack_probability"].attrs["wider_than"]
    (left, level_), low = places[1], min(y for _, y in places)
    assert (found["observed_x"].item(), found["observed_y"].item()) == pytest.approx((left + 0.4, level_ + 0.15))
    assert (found["level_to_x"].item(), found["level_y"].item()) == pytest.approx((left + 0.8, 0.2))
    expected: dict[tuple[int, ...], float] = {}
    for sample, weights in enumerate(found["posterior"].values):
        ds, _ = replay(folder, sample)
        cells = set()
        for (left, level_), name in zip(places, house.names):
            one = wall_dataset(ds, name)
            opened = (one["contact_opening"].values > wider) & (one["contact_kind"].values < 2)
            steps, contacts = np.nonzero(opened)
            x, y = one["contact_x"].values[contacts] + left, one["contact_y"].values[contacts] + level_ - low
            cells |= set(zip((y / 0.15).astype(int), (x / 0.15).astype(int), steps))
        for row, column, step in cells:
            expected[row, column] = expected.get((row, column), 0.0) + weights[step]
    crack_map = found["crack_probability"].values[0]
    shown = {(int(i), int(k)): crack_map[i, k] for i, k in zip(*np.nonzero(crack_map))}
    assert len(shown) > 3
    assert {cell: p for cell, p in expected.items() if p > 0} == pytest.approx(shown)


def test_the_crack_map_of_a_house_names_its_walls_and_marks_their_cracks(folder):
    seen = CrackObservation(wall="side", x=0.4, y=0.15, width="1 mm", error="1 mm")
    _, ax = draw_back_analysis(found := infer(folder, Observations(crack=(seen,))))
    house = archived_scene({"scene": found["study_scene"].item()})
    left, level = unfolded_places(house)[1]
    texts = {text.get_text(): text for text in ax.texts}
    assert {"front", "side", "1 mm"} == set(texts)
    assert texts["1 mm"].xy == pytest.approx((left + 0.4, level + 0.15))
    assert texts["side"].xy == pytest.approx((left, level))
    bricks = next(shapes for shapes in ax.collections if shapes.get_label() == "bricks")
    assert len(bricks.get_paths()) == sum(len(lay_bricks(scene)) for scene in house.scenes)


@pytest.mark.parametrize(
    ("crack", "words"),
    [
        (
            {"width": "1 mm", "x": 1, "y": 0.2},
            "crack 1: wall: is missing; the house of house.dp has the walls front, side",
        ),
        ({"width": "1 mm", "wall": "fornt"}, "wall = 'fornt'.*Did you mean 'front'"),
        (
            {"width": "1 mm", "wall": "side", "x": 2.5, "y": 0.2},
            "x = 2.5 m lies off the wall 'side' of house.dp, 0.96 m",
        ),
        ({"width": "1 mm", "wall": "front", "x": 0.7, "y": 0.2}, "lies in opening 1 of the wall 'front'"),
        ({"width": "1 mm", "wall": "front", "x": 1.2, "y": 0.2, "within": 2}, "at most 1 m on a wall of a house"),
    ],
)
def test_wrong_observations_of_a_house_are_refused(folder, crack, words):
    with pytest.raises(InputError, match=words):
        infer(folder, Observations(crack=(CrackObservation(**crack),)))


def test_one_wall_has_no_name(small_study_file):
    scene = StudySettings.from_toml(small_study_file).scene
    with pytest.raises(InputError, match=r"wall = 'front': small.dp has one wall, no name"):
        require_on(Observations(crack=(CrackObservation(wall="front", width="1 mm"),)), scene, "small.dp")


def test_contradictions_are_of_one_wall():
    slope = {"value": 0.001, "error": 1e-5}
    Observations(tilt=(SlopeObservation(wall="a", **slope), SlopeObservation(wall="b", **{**slope, "value": 0.01})))
    Observations(crack=(CrackObservation(wall="a", width="5 mm"), CrackObservation(wall="b", none=True)))
    with pytest.raises(InputError, match="contradict"):
        Observations(crack=(CrackObservation(wall="a", width="5 mm"), CrackObservation(none=True)))


def test_choices_and_rows_change_walls_by_name(tmp_path):
    (tmp_path / "house.toml").write_text(HOUSE.replace('"wall.thickness" = {', '"footing.depth" = {'))
    options = '[[choice.option]]\nname = "thin"\n[[choice.option]]\nname = "thick"\ncost = 2\n'
    (tmp_path / "choices.toml").write_text(
        'study = "house.toml"\n[target]\nat = "30 mm"\ncategory = 2\nprobability = 0.1\n'
        f'[[choice]]\nname = "front"\n{options}scene.wall.front.thickness = "230 mm"\n'
    )
    _, _, names, settings = _read(tmp_path / "choices.toml")
    assert names == ["thin", "thick"]
    assert [[wall.thickness for wall in s.scene.wall] for s in settings] == [[0.11, 0.11], [0.23, 0.11]]
    _, fields = sample_of(settings[1], settings[1].design(), 0, 2)  # the fields of the first choice
    assert len(fields["joint.tensile_strength"]) == 27
    assert read_frozen(settings[1].to_toml()) == settings[1]  # workers read this text
    (tmp_path / "houses.csv").write_text("name;thickness (mm);wall.side.height (m)\nA;200;\nB;;0.45\n")
    _, houses = read_houses(tmp_path / "houses.csv", tmp_path / "house.toml", "site", None)
    walls = [house.settings.scene.wall for house in houses]
    assert [[(w.thickness, w.height) for w in house] for house in walls] == [
        [(0.2, 0.3), (0.2, 0.3)],
        [(0.11, 0.3), (0.11, 0.45)],
    ]
    with pytest.raises(InputError, match=r"wall.bck: there is no such wall; the study has front, side"):
        merged({"wall": [{"name": "front"}, {"name": "side"}]}, {"wall.bck.thickness": 1})


@pytest.mark.parametrize(
    ("change", "header", "words"),
    [
        ("wall.front.thickness = 0.23", "wall.front.thickness", "wall.front.thickness: the study draws wall.thickness"),
        ("wall.1.thickness = 0.23", "wall.1.thickness", "wall.1.thickness: the study draws wall.thickness"),
        ("wall.thickness = 0.23", "thickness", "wall.thickness: the study draws this number"),
        ("wall.side.joint.cohesion = 1e5", "wall.side.joint.cohesion", "the study draws this number for each house"),
        (
            "wall.bck.thickness = 0.23",
            "wall.bck.thickness",
            "wall.bck: there is no such wall; the study has front, side",
        ),
        (
            "wall.front.opening.2.width = 0.48",
            "wall.front.opening.2.width",
            "opening.2: there is no such wall.front.opening; the study has 1",
        ),
        (
            "wall.side.opening.1.width = 0.48",
            "wall.side.opening.1.width",
            "wall.side.opening: the study has none; give one",
        ),
    ],
)
def test_wrong_changes_of_walls_are_refused_by_the_key_that_was_given(change, header, words, tmp_path):
    (tmp_path / "house.toml").write_text(HOUSE)
    (tmp_path / "choices.toml").write_text(
        'study = "house.toml"\n[target]\nat = "30 mm"\ncategory = 2\nprobability = 0.1\n[[choice]]\nname = "front"\n'
        f'[[choice.option]]\nname = "thin"\n[[choice.option]]\nname = "thick"\nscene.{change}\n'
    )
    with pytest.raises(InputError, match=f"option thick: .*{words}"):
        _read(tmp_path / "choices.toml")
    (tmp_path / "houses.csv").write_text(f"name,{header}\nA,{change.split(' = ')[1]}\n")
    with pytest.raises(InputError, match=f"houses.csv, line 2.*{words}"):
        read_houses(tmp_path / "houses.csv", tmp_path / "house.toml", "site", None)


def test_an_option_changes_all_walls_at_once(tmp_path):
    (tmp_path / "house.toml").write_text(HOUSE.replace('"wall.thickness" = {', '"footing.depth" = {'))
    (tmp_path / "choices.toml").write_text(
        'study = "house.toml"\n[target]\nat = "30 mm"\ncategory = 2\nprobability = 0.1\n[[choice]]\nname = "walls"\n'
        '[[choice.option]]\nname = "thick"\nscene.wall.thickness = "230 mm"\nscene.wall.side.height = 0.45\n'
    )
    _, _, _, (settings,) = _read(tmp_path / "choices.toml")
    assert [(w.thickness, w.height) for w in settings.scene.wall] == [(0.23, 0.3), (0.23, 0.45)]


def test_margin_of_a_house_is_of_its_worst_wall(folder):
    settings = StudySettings.from_toml(folder.with_suffix(".toml"))
    question = Question(1, 0.04, reach=1.0)
    limited = study_for_limit_state(settings, question)
    assert limited.scene.mound.surface_movement == 0.04
    found = margin(*sample_of(settings, settings.design(), 0, 2), question)
    assert found.least == found.most <= 0
    moved = (1 + found.least) * 0.04
    ds = open_study(folder).isel(sample=0)
    first = int((ds["damage_category"].values >= 1).argmax())
    assert ds["surface_movement"][first - 1] < moved <= ds["surface_movement"][first]
    assert wall_dataset(ds.expand_dims("sample"), "front").sizes["sample"] == 1
