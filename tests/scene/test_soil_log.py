"""From soil log to surface movement: closed forms, site classes, and the mound that follows."""

import numpy as np
import pytest
from scipy.integrate import quad

from damagepred import Scene
from damagepred.errors import InputError
from damagepred.scene import SoilLayer, Suction, surface_movement
from damagepred.scene.assumed import ground_line
from damagepred.study.campaign.site_classes import site_line, surface_movements
from damagepred.study.settings import StudySettings

FOOTED = {"footing": {"width": 0.3, "depth": 0.3}, "movement": {"shape": "mound"}}


def layer(thickness: float, index: float) -> SoilLayer:
    return SoilLayer(thickness=thickness, shrink_swell_index=index)


def test_cracked_clay_under_a_triangle_of_suction() -> None:
    """I_ss du H / 2: the mean of the triangle."""
    found = surface_movement([layer(5, 0.04)], Suction(change=1.2, cracked_share=1), 2.3)
    assert found == pytest.approx(0.04 * 1.2 * 2.3 / 2, rel=1e-14)


def test_uncracked_clay_has_the_restraint_of_its_depth() -> None:
    """The integral of (2 - z/5) (1 - z/H) from 0 to H is H (1 - H/30)."""
    found = surface_movement([layer(5, 0.03)], Suction(change=1.5, cracked_share=0), 3.0)
    assert found == pytest.approx(0.03 * 1.5 * 3.0 * (1 - 3.0 / 30), rel=1e-14)


def test_nothing_strains_below_the_depth_at_which_alpha_is_0() -> None:
    """The integral of (1 - z) (1 - z/2) from 0 to 1 is 5/12."""
    suction = Suction(change=1.0, cracked_share=0, restraint=1, restraint_depth=1)
    assert surface_movement([layer(5, 0.03)], suction, 2.0) == pytest.approx(0.03 * 5 / 12, rel=1e-14)


def test_layers_cut_anywhere_add_up() -> None:
    whole = surface_movement([layer(4, 0.04)], Suction(), 2.3)
    parts = surface_movement([layer(t, 0.04) for t in (0.3, 0.85, 1.0, 1.85)], Suction(), 2.3)
    assert parts == pytest.approx(whole, rel=1e-13)


def test_any_log_is_the_integral() -> None:
    layers, suction, depth = [layer(0.4, 0.01), layer(1.1, 0.06), layer(0.3, 0.0), layer(2, 0.03)], Suction(), 3.0
    bottom = np.cumsum([x.thickness for x in layers])

    def strain(z: float) -> float:
        index = layers[int(np.searchsorted(bottom, z))].shrink_swell_index
        alpha = 1.0 if z < 0.5 * depth else 2.0 - z / 5.0
        return index * alpha * 1.2 * (1.0 - z / depth)

    expected = quad(strain, 0.0, depth, points=[0.4, 1.5, 1.8], limit=200)[0]
    assert surface_movement(layers, suction, depth) == pytest.approx(expected, rel=1e-8)


def test_below_the_log_and_below_the_suction_nothing_moves() -> None:
    shallow = surface_movement([layer(1, 0.04)], Suction(cracked_share=1), 2.0)
    assert shallow == pytest.approx(0.04 * 1.2 * (1 - 0.25), rel=1e-14)
    assert surface_movement([layer(1, 0.0), layer(9, 0.04)], Suction(), 1.0) == 0.0


def test_the_mound_follows_from_the_log() -> None:
    log = [{"thickness": "3 m", "shrink_swell_index": "4 %"}]
    scene = Scene.from_dict({**FOOTED, "soil_layer": log, "mound": {"suction_depth": "2.3 m"}})
    assert scene.mound.surface_movement == pytest.approx(surface_movement([layer(3, 0.04)], Suction(), 2.3))
    assert Scene.from_dict(scene.to_dict()) == scene
    softer = scene.with_values({"soil_layer.0.shrink_swell_index": 0.02})
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
    ],
)
def test_wrong_logs_are_named(tables: dict, words: str) -> None:
    with pytest.raises(InputError, match=words):
        Scene.from_dict(tables)


def test_what_follows_from_the_log_is_not_sampled() -> None:
    log = [{"thickness": "3 m", "shrink_swell_index": "4 %"}]
    with pytest.raises(InputError, match="follows from other keys"):
        Scene.from_dict({**FOOTED, "soil_layer": log}).with_values({"mound.surface_movement": 0.03})


def test_site_classes_have_the_probabilities_of_the_lognormal_index() -> None:
    """y_s is proportional to I_ss, so P(y_s <= 40 mm) is that of the lognormal."""
    from scipy.stats import lognorm

    log = [{"thickness": "3 m", "shrink_swell_index": "4 %"}]
    tables = {
        "scene": {**FOOTED, "soil_layer": log, "mound": {"suction_depth": "2.3 m"}},
        "study": {"samples": 2},
        "variables": {
            "soil_layer.0.shrink_swell_index": {"distribution": "lognormal", "mean": "4 %", "cov": 0.3},
        },
    }
    settings = StudySettings.from_dict(tables, source="study")
    per_index = surface_movement([layer(3, 0.04)], Suction(), 2.3) / 0.04
    sigma = np.sqrt(np.log(1 + 0.3**2))
    expected = lognorm(sigma, scale=0.04 / np.sqrt(1 + 0.3**2)).cdf(0.04 / per_index)
    found = np.array(surface_movements(settings, 1024))
    assert (found <= 0.04).mean() == pytest.approx(expected, abs=0.01)
    assert "probability of each class: M" in site_line(settings.scene, settings)
    assert site_line(settings.scene) == f"soil log: y_s = {1e3 * per_index * 0.04:.0f} mm, site class H2"
    assert site_line(Scene()) is None
