"""From soil log to surface movement: closed forms, site classes, and the mound that follows."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from damagepred import Footing, InputError, Movement, Scene
from damagepred.campaign.cost_estimate import site_line, surface_movements
from damagepred.campaign.settings import StudySettings
from damagepred.scene import Seasons, SoilLayer, Suction, surface_movement
from damagepred.scene.assumed import assumed_seasons, ground_line

FOOTED = {"footing": {"width": 0.3, "depth": 0.3}, "movement": {"shape": "mound"}}


LOG = [{"thickness": "4 m", "shrink_swell_index": "4 %"}]


def layer(thickness: float, index: float) -> SoilLayer:
    return SoilLayer(thickness=thickness, shrink_swell_index=index)


def test_the_mound_follows_from_the_log() -> None:
    log = [{"thickness": "4 m", "shrink_swell_index": "4 %"}]
    scene = Scene.from_dict({**FOOTED, "soil_layer": log, "mound": {"suction_depth": "2.3 m"}})
    assert scene.mound.surface_movement == pytest.approx(surface_movement([layer(4, 0.04)], Suction(), 2.3))
    assert Scene.from_dict(scene.to_dict()) == scene
    softer = scene.with_values({"soil_layer.1.shrink_swell_index": 0.02})
    assert softer.mound.surface_movement == pytest.approx(0.5 * scene.mound.surface_movement)
    assert "change of suction 1.2 pF" in ground_line(scene)
    assert "change of suction" not in ground_line(scene, ["suction.change"])


@pytest.mark.parametrize(
    ("tables", "words"),
    [
        ({"soil_layer": [{"thickness": 1, "shrink_swell_index": 0.04}]}, "needs movement.shape = 'mound'"),
        ({**FOOTED, "soil_layer": [{"thickness": 0, "shrink_swell_index": 0.04}]}, "thickness"),
        ({**FOOTED, "soil_layer": [{"thickness": 1, "shrink_swell_index": 4}]}, "shrink_swell_index"),
        ({**FOOTED, "suction": {"change": 1.0}}, "only read with"),
        (
            {**FOOTED, "soil_layer": LOG, "mound": {"surface_movement": "30 mm"}},
            "mound.surface_movement = 30 mm: follows",
        ),
        (
            {"movement": {"shape": "mound", "seasons": {}}, "mound": {"surface_movement": "30 mm"}},
            r"mound.surface_movement = 30 mm: follows from \[movement.seasons\]",
        ),
        ({"movement": {"central_deflection": "9 mm", "seasons": {}}}, "movement.central_deflection = 9 mm: follows"),
        ({**FOOTED, "soil_layer": [{**LOG[0], "name": "2"}]}, "must be one word"),
        ({**FOOTED, "soil_layer": [{**LOG[0], "name": "my clay"}]}, "must be one word"),
        ({**FOOTED, "soil_layer": [{**LOG[0], "name": "thickness"}]}, "must be one word"),
        ({**FOOTED, "soil_layer": [{**LOG[0], "name": "clay"}] * 2}, "two layers have the name 'clay'"),
        ({**FOOTED, "soil_layer": [{**LOG[0], "name": "2a"}, LOG[0]]}, "must be one word"),
        ({**FOOTED, "soil_layer": LOG, "suction": {"climate_zone": 7}}, "climate_zone = 7: must be at most 6"),
        (
            {"movement": {"shape": "mound", "stage": [{"surface_movement": 0.04}]}, "soil_layer": LOG},
            "seasons in place of stages",
        ),
    ],
)
def test_wrong_logs_are_named(tables: dict, words: str) -> None:
    with pytest.raises(InputError, match=words):
        Scene.from_dict(tables)


SHORT = [{"thickness": "0.5 m", "shrink_swell_index": "4 %"}, {"thickness": "1 m", "shrink_swell_index": "4 %"}]
DEEP = {**FOOTED, "mound": {"suction_depth": "3 m"}}


def test_a_log_that_ends_above_the_suction_depth_is_refused_or_goes_on_as_asked() -> None:
    """By hand: 0.04 x 1.2 x (1.5 - 1.5^2/6) = 54 mm; below, 0.048 x integral of (2 - z/5)(1 - z/3) = 28.8 mm."""
    with pytest.raises(InputError) as refused:
        Scene.from_dict({**DEEP, "soil_layer": SHORT})
    for words in (
        "log ends at 1.5 m",
        "suction changes to 3 m",
        "54 mm if nothing",
        "82.8 mm if its last",
        "below_log",
    ):
        assert words in str(refused.value)
    for below, y_s, words in (("inert", 0.054, "nothing moves"), ("extend", 0.0828, "the last layer goes on")):
        scene = Scene.from_dict({**DEEP, "soil_layer": SHORT, "suction": {"below_log": below}})
        assert scene.mound.surface_movement == pytest.approx(y_s, rel=1e-12)
        assert f"; below the log, from 1.5 to 3 m, {words}" in site_line(scene)
        assert Scene.from_dict(scene.to_dict()) == scene
    rock = [*SHORT, {"thickness": "0.1 m", "shrink_swell_index": 0}]
    assert "below the log" not in site_line(Scene.from_dict({**DEEP, "soil_layer": rock}))
    with pytest.raises(InputError, match="log ends at"):
        surface_movement([layer(1.5, 0.04)], Suction(), 3.0)


def test_a_sampled_log_is_refused_where_it_ends_early() -> None:
    depth = {"distribution": "uniform", "lower": 3.5, "upper": 4.5}
    with pytest.raises(InputError, match=r"variables.\"mound.suction_depth\".*log ends at 4 m.*to 4.5 m"):
        StudySettings.from_dict({"scene": {**FOOTED, "soil_layer": LOG}, "variables": {"mound.suction_depth": depth}})


TWO = [{"thickness": 1, "shrink_swell_index": 0.01}, {"thickness": 5, "shrink_swell_index": 0.04, "name": "clay"}]


def index(mean: float) -> dict:
    return {"distribution": "normal", "mean": mean, "cov": 0.1, "source": "test"}


@pytest.mark.parametrize(
    ("place", "words"),
    [
        ("soil_layer.0.shrink_swell_index", "soil_layer '0'; numbers count from 1, here to 2; names are clay"),
        ("soil_layer.3.shrink_swell_index", "soil_layer '3'; numbers count from 1, here to 2"),
        ("soil_layer.clya.shrink_swell_index", "Did you mean 'clay'?"),
        ("soil_layer.clay.index", "no such number"),
    ],
)
def test_wrong_layers_are_named(place: str, words: str) -> None:
    with pytest.raises(InputError) as refused:
        StudySettings.from_dict({"scene": {**FOOTED, "soil_layer": TWO}, "variables": {place: index(0.04)}})
    assert str(refused.value).startswith(f'study: [variables."{place}"]: ')
    assert words in str(refused.value)


def test_one_number_named_twice_is_refused() -> None:
    both = {f"soil_layer.{step}.shrink_swell_index": index(0.04) for step in ("2", "clay")}
    with pytest.raises(InputError, match="is the same number as"):
        StudySettings.from_dict({"scene": {**FOOTED, "soil_layer": TWO}, "variables": both})


def test_each_mean_that_is_not_the_scenes_value_is_named() -> None:
    variables = {
        "joint.friction": {"distribution": "normal", "mean": 0.5, "cov": 0.1},
        "joint.cohesion": {"distribution": "lognormal", "mean": "0.375 MPa", "cov": 0.5},
        "joint.tensile_strength": {"distribution": "lognormal", "median": "0.453 MPa", "dispersion": 0.5},
        "block.density": {"distribution": "uniform", "lower": 1800, "upper": 2000},
    }
    settings = StudySettings.from_dict({"scene": {}, "variables": variables})
    assert settings.other_means() == [
        "variable joint.friction: mean 0.5, the scene has 0.75; samples follow the variable",
        "variable block.density: mean 1900 kg/m³, the scene has 2000 kg/m³; samples follow the variable",
    ]


def test_the_climatic_zone_gives_depth_and_change_of_suction_where_they_are_not_given() -> None:
    scene = Scene.from_dict({**FOOTED, "soil_layer": LOG, "suction": {"climate_zone": 3}})
    assert (scene.mound.suction_depth, scene.suction.change) == (2.3, 1.2)
    assert scene.mound.surface_movement == surface_movement([layer(4, 0.04)], Suction(change=1.2), 2.3)
    assert "H_s of climatic zone 3 (secondary)" in ground_line(scene)
    assert "change of suction 1.2 pF" in ground_line(scene)
    assert Scene.from_dict(scene.to_dict()) == scene
    own = {"suction": {"climate_zone": 3, "change": 1.5}, "mound": {"suction_depth": 3.0}}
    scene = Scene.from_dict({**FOOTED, "soil_layer": LOG, **own})
    assert (scene.mound.suction_depth, scene.suction.change) == (3.0, 1.5)
    assert "climatic zone" not in ground_line(scene)
    suction = Suction(climate_zone=2)
    footing = Footing(width=0.3, depth=0.3)
    soil_layer = (layer(4, 0.04),)
    objects = Scene(soil_layer=soil_layer, suction=suction, movement=Movement(shape="mound"), footing=footing)
    assert objects.mound.suction_depth == 1.8


def test_the_log_gives_the_size_of_the_seasons() -> None:
    """The mean swing is a share of y_s, and the mound's movement the largest of the history."""
    seasons = {"years": 2, "swing_cov": 0, "swing_share": 0.5, "trend": "4 mm"}
    movement = {"shape": "mound", "seasons": seasons}
    scene = Scene.from_dict({**FOOTED, "movement": movement, "soil_layer": LOG, "mound": {"suction_depth": 2.3}})
    y_s = surface_movement([layer(4, 0.04)], Suction(), 2.3)
    assert scene.movement.seasons.swing == pytest.approx(0.5 * y_s)
    assert scene.mound.surface_movement == pytest.approx(0.25 * y_s + 3e-3)  # after 1.5 of 2 years
    assert site_line(scene) == f"soil log: y_s = {1e3 * y_s:.0f} mm, site class H2"
    assert Scene.from_dict(scene.to_dict()) == scene
    softer = scene.with_values({"soil_layer.1.shrink_swell_index": 0.02})
    assert softer.movement.seasons.swing == pytest.approx(0.25 * y_s)
    assert softer.with_seed(1, 2).movement.seasons.swing == softer.movement.seasons.swing
    with pytest.raises(InputError, match="follows from other keys"):
        scene.with_values({"movement.seasons.swing": 0.03})
    assert "a mean swing of 0.6 y_s" in assumed_seasons(
        replace(scene, movement=Movement(shape="mound", seasons=Seasons()))
    )


def test_a_swing_beside_a_log_is_refused(tmp_path: Path) -> None:
    (tmp_path / "wall.toml").write_text(
        "[movement]\nshape = 'mound'\n[movement.seasons]\nswing = 0.02\n"
        "[[soil_layer]]\nthickness = 4\nshrink_swell_index = 0.04\n"
    )
    with pytest.raises(InputError, match=r"follows from .*soil_layer.*; give swing_share"):
        Scene.from_toml(tmp_path / "wall.toml")


def test_site_classes_have_the_probabilities_of_the_lognormal_index() -> None:
    """y_s is proportional to I_ss, so P(y_s <= 40 mm) is that of the lognormal."""
    from scipy.stats import lognorm

    log = [{"thickness": "4 m", "shrink_swell_index": "4 %"}]
    tables = {
        "scene": {**FOOTED, "soil_layer": log, "mound": {"suction_depth": "2.3 m"}},
        "study": {"samples": 2},
        "variables": {"soil_layer.1.shrink_swell_index": {"distribution": "lognormal", "mean": "4 %", "cov": 0.3}},
    }
    settings = StudySettings.from_dict(tables, source="study")
    per_index = surface_movement([layer(4, 0.04)], Suction(), 2.3) / 0.04
    sigma = np.sqrt(np.log(1 + 0.3**2))
    expected = lognorm(sigma, scale=0.04 / np.sqrt(1 + 0.3**2)).cdf(0.04 / per_index)
    found = np.array(surface_movements(settings, 1024))
    assert (found <= 0.04).mean() == pytest.approx(expected, abs=0.01)
    assert "probability of each class: M" in site_line(settings.scene, settings)
    assert site_line(settings.scene) == f"soil log: y_s = {1e3 * per_index * 0.04:.0f} mm, site class H2"
    assert site_line(Scene()) is None
